//! Views: a tree as pictures from many directions.
//!
//! System *views*, after a course report on forests with pre-computed views (paper 001: sections
//! 3.3 View Computation, 3.4 Displaying Trees, 6 Future Work), which follows the z-field of
//! E. Bruneton, F. Neyret, "Real-time realistic rendering and lighting of forests", Computer
//! Graphics Forum 31 (2012). Where we deviate:
//!
//! * views lie on a hemi-octahedral grid by default; the paper's rings, which crowd views at the
//!   pole, remain ([`Layout::Rings`]);
//! * every view is stored at every resolution as a *level*, trimmed to what it shows, with true
//!   coverage in its alpha and the threshold that keeps it ([`TileRecord::cutoff`]): trees do not
//!   thin out at a distance;
//! * besides the nearest view ([`Lookup::Nearest`]) three can be blended, and rays can be followed
//!   through their depth: the paper's future work. Each sample takes one view, drawn by its share,
//!   and covers by the hash rule: no sorting, no boxes (section 4.4);
//! * normals and the share of the sky that is seen travel with the colours: views can be relit.
//!
//! Two faces: [`bake()`] writes the sections of a pack from anything that can be captured
//! ([`forest_raster::Subject`]); [`ViewsBlock`] reads them, and [`select()`] says what to look at.
//!
//! ```
//! use forest_raster::{CaptureScene, Surfaces};
//! use forest_soup::{Camera, Material, Projection, TriangleSoup};
//! use forest_views::{Directions, Dome, Fit, Frame, Lookup, ViewsBlock, ViewsOptions, bake, select};
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
//! let directions = Directions::octahedral(25, Dome::Upper);
//! let options = ViewsOptions { directions, texels: 16, ..ViewsOptions::default() };
//! let frame = Frame::of(&leaf, &directions, Fit::Tight).unwrap();
//! let path = tempfile::tempdir().unwrap().keep().join("leaf.fpack");
//! let mut writer = forest_pack::PackWriter::create(&path).unwrap();
//! bake(&CaptureScene::new(&leaf, &surfaces), &frame, &options, &mut writer, &|_| {}).unwrap();
//! writer.finish().unwrap();
//!
//! let pack = forest_pack::Pack::open(&path).unwrap();
//! let block = ViewsBlock::open(&pack).unwrap();
//! let projection = Projection::Perspective { fov_y: 1.0 };
//! let far = Camera::new(DVec3::new(0.0, 0.0, 100.0), -DVec3::Z, projection, [640, 480]);
//! let chosen = select(&block, &far, Lookup::Nearest, 1.0);
//! assert_eq!(block.header.levels[chosen.level].texels, 8); // the leaf is six pixels high
//! ```

mod bake;
mod block;
mod codec;
mod directions;
mod error;
mod fit;
mod header;
mod lookup;
mod options;
mod pack_tiles;
mod prune;
mod select;
mod tile;
mod validate;

pub use bake::{BakeReport, TexelCounts, bake};
pub use block::{OFF_STEPS, Texels, ViewsBlock, decode_height, decode_normal, normal_parts};
pub use codec::{Channel, decode, encode};
pub use directions::{Blend, Directions, Dome, Layout, MAX_VIEWS};
pub use error::ViewsError;
pub use fit::Frame;
pub use header::{LevelHeader, TileRecord, ViewFrame, ViewsHeader};
pub use lookup::{BEHIND, Found, Hit, JOINED, MOST_STEPS, Ray, SLACK, ViewSampler};
pub use options::{Channels, Fit, Quality, ViewsOptions};
pub use prune::prune;
pub use select::{COVER, Lookup, PICK, Selection, select, views};
