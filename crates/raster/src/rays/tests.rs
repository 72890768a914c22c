use super::*;
use crate::{Buffers, CaptureScene, Subject};
use crate::{Light, Sampling, Sun, rasterize};
use forest_soup::{AlphaMode, Material, Projection, Relief, Texture, Wrap};
use glam::DVec3;
use std::sync::Arc;

fn soup(triangles: &[[Vec3; 3]]) -> TriangleSoup {
    let n = triangles.len() as u32;
    TriangleSoup {
        positions: triangles.as_flattened().to_vec(),
        triangles: (0..n).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        triangle_materials: vec![0; n as usize],
        materials: vec![Material::default()],
        ..TriangleSoup::default()
    }
}

/// A horizontal square of half-width `h` at height `y`.
fn square(y: f32, h: f32) -> [[Vec3; 3]; 2] {
    let v = |x: f32, z: f32| Vec3::new(x * h, y, z * h);
    let [a, b, c, d] = [v(-1.0, -1.0), v(1.0, -1.0), v(1.0, 1.0), v(-1.0, 1.0)];
    [[a, b, c], [a, c, d]]
}

/// From above onto a picture of `height` units about the origin.
fn from_above(height: f64, side: u32) -> Camera {
    let projection = Projection::Orthographic { height };
    Camera::new(DVec3::new(0.0, 50.0, 0.0), -DVec3::Y, projection, [side; 2])
}

fn lit(to_sun: DVec3, sun: f32, sky: f32, translucency: f32) -> Style {
    let to_sun = to_sun.normalize();
    let sun = Sun { to_sun, sun: [sun; 3], sky: [sky; 3], translucency, darkest: 1.0 };
    Style { light: Light::Sun(sun), sampling: Sampling::TRUTH }
}

/// A leaf under the sun, seen from above and from below, by rays and by scanlines.
#[test]
fn light_shines_through_as_light_and_material_let_it() {
    let mut leaf = soup(&square(0.0, 4.0));
    for (of_light, of_leaf) in [(1.0, 1.0), (0.5, 1.0), (1.0, 0.25), (0.5, 0.5), (0.0, 1.0)] {
        leaf.materials[0].translucency = of_leaf;
        let surfaces = Surfaces::new(&leaf.materials, &[]);
        let style = lit(DVec3::Y, 1.0, 0.0, of_light);
        for (up, want) in [(1.0, 1.0), (-1.0, of_light * of_leaf)] {
            let projection = Projection::Orthographic { height: 1.0 };
            let camera = Camera::new(DVec3::Y * up, DVec3::NEG_Y * up, projection, [4, 4]);
            let rays = RayScene::new(&leaf, &surfaces).picture(&camera, &style);
            for picture in [rays, rasterize(&leaf, &surfaces, &camera, &style)] {
                let seen = picture.pixels[5][0];
                assert!((seen - want).abs() < 1e-5, "{of_light} {of_leaf} {up}: {seen}");
            }
        }
    }
}

#[test]
fn a_roof_throws_its_shadow_and_hides_the_sky() {
    // A floor, and above it a small roof that is out of the picture.
    let mut roof = square(4.0, 1.0).map(|t| t.map(|p| p + Vec3::X * 10.0));
    let floor = square(0.0, 40.0);
    let soup_with_roof = soup(&[floor, roof].concat());
    let surfaces = Surfaces::new(&soup_with_roof.materials, &[]);
    let scene = RayScene::new(&soup_with_roof, &surfaces);
    let camera = from_above(8.0, 32);
    // The sun shines under the roof at (10 − 4·10/4): its shadow lies about the origin, 2 × 2.
    let style = lit(DVec3::new(10.0, 4.0, 0.0), 1.0, 0.0, 0.0);
    let cos = f64::from(4.0f32) / 116.0f64.sqrt();
    let p = scene.picture(&camera, &style);
    let mean: f64 = p.pixels.iter().map(|p| f64::from(p[0])).sum::<f64>() / (32.0 * 32.0);
    assert!((mean - cos * (1.0 - 4.0 / 64.0)).abs() < 2e-3, "{mean}");
    assert_eq!(p.pixels[16 * 32 + 16][0], 0.0);
    // A square of half-width a at height h hides from a place under its middle four times
    // X/(π·√(1+X²))·atan(X/√(1+X²)) of the sky, X = a/h (a rectangle's configuration factor).
    roof = square(4.0, 2.0);
    let soup_under = soup(&[floor, roof].concat());
    let scene = RayScene::new(&soup_under, &surfaces);
    let x = 2.0 / 4.0f64;
    let root = (1.0 + x * x).sqrt();
    let quarter = 2.0 * (x / root) * (x / root).atan() / std::f64::consts::TAU;
    let eye = DVec3::new(0.0, 3.9, 0.0);
    let projection = Projection::Orthographic { height: 0.1 };
    let camera = Camera::new(eye, -DVec3::Y, projection, [16; 2]);
    // The camera is under the roof, but parallel rays start before the scene: look from below.
    let below = Camera { eye: -eye, forward: DVec3::Y, right: -camera.right, ..camera };
    let two_sided = lit(DVec3::Y, 0.0, 1.0, 0.0);
    let p = scene.picture(&below, &two_sided);
    assert!(p.pixels.iter().all(|p| p[0] == 1.0), "the floor's underside sees all of its sky");
    let perspective = Camera {
        eye,
        projection: Projection::Perspective { fov_y: 0.01 },
        ..Camera::new(eye, -DVec3::Y, projection, [32; 2])
    };
    let p = scene.picture(&perspective, &two_sided);
    let sky: f64 = p.pixels.iter().map(|p| f64::from(p[0])).sum::<f64>() / (32.0 * 32.0);
    assert!((sky - (1.0 - 4.0 * quarter)).abs() < 4e-3, "{sky} {}", 1.0 - 4.0 * quarter);
}

#[test]
fn light_shines_through_from_behind() {
    let leaf = soup(&square(0.0, 10.0));
    let surfaces = Surfaces::new(&leaf.materials, &[]);
    let scene = RayScene::new(&leaf, &surfaces);
    let style = lit(-DVec3::Y, 1.0, 0.0, 0.25);
    let p = scene.picture(&from_above(4.0, 4), &style);
    assert!(p.pixels.iter().all(|p| (p[0] - 0.25).abs() < 1e-6), "{:?}", p.pixels[0]);
    assert_eq!(p.normal[0], [0.0, 1.0, 0.0]);
    assert!(p.depth.iter().all(|d| (d - 50.0).abs() < 1e-4));
}

#[test]
fn partial_opacity_covers_its_share_both_ways() {
    let mut pane = soup(&square(0.0, 10.0));
    pane.materials[0] = Material {
        alpha_mode: AlphaMode::Blend,
        base_color: [0.5, 0.25, 1.0, 0.3],
        ..Material::default()
    };
    let surfaces = Surfaces::new(&pane.materials, &[]);
    let camera = from_above(4.0, 32);
    let style = Style::default();
    let a = rasterize(&pane, &surfaces, &camera, &style);
    let b = RayScene::new(&pane, &surfaces).picture(&camera, &style);
    assert_eq!(a.pixels, b.pixels);
    // 65,536 draws: five deviations are 0.009.
    assert!((a.mean_coverage() - 0.3).abs() < 0.009, "{}", a.mean_coverage());
    let p = a.pixels.iter().find(|p| p[3] > 0.0).unwrap();
    assert!((p[1] / p[3] - 0.25).abs() < 1e-5);
}

#[test]
fn rays_along_axes_and_scenes_of_any_size_are_seen() {
    // The library's hierarchy fails on directions with −0 and on scenes below its 10⁻⁴.
    for scale in [1e-6f32, 1.0, 1e6] {
        let tile = soup(&square(0.0, scale));
        let surfaces = Surfaces::new(&tile.materials, &[]);
        let scene = RayScene::new(&tile, &surfaces);
        for forward in [-DVec3::Y, DVec3::Y, DVec3::new(-0.0, -1.0, -0.0)] {
            let projection = Projection::Orthographic { height: 4.0 * f64::from(scale) };
            let eye = forward * (-3.0 * f64::from(scale));
            let camera = Camera::new(eye, forward, projection, [16; 2]);
            let p = scene.picture(&camera, &Style::default());
            assert!((p.mean_coverage() - 0.25).abs() < 1e-3, "{scale} {forward}");
        }
    }
}

#[test]
fn nothing_and_not_numbers_make_empty_pictures() {
    let bad = [[Vec3::NAN, Vec3::X, Vec3::Y], [Vec3::INFINITY, Vec3::X, Vec3::Z]];
    for triangles in [&[][..], &bad[..]] {
        let nothing = soup(triangles);
        let surfaces = Surfaces::new(&nothing.materials, &[]);
        let camera = from_above(4.0, 8);
        let empty = Picture::empty(8, 8);
        assert_eq!(rasterize(&nothing, &surfaces, &camera, &Style::default()), empty);
        assert_eq!(RayScene::new(&nothing, &surfaces).picture(&camera, &Style::default()), empty);
    }
}

/// Height of some hills at x, z in 0 … 1, and how it grows along both.
fn hills(x: f64, z: f64) -> (f64, f64, f64) {
    let (a, b) = (std::f64::consts::TAU * 2.0, std::f64::consts::TAU * 3.0);
    let (p, q) = (a * x + 0.4, b * z + 1.1 * (a * x).sin());
    let high = 0.02;
    let along_z = high * 0.6 * b * q.cos();
    let along_x = high * a * p.cos() + high * 0.6 * q.cos() * 1.1 * a * (a * x).cos();
    (high * (p.sin() + 0.6 * q.sin()), along_x, along_z)
}

/// A square whose bumps are those of `hills`; u grows along x, and v along z or against it.
fn bumpy(mirrored: bool) -> TriangleSoup {
    let side = 256;
    let middle = |i: u32| (f64::from(i) + 0.5) / f64::from(side);
    let texel = |i: u32| {
        let (x, v) = (middle(i % side), middle(i / side));
        let (_, along_x, along_z) = hills(x, if mirrored { 1.0 - v } else { v });
        // Up the picture is against v.
        let along_up = if mirrored { along_z } else { -along_z };
        let n = DVec3::new(-along_x, -along_up, 1.0).normalize();
        let [x, y, z] = (127.5 + n * 127.5).round().to_array().map(|v| v as u8);
        [x, y, z, 255]
    };
    let texture = Texture {
        name: "hills".into(),
        width: side,
        height: side,
        texels: (0..side * side).map(texel).collect(),
        wrap: [Wrap::Repeat; 2],
    };
    let corner = |x: f32, z: f32| Vec3::new(x - 0.5, 0.0, z - 0.5);
    let [a, b, c, d] = [corner(0., 0.), corner(1., 0.), corner(1., 1.), corner(0., 1.)];
    // Its front is above.
    let mut square = soup(&[[a, c, b], [a, d, c]]);
    let uv = |p: &Vec3| Vec2::new(p.x + 0.5, if mirrored { 0.5 - p.z } else { p.z + 0.5 });
    square.uvs = square.positions.iter().map(uv).collect();
    square.normals = vec![Vec3::Y; square.positions.len()];
    square.materials[0].relief = Some(Relief { texture: 0, scale: 1.0 });
    square.textures = vec![Arc::new(texture)];
    square
}

/// The hills themselves.
fn hilly() -> TriangleSoup {
    let n = 256;
    let place = |i: u32, j: u32| {
        let [x, z] = [i, j].map(|i| f64::from(i) / f64::from(n));
        DVec3::new(x - 0.5, hills(x, z).0, z - 0.5).as_vec3()
    };
    let cell = |k: u32| {
        let (i, j) = (k % n, k / n);
        let [a, b, c, d] = [place(i, j), place(i + 1, j), place(i + 1, j + 1), place(i, j + 1)];
        [[a, c, b], [a, d, c]]
    };
    soup((0..n * n).map(cell).collect::<Vec<_>>().as_flattened())
}

/// Normal textures are lit as the shapes they were made of, from both sides, however they are laid on: by rays
/// and by scanlines; and captures keep their normals.
#[test]
fn bumps_are_lit_as_the_hills_they_stand_for() {
    let hilly = hilly();
    let surfaces = Surfaces::new(&hilly.materials, &[]);
    let hills = RayScene::new(&hilly, &surfaces);
    for mirrored in [false, true] {
        let bumpy = bumpy(mirrored);
        let surfaces = Surfaces::new(&bumpy.materials, &bumpy.textures);
        let square = RayScene::new(&bumpy, &surfaces);
        for (up, to_sun) in [
            (1.0, DVec3::new(0.7, 1.0, 0.0)),
            (1.0, DVec3::new(0.0, 1.0, 0.7)),
            (-1.0, DVec3::new(0.5, -1.0, 0.6)),
        ] {
            let projection = Projection::Orthographic { height: 0.9 };
            let eye = DVec3::new(0.0, 5.0 * up, 0.0);
            let camera = Camera::new(eye, DVec3::NEG_Y * up, projection, [48; 2]);
            let style =
                Style { sampling: Sampling { side: 4, seed: 1 }, ..lit(to_sun, 1.0, 0.0, 0.0) };
            let want = hills.picture(&camera, &style);
            let level = to_sun.normalize().y * up;
            let spread = rms(&want, |_| level);
            assert!(spread > 0.08, "the sun shows the hills: {spread}");
            let pictures = [
                ("rays", square.picture(&camera, &style)),
                ("lines", rasterize(&bumpy, &surfaces, &camera, &style)),
            ];
            for (how, got) in pictures {
                let off = rms(&want, |p| f64::from(got.pixels[p][0]));
                assert!(off < 0.1 * spread, "{how}, {mirrored}, {to_sun}: {off} of {spread}");
            }
            let capture = CaptureScene::new(&bumpy, &surfaces);
            let got = capture.capture(&camera, 4, &mut Buffers::default()).picture;
            let toward = to_sun.normalize().as_vec3();
            let off = rms(&want, |p| f64::from(Vec3::from(got.normal[p]).dot(toward)));
            assert!(off < 0.1 * spread, "captured, {mirrored}, {to_sun}: {off} of {spread}");
        }
    }
}

fn rms(picture: &Picture, other: impl Fn(usize) -> f64) -> f64 {
    let square = |(i, p): (usize, &[f32; 4])| (f64::from(p[0]) - other(i)).powi(2);
    let sum: f64 = picture.pixels.iter().enumerate().map(square).sum();
    (sum / picture.pixels.len() as f64).sqrt()
}
