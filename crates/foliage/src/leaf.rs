//! Leaves: what hangs together of leaf triangles, each flat and fixed to a branch.

use crate::hang::Grown;
use crate::tensor::{NormalTensor, principal_axes};
use crate::weld::Welded;
use forest_soup::TriangleSoup;
use glam::{DMat3, DVec3, Vec3};
use rayon::prelude::*;

/// Something that lies on a card of its own or with others: a leaf, a spray of leaves on one quad, a
/// twig.
#[derive(Clone, Debug)]
pub(crate) struct Leaf {
    /// Numbers of its triangles in the soup.
    pub(crate) triangles: Vec<u32>,
    /// Area-weighted middle.
    pub(crate) center: DVec3,
    /// Area of its triangles.
    pub(crate) area: f64,
    /// Unit normal; its sign means nothing.
    pub(crate) facing: DVec3,
    /// It may be turned to lie in its card's plane: leaves face all ways anyway. What may not is
    /// projected.
    pub(crate) turns: bool,
    /// The record of the branch that it hangs on, and where.
    pub(crate) on: (u32, f32),
    /// The corner by which it hangs.
    pub(crate) pivot: DVec3,
}

impl Leaf {
    /// Its part of what a card shows.
    pub(crate) fn grown(&self) -> Grown {
        Grown { place: self.center, area: self.area, on: self.on }
    }
}

/// From this share of its area that faces one way a leaf is flat enough for one card.
const FLAT: f64 = 0.7;

/// Leaves of welded triangles; those larger than `largest` are cut, and those that face several ways
/// (crossed quads) are parted by the way they face.
pub(crate) fn leaves(welded: &Welded, largest: f64) -> Vec<Leaf> {
    let pieces = welded.components();
    let whole = pieces.into_par_iter().flat_map_iter(|piece| cut(welded, piece, largest));
    whole.flat_map_iter(|piece| parted(welded, piece)).filter_map(|p| leaf(welded, &p)).collect()
}

fn corners(welded: &Welded, i: u32) -> [DVec3; 3] {
    welded.triangles[i as usize].map(|v| welded.positions[v as usize].as_dvec3())
}

fn cross([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}

/// Halves until nothing is larger.
fn cut(welded: &Welded, piece: Vec<u32>, largest: f64) -> Vec<Vec<u32>> {
    let middle = |i: u32| corners(welded, i).iter().sum::<DVec3>() / 3.0;
    let (min, max) = piece.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), &i| {
        (min.min(middle(i)), max.max(middle(i)))
    });
    let size = max - min;
    if piece.len() < 2 || size.max_element() <= largest {
        return vec![piece];
    }
    let axis = (0..3).max_by(|a, b| size[*a].total_cmp(&size[*b])).unwrap_or(0);
    let half = 0.5 * (min[axis] + max[axis]);
    let (low, high): (Vec<u32>, Vec<u32>) =
        piece.into_iter().partition(|&i| middle(i)[axis] < half);
    if low.is_empty() || high.is_empty() {
        return vec![[low, high].concat()];
    }
    [cut(welded, low, largest), cut(welded, high, largest)].concat()
}

fn parted(welded: &Welded, piece: Vec<u32>) -> Vec<Vec<u32>> {
    let mut tensor = NormalTensor::default();
    piece.iter().for_each(|&i| tensor.add(cross(corners(welded, i))));
    let (shares, axes) = tensor.axes();
    if shares[0] >= FLAT {
        return vec![piece];
    }
    let mut parts = [Vec::new(), Vec::new(), Vec::new()];
    for i in piece {
        parts[nearest_axis(&axes, cross(corners(welded, i)))].push(i);
    }
    parts.into_iter().filter(|p| !p.is_empty()).collect()
}

/// The column of `axes` that `v` lies nearest to, whatever its sign.
pub(crate) fn nearest_axis(axes: &DMat3, v: DVec3) -> usize {
    let along = |k: usize| axes.col(k).dot(v).abs();
    (0..3).max_by(|a, b| along(*a).total_cmp(&along(*b))).unwrap_or(0)
}

fn leaf(welded: &Welded, piece: &[u32]) -> Option<Leaf> {
    let mut tensor = NormalTensor::default();
    let mut center = DVec3::ZERO;
    for &i in piece {
        let c = corners(welded, i);
        let n = cross(c);
        tensor.add(n);
        center += c.iter().sum::<DVec3>() / 3.0 * (0.5 * n.length());
    }
    (tensor.area > 0.0).then(|| Leaf {
        triangles: piece.iter().map(|&i| welded.sources[i as usize]).collect(),
        center: center / tensor.area,
        area: tensor.area,
        facing: tensor.axes().1.x_axis,
        turns: true,
        on: (0, 0.0),
        pivot: DVec3::ZERO,
    })
}

/// Leaves near each other, none of whose middles are farther apart than `largest` along an axis.
pub(crate) fn clusters(leaves: &[Leaf], largest: f64) -> Vec<Vec<u32>> {
    let all: Vec<u32> = (0..leaves.len() as u32).collect();
    let mut out = Vec::new();
    let mut open = vec![all];
    while let Some(mut set) = open.pop() {
        let (min, max) =
            set.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), &i| {
                let p = leaves[i as usize].center;
                (min.min(p), max.max(p))
            });
        let size = max - min;
        if set.len() < 2 || size.max_element() <= largest {
            if !set.is_empty() {
                out.push(set);
            }
            continue;
        }
        let axis = (0..3).max_by(|a, b| size[*a].total_cmp(&size[*b])).unwrap_or(0);
        let at = |i: u32| leaves[i as usize].center[axis];
        set.sort_by(|a, b| at(*a).total_cmp(&at(*b)).then(a.cmp(b)));
        // Half of the area on each side.
        let total: f64 = set.iter().map(|&i| leaves[i as usize].area).sum();
        let mut sum = 0.0;
        let middle = set.iter().position(|&i| {
            sum += leaves[i as usize].area;
            sum >= 0.5 * total
        });
        let middle = middle.unwrap_or(0).clamp(1, set.len() - 1);
        let high = set.split_off(middle);
        open.push(high);
        open.push(set);
    }
    out
}

/// A card: leaves that face its way, and its frame.
#[derive(Clone, Debug)]
pub(crate) struct Card {
    /// Numbers of its leaves.
    pub(crate) leaves: Vec<u32>,
    /// A place on its plane.
    pub(crate) center: DVec3,
    /// Right, up and normal: a right-handed frame.
    pub(crate) axes: DMat3,
}

/// Groups of a cluster that hold less than this share of its area join another.
const SLIGHT: f64 = 0.12;

/// The cards of a cluster, one to three, at right angles to each other: along the axes of its normals.
pub(crate) fn cards(soup: &TriangleSoup, leaves: &[Leaf], cluster: &[u32]) -> Vec<Card> {
    let mut tensor = NormalTensor::default();
    for &i in cluster {
        tensor.add(leaves[i as usize].facing * (2.0 * leaves[i as usize].area));
    }
    let (_, axes) = tensor.axes();
    let mut groups: [(f64, Vec<u32>); 3] = Default::default();
    let mut open = [true; 3];
    for &i in cluster {
        let leaf = &leaves[i as usize];
        let group = &mut groups[nearest_axis(&axes, leaf.facing)];
        group.0 += leaf.area;
        group.1.push(i);
    }
    // Slight groups go to the better of the others.
    for k in (0..3).rev() {
        if groups[k].0 < SLIGHT * tensor.area
            && groups.iter().filter(|g| !g.1.is_empty()).count() > 1
        {
            open[k] = false;
            let (_, moved) = std::mem::take(&mut groups[k]);
            for i in moved {
                let leaf = &leaves[i as usize];
                let others = (0..3).filter(|j| open[*j]);
                let along = |j: &usize| axes.col(*j).dot(leaf.facing).abs();
                let to = others.max_by(|a, b| along(a).total_cmp(&along(b))).unwrap_or(0);
                groups[to].0 += leaf.area;
                groups[to].1.push(i);
            }
        }
    }
    let groups = groups.into_iter().enumerate().filter(|(_, g)| !g.1.is_empty());
    groups.map(|(k, g)| card(soup, leaves, g.1, axes.col(k))).collect()
}

fn card(soup: &TriangleSoup, leaves: &[Leaf], group: Vec<u32>, normal: DVec3) -> Card {
    let area: f64 = group.iter().map(|&i| leaves[i as usize].area).sum();
    let weighted = group.iter().map(|&i| leaves[i as usize].center * leaves[i as usize].area);
    let center = weighted.sum::<DVec3>() / area;
    // As narrow as may be: along the spread of the corners in the plane.
    let mut spread = [0.0; 6];
    for &i in &group {
        let leaf = &leaves[i as usize];
        for p in flat_corners(soup, leaf, normal) {
            let d = p - center;
            let d = d - normal * d.dot(normal);
            let products = [d.x * d.x, d.y * d.y, d.z * d.z, d.x * d.y, d.x * d.z, d.y * d.z];
            spread.iter_mut().zip(products).for_each(|(s, p)| *s += p);
        }
    }
    let along = principal_axes(spread).1.x_axis;
    let right = (along - normal * along.dot(normal)).normalize_or(normal.any_orthonormal_vector());
    Card { leaves: group, center, axes: DMat3::from_cols(right, normal.cross(right), normal) }
}

/// Corners of a leaf's triangles, three each; if it turns, turned about its middle so that it lies
/// parallel to a plane: its area stays what it is.
pub(crate) fn flat_corners<'a>(
    soup: &'a TriangleSoup,
    leaf: &'a Leaf,
    normal: DVec3,
) -> impl Iterator<Item = DVec3> + 'a {
    let facing = if leaf.facing.dot(normal) < 0.0 { -leaf.facing } else { leaf.facing };
    let turn = match leaf.turns {
        true => glam::DQuat::from_rotation_arc(facing, normal),
        false => glam::DQuat::IDENTITY,
    };
    let corners = leaf.triangles.iter().flat_map(|&i| soup.corners(i as usize));
    corners.map(move |p: Vec3| leaf.center + turn * (p.as_dvec3() - leaf.center))
}
