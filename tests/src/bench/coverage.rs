//! Does the crown thin out or fatten? Coverage of cuts against that of their source.

use anyhow::Result;
use forest_draw::draw_points;
use forest_eval::{Truth, calibrate, held_out_views};
use forest_pack::{Pack, PackWriter};
use forest_points::{BakeOptions, PixelArea, PointsBlock, RadiusRule, Thresholds, bake};
use forest_raster::{Style, Surfaces};
use forest_soup::TriangleSoup;

/// Neither bakes nor calibrations know them.
const VIEWS: u32 = 16;
/// s_m of the cuts, in square pixels of a tree of [`HEIGHT`] pixels.
pub(crate) const CUTS: [f64; 5] = [0.0, 1.0, 4.0, 16.0, 64.0];
pub(crate) const HEIGHT: f64 = 256.0;

/// One cut, over all views.
#[derive(Clone, Copy)]
pub(crate) struct Row {
    /// Mean number of points.
    pub(crate) points: u64,
    /// Mean over views of coverage over the source's coverage, minus one.
    pub(crate) error: f64,
    /// The largest in magnitude of one view.
    pub(crate) worst: f64,
}

/// Rows for [`CUTS`].
pub(crate) fn measure(
    soup: &TriangleSoup,
    radius: RadiusRule,
    calibrated: bool,
) -> Result<Vec<Row>> {
    let dir = tempfile::tempdir()?;
    let path = dir.path().join("t.fpack");
    let mut writer = PackWriter::create(&path)?;
    bake(soup, &BakeOptions { radius, ..BakeOptions::default() }, &mut writer, &|_| {})?;
    writer.finish()?;
    let pack = Pack::open(&path)?;
    let mut block = PointsBlock::open(&pack)?;
    let surfaces = Surfaces::new(&soup.materials, &soup.textures);
    let truth = Truth::new(soup, &surfaces, Style::default())?;
    if calibrated {
        block.calibration = Some(calibrate(&truth, &block, &|_| {})?.calibration);
    }
    let side = truth.frame.side(HEIGHT, 1);
    let mut rows = vec![Row { points: 0, error: 0.0, worst: 0.0 }; CUTS.len()];
    for view in held_out_views(VIEWS) {
        let camera = truth.frame.camera(&view, HEIGHT, side);
        let source = truth.picture(&view, HEIGHT, side).mean_coverage();
        for (row, finest) in rows.iter_mut().zip(CUTS) {
            let thresholds = Thresholds {
                finest: PixelArea(finest),
                largest: PixelArea(f64::INFINITY),
                depth_bias: PixelArea(0.0),
            };
            let (picture, drawn) =
                draw_points(&block, None, &camera, &thresholds, Style::default());
            let error = picture.mean_coverage() / source - 1.0;
            row.points += drawn.points / u64::from(VIEWS);
            row.error += error / f64::from(VIEWS);
            if error.abs() > row.worst.abs() {
                row.worst = error;
            }
        }
    }
    Ok(rows)
}
