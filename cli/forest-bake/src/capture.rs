//! `forest-bake capture`.

use crate::failure::Usage;
use crate::log::Log;
use crate::output;
use crate::source::SourceArgs;
use crate::volume::stand;
use anyhow::{Context, Result};
use forest_export::photographs;
use forest_raster::{Light, Sampling, Style, Surfaces, rasterize};
use forest_soup::{Camera, Photograph, Projection};
use forest_volume::VolumeError;
use std::path::PathBuf;

#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    source: SourceArgs,
    /// Folder to write: transforms.json and RGBA images, as NeRF tools read them (z up).
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,
    /// Number of photographs.
    #[arg(long, default_value_t = 32, value_parser = clap::value_parser!(u32).range(1..=256))]
    cameras: u32,
    /// dome (from the horizon up), ring, or ring:DEGREES above the horizon.
    #[arg(long, default_value = "dome", value_name = "STAND")]
    stand: String,
    /// Side of a photograph in pixels.
    #[arg(long, default_value_t = 512, value_parser = clap::value_parser!(u32).range(8..=8192))]
    size: u32,
    /// Distance of the cameras from the middle, in radii of the tree's box.
    #[arg(long, default_value_t = 3.0, value_name = "RADII")]
    distance: f64,
    /// Samples a side of a pixel.
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=16))]
    samples: u32,
    /// Replace a capture that is there.
    #[arg(long)]
    force: bool,
}

pub(crate) fn run(args: &Args, log: Log) -> Result<()> {
    let stand = stand(&args.stand, args.cameras)?;
    if !(args.distance > 1.05 && args.distance < 1e6) {
        let problem = format!("--distance {}: above 1.05 radii and below a million", args.distance);
        return Err(Usage(problem).into());
    }
    let target = args.output.join("transforms.json");
    if target.exists() && !args.force {
        let problem = format!("{}: exists; give --force to replace it", target.display());
        return Err(Usage(problem).into());
    }
    let source = args.source.load(log)?;
    let soup = &source.soup;
    soup.validate()?;
    let bounds = soup.bounds();
    let radius = bounds.half_diagonal();
    if bounds.is_empty() || radius <= 0.0 {
        let what = "no triangle with finite corners and an extent";
        return Err(VolumeError::NothingToSee(what.into()).into());
    }
    let middle = soup.origin + bounds.center();
    let surfaces = Surfaces::new(&soup.materials, &soup.textures);
    let style = Style { sampling: Sampling { side: args.samples, seed: 1 }, light: Light::Albedo };
    let projection = Projection::Perspective { fov_y: 2.0 * (1.02 / args.distance).asin() };
    let bar = output::bar(u64::from(args.cameras), "photographs", log);
    let photos: Vec<Photograph> = (0..)
        .zip(stand.directions())
        .map(|(i, from)| {
            let eye = middle + from * (args.distance * radius);
            let camera = Camera::new(eye, -from, projection, [args.size; 2]);
            let picture = rasterize(soup, &surfaces, &camera, &style);
            bar.inc(1);
            let (name, pixels) = (format!("{i:03}"), picture.straight());
            Photograph { name, camera: (&camera).into(), pixels }
        })
        .collect();
    bar.finish_and_clear();
    std::fs::create_dir_all(&args.output).with_context(|| args.output.display().to_string())?;
    // The description last: without it there is no capture.
    for file in photographs(&photos)? {
        output::write_file(&args.output.join(&file.name), &file.bytes)?;
    }
    if log.says() {
        let folder = args.output.display();
        eprintln!("{folder}: {} photographs of {}² pixels", photos.len(), args.size);
    }
    Ok(())
}
