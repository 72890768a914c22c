//! Threads, places and scales that must not matter.

use crate::support::{arg, repo, succeed};
use forest_import::{Block, Limits};
use forest_pack::{SectionId, kind};
use forest_points::{BakeOptions, GridChoice, PointsBlock};
use forest_soup::{AlphaMode, Instance, Material, Mesh, Model, Placement, TriangleSoup};
use forest_tests::soups::leaves;
use forest_tests::{bake_bytes, bake_model_bytes, open};
use glam::{DQuat, DVec3};

/// Cells, points and triangles: all that is drawn, without the header that places it.
fn payload(bytes: &[u8]) -> Vec<Vec<u8>> {
    let pack = open(bytes).unwrap();
    [kind::POINTS_CELLS, kind::POINTS, kind::POINTS_TRIANGLES]
        .map(|k| pack.bytes(SectionId::new(k, 0), 1 << 30).unwrap().into_owned())
        .to_vec()
}

fn bake(soup: &TriangleSoup) -> Vec<u8> {
    bake_bytes(soup, &BakeOptions::default()).unwrap().0
}

#[test]
fn one_two_and_eight_threads_write_the_same_bytes() {
    let dir = tempfile::tempdir().unwrap();
    for source in ["conifer.glb", "broadleaf_young.gltf"] {
        let bake_with = |threads: &str| {
            let pack = dir.path().join(format!("{threads}.fpack"));
            let source = arg(&repo("sample-data").join(source));
            succeed(&["points", &source, "-o", &arg(&pack), "--threads", threads, "-q", "--force"]);
            std::fs::read(pack).unwrap()
        };
        let one = bake_with("1");
        assert!(one == bake_with("2") && one == bake_with("8"), "{source}");
    }
}

/// What is measured is a part of the pack as everything else.
#[test]
fn measured_packs_do_not_depend_on_threads_either() {
    let dir = tempfile::tempdir().unwrap();
    let measured = |threads: &str| {
        let pack = arg(&dir.path().join(format!("{threads}.fpack")));
        let source = arg(&repo("sample-data/shrub.obj"));
        let size = ["--surfel-size", "0.1", "--measure"];
        succeed(
            &[&["points", &source, "-o", &pack, "--threads", threads, "-q"], &size[..]].concat(),
        );
        std::fs::read(pack).unwrap()
    };
    assert!(measured("1") == measured("3"));
    let left: Vec<_> = std::fs::read_dir(dir.path()).unwrap().map(|e| e.unwrap().path()).collect();
    assert_eq!(left.len(), 2, "{left:?}");
}

#[test]
fn a_block_moved_by_its_nodes_bakes_to_the_same_payload() {
    let tree = |offset: DVec3| {
        let leaf = leaves(300, 0.1, 8);
        let mesh = Mesh { positions: leaf.positions, triangles: leaf.triangles, ..Mesh::default() };
        let place = |i: i32| {
            let t = DVec3::new(f64::from(i) * 0.37, 0.1 * f64::from(i), 0.0);
            let turn = DQuat::from_rotation_y(f64::from(i));
            Placement::from_translation(offset) * Placement::from_trs(t, turn, DVec3::splat(1.1))
        };
        let instances = (0..5).map(|i| Instance { mesh: 0, placement: place(i) }).collect();
        let model = Model {
            meshes: vec![mesh],
            instances,
            materials: vec![Material::default()],
            textures: vec![],
        };
        bake(&model.flatten(10_000).unwrap())
    };
    let near = tree(DVec3::ZERO);
    let far = tree(DVec3::new(1e6, -1e6, 1e6 + 0.123));
    assert!(payload(&near) == payload(&far));
    let origin = |b: &[u8]| PointsBlock::open(&open(b).unwrap()).unwrap().origin();
    assert!((origin(&far) - origin(&near) - DVec3::new(1e6, -1e6, 1e6 + 0.123)).length() < 1e-9);
}

#[test]
fn scales_of_two_to_the_twenty_give_identical_payloads() {
    let soup = leaves(3000, 0.05, 6);
    let want = payload(&bake(&soup));
    for exponent in [-20, 20] {
        let mut scaled = soup.clone();
        let by = (exponent as f32).exp2();
        scaled.positions.iter_mut().for_each(|p| *p *= by);
        let bytes = bake(&scaled);
        assert!(payload(&bytes) == want, "2^{exponent}");
    }
}

#[test]
fn scales_of_ten_to_the_six_agree_within_a_hundred_thousandth() {
    let soup = leaves(3000, 0.05, 6);
    // Mean position of the surfels of each cell, over the block's size: quantisation averages out.
    let centers = |bytes: &[u8], scale: f64| {
        let pack = open(bytes).unwrap();
        let block = PointsBlock::open(&pack).unwrap();
        let mean = |cell: &forest_points::CellRecord| {
            let leaves = block.cell_points(cell).iter().filter(|p| p.is_leaf());
            let sum: DVec3 = leaves.map(|p| block.to_world(block.position(cell, p.position))).sum();
            sum / f64::from(cell.surfels.max(1)) / scale
        };
        block.cells.iter().map(|c| (c.grid_index, c.surfels, mean(c))).collect::<Vec<_>>()
    };
    let want = centers(&bake(&soup), 1.0);
    for scale in [1e-6f32, 1e6] {
        let mut scaled = soup.clone();
        scaled.positions.iter_mut().for_each(|p| *p *= scale);
        let got = centers(&bake(&scaled), f64::from(scale));
        assert_eq!(got.len(), want.len());
        for ((i, n, a), (j, m, b)) in got.iter().zip(&want) {
            assert_eq!((i, n), (j, m));
            assert!((*a - *b).length() < 1e-5, "{scale}: cell {i}, {a} {b}");
        }
    }
}

/// A block of sample trees, of a mesh with colours, corners that are no numbers and doubled triangles, one
/// placement mirrored.
fn mixed_block() -> Model {
    let sample = |name: &str, at: &str| format!("{}{at}", arg(&repo("sample-data").join(name)));
    let parts = [
        sample("shrub.obj", "@100000,3,0"),
        sample("broadleaf_young.gltf", "@100004,3,1:yaw=70,scale=0.3"),
        sample("shrub.obj", "@100000,3,2:yaw=20"),
    ];
    let mut model = Block::parse(&parts).unwrap().load(&Limits::default()).unwrap().model;
    let leaf = leaves(300, 0.2, 9);
    let mut odd = Mesh {
        colors: (0..900).map(|i| [0.3, 0.8, 0.1, (i % 5) as f32 / 4.0]).collect(),
        positions: leaf.positions,
        triangles: leaf.triangles,
        material: model.materials.len() as u16,
        ..Mesh::default()
    };
    odd.positions[17].y = f32::NAN;
    odd.triangles.extend_from_within(100..120);
    model.materials.push(Material { alpha_mode: AlphaMode::Blend, ..Material::default() });
    let mirror = DVec3::new(-1.0, 1.0, 1.0);
    let at = DVec3::new(100_002.0, 3.0, 0.5);
    let placement = Placement::from_trs(at, DQuat::from_rotation_y(1.0), mirror);
    model.instances.push(Instance { mesh: model.meshes.len() as u32, placement });
    model.meshes.push(odd);
    model
}

#[test]
fn blocks_baked_from_disk_are_those_baked_in_memory() {
    let model = mixed_block();
    let soup = model.clone().flatten(1 << 24).unwrap();
    for options in [
        BakeOptions::default(),
        BakeOptions { grid: GridChoice::Fixed([1, 1, 1]), ..BakeOptions::default() },
        BakeOptions {
            grid: GridChoice::Fixed([9, 3, 17]),
            triangles: false,
            ..BakeOptions::default()
        },
    ] {
        let (memory, in_memory) = bake_bytes(&soup, &options).unwrap();
        let (disk, on_disk) = bake_model_bytes(model.clone(), &options).unwrap();
        assert!(memory == disk, "{options:?}");
        assert_eq!(in_memory.header.counts, on_disk.header.counts);
        assert_eq!(
            (on_disk.header.counts.non_finite, on_disk.header.counts.duplicate >= 20),
            (1, true)
        );
    }
    let nothing = Model { instances: model.instances[..0].to_vec(), ..model.clone() };
    let error = bake_model_bytes(nothing, &BakeOptions::default()).unwrap_err().to_string();
    assert!(error.contains("no triangle"), "{error}");
    let mut broken = model;
    broken.meshes[0].triangles[3][1] = u32::MAX;
    let error = bake_model_bytes(broken, &BakeOptions::default()).unwrap_err().to_string();
    assert!(error.starts_with("invalid soup: mesh 0: a triangle uses vertices"), "{error}");
}
