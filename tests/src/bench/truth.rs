//! What a picture of the truth costs, and what each metric costs.

use anyhow::Result;
use forest_eval::{Comparison, Frame, held_out_views};
use forest_raster::{Light, Picture, RayScene, Sampling, Style, Surfaces, rasterize};
use forest_soup::TriangleSoup;
use std::time::Instant;

/// Pixels along a side.
pub(crate) const SIDE: u32 = 512;

/// Seconds of a picture of [`SIDE`]² pixels with 64 samples each.
pub(crate) struct Truths {
    pub(crate) scanlines: f64,
    pub(crate) hierarchy: f64,
    pub(crate) rays: f64,
    /// With a sun and a sky, both with shadows.
    pub(crate) lit: f64,
    /// Share of the picture that the tree covers.
    pub(crate) coverage: f64,
}

/// Medians of three runs, one for the rays.
pub(crate) fn truths(soup: &TriangleSoup) -> Result<Truths> {
    let surfaces = Surfaces::new(&soup.materials, &soup.textures);
    let frame = frame(soup)?;
    let view = held_out_views(3)[1];
    let camera = frame.camera(&view, f64::from(SIDE) * frame.height / (2.0 * frame.radius), SIDE);
    let style = Style::default();
    let (scanlines, picture) = timed(3, || rasterize(soup, &surfaces, &camera, &style));
    let (hierarchy, scene) = timed(3, || RayScene::new(soup, &surfaces));
    let (rays, _) = timed(1, || scene.picture(&camera, &style));
    let lit_style = Style { light: Light::MORNING, ..style };
    let (lit, _) = timed(1, || scene.picture(&camera, &lit_style));
    Ok(Truths { scanlines, hierarchy, rays, lit, coverage: picture.mean_coverage() })
}

/// Milliseconds of metrics on the box of two pictures of a tree.
pub(crate) struct Metrics {
    pub(crate) flip: f64,
    pub(crate) ssim: f64,
    /// All others: RMSE, coverage, silhouette, depth.
    pub(crate) rest: f64,
    /// Pixels of the box.
    pub(crate) size: [u32; 2],
}

/// Medians of five runs.
pub(crate) fn metrics(soup: &TriangleSoup) -> Result<Metrics> {
    let surfaces = Surfaces::new(&soup.materials, &soup.textures);
    let frame = frame(soup)?;
    let view = held_out_views(3)[1];
    let camera = frame.camera(&view, f64::from(SIDE), frame.side(f64::from(SIDE), 1));
    let draw = |seed: u32| -> Picture {
        let style = Style { sampling: Sampling { side: 2, seed }, light: Light::Albedo };
        rasterize(soup, &surfaces, &camera, &style)
    };
    let comparison = Comparison::new(&draw(1), &draw(2));
    let grey = forest_eval::BACKGROUND;
    let (flip, _) = timed(5, || comparison.flip(grey).mean());
    let (ssim, _) = timed(5, || comparison.ssim(grey));
    let (rest, _) = timed(5, || comparison.pixel_errors(1.0));
    let (truth, _) = comparison.pictures();
    let size = [truth.width, truth.height];
    Ok(Metrics { flip: 1e3 * flip, ssim: 1e3 * ssim, rest: 1e3 * rest, size })
}

fn frame(soup: &TriangleSoup) -> Result<Frame> {
    Frame::of(soup).ok_or_else(|| anyhow::anyhow!("a soup without extent"))
}

/// Median seconds of `runs` runs, and the last result.
fn timed<T>(runs: usize, mut run: impl FnMut() -> T) -> (f64, T) {
    let mut once = || {
        let start = Instant::now();
        let result = run();
        (start.elapsed().as_secs_f64(), result)
    };
    let mut all: Vec<(f64, T)> = (0..runs).map(|_| once()).collect();
    let mut seconds: Vec<f64> = all.iter().map(|r| r.0).collect();
    seconds.sort_by(f64::total_cmp);
    let last = all.pop().expect("at least one run");
    (seconds[runs / 2], last.1)
}
