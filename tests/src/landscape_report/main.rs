//! `make landscape`: landscapes of 1,000 to 1,000,000 trees beside what engines commonly do.

mod ours;
mod truth;

use anyhow::{Context, Result};
use forest_gpu::{Gpu, instance};
use forest_points::PixelArea;
use forest_scene::Scene;
use forest_tests::reports::load_soup;
use ours::Ours;
use std::path::Path;
use truth::{Crop, Sources};

const SIZE: [u32; 2] = [1280, 720];

fn main() -> Result<()> {
    let args: Vec<String> = std::env::args().collect();
    let gpu = Gpu::open(&instance(false, None), None, None)?;
    let scene = Scene::open(Path::new(&args[1]))?;
    let soups = args[2].split(',').map(|t| load_soup(Path::new(t))).collect::<Result<_>>()?;
    let sources = Sources::new(soups);
    let crops: Vec<Crop> = [[100, 310], [560, 330], [900, 480]]
        .map(|corner| Crop { corner, size: [160, 90] })
        .into();
    let camera = scene.file.camera(None).context("camera")?.camera(&scene.land, SIZE);
    let start = std::time::Instant::now();
    let truth = truth::pictures(&scene, &sources, &camera, &crops, 6);
    eprintln!("truth {:.1} s", start.elapsed().as_secs_f64());
    for samples in [1] {
        let mut ours = Ours::new(&gpu, &scene, SIZE, samples)?;
        for (f, h) in [(1.0, 0.667), (4.0, 0.667), (16.0, 0.667)] {
            ours.detail.finest = PixelArea(f);
            ours.detail.largest = PixelArea(16.0 * f);
            ours.detail.hidden = h;
            ours.frame(&gpu, &camera)?;
            let (ms, drawn) = ours.frame(&gpu, &camera)?;
            let picture = ours.picture(&gpu)?;
            let flip = ours::flip(&picture, SIZE[0], &crops, &truth);
            let mean = |p: &[[f32; 3]]| p.iter().map(|v| v[1]).sum::<f32>() / p.len() as f32;
            let mut all = vec![];
            for c in &crops { for y in 0..90 { for x in 0..160 { all.push(picture[((c.corner[1]+y)*1280+c.corner[0]+x) as usize]); } } }
            let t: Vec<[f32;3]> = truth.iter().flat_map(|t| t.pixels.iter().map(|p| [p[0],p[1],p[2]])).collect();
            println!("samples {samples} s_m {f} hidden {h}: {ms:.0} ms, {:.2}M, FLIP {flip:.4} green {:.3} truth {:.3}", drawn.primitives() as f64 / 1e6, mean(&all), mean(&t));
            if samples == 1 && f == 4.0 { for (i, (c, t)) in crops.iter().zip(&truth).enumerate() {
                let mut img = image::RgbImage::new(320, 90);
                let enc = |v: [f32;3]| image::Rgb(v.map(|v| forest_soup::linear_to_srgb8(v)));
                for y in 0..90 { for x in 0..160 {
                    let p = t.pixels[(y*160+x) as usize]; img.put_pixel(x, y, enc([p[0],p[1],p[2]]));
                    img.put_pixel(160 + x, y, enc(picture[((c.corner[1]+y)*1280+c.corner[0]+x) as usize])); } }
                image::imageops::resize(&img, 1280, 360, image::imageops::Nearest).save(format!("/tmp/v6/crop{i}.png"))?;
            } }
        }
    }
    Ok(())
}
