//! Several at once: on one cache, and as jobs of a workflow engine.

use super::{Farm, POINTS, assert_valid, names, shipped};
use crate::support::{arg, forest_bake};
use forest_tests::figures;
use serde_json::Value;
use std::io::Write;
use std::process::{Command, Stdio};

#[test]
fn two_runs_at_once_share_a_cache() {
    let cache = tempfile::tempdir().unwrap();
    let farms = [Farm::new(&names(20), POINTS), Farm::new(&names(20), POINTS)];
    let program = forest_bake().get_program().to_owned();
    // Twice on the same manifest, too.
    let writers = 3 * figures::effort();
    let runs: Vec<_> = (0..writers)
        .map(|i| &farms[usize::from(i % 3 == 2)])
        .map(|farm| {
            Command::new(&program)
                .args(["batch", &arg(&farm.manifest()), "--cache", &arg(cache.path())])
                .stderr(Stdio::piped())
                .spawn()
                .unwrap()
        })
        .collect();
    figures::note("writers", writers as f64);
    for run in runs {
        let output = run.wait_with_output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    assert_eq!(farms[0].made().len(), 20);
    assert_eq!(farms[0].made(), farms[1].made());
    let entries = |folder: &std::path::Path| {
        let mut count = 0;
        super::files(folder, &mut |p| count += usize::from(p.ends_with("done.json")));
        count
    };
    assert_eq!(entries(cache.path()), 20);
    assert_eq!(std::fs::read_dir(cache.path().join("making")).unwrap().count(), 0);
    // A third takes all of it out of the cache.
    let third = Farm::new(&names(20), POINTS);
    let (code, _, err) = third.batch(&["--cache", &arg(cache.path()), "--log", "json"]);
    assert_eq!(code, 0, "{err}");
    assert!(!err.contains("\"start\""), "nothing is baked: {err}");
    assert_eq!(third.made(), farms[0].made());
}

#[test]
fn memory_decides_how_many_bake_at_once() {
    let farm = Farm::new(&names(6), POINTS);
    let most_at_once = |memory: &str| {
        let options = ["--max-memory", memory, "--jobs", "4", "--log", "json", "--force"];
        let (code, _, err) = farm.batch(&options);
        assert_eq!(code, 0, "{err}");
        let (mut now, mut most) = (0i32, 0);
        for line in err.lines() {
            let event: Value = serde_json::from_str(line).unwrap();
            match event["event"].as_str().unwrap() {
                "start" => now += 1,
                "done" => now -= 1,
                _ => {}
            }
            most = most.max(now);
        }
        most
    };
    // One may always run; a guess for an unknown asset is some hundreds of megabytes.
    assert_eq!(most_at_once("1MiB"), 1);
    assert!(most_at_once("64GiB") > 1);
}

#[test]
fn jobs_are_told_to_other_engines() {
    let farm = Farm::new(&names(3), POINTS);
    let graph = || -> Value {
        let (code, out, err) = farm.batch(&["--jobs-json"]);
        assert_eq!(code, 0, "{err}");
        serde_json::from_str(&out).unwrap()
    };
    let first = graph();
    assert_valid("jobs", &first);
    let job = &first["jobs"][1];
    let inputs: Vec<&str> =
        job["inputs"].as_array().unwrap().iter().map(|i| i.as_str().unwrap()).collect();
    for want in ["tree-001.obj", "tree.mtl", "leaf.png"] {
        assert!(inputs.iter().any(|i| i.ends_with(want)), "{inputs:?}");
    }
    let guessed = job["memory_bytes"].as_u64().unwrap();
    // The command is what bakes it.
    let command: Vec<&str> =
        job["command"].as_array().unwrap().iter().map(|c| c.as_str().unwrap()).collect();
    assert_eq!(command[0], "forest-bake");
    crate::support::succeed(&command[1..]);
    assert_eq!(farm.made().into_keys().collect::<Vec<_>>(), ["packs/tree-001.fpack"]);
    // Now its memory is known.
    let second = graph();
    assert_eq!(second["jobs"][1]["hash"], job["hash"]);
    assert!(second["jobs"][1]["memory_bytes"].as_u64().unwrap() < guessed);
}

/// The shipped workflow gives the bytes that `batch` gives.
#[test]
fn snakemake_bakes_the_same_bytes() {
    let Ok(snakemake) = std::env::var("SNAKEMAKE") else {
        // Past the harness, which keeps to itself what a passing test prints.
        let _ =
            writeln!(std::io::stderr(), "skipped: SNAKEMAKE does not name it (see `make test`)");
        return;
    };
    let reference = Farm::new(&names(6), POINTS);
    reference.summary(0, &[]);
    let farm = Farm::new(&names(6), POINTS);
    let program = forest_bake().get_program().to_string_lossy().into_owned();
    let run = |farm: &Farm| {
        let output = Command::new(&snakemake)
            .args(["--snakefile", &arg(&shipped("Snakefile")), "--cores", "2", "--quiet", "all"])
            .args(["--directory", &arg(farm.folder.path())])
            .args(["--config", &format!("manifest={}", arg(&farm.manifest()))])
            .args([
                &format!("forest_bake={program}"),
                &format!("cache={}", arg(&farm.path("cache"))),
            ])
            .output()
            .unwrap();
        let err = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{err}");
        err
    };
    run(&farm);
    assert_eq!(farm.made(), reference.made());
    // Both know what the other made.
    assert_eq!(farm.planned(), Vec::<String>::new());
    let err = run(&farm);
    assert!(!err.contains("rule "), "nothing to do: {err}");
}
