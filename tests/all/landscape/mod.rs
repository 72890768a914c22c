//! Landscapes: made by `forest-bake scene`, drawn by `forest-view` and `forest-gpu`, beside ground truth.

mod needs; // what a scene's cameras can ever ask of its packs
mod pictures; // pictures beside their ground truth and each other
mod program; // the programs: scenes made, refused, drawn, measured

use crate::support::{arg, repo, succeed};
use forest_gpu::{
    Gpu, Landscape, LandscapeDetail, LandscapeDrawn, LandscapeRenderer, LandscapeTarget, Options,
    adapters, instance, read_samples,
};
use forest_scene::Scene;
use forest_soup::Camera;
use forest_tests::landscapes::averaged;
use std::path::{Path, PathBuf};
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
