//! Packs to pictures on the CPU: what a viewer draws, without a viewer.
//!
//! [`draw_points`] draws the cut that [`forest_points::select()`] chooses: spheroids as ellipses,
//! triangles with their textures and alpha rule, opacity by the hash rule, no sorting and no
//! blending. A picture is supersampled on a regular grid of `samples²` a pixel and box-filtered;
//! textures are sampled bilinearly at full resolution, so that a far leaf card keeps its mean
//! alpha.
//!
//! ```
//! use forest_draw::{Light, Style, draw_points};
//! use forest_points::{BakeOptions, PointsBlock, SurfelSize, Thresholds, bake};
//! use forest_soup::{Camera, Material, Projection, TriangleSoup};
//! use glam::{DVec3, Vec3};
//!
//! let leaf = TriangleSoup {
//!     positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
//!     triangles: vec![[0, 1, 2]],
//!     triangle_materials: vec![0],
//!     materials: vec![Material::default()],
//!     ..TriangleSoup::default()
//! };
//! let path = tempfile::tempdir().unwrap().keep().join("leaf.fpack");
//! let mut writer = forest_pack::PackWriter::create(&path).unwrap();
//! let options = BakeOptions { surfel_size: SurfelSize::Triangle, ..BakeOptions::default() };
//! bake(&leaf, &options, &mut writer, &|_| {}).unwrap();
//! writer.finish().unwrap();
//!
//! let pack = forest_pack::Pack::open(&path).unwrap();
//! let block = PointsBlock::open(&pack).unwrap();
//! let projection = Projection::Orthographic { height: 2.0 };
//! let camera = Camera::new(DVec3::new(0.5, 0.5, 1.0), -DVec3::Z, projection, [64, 64]);
//! let style = Style { samples: 4, light: Light::Albedo };
//! // One disc of the leaf's area, half a unit, in a picture of four.
//! let (picture, _) = draw_points(&block, None, &camera, &Thresholds::default(), &style);
//! assert!((picture.mean_coverage() - 0.125).abs() < 0.01);
//! ```

mod canvas;
mod picture;
mod points;
mod primitive;
mod style;

pub use picture::Picture;
pub use points::{Drawn, Surfaces, draw_points};
pub use style::{Light, Style};
