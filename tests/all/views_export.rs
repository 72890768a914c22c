//! Exports: every tile of a preset shows what its engine's shader expects there.

use crate::support::{arg, repo, run, succeed};
use forest_export::{Engine, ExportFile, PlainFormat, for_engine, plain};
use forest_soup::{TriangleSoup, srgb8_to_linear};
use forest_tests::soups::of_triangles;
use forest_tests::{bake_views, open};
use forest_views::{Channel, Directions, Dome, Layout, Quality, ViewsBlock, ViewsOptions, decode};
use glam::{DVec3, Vec3};

/// A ball whose colour is its normal: ½ + ½·n, linear.
fn compass() -> TriangleSoup {
    let mut triangles = vec![];
    let place = |i: i32, j: i32| {
        let (up, around) = (f32::to_radians(i as f32 * 7.5), f32::to_radians(j as f32 * 7.5));
        Vec3::new(around.sin() * up.cos(), up.sin(), around.cos() * up.cos())
    };
    for i in -12..12 {
        for j in 0..48 {
            let [a, b, c, d] =
                [(i, j), (i, j + 1), (i + 1, j + 1), (i + 1, j)].map(|p| place(p.0, p.1));
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    let mut soup = of_triangles(&triangles);
    let color = |p: &Vec3| (*p * 0.5 + 0.5).extend(1.0).to_array();
    soup.colors = soup.positions.iter().map(color).collect();
    soup.normals = soup.positions.clone();
    soup
}

fn baked(side: u32, dome: Dome) -> Vec<u8> {
    let options = ViewsOptions {
        directions: Directions { layout: Layout::Octahedral { side }, dome },
        texels: 32,
        quality: Quality::Lossless,
        ..ViewsOptions::default()
    };
    bake_views(&compass(), &options).unwrap()
}

fn exported(bytes: &[u8], engine: Engine) -> Vec<ExportFile> {
    let pack = open(bytes).unwrap();
    for_engine(&ViewsBlock::open(&pack).unwrap(), engine, "ball").unwrap()
}

fn picture(files: &[ExportFile], name: &str) -> image::RgbaImage {
    let file = files.iter().find(|f| f.name == name).unwrap_or_else(|| panic!("no {name}"));
    image::load_from_memory(&file.bytes).unwrap().to_rgba8()
}

/// The normal that the colour of a texel says.
fn shown(image: &image::RgbaImage, x: u32, y: u32) -> DVec3 {
    let [r, g, b, a] = image.get_pixel(x, y).0;
    assert!(a > 200, "nothing at {x}, {y}");
    DVec3::from([r, g, b].map(|c| f64::from(srgb8_to_linear(c)) * 2.0 - 1.0)).normalize()
}

/// What an engine's shader takes tile (column, row from the top) of n × n for: direction to the
/// camera, right and up of the image. Written down from each shader's source, not from ours.
fn expected(engine: Engine, column: u32, row: u32, n: u32) -> [DVec3; 3] {
    let at = |i: u32| f64::from(i) / f64::from(n - 1);
    match engine {
        // Shader rows count from the bottom of a flipped texture; up switches at the pole.
        Engine::Three => {
            let (u, v) = (at(column), at(n - 1 - row));
            let (x, z) = (u - v, u + v - 1.0);
            let d = DVec3::new(x, 1.0 - x.abs() - z.abs(), z).normalize();
            let up = if d.y > 0.999 { DVec3::NEG_X } else { DVec3::Y };
            let right = up.cross(d).normalize();
            [d, right, d.cross(right)]
        }
        Engine::Godot => {
            let (u, v) = (at(column), at(row));
            let (x, z) = (u - v, u + v - 1.0);
            let d = DVec3::new(x, 1.0 - x.abs() - z.abs(), z).normalize();
            let up = if d.y.abs() > 0.999 { DVec3::Z } else { DVec3::Y };
            let right = up.cross(d).normalize();
            [d, right, d.cross(right)]
        }
        // z up, left-handed: (x, y, z) there is (x, z, y) here. At the pole the limit from a tile
        // that is nearly there.
        Engine::Unreal => {
            let (u, v) = (at(column), at(row));
            let (x, y) = (u + v - 1.0, u - v);
            let z = 1.0 - x.abs() - y.abs();
            let d = DVec3::new(x, y, z).normalize();
            let near = if d.z > 0.999 { DVec3::new(1e-3, 0.0, 1.0).normalize() } else { d };
            // The left-handed cross product of n and up.
            let right = DVec3::Z.cross(near).normalize() * -1.0;
            let up = near.cross(right) * -1.0;
            let up = if up.z < 0.0 { -up } else { up };
            [d, right, up].map(|p| DVec3::new(p.x, p.z, p.y))
        }
    }
}

#[test]
fn every_tile_faces_where_its_engine_looks() {
    for n in [3, 4, 6] {
        let bytes = baked(n, Dome::Upper);
        for (engine, file) in [
            (Engine::Three, "albedo.png"),
            (Engine::Godot, "result_albedo.png"),
            (Engine::Unreal, "T_ball_Impostor_BaseColor.png"),
        ] {
            let image = picture(&exported(&bytes, engine), file);
            assert_eq!((image.width(), image.height()), (32 * n, 32 * n));
            for row in 0..n {
                for column in 0..n {
                    let [d, right, up] = expected(engine, column, row, n);
                    let (x, y) = (column * 32 + 16, row * 32 + 16);
                    let name = format!("{engine:?} {n}: column {column}, row {row}");
                    assert!(shown(&image, x, y).dot(d) > 0.98, "{name}: {}", shown(&image, x, y));
                    let to_right = shown(&image, x + 10, y) - shown(&image, x - 10, y);
                    assert!(to_right.normalize().dot(right) > 0.98, "{name}: {to_right} {right}");
                    let to_top = shown(&image, x, y - 10) - shown(&image, x, y + 10);
                    assert!(to_top.normalize().dot(up) > 0.98, "{name}: {to_top} {up}");
                }
            }
        }
    }
}

#[test]
fn a_full_sphere_is_for_godot() {
    let bytes = baked(5, Dome::Full);
    let image = picture(&exported(&bytes, Engine::Godot), "result_albedo.png");
    // Its full-sphere decode: x, z = 2·uv − 1, folded where y < 0.
    for (column, row, want) in [
        (2, 2, DVec3::Y),
        (0, 0, DVec3::NEG_Y),
        (4, 0, DVec3::NEG_Y),
        (2, 0, DVec3::NEG_Z),
        (0, 2, DVec3::NEG_X),
        (1, 1, DVec3::new(-1.0, 0.0, -1.0).normalize()),
    ] {
        let got = shown(&image, column * 32 + 16, row * 32 + 16);
        assert!(got.dot(want) > 0.98, "{column} {row}: {got}");
    }
    let pack = open(&bytes).unwrap();
    let block = ViewsBlock::open(&pack).unwrap();
    for engine in [Engine::Three, Engine::Unreal] {
        let message = for_engine(&block, engine, "ball").unwrap_err().to_string();
        assert!(message.contains("above the horizon"), "{message}");
    }
}

#[test]
fn normals_depth_and_occlusion_are_packed_as_each_shader_reads_them() {
    let n = 4;
    let bytes = baked(n, Dome::Upper);
    let near = |got: [u8; 4], want: [f64; 4], what: &str| {
        for (g, w) in got.iter().zip(want) {
            assert!((f64::from(*g) - w).abs() <= 8.0, "{what}: {got:?} {want:?}");
        }
    };
    let code = |v: f64| (v * 0.5 + 0.5) * 255.0;
    let three = picture(&exported(&bytes, Engine::Three), "normalDepth.png");
    let unreal = picture(&exported(&bytes, Engine::Unreal), "T_ball_Impostor_Normal.png");
    let godot = exported(&bytes, Engine::Godot);
    let (normal, depth) =
        (picture(&godot, "result_normal.png"), picture(&godot, "result_depth.png"));
    let orm = picture(&godot, "result_orm.png");
    for row in 0..n {
        for column in 0..n {
            let (x, y) = (column * 32 + 16, row * 32 + 16);
            // The middle faces the camera and lies half a tile before the plane; right of it the
            // normal turns right.
            near(three.get_pixel(x, y).0, [128.0, 128.0, 255.0, 255.0], "three");
            let [r, _, _, _] = three.get_pixel(x + 8, y).0;
            assert!(r > 170, "{r}");
            let d = expected(Engine::Unreal, column, row, n)[0];
            near(unreal.get_pixel(x, y).0, [code(d.x), code(d.z), code(d.y), 255.0], "unreal");
            near(normal.get_pixel(x, y).0, [128.0, 128.0, 0.0, 255.0], "godot");
            let [r, _, _, _] = normal.get_pixel(x + 8, y).0;
            assert!(r < 85, "{r}");
            assert!(depth.get_pixel(x, y).0[0] < 8, "{:?}", depth.get_pixel(x, y));
            // Depth goes on behind the silhouette, for parallax.
            assert!(depth.get_pixel(column * 32, row * 32).0[0] < 128);
            // A ball alone sees all of the sky.
            near(orm.get_pixel(x, y).0, [250.0, 255.0, 0.0, 255.0], "orm");
        }
    }
}

#[test]
fn plain_files_open_in_other_readers() {
    let pack_bytes = baked(3, Dome::Upper);
    let pack = open(&pack_bytes).unwrap();
    let block = ViewsBlock::open(&pack).unwrap();
    let files = plain(&block, &[PlainFormat::Png], "ball").unwrap();
    let names: Vec<&str> = files.iter().map(|f| f.name.as_str()).collect();
    let all =
        ["ball_color.png", "ball_normal.png", "ball_depth.png", "ball_ao.png", "ball.views.json"];
    assert_eq!(names, all);
    // Views in order from the top left: row 0 of the grid first, object-space normals.
    let normal = picture(&files, "ball_normal.png");
    let [r, g, b, _] = normal.get_pixel(16, 16).0;
    assert!(r.abs_diff(128) < 8 && g.abs_diff(128) < 8 && b < 8, "{r} {g} {b}"); // −Z
    let side: serde_json::Value = serde_json::from_slice(&files[4].bytes).unwrap();
    assert_eq!(side["tiles"][0]["toCamera"][2], -1.0);

    let exr = plain(&block, &[PlainFormat::Exr], "ball").unwrap();
    let path = tempfile::tempdir().unwrap().keep().join(&exr[0].name);
    std::fs::write(&path, &exr[0].bytes).unwrap();
    let read = exr::prelude::read_first_flat_layer_from_file(&path).unwrap();
    let mut channels: Vec<String> =
        read.layer_data.channel_data.list.iter().map(|c| c.name.to_string()).collect();
    channels.sort();
    assert_eq!(channels, ["A", "B", "G", "N.X", "N.Y", "N.Z", "R", "Z", "sky"]);
    let plane = |name: &str| {
        let list = &read.layer_data.channel_data.list;
        let channel = list.iter().find(|c| c.name.eq(name)).unwrap();
        channel.sample_data.values_as_f32().collect::<Vec<_>>()
    };
    // The front of the ball is a radius before the middle.
    let at = 16 * 96 + 16;
    assert!((plane("Z")[at] + 1.0).abs() < 0.02 && plane("Z")[0] == f32::INFINITY);
    assert!((plane("N.Z")[at] + 1.0).abs() < 0.02 && (plane("A")[at] - 1.0).abs() < 1e-3);

    for file in plain(&block, &[PlainFormat::Ktx2], "ball").unwrap() {
        if file.name.ends_with(".ktx2") {
            let reader = ktx2::Reader::new(&file.bytes).unwrap();
            let h = reader.header();
            assert_eq!((h.layer_count, h.level_count, h.pixel_width), (9, 6, 32), "{}", file.name);
        }
    }
}

#[test]
fn texture_arrays_keep_coverage_at_every_mip() {
    let options = ViewsOptions {
        directions: Directions::octahedral(9, Dome::Upper),
        texels: 64,
        quality: Quality::Lossless,
        ..ViewsOptions::default()
    };
    let bytes = bake_views(&forest_tests::soups::leaves(3000, 0.03, 9), &options).unwrap();
    let pack = open(&bytes).unwrap();
    let block = ViewsBlock::open(&pack).unwrap();
    let files = plain(&block, &[PlainFormat::Ktx2, PlainFormat::Png], "leaves").unwrap();
    let color = files.iter().find(|f| f.name == "leaves_color.ktx2").unwrap();
    let reader = ktx2::Reader::new(&color.bytes).unwrap();
    // Area of the texels of all layers that pass a test at ½.
    let passing: Vec<f64> = reader
        .levels()
        .enumerate()
        .map(|(i, level)| {
            let (side, stored) = (64u32 >> i, (64u32 >> i).max(4));
            let texels = decode(Channel::Color, Quality::Block, stored, level.data);
            let seen = |(k, t): &(usize, &[u8; 4])| {
                let (x, y) = (*k as u32 % stored, *k as u32 / stored % stored);
                x < side && y < side && t[3] >= 128
            };
            let count = texels.as_chunks::<4>().0.iter().enumerate().filter(seen).count();
            count as f64 / f64::from(side * side)
        })
        .collect();
    for (i, p) in passing[..4].iter().enumerate() {
        assert!((p / passing[0] - 1.0).abs() < 0.05, "mip {i}: {passing:?}");
    }
    let side = files.iter().find(|f| f.name == "leaves.views.json").unwrap();
    let side: serde_json::Value = serde_json::from_slice(&side.bytes).unwrap();
    let cutoff = |name: &str| {
        let list = side["files"].as_array().unwrap();
        list.iter().find(|f| f["name"] == name).unwrap()["alphaCutoff"].clone()
    };
    assert_eq!(
        (cutoff("leaves_color.ktx2"), cutoff("leaves_color.png")),
        (0.5.into(), serde_json::Value::Null)
    );
}

#[test]
fn the_program_exports_and_refuses() {
    let dir = tempfile::tempdir().unwrap();
    let file = |name: &str| arg(&dir.path().join(name));
    let (pack, out) = (file("t.fpack"), file("out"));
    let tree = arg(&repo("sample-data/shrub.obj"));
    succeed(&["views", &tree, "-o", &pack, "--views", "9", "--texels", "16"]);
    succeed(&["export", &pack, "-o", &out, "--for", "godot", "--format", "ktx2,exr,png"]);
    for name in ["result_albedo.png", "t.impostor.json", "t_color.ktx2", "t.exr", "t_depth.png"] {
        assert!(dir.path().join("out").join(name).exists(), "{name}");
    }
    let (code, _, err) = run(&["export", &pack, "-o", &out, "--for", "godot"]);
    assert!(code == 1 && err.contains("give --force to replace it"), "{code} {err}");
    succeed(&["views", &tree, "-o", &pack, "--layout", "rings:2x6", "--texels", "16", "--force"]);
    let (code, _, err) = run(&["export", &pack, "-o", &out, "--for", "three"]);
    assert!(code == 5 && err.contains("bake with --layout octahedral"), "{code} {err}");
    let points = file("p.fpack");
    succeed(&["points", &tree, "-o", &points]);
    let (code, _, err) = run(&["export", &points, "-o", &out, "--for", "three"]);
    assert!(code == 3 && err.contains("views.header"), "{code} {err}");
}

#[test]
fn points_are_written_as_splats_that_cover_what_they_cover() {
    let dir = tempfile::tempdir().unwrap();
    let file = |name: &str| arg(&dir.path().join(name));
    let (pack, out) = (file("t.fpack"), file("out"));
    succeed(&["points", &arg(&repo("sample-data/shrub.obj")), "-o", &pack]);
    let rows = |more: &[&str]| -> Vec<[f32; 17]> {
        succeed(&[&["export", &pack, "--format", "ply", "-o", &out, "--force"][..], more].concat());
        let bytes = std::fs::read(dir.path().join("out/t.ply")).unwrap();
        let end = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
        let header = std::str::from_utf8(&bytes[..end]).unwrap();
        assert!(header.starts_with("ply\nformat binary_little_endian 1.0\nelement vertex "));
        assert_eq!(header.matches("property float").count(), 17);
        let floats: Vec<f32> =
            bytes[end..].as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
        let rows = floats.as_chunks::<17>().0.to_vec();
        assert!(header.contains(&format!("element vertex {}\n", rows.len())));
        rows
    };
    let opacity = |r: &[f32; 17]| 1.0 / (1.0 + f64::from(-r[9]).exp());
    // Face-on: 2πσ² at full opacity.
    let area = |rows: &[[f32; 17]]| -> f64 {
        let of = |r: &[f32; 17]| std::f64::consts::TAU * f64::from(2.0 * r[10]).exp() * opacity(r);
        rows.iter().map(of).sum()
    };
    let (all, few) = (rows(&[]), rows(&["--points", "500"]));
    assert!(all.len() > 5000 && (250..=500).contains(&few.len()), "{} {}", all.len(), few.len());
    // Triangles of the source: 1516 halves of leaf cards, of which textures cover a quarter, and twigs.
    let soup = forest_import::Block::parse(&[arg(&repo("sample-data/shrub.obj"))]).unwrap();
    let soup =
        soup.load(&forest_import::Limits::default()).unwrap().model.flatten(1 << 20).unwrap();
    let surface: f64 = (0..soup.triangles.len())
        .map(|i| {
            let [a, b, c] = soup.corners(i).map(|p| p.as_dvec3());
            let leaf = soup.materials[soup.triangle_materials[i] as usize].name == "leaves";
            0.5 * (b - a).cross(c - a).length() * if leaf { 0.26 } else { 1.0 }
        })
        .sum();
    let ratio = area(&all) / surface;
    assert!((0.8..1.2).contains(&ratio), "{ratio}");
    let bounds = soup.bounds();
    for r in &all {
        let p = DVec3::new(r[0].into(), r[1].into(), r[2].into());
        assert!(p.cmpge(bounds.min - 0.01).all() && p.cmple(bounds.max + 0.01).all(), "{p}");
        let turn = glam::Quat::from_xyzw(r[14], r[15], r[16], r[13]);
        assert!((turn * Vec3::Z).distance(Vec3::new(r[3], r[4], r[5])) < 1e-3, "{r:?}");
        assert!(r.iter().all(|v| v.is_finite()));
    }
    let (code, _, err) = run(&["export", &pack, "--format", "png", "-o", &out, "--force"]);
    assert!(code != 0 && err.contains("views.header"), "{err}");
}
