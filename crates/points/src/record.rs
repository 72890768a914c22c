//! The point record: 16 bytes, as a shader reads it.

use crate::size::SizeCode;
use bytemuck::{Pod, Zeroable};
use forest_soup::{linear_to_srgb8, srgb8_to_linear};
use glam::DVec3;

/// One point of a block, 16 bytes.
///
/// | bytes | what |
/// |---|---|
/// | 0..6 | position: three `u16` steps from the cell's origin (x, y, z) |
/// | 6..8 | axis: octahedral, two unsigned bytes |
/// | 8..11 | colour: sRGB red, green, blue |
/// | 11 | opacity · 255 |
/// | 12..16 | `u32`: bits 0–11 own size code, 12–23 parent's size code, 24–30 flatness, 31 leaf |
///
/// Quantisation errors: position half a step along each axis (see `PointsHeader::step_exponent`);
/// axis ≤ 0.96°; colour half an sRGB code; opacity 1/510; size ≤ 0.44 % in radius, and opacity is
/// rounded after the size so that their product keeps the area to 1/510 of the footprint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct PointRecord {
    /// Position in steps from the cell's origin.
    pub position: [u16; 3],
    /// Octahedral axis.
    pub axis: [u8; 2],
    /// sRGB colour.
    pub rgb: [u8; 3],
    /// Opacity · 255.
    pub opacity: u8,
    /// Sizes, flatness and the leaf bit.
    pub bits: u32,
}

const _: () = assert!(size_of::<PointRecord>() == 16);

const PARENT_SHIFT: u32 = 12;
const FLATNESS_SHIFT: u32 = 24;
const LEAF_BIT: u32 = 1 << 31;
const CODE_MASK: u32 = 0xfff;

impl PointRecord {
    /// The size code of the point's own footprint.
    #[inline]
    pub fn own(&self) -> SizeCode {
        SizeCode::from_bits((self.bits & CODE_MASK) as u16).expect("12 bits")
    }

    /// The size code of its parent; [`SizeCode::INFINITE`] for the root of a cell.
    #[inline]
    pub fn parent(&self) -> SizeCode {
        SizeCode::from_bits((self.bits >> PARENT_SHIFT & CODE_MASK) as u16).expect("12 bits")
    }

    /// Quantised flatness, see [`crate::spheroid`].
    #[inline]
    pub fn flatness_step(&self) -> u8 {
        (self.bits >> FLATNESS_SHIFT & 0x7f) as u8
    }

    /// Whether the point is a surfel: part of a triangle, not a cluster.
    #[inline]
    pub fn is_leaf(&self) -> bool {
        self.bits & LEAF_BIT != 0
    }

    /// The axis, a unit vector whose sign means nothing.
    pub fn axis(&self) -> DVec3 {
        decode_axis(self.axis)
    }

    /// Linear RGB.
    pub fn color(&self) -> [f32; 3] {
        self.rgb.map(srgb8_to_linear)
    }

    /// Opacity in `0..=1`.
    pub fn opacity(&self) -> f64 {
        f64::from(self.opacity) / 255.0
    }

    pub(crate) fn set_parent(&mut self, parent: SizeCode) {
        self.bits =
            self.bits & !(CODE_MASK << PARENT_SHIFT) | u32::from(parent.bits()) << PARENT_SHIFT;
    }

    /// A record without a parent; `opacity` is clamped to 1/255..=1 (a point that never shows
    /// would be a hole in the cut).
    pub(crate) fn new(
        position: [u16; 3],
        axis: DVec3,
        rgb: [f32; 3],
        opacity: f64,
        own: SizeCode,
        flatness_step: u8,
        leaf: bool,
    ) -> Self {
        let bits = u32::from(own.bits())
            | u32::from(SizeCode::INFINITE.bits()) << PARENT_SHIFT
            | u32::from(flatness_step) << FLATNESS_SHIFT
            | if leaf { LEAF_BIT } else { 0 };
        Self {
            position,
            axis: encode_axis(axis),
            rgb: rgb.map(linear_to_srgb8),
            opacity: (opacity * 255.0).round().clamp(1.0, 255.0) as u8,
            bits,
        }
    }
}

/// Octahedral encoding of a unit vector in two bytes (Meyer et al. 2010); 128 is zero, so that
/// the coordinate axes are exact.
pub fn encode_axis(n: DVec3) -> [u8; 2] {
    let s = n.x.abs() + n.y.abs() + n.z.abs();
    if s.is_nan() || s <= 0.0 {
        return encode_axis(DVec3::Y);
    }
    let (x, y) = (n.x / s, n.y / s);
    let (x, y) = if n.z >= 0.0 {
        (x, y)
    } else {
        ((1.0 - y.abs()).copysign(x), (1.0 - x.abs()).copysign(y))
    };
    [x, y].map(|v| (128.0 + v * 127.0).round() as u8)
}

/// The unit vector of two octahedral bytes; 0 is read as 1.
pub fn decode_axis(code: [u8; 2]) -> DVec3 {
    let [x, y] = code.map(|c| (f64::from(c.max(1)) - 128.0) / 127.0);
    let z = 1.0 - x.abs() - y.abs();
    let fold = (-z).max(0.0);
    DVec3::new(x - fold.copysign(x), y - fold.copysign(y), z).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn fields_do_not_disturb_each_other() {
        let own = SizeCode::from_bits(0xabc).unwrap();
        let mut r = PointRecord::new([1, 2, 3], DVec3::Z, [1.0, 0.0, 0.5], 0.5, own, 0x55, true);
        assert_eq!(r.parent(), SizeCode::INFINITE);
        r.set_parent(SizeCode::from_bits(0x123).unwrap());
        assert_eq!((r.own(), r.parent().bits()), (own, 0x123));
        assert_eq!((r.flatness_step(), r.is_leaf(), r.opacity), (0x55, true, 128));
        assert_eq!(r.rgb, [255, 0, 188]);
        // The worked example of SPEC.md, section 5.3.
        let bytes: [u8; 16] = bytemuck::cast(r);
        assert_eq!(bytes, [1, 0, 2, 0, 3, 0, 128, 128, 255, 0, 188, 128, 0xbc, 0x3a, 0x12, 0xd5]);
    }

    #[test]
    fn coordinate_axes_are_exact() {
        for n in [DVec3::X, DVec3::Y, DVec3::Z, -DVec3::X, -DVec3::Y, -DVec3::Z] {
            assert_eq!(decode_axis(encode_axis(n)), n);
        }
    }

    proptest! {
        #[test]
        fn axes_stay_within_their_stated_error(v in prop::array::uniform3(-1.0f64..1.0)) {
            let n = DVec3::from_array(v).normalize_or(DVec3::X);
            let angle = decode_axis(encode_axis(n)).dot(n).min(1.0).acos().to_degrees();
            prop_assert!(angle <= 0.96, "{angle}");
        }

        #[test]
        fn every_byte_pair_decodes_to_a_unit_vector(code: [u8; 2]) {
            prop_assert!((decode_axis(code).length() - 1.0).abs() < 1e-12);
        }
    }
}
