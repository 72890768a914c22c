//! Packs to what engines read.
//!
//! [`for_engine`] writes the textures and the side file that the impostor shaders of Unreal, Godot
//! and three.js read; [`plain()`] writes PNG, EXR or KTX2 for any reader; [`contact_sheet`] a sheet for
//! people; [`photographs()`] a capture for NeRF tools; [`splats`] points as Gaussian splats; [`levels`]
//! foliage as a glb with all its levels, and [`pivots()`] its branches as textures. Nothing touches the disk: an export is a list of [`ExportFile`]s.
//!
//! ```
//! use forest_export::{Engine, for_engine, tiles};
//! use forest_raster::{CaptureScene, Surfaces};
//! use forest_soup::{Material, TriangleSoup};
//! use forest_views::{Directions, Dome, Fit, Frame, ViewsBlock, ViewsOptions, bake};
//! use glam::Vec3;
//!
//! let leaf = TriangleSoup {
//!     positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
//!     triangles: vec![[0, 1, 2]],
//!     triangle_materials: vec![0],
//!     materials: vec![Material::default()],
//!     ..TriangleSoup::default()
//! };
//! let surfaces = Surfaces::new(&leaf.materials, &leaf.textures);
//! let directions = Directions::octahedral(9, Dome::Upper);
//! let options = ViewsOptions { directions, texels: 8, ..ViewsOptions::default() };
//! let frame = Frame::of(&leaf, &directions, Fit::Tight).unwrap();
//! let path = tempfile::tempdir().unwrap().keep().join("leaf.fpack");
//! let mut writer = forest_pack::PackWriter::create(&path).unwrap();
//! bake(&CaptureScene::new(&leaf, &surfaces), &frame, &options, &mut writer, &|_| {}).unwrap();
//! writer.finish().unwrap();
//!
//! let pack = forest_pack::Pack::open(&path).unwrap();
//! let block = ViewsBlock::open(&pack).unwrap();
//! // Godot reads the grid from the top, three.js from the bottom.
//! assert_eq!(tiles(&block, Engine::Godot).unwrap()[0], 0);
//! assert_eq!(tiles(&block, Engine::Three).unwrap()[0], 6);
//! let files = for_engine(&block, Engine::Three, "leaf").unwrap();
//! let names: Vec<&str> = files.iter().map(|f| f.name.as_str()).collect();
//! assert_eq!(names, ["albedo.png", "normalDepth.png", "leaf.impostor.json"]);
//! ```
//!
//! Sources: the shaders of agargaro/octahedral-impostor, wojtekpil/Godot-Octahedral-Impostors and
//! ictusbrucks/ImpostorBaker; the Khronos KTX 2.0 and Data Format specifications.

mod engine;
mod error;
mod glb;
mod grid;
mod ktx2;
mod photographs;
mod picture;
mod pivots;
mod plain;
mod ply;
mod sheet;

pub use engine::{Engine, TileFrame, for_engine, tiles};
pub use error::ExportError;
pub use glb::levels;
pub use photographs::photographs;
pub use picture::ExportFile;
pub use pivots::pivots;
pub use plain::{PlainFormat, plain};
pub use ply::splats;
pub use sheet::contact_sheet;
