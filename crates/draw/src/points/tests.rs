use super::*;
use forest_pack::{Pack, PackWriter};
use forest_points::{BakeOptions, PixelArea, SurfelSize, bake};
use forest_raster::rasterize;
use forest_soup::{AlphaMode, Material, Projection, Texture, TriangleSoup, Wrap};
use glam::{DVec3, Vec3};
use std::sync::Arc;

/// A unit square in the XY plane, textured with a checker of covered and bare quarters.
fn card() -> TriangleSoup {
    let texels = (0..64u32 * 64)
        .map(|i| [200, 40, 20, if (i % 64 / 32 + i / 64 / 32) % 2 == 0 { 255 } else { 0 }])
        .collect();
    TriangleSoup {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y],
        uvs: vec![Vec2::Y, Vec2::ONE, Vec2::X, Vec2::ZERO],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        triangle_materials: vec![0, 0],
        materials: vec![Material {
            texture: Some(0),
            alpha_mode: AlphaMode::Mask { cutoff: 0.5 },
            ..Material::default()
        }],
        textures: vec![Arc::new(Texture {
            name: "checker".into(),
            width: 64,
            height: 64,
            texels,
            wrap: [Wrap::Clamp; 2],
        })],
        ..TriangleSoup::default()
    }
}

fn baked(soup: &TriangleSoup, size: f64) -> Pack {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("t.fpack");
    let mut writer = PackWriter::create(&path).unwrap();
    let options = BakeOptions { surfel_size: SurfelSize::Units(size), ..BakeOptions::default() };
    bake(soup, &options, &mut writer, &|_| {}).unwrap();
    writer.finish().unwrap();
    Pack::from_bytes(&path, &std::fs::read(&path).unwrap()).unwrap()
}

fn picture(pack: &Pack, forward: DVec3, largest: f64, projection: Projection) -> (Picture, Drawn) {
    let block = PointsBlock::open(pack).unwrap();
    let (materials, textures) = read_materials(pack).unwrap();
    let surfaces = Surfaces::new(&materials, &textures);
    let eye = DVec3::new(0.5, 0.5, 0.0) - forward * 2.0;
    let camera = Camera::new(eye, forward, projection, [64, 64]);
    let t = Thresholds {
        finest: PixelArea(0.0),
        largest: PixelArea(largest),
        depth_bias: PixelArea(0.0),
    };
    draw_points(&block, Some(&surfaces), &camera, &t, Style::default())
}

const ORTHO: Projection = Projection::Orthographic { height: 2.0 };

#[test]
fn triangles_cover_what_their_texture_shows() {
    let pack = baked(&card(), 0.02);
    let (p, drawn) = picture(&pack, -DVec3::Z, 0.0, ORTHO);
    assert_eq!(drawn, Drawn { points: 0, triangles: 2 });
    // Half of a quarter of the picture.
    assert!((p.mean_coverage() - 0.125).abs() < 0.002, "{}", p.mean_coverage());
    // The texture's covered top left quarter is at the top left of the square.
    assert_eq!(p.pixels[20 * 64 + 20][3], 1.0);
    assert_eq!(p.pixels[20 * 64 + 40][3], 0.0);
    assert!((p.pixels[20 * 64 + 20][0] - srgb8_to_linear(200)).abs() < 0.01);
}

#[test]
fn points_cover_as_much_as_triangles_from_every_side() {
    let pack = baked(&card(), 0.01);
    for forward in [-DVec3::Z, DVec3::new(-0.6, 0.0, -0.8), DVec3::new(0.9, 0.3, -0.3).normalize()]
    {
        let (points, drawn) = picture(&pack, forward, f64::INFINITY, ORTHO);
        let (truth, _) = picture(&pack, forward, 0.0, ORTHO);
        assert!(drawn.points > 100 && drawn.triangles == 0);
        // Discs of the triangles' area lie over each other and leave gaps: less than the sum.
        let ratio = points.mean_coverage() / truth.mean_coverage();
        assert!((0.7..1.01).contains(&ratio), "{ratio}");
    }
}

#[test]
fn triangles_of_a_pack_are_those_of_its_source() {
    let soup = card();
    let pack = baked(&soup, 0.02);
    for projection in [ORTHO, Projection::Perspective { fov_y: 0.9 }] {
        let (p, _) = picture(&pack, DVec3::new(-0.5, 0.2, -0.8).normalize(), 0.0, projection);
        let surfaces = Surfaces::new(&soup.materials, &soup.textures);
        let forward = DVec3::new(-0.5, 0.2, -0.8).normalize();
        let eye = DVec3::new(0.5, 0.5, 0.0) - forward * 2.0;
        let camera = Camera::new(eye, forward, projection, [64, 64]);
        let truth = rasterize(&soup, &surfaces, &camera, &Style::default());
        let differing = p.pixels.iter().zip(&truth.pixels).filter(|(a, b)| a != b).count();
        assert!(differing < 40, "{differing}"); // quantised corners move the edges
        assert!((p.mean_coverage() - truth.mean_coverage()).abs() < 1e-4);
    }
}

#[test]
fn perspective_and_parallel_pictures_agree_far_away() {
    let pack = baked(&card(), 0.05);
    let fov_y = 2.0 * (0.5f64).atan(); // 2 units tall at distance 2
    let (a, _) = picture(&pack, -DVec3::Z, 0.0, ORTHO);
    let (b, _) = picture(&pack, -DVec3::Z, 0.0, Projection::Perspective { fov_y });
    assert!((a.mean_coverage() - b.mean_coverage()).abs() < 1e-3);
}

#[test]
fn an_eye_inside_the_block_clips_what_is_behind_it() {
    let mut soup = card();
    soup.materials[0] = Material::default();
    for p in &mut soup.positions {
        *p = Vec3::new((p.x - 0.5) * 10.0 + 0.5, 0.0, (p.y - 0.5) * 10.0); // a floor
    }
    let pack = baked(&soup, 0.5);
    let block = PointsBlock::open(&pack).unwrap();
    let (materials, textures) = read_materials(&pack).unwrap();
    let surfaces = Surfaces::new(&materials, &textures);
    let projection = Projection::Perspective { fov_y: 1.0 };
    let camera = Camera::new(DVec3::new(0.5, 0.5, 0.0), -DVec3::Z, projection, [32, 32]);
    let t =
        Thresholds { finest: PixelArea(0.0), largest: PixelArea(0.0), depth_bias: PixelArea(0.0) };
    let (p, _) = draw_points(&block, Some(&surfaces), &camera, &t, Style::default());
    // The floor below the horizon, nothing above; its far edge is 5 units away, 0.5 down.
    let rows: Vec<f32> = p.pixels.chunks(32).map(|r| r[16][3]).collect();
    assert!(
        rows[..16].iter().all(|&c| c == 0.0) && rows[20..].iter().all(|&c| c == 1.0),
        "{rows:?}"
    );
}

/// The baker measures unions with [`Footprint::contains`]; the canvas has the same ellipse in single
/// precision about each pixel.
#[test]
fn the_canvas_fills_the_footprint_that_the_baker_measures_with() {
    let camera = Camera::new(DVec3::Z, -DVec3::Z, ORTHO, [32, 32]);
    let style =
        Style { sampling: forest_raster::Sampling { side: 16, seed: 1 }, ..Style::default() };
    for (axis, step) in [
        (DVec3::Z, 0),
        (DVec3::new(0.6, 0.3, 0.4), 0),
        (DVec3::new(-0.2, 0.9, 0.3), 40),
        (DVec3::new(0.9, -0.1, 0.05), 3),
        (DVec3::X, 127),
    ] {
        let center = DVec2::new(15.3, 16.8);
        let plane = [camera.right, -camera.up];
        let f = Footprint::new(center, 9.0, step, axis.normalize(), DVec3::Z, plane);
        let ellipse = Ellipse {
            id: 0,
            center,
            radius: f.radius,
            minor: f.minor,
            ratio: f.ratio,
            depth: 1.0,
            opacity: 255,
            rgb: [1.0; 3],
            normal: Vec3::Z,
        };
        let drawn = draw(&DisplayList::of_ellipses(vec![ellipse]), &camera, &style);
        let n = 64;
        for (i, pixel) in (0..).zip(&drawn.pixels) {
            let corner = DVec2::new(f64::from(i % 32), f64::from(i / 32));
            let inside = (0..n * n).filter(|s| {
                let within = DVec2::new(f64::from(s % n) + 0.5, f64::from(s / n) + 0.5);
                f.contains(corner + within / f64::from(n))
            });
            let want = inside.count() as f32 / (n * n) as f32;
            // 256 samples in strata against 4,096 on a grid: the strata that an edge crosses differ.
            assert!((pixel[3] - want).abs() < 0.05, "{axis} {step} {i}: {} {want}", pixel[3]);
        }
    }
}
