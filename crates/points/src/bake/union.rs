//! How much of each other a few points hide, measured.
//!
//! Pairs at a distance obey [`crate::bake::node`]'s law, but leaves come in sprays, and two-sided leaves
//! as two coincident sheets: what they hide of each other is many times what independent ones
//! would. So whenever a subtree has gathered a few points that were not looked at together, their
//! union is sampled: from directions in turn, a sample on each point counts as much of its area as
//! the points before it leave open. That is the area of the union *as renderers draw it*, with
//! opacity as independent cover; the subtree then stands for one point with that covered area.

use crate::bake::node::Node;
use crate::spheroid::Footprint;
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;
use std::sync::LazyLock;

/// Points that are looked at together: at least this many, and less than twice as many.
pub(crate) const GATHERED: usize = 4;

/// View directions of one measurement.
const DIRECTIONS: u32 = 4;

/// A point as seen from a direction.
struct Seen {
    footprint: Footprint,
    opacity: f64,
}

impl Seen {
    fn of(node: &Node, v: DVec3, right: DVec3, up: DVec3) -> Self {
        let center = DVec2::new(node.center.dot(right), node.center.dot(up));
        let (radius, step) = (node.own.radius(), node.flatness);
        let footprint = Footprint::new(center, radius, step, node.axis, v, [right, up]);
        Self { footprint, opacity: node.cover() }
    }

    /// Covered area, over π.
    fn area(&self) -> f64 {
        self.footprint.radius * self.footprint.radius * self.footprint.ratio * self.opacity
    }

    /// The point of the ellipse at point `d` of the unit disc.
    fn sample(&self, d: DVec2) -> DVec2 {
        let Footprint { center, radius, minor, ratio } = self.footprint;
        let d = d * radius;
        center + minor * (d.x * ratio) + minor.perp() * d.y
    }

    fn contains(&self, p: DVec2) -> bool {
        self.footprint.contains(p)
    }
}

/// Mean covered area of the union of `nodes` over view directions; `seed` varies the samples.
pub(crate) fn covered(nodes: &[Node], seed: u32) -> f64 {
    let sum: f64 = nodes.iter().map(|n| n.covered).sum();
    let (mut open, mut all) = (0.0, 0.0);
    let mut seen: Vec<Seen> = Vec::with_capacity(nodes.len());
    for k in 0..DIRECTIONS {
        let View { v, right, up } =
            VIEWS[(seed.wrapping_mul(DIRECTIONS).wrapping_add(k) % TABLE) as usize];
        seen.clear();
        for (i, node) in (0u32..).zip(nodes) {
            let this = Seen::of(node, v, right, up);
            let area = this.area();
            let sample = seed.wrapping_add(i * DIRECTIONS + k) % TABLE;
            let p = this.sample(SAMPLES[sample as usize]);
            let left: f64 =
                seen.iter().filter(|s| s.contains(p)).map(|s| 1.0 - s.opacity).product();
            open += area * left;
            all += area;
            seen.push(this);
        }
    }
    if all > 0.0 { sum * open / all } else { sum }
}

/// Entries of the tables below; a power of two, so that numbers may wrap around.
const TABLE: u32 = 1024;

/// A view direction and a frame around it.
struct View {
    v: DVec3,
    right: DVec3,
    up: DVec3,
}

/// Directions that fill the half sphere evenly.
static VIEWS: LazyLock<Vec<View>> = LazyLock::new(|| {
    let view = |k: u32| {
        let [u, w] = plane_sequence(k);
        let (sin, cos) = (w * TAU).sin_cos();
        let flat = (1.0 - u * u).sqrt();
        let v = DVec3::new(flat * cos, u, flat * sin);
        let (right, up) = v.any_orthonormal_pair();
        View { v, right, up }
    };
    (0..TABLE).map(view).collect()
});

/// Points that fill the unit disc evenly.
static SAMPLES: LazyLock<Vec<DVec2>> = LazyLock::new(|| {
    let point = |k: u32| {
        let [u, w] = plane_sequence(k);
        DVec2::from_angle(w * TAU) * u.sqrt()
    };
    (0..TABLE).map(point).collect()
});

/// The R2 sequence of M. Roberts (2018): point number `k` of an even filling of the unit square.
fn plane_sequence(k: u32) -> [f64; 2] {
    // 2⁶⁴ over the plastic number and over its square.
    const STEP: [u64; 2] = [0xc13f_a9a9_02a6_328f, 0x91e1_0da5_c79e_7b1d];
    STEP.map(|s| (s.wrapping_mul(u64::from(k) + 1) >> 11) as f64 * (-53f64).exp2())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bake::surfel::Surfel;
    use crate::options::RadiusRule;

    fn leaf(at: [f32; 3], axis: DVec3) -> Node {
        let s = Surfel {
            position: at,
            axis: axis.as_vec3().to_array(),
            area: 1e-4,
            rgb: [0.5; 3],
            opacity: 1.0,
        };
        Node::of_surfel(&s, RadiusRule::Opacity)
    }

    fn mean(nodes: &[Node]) -> f64 {
        (0..500).map(|seed| covered(nodes, seed * 7)).sum::<f64>() / 500.0
    }

    #[test]
    fn leaves_apart_cover_their_sum_and_coincident_ones_cover_one() {
        let apart: Vec<Node> = (0..4).map(|i| leaf([i as f32, 0.0, 0.0], DVec3::Z)).collect();
        assert!((mean(&apart) / 2e-4 - 1.0).abs() < 0.01);
        // Front and back of one leaf, twice.
        let same = vec![leaf([0.0; 3], DVec3::Z); 4];
        assert!((mean(&same) / 0.5e-4 - 1.0).abs() < 0.01, "{}", mean(&same));
    }

    #[test]
    fn half_opaque_points_hide_half_as_much() {
        let half = Surfel {
            position: [0.0; 3],
            axis: [0.0, 0.0, 1.0],
            area: 1e-4,
            rgb: [0.5; 3],
            opacity: 0.5,
        };
        let nodes = vec![Node::of_surfel(&half, RadiusRule::Opacity); 2];
        // 1 − ½·½ of the footprint, whose mean is half its area.
        assert!((mean(&nodes) / (0.75 * 0.5e-4) - 1.0).abs() < 0.02, "{}", mean(&nodes));
    }

    #[test]
    fn crossed_leaves_agree_with_a_fine_count() {
        // Two crossing discs: union by counting a grid of rays from many directions.
        let nodes = [leaf([0.0; 3], DVec3::Z), leaf([0.001, 0.0, 0.0], DVec3::X)];
        let r = nodes[0].own.radius();
        let (mut hits, n, directions) = (0u32, 60, 400);
        for k in 0..directions {
            let View { v, right, up } = VIEWS[k as usize];
            let seen = nodes.each_ref().map(|n| Seen::of(n, v, right, up));
            for i in 0..n * n {
                let at = |i: u32| (f64::from(i) + 0.5) / f64::from(n) * 4.0 * r - 2.0 * r;
                let p = DVec2::new(at(i % n), at(i / n));
                hits += u32::from(seen.iter().any(|s| s.contains(p)));
            }
        }
        let truth = f64::from(hits) / f64::from(n * n * directions) * 16.0 * r * r;
        assert!((mean(&nodes) / truth - 1.0).abs() < 0.02, "{} {truth}", mean(&nodes));
    }
}
