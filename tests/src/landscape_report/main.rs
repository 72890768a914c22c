//! `make landscape`: landscapes of 1,000 to 1,000,000 trees beside what engines commonly do; writes
//! docs/LANDSCAPE.md, the README's table and its picture of a forest.

mod ours;
mod peers;
mod table;

use anyhow::{Context, Result};
use forest_gpu::{Gpu, instance};
use forest_points::PixelArea;
use forest_scene::Scene;
use forest_soup::{Camera, linear_to_srgb8};
use forest_tests::landscapes::{Crop, Sources, brightness, flip, pictures};
use forest_tests::report_trees;
use forest_tests::reports::{load_soup, name_of, program};
use ours::Ours;
use peers::{Peer, PeerModel};
use std::path::{Path, PathBuf};
use std::time::Instant;
use table::{Percentiles, Row};

const SIZE: [u32; 2] = [1280, 720];
/// Of the README's picture.
const SHOWN: [u32; 2] = [960, 480];
const COUNTS: [u32; 5] = [1_000, 10_000, 100_000, 200_000, 1_000_000];
/// Trees of others, where they are, and ours; their heights in metres and shares.
const SHARED: [&str; 3] = ["sap_pine_20k.glb", "sap_birch_200k.glb", "ez_ash_medium.glb"];
const OWN: [&str; 3] = ["conifer.glb", "broadleaf_young.gltf", "shrub.obj"];
const STANDS: [&str; 3] = ["height=18,weight=2", "height=16", "height=14"];
/// Of the finest views.
const VIEW_TEXELS: &str = "128";
/// Samples along a side of a pixel of the truth.
const TRUTH_SIDE: u32 = 6;
/// Our s_m in square pixels, and square pixels of a triangle of the peer's levels.
const FINEST: [f64; 3] = [4.0, 16.0, 64.0];
const TRIANGLES: [f64; 2] = [16.0, 64.0];
/// Pictures that are timed from one place, and on the way.
const STILL: usize = 5;
const FLIGHT: u32 = 12;
/// Pictures of the peers: some take seconds.
const PEER_FRAMES: usize = 3;

/// Parts of the picture that are judged: the horizon, the middle, the foreground.
const CROPS: [Crop; 3] = [
    Crop { corner: [160, 290], size: [160, 90] },
    Crop { corner: [560, 380], size: [160, 90] },
    Crop { corner: [960, 520], size: [160, 90] },
];

fn main() -> Result<()> {
    // With numbers of trees, only these are measured and nothing is written.
    let asked: Vec<u32> = std::env::args().skip(1).map(|a| a.parse()).collect::<Result<_, _>>()?;
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let out = root.join("out/landscape");
    std::fs::create_dir_all(&out)?;
    let shared = report_trees(&[], &SHARED);
    let trees = if shared.len() == SHARED.len() { shared } else { report_trees(&OWN, &[]) };
    let packs = trees.iter().map(|t| baked(t, &out)).collect::<Result<Vec<_>>>()?;
    let soups = trees.iter().map(|t| load_soup(t)).collect::<Result<Vec<_>>>()?;
    let sources = Sources::new(soups);
    let gpu = Gpu::open(&instance(false, None), None, None)?;
    let mut rows = Vec::new();
    for &count in if asked.is_empty() { &COUNTS[..] } else { &asked } {
        eprintln!("{count} trees");
        let scene = Scene::open(&made(count, &packs, &out)?)?;
        measure(&gpu, &scene, &sources, &mut rows)?;
    }
    if !asked.is_empty() {
        return Ok(());
    }
    show(&gpu, &root, &out)?;
    let names: Vec<String> = trees.iter().map(|t| name_of(t)).collect();
    table::write(&root, &gpu.name(), &names, &rows)
}

/// The README's picture of 200,000 trees.
fn show(gpu: &Gpu, root: &Path, out: &Path) -> Result<()> {
    let scene = Scene::open(&out.join("200000.toml"))?;
    let camera = scene.file.camera(None).context("no camera")?.camera(&scene.land, SHOWN);
    let mut ours = Ours::new(gpu, &scene, SHOWN, 3)?;
    ours.frame(gpu, &camera)?;
    let pixels = ours.picture(gpu)?;
    let bytes = pixels.iter().flat_map(|p| p.map(linear_to_srgb8)).collect();
    let picture = image::RgbImage::from_raw(SHOWN[0], SHOWN[1], bytes).context("a picture")?;
    Ok(picture.save(root.join("docs/landscape.png"))?)
}

fn baked(tree: &Path, out: &Path) -> Result<PathBuf> {
    let pack = out.join(name_of(tree)).with_extension("fpack");
    let [from, to] = [tree, &pack].map(|p| p.to_string_lossy().into_owned());
    program(&["points", &from, "-o", &to, "--force", "-q"])?;
    let what = ["--texels", VIEW_TEXELS, "--channels", "color,normal,depth", "-q"];
    program(&[&["views", &from, "-o", &to][..], &what].concat())?;
    Ok(pack)
}

fn made(count: u32, packs: &[PathBuf], out: &Path) -> Result<PathBuf> {
    let scene = out.join(format!("{count}.toml"));
    let packs: Vec<String> =
        packs.iter().zip(STANDS).map(|(p, stand)| format!("{}:{stand}", p.display())).collect();
    let (file, count) = (scene.to_string_lossy().into_owned(), count.to_string());
    let mut args: Vec<&str> = vec!["scene"];
    args.extend(packs.iter().map(String::as_str));
    args.extend(["-o", &file, "--trees", &count, "--force", "-q"]);
    program(&args)?;
    Ok(scene)
}

fn measure(gpu: &Gpu, scene: &Scene, sources: &Sources, rows: &mut Vec<Row>) -> Result<()> {
    let camera = scene.file.camera(None).context("no camera")?.camera(&scene.land, SIZE);
    let truth = pictures(scene, sources, &camera, &CROPS, TRUTH_SIDE);
    let error = |picture: &[[f32; 3]]| {
        [flip(picture, SIZE[0], &CROPS, &truth), brightness(picture, SIZE[0], &CROPS, &truth)]
    };
    let trees = scene.trees.len();
    let mut ours = Ours::new(gpu, scene, SIZE, 1)?;
    for (finest, impostors) in FINEST.map(|f| (f, 1.0)).into_iter().chain([(FINEST[0], 0.0)]) {
        ours.detail.impostors = impostors;
        ours.detail.finest = PixelArea(finest);
        ours.detail.largest = PixelArea(16.0 * finest);
        let (flight, _) = times(&flight(scene)?, 1, |c| Ok(ours.frame(gpu, c)?.0))?;
        let (still, _) = times(&[camera; STILL], 2, |c| Ok(ours.frame(gpu, c)?.0))?;
        let drawn = ours.frame(gpu, &camera)?.1;
        rows.push(Row {
            trees,
            way: match impostors {
                0.0 => format!("ours, s_m {finest} px², without views"),
                _ => format!("ours, s_m {finest} px²"),
            },
            still,
            flight: Some(flight),
            primitives: drawn.points + drawn.triangles + drawn.impostors,
            drawn: drawn.trees,
            left_out: drawn.left_out,
            bytes: ours.bytes(),
            error: error(&ours.picture(gpu)?),
        });
        eprintln!("{}", rows[rows.len() - 1].brief());
    }
    drop(ours);
    for peer in Peer::ALL {
        let mut model = PeerModel::new(gpu, scene, sources.soups(), peer, SIZE, 1)?;
        let settings: &[f64] = if peer == Peer::LodChain { &TRIANGLES } else { &[0.0] };
        for pixels in settings {
            if peer == Peer::LodChain {
                model.triangle_pixels = *pixels;
            }
            let cameras = [camera; PEER_FRAMES];
            let draw = |c: &Camera| {
                let start = Instant::now();
                model.render(gpu, c)?;
                Ok(start.elapsed().as_secs_f64() * 1e3)
            };
            let (still, _) = times(&cameras, 1, draw)?;
            let drawn = model.render(gpu, &camera)?;
            rows.push(Row {
                trees,
                way: match peer {
                    Peer::FullMeshes => "full meshes".into(),
                    Peer::LodChain => format!("LOD meshes, {pixels} px² a triangle"),
                    Peer::Billboards => "billboards, 8 views".into(),
                },
                still,
                flight: None,
                primitives: drawn.triangles,
                drawn: drawn.trees,
                left_out: drawn.left_out,
                bytes: model.device_bytes(),
                error: error(&model.picture(gpu)?),
            });
            eprintln!("{}", rows[rows.len() - 1].brief());
        }
    }
    Ok(())
}

/// Cameras on the way of the scene's path.
fn flight(scene: &Scene) -> Result<Vec<Camera>> {
    let mut path = scene.file.paths.first().context("no path")?.clone();
    path.frames = FLIGHT;
    let sights = scene.file.along(&path);
    Ok(sights.iter().map(|s| s.camera(&scene.land, SIZE)).collect())
}

/// Milliseconds of pictures from `cameras`, after some that warm up.
fn times(
    cameras: &[Camera],
    warm_up: usize,
    mut draw: impl FnMut(&Camera) -> Result<f64>,
) -> Result<(Percentiles, usize)> {
    for camera in cameras.iter().take(warm_up) {
        draw(camera)?;
    }
    let all = cameras.iter().map(draw).collect::<Result<Vec<f64>>>()?;
    Ok((Percentiles::of(all), cameras.len()))
}
