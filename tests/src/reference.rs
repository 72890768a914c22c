//! Pictures by an independent renderer (Cycles), in ../shared/reference beside the checkout.

use forest_eval::Comparison;
use forest_raster::{Picture, Sun};
use forest_soup::{Camera, Projection, srgb8_to_linear};
use glam::DVec3;
use std::path::Path;

/// One picture.
pub struct Reference {
    /// Premultiplied linear RGBA.
    pub pixels: Vec<[f32; 4]>,
    /// Where it was taken from.
    pub camera: Camera,
    /// Its light, if it is a lit one.
    pub sun: Sun,
}

fn vector(v: &serde_json::Value) -> DVec3 {
    DVec3::from_array(std::array::from_fn(|k| v[k].as_f64().unwrap()))
}

/// Picture `kind` (`albedo` or `lit`) of `view` in a tree's folder.
///
/// # Panics
/// When it is not there or not as expected.
pub fn reference(folder: &Path, view: &str, kind: &str) -> Reference {
    let json = std::fs::read(folder.join("cameras.json")).unwrap();
    let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
    let image = image::open(folder.join(format!("{kind}_{view}.png"))).unwrap().into_rgba8();
    let pixels = image.pixels().map(|p| {
        let [r, g, b, a] = p.0;
        let alpha = f32::from(a) / 255.0;
        let [r, g, b] = [r, g, b].map(|c| srgb8_to_linear(c) * alpha);
        [r, g, b, alpha]
    });
    let v = &json["views"][view];
    let half = json["ortho_half"].as_f64().unwrap();
    let back = vector(&v["dir_to_camera_gltf"]).normalize();
    let (right, up) = (vector(&v["right_gltf"]).normalize(), vector(&v["up_gltf"]).normalize());
    let camera = Camera {
        eye: vector(&json["center_gltf"]) + back * (4.0 * half),
        right,
        up,
        forward: -back,
        projection: Projection::Orthographic { height: 2.0 * half },
        width: image.width(),
        height: image.height(),
    };
    let [x, y, z] = vector(&json["sun_dir_to_light_blender"]).normalize().to_array();
    let strength = json["world_strength"].as_f64().unwrap();
    let sun = Sun {
        to_sun: DVec3::new(x, z, -y),
        sun: [(json["sun_energy"].as_f64().unwrap() / std::f64::consts::PI) as f32; 3],
        sky: vector(&json["world_rgb"]).to_array().map(|c| (c * strength) as f32),
        translucency: 0.0,
        darkest: 1.0,
    };
    Reference { pixels: pixels.collect(), camera, sun }
}

/// Their folders, and the trees they show.
pub const REFERENCES: [(&str, &str); 5] = [
    ("ez_oak_dense_200k", "ez_oak_dense_200k.glb"),
    ("sap_birch_200k", "sap_birch_200k.glb"),
    ("sap_jmaple_450k", "sap_jmaple_450k.glb"),
    ("sap_pine_20k", "sap_pine_20k.glb"),
    ("scopia_japaneseMaple", "japaneseMaple/japaneseMaple.obj"),
];
/// Their views.
pub const VIEWS: [&str; 4] = ["front", "right", "diag45", "top"];

/// How a picture compares with the reference over the box of both: mean coverage, largest difference
/// of a mean colour channel (premultiplied), RMSE after a 4×4 box filter.
pub fn against(reference: &[[f32; 4]], ours: &Picture) -> [f64; 3] {
    let theirs = Picture { pixels: reference.to_vec(), ..ours.clone() };
    let whole = Comparison::new(&theirs, ours);
    let (theirs_cropped, ours_cropped) = whole.pictures();
    let mean = |p: &Picture, c: usize| {
        p.pixels.iter().map(|v| f64::from(v[c])).sum::<f64>() / p.pixels.len() as f64
    };
    let difference = |c| mean(ours_cropped, c) - mean(theirs_cropped, c);
    let colour = (0..3).map(|c| difference(c).abs()).fold(0.0, f64::max);
    let filtered = Comparison::new(&theirs.box_filtered(4), &ours.box_filtered(4));
    [difference(3), colour, filtered.pixel_errors(1.0).rmse]
}
