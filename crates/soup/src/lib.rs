//! Triangle soups: what every baker reads.
//!
//! A [`Model`] is what a file holds (meshes and the places they stand in); [`Model::flatten`]
//! turns it into one [`TriangleSoup`]: an `f64` origin, `f32` positions about it, materials and
//! textures. No topology is assumed. [`Camera`] is the common way to say where a picture is taken
//! from, [`Photograph`] is one with its camera, and [`ShadedTexture`] is a texture as light sees it: linear, premultiplied, with the
//! material's alpha rule applied.
//!
//! ```
//! use forest_soup::{Instance, Material, Mesh, Model, Placement};
//! use glam::{DVec3, Vec3};
//!
//! let leaf = Mesh {
//!     name: "leaf".into(),
//!     positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
//!     triangles: vec![[0, 1, 2]],
//!     ..Mesh::default()
//! };
//! let far = Placement::from_translation(DVec3::new(1e6, 0.0, 0.0));
//! let model = Model {
//!     meshes: vec![leaf],
//!     instances: vec![Instance { mesh: 0, placement: far }],
//!     materials: vec![Material::default()],
//!     textures: vec![],
//! };
//! let soup = model.flatten(1_000).unwrap();
//! assert_eq!(soup.origin, DVec3::new(1e6, 0.0, 0.0));
//! assert_eq!(soup.positions[1], Vec3::X); // the offset stays out of the f32 positions
//! ```

mod camera;
mod color;
mod coverage;
mod material;
mod model;
mod photograph;
mod pieces;
mod placement;
mod relief;
mod shaded;
mod soup;
mod texture;

pub use camera::{Camera, Projection, named_view};
pub use color::{linear_to_srgb8, luminance, srgb_to_linear, srgb8_to_linear};
pub use coverage::CoverageMap;
pub use material::{AlphaMode, Material};
pub use model::{FlattenError, Instance, Mesh, Model};
pub use photograph::{Distortion, Optics, PhotoCamera, Photograph};
pub use pieces::Pieces;
pub use placement::Placement;
pub use relief::{NormalMap, Relief, Tangents};
pub use shaded::ShadedTexture;
pub use soup::{Bounds, InvalidSoup, TriangleSoup};
pub use texture::{Texture, Wrap};
