//! The skeleton of wood: level sets of the distance along it from its root.
//!
//! A. Verroust, F. Lazarus, "Extracting skeletal curves from 3D scattered data", The Visual
//! Computer 16 (2000): distances along the graph of the surface from a source; connected pieces of
//! equal distance are rings about the limbs, their middles the nodes of the skeleton. H. Xu,
//! N. Gossett, B. Chen, "Knowledge and heuristic-based modeling of laser-scanned trees", ACM TOG 26
//! (2007) do the same to trees. Pieces of wood that do not touch are tied together first.

use crate::wood_graph::WoodGraph;
use glam::DVec3;
use hashbrown::HashMap;
use petgraph::graph::{NodeIndex, UnGraph};
use petgraph::unionfind::UnionFind;

/// A ring of wood.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ring {
    /// Middle of its corners.
    pub(crate) center: DVec3,
    /// Median distance of its corners from the middle.
    pub(crate) radius: f64,
    /// The ring before it on the way to the root.
    pub(crate) parent: Option<u32>,
}

/// Rings in the order of their distance: parents come first; ring 0 is the root.
#[derive(Clone, Debug, Default)]
pub(crate) struct Rings {
    pub(crate) rings: Vec<Ring>,
    /// The ring of each corner of the graph.
    pub(crate) of: Vec<u32>,
}

/// Share of the wood's height above its lowest corner that stands on the ground: the root.
const GROUND: f64 = 0.01;

impl Rings {
    /// Level sets `width` apart, at least as far as the graph's longest edge.
    pub(crate) fn new(graph: &WoodGraph, width: f64) -> Self {
        let (distances, ground) = distances(graph);
        let level = |v: u32| match ground[v as usize] {
            true => 0,
            false => 1 + (distances[v as usize] / width) as u32,
        };
        let mut sets = UnionFind::<u32>::new(graph.positions.len());
        for &(a, b, _) in graph.edges.iter().filter(|e| level(e.0) == level(e.1)) {
            sets.union(a, b);
        }
        // All that stands on the ground is one.
        let mut standing = (0..ground.len() as u32).filter(|v| ground[*v as usize]);
        if let Some(first) = standing.next() {
            standing.for_each(|v| _ = sets.union(first, v));
        }
        let labels = sets.into_labeling();
        let mut order: Vec<u32> =
            (0..labels.len() as u32).filter(|v| labels[*v as usize] == *v).collect();
        order.sort_by_key(|&v| (level(v), v));
        let numbers: HashMap<u32, u32> = order.iter().copied().zip(0..).collect();
        let of: Vec<u32> = labels.iter().map(|l| numbers[l]).collect();
        let levels: Vec<u32> = order.iter().map(|&v| level(v)).collect();
        let parents = parents(graph, &of, &levels);
        Self { rings: rings(graph, &of, &parents), of }
    }
}

/// Distance of each corner from the ground along the graph, and whether it stands on it.
fn distances(graph: &WoodGraph) -> (Vec<f64>, Vec<bool>) {
    let ys = || graph.positions.iter().map(|p| p.y);
    let (low, high) = (ys().fold(f64::INFINITY, f64::min), ys().fold(f64::NEG_INFINITY, f64::max));
    let ground: Vec<bool> = ys().map(|y| y <= low + GROUND * (high - low)).collect();
    let count = graph.positions.len();
    let mut net = UnGraph::<(), f64, u32>::with_capacity(count + 1, graph.edges.len());
    (0..=count).for_each(|_| _ = net.add_node(()));
    let node = |v: u32| NodeIndex::<u32>::new(v as usize);
    for &(a, b, length) in &graph.edges {
        net.add_edge(node(a), node(b), length);
    }
    let source = node(count as u32);
    for v in (0..count as u32).filter(|v| ground[*v as usize]) {
        net.add_edge(source, node(v), 0.0);
    }
    let found = petgraph::algo::dijkstra(&net, source, None, |e| *e.weight());
    let distance = |v: u32| found.get(&node(v)).copied().unwrap_or(0.0);
    ((0..count as u32).map(distance).collect(), ground)
}

/// Of each ring the one of a lower level that it hangs on by most edges.
fn parents(graph: &WoodGraph, of: &[u32], levels: &[u32]) -> Vec<Option<u32>> {
    let mut counts: HashMap<(u32, u32), u32> = HashMap::new();
    for &(a, b, _) in &graph.edges {
        let (a, b) = (of[a as usize], of[b as usize]);
        let (above, below) = if levels[a as usize] > levels[b as usize] { (a, b) } else { (b, a) };
        if levels[above as usize] > levels[below as usize] {
            *counts.entry((above, below)).or_default() += 1;
        }
    }
    let mut best: Vec<Option<(u32, u32)>> = vec![None; levels.len()];
    for ((above, below), count) in counts {
        let best = &mut best[above as usize];
        if best.is_none_or(|b| (count, std::cmp::Reverse(below)) > (b.0, std::cmp::Reverse(b.1))) {
            *best = Some((count, below));
        }
    }
    best.into_iter().map(|b| b.map(|b| b.1)).collect()
}

fn rings(graph: &WoodGraph, of: &[u32], parents: &[Option<u32>]) -> Vec<Ring> {
    let mut sums = vec![(DVec3::ZERO, 0u32); parents.len()];
    for (p, &r) in graph.positions.iter().zip(of) {
        let sum = &mut sums[r as usize];
        *sum = (sum.0 + *p, sum.1 + 1);
    }
    let centers: Vec<DVec3> = sums.iter().map(|s| s.0 / f64::from(s.1.max(1))).collect();
    let mut distances: Vec<Vec<f64>> = vec![Vec::new(); parents.len()];
    for (p, &r) in graph.positions.iter().zip(of) {
        // About the way to the parent: a ring is not quite flat.
        let center = centers[r as usize];
        let axis = parents[r as usize].map(|q| (center - centers[q as usize]).normalize_or_zero());
        let off = *p - center;
        distances[r as usize].push((off - axis.map_or(DVec3::ZERO, |a| a * off.dot(a))).length());
    }
    // The median: what begins to branch off does not count.
    let radius = |d: &mut Vec<f64>| match d.len() {
        0 => 0.0,
        n => *d.select_nth_unstable_by(n / 2, f64::total_cmp).1,
    };
    (centers.into_iter().zip(&mut distances).zip(parents))
        .map(|((center, d), parent)| Ring { center, radius: radius(d), parent: *parent })
        .collect()
}
