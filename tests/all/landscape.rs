//! Landscapes: made by `forest-bake scene`, drawn by `forest-view` and `forest-gpu`, beside ground truth.

use crate::support::{arg, forest_bake, repo, run, succeed};
use forest_gpu::{
    Gpu, Landscape, LandscapeDetail, LandscapeDrawn, LandscapeRenderer, LandscapeTarget, Options,
    adapters, instance, read_samples,
};
use forest_points::PixelArea;
use forest_scene::{Scene, Sight};
use forest_soup::{Camera, Projection};
use forest_tests::landscapes::{Crop, Sources, averaged, brightness, flip, pictures};
use forest_tests::reports::load_soup;
use forest_tests::screen::Screen;
use glam::DVec3;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::LazyLock;
use wgpu::Backend;

const TREES: [&str; 3] = ["conifer.glb", "broadleaf_young.gltf", "shrub.obj"];

/// Packs of the sample trees, baked once.
fn packs() -> &'static [PathBuf] {
    static PACKS: LazyLock<(tempfile::TempDir, Vec<PathBuf>)> = LazyLock::new(|| {
        let dir = tempfile::tempdir().unwrap();
        let bake = |tree: &&str| {
            let pack = dir.path().join(tree).with_extension("fpack");
            succeed(&["points", &arg(&repo("sample-data").join(tree)), "-o", &arg(&pack), "-q"]);
            pack
        };
        let packs = TREES.iter().map(bake).collect();
        (dir, packs)
    });
    &PACKS.1
}

/// The same with views.
fn packs_with_views() -> &'static [PathBuf] {
    static PACKS: LazyLock<(tempfile::TempDir, Vec<PathBuf>)> = LazyLock::new(|| {
        let dir = tempfile::tempdir().unwrap();
        let bake = |(tree, pack): (&&str, &PathBuf)| {
            let both = dir.path().join(tree).with_extension("fpack");
            std::fs::copy(pack, &both).unwrap();
            let from = arg(&repo("sample-data").join(tree));
            succeed(&["views", &from, "-o", &arg(&both), "--texels", "64", "-q"]);
            both
        };
        let packs = TREES.iter().zip(packs()).map(bake).collect();
        (dir, packs)
    });
    &PACKS.1
}

/// Makes a scene of the sample trees, each as high as a tree.
fn make(folder: &Path, trees: u32, more: &[&str]) -> PathBuf {
    make_of(packs(), folder, trees, more)
}

fn make_of(packs: &[PathBuf], folder: &Path, trees: u32, more: &[&str]) -> PathBuf {
    let path = folder.join("forest.toml");
    let heights = ["height=14", "height=11,weight=2", "height=5,weight=0.5"];
    let packs = packs.iter().zip(heights).map(|(p, h)| format!("{}:{h}", p.display()));
    let packs: Vec<String> = packs.collect();
    let (count, output) = (trees.to_string(), arg(&path));
    let mut args = vec!["scene"];
    args.extend(packs.iter().map(String::as_str));
    args.extend(["-o", &output, "--trees", &count, "-q"]);
    args.extend(more);
    succeed(&args);
    path
}

/// An OpenGL device, where there is one.
fn opengl() -> Option<Gpu> {
    let all = adapters(&instance(true, None));
    let found = all.into_iter().find(|a| a.get_info().backend == Backend::Gl);
    found.map(|adapter| Gpu::of(adapter).unwrap())
}

fn device() -> Gpu {
    Gpu::open(&instance(false, None), None, None).unwrap()
}

struct Drawn {
    pixels: Vec<[f32; 3]>,
    counts: LandscapeDrawn,
}

/// Draws a scene with one sample a side.
fn draw(
    gpu: &Gpu,
    scene: &Scene,
    camera: &Camera,
    detail: &LandscapeDetail,
    narrow: bool,
    side: u32,
) -> Drawn {
    let options = Options { narrow_atomics: narrow, ..Options::default() };
    let renderer = LandscapeRenderer::new(gpu, &options).unwrap();
    let mut landscape = Landscape::load(gpu, &renderer, scene).unwrap();
    let size = [camera.width, camera.height];
    let target = LandscapeTarget::new(gpu, &renderer, size, side).unwrap();
    renderer.render(gpu, &mut landscape, &target, camera, detail, None);
    let counts = landscape.drawn(gpu).unwrap();
    assert_eq!(counts.left_out, 0);
    let samples = read_samples(gpu, target.samples()).unwrap();
    Drawn { pixels: averaged(&samples, size[0], size[1], side), counts }
}

fn mean(pixels: impl Iterator<Item = [f32; 3]>) -> [f32; 3] {
    let (sum, n) = pixels.fold(([0.0; 3], 0), |(s, n), p| ([0, 1, 2].map(|k| s[k] + p[k]), n + 1));
    sum.map(|v| v / n as f32)
}

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

/// Crops of a picture of 320 × 180 pixels.
const CROPS: [Crop; 2] =
    [Crop { corner: [20, 70], size: [96, 54] }, Crop { corner: [180, 110], size: [96, 54] }];

/// The pixels of a crop in a picture of this width.
fn inside(crop: &Crop, width: u32) -> impl Iterator<Item = usize> {
    let Crop { corner: [x, y], size: [w, h] } = *crop;
    (0..w * h).map(move |i| ((y + i / w) * width + x + i % w) as usize)
}

#[test]
fn the_picture_is_near_its_ground_truth() {
    let (gpu, dir) = (device(), tempfile::tempdir().unwrap());
    let scene = Scene::open(&make(dir.path(), 600, &[])).unwrap();
    let sources = sources();
    let camera = scene.file.camera(None).unwrap().camera(&scene.land, [320, 180]);
    let truth = pictures(&scene, &sources, &camera, &CROPS, 4);
    let error = |hidden: f64| {
        let (finest, largest) = (PixelArea(1.0), PixelArea(16.0));
        let detail = LandscapeDetail { finest, largest, hidden, ..LandscapeDetail::default() };
        let drawn = draw(&gpu, &scene, &camera, &detail, false, 2);
        let ours = mean(CROPS.iter().flat_map(|c| inside(c, 320)).map(|i| drawn.pixels[i]));
        (flip(&drawn.pixels, 320, &CROPS, &truth), ours, drawn.counts)
    };
    let theirs = mean(truth.iter().flat_map(|t| &t.pixels).map(|p| [p[0], p[1], p[2]]));
    let (all, bright, counts) = error(0.0);
    for k in 0..3 {
        let ratio = bright[k] / theirs[k];
        assert!((0.8..1.25).contains(&ratio), "{bright:?} is not as bright as {theirs:?}");
    }
    assert!(all < 0.3, "{all}");
    // What is hidden is drawn with fewer points, and is no worse by much.
    let (less, _, fewer) = error(2.0 / 3.0);
    assert!(less < all + 0.02, "{less} against {all}");
    assert!(fewer.points < counts.points * 9 / 10, "{} of {}", fewer.points, counts.points);
}

fn sources() -> Sources {
    let soups = TREES.iter().map(|t| load_soup(&repo("sample-data").join(t)).unwrap());
    Sources::new(soups.collect())
}

#[test]
fn far_trees_are_drawn_by_views_and_are_as_near_the_truth() {
    let (gpu, dir) = (device(), tempfile::tempdir().unwrap());
    let scene = Scene::open(&make_of(packs_with_views(), dir.path(), 600, &[])).unwrap();
    let camera = scene.file.camera(None).unwrap().camera(&scene.land, [320, 180]);
    let truth = pictures(&scene, &sources(), &camera, &CROPS, 4);
    let usual = LandscapeDetail { finest: PixelArea(2.0), ..LandscapeDetail::default() };
    let with = |impostors: f64| {
        let detail = LandscapeDetail { impostors, ..usual };
        let drawn = draw(&gpu, &scene, &camera, &detail, false, 2);
        let error = flip(&drawn.pixels, 320, &CROPS, &truth);
        (error, brightness(&drawn.pixels, 320, &CROPS, &truth), drawn.counts)
    };
    let (points, _, all) = with(0.0);
    let (views, bright, less) = with(1.0);
    assert!(all.impostors == 0 && less.impostors * 2 > less.trees, "{less:?}");
    assert!(less.points * 2 < all.points, "{less:?} {all:?}");
    assert!(views < points + 0.02, "{views} against {points}");
    assert!((0.8..1.25).contains(&bright), "{bright}");
}

#[test]
fn views_and_points_of_a_tree_share_its_samples() {
    let (gpu, dir) = (device(), tempfile::tempdir().unwrap());
    let mut scene = Scene::open(&make_of(packs_with_views(), dir.path(), 100, &[])).unwrap();
    scene.trees.retain(|t| t.species() == 1);
    scene.trees.truncate(1);
    let camera = alone(&scene, 60.0, 0.2);
    let with = |impostors: f64| {
        let usual = LandscapeDetail { hidden: 0.0, ..LandscapeDetail::default() };
        draw(&gpu, &scene, &camera, &LandscapeDetail { impostors, ..usual }, false, 1)
    };
    let [points, views] = [0.0, 100.0].map(with);
    assert_eq!((points.counts.impostors, views.counts.points), (0, 0));
    // At some size both draw; each sample is that of one of them.
    let mut mixed = 0;
    for k in 1..60 {
        let both = with(0.02 * f64::from(k));
        if both.counts.impostors == 0 || both.counts.points == 0 {
            continue;
        }
        let (mut from_points, mut from_views) = (0, 0);
        for ((p, v), b) in points.pixels.iter().zip(&views.pixels).zip(&both.pixels) {
            assert!(b == p || b == v, "{b:?} is neither {p:?} nor {v:?}");
            from_points += u32::from(b == p && p != v);
            from_views += u32::from(b == v && p != v);
        }
        assert!(from_points > 0 && from_views > 0, "{from_points} and {from_views}");
        mixed += 1;
    }
    assert!(mixed >= 2, "never both");
}

/// A camera so many metres from the only tree of a scene, looking down on it by so many radians.
fn alone(scene: &Scene, distance: f64, down: f64) -> Camera {
    let foot = DVec3::from_array(scene.trees[0].position.map(f64::from));
    let middle = foot + DVec3::Y * 5.0;
    let (sin, cos) = down.sin_cos();
    let from = DVec3::new(0.0, sin, cos);
    let projection = Projection::Perspective { fov_y: 0.3 };
    Camera::new(middle + from * distance, -from, projection, [128, 128])
}

#[test]
fn opengl_draws_the_same_landscape() {
    let Some(gl) = opengl() else {
        eprintln!("skipped: no OpenGL adapter");
        return;
    };
    let (gpu, dir) = (device(), tempfile::tempdir().unwrap());
    let scene = Scene::open(&make_of(packs_with_views(), dir.path(), 600, &[])).unwrap();
    let camera = scene.file.camera(None).unwrap().camera(&scene.land, [320, 180]);
    // One band there: what is hidden is known only of what lies before all trees.
    let detail = LandscapeDetail { hidden: 0.0, least_seen: 0.0, ..LandscapeDetail::default() };
    let [a, b] = [&gl, &gpu].map(|g| draw(g, &scene, &camera, &detail, false, 1));
    assert_eq!(a.counts.impostors, b.counts.impostors);
    let off = |(a, b): (&[f32; 3], &[f32; 3])| (0..3).any(|k| (a[k] - b[k]).abs() > 0.02);
    let differ = a.pixels.iter().zip(&b.pixels).filter(|p| off(*p)).count();
    assert!(differ * 50 < a.pixels.len(), "{differ} of {} samples", a.pixels.len());
}

#[test]
fn a_tree_about_the_eye_is_not_drawn_by_views() {
    let (gpu, dir) = (device(), tempfile::tempdir().unwrap());
    let mut scene = Scene::open(&make_of(packs_with_views(), dir.path(), 100, &[])).unwrap();
    scene.trees.retain(|t| t.species() == 1);
    scene.trees.truncate(1);
    let counts = |distance: f64| {
        // In a picture of a few pixels even the nearest tree is small.
        let camera = Camera { width: 16, height: 16, ..alone(&scene, distance, 0.2) };
        draw(&gpu, &scene, &camera, &LandscapeDetail::default(), false, 1).counts
    };
    let (near, far) = (counts(3.0), counts(60.0));
    assert!(near.impostors == 0 && near.points + near.triangles > 0, "{near:?}");
    assert_eq!((far.impostors, far.points), (1, 0));
}

#[test]
fn trees_drawn_by_views_are_whole_from_any_height() {
    let (gpu, dir) = (device(), tempfile::tempdir().unwrap());
    let mut scene = Scene::open(&make_of(packs_with_views(), dir.path(), 100, &[])).unwrap();
    scene.trees.retain(|t| t.species() == 1);
    scene.trees.truncate(1);
    // Ground is blue, and so is the sky.
    (scene.file.land.color, scene.file.land.steep) = ([0, 0, 255], [0, 0, 255]);
    for down in [0.0, 0.7, 1.3, 1.45, 1.53, std::f64::consts::FRAC_PI_2] {
        let camera = alone(&scene, 60.0, down);
        let covered = |impostors: f64| {
            let usual = LandscapeDetail { hidden: 0.0, least_seen: 0.0, ..Default::default() };
            let drawn =
                draw(&gpu, &scene, &camera, &LandscapeDetail { impostors, ..usual }, false, 2);
            let off = |p: &&[f32; 3]| p[0].max(p[1]) > p[2];
            (drawn.pixels.iter().filter(off).count() as f64, drawn.counts.impostors)
        };
        let [(points, none), (views, one)] = [0.0, 100.0].map(covered);
        assert_eq!((none, one), (0, 1), "{down}");
        assert!((0.9..1.15).contains(&(views / points)), "{down}: {views} of {points}");
    }
}

#[test]
fn flying_on_changes_pictures_evenly() {
    let (gpu, dir) = (device(), tempfile::tempdir().unwrap());
    let scene = Scene::open(&make_of(packs_with_views(), dir.path(), 1500, &[])).unwrap();
    let start = scene.file.camera(None).unwrap().camera(&scene.land, [160, 90]);
    for impostors in [1.0, 0.0] {
        let detail = LandscapeDetail { impostors, ..LandscapeDetail::default() };
        let frame = |k: u32| {
            let eye = start.eye + start.forward * (0.5 * f64::from(k));
            draw(&gpu, &scene, &Camera { eye, ..start }, &detail, false, 4).pixels
        };
        let frames: Vec<Vec<[f32; 3]>> = (0..25).map(frame).collect();
        let off = |(a, b): (&[f32; 3], &[f32; 3])| f64::from((a[1] - b[1]).abs());
        let step = |w: &[Vec<[f32; 3]>]| w[0].iter().zip(&w[1]).map(off).sum::<f64>();
        let mut steps: Vec<f64> = frames.windows(2).map(step).collect();
        steps.sort_by(f64::total_cmp);
        let [median, worst] = [steps[12], steps[23]];
        assert!(worst < 1.5 * median, "impostors {impostors}: a step of {worst} among {median}");
    }
}

#[test]
fn trunks_before_their_own_crowns_column_are_not_left_out() {
    let (gpu, dir) = (device(), tempfile::tempdir().unwrap());
    let scene = Scene::open(&make(dir.path(), 4000, &[])).unwrap();
    for name in ["overview", "aerial"] {
        let camera = scene.file.camera(Some(name)).unwrap().camera(&scene.land, [320, 180]);
        let with = |least_seen: f64| {
            let detail = LandscapeDetail { least_seen, hidden: 0.0, ..LandscapeDetail::default() };
            draw(&gpu, &scene, &camera, &detail, false, 1)
        };
        let [all, usual] = [0.0, LandscapeDetail::default().least_seen].map(with);
        let differ = |(a, b): (&[f32; 3], &[f32; 3])| (0..3).any(|k| (a[k] - b[k]).abs() > 0.02);
        let lost = all.pixels.iter().zip(&usual.pixels).filter(|p| differ(*p)).count();
        let share = lost as f64 / all.pixels.len() as f64;
        assert!(usual.counts.points < all.counts.points);
        assert!(share < 0.015, "{name}: {share} of the samples lack what is seen");
    }
}

#[test]
fn what_is_left_out_behind_others_is_not_seen() {
    // Without 64-bit atomics there is one band, and nothing is hidden by trees but what they draw over.
    let (gpu, dir) = (device(), tempfile::tempdir().unwrap());
    let scene = Scene::open(&make(dir.path(), 800, &[])).unwrap();
    let detail = LandscapeDetail { hidden: 0.0, ..LandscapeDetail::default() };
    for name in ["overview", "within"] {
        let camera = scene.file.camera(Some(name)).unwrap().camera(&scene.land, [320, 180]);
        let [bands, one] = [false, true].map(|n| draw(&gpu, &scene, &camera, &detail, n, 1));
        let differ = bands.pixels.iter().zip(&one.pixels).filter(|(a, b)| a != b).count();
        // Two points in the very same depth, of which either may be kept.
        assert!(differ * 2000 < bands.pixels.len(), "{name}: {differ} samples differ");
        assert!(bands.counts.points < one.counts.points, "{name}: nothing was left out");
    }
}

#[test]
fn trees_of_a_pixel_keep_their_colour() {
    let (gpu, dir) = (device(), tempfile::tempdir().unwrap());
    let scene = Scene::open(&make(dir.path(), 3000, &["--smoothness", "2"])).unwrap();
    // From 8 km above: a land of 490 m is 40 pixels wide, trees are smaller than one.
    let above = 8000.0;
    let fov = 2.0 * (490.0f64 / 2.0 * 1.6 / above).atan().to_degrees();
    let sight = Sight { name: "high".into(), at: [0.0; 2], above, yaw: 0.0, pitch: -90.0, fov };
    let camera = sight.camera(&scene.land, [64, 64]);
    let crop = [Crop { corner: [16, 16], size: [32, 32] }];
    let truth = pictures(&scene, &sources(), &camera, &crop, 4);
    let theirs = mean(truth[0].pixels.iter().map(|p| [p[0], p[1], p[2]]));
    let every = LandscapeDetail { least_seen: 0.0, ..LandscapeDetail::default() };
    let drawn = draw(&gpu, &scene, &camera, &every, false, 2);
    assert_eq!(drawn.counts.trees as usize, scene.trees.len());
    let drawn = draw(&gpu, &scene, &camera, &LandscapeDetail::default(), false, 2);
    assert!(drawn.counts.points < 8 * drawn.counts.trees, "{:?}", drawn.counts);
    let inside = (0..1024usize).map(|i| drawn.pixels[(16 + i / 32) * 64 + 16 + i % 32]);
    let ours = mean(inside);
    for k in 0..3 {
        let ratio = ours[k] / theirs[k];
        assert!((0.8..1.25).contains(&ratio), "{ours:?} against {theirs:?}");
    }
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
