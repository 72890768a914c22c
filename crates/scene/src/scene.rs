//! A scene, opened: the file, and all it names.

use crate::error::SceneError;
use crate::file::{LandSpec, SceneFile};
use crate::fractal::diamond_square;
use crate::heightmap::Grey;
use crate::instances::{self, Instance};
use crate::land::Land;
use crate::scatter::Scatter;
use crate::shade::{Casters, OpacityMap};
use crate::species::{Canopy, Species, Stance};
use forest_pack::Pack;
use forest_points::PointsBlock;
use forest_raster::Light;
use glam::DVec3;
use std::path::{Path, PathBuf};

/// Texels along the longer side of the opacity maps, and metres of the smallest.
const MAP_SIDE: u32 = 2048;
const MAP_TEXEL: f64 = 1.0;

/// Points that stand for a tree in the opacity maps at least: a few a texel of its own width.
const LEAST_CANOPY: f64 = 8.0;

/// A landscape and its trees.
#[derive(Debug)]
pub struct Scene {
    /// Where the scene file lies.
    pub path: PathBuf,
    /// What is in it.
    pub file: SceneFile,
    /// The ground.
    pub land: Land,
    /// The species, in the file's order.
    pub species: Vec<Species>,
    /// The trees, sorted as [`instances::sort`] does.
    pub trees: Vec<Instance>,
}

impl Scene {
    /// Opens a scene file and all it names. Without a table of trees they are planted.
    ///
    /// # Errors
    /// When a file cannot be read or breaks a rule.
    pub fn open(path: &Path) -> Result<Self, SceneError> {
        let file = read_file(path)?;
        let folder = path.parent().unwrap_or(Path::new("."));
        let land = open_land(path, folder, &file)?;
        let species = open_species(folder, &file)?;
        let trees = match &file.forest.instances {
            Some(table) => instances::read(&folder.join(table), species.len())?,
            None => plant(path, &file, &land)?,
        };
        Ok(Self { path: path.into(), file, land, species, trees })
    }

    /// How the trees of each species stand.
    pub fn stances(&self) -> Vec<Stance> {
        self.species.iter().map(|s| s.stance).collect()
    }

    /// The opacity maps of all trees along the sun, and from above.
    ///
    /// # Errors
    /// When the points of a pack are damaged.
    pub fn opacity_maps(&self) -> Result<[OpacityMap; 2], SceneError> {
        let to_sun = match self.file.sun.light() {
            Light::Sun(sun) => sun.to_sun,
            Light::Albedo => DVec3::Y,
        };
        let wide = self.land.size[0].max(self.land.size[1]);
        let texel = MAP_TEXEL.max(wide / f64::from(MAP_SIDE));
        let canopy = |species: &Species| -> Result<Canopy, SceneError> {
            let [min, max] = species.stance.bounds;
            let texels = (max - min).max_element() / texel;
            let most = (4.0 * texels * texels).max(LEAST_CANOPY);
            Ok(Canopy::new(&species.points()?, &species.stance, most as u64))
        };
        let canopies: Vec<Canopy> = self.species.iter().map(canopy).collect::<Result<_, _>>()?;
        let stances = self.stances();
        let casters = Casters { trees: &self.trees, stances: &stances, canopies: &canopies };
        let map = |light| OpacityMap::new(&self.land, &casters, light, texel, 2 * MAP_SIDE);
        Ok([map(to_sun), map(DVec3::Y)])
    }
}

/// Reads and checks a scene file alone.
///
/// # Errors
/// When it cannot be read, is no TOML of this schema, or breaks a rule.
pub fn read_file(path: &Path) -> Result<SceneFile, SceneError> {
    let text = std::fs::read_to_string(path).map_err(SceneError::io(path, "reading the scene"))?;
    parse_file(path, &text)
}

/// Checks the text of a scene file; `path` stands for it in messages.
///
/// # Errors
/// When it is no TOML of this schema, or breaks a rule.
pub fn parse_file(path: &Path, text: &str) -> Result<SceneFile, SceneError> {
    let file: SceneFile =
        toml::from_str(text).map_err(|e| SceneError::invalid(path, "scene", e))?;
    file.validate().map_err(|(key, problem)| SceneError::invalid(path, key, problem))?;
    Ok(file)
}

/// Writes a scene file whole or not at all.
///
/// # Errors
/// When the disk is full or the folder cannot be written.
pub fn write_file(path: &Path, file: &SceneFile) -> Result<(), SceneError> {
    let text = toml::to_string(file).map_err(|e| SceneError::invalid(path, "scene", e))?;
    forest_pack::write_whole(path, text.as_bytes())
        .map_err(SceneError::io(path, "writing the scene"))
}

/// The land of a scene file that lies at `path`.
///
/// # Errors
/// When its picture cannot be read or breaks a rule.
pub fn open_land(path: &Path, folder: &Path, file: &SceneFile) -> Result<Land, SceneError> {
    let LandSpec { size, fractal, heightmap, .. } = &file.land;
    let land = match (fractal, heightmap) {
        (Some(fractal), _) => diamond_square(&(*fractal).into(), *size, file.seed),
        (None, Some(map)) => {
            Grey::read(&folder.join(&map.file))?.land(*size, [map.lowest, map.highest])
        }
        (None, None) => Land { points: [2, 2], size: [*size; 2], heights: vec![0.0; 4] },
    };
    land.validate().map_err(|problem| SceneError::invalid(path, "land", problem))?;
    Ok(land)
}

fn open_species(folder: &Path, file: &SceneFile) -> Result<Vec<Species>, SceneError> {
    let open = |s: &crate::file::SpeciesSpec| {
        let pack = Pack::open(&folder.join(&s.pack))?;
        let stance = Stance::new(&PointsBlock::open(&pack)?, s.height, s.anchor, s.scale);
        Ok(Species { pack, stance })
    };
    file.species.iter().map(open).collect()
}

/// Plants the trees of a scene file that lies at `path`.
///
/// # Errors
/// When its density cannot be read, or the scatter breaks a rule.
pub fn plant(path: &Path, file: &SceneFile, land: &Land) -> Result<Vec<Instance>, SceneError> {
    let folder = path.parent().unwrap_or(Path::new("."));
    let density = file.forest.density.as_ref().map(|d| Grey::read(&folder.join(d))).transpose()?;
    let forest = &file.forest;
    let scatter = Scatter {
        square: forest.square,
        mean: Scatter::mean_for(forest.trees, forest.square, land, density.as_ref()),
        jitter: forest.jitter,
        weights: file.species.iter().map(|s| s.weight).collect(),
        seed: file.seed,
    };
    scatter.validate(land).map_err(|problem| SceneError::invalid(path, "forest", problem))?;
    let mut trees = scatter.plant(land, density.as_ref());
    instances::sort(&mut trees);
    let check = instances::validate(&trees, file.species.len());
    check.map_err(|problem| SceneError::invalid(path, "forest", problem))?;
    Ok(trees)
}
