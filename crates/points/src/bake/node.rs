//! What a node of the cluster tree knows of the surfels under it, and how children become one
//! point.
//!
//! Position and colour are averages weighted by covered area; axes are averaged undirected, so
//! that opposite leaf faces do not cancel. The rules of [`RadiusRule`]:
//!
//! * `Opacity`, `Area`: the radius follows the spread. A spheroid drawn as a uniform ellipse has a
//!   mean projected second moment of r²·(2 + f²)/6; the surfels' is ⅔·σ², σ² being their
//!   mean squared distance from the centroid, their own extents (r²/2 for a disc) included. So
//!   r² = 4·σ²/(2 + f²). The opacity is what is left: covered area over footprint.
//! * Covered area, under `Area`, is the sum over children. Under `Opacity` it is the mean, over all
//!   view directions, of the projected *union*: measured ([`crate::bake::union`]) once a few points have
//!   come together, and by a law of pairs ([`mean_overlap`]) below that.
//! * `Paper`: section 4.2 of Gilet et al. 2005, spheres of radius
//!   R = 2/π·(Rm + α·(RM − Rm)), RM = Rl + Rr, Rm = (Rl + Rr)/2, α = |Nl·Nr|.

use crate::bake::surfel::{Surfel, axis_of};
use crate::options::RadiusRule;
use crate::size::SizeCode;
use crate::spheroid;
use glam::DVec3;
use std::f64::consts::PI;

/// The state of a node, in block space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Node {
    /// Covered surface: Σ opacity·area of the surfels.
    pub(crate) weight: f64,
    /// Weighted centroid.
    pub(crate) center: DVec3,
    /// Σ weight·|p − center|², own extents included.
    spread: f64,
    /// Σ weight·rgb.
    color: DVec3,
    /// Σ weight·n·nᵀ: xx, yy, zz, xy, xz, yz.
    orientation: [f64; 6],
    /// Unit axis; its sign means nothing.
    pub(crate) axis: DVec3,
    /// Mean over directions of the projected covered area.
    pub(crate) covered: f64,
    /// Radius by the rule, before quantisation.
    radius: f64,
    /// The code of the drawn footprint; never smaller than a child's under our rules.
    pub(crate) own: SizeCode,
    /// Quantised flatness.
    pub(crate) flatness: u8,
}

impl Node {
    /// A surfel as a node.
    pub(crate) fn of_surfel(s: &Surfel, rule: RadiusRule) -> Self {
        let area = f64::from(s.area);
        let opacity = f64::from(s.opacity);
        let weight = area * opacity;
        let axis = axis_of(s);
        let n = axis;
        let orientation =
            [n.x * n.x, n.y * n.y, n.z * n.z, n.x * n.y, n.x * n.z, n.y * n.z].map(|v| v * weight);
        let (radius, flatness) = match rule {
            // The sphere whose projected area is the triangle's mean: π·r² = A/2.
            RadiusRule::Paper => ((area / (2.0 * PI)).sqrt(), spheroid::STEPS),
            RadiusRule::Opacity | RadiusRule::Area => (s.radius(), 0),
        };
        let [x, y, z] = s.position.map(f64::from);
        Self {
            weight,
            center: DVec3::new(x, y, z),
            spread: weight * area / (2.0 * PI),
            color: DVec3::from_array(s.rgb.map(f64::from)) * weight,
            orientation,
            axis,
            covered: 0.5 * weight,
            radius,
            own: SizeCode::at_least(PI * radius * radius),
            flatness,
        }
    }

    /// One point for all `children` (at least two). `measured` is their covered area where it
    /// is known better than by the law of pairs; with `raise` the point is no smaller than a child.
    pub(crate) fn merged(
        children: &[Node],
        rule: RadiusRule,
        raise: bool,
        measured: Option<f64>,
    ) -> Self {
        let weight: f64 = children.iter().map(|c| c.weight).sum();
        let center = children.iter().map(|c| c.center * c.weight).sum::<DVec3>() / weight;
        let spread: f64 =
            children.iter().map(|c| c.spread + c.weight * c.center.distance_squared(center)).sum();
        let mut orientation = [0.0; 6];
        for c in children {
            for (sum, v) in orientation.iter_mut().zip(c.orientation) {
                *sum += v;
            }
        }
        let axis = undirected_mean(children);
        let mut node = Self {
            weight,
            center,
            spread,
            color: children.iter().map(|c| c.color).sum(),
            orientation,
            axis,
            covered: 0.0,
            radius: 0.0,
            own: SizeCode::MIN,
            flatness: spheroid::STEPS,
        };
        let largest = children.iter().map(|c| c.own).max().unwrap_or(SizeCode::MIN);
        let size = if rule == RadiusRule::Paper {
            node.radius = paper_radius(children);
            node.covered = PI * node.radius * node.radius;
            SizeCode::at_least(node.covered)
        } else {
            node.flatness = spheroid::step_for_alignment(node.alignment());
            node.covered = measured.unwrap_or_else(|| covered_area(children, rule));
            let f = spheroid::flatness(node.flatness);
            let by_spread = 4.0 * spread / (weight * (2.0 + f * f));
            let by_area = node.covered / (PI * spheroid::mean_ratio_of_step(node.flatness));
            node.radius = by_spread.max(by_area).sqrt();
            SizeCode::at_least(PI * node.radius * node.radius)
        };
        node.own = if raise { size.max(largest) } else { size };
        node
    }

    /// Linear RGB.
    pub(crate) fn rgb(&self) -> [f32; 3] {
        (self.color / self.weight).as_vec3().to_array()
    }

    /// Opacity that keeps the covered area on the footprint that is drawn.
    pub(crate) fn opacity(&self, rule: RadiusRule) -> f64 {
        match rule {
            RadiusRule::Paper => 1.0,
            RadiusRule::Opacity | RadiusRule::Area => self.cover(),
        }
    }

    /// Opacity of the drawn footprint under our rules.
    pub(crate) fn cover(&self) -> f64 {
        let footprint = spheroid::mean_projected_area(self.own.radius(), self.flatness, 1.0);
        (self.covered / footprint).min(1.0)
    }

    /// Share of the surfels' area that faces along the axis: Σ w·(n·a)² / Σ w.
    fn alignment(&self) -> f64 {
        let [xx, yy, zz, xy, xz, yz] = self.orientation;
        let a = self.axis;
        let along = xx * a.x * a.x
            + yy * a.y * a.y
            + zz * a.z * a.z
            + 2.0 * (xy * a.x * a.y + xz * a.x * a.z + yz * a.y * a.z);
        along / (xx + yy + zz)
    }

    /// Covered area seen along unit direction `d`.
    fn covered_along(&self, d: DVec3) -> f64 {
        let f = spheroid::flatness(self.flatness);
        let ratio = spheroid::footprint_ratio(f, self.axis.dot(d));
        self.covered * ratio / spheroid::mean_ratio_of_step(self.flatness)
    }
}

/// Mean axis: signs turned to the heaviest child's (the first of equals).
fn undirected_mean(children: &[Node]) -> DVec3 {
    let heaviest =
        children.iter().fold(&children[0], |best, c| if c.weight > best.weight { c } else { best });
    let sum: DVec3 = children
        .iter()
        .map(|c| c.axis * if c.axis.dot(heaviest.axis) < 0.0 { -c.weight } else { c.weight })
        .sum();
    sum.normalize_or(heaviest.axis)
}

/// The paper's radius, children folded in order.
fn paper_radius(children: &[Node]) -> f64 {
    let mut radius = children[0].radius;
    let mut axis = children[0].axis;
    for c in &children[1..] {
        let (most, least) = (radius + c.radius, 0.5 * (radius + c.radius));
        radius = 2.0 / PI * (least + axis.dot(c.axis).abs() * (most - least));
        axis = (axis + c.axis * axis.dot(c.axis).signum()).normalize_or(axis);
    }
    radius
}

/// Covered area of a cluster: the sum, less what its children hide of each other.
fn covered_area(children: &[Node], rule: RadiusRule) -> f64 {
    let sum: f64 = children.iter().map(|c| c.covered).sum();
    if rule == RadiusRule::Area {
        return sum;
    }
    let mut hidden = 0.0;
    for (i, a) in children.iter().enumerate() {
        for b in &children[..i] {
            hidden += mean_overlap(a, b);
        }
    }
    let most = children.iter().map(|c| c.covered).fold(0.0, f64::max);
    (sum - hidden).max(most)
}

/// The area that two clusters hide of each other, averaged over all view directions.
///
/// They overlap only in views along the line between them. Over all directions, a pair at distance
/// d ≫ r passes in front of each other for the solid angle 2·F/d² of 4π, and then covers the
/// product of both opacities: in the mean C₁·C₂/(2·π·d²), with the covered areas C as seen *along
/// that line* – coplanar surfels of one surface hide nothing. Near by, d² + r² stands for d²
/// (r the larger radius): halves of a solid cube then get 0.27 of a face, which is the integral.
fn mean_overlap(a: &Node, b: &Node) -> f64 {
    let between = b.center - a.center;
    let d2 = between.length_squared();
    let r2 = a.radius.max(b.radius).powi(2);
    let (ca, cb) = match between.try_normalize() {
        Some(d) => (a.covered_along(d), b.covered_along(d)),
        None => (a.covered, b.covered),
    };
    (ca * cb / (2.0 * PI * (d2 + r2))).min(a.covered).min(b.covered)
}

#[cfg(test)]
mod tests;
