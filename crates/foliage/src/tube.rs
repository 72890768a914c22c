//! Trunk and thick branches as tubes with as few sides and rings as their thickness in texels asks
//! for; texture coordinates follow those of the source.

use crate::branch::{Branch, OnBranch};
use crate::mesh::{Mesh, Vertex};
use forest_soup::TriangleSoup;
use glam::{DVec2, DVec3};
use std::f64::consts::{PI, TAU};

/// Sides of a tube.
const SIDES: std::ops::RangeInclusive<u32> = 3..=16;

/// How far a tube may be from the branch, in texels.
pub(crate) const TOLERANCE: f64 = 0.5;

/// A direction at right angles to the line at every point of a branch, carried along without twist.
fn carried(branch: &Branch) -> Vec<DVec3> {
    let tangent = |i: usize| {
        let (a, b) = (i.saturating_sub(1), (i + 1).min(branch.line.len() - 1));
        (branch.line[b] - branch.line[a]).normalize_or(DVec3::Y)
    };
    let mut out: Vec<DVec3> = Vec::with_capacity(branch.line.len());
    for i in 0..branch.line.len() {
        let t = tangent(i);
        let before = out.last().copied().unwrap_or_else(|| t.any_orthonormal_vector());
        out.push((before - t * before.dot(t)).normalize_or(t.any_orthonormal_vector()));
    }
    out
}

/// Numbers of the points of a line that a coarser one keeps: none left out is farther from it, in
/// place or radius, than `tolerance` (U. Ramer 1972; D. Douglas, T. Peucker 1973).
fn kept(branch: &Branch, tolerance: f64) -> Vec<usize> {
    let last = branch.line.len() - 1;
    let mut keep = vec![false; last + 1];
    (keep[0], keep[last]) = (true, true);
    let mut open = vec![(0, last)];
    while let Some((from, to)) = open.pop() {
        let (a, b) = (branch.line[from], branch.line[to]);
        let off = |i: usize| {
            let t = (branch.along[i] - branch.along[from])
                / (branch.along[to] - branch.along[from]).max(f64::MIN_POSITIVE);
            let radius = branch.radii[from] + (branch.radii[to] - branch.radii[from]) * t;
            branch.line[i].distance(a.lerp(b, t)).max((branch.radii[i] - radius).abs())
        };
        let worst = (from + 1..to).max_by(|a, b| off(*a).total_cmp(&off(*b)));
        if let Some(i) = worst.filter(|i| off(*i) > tolerance) {
            keep[i] = true;
            open.extend([(from, i), (i, to)]);
        }
    }
    (0..=last).filter(|i| keep[*i]).collect()
}

/// The sides of a tube whose flats lie no deeper than `tolerance` in it.
fn sides(radius: f64, tolerance: f64) -> u32 {
    let cos = 1.0 - tolerance / radius;
    let sides = if cos > 0.0 { (PI / cos.acos()).ceil() as u32 } else { 0 };
    sides.clamp(*SIDES.start(), *SIDES.end())
}

/// Adds the tube of a branch at texels of this size to `mesh`. `source` are its triangles in the
/// soup.
pub(crate) fn tube(
    mesh: &mut Mesh,
    branch: &Branch,
    number: u32,
    soup: &TriangleSoup,
    source: &[u32],
    texel: f64,
) {
    let tolerance = TOLERANCE * texel;
    let radius = branch.radii.iter().copied().fold(0.0, f64::max);
    let sides = sides(radius, tolerance);
    // As wide in the mean over all sides as a round tube.
    let wide = PI / (f64::from(sides) * (PI / f64::from(sides)).sin());
    let carried = carried(branch);
    let texture = Wrapping::of(branch, &carried, soup, source);
    let material = source.first().map_or(0, |&i| soup.triangle_materials[i as usize]);
    let color = mean_color(soup, source);
    let rings = kept(branch, tolerance);
    let first = mesh.vertices.len() as u32;
    for &i in &rings {
        let near = (i.saturating_sub(1), (i + 1).min(branch.line.len() - 1));
        let tangent = (branch.line[near.1] - branch.line[near.0]).normalize_or(DVec3::Y);
        let (x, y) = (carried[i], tangent.cross(carried[i]));
        for k in 0..=sides {
            let angle = TAU * f64::from(k) / f64::from(sides);
            let out = x * angle.cos() + y * angle.sin();
            mesh.vertices.push(Vertex {
                position: branch.line[i] + out * (branch.radii[i] * wide),
                normal: out,
                uv: texture.at(branch.along[i], angle),
                color,
                on: OnBranch { branch: number, at: branch.along[i] },
                skylit: 1.0,
            });
        }
    }
    for r in 0..rings.len() as u32 - 1 {
        for k in 0..sides {
            let a = first + r * (sides + 1) + k;
            let (b, c, d) = (a + 1, a + sides + 1, a + sides + 2);
            mesh.triangles.extend([([a, b, d], material), ([a, d, c], material)]);
        }
    }
}

fn mean_color(soup: &TriangleSoup, source: &[u32]) -> [f32; 4] {
    if soup.colors.is_empty() || source.is_empty() {
        return [1.0; 4];
    }
    let mut sum = [0.0f64; 4];
    let corners = source.iter().flat_map(|&i| soup.triangles[i as usize]);
    corners.for_each(|v| (0..4).for_each(|k| sum[k] += f64::from(soup.colors[v as usize][k])));
    sum.map(|s| (s / (3.0 * source.len() as f64)) as f32)
}

/// How the source's texture is wrapped about a branch: linear along it and around it.
struct Wrapping {
    /// Change a world unit along.
    along: DVec2,
    /// Change a turn around: whole numbers, so that it closes.
    around: DVec2,
    offset: DVec2,
}

impl Wrapping {
    fn of(branch: &Branch, carried: &[DVec3], soup: &TriangleSoup, source: &[u32]) -> Self {
        let none = Self { along: DVec2::ZERO, around: DVec2::ZERO, offset: DVec2::ZERO };
        if soup.uvs.is_empty() {
            return none;
        }
        let place = |p: DVec3| {
            let at = branch.nearest(p);
            let i = branch.along.partition_point(|&a| a <= at).clamp(1, branch.along.len() - 1) - 1;
            let tangent = (branch.line[i + 1] - branch.line[i]).normalize_or(DVec3::Y);
            let off = p - branch.sample(at).0;
            (at, off.dot(tangent.cross(carried[i])).atan2(off.dot(carried[i])) / TAU)
        };
        let (mut along, mut around) = (Vec::new(), Vec::new());
        let mut corners = Vec::new();
        for &i in source {
            let uv = soup.triangles[i as usize].map(|v| soup.uvs[v as usize].as_dvec2());
            let at = soup.corners(i as usize).map(|p| place(p.as_dvec3()));
            let step = |k: usize| {
                let turn = at[k].1 - at[0].1;
                DVec2::new(at[k].0 - at[0].0, turn - turn.round())
            };
            let (p, q) = (step(1), step(2));
            let det = p.perp_dot(q);
            if det.abs() > 1e-12 {
                let (du, dv) = (uv[1] - uv[0], uv[2] - uv[0]);
                along.push((du * q.y - dv * p.y) / det);
                around.push((dv * p.x - du * q.x) / det);
            }
            corners.extend((0..3).map(|k| (at[k], uv[k])));
        }
        if along.is_empty() {
            return none;
        }
        let (along, around) = (median(along), median(around).round());
        // Offsets repeat with the texture: a mean of angles.
        let mut sum = [DVec2::ZERO; 2];
        for ((a, turn), uv) in corners {
            let off = (uv - along * a - around * turn) * TAU;
            (0..2).for_each(|k| sum[k] += DVec2::from_angle(off[k]));
        }
        let offset = DVec2::new(sum[0].to_angle(), sum[1].to_angle()) / TAU;
        Self { along, around, offset }
    }

    fn at(&self, along: f64, angle: f64) -> DVec2 {
        self.offset + self.along * along + self.around * (angle / TAU)
    }
}

fn median(mut of: Vec<DVec2>) -> DVec2 {
    let mut part = |k: usize| {
        let middle = of.len() / 2;
        of.select_nth_unstable_by(middle, |a, b| a[k].total_cmp(&b[k])).1[k]
    };
    DVec2::new(part(0), part(1))
}
