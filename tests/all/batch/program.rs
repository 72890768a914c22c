//! What is baked, why, and what is told of it.

use super::{Farm, POINTS, assert_valid, files, names};
use crate::support::{arg, inspect, repo, run, succeed};
use forest_tests::figures;
use serde_json::{Value, json};
use std::time::Instant;

/// Two hundred assets of which ten are broken: those that are sound are baked, and once.
#[test]
fn two_hundred_assets_and_ten_broken_ones() {
    let farm = Farm::new(&names(190), POINTS);
    let broken = [
        "v 0 0",
        "v 0 0 0\nf 1 2 3\n",
        "mtllib gone.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        "",
        "f 1/x/2 3 4\n",
        "v nan nan nan\nv nan 0 0\nv 0 nan 0\nf 1 2 3\n",
        "v 0 0 0\nv 0 0 0\nv 0 0 0\nf 1 2 3\n",
        "\u{0}\u{1}\u{2}",
        "mtllib ../../up.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        "v 1e39 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 99999999999\n",
    ];
    for (i, text) in broken.iter().enumerate() {
        std::fs::write(farm.path(&format!("trees/broken-{i}.obj")), text).unwrap();
    }
    let summary = farm.summary(4, &[]);
    assert_valid("batch", &summary);
    let status = |name: &str| {
        let all = summary["assets"].as_array().unwrap();
        all.iter().filter(|a| a["status"] == name).count()
    };
    assert_eq!([status("baked"), status("failed")], [190, 10], "{summary:#}");
    for a in summary["assets"].as_array().unwrap().iter().filter(|a| a["status"] == "failed") {
        let (name, error) = (a["name"].as_str().unwrap(), a["error"].as_str().unwrap());
        assert!(name.starts_with("broken") && error.contains(&format!("{name}.obj")), "{error}");
    }
    let packs: Vec<String> =
        (0..190).map(|i| arg(&farm.path(&format!("packs/tree-{i:03}.fpack")))).collect();
    let mut verify = vec!["verify", "-q"];
    verify.extend(packs.iter().map(|p| &**p));
    succeed(&verify);
    // Nothing to do: what failed is as it was, and would fail again.
    let start = Instant::now();
    let (code, _, err) = farm.batch(&[]);
    let seconds = start.elapsed().as_secs_f64();
    assert_eq!(code, 4);
    assert!(err.contains("0 baked, 190 up to date, 10 failed"), "{err}");
    assert!(seconds < 2.0, "{seconds} s");
    figures::note("rebake-seconds", seconds);
    // A mended one is baked.
    std::fs::write(farm.path("trees/broken-3.obj"), super::tuft(7, super::LEAVES)).unwrap();
    let summary = farm.summary(4, &[]);
    let of = |name: &str| {
        let all = summary["assets"].as_array().unwrap();
        all.iter().find(|a| a["name"] == name).unwrap()["status"].clone()
    };
    assert_eq!([of("broken-3"), of("broken-4"), of("tree-000")], ["baked", "failed", "current"]);
}

#[test]
fn a_job_runs_if_what_it_is_made_of_has_changed_and_says_so() {
    let farm = Farm::new(&names(3), POINTS);
    assert_eq!(farm.planned(), ["tree-000: is new", "tree-001: is new", "tree-002: is new"]);
    farm.summary(0, &[]);
    assert_eq!(farm.planned(), Vec::<String>::new());
    let first = farm.made();
    // A file of one.
    std::fs::write(farm.path("trees/tree-001.obj"), super::tuft(9, super::LEAVES)).unwrap();
    let planned = farm.planned();
    assert!(planned.len() == 1 && planned[0].ends_with("tree-001.obj has changed"), "{planned:?}");
    farm.summary(0, &[]);
    let second = farm.made();
    let changed: Vec<&String> = second.keys().filter(|k| first.get(*k) != second.get(*k)).collect();
    assert_eq!(changed, ["packs/tree-001.fpack"]);
    // Touched, not changed.
    let text = std::fs::read(farm.path("trees/tree-001.obj")).unwrap();
    std::fs::write(farm.path("trees/tree-001.obj"), text).unwrap();
    assert_eq!(farm.planned(), Vec::<String>::new());
    // A picture of all.
    farm.paint(90);
    let planned = farm.planned();
    assert!(planned.len() == 3 && planned[0].ends_with("leaf.png has changed"), "{planned:?}");
    farm.summary(0, &[]);
    // An option.
    let manifest = std::fs::read_to_string(farm.manifest()).unwrap();
    let more = "[[override]]\nmatch = \"*-002\"\nbake.points.radius = \"area\"\n";
    std::fs::write(farm.manifest(), manifest + more).unwrap();
    assert_eq!(farm.planned(), ["tree-002: options: with --set=points.radius=area"]);
    farm.summary(0, &[]);
    // What was made.
    std::fs::remove_file(farm.path("packs/tree-000.fpack")).unwrap();
    std::fs::write(farm.path("packs/tree-001.fpack"), "mine").unwrap();
    let planned = farm.planned();
    assert!(planned[0].ends_with("tree-000.fpack is not there"), "{planned:?}");
    assert!(planned[1].ends_with("tree-001.fpack is not as it was baked"), "{planned:?}");
    farm.summary(0, &[]);
    let (code, out, _) = farm.batch(&["--force", "--dry-run", "--only", "tree-001"]);
    assert_eq!((code, &*out), (0, "tree-001: is forced\n1 of 1 would be baked\n"));
}

/// One line an event, of the schema; warnings and stages of every asset.
#[test]
fn the_log_is_one_event_a_line() {
    let farm = Farm::new(&names(2), POINTS);
    std::fs::write(farm.path("trees/broken.obj"), "f 1 2 3\n").unwrap();
    let mtl = "newmtl leaf\nmap_Kd leaf.png\nnorm gone.png\n";
    std::fs::write(farm.path("trees/tree.mtl"), mtl).unwrap();
    let (code, _, err) = farm.batch(&["--log", "json"]);
    assert_eq!(code, 4);
    let validator = super::schema("event");
    let events: Vec<Value> = err.lines().map(|l| serde_json::from_str(l).expect(l)).collect();
    for event in &events {
        assert!(validator.is_valid(event), "{event}");
    }
    let of = |asset: &str| -> Vec<&str> {
        let own = events.iter().filter(|e| e["asset"] == asset);
        own.map(|e| e["event"].as_str().unwrap()).collect()
    };
    assert_eq!(of("tree-000"), ["start", "warning", "stage", "stage", "done"]);
    assert_eq!(of("broken"), ["start", "failed"]);
    let done = events.iter().find(|e| e["event"] == "done").unwrap();
    assert!(done["counts"]["points.points"].as_u64().unwrap() > 0, "{done}");
    assert!(done["bytes"].as_u64().unwrap() > 0 && done["seconds"].as_f64().unwrap() > 0.0);
    // People are told the same in sentences, and nothing with -q but what fails.
    let (_, _, err) = farm.batch(&["--force", "-q"]);
    assert!(err.lines().all(|l| l.starts_with("broken") || l.starts_with("forest-bake")), "{err}");
}

#[test]
fn presets_representations_and_exports_are_those_of_the_manifest() {
    let text = "[bake]\npreset = \"draft\"\nexports = [\"png\"]\nnearest = \"2m\"\n\
        [bake.views]\nviews = 16\ntexels = 32\n[[asset]]\nname = \"pair\"\n\
        trees = [\"trees/tree-000.obj\", \"trees/tree-001.obj@3,0,0:yaw=20\"]\n";
    let farm = Farm::new(&names(2), text);
    let summary = farm.summary(0, &[]);
    let done = &summary["assets"][0]["done"];
    assert_eq!(done["counts"]["views.views"], 16);
    let made: Vec<String> = farm.made().into_keys().collect();
    let exported: Vec<&str> = made.iter().filter_map(|n| n.strip_prefix("exports/pair/")).collect();
    assert_eq!(
        exported,
        ["pair.views.json", "pair_color.png", "pair_depth.png", "pair_normal.png"]
    );
    let report = inspect(&farm.path("packs/pair.fpack"));
    let options = report["options"].as_array().unwrap();
    assert!(options.contains(&json!("--set=views.texels=32")), "{options:?}");
    assert_eq!(report["sources"].as_array().unwrap().len(), 2);
    // Exports that are not asked for any more go, and what is not ours stays.
    std::fs::write(farm.path("exports/pair/notes.txt"), "mine").unwrap();
    let text = std::fs::read_to_string(farm.manifest()).unwrap();
    std::fs::write(farm.manifest(), text.replace("[\"png\"]", "[\"exr\"]")).unwrap();
    farm.summary(0, &[]);
    let made: Vec<String> = farm.made().into_keys().collect();
    assert_eq!(
        made,
        [
            "exports/pair/notes.txt",
            "exports/pair/pair.exr",
            "exports/pair/pair.views.json",
            "packs/pair.fpack"
        ]
    );
}

/// Every representation's errors are measured, written into the pack, and told.
#[test]
fn judged_assets_tell_their_errors() {
    let text = "[bake]\npreset = \"draft\"\nwith = [\"points\"]\njudge = true\n[[asset]]\nfiles = [\"trees/*.obj\"]\n";
    let farm = Farm::new(&names(1), text);
    let summary = farm.summary(0, &[]);
    let told = summary["assets"][0]["done"]["errors"]["points.flip"].as_f64().unwrap();
    let report = inspect(&farm.path("packs/tree-000.fpack"));
    let rows = report["measures"]["rows"].as_array().unwrap();
    let flips: Vec<f64> = rows.iter().map(|r| r["flip"].as_f64().unwrap()).collect();
    let least = flips.iter().copied().fold(f64::INFINITY, f64::min);
    let most = flips.iter().copied().fold(0.0, f64::max);
    assert!(told > least && told < most, "{least} {told} {most}");
}

/// One import, and the bytes that the commands one by one give.
#[test]
fn all_bakes_what_its_commands_bake() {
    let dir = tempfile::tempdir().unwrap();
    let [all, one] = ["all.fpack", "one.fpack"].map(|n| arg(&dir.path().join(n)));
    let tree = arg(&repo("sample-data/shrub.obj"));
    let (code, out, err) = run(&[
        "all",
        &tree,
        "-o",
        &all,
        "--preset",
        "draft",
        "--with",
        "points,views,foliage",
        "--set",
        "foliage.levels=1",
        "--json",
        "-q",
    ]);
    assert_eq!((code, &*err), (0, ""));
    let done: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(done["counts"]["points.triangles"], 4000);
    succeed(&["points", &tree, "-o", &one, "-q"]);
    let views = ["--views=64", "--texels=64", "--samples=2", "--channels=color,normal,depth"];
    succeed(&[&["views", &*tree, "-o", &one, "-q"], &views[..]].concat());
    succeed(&["foliage", &tree, "-o", &one, "--levels=1", "-q"]);
    let hashes = |pack: &str| -> Vec<Value> {
        let report = inspect(pack.as_ref());
        let all = report["sections"].as_array().unwrap().iter();
        let mut all: Vec<Value> = all.filter(|s| s["name"] != "meta").cloned().collect();
        all.sort_by_key(|s| s.to_string());
        all
    };
    assert_eq!(hashes(&all), hashes(&one));
    let (code, _, err) = run(&["all", &tree, "-o", &all, "--preset", "draft"]);
    assert!(code == 1 && err.contains("--force"), "{err}");
    let (code, _, err) = run(&["all", &tree, "-o", &all, "--force", "--set", "views.texels=33"]);
    assert!(code == 1 && err.contains("33 texels"), "{err}");
    let (code, _, err) = run(&["all", &tree, "-o", &all, "--force", "--set", "views.colour=3"]);
    assert!(code == 1 && err.contains("views: unexpected argument '--colour'"), "{err}");
    // A tree without leaves has no foliage; asked for by name that is an error.
    let bare = dir.path().join("bare.obj");
    std::fs::write(&bare, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 1 3 4\n")
        .unwrap();
    let bare = arg(&bare);
    let game = ["--preset", "game", "--set", "views.texels=16", "--set", "points.measure=false"];
    let (code, _, err) = run(&[&["all", &*bare, "-o", &*one, "--force"], &game[..]].concat());
    assert!(code == 0 && err.contains("no foliage"), "{err}");
    let (code, _, err) = run(&["all", &bare, "-o", &one, "--force", "--with", "foliage"]);
    assert!(code == 3 && err.contains("leaves"), "{err}");
}

#[test]
fn what_is_worse_than_the_baseline_fails() {
    let farm = Farm::new(&names(2), POINTS);
    let baseline = arg(&farm.path("baseline.json"));
    assert_eq!(farm.batch(&["-q", "--summary", &baseline]).0, 0);
    assert_eq!(farm.batch(&["-q", "--compare", &baseline, "--worse", "0"]).0, 0);
    std::fs::write(farm.path("trees/tree-001.obj"), super::tuft(1, 90)).unwrap();
    let (code, _, err) = farm.batch(&["-q", "--compare", &baseline, "--worse", "10"]);
    assert_eq!(code, 4);
    assert!(err.contains("tree-001: bytes") && err.contains("points.points"), "{err}");
    assert!(!err.contains("tree-000"), "{err}");
    let (code, _, err) = farm.batch(&["-q", "--compare", &arg(&farm.manifest())]);
    assert!(code == 3 && err.contains("forest.toml"), "{err}");
}

#[test]
fn manifests_and_requests_that_make_no_sense_are_refused() {
    let farm = Farm::new(&names(1), POINTS);
    let (code, _, err) = farm.batch(&["--only", "elm"]);
    assert!(code == 1 && err.contains("there are tree-000"), "{err}");
    let (code, _, err) = run(&["batch", "/nowhere/forest.toml"]);
    assert!(code == 2 && err.contains("/nowhere/forest.toml"), "{err}");
    std::fs::write(farm.manifest(), "version = 1\n[[asset]]\nfiles = [\"trees/*.xyz\"]\n").unwrap();
    let (code, _, err) = farm.batch(&[]);
    assert!(code == 3 && err.contains("asset 0") && err.contains("matches nothing"), "{err}");
    // What the bake refuses is told of the asset.
    let text = POINTS.replace("\"draft\"", "\"drafty\"");
    std::fs::write(farm.manifest(), format!("version = 1\n{text}")).unwrap();
    let (code, _, err) = farm.batch(&[]);
    assert!(code == 4 && err.contains("tree-000") && err.contains("drafty"), "{err}");
}

/// Shells and packagers have what --help says.
#[test]
fn completions_manual_pages_and_schemas_are_printed() {
    for (shell, want) in
        [("bash", "complete -F"), ("zsh", "#compdef forest-bake"), ("fish", "complete -c")]
    {
        let text = succeed(&["completions", shell]);
        assert!(text.contains(want) && text.contains("batch"), "{shell}");
    }
    let dir = tempfile::tempdir().unwrap();
    succeed(&["man", &arg(dir.path())]);
    let mut pages = Vec::new();
    files(dir.path(), &mut |p| pages.push(p.file_name().unwrap().to_string_lossy().into_owned()));
    assert!(
        pages.contains(&"forest-bake.1".into()) && pages.contains(&"forest-bake-batch.1".into())
    );
    let all: Value = serde_json::from_str(&succeed(&["schema"])).unwrap();
    let mut names: Vec<&String> = all.as_object().unwrap().keys().collect();
    names.sort();
    assert_eq!(names, ["batch", "eval", "event", "jobs", "manifest"]);
    let manifest: toml::Value = toml::from_str(&format!("version = 1\n{POINTS}")).unwrap();
    assert_valid("manifest", &serde_json::to_value(manifest).unwrap());
}
