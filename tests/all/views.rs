//! Views: what the shipped program bakes, and hard cases.

use crate::support::{arg, inspect, repo, run, succeed};
use forest_draw::ViewsLevel;
use forest_pack::Pack;
use forest_raster::{Picture, Sampling, Style, Surfaces, rasterize};
use forest_soup::{AlphaMode, Camera, Material, Projection, TriangleSoup};
use forest_tests::soups::{leaves, of_triangles};
use forest_tests::{bake_views, open};
use forest_views::{
    Channel, Channels, Directions, Dome, Fit, Layout, Lookup, Quality, ViewsBlock, ViewsError,
    ViewsOptions,
};
use glam::{DVec3, Vec3};

fn options(views: u32, texels: u32) -> ViewsOptions {
    ViewsOptions {
        directions: Directions::octahedral(views, Dome::Upper),
        texels,
        quality: Quality::Lossless,
        ..ViewsOptions::default()
    }
}

fn camera(block: &ViewsBlock, from: DVec3, side: u32) -> Camera {
    let eye = block.center() + from * (3.0 * block.header.radius);
    let projection = Projection::Orthographic { height: 2.0 * block.header.half };
    Camera::new(eye, -from, projection, [side; 2])
}

fn drawn(pack: &Pack, from: DVec3, side: u32, lookup: Lookup) -> Picture {
    let block = ViewsBlock::open(pack).unwrap();
    let camera = camera(&block, from.normalize(), side);
    ViewsLevel::read(&block, 0).unwrap().draw(&camera, lookup, Style::default()).0
}

fn truth(soup: &TriangleSoup, pack: &Pack, from: DVec3, side: u32) -> Picture {
    let block = ViewsBlock::open(pack).unwrap();
    let surfaces = Surfaces::new(&soup.materials, &soup.textures);
    rasterize(soup, &surfaces, &camera(&block, from.normalize(), side), &Style::default())
}

fn rmse(a: &Picture, b: &Picture) -> f64 {
    let square = |(p, q): (&[f32; 4], &[f32; 4])| -> f64 {
        (0..4).map(|k| f64::from(p[k] - q[k]).powi(2)).sum::<f64>() / 4.0
    };
    let sum: f64 = a.pixels.iter().zip(&b.pixels).map(square).sum();
    (sum / a.pixels.len() as f64).sqrt()
}

#[test]
fn the_program_bakes_draws_and_keeps_what_is_there() {
    let dir = tempfile::tempdir().unwrap();
    let file = |name: &str| arg(&dir.path().join(name));
    let (pack, sheet, png) = (file("t.fpack"), file("sheet.png"), file("t.png"));
    let tree = arg(&repo("sample-data/conifer.glb"));
    succeed(&["points", &tree, "-o", &pack, "--surfel-size", "triangle"]);
    let bake = ["views", &tree, "-o", &pack, "--views", "25", "--texels", "32"];
    let json = succeed(&[&bake[..], &["--preview", &sheet, "--json"]].concat());
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!((json["views"].as_u64(), json["levels"].as_u64()), (Some(25), Some(6)));
    let share = json["stored_share"].as_f64().unwrap();
    assert!(share > json["seen_share"].as_f64().unwrap() && share < 1.5, "{share}");
    let sheet = image::open(&sheet).unwrap();
    assert_eq!((sheet.width(), sheet.height()), (5 * 32, 5 * 32));

    succeed(&["verify", &pack]);
    let report = inspect(std::path::Path::new(&pack));
    assert!(report["points"].is_object() && report["views"]["count"] == 25, "{report}");
    for lookup in ["nearest", "blend", "depth"] {
        succeed(&["draw", &pack, "--as", "views", "--lookup", lookup, "-o", &png, "--size", "64"]);
        let drawn = image::open(&png).unwrap().to_rgb8();
        let grey = drawn.get_pixel(0, 0);
        let tree = drawn.pixels().filter(|p| *p != grey).count();
        assert!(tree > 400, "{lookup}: {tree} pixels of a tree");
    }
    // Points are baked anew, and the views stay, byte for byte.
    let bytes = |p: &str| {
        let pack = Pack::open(std::path::Path::new(p)).unwrap();
        let views = pack.sections().filter(|(id, _)| id.kind >= 48 && id.kind <= 53);
        views.map(|(id, _)| (id, pack.bytes(id, 1 << 30).unwrap().into_owned())).collect::<Vec<_>>()
    };
    let before = bytes(&pack);
    succeed(&["points", &tree, "-o", &pack, "--surfel-size", "triangle"]);
    assert!(bytes(&pack) == before && before.len() == 1 + 6 * 5);
    // The number of threads does not show.
    let other = file("one.fpack");
    succeed(&["views", &tree, "-o", &other, "--views", "25", "--texels", "32", "--threads", "1"]);
    assert!(bytes(&other) == before);
}

#[test]
fn wrong_options_are_named() {
    let dir = tempfile::tempdir().unwrap();
    let pack = arg(&dir.path().join("t.fpack"));
    let tree = arg(&repo("sample-data/conifer.glb"));
    for (options, message) in [
        (&["--texels", "100"][..], "100 texels a tile; powers of two from 1 to 4096"),
        (&["--layout", "octahedral:1"], "1 views a side; at least 2"),
        (
            &["--layout", "spiral"],
            "--layout \"spiral\": octahedral, octahedral:N, rings or rings:RxP",
        ),
        (&["--layout", "rings:3x2"], "2 points a ring; at least 3"),
        (
            &["--layout", "octahedral:64", "--texels", "4", "--max-page", "8"],
            "pages; the limit is 2048",
        ),
        (&["--texels", "4096", "--samples", "8"], "32768 samples across; the limit is 16384"),
        (&["--views", "16384", "--texels", "1024"], "texels; the limit is 536870912"),
        (&["--max-page", "128"], "pages of 128 texels; multiples of 4 from 260 to 16384"),
    ] {
        let (code, _, err) = run(&[&["views", &tree, "-o", &pack][..], options].concat());
        assert_eq!(code, 1, "{err}");
        assert!(err.contains(message), "{err}");
    }
    let empty = dir.path().join("empty.obj");
    std::fs::write(&empty, "v 0 0 0\nv 0 0 0\nv 0 0 0\nf 1 2 3\n").unwrap();
    let (code, _, err) = run(&["views", &arg(&empty), "-o", &pack]);
    assert_eq!((code, err.contains("nothing to see")), (3, true), "{err}");
}

/// Texels that pass a tile's own alpha test at a level, and those of the whole tile.
fn passing(block: &ViewsBlock, level: usize, view: usize) -> (u32, u32) {
    let texels = block.texels(level).unwrap();
    let tile = &block.tiles[level][view];
    let side = block.header.levels[level].texels;
    let passes = |i: u32| {
        let at = texels.index(tile, (i % side) as i32, (i / side) as i32);
        at.is_some_and(|at| u16::from(texels.color[at][3]) >= tile.cutoff)
    };
    ((0..side * side).filter(|&i| passes(i)).count() as u32, side * side)
}

#[test]
fn an_alpha_test_passes_as_much_at_every_level() {
    for quality in [Quality::Lossless, Quality::Block] {
        let soup = leaves(3000, 0.03, 9);
        let bytes = bake_views(&soup, &ViewsOptions { quality, ..options(9, 64) }).unwrap();
        let pack = open(&bytes).unwrap();
        let block = ViewsBlock::open(&pack).unwrap();
        for view in 0..9 {
            let share = |level| {
                let (n, all) = passing(&block, level, view);
                (f64::from(n) / f64::from(all), 1.0 / f64::from(all))
            };
            let (finest, _) = share(0);
            assert!(finest > 0.05, "{finest}");
            for level in 1..block.header.levels.len() {
                let (got, texel) = share(level);
                // Within a texel and what ties of 8-bit alpha leave open.
                // Compressed blocks of a few texels have few different alphas.
                let few = quality == Quality::Block && texel > 0.01;
                let ties = if quality == Quality::Block { 0.08 } else { 0.05 };
                let limit = if few { 3.0 } else { 1.01 } * texel + ties * finest;
                assert!((got - finest).abs() <= limit, "{view} {level}: {got} of {finest}");
            }
        }
        // Over all views what is rounded evens out.
        let all = |level| (0..9).map(|v| passing(&block, level, v).0).sum::<u32>();
        for level in 1..3u32 {
            let ratio = f64::from(all(level as usize) << (2 * level)) / f64::from(all(0));
            assert!((ratio - 1.0).abs() < 0.02, "level {level}: {ratio}");
        }
    }
}

#[test]
fn ordinary_mips_would_thin_the_tree_out() {
    let bytes = bake_views(&leaves(3000, 0.03, 9), &options(4, 64)).unwrap();
    let pack = open(&bytes).unwrap();
    let block = ViewsBlock::open(&pack).unwrap();
    let texels = block.texels(3).unwrap();
    let above_half = texels.color.iter().filter(|c| c[3] >= 128).count() as f64 / 4.0;
    let (kept, _) = passing(&block, 3, 0);
    assert!(above_half < 0.5 * f64::from(kept), "{above_half} of {kept}");
}

#[test]
fn tiles_are_apart_and_have_empty_gutters() {
    let bytes = bake_views(&leaves(800, 0.1, 3), &options(16, 64)).unwrap();
    let pack = open(&bytes).unwrap();
    let block = ViewsBlock::open(&pack).unwrap();
    for (level, tiles) in block.tiles.iter().enumerate() {
        let texels = block.texels(level).unwrap();
        let mut used = std::collections::HashSet::new();
        for t in *tiles {
            for y in 0..t.height {
                for x in 0..t.width {
                    assert!(
                        used.insert((t.page, t.x + x, t.y + y)),
                        "level {level}: tiles overlap"
                    );
                    let edge = x == 0 || y == 0 || x == t.width - 1 || y == t.height - 1;
                    let (x, y) =
                        (i32::from(t.left) + i32::from(x), i32::from(t.top) + i32::from(y));
                    let color = texels.color[texels.index(t, x, y).unwrap()];
                    assert!(!edge || color[3] == 0, "level {level}: a gutter covers");
                    // White leaves: the colour goes on under the gutter.
                    assert!(color[0] > 250, "level {level}: {color:?}");
                }
            }
        }
    }
}

#[test]
fn a_baked_direction_shows_the_truth_and_depth_is_best_between() {
    let soup = leaves(1200, 0.12, 4);
    let bytes = bake_views(&soup, &options(81, 128)).unwrap();
    let pack = open(&bytes).unwrap();
    let block = ViewsBlock::open(&pack).unwrap();
    let baked = block.directions().direction(31);
    let want = truth(&soup, &pack, baked, 128);
    for lookup in Lookup::ALL {
        let got = drawn(&pack, baked, 128, lookup);
        let error = rmse(&got, &want);
        // Bilinear texels blur the edges of white leaves.
        assert!(error < 0.08, "{lookup:?}: {error}");
        let coverage = got.mean_coverage() / want.mean_coverage() - 1.0;
        assert!(coverage.abs() < 0.03, "{lookup:?}: {coverage}");
    }
    // Between four views.
    let d = block.directions();
    let between = d.direction(31) + d.direction(32) + d.direction(40) + d.direction(41);
    let want = truth(&soup, &pack, between, 128);
    let [nearest, blend, depth] =
        Lookup::ALL.map(|lookup| rmse(&drawn(&pack, between, 128, lookup), &want));
    assert!(depth < 0.8 * blend && blend < nearest, "{nearest} {blend} {depth}");
}

#[test]
fn parallax_is_followed_to_the_texel() {
    // Two squares, far before and far behind the centre: from 4° aside they move by ±0.8·tan 4°.
    let square = |z: f32, y: f32| {
        let p = |x: f32, dy: f32| Vec3::new(x, y + dy, z);
        let (a, b, c, d) = (p(-0.1, -0.1), p(0.1, -0.1), p(0.1, 0.1), p(-0.1, 0.1));
        [[a, b, c], [a, c, d]]
    };
    let soup = of_triangles(&[square(0.8, 0.5), square(-0.8, -0.5)].concat());
    let pack = open(&bake_views(&soup, &options(64, 128)).unwrap()).unwrap();
    let block = ViewsBlock::open(&pack).unwrap();
    let angle = 4f64.to_radians();
    let baked = block.directions().direction(block.directions().nearest(DVec3::Z));
    let from = baked + baked.cross(DVec3::Y).normalize() * angle.tan();
    let texel = 2.0 * block.header.half / 128.0;
    // Mean column of what the upper half of a picture shows: the front square.
    let column = |p: &Picture| {
        let upper = p.pixels[..64 * 128].iter().enumerate();
        let (sum, n) = upper.fold((0.0, 0.0), |(s, n), (i, p)| {
            (s + f64::from(p[3]) * (i % 128) as f64, n + f64::from(p[3]))
        });
        sum / n
    };
    let want = column(&truth(&soup, &pack, from, 128));
    let [nearest, _, depth] = Lookup::ALL.map(|l| column(&drawn(&pack, from, 128, l)) - want);
    assert!(depth.abs() < 0.5, "{depth} texels");
    let expected = 0.8 * angle.tan() / texel;
    assert!((nearest.abs() - expected).abs() < 1.0, "{nearest} of {expected} texels");
}

#[test]
fn a_perspective_camera_sees_what_a_parallel_one_does_from_afar() {
    let soup = leaves(500, 0.2, 6);
    let bytes = bake_views(&soup, &options(25, 64)).unwrap();
    let pack = open(&bytes).unwrap();
    let block = ViewsBlock::open(&pack).unwrap();
    let from = DVec3::new(0.4, 0.3, 1.0).normalize();
    let parallel = camera(&block, from, 64);
    let distance = 1e4 * block.header.radius;
    let eye = block.center() + from * distance;
    let fov_y = 2.0 * (block.header.half / distance).atan();
    let far = Camera::new(eye, -from, Projection::Perspective { fov_y }, [64; 2]);
    let level = ViewsLevel::read(&block, 0).unwrap();
    for lookup in Lookup::ALL {
        let [a, b] = [&parallel, &far].map(|c| level.draw(c, lookup, Style::default()).0);
        assert!(rmse(&a, &b) < 0.01, "{lookup:?}: {}", rmse(&a, &b));
        let (da, db) = (a.depth[64 * 32 + 32], b.depth[64 * 32 + 32]);
        let apart = f64::from(db) - distance - (f64::from(da) - 3.0 * block.header.radius);
        assert!(apart.abs() < 0.2 * block.header.radius, "{lookup:?}: {apart}");
    }
}

#[test]
fn one_triangle_has_its_views_even_edge_on() {
    let soup = of_triangles(&[[Vec3::ZERO, Vec3::X, Vec3::Y]]);
    let bytes = bake_views(&soup, &options(9, 64)).unwrap();
    let pack = open(&bytes).unwrap();
    let want = truth(&soup, &pack, DVec3::Z, 64);
    let got = drawn(&pack, DVec3::Z, 64, Lookup::Depth);
    assert!((got.mean_coverage() / want.mean_coverage() - 1.0).abs() < 0.02);
    // From the side nothing is seen of it.
    assert!(drawn(&pack, DVec3::X, 64, Lookup::Nearest).mean_coverage() < 1e-3);
}

#[test]
fn a_tree_thinner_than_a_texel_keeps_its_coverage() {
    // A pole of 1/40 of a texel in tiles of 16.
    let pole = |w: f32| {
        let (a, b) = (Vec3::new(-w, 0.0, 0.0), Vec3::new(w, 0.0, 0.0));
        let up = Vec3::Y * 10.0;
        [[a, b, b + up], [a, b + up, a + up]]
    };
    let width = 10.0 / 16.0 / 40.0;
    let soup = of_triangles(&pole(width));
    let bytes = bake_views(&soup, &ViewsOptions { samples: 16, ..options(9, 16) }).unwrap();
    let pack = open(&bytes).unwrap();
    let want = f64::from(2.0 * width * 10.0);
    let got = drawn(&pack, DVec3::Z, 16, Lookup::Nearest).mean_coverage();
    let block = ViewsBlock::open(&pack).unwrap();
    let area = got * (2.0 * block.header.half).powi(2);
    assert!((area / want - 1.0).abs() < 0.35, "{area} of {want}");
}

#[test]
fn exactly_the_zenith_is_seen_upright() {
    // A white arrow to −Z, which is up in a picture from above.
    let soup = of_triangles(&[[
        Vec3::new(-0.3, 0.0, 1.0),
        Vec3::new(0.3, 0.0, 1.0),
        Vec3::new(0.0, 0.0, -1.0),
    ]]);
    for directions in [Directions::octahedral(25, Dome::Upper), Directions::rings(25, Dome::Upper)]
    {
        let bytes = bake_views(&soup, &ViewsOptions { directions, ..options(25, 64) }).unwrap();
        let pack = open(&bytes).unwrap();
        for lookup in Lookup::ALL {
            let got = drawn(&pack, DVec3::Y, 64, lookup);
            let rows = |from: usize| -> f32 {
                got.pixels[from * 64..(from + 16) * 64].iter().map(|p| p[3]).sum()
            };
            assert!(rows(8) < 0.5 * rows(40), "{directions:?} {lookup:?}");
            let error = rmse(&got, &truth(&soup, &pack, DVec3::Y, 64));
            assert!(error < 0.04, "{directions:?} {lookup:?}: {error}");
        }
        // A camera that comes over the zenith from another side sees it turned, not another tree.
        let near = DVec3::new(0.02, 1.0, 0.0);
        let error = rmse(&drawn(&pack, near, 64, Lookup::Blend), &truth(&soup, &pack, near, 64));
        assert!(error < 0.1, "{directions:?}: {error}");
    }
}

#[test]
fn overlapping_translucent_cards_cover_what_they_cover() {
    let card = |z: f32| {
        let corner = |x: f32, y: f32| Vec3::new(x, y, z);
        let (a, b, c, d) =
            (corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0));
        [[a, b, c], [a, c, d]]
    };
    let mut soup = of_triangles(&[card(0.0), card(0.1), card(0.2)].concat());
    soup.materials = vec![Material {
        base_color: [1.0, 0.5, 0.25, 0.5],
        alpha_mode: AlphaMode::Blend,
        double_sided: true,
        ..Material::default()
    }];
    let bytes = bake_views(&soup, &ViewsOptions { samples: 16, ..options(9, 32) }).unwrap();
    let pack = open(&bytes).unwrap();
    let want = truth(&soup, &pack, DVec3::Z, 32);
    let covered = want.pixels[32 * 16 + 16][3];
    assert!((covered - 0.875).abs() < 0.05, "{covered}"); // 1 − ½³
    for lookup in [Lookup::Nearest, Lookup::Blend] {
        let got = drawn(&pack, DVec3::Z, 32, lookup);
        let ratio = got.mean_coverage() / want.mean_coverage();
        assert!((ratio - 1.0).abs() < 0.02, "{lookup:?}: {ratio}");
    }
}

#[test]
fn mirrored_geometry_has_mirrored_views_and_normals_towards_the_eye() {
    let soup = leaves(200, 0.3, 8);
    let mut mirrored = soup.clone();
    mirrored.positions.iter_mut().for_each(|p| p.x = -p.x);
    let bake = |soup| bake_views(soup, &options(9, 64)).unwrap();
    let [a, b] = [bake(&soup), bake(&mirrored)].map(|bytes| open(&bytes).unwrap());
    let [a, b] = [&a, &b].map(|pack| drawn(pack, DVec3::Z, 64, Lookup::Nearest));
    let mut flipped = b.clone();
    for (i, p) in b.pixels.iter().enumerate() {
        flipped.pixels[i - i % 64 + 63 - i % 64] = *p;
    }
    // Samples are sheared to one side.
    assert!(rmse(&a, &flipped) < 0.06, "{}", rmse(&a, &flipped));
    for picture in [&a, &b] {
        for (n, p) in picture.normal.iter().zip(&picture.pixels).filter(|(_, p)| p[3] > 0.5) {
            assert!(n[2] > -0.02, "{n:?} {p:?}");
        }
    }
}

#[test]
fn a_tree_a_million_units_away_has_the_same_payload() {
    let soup = leaves(300, 0.2, 2);
    let mut far = soup.clone();
    far.origin = DVec3::new(1e6, -1e6, 3e6);
    let [a, b] = [&soup, &far].map(|s| bake_views(s, &options(9, 32)).unwrap());
    let [a, b] = [open(&a).unwrap(), open(&b).unwrap()];
    for (id, _) in a.sections().filter(|(id, _)| id.kind > 48) {
        let bytes = |p: &Pack| p.bytes(id, 1 << 30).unwrap().into_owned();
        assert!(bytes(&a) == bytes(&b), "{id}");
    }
    let moved = ViewsBlock::open(&b).unwrap().center() - ViewsBlock::open(&a).unwrap().center();
    assert_eq!(moved, far.origin);
}

#[test]
fn a_scaled_tree_has_the_same_colours() {
    let soup = leaves(300, 0.2, 2);
    for factor in [2f32.powi(20), 2f32.powi(-20)] {
        let mut scaled = soup.clone();
        scaled.positions.iter_mut().for_each(|p| *p *= factor);
        let [a, b] = [&soup, &scaled].map(|s| bake_views(s, &options(4, 32)).unwrap());
        let [a, b] = [open(&a).unwrap(), open(&b).unwrap()];
        for (id, _) in a.sections().filter(|(id, _)| (49..=53).contains(&id.kind)) {
            let bytes = |p: &Pack| p.bytes(id, 1 << 30).unwrap().into_owned();
            assert!(bytes(&a) == bytes(&b), "{factor} {id}");
        }
    }
}

#[test]
fn tiles_of_one_texel_have_the_mean_of_the_tree() {
    let soup = leaves(400, 0.2, 7);
    let bytes = bake_views(&soup, &options(4, 1)).unwrap();
    let pack = open(&bytes).unwrap();
    let block = ViewsBlock::open(&pack).unwrap();
    assert_eq!((block.header.levels.len(), block.header.samples), (1, 64 * 64));
    let texels = block.texels(0).unwrap();
    for (view, tile) in block.tiles[0].iter().enumerate() {
        let at = texels.index(tile, 0, 0).unwrap();
        let from = block.directions().direction(view as u32);
        let want = truth(&soup, &pack, from, 64).mean_coverage();
        let got = f64::from(texels.color[at][3]) / 255.0;
        assert!((got - want).abs() < 0.01, "{got} {want}");
    }
}

#[test]
fn the_coarsest_levels_keep_their_coverage_when_drawn() {
    let pack = open(&bake_views(&leaves(400, 0.2, 7), &options(9, 16)).unwrap()).unwrap();
    let block = ViewsBlock::open(&pack).unwrap();
    let from = block.directions().direction(3);
    let eye = block.center() + from * (3.0 * block.header.radius);
    let projection = Projection::Orthographic { height: 8.0 * block.header.half };
    let camera = Camera::new(eye, -from, projection, [64; 2]);
    let covered = |level: usize| {
        let level = ViewsLevel::read(&block, level).unwrap();
        level.draw(&camera, Lookup::Nearest, Style::default()).0.mean_coverage()
    };
    for level in 1..5 {
        let ratio = covered(level) / covered(0);
        assert!((ratio - 1.0).abs() < 0.03, "level {level}: {ratio}");
    }
}

/// Along a baked direction one view has all shares; what a perspective camera's rays pass behind in it, the
/// others show.
#[test]
fn depth_from_a_baked_direction_has_no_holes() {
    let soup = leaves(1500, 0.08, 11);
    let pack = open(&bake_views(&soup, &options(81, 64)).unwrap()).unwrap();
    let block = ViewsBlock::open(&pack).unwrap();
    let views = ViewsLevel::read(&block, 0).unwrap();
    let surfaces = Surfaces::new(&soup.materials, &soup.textures);
    for view in [0, 12, 40, 61] {
        let from = block.directions().direction(view);
        let eye = block.center() + from * (3.0 * block.header.radius);
        let camera = Camera::new(eye, -from, Projection::Perspective { fov_y: 0.8 }, [96; 2]);
        let got = views.draw(&camera, Lookup::Depth, Style::default()).0.mean_coverage();
        let want = rasterize(&soup, &surfaces, &camera, &Style::default()).mean_coverage();
        assert!((got / want - 1.0).abs() < 0.03, "view {view}: {got} of {want}");
    }
}

#[test]
fn what_exceeds_a_page_goes_to_another() {
    let soup = leaves(300, 0.3, 5);
    let small = ViewsOptions { max_page: 132, ..options(9, 128) };
    let [one, many] = [options(9, 128), small].map(|o| bake_views(&soup, &o).unwrap());
    let [one, many] = [open(&one).unwrap(), open(&many).unwrap()];
    let level = |p: &Pack| ViewsBlock::open(p).unwrap().header.levels[0];
    assert_eq!(level(&one).pages, 1);
    assert!(level(&many).pages == 9 && level(&many).page.iter().all(|s| *s <= 132));
    let [a, b] = [&one, &many].map(|p| drawn(p, DVec3::new(0.3, 0.5, 1.0), 64, Lookup::Depth));
    assert!(a == b);
}

#[test]
fn only_the_channels_asked_for_are_stored() {
    let soup = leaves(100, 0.3, 5);
    let bare = ViewsOptions { channels: Channels::COLOR, ..options(9, 16) };
    let pack = open(&bake_views(&soup, &bare).unwrap()).unwrap();
    let block = ViewsBlock::open(&pack).unwrap();
    assert_eq!(pack.sections().count(), 2 + 2 * 5);
    assert_eq!(block.channel_bytes(Channel::Depth, 0), 0);
    // Without depth the look-up through depth is the blend.
    let from = DVec3::new(0.3, 0.2, 1.0);
    assert!(drawn(&pack, from, 32, Lookup::Depth) == drawn(&pack, from, 32, Lookup::Blend));
}

#[test]
fn the_full_sphere_sees_the_underside() {
    // A roof, red below: vertex colours cannot tell sides, so two roofs.
    let roof = |y: f32| [Vec3::new(-1.0, y, -1.0), Vec3::new(1.0, y, -1.0), Vec3::new(0.0, y, 1.0)];
    let mut soup = of_triangles(&[roof(0.0), roof(0.1)]);
    soup.colors = [[[1.0, 0.0, 0.0, 1.0]; 3], [[0.0, 1.0, 0.0, 1.0]; 3]].concat();
    for layout in [Layout::Octahedral { side: 7 }, Layout::Rings { rings: 3, points: 12 }] {
        let directions = Directions { layout, dome: Dome::Full };
        let bytes = bake_views(&soup, &ViewsOptions { directions, ..options(9, 32) }).unwrap();
        let pack = open(&bytes).unwrap();
        for (from, channel) in [(DVec3::Y, 1), (DVec3::NEG_Y, 0)] {
            let got = drawn(&pack, from, 32, Lookup::Nearest);
            let sum = |k: usize| got.pixels.iter().map(|p| p[k]).sum::<f32>();
            assert!(sum(channel) > 100.0 && sum(1 - channel) < 1.0, "{layout:?} {from}");
        }
    }
}

#[test]
fn a_tight_frame_holds_the_tree_and_wastes_less() {
    // A pole: its sphere is as wide as it is high.
    let soup = of_triangles(&[[Vec3::ZERO, Vec3::new(0.5, 0.0, 0.2), Vec3::Y * 4.0]]);
    let size = |fit| {
        let bytes = bake_views(&soup, &ViewsOptions { fit, ..options(9, 32) }).unwrap();
        let pack = open(&bytes).unwrap();
        ViewsBlock::open(&pack).unwrap().header.half
    };
    let (tight, sphere) = (size(Fit::Tight), size(Fit::Sphere));
    assert!((tight - 2.0).abs() < 1e-6 && sphere > 2.01, "{tight} {sphere}");
    let nothing = bake_views(&TriangleSoup::default(), &options(9, 32));
    assert!(matches!(nothing, Err(ViewsError::NothingToSee)));
}

#[test]
fn one_sample_a_pixel_is_the_same_whatever_else_is_asked() {
    let soup = leaves(200, 0.3, 8);
    let pack = open(&bake_views(&soup, &options(16, 32)).unwrap()).unwrap();
    let block = ViewsBlock::open(&pack).unwrap();
    let level = ViewsLevel::read(&block, 0).unwrap();
    let camera = camera(&block, DVec3::new(0.2, 0.4, 0.9).normalize(), 48);
    let style = Style { sampling: Sampling::MIDDLE, ..Style::default() };
    let once = level.draw(&camera, Lookup::Depth, style).0;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert!(pool.install(|| level.draw(&camera, Lookup::Depth, style).0) == once);
    assert!(once.pixels.iter().all(|p| p[3] == 0.0 || p[3] == 1.0));
}
