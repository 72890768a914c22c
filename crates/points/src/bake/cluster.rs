//! Hierarchical clustering of a cell's surfels (Gilet et al. 2005, section 4.2).
//!
//! A cluster is split by the plane through its centroid, normal to the covariance's largest
//! eigenvector, until fewer than five surfels are left. Every node becomes a point; the records of
//! a tree lie in post-order, children before their parent.

use crate::bake::lattice::Quantiser;
use crate::bake::node::Node;
use crate::bake::principal::{Moments, principal_axis};
use crate::bake::surfel::Surfel;
use crate::bake::union;
use crate::options::RadiusRule;
use crate::record::PointRecord;
use crate::size::SizeCode;
use glam::DVec3;

/// Clusters of at most this many surfels are not split ("until fewer than 5").
const LEAF_CLUSTER: usize = 4;

/// Clusters larger than this are built by two threads.
const PARALLEL: usize = 1 << 15;

/// A leaf's place in the recursion: kept small, because it is moved at every level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Item {
    pub(crate) position: [f32; 3],
    pub(crate) index: u32,
}

/// What the tree is built over.
pub(crate) enum Leaves<'a> {
    /// Surfels of a cell, in clusters of up to [`LEAF_CLUSTER`].
    Surfels(&'a [Surfel]),
    /// Roots of cells, one by one.
    Roots(&'a [Node]),
}

impl Leaves<'_> {
    fn items(&self) -> Vec<Item> {
        let item = |(index, position)| Item { position, index };
        match self {
            Leaves::Surfels(s) => (0..).zip(s.iter().map(|s| s.position)).map(item).collect(),
            Leaves::Roots(r) => {
                (0..).zip(r.iter().map(|n| n.center.as_vec3().to_array())).map(item).collect()
            }
        }
    }

    fn cluster_size(&self) -> usize {
        match self {
            Leaves::Surfels(_) => LEAF_CLUSTER,
            Leaves::Roots(_) => 1,
        }
    }

    fn node(&self, index: u32, radius: RadiusRule) -> Node {
        match self {
            Leaves::Surfels(s) => Node::of_surfel(&s[index as usize], radius),
            Leaves::Roots(r) => r[index as usize],
        }
    }
}

/// What points are made with.
pub(crate) struct ClusterRules<'a> {
    pub(crate) leaves: Leaves<'a>,
    pub(crate) radius: RadiusRule,
    /// Parents are never smaller than their children.
    pub(crate) monotone: bool,
    /// From block space to position steps.
    pub(crate) quantiser: Quantiser,
}

/// The points of a tree in post-order.
#[derive(Default)]
pub(crate) struct Tree {
    pub(crate) records: Vec<PointRecord>,
    /// Index of each record's parent (its own for the root); kept for audits only.
    pub(crate) parents: Option<Vec<u32>>,
    /// Nodes of the subtree being built whose union was not measured yet.
    gathered: Vec<Node>,
}

impl Tree {
    /// A tree that remembers who is whose parent.
    pub(crate) fn with_parents() -> Self {
        Self { parents: Some(Vec::new()), ..Self::default() }
    }

    fn sibling(&self) -> Self {
        Self { parents: self.parents.as_ref().map(|_| Vec::new()), ..Self::default() }
    }

    fn push(&mut self, record: PointRecord) -> usize {
        let index = self.records.len();
        self.records.push(record);
        if let Some(parents) = &mut self.parents {
            parents.push(index as u32);
        }
        index
    }

    fn set_parent(&mut self, child: usize, parent: usize) {
        let size = self.records[parent].own();
        self.records[child].set_parent(size);
        if let Some(parents) = &mut self.parents {
            parents[child] = parent as u32;
        }
    }

    fn append(&mut self, mut other: Tree) {
        let base = self.records.len() as u32;
        self.records.append(&mut other.records);
        self.gathered.append(&mut other.gathered);
        if let (Some(mine), Some(theirs)) = (&mut self.parents, other.parents) {
            mine.extend(theirs.into_iter().map(|p| p + base));
        }
    }
}

/// A built subtree: its root, and where the root's record is.
pub(crate) struct Built {
    pub(crate) root: Node,
    pub(crate) record: usize,
}

/// Builds the tree over all leaves (at least one) and appends its records.
pub(crate) fn build(rules: &ClusterRules, out: &mut Tree) -> Built {
    build_items(rules, &mut rules.leaves.items(), out)
}

fn build_items(rules: &ClusterRules, items: &mut [Item], out: &mut Tree) -> Built {
    let mut scratch = items.to_vec();
    let origin = items[0].position;
    let moments = moments_about(origin, items);
    out.records.reserve(items.len() * 7 / 4);
    split(rules, items, &mut scratch, origin, moments, out)
}

/// Splits `items`, whose `moments` are about `origin`; `scratch` is as long.
fn split(
    rules: &ClusterRules,
    items: &mut [Item],
    scratch: &mut [Item],
    origin: [f32; 3],
    moments: Moments,
    out: &mut Tree,
) -> Built {
    if items.len() <= rules.leaves.cluster_size() {
        return leaf_cluster(rules, items, out);
    }
    let (origin, moments) = match moments.covariance() {
        Some(_) => (origin, moments),
        None => (items[0].position, moments_about(items[0].position, items)),
    };
    let axis = moments.covariance().map(principal_axis);
    let (at, left) = match axis {
        Some(axis) => partition(items, scratch, origin, moments.mean(), axis),
        None => (0, Moments::default()),
    };
    // All centroids equal, or rounding put all on one side: halve the list as it stands.
    let one_sided = at == 0 || at == items.len();
    let (at, left) = if one_sided {
        let half = items.len() / 2;
        (half, moments_about(origin, &items[..half]))
    } else {
        (at, left)
    };
    let right = moments.without(&left);
    let seed = items[0].index;
    let gathered = out.gathered.len();
    let parallel = items.len() > PARALLEL;
    let (items_l, items_r) = items.split_at_mut(at);
    let (scratch_l, scratch_r) = scratch.split_at_mut(at);
    let children = if parallel {
        let mut out_r = out.sibling();
        let (l, mut r) = rayon::join(
            || split(rules, items_l, scratch_l, origin, left, out),
            || split(rules, items_r, scratch_r, origin, right, &mut out_r),
        );
        r.record += out.records.len();
        out.append(out_r);
        [l, r]
    } else {
        let l = split(rules, items_l, scratch_l, origin, left, out);
        let r = split(rules, items_r, scratch_r, origin, right, out);
        [l, r]
    };
    let [l, r] = &children;
    merge(rules, &[l.root, r.root], &[l.record, r.record], (gathered, seed), out)
}

/// The leaves of a small cluster, and their common point if there are several.
fn leaf_cluster(rules: &ClusterRules, items: &[Item], out: &mut Tree) -> Built {
    let gathered = out.gathered.len();
    let mut records = [0; LEAF_CLUSTER];
    for (slot, item) in records.iter_mut().zip(items.iter()) {
        let node = rules.leaves.node(item.index, rules.radius);
        *slot = out.push(record(rules, &node, true));
        out.gathered.push(node);
    }
    if let [root] = out.gathered[gathered..] {
        return Built { root, record: records[0] };
    }
    let mut nodes = [out.gathered[gathered]; LEAF_CLUSTER];
    nodes[..items.len()].copy_from_slice(&out.gathered[gathered..]);
    let seed = items[0].index;
    merge(rules, &nodes[..items.len()], &records[..items.len()], (gathered, seed), out)
}

/// One point for `children`. The nodes gathered below it, from number `gathered` on, are measured
/// if there are enough of them; the point then stands for them.
fn merge(
    rules: &ClusterRules,
    children: &[Node],
    records: &[usize],
    (gathered, seed): (usize, u32),
    out: &mut Tree,
) -> Built {
    let below = &out.gathered[gathered..];
    let measured = (rules.radius == RadiusRule::Opacity && below.len() >= union::GATHERED)
        .then(|| union::covered(below, seed));
    let root = Node::merged(children, rules.radius, rules.monotone, measured);
    if rules.radius != RadiusRule::Opacity {
        out.gathered.truncate(gathered);
    } else if measured.is_some() {
        out.gathered.truncate(gathered);
        out.gathered.push(root);
    }
    adopt(rules, root, records, out)
}

/// Appends the parent's record and tells its children its size.
fn adopt(rules: &ClusterRules, root: Node, children: &[usize], out: &mut Tree) -> Built {
    let parent = out.push(record(rules, &root, false));
    for &child in children {
        out.set_parent(child, parent);
    }
    Built { root, record: parent }
}

fn record(rules: &ClusterRules, node: &Node, leaf: bool) -> PointRecord {
    let position = rules.quantiser.quantise(node.center);
    let opacity = node.opacity(rules.radius);
    PointRecord::new(position, node.axis, node.rgb(), opacity, node.own, node.flatness, leaf)
}

/// Builds the block's tree over the roots of its cells: the same splits, down to single roots.
/// Appends the records above the roots and returns the size of each root's parent.
pub(crate) fn build_top(
    roots: &[Node],
    rules: &ClusterRules,
    out: &mut Vec<PointRecord>,
) -> Vec<SizeCode> {
    let mut items = rules.leaves.items();
    let mut all = Tree::default();
    build_items(rules, &mut items, &mut all);
    // The roots stand in for surfels there, in the order that splitting left the items in.
    let mut parents = vec![SizeCode::INFINITE; roots.len()];
    for (record, item) in all.records.iter().filter(|r| r.is_leaf()).zip(&items) {
        parents[item.index as usize] = record.parent();
    }
    out.extend(all.records.into_iter().filter(|r| !r.is_leaf()));
    parents
}

fn moments_about(origin: [f32; 3], items: &[Item]) -> Moments {
    let mut m = Moments::default();
    for item in items {
        m.add(offset(item.position, origin), 1.0);
    }
    m
}

#[inline(always)]
fn offset(p: [f32; 3], origin: [f32; 3]) -> [f64; 3] {
    std::array::from_fn(|k| f64::from(p[k]) - f64::from(origin[k]))
}

/// Moves the items before the plane to the front, each side in its old order; returns their number
/// and moments. The loop has no branches: the sides are as good as random.
fn partition(
    items: &mut [Item],
    scratch: &mut [Item],
    origin: [f32; 3],
    mean: DVec3,
    axis: DVec3,
) -> (usize, Moments) {
    let plane = axis.dot(mean);
    let mut left = Moments::default();
    let (mut l, mut r) = (0, 0);
    for i in 0..items.len() {
        let item = items[i];
        let d = offset(item.position, origin);
        let front = d[0] * axis.x + d[1] * axis.y + d[2] * axis.z < plane;
        items[l] = item;
        scratch[r] = item;
        l += usize::from(front);
        r += usize::from(!front);
        left.add(d, f64::from(u8::from(front)));
    }
    items[l..].copy_from_slice(&scratch[..r]);
    (l, left)
}

#[cfg(test)]
mod tests;
