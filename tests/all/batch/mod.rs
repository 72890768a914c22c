//! Batches: nothing baked twice, nothing lost, whatever happens meanwhile.

mod farm;
mod kills;
mod program;

use crate::support::{arg, repo, run};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg32;
use serde_json::Value;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};

/// A folder with a manifest and trees.
struct Farm {
    folder: tempfile::TempDir,
}

/// The picture that all trees share.
const LEAF: &str = "leaf.png";

impl Farm {
    /// Trees by these names, and a manifest: version 1, then `text`.
    fn new(names: &[String], text: &str) -> Self {
        let farm = Self { folder: tempfile::tempdir().unwrap() };
        std::fs::create_dir(farm.path("trees")).unwrap();
        farm.paint(200);
        std::fs::write(farm.path("trees/tree.mtl"), format!("newmtl leaf\nmap_Kd {LEAF}\n"))
            .unwrap();
        for (seed, name) in names.iter().enumerate() {
            std::fs::write(farm.path(&format!("trees/{name}.obj")), tuft(seed as u64, LEAVES))
                .unwrap();
        }
        std::fs::write(farm.manifest(), format!("version = 1\n{text}")).unwrap();
        farm
    }

    /// Removes all that was made.
    fn forget(&self) {
        for folder in ["packs", "exports", ".forest-bake", "cache"] {
            let _ = std::fs::remove_dir_all(self.path(folder));
        }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn manifest(&self) -> PathBuf {
        self.path("forest.toml")
    }

    /// Paints the trees' picture in this green.
    fn paint(&self, green: u8) {
        let leaf =
            |x: u32, y: u32| image::Rgba([40, green, 20, if (x + y) % 5 < 3 { 255 } else { 0 }]);
        image::RgbaImage::from_fn(8, 8, leaf).save(self.path("trees").join(LEAF)).unwrap();
    }

    /// `forest-bake batch` of the manifest: exit code, stdout and stderr.
    fn batch(&self, options: &[&str]) -> (i32, String, String) {
        let manifest = arg(&self.manifest());
        run(&[&["batch", &*manifest], options].concat())
    }

    /// What a dry run says, but for its last line.
    fn planned(&self) -> Vec<String> {
        let (code, out, err) = self.batch(&["--dry-run"]);
        assert_eq!(code, 0, "{err}");
        let mut lines: Vec<String> = out.lines().map(String::from).collect();
        lines.pop();
        lines
    }

    /// The summary of a run that ends with this code.
    fn summary(&self, code: i32, options: &[&str]) -> Value {
        let (got, out, err) = self.batch(&[&["--summary", "-", "-q"], options].concat());
        assert_eq!(got, code, "{err}");
        serde_json::from_str(&out).expect("a summary")
    }

    /// Every file that was made, by its name: its length, and a hash of its bytes.
    fn made(&self) -> BTreeMap<String, (usize, u64)> {
        let mut all = BTreeMap::new();
        for folder in ["packs", "exports"] {
            files(&self.path(folder), &mut |path| {
                let name = path.strip_prefix(self.folder.path()).unwrap().display().to_string();
                // What is hidden has no name yet.
                if !name.contains("/.") {
                    let bytes = std::fs::read(path).unwrap();
                    let mut hasher = DefaultHasher::new();
                    bytes.hash(&mut hasher);
                    all.insert(name, (bytes.len(), hasher.finish()));
                }
            });
        }
        all
    }
}

/// Tells of every file in a folder and those in it.
fn files(folder: &Path, tell: &mut dyn FnMut(&Path)) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for path in entries.map(|e| e.unwrap().path()) {
        if path.is_dir() { files(&path, tell) } else { tell(&path) }
    }
}

/// Leaves of a tuft.
const LEAVES: u32 = 60;

/// An OBJ file: a tuft of textured leaves.
fn tuft(seed: u64, leaves: u32) -> String {
    let mut rng = Pcg32::seed_from_u64(seed);
    let mut text = String::from("mtllib tree.mtl\nusemtl leaf\nvt 0 0\nvt 1 0\nvt 0 1\n");
    for i in 0..leaves {
        let mut at = |r: f32| -> [f32; 3] { std::array::from_fn(|_| rng.random_range(-r..r)) };
        let middle = at(1.0);
        for corner in [at(0.3), at(0.3), at(0.3)] {
            let [x, y, z] = std::array::from_fn(|k| middle[k] + corner[k]);
            writeln!(text, "v {x} {} {z}", y + 1.0).unwrap();
        }
        let first = 3 * i + 1;
        writeln!(text, "f {}/1 {}/2 {}/3", first, first + 1, first + 2).unwrap();
    }
    text
}

fn names(count: usize) -> Vec<String> {
    (0..count).map(|i| format!("tree-{i:03}")).collect()
}

/// Packs and nothing else: what is quick.
const POINTS: &str =
    "bake = { preset = \"draft\", with = [\"points\"] }\n[[asset]]\nfiles = [\"trees/*.obj\"]\n";

/// A schema that the program prints.
fn schema(name: &str) -> jsonschema::Validator {
    let text = crate::support::succeed(&["schema", name]);
    jsonschema::validator_for(&serde_json::from_str(&text).unwrap()).unwrap()
}

fn assert_valid(schema: &str, value: &Value) {
    let validator = self::schema(schema);
    let problems: Vec<String> = validator.iter_errors(value).map(|e| e.to_string()).collect();
    assert!(problems.is_empty(), "{schema}: {problems:?}\n{value}");
}

/// A file of the repository that users copy.
fn shipped(name: &str) -> PathBuf {
    repo("cli/forest-bake/workflow").join(name)
}
