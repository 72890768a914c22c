//! Affine placements whose translation keeps twice the bits of an `f64`.

use glam::{DMat3, DMat4, DQuat, DVec3};
use std::ops::Mul;

/// Where a mesh stands: `world = linear · local + translation`.
///
/// The translation is held as an unevaluated sum `high + low`, so that the difference of two
/// placements under a common offset (a tree placed 10⁶ units away by its root node) is the same
/// bits as without that offset: adding and subtracting the offset loses nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Rotation, scale, shear, mirror.
    pub linear: DMat3,
    high: DVec3,
    low: DVec3,
}

impl Placement {
    /// The identity.
    pub const IDENTITY: Self =
        Self { linear: DMat3::IDENTITY, high: DVec3::ZERO, low: DVec3::ZERO };

    /// A pure translation.
    pub fn from_translation(t: DVec3) -> Self {
        Self { high: t, ..Self::IDENTITY }
    }

    /// Scale, then rotate, then translate (a glTF node).
    pub fn from_trs(translation: DVec3, rotation: DQuat, scale: DVec3) -> Self {
        let linear = DMat3::from_quat(rotation) * DMat3::from_diagonal(scale);
        Self { linear, high: translation, low: DVec3::ZERO }
    }

    /// From an affine 4×4 matrix; its last row is taken to be `0 0 0 1`.
    pub fn from_mat4(m: DMat4) -> Self {
        Self { linear: DMat3::from_mat4(m), high: m.w_axis.truncate(), low: DVec3::ZERO }
    }

    /// The translation, rounded to `f64`.
    pub fn translation(&self) -> DVec3 {
        self.high + self.low
    }

    /// `self.translation − other.translation`, exact to about 10⁻³² of the larger.
    pub fn translation_from(&self, other: &Placement) -> DVec3 {
        let (s, e) = two_sum(self.high, -other.high);
        s + (e + (self.low - other.low))
    }

    /// Whether every number of the placement is finite.
    pub fn is_finite(&self) -> bool {
        self.linear.is_finite() && self.high.is_finite() && self.low.is_finite()
    }

    /// Whether the placement turns a left hand into a right hand.
    pub fn is_mirrored(&self) -> bool {
        self.linear.determinant() < 0.0
    }
}

impl Mul for Placement {
    type Output = Placement;

    /// `(self · child)(p) = self(child(p))`.
    fn mul(self, child: Placement) -> Placement {
        let moved = self.linear * child.high;
        let (s, e) = two_sum(self.high, moved);
        let low = e + (self.low + self.linear * child.low);
        let (high, low) = two_sum(s, low);
        Placement { linear: self.linear * child.linear, high, low }
    }
}

/// Knuth's error-free sum: `a + b = s + e` exactly, per component.
fn two_sum(a: DVec3, b: DVec3) -> (DVec3, DVec3) {
    let s = a + b;
    let bb = s - a;
    (s, (a - (s - bb)) + (b - bb))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_under_a_far_parent_are_the_bits_of_the_near_ones() {
        let local = [DVec3::new(0.1, 0.2, 0.3), DVec3::new(1.7, -2.3, 1e-7)];
        let under = |root: DVec3| {
            let [a, b] =
                local.map(|t| Placement::from_translation(root) * Placement::from_translation(t));
            b.translation_from(&a)
        };
        assert_eq!(under(DVec3::new(1e6, -3e5, 123.456)), under(DVec3::ZERO));
    }

    #[test]
    fn product_applies_the_child_first() {
        let turn = Placement::from_trs(
            DVec3::X,
            DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2),
            DVec3::splat(2.0),
        );
        let p = turn * Placement::from_translation(DVec3::new(1.0, 0.0, 0.0));
        assert!((p.translation() - DVec3::new(1.0, 2.0, 0.0)).length() < 1e-15);
        assert!(!p.is_mirrored());
        let mirror = Placement::from_trs(DVec3::ZERO, DQuat::IDENTITY, DVec3::new(-1.0, 1.0, 1.0));
        assert!((p * mirror).is_mirrored());
    }
}
