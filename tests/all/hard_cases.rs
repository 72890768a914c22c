//! Degenerate and extreme soups. Every test states the number it expects.

use forest_points::{
    BakeError, BakeOptions, BakeReport, GridChoice, PointsBlock, SurfelSize, spheroid,
};
use forest_soup::{AlphaMode, TriangleSoup};
use forest_tests::soups::{leaves, of_triangles, texture, textured};
use forest_tests::{bake_bytes, open, use_pack};
use glam::Vec3;

/// One surfel a triangle.
fn options() -> BakeOptions {
    BakeOptions { surfel_size: SurfelSize::Triangle, ..BakeOptions::default() }
}

fn bake(soup: &TriangleSoup) -> (Vec<u8>, BakeReport) {
    let (bytes, report) = bake_bytes(soup, &options()).unwrap();
    use_pack(&bytes).unwrap();
    (bytes, report)
}

/// A right triangle of legs `size` at `at`.
fn leaf(at: Vec3, size: f32) -> [Vec3; 3] {
    [at, at + Vec3::X * size, at + Vec3::Y * size]
}

/// Σ opacity × mean footprint of the surfels, in world units².
fn surfel_area(bytes: &[u8]) -> f64 {
    let pack = open(bytes).unwrap();
    let block = PointsBlock::open(&pack).unwrap();
    let area = |p: &forest_points::PointRecord| {
        spheroid::mean_projected_area(p.own().radius(), p.flatness_step(), p.opacity())
    };
    block.points.iter().filter(|p| p.is_leaf()).map(area).sum::<f64>() * block.scale().powi(2)
}

#[test]
fn nan_and_infinite_corners_are_left_out_and_counted() {
    let mut soup = leaves(10, 0.1, 1);
    soup.positions[3].x = f32::NAN;
    soup.positions[8].y = f32::INFINITY;
    let (_, report) = bake(&soup);
    assert_eq!((report.header.counts.non_finite, report.header.counts.surfels), (2, 8));
    soup.positions.fill(Vec3::NAN);
    let e = bake_bytes(&soup, &options()).unwrap_err();
    assert!(e.to_string().contains("10 with NaN or infinite corners"), "{e}");
}

#[test]
fn zero_area_and_duplicate_triangles_are_left_out_and_counted() {
    let mut triangles: Vec<[Vec3; 3]> = (0..8).map(|i| leaf(Vec3::X * i as f32, 0.5)).collect();
    let [a, b, c] = triangles[2];
    triangles.extend([[c, a, b], [a, c, b], [a, a, b], [a, (a + b) / 2.0, b]]);
    let (_, report) = bake(&of_triangles(&triangles));
    let counts = report.header.counts;
    assert_eq!((counts.duplicate, counts.zero_area, counts.surfels), (2, 2, 8));
}

#[test]
fn equal_centroids_are_halved_as_they_stand() {
    // 100 triangles about one centre: 100 → 50 → 25 → 12 13 → 6 7 → 3 4: 32 clusters, 31 above.
    let triangles: Vec<[Vec3; 3]> = (0..100)
        .map(|i| {
            let r = 0.5 + i as f32 * 0.001;
            [Vec3::X * r, Vec3::new(-0.5, 0.75, 0.0) * r, Vec3::new(-0.5, -0.75, 0.0) * r]
        })
        .collect();
    let (_, report) = bake(&of_triangles(&triangles));
    assert_eq!(report.header.counts.points, 100 + 32 + 31);
    assert_eq!(report.cells, 1);
}

#[test]
fn collinear_and_coplanar_centroids_split_evenly() {
    // 64 in a row: 16 clusters of four and 15 above them, in one cell.
    let row: Vec<[Vec3; 3]> = (0..64).map(|i| leaf(Vec3::X * i as f32, 0.5)).collect();
    let one_cell = BakeOptions { grid: GridChoice::Fixed([1, 1, 1]), ..options() };
    let (_, report) = bake_bytes(&of_triangles(&row), &one_cell).unwrap();
    assert_eq!(report.header.counts.points, 64 + 16 + 15);
    // A 16 × 8 sheet: the longer side first, then squares.
    let sheet: Vec<[Vec3; 3]> =
        (0..128).map(|i| leaf(Vec3::new((i % 16) as f32, 0.0, (i / 16) as f32), 0.5)).collect();
    let (bytes, report) = bake_bytes(&of_triangles(&sheet), &one_cell).unwrap();
    use_pack(&bytes).unwrap();
    assert_eq!(report.header.counts.surfels, 128);
    assert!(
        (32..=64).contains(&(report.header.counts.points - 128 - 31)),
        "{:?}",
        report.header.counts
    );
}

#[test]
fn an_isotropic_cloud_keeps_its_area_and_its_bytes() {
    let soup = leaves(5000, 0.02, 9);
    let truth: f64 = (0..5000)
        .map(|i| {
            let [a, b, c] = soup.corners(i).map(|p| p.as_dvec3());
            (b - a).cross(c - a).length() * 0.25 // half of its area
        })
        .sum();
    let (bytes, _) = bake(&soup);
    assert!((surfel_area(&bytes) / truth - 1.0).abs() < 1e-3, "{}", surfel_area(&bytes) / truth);
    assert_eq!(bytes, bake(&soup).0);
}

#[test]
fn needles_of_aspect_a_million_keep_area_and_line() {
    let needles: Vec<[Vec3; 3]> = (0..20)
        .map(|i| {
            let z = i as f32 * 0.05;
            [Vec3::new(0.0, 0.0, z), Vec3::new(1.0, 0.0, z), Vec3::new(0.0, 1e-6, z)]
        })
        .collect();
    let fine = BakeOptions { surfel_size: SurfelSize::Units(0.0501), ..BakeOptions::default() };
    let (bytes, report) = bake_bytes(&of_triangles(&needles), &fine).unwrap();
    assert_eq!(report.header.counts.surfels, 20 * 20);
    assert!((surfel_area(&bytes) / (20.0 * 0.25e-6) - 1.0).abs() < 0.01, "{}", surfel_area(&bytes));
}

#[test]
fn one_triangle_is_one_point_and_none_is_an_error() {
    let (_, report) = bake(&of_triangles(&[leaf(Vec3::ZERO, 1.0)]));
    assert_eq!((report.header.counts.points, report.cells), (1, 1));
    let e = bake_bytes(&of_triangles(&[]), &options()).unwrap_err();
    assert!(matches!(e, BakeError::NothingVisible(_)), "{e}");
    let point = bake_bytes(&of_triangles(&[[Vec3::ONE; 3]]), &options()).unwrap_err();
    assert!(point.to_string().contains("1 without area"), "{point}");
}

#[test]
fn a_triangle_across_all_cells_belongs_to_one_and_lies_where_it_should() {
    let mut soup = leaves(400, 0.02, 3);
    let big = [Vec3::new(-2.0, -2.0, 0.1), Vec3::new(2.0, -2.0, 0.1), Vec3::new(0.0, 2.0, 0.1)];
    let base = soup.positions.len() as u32;
    soup.positions.extend(big);
    soup.triangles.push([base, base + 1, base + 2]);
    soup.triangle_materials.push(0);
    let (bytes, report) = bake(&soup);
    assert_eq!(report.header.counts.surfels, 401);
    let pack = open(&bytes).unwrap();
    let block = PointsBlock::open(&pack).unwrap();
    let step = f64::from(block.header.step_exponent).exp2() * block.scale();
    // Its surfel is the largest; at its centroid, to half a step an axis.
    let (cell, point) = block
        .cells
        .iter()
        .flat_map(|c| block.cell_points(c).iter().map(move |p| (c, p)))
        .filter(|(_, p)| p.is_leaf())
        .max_by_key(|(_, p)| p.own())
        .unwrap();
    let at = block.to_world(block.position(cell, point.position));
    let centroid = (big[0] + big[1] + big[2]).as_dvec3() / 3.0;
    assert!((at - centroid).abs().max_element() <= 0.5 * step * 1.0001, "{at} {step}");
}

#[test]
fn vertices_rounded_far_away_are_judged_as_they_are() {
    // At 10⁶ an f32 has steps of 1/16: what is left of the leaves is baked to the last digit.
    let mut soup = leaves(500, 1.0, 5);
    soup.positions.iter_mut().for_each(|p| *p = *p * 20.0 + Vec3::splat(1e6));
    let truth: f64 = (0..500)
        .map(|i| {
            let [a, b, c] = soup.corners(i).map(|p| p.as_dvec3());
            (b - a).cross(c - a).length() * 0.25
        })
        .sum();
    let (bytes, report) = bake(&soup);
    assert_eq!(report.header.counts.surfels + report.header.counts.zero_area, 500);
    assert!((surfel_area(&bytes) / truth - 1.0).abs() < 2e-3, "{}", surfel_area(&bytes) / truth);
}

#[test]
fn opposite_normals_do_not_cancel() {
    // Two sheets back to back, wound oppositely: the block's point is still a disc along Z.
    let front = leaf(Vec3::ZERO, 1.0);
    let back = [front[0], front[2], front[1]].map(|p| p + Vec3::Z * 1e-3);
    let (bytes, report) = bake(&of_triangles(&[front, back]));
    assert_eq!(report.header.counts.points, 3);
    let pack = open(&bytes).unwrap();
    let block = PointsBlock::open(&pack).unwrap();
    let root = block.points.iter().find(|p| !p.is_leaf()).unwrap();
    assert!(root.axis().z.abs() > 0.999 && root.flatness_step() == 0);
}

#[test]
fn transparent_textures_are_an_error_and_single_texels_are_not() {
    let clear = texture(8, |_, _| [255, 255, 255, 0]);
    let soup = textured(leaves(30, 0.1, 1), clear, AlphaMode::Mask { cutoff: 0.5 });
    let e = bake_bytes(&soup, &options()).unwrap_err();
    assert!(e.to_string().contains("30 that are fully transparent"), "{e}");
    let one = texture(1, |_, _| [0, 255, 0, 128]);
    let (bytes, report) = bake(&textured(leaves(30, 0.1, 1), one, AlphaMode::Blend));
    assert_eq!(report.header.counts.surfels, 30);
    let pack = open(&bytes).unwrap();
    let block = PointsBlock::open(&pack).unwrap();
    let leaf = block.points.iter().find(|p| p.is_leaf()).unwrap();
    assert_eq!(leaf.rgb, [0, 255, 0]);
    assert!((126..=128).contains(&leaf.opacity), "{}", leaf.opacity);
}

#[test]
fn a_texture_of_8192_texels_a_side() {
    // Covered where x + y is even, in blocks of 16: half.
    let image =
        texture(8192, |x, y| [90, 120, 30, if (x / 16 + y / 16) % 2 == 0 { 255 } else { 0 }]);
    let soup = textured(leaves(40, 0.1, 1), image, AlphaMode::Mask { cutoff: 0.5 });
    let points_only = BakeOptions { triangles: false, ..options() };
    let (bytes, report) = bake_bytes(&soup, &points_only).unwrap();
    assert_eq!(report.header.counts.surfels, 40);
    let pack = open(&bytes).unwrap();
    let block = PointsBlock::open(&pack).unwrap();
    for p in block.points.iter().filter(|p| p.is_leaf()) {
        assert!((p.opacity() - 0.5).abs() < 0.02, "{}", p.opacity());
    }
}
