//! What a scene can ever ask of its packs.

use crate::scene::Scene;
use crate::sight::Sight;
use forest_points::PointsNeed;
use glam::DVec3;
use rayon::prelude::*;

/// The need of each species from all cameras of a scene and all pictures of its paths, `height` pixels
/// high, however the camera turns: thresholds are s_m and s_M in square pixels. Of trees that a camera
/// stands in everything is needed.
pub fn points_needs(scene: &Scene, height: u32, [finest, largest]: [f64; 2]) -> Vec<PointsNeed> {
    let mut sights: Vec<Sight> = scene.file.cameras.clone();
    for path in &scene.file.paths {
        sights.extend(scene.file.along(path));
    }
    // Eyes, and pixels of a metre at a distance of one.
    let eyes: Vec<(DVec3, f64)> = sights
        .iter()
        .map(|s| {
            let camera = s.camera(&scene.land, [height, height]);
            (camera.eye, camera.pixels_per_unit(1.0))
        })
        .collect();
    let stances = scene.stances();
    let none = || vec![0.0f64; stances.len()];
    let most = scene
        .trees
        .par_iter()
        .fold(none, |mut most, tree| {
            let stance = &stances[tree.species()];
            let scale = tree.scale(stance.scale);
            let foot = DVec3::from_array(tree.position.map(f64::from));
            for (eye, pixels) in &eyes {
                let nearest = (foot.distance(*eye) - stance.reach() * scale).max(0.0);
                // Pixels of a unit of the pack.
                let here = pixels * stance.unit * scale / nearest;
                let entry = &mut most[tree.species()];
                *entry = entry.max(here);
            }
            most
        })
        .reduce(none, |a, b| a.iter().zip(b).map(|(a, b)| a.max(b)).collect());
    most.into_iter()
        .map(|pixels| {
            let area = |px: f64| px / (pixels * pixels);
            PointsNeed { finest: area(finest), largest: area(largest) }
        })
        .collect()
}
