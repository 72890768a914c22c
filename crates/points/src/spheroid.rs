//! The shape of a point: an oblate spheroid.
//!
//! A point is a spheroid with semi-axes (r, r, r·flatness) about its axis: a disc (flatness 0)
//! where its surfels are parallel, a sphere (flatness 1) where they have no common direction. Seen
//! from a direction at angle θ to the axis it covers the ellipse with semi-axes r and
//! r·√(cos²θ + f²·sin²θ), of area π·r²·that root: for a disc exactly the |cos θ| law of a triangle,
//! so that a surfel of radius √(A/π) covers what its triangle of area A covers, *from every
//! direction*, and A/2 on average (Cauchy). A sphere of the paper's kind would need √(A/2π) and
//! be right on average only.

use glam::{DVec2, DVec3};
use std::f64::consts::PI;
use std::sync::LazyLock;

/// Steps of the quantised flatness: 0 is a disc, `STEPS` a sphere.
pub const STEPS: u8 = 127;

/// Ratio of the spheroid's footprint from a direction to that from along its axis:
/// √(cos² + flatness²·sin²).
#[inline]
pub fn footprint_ratio(flatness: f64, cos: f64) -> f64 {
    let c2 = (cos * cos).min(1.0);
    (c2 + flatness * flatness * (1.0 - c2)).sqrt()
}

/// Mean of [`footprint_ratio`] over all directions: a quarter of the spheroid's surface over π·r²
/// (Cauchy's formula), ½·(1 + f²/ε·artanh ε) with ε = √(1 − f²). From ½ (disc) to 1 (sphere).
pub fn mean_ratio(flatness: f64) -> f64 {
    let eps = (1.0 - flatness * flatness).max(0.0).sqrt();
    // artanh(ε)/ε → 1 as ε → 0; at ε = 1 the factor f² wins.
    let factor = if eps < 1e-6 {
        1.0
    } else if flatness == 0.0 {
        0.0
    } else {
        eps.atanh() / eps
    };
    0.5 * (1.0 + flatness * flatness * factor)
}

static MEAN_RATIOS: LazyLock<[f64; STEPS as usize + 1]> =
    LazyLock::new(|| std::array::from_fn(|k| mean_ratio(k as f64 / f64::from(STEPS))));

/// Flatness of quantised step `k ≤ STEPS`.
#[inline]
pub fn flatness(k: u8) -> f64 {
    f64::from(k) / f64::from(STEPS)
}

/// [`mean_ratio`] of quantised step `k ≤ STEPS`.
#[inline]
pub fn mean_ratio_of_step(k: u8) -> f64 {
    MEAN_RATIOS[k as usize]
}

/// The quantised flatness for surfels whose areas have alignment `t` = Σ w·(nᵢ·a)² / Σ w about the
/// axis a.
///
/// The surfels' mean |nᵢ·a| is taken to be ¼ + ¾·t, exact for parallel (t = 1) and for isotropic
/// (t = ⅓) ones; the flatness is then the one whose mean over directions and view along the axis
/// are in the surfels' ratio ½ : mean |nᵢ·a|.
pub fn step_for_alignment(t: f64) -> u8 {
    let ratio = 2.0 / (1.0 + 3.0 * t.clamp(1.0 / 3.0, 1.0));
    let above = MEAN_RATIOS.partition_point(|&g| g < ratio).min(STEPS as usize);
    let below = above.saturating_sub(1);
    let nearer_below = ratio - MEAN_RATIOS[below] < MEAN_RATIOS[above] - ratio;
    (if nearer_below { below } else { above }) as u8
}

/// Mean projected area of a spheroid of radius `r`, quantised flatness `k` and opacity `o`.
#[inline]
pub fn mean_projected_area(r: f64, k: u8, o: f64) -> f64 {
    PI * r * r * mean_ratio_of_step(k) * o
}

/// The ellipse that a spheroid covers in a picture plane: what renderers fill, and what the baker
/// measures unions with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footprint {
    /// Middle, in the plane's coordinates.
    pub center: DVec2,
    /// Larger semi-axis.
    pub radius: f64,
    /// Unit direction of the smaller semi-axis.
    pub minor: DVec2,
    /// Smaller over larger semi-axis, > 0.
    pub ratio: f64,
}

/// A disc seen edge-on still has this ratio: dividing by it must not overflow.
pub const THINNEST: f64 = 1e-6;

impl Footprint {
    /// Of a spheroid of quantised flatness `step` about unit vector `axis`, seen from unit direction
    /// `to_eye`; `x` and `y` are the unit vectors of the plane.
    pub fn new(
        center: DVec2,
        radius: f64,
        step: u8,
        axis: DVec3,
        to_eye: DVec3,
        [x, y]: [DVec3; 2],
    ) -> Self {
        // The disc is foreshortened along the projection of its axis.
        let minor = DVec2::new(axis.dot(x), axis.dot(y)).normalize_or(DVec2::X);
        let ratio = footprint_ratio(flatness(step), axis.dot(to_eye)).max(THINNEST);
        Self { center, radius, minor, ratio }
    }

    /// Whether the ellipse contains `p`.
    #[inline]
    pub fn contains(&self, p: DVec2) -> bool {
        let d = p - self.center;
        let along = d.dot(self.minor);
        d.length_squared() + along * along * (1.0 / (self.ratio * self.ratio) - 1.0)
            <= self.radius * self.radius
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_ratio_is_the_integral_over_directions() {
        for f in [0.0, 0.05, 0.3, 0.7, 0.999, 1.0] {
            // ∫₀¹ √(c² + f²(1 − c²)) dc by the midpoint rule.
            let n = 100_000;
            let sum: f64 =
                (0..n).map(|i| footprint_ratio(f, (f64::from(i) + 0.5) / f64::from(n))).sum();
            assert!((sum / f64::from(n) - mean_ratio(f)).abs() < 1e-8, "{f}");
        }
    }

    #[test]
    fn a_footprint_covers_its_area() {
        let axis = DVec3::new(0.4, -0.3, 0.866).normalize();
        let f = Footprint::new(DVec2::ZERO, 2.0, 30, axis, DVec3::Z, [DVec3::X, DVec3::Y]);
        let (n, mut inside) = (1000, 0);
        for i in 0..n * n {
            let at = |i: i32| (f64::from(i) + 0.5) / f64::from(n) * 5.0 - 2.5;
            let p = DVec2::new(at(i % n), at(i / n));
            inside += i32::from(f.contains(p));
        }
        let area = f64::from(inside) * 25.0 / f64::from(n * n);
        let want = PI * 4.0 * footprint_ratio(flatness(30), axis.z);
        assert!((area / want - 1.0).abs() < 1e-3, "{area} {want}");
    }

    #[test]
    fn parallel_surfels_make_a_disc_and_isotropic_ones_a_sphere() {
        assert_eq!(step_for_alignment(1.0), 0);
        assert_eq!(step_for_alignment(1.0 / 3.0), STEPS);
        assert_eq!(step_for_alignment(0.0), STEPS);
        let middle = step_for_alignment(2.0 / 3.0);
        // mean |cos| = ¾ → ratio ⅔.
        assert!((mean_ratio_of_step(middle) - 2.0 / 3.0).abs() < 0.005);
    }
}
