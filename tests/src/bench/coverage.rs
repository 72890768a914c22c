//! Does the crown thin out or fatten? Coverage of cuts against that of the triangles they stand for.

use anyhow::Result;
use forest_draw::{draw_points, read_surfaces};
use forest_pack::{Pack, PackWriter};
use forest_points::{BakeOptions, PixelArea, PointsBlock, RadiusRule, Thresholds, bake};
use forest_raster::Style;
use forest_soup::{Camera, Projection, TriangleSoup};
use glam::DVec3;

/// View directions: a Fibonacci spiral over the sphere. Bakes do not know them.
const VIEWS: u32 = 16;
/// s_m of the cuts, in square pixels of a picture of [`SIDE`] pixels.
pub(crate) const CUTS: [f64; 5] = [0.0, 1.0, 4.0, 16.0, 64.0];
pub(crate) const SIDE: u32 = 256;

/// One cut, over all views.
#[derive(Clone, Copy)]
pub(crate) struct Row {
    /// Mean number of points.
    pub(crate) points: u64,
    /// Mean over views of coverage over the triangles' coverage, minus one.
    pub(crate) error: f64,
    /// The largest in magnitude of one view.
    pub(crate) worst: f64,
}

/// Rows for [`CUTS`].
pub(crate) fn measure(soup: &TriangleSoup, radius: RadiusRule) -> Result<Vec<Row>> {
    let dir = tempfile::tempdir()?;
    let path = dir.path().join("t.fpack");
    let mut writer = PackWriter::create(&path)?;
    bake(soup, &BakeOptions { radius, ..BakeOptions::default() }, &mut writer, &|_| {})?;
    writer.finish()?;
    let pack = Pack::open(&path)?;
    let block = PointsBlock::open(&pack)?;
    let surfaces = read_surfaces(&pack, &block)?;
    let style = Style::default();
    let draw = |camera: &Camera, finest: f64, largest: f64| {
        let thresholds = Thresholds {
            finest: PixelArea(finest),
            largest: PixelArea(largest),
            depth_bias: PixelArea(0.0),
        };
        let (picture, drawn) = draw_points(&block, surfaces.as_ref(), camera, &thresholds, &style);
        (picture.mean_coverage(), drawn.points)
    };
    let mut rows = vec![Row { points: 0, error: 0.0, worst: 0.0 }; CUTS.len()];
    for k in 0..VIEWS {
        let camera = view(&block, k);
        let (truth, _) = draw(&camera, 0.0, 0.0);
        for (row, finest) in rows.iter_mut().zip(CUTS) {
            let (coverage, points) = draw(&camera, finest, f64::INFINITY);
            let error = coverage / truth - 1.0;
            row.points += points / u64::from(VIEWS);
            row.error += error / f64::from(VIEWS);
            if error.abs() > row.worst.abs() {
                row.worst = error;
            }
        }
    }
    Ok(rows)
}

fn view(block: &PointsBlock, k: u32) -> Camera {
    let y = 1.0 - (2.0 * f64::from(k) + 1.0) / f64::from(VIEWS);
    let turn = f64::from(k) * 2.399_963_229_728_653; // the golden angle
    let flat = (1.0 - y * y).sqrt();
    let from = DVec3::new(turn.cos() * flat, y, turn.sin() * flat);
    let radius = block.half_diagonal();
    let projection = Projection::Orthographic { height: 2.0 * radius };
    Camera::new(block.origin() + from * (2.0 * radius), -from, projection, [SIDE; 2])
}
