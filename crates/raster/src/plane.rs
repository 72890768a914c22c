//! Linear functions over the picture, and the edges of triangles.

use glam::DVec2;

/// f(x, y) = x·`x` + y·`y` + `c` over picture coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Plane {
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) c: f64,
}

impl Plane {
    #[inline]
    pub(crate) fn at(&self, x: f64, y: f64) -> f64 {
        self.x * x + self.y * y + self.c
    }

    /// Value at a pixel's corner and steps along x and y, for the samples within it: small numbers
    /// that single precision holds well.
    #[inline]
    pub(crate) fn within(&self, x: u32, y: u32) -> [f32; 3] {
        [self.at(f64::from(x), f64::from(y)) as f32, self.x as f32, self.y as f32]
    }
}

/// The edge functions of a triangle: number k is ≥ 0 on the inner side of the edge opposite to
/// corner k. On an edge that two triangles share they are each other's exact negatives, so that
/// no sample falls between the triangles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Edges {
    pub(crate) planes: [Plane; 3],
    /// 1 / (twice the area).
    scale: f64,
}

impl Edges {
    /// `None` for a triangle without area in the picture, or with corners that are not finite.
    pub(crate) fn new([a, b, c]: [DVec2; 3]) -> Option<Self> {
        let area = (b - a).perp_dot(c - a);
        if !area.is_finite() || area == 0.0 {
            return None;
        }
        let planes = [(b, c), (c, a), (a, b)].map(|(u, v)| edge(u, v, area.signum()));
        Some(Self { planes, scale: 1.0 / area.abs() })
    }

    /// Barycentric coordinates.
    pub(crate) fn weights(&self, x: f64, y: f64) -> [f64; 3] {
        self.planes.map(|p| p.at(x, y) * self.scale)
    }

    /// The linear function with these values at the corners.
    pub(crate) fn interpolate(&self, values: [f64; 3]) -> Plane {
        // About the mean: the values may be large and close together.
        let mean = (values[0] + values[1] + values[2]) / 3.0;
        let mut sum = Plane { x: 0.0, y: 0.0, c: mean };
        for (p, v) in self.planes.iter().zip(values) {
            let w = (v - mean) * self.scale;
            sum = Plane { x: sum.x + p.x * w, y: sum.y + p.y * w, c: sum.c + p.c * w };
        }
        sum
    }
}

/// (v − u) × (p − u), computed from the lower of both ends whichever way the edge is walked.
fn edge(u: DVec2, v: DVec2, sign: f64) -> Plane {
    let swap = (v.x, v.y) < (u.x, u.y);
    let (from, to, sign) = if swap { (v, u, -sign) } else { (u, v, sign) };
    let d = to - from;
    Plane { x: -d.y * sign, y: d.x * sign, c: (d.y * from.x - d.x * from.y) * sign }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_barycentric_for_both_windings() {
        let corners = [DVec2::new(1.0, 2.0), DVec2::new(7.0, 3.0), DVec2::new(2.0, 9.0)];
        let p = (corners[0] * 0.2) + (corners[1] * 0.5) + (corners[2] * 0.3);
        let [a, b, c] = corners;
        let w = Edges::new([a, b, c]).unwrap().weights(p.x, p.y);
        for (got, want) in w.iter().zip([0.2, 0.5, 0.3]) {
            assert!((got - want).abs() < 1e-12);
        }
        let w = Edges::new([a, c, b]).unwrap().weights(p.x, p.y);
        assert!((w[1] - 0.3).abs() < 1e-12);
        assert!(Edges::new([a, b, (a + b) * 0.5]).is_none_or(|e| e.scale > 1e12));
        assert_eq!(Edges::new([a, b, DVec2::splat(f64::NAN)]), None);
    }

    #[test]
    fn shared_edges_are_exact_negatives() {
        let (a, b) = (DVec2::new(0.1, 0.7), DVec2::new(12.3, 5.1));
        let (c, d) = (DVec2::new(3.3, 9.9), DVec2::new(8.0, -4.2));
        let (one, two) = (Edges::new([a, b, c]).unwrap(), Edges::new([b, a, d]).unwrap());
        let (p, q) = (one.planes[2], two.planes[2]);
        assert_eq!((p.x, p.y, p.c), (-q.x, -q.y, -q.c));
    }

    #[test]
    fn interpolation_meets_the_corners() {
        let corners = [DVec2::new(1.0, 2.0), DVec2::new(7.0, 3.0), DVec2::new(2.0, 9.0)];
        let plane = Edges::new(corners).unwrap().interpolate([1e6, 1e6 + 1.0, 1e6 - 3.0]);
        for (p, want) in corners.iter().zip([1e6, 1e6 + 1.0, 1e6 - 3.0]) {
            assert!((plane.at(p.x, p.y) - want).abs() < 1e-8);
        }
    }
}
