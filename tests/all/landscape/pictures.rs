//! Pictures of landscapes beside their ground truth, and beside themselves drawn in other ways.

use super::{TREES, device, draw, make, make_of, mean, opengl, packs_with_views};
use crate::support::repo;
use forest_gpu::LandscapeDetail;
use forest_points::PixelArea;
use forest_scene::{Scene, Sight};
use forest_soup::{Camera, Projection};
use forest_tests::landscapes::{Crop, Sources, brightness, flip, pictures};
use forest_tests::reports::load_soup;
use glam::DVec3;
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
