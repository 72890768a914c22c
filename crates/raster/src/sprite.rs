//! Things that are asked sample by sample: views, billboards.

use glam::{IVec2, Vec3};

/// What a sprite shows at a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpriteHit {
    /// Distance along the camera's forward axis, in world units.
    pub depth: f64,
    /// Linear RGB, unlit.
    pub rgb: [f32; 3],
    /// Unit normal on the side that is seen.
    pub normal: Vec3,
    /// Share of it that faces all ways ([`crate::scattered`]), in `0..=1`; the rest is turned by the normal.
    pub scattered: f32,
    /// Share of the sun that is estimated to be seen from there ([`crate::Sun::seen`]).
    pub sunlit: f32,
    /// Share of the sky that is seen from there.
    pub sky: f32,
}

/// Something flat or deep that says of each sample what it shows there.
pub trait Sprite: Send + Sync + std::fmt::Debug {
    /// First and last pixel of the box around it.
    fn pixels(&self) -> (IVec2, IVec2);

    /// Depth that nothing of it is nearer than.
    fn nearest(&self) -> f64;

    /// What is seen at picture coordinates (x, y), at place `grid` of the sample grid: the same
    /// answer whenever it is asked.
    fn sample(&self, x: f64, y: f64, grid: (u32, u32)) -> Option<SpriteHit>;
}
