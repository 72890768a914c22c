//! Normalised block space: the block's sphere becomes the unit ball, by a power of two.

use forest_soup::Bounds;
use glam::DVec3;

/// Maps soup positions to block space: `(p − center) · 2^−exponent`, in `f64`.
///
/// The scale is a power of two, so that a block scaled by 2^±20 gives the very same numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BlockFrame {
    /// Middle of the block's box, in the soup's space.
    pub(crate) center: DVec3,
    /// log₂ of a block unit.
    pub(crate) exponent: i32,
    /// The block's box, in block space.
    pub(crate) bounds: Bounds,
    to_block: f64,
}

impl BlockFrame {
    /// The frame of what lies in a box; `None` if that is nothing, or one point.
    pub(crate) fn of(bounds: Bounds) -> Option<Self> {
        let half = bounds.half_diagonal();
        if bounds.is_empty() || half == 0.0 {
            return None;
        }
        let exponent = half.log2().ceil() as i32;
        let to_block = (-f64::from(exponent)).exp2();
        let center = bounds.center();
        let map = |p: DVec3| (p - center) * to_block;
        let bounds = Bounds { min: map(bounds.min), max: map(bounds.max) };
        Some(Self { center, exponent, bounds, to_block })
    }

    #[inline]
    pub(crate) fn map(&self, p: glam::Vec3) -> DVec3 {
        (p.as_dvec3() - self.center) * self.to_block
    }

    /// Block units in a world length.
    pub(crate) fn length(&self, world: f64) -> f64 {
        world * self.to_block
    }
}
