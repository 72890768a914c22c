//! Packs to pictures on the CPU: what a viewer draws, without a viewer.
//!
//! [`draw_points`] draws the cut that [`forest_points::select()`] chooses on the canvas of
//! [`forest_raster`], with the same samples as the ground truth: spheroids as ellipses, triangles
//! with their textures and alpha rule, opacity by the hash rule, no sorting and no blending.
//! [`ViewsLevel`] draws a level of views the same way, sample by sample; [`PointsSubject`] lets views
//! be captured from points. [`FoliageScene`] draws the meshes of foliage, bent by the wind. [`VolumeScene`] sorts and blends: that is what its billboards are made for.
//! All but foliage, which has a shadow map, take [`Lit`]: a style, on the crown of a pack or without one
//! ([`CrownStyle`]).
//!
//! ```
//! use forest_draw::draw_points;
//! use forest_points::{BakeOptions, PointsBlock, SurfelSize, Thresholds, bake};
//! use forest_raster::Style;
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
//! // One disc of the leaf's area, half a unit, in a picture of four.
//! let (picture, _) = draw_points(&block, None, &camera, &Thresholds::default(), &Style::default());
//! assert!((picture.mean_coverage() - 0.125).abs() < 0.01);
//! ```

mod foliage;
mod lit;
mod points;
mod subject;
mod views;
mod volume;

pub use foliage::FoliageScene;
pub use lit::{CrownStyle, Lit};
pub use points::{
    Drawn, PointsFrame, draw_bent_points, draw_points, point_ellipses, read_surfaces,
};
pub use subject::PointsSubject;
pub use views::{ViewsDrawn, ViewsLevel};
pub use volume::{VolumeDrawn, VolumeScene};
