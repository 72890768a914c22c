//! Corners that lie at one place are one: the topology that soups do not have.

use forest_soup::TriangleSoup;
use glam::{IVec3, Vec3};
use hashbrown::HashMap;
use petgraph::unionfind::UnionFind;

/// Corners nearer to each other than this share of the soup's size are one (mostly: they are
/// rounded to a grid of it).
const WELD: f64 = 1e-6;

/// Some triangles of a soup over welded corners.
#[derive(Clone, Debug, Default)]
pub(crate) struct Welded {
    /// Places of the corners, about the soup's origin.
    pub(crate) positions: Vec<Vec3>,
    /// Corners of each triangle.
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Number of each triangle in the soup.
    pub(crate) sources: Vec<u32>,
}

impl Welded {
    /// Welds triangles `sources` of `soup`, whose corners are finite and whose box has this size.
    pub(crate) fn new(soup: &TriangleSoup, sources: Vec<u32>, size: f64) -> Self {
        let step = (size * WELD).max(f64::MIN_POSITIVE);
        let mut numbers: HashMap<IVec3, u32> = HashMap::new();
        let mut out = Self { sources, ..Self::default() };
        for &source in &out.sources {
            out.triangles.push(soup.corners(source as usize).map(|p| {
                let cell = (p.as_dvec3() / step).round().as_ivec3();
                *numbers.entry(cell).or_insert_with(|| {
                    out.positions.push(p);
                    out.positions.len() as u32 - 1
                })
            }));
        }
        out
    }

    /// Triangles that hang together by corners, as indices into [`Welded::triangles`]; in the order
    /// of their first triangles.
    pub(crate) fn components(&self) -> Vec<Vec<u32>> {
        let mut sets = UnionFind::<u32>::new(self.positions.len());
        for &[a, b, c] in &self.triangles {
            sets.union(a, b);
            sets.union(b, c);
        }
        let mut places: HashMap<u32, usize> = HashMap::new();
        let mut out: Vec<Vec<u32>> = Vec::new();
        for (i, t) in (0..).zip(&self.triangles) {
            let place = *places.entry(sets.find_mut(t[0])).or_insert_with(|| {
                out.push(Vec::new());
                out.len() - 1
            });
            out[place].push(i);
        }
        out
    }
}
