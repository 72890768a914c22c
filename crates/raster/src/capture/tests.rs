use super::*;
use crate::{Sampling, Style, rasterize};
use forest_soup::{AlphaMode, Material};
use glam::Vec2;

/// A crown of small leaves about a trunk, some of them half transparent, vertex colours and all.
fn tree() -> TriangleSoup {
    let mut soup = TriangleSoup {
        origin: DVec3::new(3e5, 0.0, -7.0),
        materials: vec![
            Material { base_color: [0.4, 0.3, 0.2, 1.0], ..Material::default() },
            Material {
                base_color: [0.2, 0.6, 0.1, 0.7],
                alpha_mode: AlphaMode::Blend,
                ..Material::default()
            },
        ],
        ..TriangleSoup::default()
    };
    let mut triangle = |corners: [Vec3; 3], material: u16, shade: f32| {
        let first = soup.positions.len() as u32;
        soup.positions.extend(corners);
        soup.normals.extend([Vec3::ZERO; 3]);
        soup.uvs.extend([Vec2::ZERO; 3]);
        soup.colors.extend([[shade, 1.0, 1.0, 1.0]; 3]);
        soup.triangles.push([first, first + 1, first + 2]);
        soup.triangle_materials.push(material);
    };
    let foot = [Vec3::new(-0.1, 0.0, 0.0), Vec3::new(0.1, 0.0, 0.05), Vec3::new(0.0, 3.0, 0.0)];
    triangle(foot, 0, 1.0);
    triangle([Vec3::new(0.0, 0.0, -0.1), Vec3::new(0.0, 0.0, 0.1), foot[2]], 0, 0.5);
    for i in 0..900 {
        let t = i as f32;
        let turn = Vec3::new((t * 2.4).sin(), (t * 0.713).sin(), (t * 2.4).cos());
        let at = Vec3::new(0.0, 2.4, 0.0) + turn * (0.3 + 0.7 * (t * 0.37).sin().abs());
        let side = Vec3::new((t * 1.7).cos(), (t * 0.9).sin(), (t * 2.1).sin()) * 0.09;
        let other = side.any_orthonormal_vector() * 0.07;
        triangle([at - side, at + side, at + other], u16::from(i % 3 == 0), (i % 7) as f32 / 7.0);
    }
    soup
}

fn camera(from: DVec3, side: u32) -> Camera {
    let eye = DVec3::new(3e5, 1.7, -7.0) + from * 5.0;
    Camera::new(eye, -from, Projection::Orthographic { height: 4.0 }, [side; 2])
}

#[test]
fn captures_are_the_truth_at_sixteen_samples() {
    let soup = tree();
    let surfaces = Surfaces::new(&soup.materials, &soup.textures);
    let scene = CaptureScene::new(&soup, &surfaces);
    let mut buffers = Buffers::default();
    for from in [DVec3::Z, DVec3::Y, DVec3::new(0.5, 0.3, -0.8).normalize()] {
        let camera = camera(from, 96);
        let got = scene.capture(&camera, 4, &mut buffers).picture;
        let style = Style { sampling: Sampling { side: 16, seed: 3 }, ..Style::default() };
        let want = rasterize(&soup, &surfaces, &camera, &style);
        assert!((got.mean_coverage() - want.mean_coverage()).abs() < 0.001);
        let (mut square, mut depth, mut normal, mut n) = (0.0, 0.0, 0.0, 0.0);
        for (i, (g, w)) in got.pixels.iter().zip(&want.pixels).enumerate() {
            square += (0..4).map(|k| f64::from(g[k] - w[k]).powi(2)).sum::<f64>() / 4.0;
            let both = f64::from(g[3].min(w[3]));
            // The hash rule takes other samples: only its mean is the same.
            if both > 0.5 {
                depth += both * f64::from((got.depth[i] - want.depth[i]).abs());
                let [a, b] = [&got, &want].map(|p| Vec3::from_array(p.normal[i]));
                normal += f64::from((a - b).length());
                n += both;
            }
        }
        let rmse = (square / got.pixels.len() as f64).sqrt();
        assert!(rmse < 0.02, "{from}: {rmse}");
        // From above the leaves are seen edge-on: few pixels are half covered.
        let [depth, normal] = [depth, normal].map(|sum| sum / f64::max(n, 100.0));
        assert!(depth < 0.04 && normal < 0.1, "{from}: {depth} {normal}");
    }
}

#[test]
fn buffers_forget_what_was_drawn_before() {
    let soup = tree();
    let surfaces = Surfaces::new(&soup.materials, &soup.textures);
    let scene = CaptureScene::new(&soup, &surfaces);
    let fresh = scene.capture(&camera(DVec3::X, 40), 4, &mut Buffers::default());
    let mut used = Buffers::default();
    for (from, side) in [(DVec3::Y, 40), (DVec3::Z, 64), (DVec3::X, 40)] {
        let got = scene.capture(&camera(from, side), 4, &mut used);
        if from == DVec3::X {
            assert_eq!(got, fresh);
        }
    }
}

#[test]
fn a_long_triangle_is_cut_as_exactly_as_a_short_one() {
    // Two triangles share a slanting edge across the whole picture: no gap, nothing twice.
    let soup = TriangleSoup {
        positions: vec![
            Vec3::new(-2.0, -2.0, 0.0),
            Vec3::new(2.0, -1.9, 0.0),
            Vec3::new(2.0, 2.0, 0.0),
            Vec3::new(-2.0, 2.0, 0.0),
        ],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        triangle_materials: vec![0; 2],
        materials: vec![Material::default()],
        ..TriangleSoup::default()
    };
    let surfaces = Surfaces::new(&soup.materials, &soup.textures);
    let scene = CaptureScene::new(&soup, &surfaces);
    let projection = Projection::Orthographic { height: 3.0 };
    let camera = Camera::new(DVec3::Z * 3.0, -DVec3::Z, projection, [77; 2]);
    let got = scene.capture(&camera, 4, &mut Buffers::default()).picture;
    assert_eq!(got.mean_coverage(), 1.0);
    assert!(got.depth.iter().all(|d| (d - 3.0).abs() < 1e-6));
}

#[test]
fn a_floor_under_a_roof_sees_no_sky() {
    let square = |y: f32, half: f32| {
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(x, z)| Vec3::new(x * half, y, z * half))
    };
    let soup = TriangleSoup {
        positions: [square(0.0, 0.2), square(0.5, 4.0)].concat(),
        triangles: vec![[0, 2, 1], [0, 3, 2], [4, 6, 5], [4, 7, 6]],
        triangle_materials: vec![0; 4],
        materials: vec![Material::default()],
        ..TriangleSoup::default()
    };
    let surfaces = Surfaces::new(&soup.materials, &soup.textures);
    let scene = CaptureScene::new(&soup, &surfaces).with_skylight();
    let sky = scene.skylight.as_ref().unwrap();
    for (i, t) in (0..).zip(&scene.triangles) {
        assert!(t.own.y > 0.9, "{}", t.own);
        let floor = t.id < 2;
        // From the floor the roof, 8 by 8 at height ½, leaves about 1/65 of the cosine.
        let (above, below) = (sky.mean(i, true), sky.mean(i, false));
        if floor {
            assert!(above < 0.05, "{above}");
        } else {
            assert!(above > 0.99, "{above}");
        }
        assert!(below > if floor { 0.99 } else { 0.9 }, "{below}");
    }
}

#[test]
fn deep_pictures_know_each_slab_and_agree_with_the_flat_one() {
    // Walls at z = 0, −1 and −1.02: the last two lie in one slab.
    let wall = |z: f32| {
        [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
            .map(|[x, y]: [f32; 2]| Vec3::new(x, y, z))
    };
    let soup = TriangleSoup {
        positions: [wall(0.0), wall(-1.0), wall(-1.02)].concat(),
        triangles: (0..3)
            .flat_map(|w| [[4 * w, 4 * w + 1, 4 * w + 2], [4 * w, 4 * w + 2, 4 * w + 3]])
            .collect(),
        triangle_materials: vec![0; 6],
        materials: vec![Material { base_color: [0.5, 0.25, 0.0, 1.0], ..Material::default() }],
        ..TriangleSoup::default()
    };
    let surfaces = Surfaces::new(&soup.materials, &soup.textures);
    let scene = CaptureScene::new(&soup, &surfaces);
    let projection = Projection::Orthographic { height: 4.0 };
    let camera = Camera::new(DVec3::new(0.0, 0.0, 5.0), -DVec3::Z, projection, [32, 32]);
    let mut buffers = Buffers::default();
    let flat = scene.capture(&camera, 1, &mut buffers).picture;
    let deep = scene.deep(&camera, 0.6, &mut buffers);
    let mut seen = 0;
    for pixel in 0..32 * 32 {
        let hits = deep.hits(pixel);
        assert_eq!(hits.first().map_or(f32::INFINITY, |h| h.depth), flat.depth[pixel]);
        if let [a, b] = hits {
            assert!((a.depth - 5.0).abs() < 1e-5 && (b.depth - 6.0).abs() < 1e-5, "{hits:?}");
            assert_eq!(a.rgb, [188, 137, 0]);
            assert!(deep.slab(f64::from(b.depth)) > deep.slab(f64::from(a.depth)));
            seen += 1;
        } else {
            assert!(hits.is_empty(), "{hits:?}");
        }
    }
    assert_eq!(seen, 256);
}
