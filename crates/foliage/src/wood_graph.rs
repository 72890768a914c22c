//! The graph of wood: corners and edges of its triangles, with long edges cut and separate pieces
//! tied together where they come nearest.

use crate::weld::Welded;
use glam::DVec3;
use hashbrown::{HashMap, HashSet};
use petgraph::unionfind::UnionFind;
use rayon::prelude::*;
use rstar::RTree;
use rstar::primitives::GeomWithData;

/// Wood as a graph.
#[derive(Clone, Debug, Default)]
pub(crate) struct WoodGraph {
    /// The welded corners first, then those of cut edges.
    pub(crate) positions: Vec<DVec3>,
    /// Pairs of corners with their distance; each once.
    pub(crate) edges: Vec<(u32, u32, f64)>,
    /// How many separate pieces were tied.
    pub(crate) pieces: usize,
}

/// A corner in space, by its number.
pub(crate) type Place = GeomWithData<[f64; 3], u32>;

impl WoodGraph {
    /// The graph of `wood`, without edges longer than `longest` between corners of one piece.
    pub(crate) fn new(wood: &Welded, longest: f64) -> Self {
        let mut cutter = Cutter {
            positions: wood.positions.iter().map(|p| p.as_dvec3()).collect(),
            middles: HashMap::new(),
            longest,
        };
        let mut edges = HashSet::new();
        for &triangle in &wood.triangles {
            cutter.cut(triangle, &mut |[a, b, c]| {
                for (p, q) in [(a, b), (b, c), (c, a)] {
                    if p != q {
                        edges.insert((p.min(q), p.max(q)));
                    }
                }
            });
        }
        let positions = cutter.positions;
        let mut edges: Vec<(u32, u32, f64)> = edges
            .into_iter()
            .map(|(a, b)| (a, b, positions[a as usize].distance(positions[b as usize])))
            .collect();
        edges.sort_unstable_by_key(|e| (e.0, e.1));
        let mut out = Self { positions, edges, pieces: 0 };
        out.tie();
        out
    }

    /// A tree of all corners.
    pub(crate) fn places(&self) -> RTree<Place> {
        let place = |(i, p): (u32, &DVec3)| Place::new(p.to_array(), i);
        RTree::bulk_load((0..).zip(&self.positions).map(place).collect())
    }

    /// Ties pieces together by their shortest gaps (Borůvka 1926: a minimum spanning tree).
    fn tie(&mut self) {
        let count = self.positions.len();
        let mut sets = UnionFind::<u32>::new(count);
        self.edges.iter().for_each(|e| _ = sets.union(e.0, e.1));
        let places = self.places();
        loop {
            let labels = sets.clone().into_labeling();
            let mut members: HashMap<u32, Vec<u32>> = HashMap::new();
            (0..).zip(&labels).for_each(|(i, l)| members.entry(*l).or_default().push(i));
            let mut pieces: Vec<(u32, Vec<u32>)> = members.into_iter().collect();
            self.pieces = self.pieces.max(pieces.len());
            if pieces.len() <= 1 {
                return;
            }
            // The largest asks nobody: the others ask it.
            pieces.sort_unstable_by_key(|p| (std::cmp::Reverse(p.1.len()), p.0));
            let ties: Vec<(u32, u32, f64)> = pieces[1..]
                .par_iter()
                .filter_map(|(_, piece)| self.nearest_stranger(piece, &labels, &places))
                .collect();
            for (a, b, distance) in ties {
                if sets.union(a, b) {
                    self.edges.push((a.min(b), a.max(b), distance));
                }
            }
        }
    }

    /// The shortest way from a piece to any other.
    fn nearest_stranger(
        &self,
        piece: &[u32],
        labels: &[u32],
        places: &RTree<Place>,
    ) -> Option<(u32, u32, f64)> {
        let own = labels[*piece.first()? as usize];
        let stranger = |v: u32, most: usize| {
            let from = self.positions[v as usize];
            let mut near = places.nearest_neighbor_iter(from.to_array()).take(most);
            let other = near.find(|n| labels[n.data as usize] != own)?.data;
            Some((v, other, from.distance(self.positions[other as usize])))
        };
        // Corners whose strangers lie beyond many of their own are not where the gap is shortest.
        let near = piece.iter().filter_map(|&v| stranger(v, NEAR));
        near.min_by(|a, b| a.2.total_cmp(&b.2).then((a.0, a.1).cmp(&(b.0, b.1))))
            .or_else(|| stranger(piece[0], usize::MAX))
    }
}

/// Neighbours of a corner among which one of another piece is looked for.
const NEAR: usize = 48;

/// Cuts triangles whose edges are long; both triangles of an edge get the same middle.
struct Cutter {
    positions: Vec<DVec3>,
    middles: HashMap<(u32, u32), u32>,
    longest: f64,
}

impl Cutter {
    fn cut(&mut self, t: [u32; 3], out: &mut impl FnMut([u32; 3])) {
        let length = |k: usize| {
            let [a, b] = [t[k], t[(k + 1) % 3]].map(|v| self.positions[v as usize]);
            a.distance(b)
        };
        let k = (0..3).max_by(|a, b| length(*a).total_cmp(&length(*b))).unwrap_or(0);
        if length(k).total_cmp(&self.longest).is_le() {
            return out(t);
        }
        let (a, b, c) = (t[k], t[(k + 1) % 3], t[(k + 2) % 3]);
        let middle = *self.middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
            self.positions.push((self.positions[a as usize] + self.positions[b as usize]) * 0.5);
            self.positions.len() as u32 - 1
        });
        self.cut([a, middle, c], out);
        self.cut([middle, b, c], out);
    }
}
