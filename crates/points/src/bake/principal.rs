//! Covariance and its principal axis (Gilet et al. 2005, equation 1).

use glam::DVec3;
use nalgebra::{Matrix3, SymmetricEigen};

/// Sums of points about a local origin, in `f64`: enough for centroid and covariance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Moments {
    pub(crate) count: f64,
    /// Σ d.
    first: [f64; 3],
    /// Σ d·dᵀ: xx, yy, zz, xy, xz, yz.
    second: [f64; 6],
}

impl Moments {
    /// Adds `point − origin` if `keep` is 1, nothing if it is 0.
    #[inline(always)]
    pub(crate) fn add(&mut self, d: [f64; 3], keep: f64) {
        let [x, y, z] = d.map(|v| v * keep);
        self.count += keep;
        self.first[0] += x;
        self.first[1] += y;
        self.first[2] += z;
        // keep² = keep.
        self.second[0] += x * x;
        self.second[1] += y * y;
        self.second[2] += z * z;
        self.second[3] += x * y;
        self.second[4] += x * z;
        self.second[5] += y * z;
    }

    /// The sums of the points that are in `self` but not in `part`.
    pub(crate) fn without(&self, part: &Moments) -> Self {
        Self {
            count: self.count - part.count,
            first: std::array::from_fn(|i| self.first[i] - part.first[i]),
            second: std::array::from_fn(|i| self.second[i] - part.second[i]),
        }
    }

    /// Centroid about the local origin.
    pub(crate) fn mean(&self) -> DVec3 {
        DVec3::from_array(self.first) / self.count
    }

    /// Covariance: xx, yy, zz, xy, xz, yz; `None` where the local origin is so far from the points
    /// that less than half of the digits would be left.
    pub(crate) fn covariance(&self) -> Option<[f64; 6]> {
        let m = self.mean();
        let s = self.second.map(|v| v / self.count);
        let c = [
            s[0] - m.x * m.x,
            s[1] - m.y * m.y,
            s[2] - m.z * m.z,
            s[3] - m.x * m.y,
            s[4] - m.x * m.z,
            s[5] - m.y * m.z,
        ];
        (c[0] + c[1] + c[2] > 1e-8 * (s[0] + s[1] + s[2])).then_some(c)
    }
}

/// Eigenvector of the largest eigenvalue of a symmetric matrix, by an iterative solver.
///
/// The first of equal eigenvalues wins, and the sign is the one with the largest component
/// positive, so that the same matrix gives the same axis everywhere. The zero matrix gives X.
pub(crate) fn principal_axis(c: [f64; 6]) -> DVec3 {
    let scale = c[0].max(c[1]).max(c[2]);
    if scale.is_nan() || scale <= 0.0 {
        return DVec3::X;
    }
    let [xx, yy, zz, xy, xz, yz] = c.map(|v| v / scale);
    let eigen = SymmetricEigen::new(Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz));
    let values = eigen.eigenvalues;
    let largest = (0..3).fold(0, |best, i| if values[i] > values[best] { i } else { best });
    let v = eigen.eigenvectors.column(largest);
    let v = DVec3::new(v[0], v[1], v[2]);
    let main = (0..3).fold(0, |best, i| if v[i].abs() > v[best].abs() { i } else { best });
    if v[main] < 0.0 { -v } else { v }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn covariance_of(points: &[[f64; 3]]) -> Option<[f64; 6]> {
        let mut m = Moments::default();
        points.iter().for_each(|&p| m.add(p, 1.0));
        m.covariance()
    }

    #[test]
    fn collinear_points_give_their_line() {
        // Rank one: closed forms give NaN here.
        let d = DVec3::new(1.0, -2.0, 0.5).normalize();
        let points: Vec<[f64; 3]> = (0..7).map(|i| (d * f64::from(i)).to_array()).collect();
        let axis = principal_axis(covariance_of(&points).unwrap());
        assert!(axis.dot(d).abs() > 1.0 - 1e-12, "{axis}");
    }

    #[test]
    fn equal_points_and_equal_eigenvalues_give_a_fixed_axis() {
        assert_eq!(covariance_of(&[[0.25; 3]; 5]), None);
        assert_eq!(principal_axis([0.0; 6]), DVec3::X);
        let a = principal_axis([2.0, 2.0, 2.0, 0.0, 0.0, 0.0]);
        assert!(a.is_normalized());
        assert_eq!(a, principal_axis([2.0, 2.0, 2.0, 0.0, 0.0, 0.0]));
    }

    #[test]
    fn a_far_origin_is_noticed() {
        let near: Vec<[f64; 3]> = (0..9).map(|i| [f64::from(i) * 1e-3, 0.0, 0.0]).collect();
        let far: Vec<[f64; 3]> = near.iter().map(|p| [p[0] + 1e6, 0.0, 0.0]).collect();
        assert!(covariance_of(&near).is_some());
        assert_eq!(covariance_of(&far), None);
    }

    proptest! {
        /// No direction has more variance than the principal axis, and it is an eigenvector.
        #[test]
        fn axis_is_an_eigenvector_of_the_largest_variance(
            points in prop::collection::vec(prop::array::uniform3(-1.0f64..1.0), 2..20),
            stretch in prop::array::uniform3(prop::sample::select(vec![0.0, 1e-6, 1e-3, 1.0])),
        ) {
            let points: Vec<[f64; 3]> =
                points.iter().map(|p| std::array::from_fn(|i| p[i] * stretch[i])).collect();
            let Some(c) = covariance_of(&points) else { return Ok(()) };
            let [xx, yy, zz, xy, xz, yz] = c;
            let axis = principal_axis(c);
            let image = DVec3::new(
                xx * axis.x + xy * axis.y + xz * axis.z,
                xy * axis.x + yy * axis.y + yz * axis.z,
                xz * axis.x + yz * axis.y + zz * axis.z,
            );
            let lambda = axis.dot(image);
            prop_assert!((image - axis * lambda).length() <= 1e-9 * (xx + yy + zz));
            prop_assert!(lambda >= xx.max(yy).max(zz) * (1.0 - 1e-9));
        }
    }
}
