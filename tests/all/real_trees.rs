//! Trees by others: in ../shared/trees beside the checkout, where they are.

use crate::support::{arg, inspect, shared, succeed};
use std::path::PathBuf;

fn tree(name: &str) -> Option<PathBuf> {
    shared("trees").map(|t| t.join(name))
}

/// Bakes and verifies; returns the counts of `inspect`.
fn baked(name: &str) -> Option<serde_json::Value> {
    let dir = tempfile::tempdir().unwrap();
    let pack = dir.path().join("t.fpack");
    succeed(&["points", &arg(&tree(name)?), "-o", &arg(&pack), "-q"]);
    succeed(&["verify", &arg(&pack)]);
    Some(inspect(&pack)["points"]["counts"].clone())
}

#[test]
fn triangle_counts_are_those_of_the_manifest() {
    for (name, triangles) in [
        ("sap_pine_20k.glb", 20_900),
        ("sap_pine_20k.obj", 20_900),
        ("ez_ash_medium.glb", 20_000),
        ("sap_birch_200k.glb", 194_564),
        ("japaneseMaple/japaneseMaple.obj", 198_396),
        ("christmas_tree/christmas_tree.obj", 15_552),
        ("bush/bush.obj", 40_292),
        ("sap_jmaple_450k.glb", 441_540),
    ] {
        if let Some(counts) = baked(name) {
            assert_eq!(counts["source_triangles"], triangles, "{name}");
            assert_eq!(counts["non_finite"], 0, "{name}");
        }
    }
}

#[test]
fn an_exporters_wrapped_indices_show_as_duplicates() {
    if let Some(counts) = baked("ez_oak_wrapped_u16.glb") {
        assert_eq!(counts["duplicate"], 114_657);
    }
}

#[test]
fn glb_and_obj_of_one_tree_agree() {
    // The same geometry by two formats; alpha is a mask in one and coverage in the other.
    let (Some(glb), Some(obj)) = (baked("sap_pine_20k.glb"), baked("sap_pine_20k.obj")) else {
        return;
    };
    let surfels = |c: &serde_json::Value| c["surfels"].as_f64().unwrap();
    assert!((surfels(&glb) / surfels(&obj) - 1.0).abs() < 0.1, "{glb} {obj}");
}

#[test]
fn a_block_of_real_trees_bakes() {
    let names = ["sap_pine_20k.glb", "sap_birch_200k.glb", "ez_ash_medium.glb"];
    let paths: Option<Vec<String>> = names.iter().map(|n| tree(n).map(|p| arg(&p))).collect();
    let Some(paths) = paths else { return };
    let dir = tempfile::tempdir().unwrap();
    let pack = arg(&dir.path().join("block.fpack"));
    let placed = format!("{}@12,0,3:yaw=70", paths[1]);
    let third = format!("{}@-6,0,5:scale=0.2", paths[2]);
    succeed(&["points", &paths[0], &placed, &third, "-o", &pack, "-q"]);
    succeed(&["verify", &pack]);
    let report = inspect(pack.as_ref());
    assert_eq!(report["points"]["counts"]["source_triangles"], 20_900 + 194_564 + 20_000);
    assert_eq!(report["sources"].as_array().unwrap().len(), 3);
    let mut textures =
        report["sections"].as_array().unwrap().iter().filter(|s| s["name"] == "texture");
    assert!(textures.clone().count() >= 5 && textures.all(|t| t["codec"] == "zstd"));
}
