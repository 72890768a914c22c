//! Triangle soups to pictures on the CPU.
//!
//! The ground truth that every level of detail is judged against, computed two ways that must
//! agree sample by sample:
//!
//! * [`rasterize`], scanlines: the fast way, for base colours, depth, normals and light without
//!   shadows ([`rasterize_shadowed`]: with those of a shadow map). What sweeps and view bakes use.
//! * [`RayScene`], rays through a bounding volume hierarchy (the library `obvhs`): slower, and the
//!   only way to shadows and a hidden sky. What lit truths use, and what checks the scanlines.
//!
//! A pixel is the mean of its samples, 64 by default, stratified and seeded ([`Sampling`]).
//! Textures are read at full resolution at every sample, so that a far leaf card has the right
//! mean alpha: no mips, whose filtered alpha an alpha test would get wrong. What is partly
//! transparent covers a sample by the hash rule ([`covers`]); nothing is blended or sorted.
//!
//! A [`Grove`] is many instances of a few soups, by the same rays: the truth of landscapes.
//!
//! [`CaptureScene`] takes many parallel views of one soup, fast and with less care for single
//! samples: what view atlases are baked from. [`layers()`] finds what rays meet behind the first
//! thing too.
//!
//! Renderers of other things (points, views) fill a [`DisplayList`] and [`draw`] it, so that
//! there is one canvas. What must be blended is sorted and [`composite()`]d.
//!
//! ```
//! use forest_raster::{RayScene, Style, Surfaces, rasterize};
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
//! let surfaces = Surfaces::new(&leaf.materials, &leaf.textures);
//! let projection = Projection::Orthographic { height: 2.0 };
//! let camera = Camera::new(DVec3::new(0.5, 0.5, 3.0), -DVec3::Z, projection, [64, 64]);
//! let truth = rasterize(&leaf, &surfaces, &camera, &Style::default());
//! // Half a square unit in a picture of four.
//! assert!((truth.mean_coverage() - 0.125).abs() < 1e-3);
//! let again = RayScene::new(&leaf, &surfaces).picture(&camera, &Style::default());
//! assert!((truth.mean_coverage() - again.mean_coverage()).abs() < 1e-6);
//! ```

mod canvas;
mod capture;
mod composite;
mod grove;
mod layers;
mod light;
mod list;
mod mesh;
mod opacity;
mod picture;
mod plane;
mod rays;
mod sampling;
mod shadow;
mod sprite;
mod surface;
mod trace;

pub use canvas::{Style, draw};
pub use capture::{Buffers, Capture, CaptureScene, DeepHit, DeepPicture, Skylight, Subject};
pub use composite::{Layer, composite};
pub use grove::{Grove, Kind, Planted};
pub use layers::{LayerHit, layers};
pub use light::{Light, Sun, scattered};
pub use list::{Corner, DisplayList, Ellipse, Projector};
pub use mesh::{rasterize, rasterize_shadowed};
pub use opacity::{covers, sample_hash};
pub use picture::Picture;
pub use rays::RayScene;
pub use sampling::Sampling;
pub use shadow::{SHADOW_BIAS, SHADOW_SIDE, ShadowMap, sun_camera};
pub use sprite::{Sprite, SpriteHit};
pub use surface::Surfaces;
