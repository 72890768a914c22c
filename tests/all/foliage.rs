//! Foliage: what the program bakes, hard cases, and what the wind does.

use crate::support::{arg, inspect, repo, run, succeed};
use forest_draw::FoliageScene;
use forest_foliage::{
    FoliageBlock, FoliageError, FoliageOptions, Hung, PartsOptions, Pose, Posed, Sway, Wind,
};
use forest_pack::Pack;
use forest_raster::{Light, Sampling, Style, Surfaces, rasterize};
use forest_soup::{Camera, Material, TriangleSoup};
use forest_tests::soups::{leaves, small_tree};
use forest_tests::{bake_foliage, bake_volume, open};
use glam::{DVec3, Vec3};
use std::path::Path;

const GALE: f32 = 1.0;

fn gale(time: f32) -> Wind {
    Wind { strength: GALE, time, ..Wind::default() }
}

#[test]
fn the_program_bakes_draws_and_keeps_what_is_there() {
    let dir = tempfile::tempdir().unwrap();
    let file = |name: &str| arg(&dir.path().join(name));
    let (pack, png) = (file("t.fpack"), file("t.png"));
    let tree = arg(&repo("sample-data/conifer.glb"));
    succeed(&["points", &tree, "-o", &pack, "--surfel-size", "triangle"]);
    let json = succeed(&["foliage", &tree, "-o", &pack, "--levels", "3", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    let parts = |m: &serde_json::Value| (m["name"].clone(), m["leaf_triangles"].clone());
    let parts: Vec<_> = json["materials"].as_array().unwrap().iter().map(parts).collect();
    assert_eq!(parts, [("bark".into(), 0.into()), ("leaves".into(), 3248.into())]);
    assert_eq!(json["branches"][0], 1, "a trunk");
    let triangles = |l: &serde_json::Value| l["triangles"].as_u64().unwrap();
    let levels: Vec<u64> = json["levels"].as_array().unwrap().iter().map(triangles).collect();
    assert!(levels.len() == 3 && levels.windows(2).all(|w| w[1] * 2 < w[0]), "{levels:?}");
    succeed(&["verify", &pack]);
    let told = inspect(Path::new(&pack));
    assert!(told["points"].is_object(), "points are kept");
    assert_eq!(told["foliage"]["levels"].as_array().unwrap().len(), 3);
    assert_eq!(told["foliage"]["source_triangles"], serde_json::json!([16752, 3248]));
    let draw = ["draw", &pack, "-o", &png, "--as", "foliage", "--size", "64", "--samples", "2"];
    succeed(&[&draw[..], &["--level", "0,2"]].concat());
    succeed(&[&draw[..], &["--wind", "0.8,2.5"]].concat());
    // And the other way round.
    succeed(&["points", &tree, "-o", &pack, "--surfel-size", "triangle"]);
    assert!(inspect(Path::new(&pack))["foliage"].is_object(), "foliage is kept");
    // Points hang on its branches, whichever came first.
    succeed(&["verify", &pack]);
    let points = ["draw", &pack, "-o", &png, "--as", "points", "--size", "64", "--samples", "2"];
    let picture = |more: &[&str]| {
        succeed(&[&points[..], more].concat());
        std::fs::read(&png).unwrap()
    };
    assert_ne!(picture(&[]), picture(&["--wind", "1,2.2"]), "points bend");
    succeed(&["views", &tree, "-o", &pack, "--views", "9", "--texels", "16", "-q"]);
    assert_ne!(picture(&[]), picture(&["--wind", "1,2.2"]), "they still hang there");
    let (code, _, err) = run(&["draw", &pack, "-o", &png, "--as", "views", "--wind", "1"]);
    assert!(code == 1 && err.contains("views and volumes lean as a whole"), "{code} {err}");
    // From afar no triangle of the points is left; foliage keeps its materials.
    let lean = file("lean");
    succeed(&["needs", &pack, "-o", &lean, "--nearest", "200m", "-q"]);
    succeed(&["verify", &arg(&dir.path().join("lean/t.fpack"))]);
    for (wrong, code, says) in [
        (&["--level", "3"][..], 1, "--level 3: the coarsest level of the pack is 2"),
        (&["--wind", "3"], 1, "a strength from 0 to 2"),
        (&["--budget", "5"], 1, "choose levels of points"),
    ] {
        let (got, _, err) = run(&[&draw[..], wrong].concat());
        assert!(got == code && err.contains(says), "{wrong:?}: {got} {err}");
    }
}

#[test]
fn what_is_wood_and_what_is_leaf_can_be_corrected() {
    let dir = tempfile::tempdir().unwrap();
    let pack = arg(&dir.path().join("t.fpack"));
    let tree = arg(&repo("sample-data/shrub.obj"));
    let bake = ["foliage", &tree, "-o", &pack, "--levels", "1", "--json"];
    let leaf = |more: &[&str]| {
        let json = succeed(&[&bake[..], more].concat());
        let json: serde_json::Value = serde_json::from_str(&json).unwrap();
        let of = |m: &serde_json::Value| m["leaf_triangles"].as_u64().unwrap();
        json["materials"].as_array().unwrap().iter().map(of).sum::<u64>()
    };
    assert_eq!(leaf(&[]), 1516);
    assert_eq!(leaf(&["--leaf", "BARK"]), 1516 + 2484);
    for (wrong, code, says) in [
        (&["--leaf", "petals"][..], 1, "no material is called \"petals\"; there are bark, leaves"),
        (&["--wood", "leaves"], 3, "no leaves found in 4000 triangles of bark, leaves"),
        (&["--texel", "-1"], 1, "texels of -1; above 0"),
        (&["--levels", "9"], 1, "--levels"),
    ] {
        let (got, _, err) = run(&[&bake[..], wrong].concat());
        assert!(got == code && err.contains(says), "{wrong:?}: {got} {err}");
    }
}

#[test]
fn materials_without_names_are_told_apart_by_shape() {
    let mut tree = small_tree();
    tree.materials = vec![Material::default(); 2];
    let (bytes, report) = bake_foliage(&tree, &FoliageOptions::default()).unwrap();
    let leaf: Vec<usize> = report.materials.iter().map(|m| m.leaf_triangles).collect();
    assert_eq!(leaf, [0, 120], "12 quads at each of 5 tips");
    // The trunk and its four branches, which do not touch it.
    let pack = open(&bytes).unwrap();
    assert_eq!(FoliageBlock::open(&pack).unwrap().header.branches, [1, 4, 0, 0]);
    assert_eq!(report.pieces, 5);
}

#[test]
fn hard_cases_end_in_foliage_or_a_reason() {
    let all_leaves = PartsOptions { leaf: vec![String::new()], ..PartsOptions::default() };
    let options = FoliageOptions { parts: all_leaves, ..FoliageOptions::default() };
    // No wood at all: a trunk is made up, so that it sways.
    let (bytes, report) = bake_foliage(&leaves(200, 0.2, 3), &options).unwrap();
    assert_eq!((report.header.wind, report.header.branches), (1, [1, 0, 0, 0]));
    forest_tests::use_pack(&bytes).unwrap();
    // One triangle; one that is flat on the ground; corners that are not finite.
    for soup in [leaves(1, 0.3, 1), {
        let mut flat = leaves(5, 0.3, 2);
        flat.positions.iter_mut().for_each(|p| p.y = 0.0);
        flat
    }] {
        forest_tests::use_pack(&bake_foliage(&soup, &options).unwrap().0).unwrap();
    }
    let mut broken = small_tree();
    broken.positions[0] = Vec3::NAN;
    let last = broken.positions.len() - 1;
    broken.positions[last] = Vec3::INFINITY;
    forest_tests::use_pack(&bake_foliage(&broken, &FoliageOptions::default()).unwrap().0).unwrap();
    let nothing = bake_foliage(&TriangleSoup::default(), &options).unwrap_err();
    assert!(
        matches!(nothing, FoliageError::NothingToSee | FoliageError::NoSuchMaterial { .. }),
        "{nothing}"
    );
    let fine = FoliageOptions { texel: Some(1e-5), levels: 1, ..FoliageOptions::default() };
    let full = bake_foliage(&small_tree(), &fine).map(|b| b.1.header.atlas);
    assert!(matches!(full, Err(FoliageError::AtlasFull { .. })), "{full:?}");
}

#[test]
fn a_moved_or_scaled_tree_has_the_same_foliage() {
    let counts = |soup: &TriangleSoup| {
        let header = bake_foliage(soup, &FoliageOptions::default()).unwrap().1.header;
        let level = |l: &forest_foliage::LevelHeader| (l.triangles(), l.tubes, l.sheets, l.cards);
        (header.branches, header.levels.iter().map(level).collect::<Vec<_>>())
    };
    let tree = small_tree();
    let want = counts(&tree);
    let moved = TriangleSoup { origin: DVec3::new(1e6, -3e5, 2e6), ..tree.clone() };
    assert_eq!(counts(&moved), want);
    let mut large = tree.clone();
    large.positions.iter_mut().for_each(|p| *p *= 1024.0);
    assert_eq!(counts(&large), want);
}

#[test]
fn threads_do_not_change_a_byte() {
    let baked = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| bake_foliage(&small_tree(), &FoliageOptions::default()).unwrap().0)
    };
    assert!(baked(1) == baked(3));
}

/// Foliage of a sample tree, its soup, and pictures of both.
struct Sample {
    soup: TriangleSoup,
    bytes: Vec<u8>,
}

impl Sample {
    fn new(name: &str) -> Self {
        let path = repo("sample-data").join(name).display().to_string();
        let block = forest_import::Block::parse(&[path]).unwrap();
        let loaded = block.load(&forest_import::Limits::default()).unwrap();
        let soup = loaded.model.flatten(1 << 24).unwrap();
        let bytes = bake_foliage(&soup, &FoliageOptions::default()).unwrap().0;
        Self { soup, bytes }
    }
}

#[test]
fn levels_keep_coverage_and_colour_and_get_worse_one_by_one() {
    for name in ["broadleaf_young.gltf", "conifer.glb", "shrub.obj"] {
        let sample = Sample::new(name);
        let pack = open(&sample.bytes).unwrap();
        let block = FoliageBlock::open(&pack).unwrap();
        let scene = FoliageScene::read(&block).unwrap();
        let surfaces = Surfaces::new(&sample.soup.materials, &sample.soup.textures);
        let style = Style { sampling: Sampling { side: 4, seed: 1 }, light: Light::Albedo };
        let views = [[20.0, 10.0], [140.0, 0.0], [260.0, 45.0]];
        let cameras = views.map(|v| Camera::around(block.bounds(), v, None, [160; 2]));
        let truths = cameras.map(|c| rasterize(&sample.soup, &surfaces, &c, &style));
        let mut last = 0.0;
        for level in 0..block.header.levels.len() {
            let (mut square, mut sums) = (0.0, [[0.0; 4]; 2]);
            for (camera, truth) in cameras.iter().zip(&truths) {
                let picture = scene.draw(camera, level, &Wind::default(), &style);
                for (a, b) in picture.pixels.iter().zip(&truth.pixels) {
                    for k in 0..4 {
                        square += f64::from(a[k] - b[k]).powi(2);
                        sums[0][k] += f64::from(a[k]);
                        sums[1][k] += f64::from(b[k]);
                    }
                }
            }
            let [own, truth] = sums;
            let coverage = own[3] / truth[3];
            assert!((0.88..1.12).contains(&coverage), "{name} {level}: coverage {coverage}");
            for k in 0..3 {
                let color = own[k] / own[3] * truth[3] / truth[k];
                assert!((0.85..1.15).contains(&color), "{name} {level}: colour {k} {color}");
            }
            assert!(square > last, "{name} {level}: {square} after {last}");
            last = square;
        }
    }
}

#[test]
fn no_branch_stretches_in_a_gale() {
    let sample = Sample::new("broadleaf_young.gltf");
    let pack = open(&sample.bytes).unwrap();
    let block = FoliageBlock::open(&pack).unwrap();
    assert!(block.branches.len() > 100);
    let mut moved_most = 0.0f32;
    for time in [0.7, 2.9, 11.3] {
        let pose = Pose::new(block.branches, &gale(time), 0.3);
        for (i, b) in (0..).zip(block.branches) {
            let rest =
                |s: f32| Vec3::from(b.base) + (Vec3::from(b.linear) + Vec3::from(b.square) * s) * s;
            let at = |s: f32| pose.place(block.branches, Hung::new(i, s), rest(s));
            let length = |place: &dyn Fn(f32) -> Vec3| -> f32 {
                (0..50).map(|k| place(k as f32 / 50.0).distance(place((k + 1) as f32 / 50.0))).sum()
            };
            let ratio = length(&at) / length(&rest);
            assert!((ratio - 1.0).abs() < 0.01, "branch {i} at {time} s: {ratio}");
            // It stays where it grows.
            if let Some(p) = block.branches.get(b.parent as usize) {
                let on_parent =
                    pose.place(block.branches, Hung::new(b.parent, b.at), b.base.into());
                assert!(on_parent.distance(at(0.0)) < 1e-4 * p.length, "branch {i}");
            }
            moved_most = moved_most.max(at(1.0).distance(rest(1.0)) / b.length);
        }
    }
    assert!(moved_most > 0.1, "{moved_most}");
}

#[test]
fn the_whole_trees_sway_is_the_mean_of_its_branches() {
    let sample = Sample::new("conifer.glb");
    let pack = open(&sample.bytes).unwrap();
    let block = FoliageBlock::open(&pack).unwrap();
    let [min, max] = block.header.bounds;
    let height = max[1] - min[1];
    for time in [1.0, 4.2, 9.9] {
        let eye = block.origin() + DVec3::Z * 50.0;
        let posed = Posed::new(&block, &gale(time), 0.0, eye);
        let sway = Sway::of(&block, &posed);
        // Means over the upper half, of all vertices of the finest level: the sway was fitted to a few.
        let (materials, textures) = block.materials().unwrap();
        let bent = block.soup(0, Some(posed), &materials, &textures);
        let (mut moved, mut swayed, mut n) = (Vec3::ZERO, Vec3::ZERO, 0.0);
        for (p, v) in bent.positions.iter().zip(block.vertices[0]) {
            if f64::from(v.position[1]) > min[1] + 0.5 * height {
                moved += *p - Vec3::from(v.position);
                swayed += sway.at(v.position[1]);
                n += 1.0;
            }
        }
        let (moved, swayed) = (moved / n, swayed / n);
        assert!(moved.length() > 0.005 * height as f32, "{moved}");
        let off = (moved - swayed).with_y(0.0).length() / moved.length();
        assert!(off < 0.15, "at {time} s: {moved} and {swayed}");
    }
}

#[test]
fn a_sequence_is_a_folder_of_frames_and_an_animation() {
    let dir = tempfile::tempdir().unwrap();
    let pack = dir.path().join("t.fpack");
    std::fs::write(&pack, bake_foliage(&small_tree(), &FoliageOptions::default()).unwrap().0)
        .unwrap();
    let folder = dir.path().join("frames");
    let (pack, frames) = (arg(&pack), arg(&folder));
    let draw = |more: &[&str]| {
        let all = [&*pack, "--headless", "--size", "96x64", "-o", &*frames];
        crate::view::view(&[&all[..], more].concat())
    };
    let (code, err) = draw(&["--sequence", "0.5", "--rate", "8", "--wind", "1"]);
    assert_eq!(code, 0, "{err}");
    let frame = |i: u32| std::fs::read(folder.join(format!("{i:04}.png"))).unwrap();
    assert!((1..4).all(|i| frame(i) != frame(i - 1)), "it moves");
    assert!(!folder.join("0004.png").exists());
    let preview = std::fs::File::open(folder.join("preview.png")).unwrap();
    let reader = png::Decoder::new(std::io::BufReader::new(preview)).read_info().unwrap();
    assert_eq!(reader.info().animation_control().unwrap().num_frames, 4);
    // Never into what is there already.
    let (code, err) = draw(&["--sequence", "0.5"]);
    assert!(code == 1 && err.contains("new or empty folder"), "{code} {err}");
}

#[test]
fn the_coarsest_level_that_is_fine_enough_is_selected() {
    let pack = open(&bake_foliage(&small_tree(), &FoliageOptions::default()).unwrap().0).unwrap();
    let block = FoliageBlock::open(&pack).unwrap();
    // Levels have texels of 1/512, 1/256, … of the height.
    let level = |pixels: u32| {
        let [min, max] = block.bounds();
        let height = f64::from(pixels) / 100.0 * (max.y - min.y);
        let mut camera = Camera::around([min, max], [0.0, 0.0], None, [100; 2]);
        let scale = (max.y - min.y) * 100.0 / f64::from(pixels);
        camera.projection = forest_soup::Projection::Orthographic { height: scale };
        assert!(height > 0.0);
        block.select(&camera, 1.0)
    };
    assert_eq!([2000, 512, 300, 250, 100, 10].map(level), [0, 0, 0, 1, 2, 3]);
}

/// A volume of the same source stays beside foliage: sections of each are their own.
#[test]
fn foliage_and_volume_do_not_share_sections() {
    let tree = small_tree();
    let options = forest_volume::VolumeOptions { levels: 2, ..Default::default() };
    let stand = forest_volume::Stand::Dome { cameras: 4 };
    let volume = open(&bake_volume(&tree, stand, &options, None).unwrap().0).unwrap();
    let foliage = open(&bake_foliage(&tree, &FoliageOptions::default()).unwrap().0).unwrap();
    let kinds = |p: &Pack| p.sections().map(|(id, _)| id.kind).collect::<Vec<_>>();
    let shared: Vec<u16> =
        kinds(&volume).into_iter().filter(|k| kinds(&foliage).contains(k)).collect();
    assert!(shared.iter().all(|k| *k == forest_pack::kind::META), "{shared:?}");
}
