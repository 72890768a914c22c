//! The shipped `forest-view`: pictures without a window, its window under a virtual screen, exit codes.

use crate::support::{arg, forest_bake, repo, succeed};
use forest_draw::draw_points;
use forest_pack::Pack;
use forest_points::{PixelArea, PointsBlock, SizeCode, Thresholds};
use forest_raster::{Light, Sampling, Style};
use forest_soup::{Camera, Projection};
use forest_tests::screen::Screen;
use glam::DVec3;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

/// Runs it and returns (exit code, stderr).
pub(crate) fn view(args: &[&str]) -> (i32, String) {
    let program = Path::new(forest_bake().get_program()).with_file_name("forest-view");
    // Mesa complains where this folder is not set.
    let folder = tempfile::tempdir().unwrap();
    let mut command = Command::new(program);
    let command = command.args(args).env("XDG_RUNTIME_DIR", folder.path());
    let output = command.output().expect("the program starts");
    (output.status.code().unwrap_or(-1), String::from_utf8_lossy(&output.stderr).into_owned())
}

fn golden(name: &str) -> String {
    arg(&repo("tests/golden").join(name))
}

fn picture(path: &str) -> image::RgbaImage {
    image::open(path).unwrap_or_else(|e| panic!("{path}: {e}")).into_rgba8()
}

#[test]
fn draws_every_representation_without_a_window() {
    let dir = tempfile::tempdir().unwrap();
    let png = arg(&dir.path().join("t.png"));
    let packs = [
        ("textured.fpack", "points"),
        ("views.fpack", "views"),
        ("volume.fpack", "volume"),
        ("foliage.fpack", "foliage"),
    ];
    for (pack, what) in packs {
        let pack = golden(pack);
        let line = [&pack, "--headless", "-o", &png, "--size", "120x80", "--as", what];
        let (code, err) = view(&line);
        assert_eq!(code, 0, "{err}");
        assert!(err.contains(what), "{err}");
        let shown = picture(&png);
        assert_eq!((shown.width(), shown.height()), (120, 80));
        let grey = shown.get_pixel(0, 0);
        assert!(shown.pixels().any(|p| p != grey), "{what}: nothing is shown");
        // Straight alpha: what is not covered is not.
        assert_eq!(view(&[&line[..], &["--alpha", "-q"]].concat()), (0, String::new()));
        let alpha = picture(&png);
        assert!(alpha.pixels().any(|p| p[3] == 0) && alpha.pixels().any(|p| p[3] > 100));
    }
}

#[test]
fn the_picture_is_that_of_draw() {
    let dir = tempfile::tempdir().unwrap();
    let [gpu, cpu] = ["gpu.png", "cpu.png"].map(|n| arg(&dir.path().join(n)));
    let pack = arg(&dir.path().join("shrub.fpack"));
    succeed(&["points", &arg(&repo("sample-data/shrub.obj")), "-o", &pack, "-q"]);
    let same = ["--samples", "1", "--view", "30,10", "--finest", "2", "-q"];
    let (code, err) = view(
        &[&[pack.as_str(), "--headless", "--parallel", "--size", "256x256", "-o", &gpu], &same[..]]
            .concat(),
    );
    assert_eq!(code, 0, "{err}");
    succeed(&[&["draw", &pack, "-o", &cpu, "--size", "256"], &same[..]].concat());
    let (gpu, cpu) = (picture(&gpu), picture(&cpu));
    let differ = gpu
        .pixels()
        .zip(cpu.pixels())
        .filter(|(a, b)| a.0.iter().zip(b.0).any(|(a, b)| a.abs_diff(b) > 3));
    // Ellipses whose edge goes through the middle of a pixel.
    assert!(differ.count() < 256 * 256 / 1000);
}

#[test]
fn auto_follows_the_measured_table() {
    let dir = tempfile::tempdir().unwrap();
    let file = |name: &str| arg(&dir.path().join(name));
    let (pack, png) = (file("t.fpack"), file("t.png"));
    succeed(&["points", &arg(&repo("sample-data/shrub.obj")), "-o", &pack, "-q", "--measure"]);
    let level = |more: &[&str]| {
        let line = [&pack, "--headless", "-o", &png, "--size", "256x256", "--light", "albedo"];
        let (code, err) = view(&[&line[..], more].concat());
        assert_eq!(code, 0, "{err}");
        let s_m = err.split("s_m ").nth(1).and_then(|t| t.split(' ').next());
        s_m.map_or(0.0, |t| t.parse::<f64>().unwrap())
    };
    // A larger error, coarser points; no error at all, triangles.
    let (fine, coarse) = (level(&["--error", "0.03"]), level(&["--error", "0.3"]));
    assert!(coarse > fine, "{coarse} {fine}");
    assert_eq!(level(&["--error", "0.0001"]), 0.0);
    // All the time in the world: the best there is.
    assert_eq!(level(&["--fps", "0.001"]), 0.0);
    let (code, err) = view(&[&golden("textured.fpack"), "--headless", "-o", &png, "--as", "auto"]);
    assert_eq!(code, 1, "{err}");
    assert!(err.contains("--as auto needs a table measured under base colours"), "{err}");
}

#[test]
fn the_source_is_shown_beside_its_level() {
    let dir = tempfile::tempdir().unwrap();
    let file = |name: &str| arg(&dir.path().join(name));
    let tree = arg(&repo("sample-data/shrub.obj"));
    let (pack, png) = (file("t.fpack"), file("t.png"));
    succeed(&["points", &tree, "-o", &pack, "-q"]);
    let line = [&pack, "--headless", "-o", &png, "--size", "200x200", "--samples", "3", "-q"];
    let level = ["--finest", "0.001", "--largest", "0"];
    let (code, err) = view(&[&line[..], &level, &["--truth", &tree]].concat());
    assert_eq!(code, 0, "{err}");
    let both = picture(&png);
    assert_eq!(view(&[&line[..], &level].concat()).0, 0);
    let alone = picture(&png);
    assert_eq!(both.get_pixel(100, 5).0, [255; 4]);
    let half = |left: bool| {
        let there =
            both.enumerate_pixels().filter(|(x, ..)| (*x < 98) == left && !(98..=101).contains(x));
        let far = there.clone().filter(|(x, y, p)| {
            let q = alone.get_pixel(*x, *y);
            (0..3).any(|k| p[k].abs_diff(q[k]) > 90)
        });
        far.count() as f64 / there.count() as f64
    };
    assert_eq!(half(false), 0.0);
    // The same triangles, sampled elsewhere.
    assert!(half(true) < 0.03, "{}", half(true));
}

#[test]
fn benches_a_camera_path() {
    let dir = tempfile::tempdir().unwrap();
    let file = |name: &str| arg(&dir.path().join(name));
    let (path, json) = (file("path.json"), file("bench.json"));
    let keys = r#"{"frames": 12, "keys": [{"yaw": 0, "pitch": 10, "distance": 3},
        {"yaw": 180, "pitch": 40, "distance": 30}]}"#;
    std::fs::write(&path, keys).unwrap();
    let pack = golden("textured.fpack");
    let line = [&pack, "--bench", &path, "--json", &json, "--size", "96x64", "--samples", "1"];
    let (code, err) = view(&line);
    assert_eq!(code, 0, "{err}");
    let report: serde_json::Value = serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap();
    assert_eq!((&report["frames"], &report["representation"]), (&12.into(), &"points".into()));
    let of = |name: &str, p: &str| report[name][p].as_f64().unwrap();
    for name in ["frame_ms", "primitives", "draw_calls", "bytes"] {
        assert!(of(name, "p50") > 0.0 && of(name, "p50") <= of(name, "p95"), "{report}");
        assert!(of(name, "p95") <= of(name, "p99"), "{report}");
    }
    assert!(!report["adapter"].as_str().unwrap().is_empty());
    std::fs::write(&path, r#"{"frames": 0, "keys": []}"#).unwrap();
    let (code, err) = view(&line);
    assert_eq!(code, 1, "{err}");
    assert!(err.contains("path.json: 0 frames; from 1 to 100000"), "{err}");
    std::fs::write(&path, "{").unwrap();
    assert_eq!(view(&line).0, 3);
}

#[test]
fn errors_have_their_exit_codes() {
    let dir = tempfile::tempdir().unwrap();
    let file = |name: &str| arg(&dir.path().join(name));
    let (png, broken) = (file("t.png"), file("broken.fpack"));
    let mut bytes = std::fs::read(golden("textured.fpack")).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    std::fs::write(&broken, &bytes).unwrap();
    let pack = golden("textured.fpack");
    let headless = ["--headless", "-o", &png];
    let with = |pack: &str, more: &[&str]| view(&[&[pack], &headless[..], more].concat());
    let cases: [(i32, (i32, String), &str); 7] = [
        (1, view(&[]), "PACK"),
        (1, with(&pack, &["--size", "0x10"]), "sides must be within 1 and 16384"),
        (1, with(&pack, &["--as", "views"]), "textured.fpack: has no views"),
        (1, with(&pack, &["--view", "askew"]), "--view \"askew\": a name or YAW,PITCH"),
        (2, with(&file("absent.fpack"), &[]), "absent.fpack: cannot open"),
        (3, with(&broken, &[]), "its hash does not match: damaged"),
        (4, with(&pack, &["--adapter", "no such card"]), "apt install mesa-vulkan-drivers"),
    ];
    for (want, (code, err), text) in cases {
        assert_eq!(code, want, "{err}");
        assert!(err.contains(text), "{text}: {err}");
    }
    assert!(!Path::new(&png).exists());
}

/// The reader of docs/READER.md, which knows none of our crates, draws the cut that `draw` draws.
#[test]
fn the_page_for_readers_is_true() {
    let dir = tempfile::tempdir().unwrap();
    let (path, png) = (dir.path().join("shrub.fpack"), dir.path().join("t.png"));
    succeed(&["points", &arg(&repo("sample-data/shrub.obj")), "-o", &arg(&path), "-q"]);
    let reader = Path::new(forest_bake().get_program()).with_file_name("examples/reader");
    let pack = Pack::open(&path).unwrap();
    let block = PointsBlock::open(&pack).unwrap();
    let unit = block.scale();
    let projection = Projection::Orthographic { height: 2.0 * unit };
    let eye = block.origin() + DVec3::new(0.0, 0.0, 3.0 * unit);
    let camera = Camera::new(eye, -DVec3::Z, projection, [512; 2]);
    for code in [2200u16, 2900, 3400] {
        let line = [arg(&path), arg(&png), code.to_string()];
        assert!(Command::new(&reader).args(line).status().unwrap().success());
        // The same size code for all cells: an area in pixels, which is 256 to a unit.
        let area = SizeCode::from_bits(code).unwrap().area() * 256.0 * 256.0 * 1.0001;
        let thresholds = Thresholds {
            finest: PixelArea(area),
            largest: PixelArea(f64::INFINITY),
            depth_bias: PixelArea(0.0),
        };
        let style = Style { sampling: Sampling::MIDDLE, light: Light::Albedo };
        let (want, drawn) = draw_points(&block, None, &camera, &thresholds, style);
        assert!(drawn.points > 20, "{code}: {drawn:?}");
        let got = picture(&arg(&png));
        let differ = got.pixels().zip(&want.pixels).filter(|(g, w)| (g[3] > 0) != (w[3] > 0.0));
        let shown = want.pixels.iter().filter(|p| p[3] > 0.0).count();
        assert!(differ.count() * 200 < shown, "{code}: of {shown}");
        // Its pow(2.2) is near enough to sRGB.
        let off = got
            .pixels()
            .zip(want.over(0.0))
            .filter(|(g, w)| g[3] > 0 && (0..3).any(|k| g[k].abs_diff(w[k]) > 12));
        assert!(off.count() * 100 < shown, "{code}: colours");
    }
}

/// A program that is ended with its test.
struct Running(std::process::Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Starts a window on `screen`.
fn window(screen: &Screen, args: &[&str]) -> Running {
    let program = Path::new(forest_bake().get_program()).with_file_name("forest-view");
    let child = Command::new(program)
        .args(args)
        .env("DISPLAY", screen.display())
        .env_remove("WAYLAND_DISPLAY")
        .spawn();
    Running(child.expect("the program starts"))
}

fn wait_for(what: &str, mut done: impl FnMut() -> bool) {
    let start = Instant::now();
    while !done() {
        assert!(start.elapsed() < Duration::from_secs(60), "{what}: not within a minute");
        std::thread::sleep(Duration::from_millis(100));
    }
}

#[test]
fn a_window_shows_the_pack_and_follows_its_file() {
    let screen = Screen::start([1024, 768]);
    let dir = tempfile::tempdir().unwrap();
    let pack = dir.path().join("shown.fpack");
    std::fs::copy(golden("textured.fpack"), &pack).unwrap();
    let line = [&arg(&pack), "--size", "1024x768", "--as", "points", "--light", "albedo"];
    let mut child = window(&screen, &line);
    // The picture's grey on the right, the dark panel on the left, and the tree in between.
    let background = |p: &image::Rgb<u8>| p.0.iter().all(|v| v.abs_diff(203) <= 2);
    let tree = |shown: &image::RgbImage| {
        let middle = shown.enumerate_pixels().filter(|(x, ..)| (350..1010).contains(x));
        middle.filter(|(.., p)| !background(p)).count()
    };
    wait_for("the window", || {
        assert!(child.0.try_wait().unwrap().is_none(), "the window closed");
        let shown = screen.picture();
        let dark = shown.enumerate_pixels().filter(|(x, y, p)| *x < 250 && *y < 300 && p[1] < 60);
        background(shown.get_pixel(1015, 760)) && tree(&shown) > 500 && dark.count() > 10_000
    });
    let shown = screen.picture();
    let before = tree(&shown);
    // Baked anew: another tree is shown, without a touch.
    let other = dir.path().join("other.fpack");
    std::fs::copy(golden("one-triangle.fpack"), &other).unwrap();
    std::fs::rename(&other, &pack).unwrap();
    wait_for("the other pack", || tree(&screen.picture()).abs_diff(before) > before / 20);
    // A broken one leaves what is shown, and the window stands.
    std::fs::write(&other, b"no pack").unwrap();
    std::fs::rename(&other, &pack).unwrap();
    std::thread::sleep(Duration::from_secs(2));
    assert!(child.0.try_wait().unwrap().is_none());
    assert!(tree(&screen.picture()) > 500);
}

#[test]
fn the_windows_picture_is_that_of_a_headless_run() {
    let screen = Screen::start([1024, 768]);
    let dir = tempfile::tempdir().unwrap();
    let [shot, headless] = ["shot.png", "headless.png"].map(|n| arg(&dir.path().join(n)));
    // What a slider of the panel cannot reach must not be changed by it.
    let odd = ["--samples", "6", "--largest", "0", "--finest", "0.001", "--bias", "-0.5"];
    for (pack, what) in [("textured.fpack", "points"), ("volume.fpack", "volume")] {
        let pack = golden(pack);
        let same = ["--size", "400x300", "--as", what, "--view", "20,10", "--distance", "4"];
        let same = [&same[..], &odd].concat();
        let line = [&[&pack, "--screenshot", &shot], &same[..]].concat();
        let mut child = window(&screen, &line);
        wait_for("the screenshot", || child.0.try_wait().unwrap().is_some());
        assert!(child.0.wait().unwrap().success(), "{line:?}");
        let line = [&[&pack, "--headless", "-o", &headless], &same[..]].concat();
        assert_eq!(view(&line).0, 0);
        assert!(picture(&shot) == picture(&headless), "{what}");
    }
    let mut blind =
        Command::new(Path::new(forest_bake().get_program()).with_file_name("forest-view"));
    let blind =
        blind.arg(golden("textured.fpack")).env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY");
    let output = blind.output().unwrap();
    let err = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(4), "{err}");
    assert!(err.contains("no window system: --headless draws without one"), "{err}");
}
