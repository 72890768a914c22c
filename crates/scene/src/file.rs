//! The scene file: TOML, documented in docs/SCENE.md.

use crate::fractal::Fractal;
use crate::instances::MOST_SPECIES;
use crate::sight::{Sight, Sky};
use forest_raster::{Light, Sun};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// A scene file. Paths in it are taken from its own folder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneFile {
    /// Seed of everything random.
    #[serde(default)]
    pub seed: u64,
    /// The ground.
    pub land: LandSpec,
    /// Where trees stand.
    pub forest: ForestSpec,
    /// The light.
    #[serde(default)]
    pub sun: SunSpec,
    /// What is behind everything.
    #[serde(default)]
    pub sky: Sky,
    /// What trees there are.
    pub species: Vec<SpeciesSpec>,
    /// Where to look from; the first one is where the viewer starts.
    #[serde(default, rename = "camera")]
    pub cameras: Vec<Sight>,
    /// Ways between cameras.
    #[serde(default, rename = "path")]
    pub paths: Vec<PathSpec>,
}

/// The ground: fractal, from a picture, or flat without both.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LandSpec {
    /// Metres along x; of a picture the depth follows from its pixels.
    pub size: f64,
    /// Diamond–square.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fractal: Option<FractalSpec>,
    /// A picture.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub heightmap: Option<HeightmapSpec>,
    /// sRGB colour of the ground, 0 … 255.
    #[serde(default = "usual_ground")]
    pub color: [u8; 3],
    /// sRGB colour where it is steep.
    #[serde(default = "usual_steep")]
    pub steep: [u8; 3],
}

impl Default for LandSpec {
    /// A flat square kilometre of grass.
    fn default() -> Self {
        let (color, steep) = (usual_ground(), usual_steep());
        Self { size: 1000.0, fractal: None, heightmap: None, color, steep }
    }
}

fn usual_ground() -> [u8; 3] {
    [86, 92, 50]
}

fn usual_steep() -> [u8; 3] {
    [112, 102, 86]
}

/// [`Fractal`] in a file.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FractalSpec {
    /// Cells along a side, a power of two.
    pub cells: u32,
    /// The paper's x in metres.
    pub range: f64,
    /// The paper's y.
    pub smoothness: f64,
}

impl From<FractalSpec> for Fractal {
    fn from(s: FractalSpec) -> Self {
        Self { cells: s.cells, range: s.range, smoothness: s.smoothness }
    }
}

/// Heights from a picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HeightmapSpec {
    /// PNG of 8 or 16 bits, or EXR.
    pub file: PathBuf,
    /// Height in metres where the picture is 0.
    #[serde(default)]
    pub lowest: f64,
    /// Height in metres where it is 1.
    pub highest: f64,
}

/// Where trees stand.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ForestSpec {
    /// Expected number of trees.
    pub trees: f64,
    /// Side of a square of the scatter in metres.
    #[serde(default = "usual_square")]
    pub square: f64,
    /// Share of the largest perturbation, 0 … 1.
    #[serde(default = "one")]
    pub jitter: f64,
    /// A picture over the whole land: trees are as rare as it is dark.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub density: Option<PathBuf>,
    /// The table of trees that was made of this; without, they are planted anew at every load.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub instances: Option<PathBuf>,
}

fn usual_square() -> f64 {
    16.0
}

fn one() -> f64 {
    1.0
}

/// A species.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SpeciesSpec {
    /// Its pack: points, and views if there are.
    pub pack: PathBuf,
    /// Its share of the trees, relative to the others'.
    #[serde(default = "one")]
    pub weight: f64,
    /// Least and largest scale.
    #[serde(default = "usual_scale")]
    pub scale: [f64; 2],
    /// Height in metres at scale 1; without, a unit of the pack is a metre.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub height: Option<f64>,
    /// Where it touches the ground, in the pack's world; without, the pack's zero if that lies in its
    /// box, else the middle of the box's bottom.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub anchor: Option<[f64; 3]>,
}

impl Default for SpeciesSpec {
    /// One of no pack yet.
    fn default() -> Self {
        let (pack, scale) = (PathBuf::new(), usual_scale());
        Self { pack, weight: one(), scale, height: None, anchor: None }
    }
}

fn usual_scale() -> [f64; 2] {
    [0.8, 1.2]
}

/// The light.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SunSpec {
    /// Degrees clockwise from north (−z) that it stands.
    pub azimuth: f64,
    /// Degrees above the horizon, 6 or more.
    pub elevation: f64,
    /// What a white surface facing the sun shows, linear RGB.
    pub sun: [f32; 3],
    /// What a white surface shows under the whole sky, linear RGB.
    pub sky: [f32; 3],
    /// Share of the sunlight that shines through leaves, 0 … 1.
    pub translucency: f32,
}

impl Default for SunSpec {
    /// High in the south-west.
    fn default() -> Self {
        Self {
            azimuth: 220.0,
            elevation: 48.0,
            sun: [1.05, 1.0, 0.9],
            sky: [0.42, 0.46, 0.52],
            translucency: 0.6,
        }
    }
}

impl SunSpec {
    /// As renderers take it.
    pub fn light(&self) -> Light {
        let (azimuth, elevation) = (self.azimuth.to_radians(), self.elevation.to_radians());
        let flat = elevation.cos();
        Light::Sun(Sun {
            to_sun: DVec3::new(azimuth.sin() * flat, elevation.sin(), -azimuth.cos() * flat),
            sun: self.sun,
            sky: self.sky,
            translucency: self.translucency,
            darkest: 1.0,
        })
    }
}

/// A way from camera to camera, in equal parts of the time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PathSpec {
    /// Its name.
    pub name: String,
    /// Names of cameras, two or more.
    pub cameras: Vec<String>,
    /// Pictures along it.
    pub frames: u32,
}

impl SceneFile {
    /// The camera of this name, or the first one without.
    pub fn camera(&self, name: Option<&str>) -> Option<&Sight> {
        match name {
            Some(name) => self.cameras.iter().find(|c| c.name == name),
            None => self.cameras.first(),
        }
    }

    /// The sights along a path.
    pub fn along(&self, path: &PathSpec) -> Vec<Sight> {
        let stops: Vec<&Sight> =
            path.cameras.iter().filter_map(|name| self.camera(Some(name))).collect();
        let last = f64::from(path.frames.max(2) - 1);
        let sight = |i: u32| {
            let at = f64::from(i) / last * (stops.len() - 1) as f64;
            let leg = (at as usize).min(stops.len().saturating_sub(2));
            stops[leg].toward(stops[(leg + 1).min(stops.len() - 1)], at - leg as f64)
        };
        if stops.is_empty() { Vec::new() } else { (0..path.frames).map(sight).collect() }
    }

    /// Checks what can be checked without opening other files.
    ///
    /// # Errors
    /// Key and problem of the first broken rule, with the value and the limit.
    pub fn validate(&self) -> Result<(), (String, String)> {
        let at = |key: &str| {
            let key = key.to_string();
            move |problem: String| (key, problem)
        };
        let within = |key: &str, v: f64, low: f64, high: f64| {
            let problem = || format!("{v}; it must be within {low} and {high}");
            if (low..=high).contains(&v) { Ok(()) } else { Err(at(key)(problem())) }
        };
        within("land.size", self.land.size, 1e-3, 1e6)?;
        if let (Some(_), Some(_)) = (&self.land.fractal, &self.land.heightmap) {
            return Err(at("land")("has fractal and heightmap; there can be one".into()));
        }
        if let Some(fractal) = self.land.fractal {
            Fractal::from(fractal).validate().map_err(at("land.fractal"))?;
        }
        if let Some(map) = &self.land.heightmap {
            within("land.heightmap.lowest", map.lowest, -1e5, 1e5)?;
            within("land.heightmap.highest", map.highest, -1e5, 1e5)?;
        }
        within("forest.trees", self.forest.trees, 0.0, crate::scatter::MOST_TREES as f64)?;
        within("sun.azimuth", self.sun.azimuth, -3600.0, 3600.0)?;
        within("sun.elevation", self.sun.elevation, 6.0, 90.0)?;
        within("sun.translucency", self.sun.translucency.into(), 0.0, 1.0)?;
        for v in self.sun.sun.iter().chain(&self.sun.sky) {
            within("sun", f64::from(*v), 0.0, 1e4)?;
        }
        for v in self.sky.horizon.iter().chain(&self.sky.zenith) {
            within("sky", f64::from(*v), 0.0, 1e4)?;
        }
        if !(1..=MOST_SPECIES).contains(&self.species.len()) {
            let n = self.species.len();
            return Err(at("species")(format!("{n} of them; there must be 1 to {MOST_SPECIES}")));
        }
        for (i, s) in self.species.iter().enumerate() {
            let key = |name: &str| format!("species {i} ({}): {name}", s.pack.display());
            within(&key("weight"), s.weight, 0.0, 1e9)?;
            within(&key("scale"), s.scale[0], 1e-3, 1e3)?;
            within(&key("scale"), s.scale[1], s.scale[0], 1e3)?;
            if let Some(height) = s.height {
                within(&key("height"), height, 1e-3, 1e4)?;
            }
            for v in s.anchor.iter().flatten() {
                within(&key("anchor"), *v, -1e12, 1e12)?;
            }
        }
        for (i, c) in self.cameras.iter().enumerate() {
            c.validate().map_err(at(&format!("camera {i} ({})", c.name)))?;
            if self.cameras[..i].iter().any(|other| other.name == c.name) {
                return Err(at(&format!("camera {i}"))(format!("a second one named {}", c.name)));
            }
        }
        for p in &self.paths {
            let key = format!("path {}", p.name);
            within(&key, f64::from(p.frames), 1.0, 1e6)?;
            within(&key, p.cameras.len() as f64, 2.0, 1e4)?;
            if let Some(name) = p.cameras.iter().find(|n| self.camera(Some(n)).is_none()) {
                return Err(at(&key)(format!("no camera is named {name}")));
            }
        }
        Ok(())
    }
}
