//! Packs to pictures on a graphics device: passes and WGSL that any engine can use.
//!
//! A [`Model`] is a [`forest_pack::Pack`] on a device: its sections are uploaded from the memory map as
//! they lie. A [`Renderer`] draws [`Layer`]s of it into a [`Target`], by the same `select` and the same
//! hash rule as `forest-draw`: with one sample a pixel both make the same picture.
//!
//! * **Points**: small ones by a compute shader, one atomic operation a sample (M. Schütz, B. Kerbl,
//!   M. Wimmer, "Software rasterization of 2 billion points in real time", 2022; 64-bit atomics, or
//!   32-bit ones in two runs); large ones as quads; beyond, the pack's triangles with their textures.
//! * **Views**: a quad; each sample a ray through one to three views, through their depth if wanted.
//! * **Volume**: billboards of two cameras from back to front, codes decompressed by a look-up.
//! * **Foliage**: a level's mesh, bent by the wind.
//! * **[`candidates`], [`Goal`], [`Fader`]**: which level of which representation, by the table that was
//!   measured when the pack was baked and by what levels cost here ([`Costs`]); changes fade on
//!   complementary samples.
//!
//! Light is that of [`forest_raster::Light`], with the estimated self-shadow of the points' paper (G.
//! Gilet, A. Meyer, F. Neyret 2005, section 5.3); volumes are in the light of their photographs. No
//! buffer is made while frames are drawn, and sizes are checked against the device's limits before.
//!
//! ```no_run
//! use forest_foliage::Wind;
//! use forest_gpu::{Frame, Gpu, Layer, Look, Model, Options, Renderer, What, read_picture};
//! use forest_points::Thresholds;
//! use forest_raster::Light;
//! use forest_soup::Camera;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let pack = forest_pack::Pack::open("oak.fpack".as_ref())?;
//! let gpu = Gpu::open(&forest_gpu::instance(false, None), None, None)?;
//! let renderer = Renderer::new(&gpu, &Options::default())?;
//! let mut model = Model::load(&gpu, &renderer, &pack)?;
//! let target = renderer.target(&gpu, [640, 480], 2)?;
//! let camera = Camera::around(model.bounds(), [30.0, 10.0], Some(3.0), [640, 480]);
//! let layers = [Layer::whole(What::Points(Thresholds::default()))];
//! let frame = Frame { camera, light: Light::MORNING, wind: Wind::default(), layers: &layers };
//! renderer.render(&gpu, &mut model, &target, &frame, None)?;
//! let pixels = read_picture(&gpu, &target, &Look::default(), None)?;
//! assert_eq!(pixels.len(), 640 * 480);
//! # Ok(())
//! # }
//! ```

mod auto;
mod bind;
mod costs;
mod device;
mod error;
mod foliage;
mod frame;
mod landscape;
mod materials;
mod model;
mod pipeline;
mod points;
mod present;
mod renderer;
mod shade;
mod shader;
mod sheet;
mod target;
mod textures;
mod timer;
mod triangles;
mod views;
mod volume;
mod wind;

pub use auto::{Candidate, Fader, Goal, JUST_NOTICEABLE, candidates};
pub use costs::Costs;
pub use device::{Display, Gpu, adapters, describe, instance};
pub use error::GpuError;
pub use frame::{Frame, Layer, What};
pub use landscape::{
    Landscape, LandscapeDetail, LandscapeDrawn, LandscapeRenderer, LandscapeTarget, Steering,
    finest_for,
};
pub use model::Model;
pub use present::{Look, Presenter, Shown, read_picture, read_samples};
pub use renderer::{Drawn, Options, Renderer};
pub use target::Target;
pub use timer::Timer;

/// Layers of one representation that a picture may have: two, that fade into each other.
const MOST_LAYERS: usize = 2;

/// Points of a workgroup of the compute shader.
const CHUNK: u32 = 128;
