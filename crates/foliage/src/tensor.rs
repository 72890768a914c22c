//! Which way surfaces face, without a sign: the area-weighted tensor of normals.

use glam::{DMat3, DVec3};
use nalgebra::{Matrix3, SymmetricEigen};

/// The sum of area · n nᵀ over triangles, and of their areas.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct NormalTensor {
    sum: DMat3Sum,
    pub(crate) area: f64,
}

type DMat3Sum = [f64; 6];

impl NormalTensor {
    /// Adds a triangle by the cross product of two of its edges.
    pub(crate) fn add(&mut self, cross: DVec3) {
        let length = cross.length();
        if length > 0.0 {
            let (n, area) = (cross / length, 0.5 * length);
            let products = [n.x * n.x, n.y * n.y, n.z * n.z, n.x * n.y, n.x * n.z, n.y * n.z];
            for (s, p) in self.sum.iter_mut().zip(products) {
                *s += area * p;
            }
            self.area += area;
        }
    }

    /// Shares of the area that face along the axes, largest first, and the axes: a right-handed frame.
    /// Without any area, a third each along x, y and z.
    pub(crate) fn axes(&self) -> ([f64; 3], DMat3) {
        if self.area <= 0.0 {
            return ([1.0 / 3.0; 3], DMat3::IDENTITY);
        }
        principal_axes(self.sum.map(|v| v / self.area))
    }
}

/// Eigenvalues, largest first, and unit eigenvectors (a right-handed frame) of the symmetric matrix
/// with elements xx, yy, zz, xy, xz, yz.
pub(crate) fn principal_axes([xx, yy, zz, xy, xz, yz]: [f64; 6]) -> ([f64; 3], DMat3) {
    let eigen = SymmetricEigen::new(Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz));
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let axis = |k: usize| {
        let v = eigen.eigenvectors.column(order[k]);
        let v = DVec3::new(v[0], v[1], v[2]);
        // The sign means nothing: the same one on every machine.
        let largest = v.to_array().into_iter().max_by(|a, b| a.abs().total_cmp(&b.abs()));
        if largest.is_some_and(|l| l < 0.0) { -v } else { v }
    };
    let (a, b) = (axis(0), axis(1));
    (order.map(|k| eigen.eigenvalues[k].max(0.0)), DMat3::from_cols(a, b, a.cross(b)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_card_faces_one_way_and_a_tube_two() {
        let mut card = NormalTensor::default();
        card.add(DVec3::Z * 2.0);
        card.add(DVec3::Z * -2.0);
        let (shares, axes) = card.axes();
        assert!((shares[0] - 1.0).abs() < 1e-12 && (axes.x_axis.z.abs() - 1.0).abs() < 1e-12);
        let mut tube = NormalTensor::default();
        (0..12).for_each(|i| {
            let angle = f64::from(i) * std::f64::consts::TAU / 12.0;
            tube.add(DVec3::new(angle.cos(), 0.0, angle.sin()));
        });
        let (shares, axes) = tube.axes();
        assert!((shares[0] - 0.5).abs() < 1e-9 && (shares[1] - 0.5).abs() < 1e-9);
        assert!((axes.z_axis.y.abs() - 1.0).abs() < 1e-9);
        assert_eq!(NormalTensor::default().axes().0, [1.0 / 3.0; 3]);
    }
}
