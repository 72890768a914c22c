//! Landscapes: terrain, trees scattered on it, and what a scene needs of its packs.
//!
//! * [`diamond_square`] and [`Grey::land`] make a [`Land`]; [`Ground`] is its level of detail.
//! * [`Scatter`] plants trees on it: a table of [`Instance`]s, 16 bytes each, in a file of its own.
//! * [`Scene`] is what a scene file ([`SceneFile`], TOML) names, opened.
//! * [`OpacityMap`] says how much light reaches a place between the trees.
//! * [`needs`] says what its cameras can ever ask of each pack, [`solve`] what to keep of them for so many bytes.
//!
//! Nothing is drawn here: that is `forest-gpu`'s, with ground truth from `forest-raster`.
//!
//! Sources: terrain and scatter follow paper 001 (sections 3.1 and 3.2); landscapes of instanced
//! blocks are those of G. Gilet, A. Meyer, F. Neyret, "Point-based rendering of trees" (2005, section 6).
//!
//! ```
//! use forest_scene::{Fractal, Scatter, diamond_square};
//!
//! let fractal = Fractal { cells: 128, range: 20.0, smoothness: 0.9 };
//! let land = diamond_square(&fractal, 1000.0, 7);
//! let weights = vec![2.0, 1.0];
//! let scatter = Scatter { square: 10.0, mean: 0.5, jitter: 1.0, weights, seed: 7 };
//! let trees = scatter.plant(&land, None);
//! // 10,000 squares with half a tree each.
//! assert!((4700..5300).contains(&trees.len()));
//! let [x, y, z] = trees[0].position.map(f64::from);
//! assert!((y - land.height(x, z)).abs() < 1e-5);
//! ```

mod budget;
mod error;
mod expected;
mod file;
mod filled;
mod fractal;
mod ground;
mod heightmap;
mod impostor;
pub mod instances;
mod land;
mod need;
mod scatter;
mod scene;
mod shade;
mod sight;
mod solve;
mod species;
mod surface;

pub use budget::{Candidate, Choice, frontier, within_bytes, within_error};
pub use error::SceneError;
pub use file::{
    ForestSpec, FractalSpec, HeightmapSpec, LandSpec, PathSpec, SceneFile, SpeciesSpec, SunSpec,
};
pub use filled::{Filled, HEIGHT_BANDS, band_height, filled};
pub use fractal::{Fractal, diamond_square};
pub use ground::{Ground, PATCH, Patch, is_beside};
pub use heightmap::Grey;
pub use impostor::{IMPOSTOR_FADE, Impostor, LEAST_IMPOSTOR};
pub use instances::{Instance, MOST_SPECIES, STEPS, TILE, Tile};
pub use land::{Land, MOST_POINTS};
pub use need::{Fineness, SpeciesNeed, needs};
pub use scatter::{MOST_TREES, Scatter};
pub use scene::{Scene, open_land, parse_file, plant, read_file, write_file};
pub use shade::{Casters, DEPTH_STEPS, DIFFUSE, HEIGHT_STEPS, LOWEST_LIGHT, OpacityMap, Texel};
pub use sight::{Sight, Sky};
pub use solve::{Solved, solve};
pub use species::{Canopy, CanopyPoint, Species, Stance};
pub use surface::{GroundVertex, ground_soup, ground_vertices};
