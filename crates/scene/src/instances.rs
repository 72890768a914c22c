//! The table of trees: a binary file beside the scene file.
//!
//! | bytes | what |
//! |---|---|
//! | 0..8 | `FTREES`, 0x1a, newline |
//! | 8..12 | version, 1 |
//! | 12..16 | zero |
//! | 16..24 | number of trees |
//! | 24..56 | BLAKE3 of the records |
//! | 56..64 | zero |
//! | 64.. | records of 16 bytes: [`Instance`] |
//!
//! All little-endian. Records are sorted by species; within one, neighbours in the table are
//! neighbours on the land (Morton order), so that a run of them is a compact group.

use crate::error::SceneError;
use crate::scatter::MOST_TREES;
use bytemuck::{Pod, Zeroable};
use std::path::Path;

/// Most species of a scene.
pub const MOST_SPECIES: usize = 64;

/// Trees of a [`Tile`] at most: what a workgroup of the viewer's culling shader looks at.
pub const TILE: usize = 128;

const MAGIC: &[u8; 8] = b"FTREES\x1a\n";
const VERSION: u32 = 1;
const HEADER: usize = 64;

/// Steps of yaw in a turn, and of scale.
pub const STEPS: u32 = 4096;

/// One tree, 16 bytes, as a shader reads it.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Instance {
    /// Where it stands, in metres from the scene's zero.
    pub position: [f32; 3],
    /// Bits 0–11: yaw in 4096th of a turn; 12–23: scale in 4095th of its species' range; 24–31: species.
    pub bits: u32,
}

impl Instance {
    /// A tree; of `yaw` and `scale` the upper 12 bits are kept.
    pub fn new(position: [f32; 3], species: u8, yaw: u16, scale: u16) -> Self {
        let bits = u32::from(yaw >> 4) | u32::from(scale >> 4) << 12 | u32::from(species) << 24;
        Self { position, bits }
    }

    /// The number of its species.
    pub fn species(&self) -> usize {
        (self.bits >> 24) as usize
    }

    /// Radians that it is turned about +Y, from +Z to +X.
    pub fn yaw(&self) -> f64 {
        f64::from(self.bits & (STEPS - 1)) * (std::f64::consts::TAU / f64::from(STEPS))
    }

    /// Its scale, from its species' range.
    pub fn scale(&self, [least, most]: [f64; 2]) -> f64 {
        let share = f64::from(self.bits >> 12 & (STEPS - 1)) / f64::from(STEPS - 1);
        least + (most - least) * share
    }
}

/// A run of neighbours of one species.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tile {
    /// The species.
    pub species: usize,
    /// First tree in the table.
    pub first: u32,
    /// Number of trees, 1 to [`TILE`].
    pub count: u32,
    /// Smallest corner of the box around their places.
    pub min: [f32; 3],
    /// Largest corner.
    pub max: [f32; 3],
}

/// Sorts trees as the file has them.
pub fn sort(trees: &mut [Instance]) {
    let edge = |k: usize| {
        let along = trees.iter().map(|t| t.position[k]);
        along.fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)))
    };
    let ((x0, x1), (z0, z1)) = (edge(0), edge(2));
    let widest = (x1 - x0).max(z1 - z0).max(f32::MIN_POSITIVE);
    let step = |v: f32, from: f32| (((v - from) / widest) * 65535.0) as u32;
    trees.sort_by_cached_key(|t| {
        let [x, _, z] = t.position;
        (t.species(), spread(step(x, x0)) | spread(step(z, z0)) << 1, t.position.map(f32::to_bits))
    });
}

/// The lower 16 bits with a zero after each.
fn spread(v: u32) -> u32 {
    let v = (v | v << 8) & 0x00ff_00ff;
    let v = (v | v << 4) & 0x0f0f_0f0f;
    let v = (v | v << 2) & 0x3333_3333;
    (v | v << 1) & 0x5555_5555
}

/// The tiles of a sorted table.
pub fn tiles(trees: &[Instance]) -> Vec<Tile> {
    let mut tiles = Vec::new();
    let mut first = 0;
    for group in trees.chunk_by(|a, b| a.species() == b.species()) {
        for run in group.chunks(TILE) {
            let edge = |start: f32, pick: fn(f32, f32) -> f32| {
                std::array::from_fn(|k| run.iter().map(|t| t.position[k]).fold(start, pick))
            };
            tiles.push(Tile {
                species: run[0].species(),
                first,
                count: run.len() as u32,
                min: edge(f32::INFINITY, f32::min),
                max: edge(f32::NEG_INFINITY, f32::max),
            });
            first += run.len() as u32;
        }
    }
    tiles
}

/// Checks trees of a scene with so many species.
///
/// # Errors
/// The first broken rule, with the record, the value and the limit.
pub fn validate(trees: &[Instance], species: usize) -> Result<(), String> {
    if trees.len() > MOST_TREES {
        return Err(format!("{} trees; the limit is {MOST_TREES}", trees.len()));
    }
    for (i, t) in trees.iter().enumerate() {
        if let Some(v) = t.position.iter().find(|v| !(-1e6..=1e6).contains(*v)) {
            return Err(format!("tree {i}: a position of {v}; it must be within ±1000000 m"));
        }
        if t.species() >= species {
            return Err(format!("tree {i}: species {}; the scene has {species}", t.species()));
        }
    }
    match trees.windows(2).position(|w| w[0].species() > w[1].species()) {
        Some(i) => Err(format!("tree {}: not sorted by species", i + 1)),
        None => Ok(()),
    }
}

/// Writes a table whole or not at all.
///
/// # Errors
/// When the disk is full or the folder cannot be written.
pub fn write(path: &Path, trees: &[Instance]) -> Result<(), SceneError> {
    forest_pack::write_whole(path, &table(trees)).map_err(SceneError::io(path, "writing the trees"))
}

/// The bytes of a table.
pub fn table(trees: &[Instance]) -> Vec<u8> {
    let records: &[u8] = bytemuck::cast_slice(trees);
    let mut bytes = Vec::with_capacity(HEADER + records.len());
    bytes.extend_from_slice(MAGIC);
    bytes.extend_from_slice(&VERSION.to_le_bytes());
    bytes.extend_from_slice(&[0; 4]);
    bytes.extend_from_slice(&(trees.len() as u64).to_le_bytes());
    bytes.extend_from_slice(blake3::hash(records).as_bytes());
    bytes.extend_from_slice(&[0; 8]);
    bytes.extend_from_slice(records);
    bytes
}

/// Reads a table and checks it for a scene with so many species.
///
/// # Errors
/// When it cannot be read, is damaged or breaks a rule.
pub fn read(path: &Path, species: usize) -> Result<Vec<Instance>, SceneError> {
    let bytes = std::fs::read(path).map_err(SceneError::io(path, "reading the trees"))?;
    parse(path, &bytes, species)
}

/// Checks the bytes of a table; `path` stands for it in messages.
///
/// # Errors
/// When it is damaged or breaks a rule.
pub fn parse(path: &Path, bytes: &[u8], species: usize) -> Result<Vec<Instance>, SceneError> {
    let wrong = |element: &str, problem: String| SceneError::invalid(path, element, problem);
    if bytes.len() < HEADER || &bytes[..8] != MAGIC {
        return Err(wrong("header", "is not a table of trees".into()));
    }
    let word = |at: usize| u32::from_le_bytes([0, 1, 2, 3].map(|k| bytes[at + k]));
    if word(8) != VERSION {
        return Err(wrong("header", format!("version {}; this build knows {VERSION}", word(8))));
    }
    let count = u64::from(word(16)) | u64::from(word(20)) << 32;
    let records = &bytes[HEADER..];
    if count.checked_mul(16) != Some(records.len() as u64) {
        let length = records.len();
        return Err(wrong("header", format!("{count} trees in {length} bytes of 16 each")));
    }
    if blake3::hash(records).as_bytes() != &bytes[24..56] {
        return Err(wrong("trees", "are damaged: their hash is another".into()));
    }
    let trees: Vec<Instance> = bytemuck::pod_collect_to_vec(records);
    validate(&trees, species).map_err(|problem| wrong("trees", problem))?;
    Ok(trees)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trees() -> Vec<Instance> {
        let mut trees: Vec<Instance> = (0..700u32)
            .map(|i| {
                let [x, z] = [i % 26, i / 26].map(|v| v as f32 * 3.0 - 30.0);
                Instance::new([x, 0.5, z], (i % 3) as u8, (i * 97) as u16, (i * 31) as u16)
            })
            .collect();
        sort(&mut trees);
        trees
    }

    #[test]
    fn fields_do_not_disturb_each_other() {
        let t = Instance::new([1.0, 2.0, 3.0], 7, 0x4000, 0xffff);
        assert_eq!(t.species(), 7);
        assert!((t.yaw() - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        assert_eq!(t.scale([0.5, 1.5]), 1.5);
    }

    #[test]
    fn tables_come_back() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.trees");
        write(&path, &trees()).unwrap();
        assert_eq!(read(&path, 3).unwrap(), trees());
        let error = read(&path, 2).unwrap_err().to_string();
        assert!(error.contains("species 2; the scene has 2"), "{error}");
    }

    #[test]
    fn damaged_tables_are_refused() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.trees");
        write(&path, &trees()).unwrap();
        let good = std::fs::read(&path).unwrap();
        for (at, what) in [(0, "not a table"), (8, "version"), (16, "trees in"), (999, "hash")] {
            let mut bad = good.clone();
            bad[at] ^= 0x40;
            std::fs::write(&path, &bad).unwrap();
            let error = read(&path, 3).unwrap_err();
            assert!(error.to_string().contains(what), "{error}");
            assert_eq!(error.exit_code(), 3);
        }
        std::fs::write(&path, &good[..40]).unwrap();
        assert_eq!(read(&path, 3).unwrap_err().exit_code(), 3);
    }

    #[test]
    fn tiles_are_compact_groups_of_one_species() {
        let trees = trees();
        let tiles = tiles(&trees);
        assert_eq!(tiles.iter().map(|t| t.count as usize).sum::<usize>(), trees.len());
        for tile in &tiles {
            let run = &trees[tile.first as usize..][..tile.count as usize];
            assert!(run.iter().all(|t| t.species() == tile.species));
            // 128 of 234 trees of a species on 78 m × 81 m.
            let wide = |k: usize| tile.max[k] - tile.min[k];
            assert!(wide(0) * wide(2) < 5200.0, "{tile:?}");
        }
    }
}
