//! Foliage: a tree as a few textured meshes that bend in the wind.
//!
//! After A. Candussi, N. Candussi, T. Höllerer, "Rendering Realistic Trees and Forests in Real Time"
//! (Eurographics 2005): leaves are grouped into few cards, thin branches into bent sheets, trunk and
//! thick branches are tubes; coarser levels have fewer and larger of them; all pictures lie in one
//! texture dictionary; every branch is bent by the wind, with what hangs on it.
//!
//! [`bake`] tells wood from leaves ([`Parts`]), finds the skeleton of the wood and makes a level for
//! every size of texel; [`FoliageBlock`] reads them back, [`FoliageBlock::select`] chooses one for a
//! camera, and [`FoliageBlock::soup`] is its mesh, at rest or in the [`Wind`].
//!
//! ```
//! use forest_foliage::{FoliageBlock, FoliageOptions, bake};
//! use forest_soup::{Material, TriangleSoup};
//! use glam::{DVec3, Vec3};
//!
//! // A trunk of three sides and a leaf.
//! let corners = |y: f32, r: f32| [(1.0, 0.0), (-0.5, 0.87), (-0.5, -0.87)].map(|(x, z)| Vec3::new(r * x, y, r * z));
//! let ring = |k: u32| [[k, k + 3, (k + 1) % 3], [(k + 1) % 3, k + 3, 3 + (k + 1) % 3]];
//! let named = |name: &str| Material { name: name.into(), ..Material::default() };
//! let tree = TriangleSoup {
//!     positions: [corners(0.0, 0.1), corners(2.0, 0.05), [1.0, 1.2, 1.4].map(|x| Vec3::new(x, 2.0, x * x))].concat(),
//!     triangles: (0..3).flat_map(ring).chain([[6, 7, 8]]).collect(),
//!     triangle_materials: vec![0, 0, 0, 0, 0, 0, 1],
//!     materials: vec![named("bark"), named("leaf")],
//!     ..TriangleSoup::default()
//! };
//! let path = tempfile::tempdir().unwrap().keep().join("tree.fpack");
//! let mut writer = forest_pack::PackWriter::create(&path).unwrap();
//! bake(&tree, &FoliageOptions::default(), &mut writer, &|_| {}).unwrap();
//! writer.finish().unwrap();
//!
//! let pack = forest_pack::Pack::open(&path).unwrap();
//! let block = FoliageBlock::open(&pack).unwrap();
//! assert_eq!(block.header.levels[0].tubes, 1);
//! assert_eq!(block.header.levels[0].cards, 1);
//! ```

mod bake;
mod block;
mod branch;
mod cover;
mod crown;
mod density;
mod dictionary;
mod error;
mod fit;
mod hang;
mod header;
mod leaf;
mod level;
mod mesh;
mod options;
mod panel;
mod parts;
mod points;
mod sheet;
mod skeleton;
pub mod sway;
mod tensor;
mod thick;
mod tube;
mod validate;
mod visible;
mod weld;
pub mod wind;
mod wood;
mod wood_graph;

pub use bake::{BakeReport, bake};
pub use block::{FoliageBlock, Mip, Posed};
pub use crown::{ALL_WAYS, CrownLight, Gain};
pub use density::CrownShade;
pub use error::FoliageError;
pub use header::{DICTIONARY, Draw, FoliageHeader, LevelHeader, VertexRecord, WoodWay};
pub use options::FoliageOptions;
pub use parts::{MaterialParts, Part, Parts, PartsOptions, Reason};
pub use points::{BentPoints, PointsWind};
pub use sway::Sway;
pub use thick::WoodErrors;
pub use validate::validate;
pub use wind::{BranchPose, BranchRecord, Hung, NO_BRANCH, Pose, Wind};
