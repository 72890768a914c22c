//! Ground truth of landscapes: parts of pictures, by rays through all trees; and how far pictures are
//! from it.

use forest_eval::Comparison;
use forest_raster::{Grove, Kind, Picture, Planted, Sampling, Style, Surfaces};
use forest_scene::{Scene, Sky, ground_soup, ground_vertices};
use forest_soup::{Camera, TriangleSoup};
use glam::DVec3;

/// A part of a picture: first pixel and size.
#[derive(Clone, Copy, Debug)]
pub struct Crop {
    /// First pixel.
    pub corner: [u32; 2],
    /// Pixels across and down.
    pub size: [u32; 2],
}

/// The soups of a scene's species, ready for rays.
pub struct Sources {
    soups: Vec<TriangleSoup>,
    surfaces: Vec<Surfaces>,
}

impl Sources {
    /// Soups in the order of the scene's species.
    pub fn new(soups: Vec<TriangleSoup>) -> Self {
        let surfaces = soups.iter().map(|s| Surfaces::new(&s.materials, &s.textures)).collect();
        Self { soups, surfaces }
    }

    /// The soups.
    pub fn soups(&self) -> &[TriangleSoup] {
        &self.soups
    }
}

/// What `camera` sees of `scene` in each of `crops`, with the scene's sun, sky and shadows; `side` ×
/// `side` samples a pixel.
pub fn pictures(
    scene: &Scene,
    sources: &Sources,
    camera: &Camera,
    crops: &[Crop],
    side: u32,
) -> Vec<Picture> {
    let vertices = ground_vertices(&scene.land, &scene.file.land);
    let ground = ground_soup(&scene.land, &vertices);
    let bare = Surfaces::new(&ground.materials, &[]);
    let stances = scene.stances();
    let mut kinds: Vec<Kind> = sources
        .soups
        .iter()
        .zip(&sources.surfaces)
        .zip(&stances)
        .map(|((soup, surfaces), s)| Kind { soup, surfaces, anchor: s.anchor })
        .collect();
    let (position, anchor) = (DVec3::ZERO, ground.origin);
    kinds.push(Kind { soup: &ground, surfaces: &bare, anchor });
    let tree = |t: &forest_scene::Instance| {
        let stance = &stances[t.species()];
        Planted {
            kind: t.species() as u32,
            position: DVec3::from_array(t.position.map(f64::from)),
            yaw: t.yaw(),
            scale: t.scale(stance.scale) * stance.unit,
        }
    };
    let mut planted: Vec<Planted> = scene.trees.iter().map(tree).collect();
    planted.push(Planted { kind: sources.soups.len() as u32, position, yaw: 0.0, scale: 1.0 });
    let grove = Grove::new(&kinds, &planted);
    let sampling = Sampling { side, seed: 1 };
    let style = Style { sampling, light: scene.file.sun.light() };
    crops
        .iter()
        .map(|c| {
            let picture = grove.picture(camera, &style, c.corner, c.size);
            over_sky(picture, camera, &scene.file.sky, *c)
        })
        .collect()
}

/// The picture of a crop over the sky.
fn over_sky(mut picture: Picture, camera: &Camera, sky: &Sky, crop: Crop) -> Picture {
    let unit = camera.pixels_per_unit(1.0);
    for (i, pixel) in picture.pixels.iter_mut().enumerate() {
        let [x, y] = [i as u32 % crop.size[0], i as u32 / crop.size[0]];
        let right = f64::from(crop.corner[0] + x) + 0.5 - 0.5 * f64::from(camera.width);
        let up = 0.5 * f64::from(camera.height) - f64::from(crop.corner[1] + y) - 0.5;
        let ray = camera.forward + (camera.right * right + camera.up * up) / unit;
        let behind = sky.color(ray.normalize());
        let open = 1.0 - pixel[3];
        for k in 0..3 {
            pixel[k] += behind[k] * open;
        }
        pixel[3] = 1.0;
    }
    picture
}

/// Means of linear RGB over the `side` × `side` samples of each pixel.
pub fn averaged(samples: &[[f32; 4]], width: u32, height: u32, side: u32) -> Vec<[f32; 3]> {
    let share = 1.0 / (side * side) as f32;
    let pixel = |i: u32| {
        let (x, y) = (i % width * side, i / width * side);
        let mut sum = [0.0; 3];
        for s in 0..side * side {
            let row = (y + s / side) * width * side;
            let sample = samples[(row + x + s % side) as usize];
            (0..3).for_each(|k| sum[k] += sample[k] * share);
        }
        sum
    };
    (0..width * height).map(pixel).collect()
}

/// Mean FLIP of a picture `width` pixels wide over crops of the truth.
pub fn flip(picture: &[[f32; 3]], width: u32, crops: &[Crop], truth: &[Picture]) -> f64 {
    let of = |(crop, truth): (&Crop, &Picture)| {
        Comparison::new(truth, &part(picture, width, crop)).flip(0.0).mean()
    };
    crops.iter().zip(truth).map(of).sum::<f64>() / crops.len() as f64
}

/// Mean luminance of a picture `width` pixels wide in all crops, over that of the truth.
pub fn brightness(picture: &[[f32; 3]], width: u32, crops: &[Crop], truth: &[Picture]) -> f64 {
    let sum = |p: &Picture| {
        let luminance = |p: &[f32; 4]| f64::from(0.2126 * p[0] + 0.7152 * p[1] + 0.0722 * p[2]);
        p.pixels.iter().map(luminance).sum::<f64>()
    };
    let ours: f64 = crops.iter().map(|c| sum(&part(picture, width, c))).sum();
    ours / truth.iter().map(sum).sum::<f64>()
}

fn part(picture: &[[f32; 3]], width: u32, crop: &Crop) -> Picture {
    let [w, h] = crop.size;
    let mut part = Picture::empty(w, h);
    for (i, pixel) in part.pixels.iter_mut().enumerate() {
        let (x, y) = (crop.corner[0] + i as u32 % w, crop.corner[1] + i as u32 / w);
        let [r, g, b] = picture[(y * width + x) as usize];
        *pixel = [r, g, b, 1.0];
    }
    part
}
