//! Scenes are made, refused, drawn and measured by the programs.

use super::{make, packs};
use crate::support::{arg, forest_bake, run, succeed};
use forest_scene::Scene;
use forest_tests::screen::Screen;
use std::path::Path;
use std::process::Command;
#[test]
fn a_landscape_is_made_and_planted_anew() {
    let dir = tempfile::tempdir().unwrap();
    let path = make(dir.path(), 500, &["--seed", "7", "--square", "10"]);
    let table = path.with_extension("trees");
    let (text, trees) = (std::fs::read(&path).unwrap(), std::fs::read(&table).unwrap());
    // 500 expected; a Poisson number strays by 22.
    let scene = Scene::open(&path).unwrap();
    assert!((400..600).contains(&scene.trees.len()), "{}", scene.trees.len());
    for t in &scene.trees {
        let [x, y, z] = t.position.map(f64::from);
        assert_eq!(y as f32, scene.land.height(x, z) as f32);
    }
    // Planted anew: the same, with one thread too; and another seed is another forest.
    std::fs::remove_file(&table).unwrap();
    succeed(&["scene", &arg(&path), "--plant", "-q", "--threads", "1"]);
    assert_eq!(std::fs::read(&table).unwrap(), trees);
    let again = run(&["scene", &arg(&packs()[0]), "-o", &arg(&path)]);
    assert!(
        again.0 == 1 && again.2.contains("forest.toml: is there already; --force"),
        "{again:?}"
    );
    assert_eq!(std::fs::read(&path).unwrap(), text);
    make(dir.path(), 500, &["--seed", "8", "--square", "10", "--force"]);
    assert_ne!(std::fs::read(&table).unwrap(), trees);
}

#[test]
fn wrong_scenes_are_refused_by_name() {
    let dir = tempfile::tempdir().unwrap();
    let path = make(dir.path(), 50, &[]);
    let good = std::fs::read_to_string(&path).unwrap();
    let cases = [
        ("seed = 1", "seeds = 1", "unknown field `seeds`"),
        ("range = ", "range = -", "land.fractal: a range of -"),
        ("cells = 8\n", "cells = 9\n", "9 cells; it must be a power of two"),
        ("trees = 50.0", "trees = 5e9", "forest.trees: 5000000000; it must be within"),
        ("elevation = 48.0", "elevation = 2.0", "sun.elevation: 2; it must be within 6 and 90"),
        ("\"within\"]", "\"without\"]", "path flight: no camera is named without"),
        ("forest.trees\"", "gone.trees\"", "gone.trees: reading the trees"),
    ];
    for (old, new, what) in cases {
        assert!(good.contains(old), "{old}\n{good}");
        std::fs::write(&path, good.replace(old, new)).unwrap();
        let error = Scene::open(&path).unwrap_err();
        assert!(error.to_string().contains(what), "{what}: {error}");
        let code = if what.contains("gone") { 2 } else { 3 };
        let program = Path::new(forest_bake().get_program()).with_file_name("forest-view");
        let mut view = Command::new(program);
        let png = arg(&dir.path().join("no.png"));
        let output = view.args([&arg(&path), "--headless", "-o", &png]).output().unwrap();
        assert_eq!(output.status.code(), Some(code), "{what}");
        assert!(String::from_utf8_lossy(&output.stderr).contains(what), "{what}");
    }
    let wrong = run(&["scene", "oak.fpack:colour=3", "-o", &arg(&dir.path().join("x.toml"))]);
    assert!(wrong.0 == 1 && wrong.2.contains("\"colour=3\""), "{wrong:?}");
}

#[test]
fn the_program_draws_measures_and_steers() {
    let dir = tempfile::tempdir().unwrap();
    let scene = arg(&make(dir.path(), 300, &[]));
    let [png, json, shot] = ["a.png", "a.json", "b.png"].map(|n| arg(&dir.path().join(n)));
    let program = Path::new(forest_bake().get_program()).with_file_name("forest-view");
    let view = |args: &[&str], display: Option<&str>| {
        let mut command = Command::new(&program);
        command.args(args).env("XDG_RUNTIME_DIR", dir.path()).env_remove("WAYLAND_DISPLAY");
        match display {
            Some(display) => command.env("DISPLAY", display),
            None => command.env_remove("DISPLAY"),
        };
        let output = command.output().unwrap();
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        (output.status.code(), text)
    };
    let small = ["--size", "240x136", "--samples", "1"];
    let with = |args: &[&str]| -> Vec<String> {
        [&[scene.as_str()], &small[..], args].concat().iter().map(|s| s.to_string()).collect()
    };
    let call = |args: &[&str], display: Option<&str>| {
        let args = with(args);
        view(&args.iter().map(String::as_str).collect::<Vec<_>>(), display)
    };
    let (code, text) = call(&["--headless", "-o", &png, "--camera", "within"], None);
    assert!(code == Some(0) && text.contains("trees"), "{text}");
    // The window shows what is drawn without one.
    let screen = Screen::start([640, 480]);
    let line = ["--screenshot", &shot, "--camera", "within"];
    let (code, text) = call(&line, Some(&screen.display()));
    assert_eq!(code, Some(0), "{text}");
    let [a, b] = [&png, &shot].map(|p| image::open(p).unwrap().into_rgb8());
    assert!(a == b, "the window's picture is another");
    // A rate that cannot be reached ends at coarse points; one that is easy, at fine ones.
    let primitives = |rate: &str| {
        let (code, text) = call(&["--bench", "flight", "--json", &json, "--fps", rate], None);
        assert_eq!(code, Some(0), "{text}");
        let report: serde_json::Value =
            serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap();
        assert_eq!(report["frames"], 60);
        assert!(report["frame_ms"]["p99"].as_f64() >= report["frame_ms"]["p50"].as_f64());
        report["primitives"]["p50"].as_f64().unwrap()
    };
    let (fast, slow) = (primitives("5000"), primitives("0.5"));
    assert!(fast < 0.5 * slow, "{fast} against {slow}");
    for (args, what) in [
        (&["--headless", "-o", &png, "--camera", "moon"][..], "no camera is named moon"),
        (&["--bench", "walk", "--json", &json], "no path is named walk"),
        (&["--headless", "-o", &png, "--error", "0.05"], "--error needs a measured table"),
    ] {
        let (code, text) = call(args, None);
        assert!(code == Some(1) && text.contains(what), "{text}");
    }
}
