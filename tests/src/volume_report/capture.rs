//! A tree photographed and made again from its photographs.

use anyhow::Result;
use forest_draw::VolumeScene;
use forest_eval::{MatteErrors, drawn, held_out_views, matte_errors};
use forest_raster::{Light, Picture, Sampling, Style, Surfaces, rasterize};
use forest_soup::{Camera, PhotoCamera, Photograph, Projection, TriangleSoup};
use forest_tests::{open, write_volume};
use forest_volume::{Stand, TomographyOptions, Volume, VolumeBlock, VolumeOptions};
use glam::DVec3;
use image::RgbImage;
use std::fmt::Write;
use std::path::Path;

const COUNTS: [u32; 4] = [8, 16, 32, 64];
const SIZE: u32 = 400;
const HELD_OUT: u32 = 8;
/// Photographs that are shown.
const SHOWN: usize = 3;

/// Cells six pixels wide: texels of a pixel and a half.
fn options() -> VolumeOptions {
    VolumeOptions { levels: 6, ..VolumeOptions::default() }
}

struct Scene<'a> {
    soup: &'a TriangleSoup,
    surfaces: Surfaces,
}

impl Scene<'_> {
    fn camera(&self, from: DVec3) -> Camera {
        let bounds = self.soup.bounds();
        let (middle, radius) = (self.soup.origin + bounds.center(), bounds.half_diagonal());
        let projection = Projection::Perspective { fov_y: 2.0 * (1.02f64 / 3.0).asin() };
        Camera::new(middle + from * (3.0 * radius), -from, projection, [SIZE; 2])
    }

    fn picture(&self, camera: &Camera) -> Picture {
        let sampling = Sampling { side: 4, seed: 1 };
        rasterize(self.soup, &self.surfaces, camera, &Style { sampling, light: Light::Albedo })
    }

    fn photograph(&self, from: DVec3, name: String) -> Photograph {
        let camera = self.camera(from);
        let pixels = self.picture(&camera).straight();
        Photograph { name, camera: PhotoCamera::from(&camera), pixels }
    }
}

/// What a number of photographs gave.
struct Row {
    count: u32,
    errors: MatteErrors,
    residual: f64,
    cells: u64,
    seconds: f64,
}

pub(crate) fn write(t: &mut String, name: &str, soup: &TriangleSoup, picture: &Path) -> Result<()> {
    let scene = Scene { soup, surfaces: Surfaces::new(&soup.materials, &soup.textures) };
    let views = held_out_views(HELD_OUT);
    let directions: Vec<DVec3> = views.iter().map(|v| DVec3::from_array(v.to_camera)).collect();
    let held_out: Vec<Photograph> =
        directions.iter().map(|&from| scene.photograph(from, "held out".into())).collect();
    let mut rows = Vec::new();
    let mut sheet = Vec::new();
    let shown = || directions.iter().step_by(directions.len() / SHOWN).take(SHOWN);
    sheet.push(shown().map(|&from| scene.picture(&scene.camera(from))).collect::<Vec<_>>());
    for count in COUNTS {
        eprintln!("  {count} photographs");
        let stand = Stand::Dome { cameras: count };
        let photos: Vec<Photograph> = (0..)
            .zip(stand.directions())
            .map(|(i, from)| scene.photograph(from, format!("{i}")))
            .collect();
        let start = std::time::Instant::now();
        let tomography = TomographyOptions::default();
        let volume = Volume::from_photographs(&photos, &tomography, &options(), &|_| {})?;
        let seconds = start.elapsed().as_secs_f64();
        let pack = open(&write_volume(&volume, None)?.0)?;
        let block = VolumeBlock::open(&pack)?;
        let errors = matte_errors(&block, &held_out)?;
        let residuals = volume.report.tomography.as_ref().map_or(&[][..], |t| &t.residuals);
        let residual = residuals.iter().sum::<f64>() / residuals.len().max(1) as f64;
        let cells = volume.report.levels.last().map_or(0, |l| l.cells);
        rows.push(Row { count, errors, residual, cells, seconds });
        if [16, 64].contains(&count) {
            let volume = VolumeScene::read(&block)?;
            sheet.push(shown().map(|&from| drawn(&volume, &scene.camera(from))).collect());
        }
    }
    save(&sheet, picture)?;
    writeln!(
        t,
        "\n## From photographs: {name}\n\nPhotographed by perspective cameras on the half sphere, {SIZE}² \
         pixels with mattes, and made again from the photographs alone: opacity by tomography, textures by \
         opacity. Errors in {HELD_OUT} photographs that the bake does not know, over the pixels that either \
         shows: of mattes, of colour and matte (premultiplied linear), and IoU at alpha ½. *Own* is the mean \
         RMS difference of the mattes that it does know.\n\n\
         | photographs | matte RMSE | IoU | RMSE | coverage | own | finest cells | s |\n|---|---|---|---|---|---|---|---|"
    )?;
    for r in &rows {
        writeln!(
            t,
            "| {} | {:.4} | {:.3} | {:.4} | {:+.1} % | {:.4} | {} | {:.0} |",
            r.count,
            r.errors.matte_rmse,
            r.errors.iou,
            r.errors.rmse,
            100.0 * r.errors.coverage,
            r.residual,
            r.cells,
            r.seconds,
        )?;
    }
    writeln!(
        t,
        "\n![Held-out photographs, and the tree from 16 and 64 photographs](volume_heldout.png)\n\n\
         *Three of the photographs that are held out (top), and the tree as 16 (middle) and 64 (bottom) \
         others gave it.*"
    )?;
    Ok(())
}

/// Rows of pictures over grey.
fn save(rows: &[Vec<Picture>], path: &Path) -> Result<()> {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0) as u32;
    let mut sheet = RgbImage::new(columns * SIZE, rows.len() as u32 * SIZE);
    for (y, row) in (0..).zip(rows) {
        for (x, picture) in (0..).zip(row) {
            for (i, rgb) in (0u32..).zip(picture.over(0.6)) {
                sheet.put_pixel(x * SIZE + i % SIZE, y * SIZE + i / SIZE, image::Rgb(rgb));
            }
        }
    }
    sheet.save(path)?;
    Ok(())
}
