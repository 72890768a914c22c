//! Blocks: one file, or several with placements.

use crate::{ImportError, Limits, load};
use forest_soup::{Instance, Material, Model, Placement, Relief};
use glam::{DQuat, DVec3};
use serde::Deserialize;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// What is baked together.
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    /// The trees, in order.
    pub parts: Vec<Part>,
}

/// One tree of a block.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// The file.
    pub file: PathBuf,
    /// World position of the tree's own origin.
    pub at: [f64; 3],
    /// Turn about +Y, in degrees, counter-clockwise seen from above.
    pub yaw: f64,
    /// Uniform scale, > 0.
    pub scale: f64,
}

/// A block that has been read.
#[derive(Debug)]
pub struct LoadedBlock {
    /// All trees.
    pub model: Model,
    /// Hash of each part's files, in the order of the parts.
    pub hashes: Vec<[u8; 32]>,
    /// What was odd but could be read.
    pub warnings: Vec<String>,
}

impl Part {
    /// A file where it stands.
    pub fn new(file: impl Into<PathBuf>) -> Self {
        Self { file: file.into(), at: [0.0; 3], yaw: 0.0, scale: 1.0 }
    }

    /// Parses `FILE`, `FILE@x,y,z` or `FILE@x,y,z:yaw=40,scale=1.2`.
    ///
    /// # Errors
    /// When the placement is not of that form; the message quotes it.
    pub fn parse(text: &str) -> Result<Self, ImportError> {
        // An @ that is not followed by a number belongs to the file's name.
        let starts_number =
            |t: &str| t.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c));
        let Some((file, placement)) = text.rsplit_once('@').filter(|(_, p)| starts_number(p))
        else {
            return Ok(Self::new(text));
        };
        let bad = |problem: String| {
            ImportError::invalid(Path::new(file), format!("placement {placement:?}"), problem)
        };
        let (position, settings) = placement.split_once(':').unwrap_or((placement, ""));
        let number =
            |t: &str| t.trim().parse::<f64>().map_err(|_| bad(format!("{t:?} is not a number")));
        let at: Vec<f64> = position.split(',').map(number).collect::<Result<_, _>>()?;
        let mut part = Self::new(file);
        part.at = at
            .try_into()
            .map_err(|v: Vec<f64>| bad(format!("{} coordinates; 3 are needed", v.len())))?;
        for setting in settings.split(',').filter(|s| !s.is_empty()) {
            match setting.split_once('=') {
                Some(("yaw", v)) => part.yaw = number(v)?,
                Some(("scale", v)) => part.scale = number(v)?,
                _ => {
                    return Err(bad(format!(
                        "{setting:?}; known are yaw=DEGREES and scale=FACTOR"
                    )));
                }
            }
        }
        part.check()?;
        Ok(part)
    }

    fn check(&self) -> Result<(), ImportError> {
        let finite = self.at.iter().all(|v| v.is_finite()) && self.yaw.is_finite();
        if finite && self.scale.is_finite() && self.scale > 0.0 {
            return Ok(());
        }
        let problem = "position and yaw must be finite, scale positive";
        Err(ImportError::invalid(
            &self.file,
            format!("placement {}", self.placement_text()),
            problem,
        ))
    }

    /// The placement as text, empty for none.
    pub fn placement_text(&self) -> String {
        let [x, y, z] = self.at;
        match (self.at == [0.0; 3], self.yaw == 0.0 && self.scale == 1.0) {
            (true, true) => String::new(),
            (false, true) => format!("{x},{y},{z}"),
            _ => format!("{x},{y},{z}:yaw={},scale={}", self.yaw, self.scale),
        }
    }

    fn placement(&self) -> Placement {
        let rotation = DQuat::from_rotation_y(self.yaw.to_radians());
        Placement::from_trs(DVec3::from_array(self.at), rotation, DVec3::splat(self.scale))
    }
}

/// The TOML form of a block.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BlockFile {
    tree: Vec<TreeEntry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TreeEntry {
    file: PathBuf,
    #[serde(default)]
    at: [f64; 3],
    #[serde(default)]
    yaw: f64,
    #[serde(default = "one")]
    scale: f64,
}

fn one() -> f64 {
    1.0
}

impl Block {
    /// A block from command line arguments: trees with placements, or one `.toml` file.
    ///
    /// # Errors
    /// When a placement or the block file is malformed.
    pub fn parse<S: AsRef<str>>(arguments: &[S]) -> Result<Self, ImportError> {
        if let [only] = arguments
            && only.as_ref().to_ascii_lowercase().ends_with(".toml")
        {
            return Self::read(Path::new(only.as_ref()));
        }
        let parts = arguments.iter().map(|a| Part::parse(a.as_ref())).collect::<Result<_, _>>()?;
        Ok(Self { parts })
    }

    /// Reads a block file; the files it names are relative to it.
    ///
    /// ```toml
    /// [[tree]]
    /// file = "conifer.glb"
    ///
    /// [[tree]]
    /// file = "shrub.obj"
    /// at = [3.0, 0.0, 1.0]
    /// yaw = 40.0
    /// scale = 1.2
    /// ```
    ///
    /// # Errors
    /// When the file cannot be read or breaks the form.
    pub fn read(path: &Path) -> Result<Self, ImportError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| ImportError::Io { file: path.into(), source })?;
        let file: BlockFile =
            toml::from_str(&text).map_err(|e| ImportError::invalid(path, "block file", e))?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let parts: Vec<Part> = file
            .tree
            .into_iter()
            .map(|t| Part { file: folder.join(t.file), at: t.at, yaw: t.yaw, scale: t.scale })
            .collect();
        parts.iter().try_for_each(Part::check)?;
        if parts.is_empty() {
            return Err(ImportError::invalid(path, "block file", "no [[tree]]"));
        }
        Ok(Self { parts })
    }

    /// Reads all trees; a file that stands in several places is read once.
    ///
    /// # Errors
    /// As [`load`].
    pub fn load(&self, limits: &Limits) -> Result<LoadedBlock, ImportError> {
        let mut block = LoadedBlock { model: Model::default(), hashes: vec![], warnings: vec![] };
        let mut known: HashMap<&Path, (Vec<Instance>, [u8; 32])> = HashMap::new();
        for part in &self.parts {
            if !known.contains_key(&*part.file) {
                let imported = load(&part.file, limits)?;
                block.warnings.extend(imported.warnings);
                let instances = add(&mut block.model, imported.model, &part.file)?;
                known.insert(&part.file, (instances, imported.hash));
            }
            let (instances, hash) = &known[&*part.file];
            let place = part.placement();
            block.model.instances.extend(
                instances.iter().map(|i| Instance { placement: place * i.placement, ..*i }),
            );
            block.hashes.push(*hash);
        }
        Ok(block)
    }
}

/// Adds meshes, materials and textures; returns the instances, not yet placed.
fn add(to: &mut Model, from: Model, file: &Path) -> Result<Vec<Instance>, ImportError> {
    let (mesh, texture) = (to.meshes.len() as u32, to.textures.len() as u32);
    let Ok(material) = u16::try_from(to.materials.len() + from.materials.len()) else {
        let problem = format!("more than {} materials in the block", u16::MAX);
        return Err(ImportError::invalid(file, "materials", problem));
    };
    let material = material - from.materials.len() as u16;
    to.meshes.extend(from.meshes.into_iter().map(|mut m| {
        m.material += material;
        m
    }));
    to.materials.extend(from.materials.into_iter().map(|m| Material {
        texture: m.texture.map(|t| t + texture),
        relief: m.relief.map(|r| Relief { texture: r.texture + texture, ..r }),
        ..m
    }));
    to.textures.extend(from.textures);
    Ok(from.instances.into_iter().map(|i| Instance { mesh: i.mesh + mesh, ..i }).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn placements_of_the_command_line() {
        let p = Part::parse("b.glb@3,0,1:yaw=40,scale=1.2").unwrap();
        assert_eq!(p, Part { file: "b.glb".into(), at: [3.0, 0.0, 1.0], yaw: 40.0, scale: 1.2 });
        assert_eq!(p.placement_text(), "3,0,1:yaw=40,scale=1.2");
        assert_eq!(Part::parse("me@home/a.glb").unwrap(), Part::new("me@home/a.glb"));
        assert_eq!(Part::parse("a.glb@-1.5,.5,2e1").unwrap().at, [-1.5, 0.5, 20.0]);
        for (text, want) in [
            ("a.glb@1,2", "2 coordinates"),
            ("a.glb@1,2,x", "\"x\" is not a number"),
            ("a.glb@1,2,3:size=2", "\"size=2\""),
            ("a.glb@1,2,3:scale=0", "scale positive"),
        ] {
            let e = Part::parse(text).unwrap_err().to_string();
            assert!(e.contains(want) && e.contains("a.glb"), "{e}");
        }
    }

    #[test]
    fn a_file_in_two_places_is_read_once() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("t.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
        let toml =
            "[[tree]]\nfile = \"t.obj\"\n[[tree]]\nfile = \"t.obj\"\nat = [5, 0, 0]\nyaw = 90\n";
        std::fs::write(dir.path().join("b.toml"), toml).unwrap();
        let path = dir.path().join("b.toml").to_string_lossy().into_owned();
        let block = Block::parse(&[path]).unwrap().load(&Limits::default()).unwrap();
        assert_eq!((block.model.meshes.len(), block.model.instances.len()), (1, 2));
        let soup = block.model.flatten(10).unwrap();
        // +X turned by 90° counter-clockwise, seen from above, is −Z.
        assert!((soup.positions[4] - glam::Vec3::new(5.0, 0.0, -1.0)).length() < 1e-6);
    }

    #[test]
    fn block_files_name_what_they_do_not_know() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("b.toml");
        std::fs::write(&path, "[[tree]]\nfile = \"a\"\nyawn = 3\n").unwrap();
        assert!(Block::read(&path).unwrap_err().to_string().contains("yawn"));
    }
}
