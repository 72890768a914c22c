//! Long thin triangles, cut across their length: twigs stay lines, not rows of beads.

use super::{Part, Piece};
use glam::Vec2;
use std::rc::Rc;

/// Triangles this many times longer than high are sliced.
const SLENDER: f64 = 3.0;

/// Most slices of a triangle.
const MOST: f64 = 4096.0;

/// A triangle along its longest edge: `corners[0]`–`corners[1]` is that edge, the apex stands over
/// it at share `apex` of its length.
pub(super) struct Slices {
    /// Corner numbers, the longest edge first.
    corners: [usize; 3],
    apex: f64,
    count: u32,
}

impl Slices {
    /// Slices as long as the triangle is high, but not shorter than the surfel size; `None` if the
    /// triangle is not slender or needs only one. `edges` are squared lengths of 0–1, 1–2, 2–0.
    pub(super) fn of(edges: [f64; 3], area: f64, size: f64) -> Option<Self> {
        let first = (0..3).fold(0, |best, k| if edges[k] > edges[best] { k } else { best });
        let corners = [first, (first + 1) % 3, (first + 2) % 3];
        let length = edges[first].sqrt();
        let height = 2.0 * area / length;
        let count = (length / height.max(size)).ceil().min(MOST);
        if length < SLENDER * height || count < 2.0 {
            return None;
        }
        // The apex's place along the edge: (|PR|² + |PQ|² − |QR|²) / 2|PQ|².
        let (pq, qr, rp) = (edges[first], edges[corners[1]], edges[corners[2]]);
        let apex = ((rp + pq - qr) / (2.0 * pq)).clamp(0.0, 1.0);
        Some(Self { corners, apex, count: count as u32 })
    }

    /// The slices, with `rgba` of a triangle within each.
    pub(super) fn cut(&self, rgba: impl Fn(Part) -> [f32; 4]) -> Rc<[Piece]> {
        let n = f64::from(self.count);
        let slices: Vec<Slice> =
            (0..self.count).map(|i| self.slice(f64::from(i) / n, f64::from(i + 1) / n)).collect();
        let largest = slices.iter().map(|s| s.area).fold(0.0, f64::max);
        let piece = |s: &Slice| {
            let corners = [(s.from, 0.0), (s.to, 0.0), (s.along, 2.0 * s.up)];
            let part = corners.map(|(t, h)| self.weights(t, h));
            Piece {
                part,
                at: self.weights(s.along, s.up).to_array(),
                area: (s.area / largest) as f32,
                rgba: rgba(part),
            }
        };
        slices.iter().map(piece).collect()
    }

    /// Area and centroid between two places along the edge, by Simpson's rule on each side of the
    /// apex: exact, the height being linear there.
    fn slice(&self, from: f64, to: f64) -> Slice {
        let middle = self.apex.clamp(from, to);
        let (mut area, mut along, mut up) = (0.0, 0.0, 0.0);
        for (a, b) in [(from, middle), (middle, to)] {
            for (t, weight) in [(a, 1.0), (0.5 * (a + b), 4.0), (b, 1.0)] {
                let w = weight * (b - a) / 6.0;
                let h = self.height(t);
                area += w * h;
                along += w * h * t;
                up += w * h * h * 0.5;
            }
        }
        Slice { from, to, area, along: along / area, up: up / area }
    }

    /// Height over the edge at share `t` of it, the apex having 1.
    fn height(&self, t: f64) -> f64 {
        if t <= self.apex && self.apex > 0.0 {
            t / self.apex
        } else if self.apex < 1.0 {
            (1.0 - t) / (1.0 - self.apex)
        } else {
            0.0
        }
    }

    /// The point at share `t` along the edge and height `h`, as weights of corners 1 and 2.
    fn weights(&self, t: f64, h: f64) -> Vec2 {
        let mut w = [0.0f64; 3];
        w[self.corners[2]] = h;
        w[self.corners[1]] = t - h * self.apex;
        w[self.corners[0]] = 1.0 - h - w[self.corners[1]];
        Vec2::new(w[1] as f32, w[2] as f32)
    }
}

struct Slice {
    from: f64,
    to: f64,
    /// In units of the triangle's length × height.
    area: f64,
    along: f64,
    up: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slices_add_up_to_the_triangle() {
        // A thin triangle of length 1 and height 0.1, its apex at 0.3.
        let edges = [1.0, 0.7f64.powi(2) + 0.01, 0.3f64.powi(2) + 0.01];
        let slices = Slices::of(edges, 0.05, 0.0).unwrap();
        assert_eq!(slices.count, 10);
        let parts: Vec<Slice> =
            (0..10).map(|i| slices.slice(f64::from(i) / 10.0, f64::from(i + 1) / 10.0)).collect();
        let area: f64 = parts.iter().map(|s| s.area).sum();
        assert!((area - 0.5).abs() < 1e-12);
        // The mean of the centroids is the triangle's: (0 + 1 + 0.3)/3 along, 1/3 up.
        let along: f64 = parts.iter().map(|s| s.area * s.along).sum::<f64>() / area;
        let up: f64 = parts.iter().map(|s| s.area * s.up).sum::<f64>() / area;
        assert!((along - 1.3 / 3.0).abs() < 1e-12 && (up - 1.0 / 3.0).abs() < 1e-12);
        let pieces = slices.cut(|_| [1.0; 4]);
        let largest = pieces.iter().map(|p| p.area).fold(0.0, f32::max);
        assert_eq!(largest, 1.0);
    }

    #[test]
    fn stout_triangles_are_not_sliced() {
        assert!(Slices::of([2.0, 1.0, 1.0], 0.5, 0.0).is_none());
        assert!(Slices::of([1.0, 0.5, 0.5], 0.01, 2.0).is_none()); // one slice is enough
    }
}
