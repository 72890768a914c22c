//! What fuzzing throws bytes at. A target takes any bytes and ends: in a value that keeps its rules, or in an
//! error. `make fuzz` runs them; the tests replay the committed corpus, crashes found included.

use crate::{golden, use_pack, with_section};
use forest_import::{Files, ImportError, Limits, Up, load_from, load_photographs_from};
use forest_scene::{Instance, instances, parse_file};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

/// One kind of input.
pub struct Target {
    /// Its name, and that of the folder of its corpus.
    pub name: &'static str,
    /// What is done with the bytes.
    pub run: fn(&[u8]),
}

/// All of them.
pub const TARGETS: [Target; 7] = [
    Target { name: "container", run: container },
    Target { name: "sections", run: sections },
    Target { name: "gltf", run: gltf },
    Target { name: "obj", run: obj },
    Target { name: "images", run: images },
    Target { name: "transforms", run: transforms },
    Target { name: "scenes", run: scenes },
];

/// What a hostile file may make us hold.
const LIMITS: Limits =
    Limits { file_bytes: 1 << 20, texture_side: 64, total_bytes: 1 << 22, allow_outside: false };

/// Triangles of a model that are laid out.
const MOST_TRIANGLES: u64 = 1 << 12;

/// Any bytes as a pack.
pub fn container(bytes: &[u8]) {
    let _ = use_pack(bytes);
}

/// Any bytes as one section of a sound pack.
pub fn sections(bytes: &[u8]) {
    if let Some(pack) = forged(bytes) {
        let _ = use_pack(&pack);
    }
}

/// A golden pack, which the first byte chooses, whose section, which the second chooses, are the other bytes.
pub fn forged(bytes: &[u8]) -> Option<Vec<u8>> {
    static SOUND: LazyLock<Vec<Vec<u8>>> = LazyLock::new(|| {
        let read = |g: golden::Golden| std::fs::read(g.path()).expect("a golden pack");
        golden::all().into_iter().map(read).collect()
    });
    let (&[which, section], data) = bytes.split_first_chunk()?;
    with_section(SOUND.get(usize::from(which))?, section, data)
}

/// Any bytes as glTF, with a buffer and a picture beside.
pub fn gltf(bytes: &[u8]) {
    let others = [("a.bin", (0..=255).collect()), ("a.png", picture())];
    let _ = model("t.glb", bytes, others.into());
}

/// Any bytes as OBJ and, behind a zero byte, MTL, with a picture beside.
pub fn obj(bytes: &[u8]) {
    let (obj, mtl) = match bytes.iter().position(|&b| b == 0) {
        Some(at) => (&bytes[..at], &bytes[at + 1..]),
        None => (bytes, &[][..]),
    };
    let _ = model("t.obj", obj, [("m.mtl", mtl.to_vec()), ("a.png", picture())].into());
}

/// Any bytes as the picture of a material.
pub fn images(bytes: &[u8]) {
    const LEAF: &[u8] =
        b"mtllib m.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n";
    const LIBRARY: &[u8] = b"newmtl a\nmap_Kd a.png\n";
    let _ = model("t.obj", LEAF, [("m.mtl", LIBRARY.to_vec()), ("a.png", bytes.to_vec())].into());
}

/// Any bytes as the cameras of photographs, with one photograph beside.
pub fn transforms(bytes: &[u8]) {
    let files = files("transforms.json", bytes, [("a.png", picture())].into());
    if let Ok(set) = load_photographs_from(&files, Path::new("transforms.json"), &LIMITS, Up::Z) {
        for photo in &set.photographs {
            assert!(photo.camera.eye.is_finite() && photo.camera.forward.is_finite());
            assert_eq!(photo.pixels.len(), photo.camera.size.iter().product::<u32>() as usize);
        }
    }
}

/// Any bytes as a scene, or, behind a zero byte, as the trees of one.
pub fn scenes(bytes: &[u8]) {
    let name = Path::new("scene.toml");
    if let Some(trees) = bytes.strip_prefix(&[0]) {
        let whole = &trees[..trees.len() / 16 * 16];
        let records: Vec<Instance> = bytemuck::pod_collect_to_vec(whole);
        let _ = instances::parse(name, &instances::table(&records), 3);
        let _ = instances::parse(name, trees, 3);
    } else if let Ok(text) = std::str::from_utf8(bytes)
        && let Ok(file) = parse_file(name, text)
    {
        let light = file.sun.light();
        assert!(matches!(light, forest_raster::Light::Sun(sun) if sun.to_sun.is_finite()));
        for path in file.paths.iter().filter(|p| p.frames < 1000) {
            assert_eq!(file.along(path).len(), path.frames as usize);
        }
    }
}

/// Reads a model and lays it out: what comes of that keeps the rules of soups.
fn model(
    name: &str,
    bytes: &[u8],
    others: BTreeMap<&str, Vec<u8>>,
) -> Result<(), Box<dyn std::error::Error>> {
    let read = load_from(&files(name, bytes, others), Path::new(name), &LIMITS);
    if let Err(error @ ImportError::Io { .. }) = read {
        panic!("{error}: files in memory can be read");
    }
    let soup = read?.model.flatten(MOST_TRIANGLES)?;
    soup.validate().expect("what was imported keeps the rules");
    Ok(())
}

fn files(name: &str, bytes: &[u8], others: BTreeMap<&str, Vec<u8>>) -> Files {
    let others = others.into_iter().map(|(name, bytes)| (PathBuf::from(name), bytes));
    Files::Memory(others.chain([(name.into(), bytes.to_vec())]).collect())
}

/// A PNG of 2 × 2 texels.
fn picture() -> Vec<u8> {
    static PNG: LazyLock<Vec<u8>> = LazyLock::new(|| {
        let image =
            image::RgbaImage::from_fn(2, 2, |x, y| image::Rgba([90, 160, 40, (x + y) as u8 * 99]));
        let mut out = std::io::Cursor::new(Vec::new());
        image.write_to(&mut out, image::ImageFormat::Png).expect("a PNG");
        out.into_inner()
    });
    PNG.clone()
}
