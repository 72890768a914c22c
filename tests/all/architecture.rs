//! The arrows between crates, read from `cargo metadata`.

use crate::support::repo;
use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;

fn metadata() -> serde_json::Value {
    let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".into());
    let output = Command::new(cargo)
        .args(["metadata", "--format-version", "1", "--locked"])
        .current_dir(repo("."))
        .output()
        .expect("cargo runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("JSON")
}

/// What each crate of this workspace may use of it. Tests may use more.
const ALLOWED: &[(&str, &[&str])] = &[
    ("forest-soup", &[]),
    ("forest-pack", &[]),
    ("forest-import", &["forest-soup"]),
    ("forest-batch", &["forest-import", "forest-pack"]),
    ("forest-points", &["forest-soup", "forest-pack"]),
    ("forest-raster", &["forest-soup"]),
    ("forest-vq", &[]),
    ("forest-views", &["forest-soup", "forest-raster", "forest-pack"]),
    (
        "forest-export",
        &["forest-soup", "forest-pack", "forest-points", "forest-views", "forest-foliage"],
    ),
    ("forest-volume", &["forest-soup", "forest-raster", "forest-pack", "forest-vq"]),
    ("forest-foliage", &["forest-soup", "forest-raster", "forest-pack", "forest-points"]),
    (
        "forest-draw",
        &[
            "forest-foliage",
            "forest-soup",
            "forest-raster",
            "forest-pack",
            "forest-points",
            "forest-views",
            "forest-volume",
        ],
    ),
    (
        "forest-eval",
        &[
            "forest-foliage",
            "forest-soup",
            "forest-raster",
            "forest-pack",
            "forest-points",
            "forest-views",
            "forest-volume",
            "forest-draw",
        ],
    ),
    (
        "forest-gpu",
        &[
            "forest-foliage",
            "forest-soup",
            "forest-raster",
            "forest-pack",
            "forest-points",
            "forest-views",
            "forest-volume",
            "forest-scene",
        ],
    ),
    (
        "forest-scene",
        &["forest-soup", "forest-raster", "forest-pack", "forest-points", "forest-views"],
    ),
    ("forest-sample-data", &["forest-soup"]),
    (
        "forest-view",
        &[
            "forest-foliage",
            "forest-soup",
            "forest-pack",
            "forest-import",
            "forest-points",
            "forest-raster",
            "forest-views",
            "forest-volume",
            "forest-scene",
            "forest-gpu",
        ],
    ),
    (
        "forest-bake",
        &[
            "forest-batch",
            "forest-foliage",
            "forest-soup",
            "forest-pack",
            "forest-import",
            "forest-points",
            "forest-raster",
            "forest-draw",
            "forest-eval",
            "forest-views",
            "forest-volume",
            "forest-export",
            "forest-scene",
        ],
    ),
    (
        "forest-tests",
        &[
            "forest-foliage",
            "forest-soup",
            "forest-pack",
            "forest-import",
            "forest-points",
            "forest-raster",
            "forest-draw",
            "forest-eval",
            "forest-views",
            "forest-volume",
            "forest-export",
            "forest-sample-data",
            "forest-vq",
            "forest-scene",
            "forest-gpu",
        ],
    ),
];

#[test]
fn arrows_point_one_way() {
    let metadata = metadata();
    let allowed: BTreeMap<&str, BTreeSet<&str>> =
        ALLOWED.iter().map(|(k, v)| (*k, v.iter().copied().collect())).collect();
    let mut seen = 0;
    for package in metadata["packages"].as_array().unwrap() {
        let name = package["name"].as_str().unwrap();
        if !package["source"].is_null() {
            continue;
        }
        seen += 1;
        let may = allowed.get(name).unwrap_or_else(|| panic!("{name}: say here what it may use"));
        for dependency in package["dependencies"].as_array().unwrap() {
            let used = dependency["name"].as_str().unwrap();
            if used.starts_with("forest-") && dependency["kind"].is_null() {
                assert!(may.contains(used), "{name} must not use {used}");
            }
        }
    }
    assert_eq!(seen, ALLOWED.len());
}

#[test]
fn only_one_module_knows_bincode() {
    let mut users = vec![];
    for package in metadata()["packages"].as_array().unwrap() {
        let dependencies = package["dependencies"].as_array().unwrap();
        if package["source"].is_null() && dependencies.iter().any(|d| d["name"] == "bincode") {
            users.push(package["name"].as_str().unwrap().to_string());
        }
    }
    assert_eq!(users, ["forest-pack"]);
    let source = repo("formats/pack/src");
    for entry in std::fs::read_dir(source).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "rs") && path.file_name().unwrap() != "header.rs" {
            let text = std::fs::read_to_string(&path).unwrap();
            assert!(!text.contains("bincode::"), "{}", path.display());
        }
    }
}

/// The licences that deny.toml allows.
fn allowed_licences() -> Vec<String> {
    let text = std::fs::read_to_string(repo("deny.toml")).unwrap();
    let deny: toml::Table = toml::from_str(&text).unwrap();
    let allow = deny["licenses"]["allow"].as_array().unwrap();
    allow.iter().map(|l| l.as_str().unwrap().to_string()).collect()
}

#[test]
fn every_dependency_has_a_licence_we_can_ship() {
    let allowed = allowed_licences();
    for package in metadata()["packages"].as_array().unwrap() {
        let name = package["name"].as_str().unwrap();
        let Some(licence) = package["license"].as_str() else { panic!("{name} has no licence") };
        // One choice of every OR whose ANDs are all known.
        let fits = licence
            .replace('/', " OR ")
            .replace(['(', ')'], "")
            .split(" OR ")
            .any(|choice| choice.split(" AND ").all(|l| allowed.iter().any(|a| a == l.trim())));
        assert!(fits, "{name}: {licence}");
    }
}

#[test]
fn all_crates_use_one_glam() {
    let metadata = metadata();
    let nodes = metadata["resolve"]["nodes"].as_array().unwrap();
    let ours = nodes.iter().filter(|n| n["id"].as_str().unwrap().contains("forest-"));
    let glams: BTreeSet<&str> = ours
        .flat_map(|n| n["deps"].as_array().unwrap())
        .filter(|d| d["name"] == "glam")
        .map(|d| d["pkg"].as_str().unwrap())
        .collect();
    assert_eq!(glams.len(), 1, "{glams:?}");
}
