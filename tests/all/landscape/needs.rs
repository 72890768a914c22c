//! `needs`: packs pruned to what a scene's cameras can ever ask, within a budget.

use super::{TREES, device, draw, make, make_of, mean, packs, packs_with_views};
use crate::support::{arg, repo, run, succeed};
use forest_gpu::LandscapeDetail;
use forest_points::PixelArea;
use forest_scene::{Scene, Sight};
use std::path::{Path, PathBuf};
/// Bytes of a file.
fn size_of(path: &Path) -> u64 {
    std::fs::metadata(path).unwrap_or_else(|e| panic!("{}: {e}", path.display())).len()
}

#[test]
fn pruned_packs_draw_the_same_frames_within_the_need() {
    let (gpu, dir) = (device(), tempfile::tempdir().unwrap());
    let path = make(dir.path(), 300, &[]);
    // From above the trees, 90 m away from the nearest.
    let text = std::fs::read_to_string(&path).unwrap();
    let (head, _) = text.split_once("[[camera]]").unwrap();
    let camera = "[[camera]]\nname = \"high\"\nat = [0.0, 60.0]\nabove = 110.0\npitch = -50.0\n";
    std::fs::write(&path, format!("{head}{camera}")).unwrap();
    let folder = dir.path().join("lean");
    let [scene, out] = [&path, &folder].map(|p| arg(p));
    let same = ["--height", "180", "--finest", "1"];
    let line = [&["needs", scene.as_str(), "-o", &out], &same[..]].concat();
    let text = succeed(&line);
    assert!(text.lines().count() == 3 && text.contains("points"), "{text}");
    let whole = Scene::open(&path).unwrap();
    let lean = Scene::open(&folder.join("forest.toml")).unwrap();
    assert_eq!(whole.trees, lean.trees);
    for (a, b) in whole.species.iter().zip(&lean.species) {
        let [before, after] = [&a.pack, &b.pack].map(|p| size_of(p.path()));
        assert!(after * 4 < before * 3, "{after} of {before} bytes");
    }
    let camera = whole.file.camera(None).unwrap().camera(&whole.land, [320, 180]);
    let finest = PixelArea(1.0);
    let largest = PixelArea(16.0);
    for hidden in [0.0, 2.0 / 3.0] {
        let detail = LandscapeDetail { finest, largest, hidden, ..LandscapeDetail::default() };
        let [a, b] = [&whole, &lean].map(|s| draw(&gpu, s, &camera, &detail, false, 1));
        assert!(a.pixels == b.pixels, "another frame, hidden {hidden}");
        assert_eq!((a.counts.points, b.counts.beyond), (b.counts.points, 0));
    }
    // A camera among the trees asks for more, and is told.
    let near = Sight { above: 6.0, pitch: 0.0, ..whole.file.camera(None).unwrap().clone() };
    let near = near.camera(&whole.land, [320, 180]);
    let detail = LandscapeDetail { finest, largest, ..LandscapeDetail::default() };
    let [a, b] = [&whole, &lean].map(|s| draw(&gpu, s, &near, &detail, false, 1));
    assert!(a.counts.beyond == 0 && b.counts.beyond > 0, "{:?}", b.counts);
    // It is the same forest, in coarser points.
    let [a, b] = [a, b].map(|d| mean(d.pixels.into_iter()));
    assert!((0..3).all(|k| (a[k] - b[k]).abs() < 0.05), "{a:?} {b:?}");
    let again = run(&line);
    assert!(again.0 == 1 && again.2.contains("is there already; --force"), "{again:?}");
}

#[test]
fn pruned_views_draw_the_same_frames_within_the_need() {
    let (gpu, dir) = (device(), tempfile::tempdir().unwrap());
    let path = make_of(packs_with_views(), dir.path(), 2000, &[]);
    // From above alone: no tree is larger than a few pixels.
    let text = std::fs::read_to_string(&path).unwrap();
    let (head, _) = text.split_once("[[camera]]").unwrap();
    let camera = "[[camera]]\nname = \"high\"\nat = [0.0, 150.0]\nabove = 140.0\npitch = -40.0\n";
    std::fs::write(&path, format!("{head}{camera}")).unwrap();
    let folder = dir.path().join("lean");
    let line = ["needs", &arg(&path), "-o", &arg(&folder), "--height", "180", "--finest", "1"];
    let text = succeed(&line);
    assert!(text.lines().all(|l| l.contains("levels of views")), "{text}");
    let whole = Scene::open(&path).unwrap();
    let lean = Scene::open(&folder.join("forest.toml")).unwrap();
    let mut saved = 0;
    for (a, b) in whole.species.iter().zip(&lean.species) {
        let [full, kept] = [a, b].map(|s| s.views().unwrap().unwrap().header);
        assert!(kept.levels.len() < full.levels.len() && !kept.channels.normal, "{kept:?}");
        saved += usize::from(kept.levels[0].texels < full.levels[0].texels);
        let [before, after] = [a, b].map(|s| size_of(s.pack.path()));
        assert!(after * 4 < before, "{after} of {before} bytes");
    }
    assert!(saved > 0, "all have their finest level");
    let camera = whole.file.camera(None).unwrap().camera(&whole.land, [320, 180]);
    for hidden in [0.0, 2.0 / 3.0] {
        let finest = PixelArea(1.0);
        let detail = LandscapeDetail { finest, hidden, ..LandscapeDetail::default() };
        let [a, b] = [&whole, &lean].map(|s| draw(&gpu, s, &camera, &detail, false, 1));
        assert!(a.counts.impostors * 2 > a.counts.trees, "{:?}", a.counts);
        assert_eq!(a.counts, b.counts);
        assert!(a.pixels == b.pixels, "another frame, hidden {hidden}");
    }
}

#[test]
fn more_bytes_are_spent_on_what_is_seen_and_are_worth_it() {
    let (gpu, dir) = (device(), tempfile::tempdir().unwrap());
    let measured: Vec<PathBuf> = packs_with_views()
        .iter()
        .zip(TREES)
        .map(|(from, tree)| {
            let pack = dir.path().join(from.file_name().unwrap());
            std::fs::copy(from, &pack).unwrap();
            let source = arg(&repo("sample-data").join(tree));
            let few =
                ["--alone", "--embed", "--heights", "64,16,4", "--views", "3", "--samples", "2"];
            succeed(&[&["eval", &arg(&pack), "--source", &source, "-q"][..], &few].concat());
            pack
        })
        .collect();
    let path = make_of(&measured, dir.path(), 1000, &[]);
    let whole = Scene::open(&path).unwrap();
    let camera = whole.file.camera(None).unwrap().camera(&whole.land, [320, 180]);
    let detail = LandscapeDetail { finest: PixelArea(1.0), ..LandscapeDetail::default() };
    let full = draw(&gpu, &whole, &camera, &detail, false, 2).pixels;
    let scene = arg(&path);
    let line = ["needs", &scene, "--height", "180", "--finest", "1", "--json"];
    let mut last = (f64::INFINITY, f64::INFINITY);
    for bytes in ["300KiB", "900KiB", "3MiB"] {
        let folder = dir.path().join(bytes);
        let text = succeed(&[&line[..], &["-o", &arg(&folder), "--max-bytes", bytes]].concat());
        let report: serde_json::Value = serde_json::from_str(&text).unwrap();
        let (all, expected) = (&report["packs"], report["budget"]["error"].as_f64().unwrap());
        let sizes = all.as_array().unwrap().iter().map(|p| p["bytes"][1].as_u64().unwrap());
        let most = bytes.parse::<bytesize::ByteSize>().unwrap().0;
        let sum: u64 = sizes.sum();
        assert!(sum <= most && sum * 4 > most * 3, "{sum} of {most} bytes");
        let lean = Scene::open(&folder.join("forest.toml")).unwrap();
        let pixels = draw(&gpu, &lean, &camera, &detail, false, 2).pixels;
        let off = |(a, b): (&[f32; 3], &[f32; 3])| f64::from((a[1] - b[1]).powi(2));
        let error = full.iter().zip(&pixels).map(off).sum::<f64>().sqrt();
        assert!(expected < last.0 && error < last.1, "{bytes}: {expected}, {error} after {last:?}");
        last = (expected, error);
    }
    let (out, tiny) = (arg(&dir.path().join("none")), ["--max-bytes", "1KiB"]);
    let none = run(&[&line[..], &["-o", &out], &tiny].concat());
    assert!(none.0 == 1 && none.2.contains("the smallest packs have"), "{none:?}");
    let text = succeed(&[&line[..], &["-o", &out, "--max-error", "0.2"]].concat());
    let report: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert!(report["budget"]["error"].as_f64().unwrap() <= 0.2);
}

#[test]
fn a_pruned_pack_is_drawn_as_the_whole_one_from_its_nearest_distance_on() {
    let dir = tempfile::tempdir().unwrap();
    let folder = arg(&dir.path().join("lean"));
    let pack = arg(&packs()[1]);
    let name = packs()[1].file_name().unwrap().to_string_lossy().into_owned();
    // The broadleaf tree is some 6 units high: as parallel pictures of 64 pixels have it from 11 on.
    let line = ["needs", &pack, "-o", &folder, "--nearest", "11m", "--height", "64", "--fov", "35"];
    let text = succeed(&[&line[..], &["--json"]].concat());
    let rows: serde_json::Value = serde_json::from_str(&text).unwrap();
    let bytes = rows["packs"][0]["bytes"].as_array().unwrap();
    assert!(bytes[1].as_u64().unwrap() * 2 < bytes[0].as_u64().unwrap(), "{rows}");
    let lean = arg(&dir.path().join("lean").join(name));
    succeed(&["verify", &lean, "-q"]);
    let [a, b] = ["a.png", "b.png"].map(|n| arg(&dir.path().join(n)));
    let draw = |pack: &str, png: &str, size: &str| {
        let (code, _, err) =
            run(&["draw", pack, "-o", png, "--size", size, "--view", "40,20", "--finest", "1"]);
        assert_eq!(code, 0, "{err}");
        err
    };
    let (whole, pruned) = (draw(&pack, &a, "48"), draw(&lean, &b, "48"));
    assert!(!whole.contains("pruned") && !pruned.contains("pruned"), "{pruned}");
    assert!(std::fs::read(&a).unwrap() == std::fs::read(&b).unwrap());
    let pruned = draw(&lean, &b, "512");
    assert!(pruned.contains("pruned; has no points of 1 px² here"), "{pruned}");
    let (code, _, err) = run(&["needs", &pack, "-o", &folder]);
    assert!(code == 1 && err.contains("packs need --nearest"), "{err}");
}
