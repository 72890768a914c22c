//! Volumes: a tree as an octree of small billboards, one for each cell and camera.
//!
//! System *volume*, after C. Linz, A. Reche-Martinez, G. Drettakis, M. Magnor, "Effective
//! multi-resolution rendering and texture compression for captured volumetric trees" (paper 004),
//! which builds on A. Reche, I. Martín, G. Drettakis, "Volumetric reconstruction and interactive
//! rendering of trees from photographs" (2004; section 2.1 of the paper). Where we deviate:
//!
//! * textures are made of what each cell stops of the light that reaches it, so that billboards one
//!   over the other give the photograph again (`billboards.rs`); a mesh is photographed with depth;
//! * the two nearest cameras have shares that change without a step, and a billboard that one of
//!   them does not know is the other's alone ([`select()`]);
//! * levels are faded into each other so that together they hide what one of them would;
//! * blank texels do not take part in codebooks ([`Blank::Mean`]); the paper's black is an option.
//!
//! Two faces: [`Volume`] is made of a mesh or of photographs and [`bake()`] writes it;
//! [`VolumeBlock`] reads it, and [`select()`] says what to draw.
//!
//! ```
//! use forest_raster::Surfaces;
//! use forest_soup::{Camera, Material, Projection, TriangleSoup};
//! use forest_volume::{Detail, Stand, Volume, VolumeBlock, VolumeOptions, bake, select};
//! use glam::{DVec3, Vec3};
//!
//! let leaf = TriangleSoup {
//!     positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
//!     triangles: vec![[0, 1, 2]],
//!     triangle_materials: vec![0],
//!     materials: vec![Material::default()],
//!     ..TriangleSoup::default()
//! };
//! let surfaces = Surfaces::new(&leaf.materials, &leaf.textures);
//! let options = VolumeOptions { levels: 3, ..VolumeOptions::default() };
//! let stand = Stand::Dome { cameras: 4 };
//! let volume = Volume::from_mesh(&leaf, &surfaces, stand, &options, &|_| {}).unwrap();
//! let path = tempfile::tempdir().unwrap().keep().join("leaf.fpack");
//! let mut writer = forest_pack::PackWriter::create(&path).unwrap();
//! bake(&volume, None, &mut writer).unwrap();
//! writer.finish().unwrap();
//!
//! let pack = forest_pack::Pack::open(&path).unwrap();
//! let block = VolumeBlock::open(&pack).unwrap();
//! let projection = Projection::Perspective { fov_y: 1.0 };
//! let far = Camera::new(DVec3::new(0.0, 0.0, 1e4), -DVec3::Z, projection, [640, 480]);
//! let chosen = select(&block, &far, Detail::PIXEL);
//! assert_eq!(chosen.items.len(), 1); // the root will do
//! ```

mod atlas;
mod bake;
mod below;
mod billboards;
mod block;
mod cells;
mod coverage;
mod error;
mod frame;
mod header;
mod hull;
mod lattice;
mod march;
mod matte;
mod options;
mod photograph;
mod prune;
mod quantise;
mod select;
mod tomography;
mod validate;
mod volume;

pub use atlas::Codewords;
pub use bake::{BakeReport, bake};
pub use block::VolumeBlock;
pub use error::VolumeError;
pub use forest_vq::{Centers, bits_for as code_bits};
pub use frame::CameraFrame;
pub use header::{ATLAS_WIDTH, Coding, LevelHeader, NodeRecord, VolumeHeader};
pub use lattice::{Branching, Lattice};
pub use options::{Blank, Coarse, CodebookOptions, CodebookSize, Prune, Space, VolumeOptions};
pub use photograph::Stand;
pub use quantise::{Effort, Quality, Quantised, quantise};
pub use select::{
    Blending, CameraShare, Detail, Item, LEAST_THROUGH, Selection, planes, select, select_into,
};
pub use tomography::{TomographyOptions, TomographyReport};
pub use volume::{LevelCounts, Volume, VolumeLevel, VolumeReport};
