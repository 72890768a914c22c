use super::*;
use crate::bake;
use crate::options::{BakeOptions, GridChoice, RadiusRule, SurfelSize};
use forest_pack::{Pack, PackWriter};
use forest_soup::{Material, TriangleSoup};
use glam::Vec3;
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg32;
use std::path::Path;

/// Random leaves in a unit ball.
pub(crate) fn leaves(n: u32, seed: u64) -> TriangleSoup {
    let mut rng = Pcg32::seed_from_u64(seed);
    let mut positions = Vec::new();
    while positions.len() < 3 * n as usize {
        let mut v = |r: f32| Vec3::from_array(std::array::from_fn(|_| rng.random_range(-r..r)));
        let c = v(1.0);
        if c.length() < 1.0 {
            positions.extend([c, c + v(0.05), c + v(0.05)]);
        }
    }
    TriangleSoup {
        positions,
        triangles: (0..n).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        triangle_materials: vec![0; n as usize],
        materials: vec![Material::default()],
        ..TriangleSoup::default()
    }
}

pub(crate) fn baked(soup: &TriangleSoup, options: &BakeOptions) -> Pack {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("t.fpack");
    let mut writer = PackWriter::create(&path).unwrap();
    bake(soup, options, &mut writer, &|_| {}).unwrap();
    writer.finish().unwrap();
    Pack::from_bytes(Path::new("t.fpack"), &std::fs::read(&path).unwrap()).unwrap()
}

fn camera(distance: f64, direction: DVec3) -> Camera {
    let projection = Projection::Perspective { fov_y: 0.8 };
    Camera::new(direction * distance, -direction, projection, [800, 600])
}

/// Σ covered area (block units², opacity × footprint, mean over directions) of a cut.
fn covered(block: &PointsBlock, cut: &Cut) -> f64 {
    cut.points(block)
        .map(|(_, _, p)| {
            crate::spheroid::mean_projected_area(p.own().radius(), p.flatness_step(), p.opacity())
        })
        .sum()
}

#[test]
fn cuts_keep_the_area_at_every_distance() {
    let soup = leaves(3000, 1);
    let options = BakeOptions {
        radius: RadiusRule::Area,
        surfel_size: SurfelSize::Triangle,
        ..BakeOptions::default()
    };
    let pack = baked(&soup, &options);
    let block = PointsBlock::open(&pack).unwrap();
    let all_points = Thresholds { largest: PixelArea(f64::INFINITY), ..Thresholds::default() };
    let area = |d: f64| covered(&block, &select(&block, &camera(d, DVec3::Z), &all_points));
    let base = area(2.0);
    let mut counts = vec![];
    for d in [5.0, 10.0, 20.0, 50.0, 200.0, 1e3, 1e4] {
        let cut = select(&block, &camera(d, DVec3::Z), &all_points);
        counts.push(cut.points(&block).count());
        assert!((area(d) / base - 1.0).abs() < 0.03, "{} at {d}", area(d) / base);
    }
    assert!(counts.is_sorted_by(|a, b| a >= b), "{counts:?}");
    assert_eq!(*counts.last().unwrap(), 1);
}

#[test]
fn near_by_everything_is_a_triangle_and_far_away_nothing_is() {
    let soup = leaves(500, 2);
    let pack = baked(&soup, &BakeOptions::default());
    let block = PointsBlock::open(&pack).unwrap();
    let closest =
        Thresholds { finest: PixelArea(0.0), largest: PixelArea(0.0), ..Default::default() };
    let cut = select(&block, &camera(3.0, DVec3::X), &closest);
    assert_eq!((cut.triangle_count(), cut.points(&block).count()), (500, 0));
    let cut = select(&block, &camera(1e6, DVec3::X), &Thresholds::default());
    assert_eq!((cut.triangle_count(), cut.points(&block).count()), (0, 1));
}

#[test]
fn depth_bias_coarsens_the_back_and_refines_the_front() {
    let soup = leaves(20_000, 3);
    let pack = baked(&soup, &BakeOptions::default());
    let block = PointsBlock::open(&pack).unwrap();
    let cam = camera(8.0, DVec3::Z);
    let count = |k: f64| {
        let t = Thresholds {
            finest: PixelArea(20.0),
            largest: PixelArea(1e9),
            depth_bias: PixelArea(k),
        };
        let cut = select(&block, &cam, &t);
        let (mut front, mut back) = (0, 0);
        for (_, cell, _) in cut.points(&block) {
            if cell.center[2] > 0.0 { front += 1 } else { back += 1 }
        }
        (front, back)
    };
    let ((front0, back0), (front1, back1)) = (count(0.0), count(18.0));
    assert!(front1 > front0 && back1 < back0, "{front0} {back0} → {front1} {back1}");
}

#[test]
fn a_covered_cell_is_left_out_and_an_uncovered_one_is_not() {
    // At any distance the cut's leaves-under-points add up to all surfels: checked by area of a
    // soup of equal triangles under the area rule, cell by cell choices included.
    let soup = leaves(4000, 4);
    let options = BakeOptions { radius: RadiusRule::Area, ..BakeOptions::default() };
    let pack = baked(&soup, &options);
    let block = PointsBlock::open(&pack).unwrap();
    let base = covered(
        &block,
        &select(
            &block,
            &camera(1.5, DVec3::Z),
            &Thresholds {
                finest: PixelArea(0.0),
                largest: PixelArea(f64::INFINITY),
                depth_bias: PixelArea(0.0),
            },
        ),
    );
    for d in [1.2, 3.0, 30.0, 90.0, 300.0, 600.0] {
        for k in [0.0, 5.0, 500.0] {
            let t = Thresholds {
                finest: PixelArea(3.0),
                largest: PixelArea(f64::INFINITY),
                depth_bias: PixelArea(k),
            };
            let got = covered(&block, &select(&block, &camera(d, DVec3::new(0.6, 0.0, 0.8)), &t));
            assert!((got / base - 1.0).abs() < 0.03, "{} at {d}, k {k}", got / base);
        }
    }
}

#[test]
fn the_papers_order_draws_a_range_of_own_sizes() {
    let soup = leaves(2000, 5);
    let options =
        BakeOptions { order: Order::Paper, radius: RadiusRule::Paper, ..Default::default() };
    let pack = baked(&soup, &options);
    let block = PointsBlock::open(&pack).unwrap();
    let cam = camera(4.0, DVec3::Z);
    let t =
        Thresholds { finest: PixelArea(2.0), largest: PixelArea(30.0), depth_bias: PixelArea(0.0) };
    let cut = select(&block, &cam, &t);
    assert!(cut.points(&block).count() > 0);
    for (_, cell, p) in cut.points(&block) {
        let c = DVec3::from_array(cell.center.map(f64::from));
        let pixels = cam.pixels_per_unit(block.to_world(c).distance(cam.eye)) * block.scale();
        let area = p.own().area() * pixels * pixels;
        // Within one code of the thresholds.
        assert!((1.98..30.3).contains(&area), "{area}");
    }
}

#[test]
fn select_into_keeps_its_memory() {
    let soup = leaves(1000, 6);
    let pack = baked(&soup, &BakeOptions::default());
    let block = PointsBlock::open(&pack).unwrap();
    let mut cut = Cut::default();
    select_into(&block, &camera(3.0, DVec3::Z), &Thresholds::default(), &mut cut);
    let place = cut.cells.as_ptr();
    select_into(&block, &camera(4.0, DVec3::Z), &Thresholds::default(), &mut cut);
    assert_eq!(place, cut.cells.as_ptr());
}

proptest! {
    /// Across cells, by area: what is drawn as triangles and points adds up to the block. (That each
    /// surfel is represented exactly once within its cell is audited in `bake::audit`.)
    #[test]
    fn thresholds_of_any_size_give_a_cut(
        finest in 0.0f64..100.0, ratio in 1.0f64..50.0, k in -50.0f64..50.0, d in 0.5f64..100.0,
    ) {
        let soup = leaves(300, 7);
        let options = BakeOptions {
            radius: RadiusRule::Area,
            surfel_size: SurfelSize::Triangle,
            grid: GridChoice::Budget(8),
            ..BakeOptions::default()
        };
        let pack = baked(&soup, &options);
        let block = PointsBlock::open(&pack).unwrap();
        let t = Thresholds {
            finest: PixelArea(finest),
            largest: PixelArea(finest * ratio),
            depth_bias: PixelArea(k),
        };
        let cut = select(&block, &camera(d, DVec3::Y), &t);
        let triangles: f64 = cut
            .cells
            .iter()
            .flat_map(|c| &block.triangles[c.triangles.start as usize..c.triangles.end as usize])
            .map(|t| SizeCode::from_bits(t.size).unwrap().area() / 2.0)
            .sum();
        let all = Thresholds { finest: PixelArea(0.0), largest: PixelArea(f64::INFINITY), ..t };
        let whole = covered(&block, &select(&block, &camera(d, DVec3::Y), &Thresholds { depth_bias: PixelArea(0.0), ..all }));
        let got = covered(&block, &cut) + triangles;
        prop_assert!((got / whole - 1.0).abs() < 0.05, "{got} {whole}");
    }
}

#[test]
fn budgets_hold_and_are_used() {
    let pack = baked(&leaves(3000, 5), &BakeOptions::default());
    let block = PointsBlock::open(&pack).unwrap();
    let camera = camera(6.0, DVec3::Z);
    let drawn = |t: &Thresholds| {
        let cut = select(&block, &camera, t);
        cut.points(&block).count() as u64 + cut.triangle_count()
    };
    for most in [1, 17, 500, 2999] {
        let (thresholds, count) = within_budget(&block, &camera, 16.0, most).unwrap();
        assert_eq!(count, drawn(&thresholds));
        assert!(count <= most && (most < 20 || count * 10 > most * 9), "{count} of {most}");
    }
    let (thresholds, count) = within_budget(&block, &camera, 16.0, 3000).unwrap();
    assert_eq!((thresholds, count), (Thresholds::TRIANGLES, 3000));
    assert_eq!(drawn(&thresholds), 3000);
    assert_eq!(within_budget(&block, &camera, 16.0, 0), None);
}
