//! `make view`: what the viewer's pictures cost, how near they are to `draw`'s, and whether its levels
//! pop; writes docs/VIEWER.md and the pictures of the viewer.

mod popping;
mod times;
mod window;

use anyhow::Result;
use forest_gpu::{Gpu, instance};
use forest_tests::report_trees;
use forest_tests::reports::{name_of, program};
use std::fmt::Write;
use std::path::{Path, PathBuf};

const SHARED: [&str; 2] = ["ez_oak_dense_200k.glb", "sap_birch_200k.glb"];
/// The tree whose levels are faded, and that the pictures show.
const SHOWN: &str = "broadleaf_young.gltf";

fn main() -> Result<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let out = root.join("out/viewer");
    std::fs::create_dir_all(&out)?;
    let gpu = Gpu::open(&instance(false, None), None, None)?;
    let mut text = String::from(HEAD);
    writeln!(text, "\nAdapter: {}.\n", gpu.name())?;
    times::head(&mut text)?;
    for tree in report_trees(&[SHOWN], &SHARED) {
        eprintln!("{}", name_of(&tree));
        times::write(&mut text, &gpu, &name_of(&tree), &baked(&tree, &out)?)?;
    }
    let tree = root.join("sample-data").join(SHOWN);
    let pack = measured(&tree, &out)?;
    eprintln!("popping of {SHOWN}");
    popping::write(&mut text, &gpu, SHOWN, &pack, &tree)?;
    eprintln!("pictures");
    window::write(&root, &pack, &tree)?;
    std::fs::write(root.join("docs/VIEWER.md"), text)?;
    println!("{}", root.join("docs/VIEWER.md").display());
    Ok(())
}

const HEAD: &str = "# The viewer: times, parity, popping

Written by `make view`. Pictures are 1280 × 720 with one sample a pixel and the ball around the tree as
high as they are. A frame is
timed from choosing levels to the finished picture, the device by its own clock; medians of 15 frames after 3.
Primitives are points that are looked at (a prefix of each cell's array), triangles, views and cells. *Parity*
is the RMSE of premultiplied linear RGBA against `forest-bake draw`'s picture of the same samples, over the
box around the tree (0.01 is allowed).
";

/// A pack of points, views and a volume.
fn baked(tree: &Path, out: &Path) -> Result<PathBuf> {
    let pack = out.join(name_of(tree)).with_extension("fpack");
    let [tree, file] = [tree, &pack].map(|p| p.to_string_lossy().into_owned());
    program(&["points", &tree, "-o", &file, "--force"])?;
    program(&["views", &tree, "-o", &file, "--layout", "octahedral:12"])?;
    program(&["volume", &tree, "-o", &file])?;
    Ok(pack)
}

/// The same with a measured table of all of them.
fn measured(tree: &Path, out: &Path) -> Result<PathBuf> {
    let pack = out.join("measured.fpack");
    let [tree, file] = [tree, &pack].map(|p| p.to_string_lossy().into_owned());
    program(&["points", &tree, "-o", &file, "--force", "--measure"])?;
    program(&["views", &tree, "-o", &file, "--layout", "octahedral:12"])?;
    program(&["volume", &tree, "-o", &file])?;
    program(&["eval", &file, "--source", &tree, "--alone", "--embed"])?;
    Ok(pack)
}
