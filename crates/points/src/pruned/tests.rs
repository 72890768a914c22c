use super::*;
use crate::select::{PixelArea, Thresholds, select};
use crate::{BakeOptions, bake};
use forest_soup::{Camera, Material, Projection, TriangleSoup};
use glam::{DVec3, Vec3};
use std::path::Path;

/// A ball of 3,000 triangles of many sizes.
fn packed(folder: &Path) -> Pack {
    let corner = |i: u32, k: u32| {
        let h = |n: u32| {
            let v = i.wrapping_mul(0x9e37_79b9) ^ n.wrapping_mul(0x85eb_ca6b);
            let v = (v ^ v >> 15).wrapping_mul(0x2c1b_3c6d);
            (v ^ v >> 12) as f32 / u32::MAX as f32 - 0.5
        };
        let size = 0.02 + 0.2 * (h(9) + 0.5).powi(3);
        let off = Vec3::new(h(10 + k), h(20 + k), h(30 + k)) * size;
        Vec3::new(h(1), h(2), h(3)) * 4.0 + off
    };
    let soup = TriangleSoup {
        positions: (0..3000).flat_map(|i| [0, 1, 2].map(|k| corner(i, k))).collect(),
        triangles: (0..3000).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        triangle_materials: vec![0; 3000],
        materials: vec![Material::default()],
        ..TriangleSoup::default()
    };
    let path = folder.join("whole.fpack");
    let mut writer = PackWriter::create(&path).unwrap();
    bake(&soup, &BakeOptions::default(), &mut writer, &|_| {}).unwrap();
    writer.finish().unwrap();
    Pack::open(&path).unwrap()
}

fn camera(distance: f64) -> Camera {
    let projection = Projection::Perspective { fov_y: 0.8 };
    let eye = DVec3::new(0.3, 0.5, 1.0).normalize() * distance;
    Camera::new(eye, -eye, projection, [640, 480])
}

const THRESHOLDS: Thresholds =
    Thresholds { finest: PixelArea(1.0), largest: PixelArea(16.0), depth_bias: PixelArea(0.0) };

/// Numbers of the points and triangles that are drawn, in order.
fn drawn(block: &PointsBlock, camera: &Camera) -> Vec<u32> {
    let mut numbers = Vec::new();
    for c in &select(block, camera, &THRESHOLDS).cells {
        let points = c.drawn_points(block).map(|(i, ..)| i);
        numbers.extend(points.map(|i| i.wrapping_add(block.point_offset(c.cell))));
        let triangles = c.triangles.clone();
        numbers.extend(triangles.map(|i| i.wrapping_add(block.triangle_offset(c.cell))));
    }
    numbers
}

#[test]
fn within_the_need_the_same_numbers_are_drawn() {
    let dir = tempfile::tempdir().unwrap();
    let whole = packed(dir.path());
    let block = PointsBlock::open(&whole).unwrap();
    let prune_for = |nearest: f64, name: &str| {
        // Where the eye is nearest to any cell: by the radius of the block.
        let pixels = camera(nearest).pixels_per_unit(nearest - 2.0 * block.half_diagonal());
        let area = |px: f64| px / (pixels * pixels);
        let need = PointsNeed { finest: area(1.0), largest: area(16.0) };
        let path = dir.path().join(name);
        let mut writer = PackWriter::create(&path).unwrap();
        let report = prune(&whole, &block, &need, &mut writer).unwrap();
        writer.finish().unwrap();
        (Pack::open(&path).unwrap(), report, need)
    };
    for (nearest, name) in [(16.0, "near.fpack"), (100.0, "far.fpack")] {
        let (pack, report, _) = prune_for(nearest, name);
        let pruned = PointsBlock::open(&pack).unwrap();
        assert_eq!(pruned.points.len() as u64, report.points[1]);
        assert!(report.triangles[1] < report.triangles[0], "{report:?}");
        for factor in [1.0, 1.1, 2.5, 40.0, 1e4] {
            let want = drawn(&block, &camera(nearest * factor));
            let got = drawn(&pruned, &camera(nearest * factor));
            assert!(!want.is_empty() && want == got, "{nearest} times {factor}");
            assert!(!pruned.is_beyond(&camera(nearest * factor), &THRESHOLDS));
        }
    }
    let (pack, report, need) = prune_for(100.0, "far.fpack");
    assert!(report.points[1] * 2 < report.points[0], "{report:?}");
    let pruned = PointsBlock::open(&pack).unwrap();
    // Nearer it draws the finest that it has: every cell's cut is there, and is not finer.
    let near = drawn(&pruned, &camera(8.0));
    assert!(near.len() < drawn(&block, &camera(8.0)).len());
    assert!(near.len() >= drawn(&block, &camera(100.0)).len());
    assert!(pruned.is_beyond(&camera(8.0), &THRESHOLDS));
    assert!(!block.is_beyond(&camera(8.0), &THRESHOLDS));
    // Pruned anew for the same need, nothing is left out; for less, the numbers stay.
    let again = dir.path().join("again.fpack");
    let mut writer = PackWriter::create(&again).unwrap();
    let far = PointsNeed { finest: 9.0 * need.finest, largest: 9.0 * need.largest };
    let second = prune(&pack, &pruned, &far, &mut writer).unwrap();
    writer.finish().unwrap();
    assert!(second.points[1] < second.points[0]);
    let again = Pack::open(&again).unwrap();
    let again = PointsBlock::open(&again).unwrap();
    assert_eq!(drawn(&block, &camera(400.0)), drawn(&again, &camera(400.0)));
}

#[test]
fn nothing_needed_leaves_a_sound_pack() {
    let dir = tempfile::tempdir().unwrap();
    let whole = packed(dir.path());
    let block = PointsBlock::open(&whole).unwrap();
    for (finest, largest) in [(f64::INFINITY, f64::INFINITY), (0.0, 0.0)] {
        let path = dir.path().join("p.fpack");
        let mut writer = PackWriter::create(&path).unwrap();
        let need = PointsNeed { finest, largest };
        let report = prune(&whole, &block, &need, &mut writer).unwrap();
        writer.finish().unwrap();
        let pack = Pack::open(&path).unwrap();
        let pruned = PointsBlock::open(&pack).unwrap();
        let all = finest == 0.0;
        assert_eq!(report.points[1] == report.points[0], all);
        assert_eq!(pruned.triangles.is_empty(), !all);
        assert_eq!(drawn(&pruned, &camera(1e7)).len(), 1);
    }
}

#[test]
fn forged_numbers_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let whole = packed(dir.path());
    let mut block = PointsBlock::open(&whole).unwrap();
    let firsts = vec![[0, 0]; block.cells.len()];
    let good = Pruned { fine: -1, coarse: 4094, points: block.points.len() as u32, firsts };
    for (forged, what) in [
        (Pruned { fine: 4095, ..good.clone() }, "a limit of 4095"),
        (Pruned { firsts: vec![], ..good.clone() }, "numbers of 0 cells"),
        (Pruned { points: 3, ..good.clone() }, "3 points of the whole pack"),
    ] {
        block.pruned = Some(forged);
        let (kind, problem) = crate::validate(&block).unwrap_err();
        assert!(kind == kind::POINTS_PRUNED && problem.contains(what), "{problem}");
    }
}
