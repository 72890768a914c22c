//! How much of a scene's pictures trees fill, by species and by their size in them.

use crate::need::sights;
use crate::scene::Scene;
use forest_soup::Camera;
use glam::DVec3;
use rayon::prelude::*;

/// Bands of heights: two an octave, from one pixel on.
pub const HEIGHT_BANDS: usize = 28;

/// Pixels along a side of what is filled at once: trees are known by their boxes only.
const CELL: u32 = 4;

/// Of all pictures, the share that trees of a species fill whose box is so many pixels high.
pub type Filled = [f64; HEIGHT_BANDS];

/// Height in pixels of the trees of a band: the middle of it.
pub fn band_height(band: usize) -> f64 {
    2f64.powf((band as f64 + 0.5) * 0.5)
}

/// Shares of the pictures from all cameras and all pictures of paths, `height` pixels high and 16 : 9, that
/// trees of each species fill: each tree as the ellipse in its box, the nearer before the farther. Hills
/// hide nothing.
pub fn filled(scene: &Scene, height: u32) -> Vec<Filled> {
    let sights = sights(scene);
    let size = [(height * 16).div_ceil(9), height];
    let none = || vec![[0.0; HEIGHT_BANDS]; scene.species.len()];
    let of = |sight: &crate::sight::Sight| one(scene, &sight.camera(&scene.land, size));
    let sum = sights.par_iter().map(of).reduce(none, |a, b| {
        let add = |(a, b): (Filled, Filled)| std::array::from_fn(|k| a[k] + b[k]);
        a.into_iter().zip(b).map(add).collect()
    });
    let pictures = sights.len().max(1) as f64;
    sum.into_iter().map(|bands| bands.map(|v| v / pictures)).collect()
}

fn one(scene: &Scene, camera: &Camera) -> Vec<Filled> {
    let stances = scene.stances();
    let mut order: Vec<(f64, usize)> = scene
        .trees
        .iter()
        .enumerate()
        .map(|(i, t)| (DVec3::from_array(t.position.map(f64::from)).distance(camera.eye), i))
        .collect();
    order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let [across, down] = [camera.width, camera.height].map(|n| n.div_ceil(CELL) as usize);
    let mut covered = vec![false; across * down];
    let mut open = covered.len();
    let mut bands = vec![[0.0; HEIGHT_BANDS]; scene.species.len()];
    let share = 1.0 / covered.len() as f64;
    for (_, i) in order {
        if open == 0 {
            break;
        }
        let tree = &scene.trees[i];
        let stance = &stances[tree.species()];
        let scale = tree.scale(stance.scale);
        let [min, max] = stance.bounds;
        let size = (max - min) * scale;
        let foot = DVec3::from_array(tree.position.map(f64::from));
        let middle = foot + DVec3::Y * (0.5 * (min.y + max.y) * scale);
        let (x, y, depth) = camera.project(middle);
        if depth <= size.length() * 0.5 {
            continue;
        }
        let pixels = camera.pixels_per_unit(depth);
        let band = (size.max_element() * pixels).max(1.0).log2() * 2.0;
        let band = (band as usize).min(HEIGHT_BANDS - 1);
        // What is seen of a box from above is wider than it is high.
        let wide = 0.5 * size.x.max(size.z) * pixels / f64::from(CELL);
        let level = camera.up.y.abs();
        let tall = 0.5 * size.y * pixels / f64::from(CELL) * level + wide * (1.0 - level);
        let (x, y) = (x / f64::from(CELL), y / f64::from(CELL));
        let cells = |v: f64, half: f64, most: usize| {
            let clamp = |v: f64| v.clamp(0.0, most as f64) as usize;
            // At least the cell of its middle, by its share: small trees are many.
            clamp((v - half).round())..clamp((v + half).round())
        };
        for row in cells(y, tall, down) {
            for column in cells(x, wide, across) {
                let off = [(column as f64 + 0.5 - x) / wide, (row as f64 + 0.5 - y) / tall];
                let cell = &mut covered[row * across + column];
                if off[0] * off[0] + off[1] * off[1] <= 1.0 && !*cell {
                    *cell = true;
                    open -= 1;
                    bands[tree.species()][band] += share;
                }
            }
        }
    }
    bands
}
