//! Points as PLY, with the properties of Gaussian splats: what splat viewers and point-cloud tools read.
//!
//! A point is a flat spheroid of one opacity; a splat is a Gaussian. Both cover the same area, seen along
//! the axis, if the Gaussian's standard deviation is the radius over √2: 2πσ²·o = πr²·o. Colour is the
//! constant of the spherical harmonics, opacity a logit, scales natural logarithms, the quaternion has w
//! first (B. Kerbl, G. Kopanas, T. Leimkühler, G. Drettakis, "3D Gaussian splatting for real-time radiance
//! field rendering", ACM TOG 42, 2023, and their viewer's files).

use crate::picture::ExportFile;
use forest_points::{PixelArea, PointsBlock, Thresholds, select, within_budget};
use forest_soup::{Camera, linear_to_srgb8};
use glam::{DQuat, DVec3};
use std::f64::consts::FRAC_1_SQRT_2;

/// The constant of spherical harmonics: 1 / (2 √π).
const HARMONIC: f32 = 0.282_094_79;

/// Opacities are within this of 0 and 1: logits are finite.
const OPAQUE: f64 = 1.0 / 512.0;

/// No splat is flatter, in radii.
const THINNEST: f64 = 1e-3;

/// What each splat is told of.
const PROPERTIES: [&str; 17] = [
    "x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1",
    "scale_2", "rot_0", "rot_1", "rot_2", "rot_3",
];

/// The finest cut of at most `most` points of a block as `NAME.ply`, in world units; `None` if it is not
/// possible with so few.
pub fn splats(block: &PointsBlock, name: &str, most: u64) -> Option<ExportFile> {
    let [min, max] = [block.header.min, block.header.max].map(|p| block.to_world(p.into()));
    // Any parallel camera: a cut by size alone.
    let camera = Camera::around([min, max], [0.0, 0.0], None, [1024; 2]);
    let all = Thresholds {
        finest: PixelArea(0.0),
        largest: PixelArea(f64::INFINITY),
        depth_bias: PixelArea(0.0),
    };
    let mut cut = select(block, &camera, &all);
    if cut.points(block).count() as u64 > most {
        let (thresholds, _) = within_budget(block, &camera, f64::INFINITY, most)?;
        cut = select(block, &camera, &thresholds);
    }
    let mut rows: Vec<f32> = Vec::new();
    for cell in &cut.cells {
        for (_, record, point) in cell.drawn_points(block) {
            let place = block.to_world(block.position(record, point.position)).as_vec3();
            let axis = point.axis();
            let radius = block.radius(point) * block.scale() * FRAC_1_SQRT_2;
            let thick = forest_points::spheroid::flatness(point.flatness_step()).max(THINNEST);
            let opacity = point.opacity().clamp(OPAQUE, 1.0 - OPAQUE);
            let turn = DQuat::from_rotation_arc(DVec3::Z, axis).as_quat();
            rows.extend(place.to_array());
            rows.extend(axis.as_vec3().to_array());
            let srgb = point.color().map(|c| f32::from(linear_to_srgb8(c)) / 255.0);
            rows.extend(srgb.map(|c| (c - 0.5) / HARMONIC));
            rows.push((opacity / (1.0 - opacity)).ln() as f32);
            rows.extend([radius, radius, radius * thick].map(|s| s.ln() as f32));
            rows.extend([turn.w, turn.x, turn.y, turn.z]);
        }
    }
    let mut bytes = header(rows.len() / PROPERTIES.len()).into_bytes();
    bytes.extend(rows.iter().flat_map(|v| v.to_le_bytes()));
    Some(ExportFile { name: format!("{name}.ply"), bytes })
}

fn header(count: usize) -> String {
    let properties: String = PROPERTIES.map(|p| format!("property float {p}\n")).concat();
    let format = "format binary_little_endian 1.0";
    format!("ply\n{format}\nelement vertex {count}\n{properties}end_header\n")
}
