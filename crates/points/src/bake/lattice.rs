//! The position lattice: one for the whole block, so that neighbouring cells have no cracks.

use forest_soup::Bounds;
use glam::DVec3;

/// Steps that the largest cell may span, two short of `u16::MAX` for rounding at both ends.
const SPAN: f64 = 65_533.0;

/// Finest step: keeps cell origins within 31 bits.
const FINEST: i32 = -30;

/// A lattice of 2^exponent block units about the block's centre.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lattice {
    pub(crate) exponent: i32,
}

impl Lattice {
    /// The finest lattice on which a box of edge `widest` spans at most 16 bits.
    pub(crate) fn for_extent(widest: f64) -> Self {
        let exponent = (widest / SPAN).log2().ceil();
        Self { exponent: (exponent as i32).max(FINEST) }
    }

    /// The quantiser of a cell with content `bounds`.
    pub(crate) fn quantiser(self, bounds: Bounds) -> Quantiser {
        let steps_per_unit = (-f64::from(self.exponent)).exp2();
        let origin = bounds.min.to_array().map(|v| (v * steps_per_unit).floor() as i32);
        let widest = bounds.size().max_element() * steps_per_unit;
        let shift = (widest / SPAN).log2().ceil().max(0.0) as u32;
        Quantiser { origin, shift, steps_per_unit }
    }
}

/// Positions as steps from a cell's origin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Quantiser {
    pub(crate) origin: [i32; 3],
    pub(crate) shift: u32,
    steps_per_unit: f64,
}

impl Quantiser {
    /// The nearest lattice point; positions lie within the cell's box by construction.
    pub(crate) fn quantise(&self, p: DVec3) -> [u16; 3] {
        let shifted = f64::from(1u32 << self.shift);
        std::array::from_fn(|k| {
            let steps = (p[k] * self.steps_per_unit - f64::from(self.origin[k])) / shifted;
            steps.round().clamp(0.0, f64::from(u16::MAX)) as u16
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn error_is_half_a_step_and_the_span_fits() {
        for widest in [2.0, 0.37, 1e-3] {
            let lattice = Lattice::for_extent(widest);
            let step = f64::from(lattice.exponent).exp2();
            assert!(step * SPAN >= widest && step * SPAN < 2.0 * widest);
            let min = DVec3::new(-0.911, 0.113, 0.5);
            let q = lattice.quantiser(Bounds { min, max: min + widest });
            assert_eq!(q.shift, 0);
            for t in [0.0, 0.123, 0.5, 1.0] {
                let p = min + widest * t;
                let code = q.quantise(p);
                for k in 0..3 {
                    let back = (f64::from(q.origin[k]) + f64::from(code[k])) * step;
                    assert!((back - p[k]).abs() <= step / 2.0 + 1e-15, "{widest} {t}");
                }
            }
        }
    }

    #[test]
    fn a_wider_box_counts_in_shifted_steps() {
        let lattice = Lattice::for_extent(0.1);
        let q = lattice.quantiser(Bounds { min: DVec3::splat(-1.0), max: DVec3::ONE });
        assert!(q.shift >= 4 && q.quantise(DVec3::ONE)[0] > 30_000);
    }
}
