//! Foliage as a glb with all its levels, and its branches as textures: what engines read of them.

use crate::support::{arg, repo, run, succeed};
use forest_draw::FoliageScene;
use forest_foliage::{BranchRecord, FoliageBlock, Hung, NO_BRANCH, Pose, Wind};
use forest_import::{Block, Limits};
use forest_pack::Pack;
use forest_raster::{Light, Sampling, Style, Surfaces, rasterize};
use forest_soup::Camera;
use forest_tests::bake_foliage;
use forest_tests::soups::small_tree;
use glam::{DVec3, Vec3};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

/// A young tree's pack with foliage and views, and its exports.
struct Exported {
    dir: tempfile::TempDir,
}

static EXPORTED: LazyLock<Exported> = LazyLock::new(|| {
    let dir = tempfile::tempdir().unwrap();
    let [pack, out] = ["t.fpack", "out"].map(|n| arg(&dir.path().join(n)));
    let tree = arg(&repo("sample-data/broadleaf_young.gltf"));
    succeed(&["foliage", &tree, "-o", &pack, "-q"]);
    succeed(&["views", &tree, "-o", &pack, "--layout", "octahedral:6", "--texels", "64", "-q"]);
    succeed(&["export", &pack, "--format", "glb,pivots", "-o", &out, "-q"]);
    Exported { dir }
});

impl Exported {
    fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    fn pack(&self) -> Pack {
        Pack::open(&self.path("t.fpack")).unwrap()
    }

    /// The glb's document and buffer.
    fn glb(&self) -> (Value, Vec<u8>) {
        read(&self.path("out/t.glb"))
    }
}

fn read(glb: &Path) -> (Value, Vec<u8>) {
    let bytes = std::fs::read(glb).unwrap();
    let glb = gltf::binary::Glb::from_slice(&bytes).unwrap();
    // The crate's own checks of a document.
    gltf::Gltf::from_slice(&bytes).unwrap();
    (serde_json::from_slice(&glb.json).unwrap(), glb.bin.unwrap().into_owned())
}

/// The floats of an attribute of a mesh.
fn floats<const N: usize>(
    (json, bytes): &(Value, Vec<u8>),
    mesh: usize,
    name: &str,
) -> Vec<[f32; N]> {
    let accessor = &json["meshes"][mesh]["primitives"][0]["attributes"][name];
    let accessor = &json["accessors"][accessor.as_u64().unwrap() as usize];
    let view = &json["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
    let number = |v: &Value| v.as_u64().unwrap() as usize;
    let rows = &bytes[number(&view["byteOffset"])..][..number(&view["byteLength"])];
    let rows: Vec<f32> = rows.as_chunks().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
    assert_eq!(rows.len(), N * number(&accessor["count"]), "{name}");
    rows.as_chunks().0.to_vec()
}

#[test]
fn levels_are_a_chain_that_ends_with_the_views() {
    let (json, _) = EXPORTED.glb();
    let names: Vec<&str> =
        json["nodes"].as_array().unwrap().iter().map(|n| n["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["t_LOD0", "t_LOD1", "t_LOD2", "t_LOD3", "t_LOD4"]);
    assert_eq!(json["scenes"][0]["nodes"], serde_json::json!([0]));
    let first = &json["nodes"][0];
    assert_eq!(first["extensions"]["MSFT_lod"]["ids"], serde_json::json!([1, 2, 3, 4]));
    let told: Vec<f64> =
        serde_json::from_value(first["extras"]["MSFT_screencoverage"].clone()).unwrap();
    assert!(told.len() == 5 && told[4] == 0.0 && told[0] < 1.0, "{told:?}");
    // Texels double from level to level.
    assert!(told[..4].windows(2).all(|w| (w[0] / w[1] - 4.0).abs() < 1e-9), "{told:?}");
    // Front, side and top.
    assert_eq!(json["nodes"][4]["extras"]["triangles"], 6);
    let pack = EXPORTED.pack();
    let block = FoliageBlock::open(&pack).unwrap();
    for (l, header) in block.header.levels.iter().enumerate() {
        assert_eq!(json["nodes"][l]["extras"]["triangles"], header.triangles());
    }
}

/// A reader without the extension shows the finest level alone: it looks as the pack's does.
#[test]
fn the_finest_level_is_what_any_reader_shows() {
    let pack = EXPORTED.pack();
    let block = FoliageBlock::open(&pack).unwrap();
    let scene = FoliageScene::read(&block).unwrap();
    let again = Block::parse(&[arg(&EXPORTED.path("out/t.glb"))]).unwrap();
    let soup = again.load(&Limits::default()).unwrap().model.flatten(1 << 20).unwrap();
    assert_eq!(soup.triangles.len() as u64, block.header.levels[0].triangles());
    let style = Style { sampling: Sampling { side: 4, seed: 1 }, light: Light::Albedo };
    let surfaces = Surfaces::new(&soup.materials, &soup.textures);
    for angles in [[20.0, 5.0], [110.0, 30.0], [250.0, 70.0]] {
        let camera = Camera::around(block.bounds(), angles, None, [160; 2]);
        let theirs = rasterize(&soup, &surfaces, &camera, &style);
        let ours = scene.draw(&camera, 0, &Wind::default(), &style);
        let [a, b] = [&theirs, &ours].map(|p| p.mean_coverage());
        assert!((a / b - 1.0).abs() < 0.05, "{a} {b}");
        // Where alpha is tested, texels are shown wholly or not at all.
        let error = forest_tests::pictures::rmse(&theirs, &ours);
        assert!(error < 0.1, "{error}");
    }
}

/// What the file tells of the wind is enough to bend it as the pack is bent.
#[test]
fn a_readers_wind_bends_branches_as_ours() {
    let (json, bytes) = EXPORTED.glb();
    let told = &json["nodes"][0]["extras"]["forest_wind"];
    let view = &json["bufferViews"][told["bufferView"].as_u64().unwrap() as usize];
    let number = |v: &Value| v.as_u64().unwrap() as usize;
    let rows = &bytes[number(&view["byteOffset"])..][..number(&view["byteLength"])];
    assert_eq!(number(&told["byteStride"]), size_of::<BranchRecord>());
    let records: Vec<BranchRecord> = bytemuck::pod_collect_to_vec(rows);
    assert_eq!(records.len(), number(&told["branches"]));
    let origin: [f64; 3] = serde_json::from_value(told["origin"].clone()).unwrap();
    let origin = DVec3::from(origin).as_vec3();
    let wind = Wind { strength: 1.0, time: 2.2, ..Wind::default() };
    let pose = Pose::new(&records, &wind, 0.0);
    let pack = EXPORTED.pack();
    let block = FoliageBlock::open(&pack).unwrap();
    let ours = Pose::new(block.branches, &wind, 0.0);
    let glb = (json, bytes);
    for level in 0..4 {
        let places = floats::<3>(&glb, level, "POSITION");
        let on = floats::<2>(&glb, level, "_WIND_BRANCH");
        let pivots = floats::<3>(&glb, level, "_WIND_PIVOT");
        let flutter = floats::<2>(&glb, level, "_WIND_FLUTTER");
        let sky = floats::<1>(&glb, level, "_SKY");
        let header = &block.header.levels[level];
        let mut moved = 0.0f32;
        for (i, v) in block.vertices[level].iter().enumerate() {
            let [branch, s] = on[i];
            let rest = Vec3::from(places[i]) - origin;
            let theirs = pose.place(&records, Hung::new(branch as u32, s), rest);
            let want = ours.place(block.branches, v.hung, v.position.into());
            assert!(theirs.distance(want) < 1e-4, "vertex {i}: {theirs}, not {want}");
            moved = moved.max(theirs.distance(rest));
            // Wood does not turn, and nothing turns about a place far away.
            assert_eq!(flutter[i][0] > 0.0, v.flutter > 0);
            assert!(i >= header.wood_vertices as usize || flutter[i][0] == 0.0);
            let far = Vec3::from(pivots[i]).distance(places[i].into());
            assert!(f64::from(far) < 64.0 * header.texel, "vertex {i}: {far}");
            assert!((0.0..=1.0).contains(&sky[i][0]) && (0.0..1.0).contains(&flutter[i][1]));
        }
        assert!(moved > 0.1, "{moved}");
    }
}

/// As the material functions of Pivot Painter 2 read them: written down from these, not from our writer.
#[test]
fn pivot_textures_are_read_as_the_engine_does() {
    use exr::prelude::read_first_rgba_layer_from_file;
    let pack = EXPORTED.pack();
    let block = FoliageBlock::open(&pack).unwrap();
    let path = EXPORTED.path("out/T_t_PivotPosition_ParentIndex.exr");
    type Rows = Vec<Vec<[f32; 4]>>;
    let image = read_first_rgba_layer_from_file(
        path,
        |size, _| vec![vec![[0.0f32; 4]; size.width()]; size.height()],
        |rows: &mut Rows, at, (r, g, b, a): (f32, f32, f32, f32)| {
            rows[at.y()][at.x()] = [r, g, b, a]
        },
    );
    let pivots = image.unwrap().layer_data.channel_data.pixels;
    let axes = image::open(EXPORTED.path("out/T_t_XVector_XExtent.png")).unwrap().into_rgba8();
    let (width, height) = (pivots[0].len(), pivots.len());
    assert_eq!((axes.width() as usize, axes.height() as usize), (width, height));
    assert!(width.is_power_of_two() && height.is_power_of_two());
    let unpacked = |float: f32| {
        let bits = float.to_bits();
        let exponent = ((bits >> 23 & 0xff) as i32 - 127 + 15) << 10;
        ((bits >> 16 & 0x8000) | exponent as u32 | (bits >> 13 & 0x3ff)) - 1024
    };
    // Every vertex leads to its branch's texel.
    let glb = EXPORTED.glb();
    let [uvs, on] = ["TEXCOORD_1", "_WIND_BRANCH"].map(|name| floats::<2>(&glb, 0, name));
    let mut seen = std::collections::BTreeSet::new();
    for ([u, v], [branch, _]) in uvs.into_iter().zip(on) {
        let [x, y] = [(u * width as f32) as usize, (v * height as f32) as usize];
        assert_eq!(y * width + x, branch as usize);
        seen.insert(branch as usize);
    }
    assert!(seen.len() > 50, "{}", seen.len());
    for (i, branch) in block.branches.iter().enumerate() {
        let [x, y, z, parent] = pivots[i / width][i % width];
        let place = DVec3::new(x.into(), z.into(), y.into()) / 100.0;
        let base = block.origin() + Vec3::from(branch.base).as_dvec3();
        // Half floats of up to 1,000 cm.
        assert!(place.distance(base) < 0.01, "{place} {base}");
        let parent = unpacked(parent);
        let want = if branch.parent == NO_BRANCH { i as u32 } else { branch.parent };
        assert_eq!(parent, want);
        let [r, g, b, a] = axes.get_pixel((i % width) as u32, (i / width) as u32).0;
        let axis = DVec3::from([r, b, g].map(|c| f64::from(c) / 127.5 - 1.0));
        let tip = (Vec3::from(branch.linear) + Vec3::from(branch.square)).as_dvec3();
        assert!(axis.normalize().dot(tip.normalize()) > 0.999, "{axis} {tip}");
        assert!((f64::from(a) / 255.0 * 20.48 - tip.length()).abs() < 0.05, "{a} {tip}");
    }
}

#[test]
fn far_trees_keep_their_shape_and_packs_without_foliage_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let file = |name: &str| arg(&dir.path().join(name));
    let mut far = small_tree();
    far.origin += DVec3::new(4e6, 0.0, -3e6);
    std::fs::write(file("far.fpack"), bake_foliage(&far, &Default::default()).unwrap().0).unwrap();
    succeed(&["export", &file("far.fpack"), "--format", "glb", "-o", &file("out"), "-q"]);
    let (json, bytes) = read(&dir.path().join("out/far.glb"));
    // The node is there; vertices have all their bits.
    assert_eq!(json["nodes"][0]["translation"], serde_json::json!([4e6, 0.0, -3e6]));
    assert!(
        json["nodes"][0]["extensions"].is_object() && json["nodes"].as_array().unwrap().len() == 4
    );
    let places = floats::<3>(&(json, bytes), 0, "POSITION");
    assert!(places.iter().flatten().all(|v| v.abs() < 10.0));
    let tree = arg(&repo("sample-data/shrub.obj"));
    succeed(&["points", &tree, "-o", &file("p.fpack"), "--surfel-size", "triangle", "-q"]);
    let (code, _, err) = run(&["export", &file("p.fpack"), "--format", "glb", "-o", &file("no")]);
    assert!(code == 3 && err.contains("foliage.header"), "{code} {err}");
}
