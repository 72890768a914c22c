//! Meshes and their chains of levels.
//!
//! Levels have a quarter of the triangles of the one before. What hangs together (wood) is simplified by
//! meshoptimizer, with pruning, and by its sloppy way where that is stuck. Foliage, which is hundreds of
//! pieces of a few triangles, is thinned out and what stays is enlarged so that its area stays the same
//! (R. Cook, J. Halstead, M. Planck, D. Ryu, "Stochastic simplification of aggregate detail", 2007):
//! simplifiers alone leave trees bare.

use bytemuck::{Pod, Zeroable};
use forest_scene::Stance;
use forest_soup::{TriangleSoup, linear_to_srgb8};
use glam::Vec3;
use std::ops::Range;

/// Triangles of the coarsest level.
const COARSEST: f64 = 64.0;
/// Foliage has at least so many pieces, and at most so many triangles in one on average.
const PIECES: usize = 64;
const PIECE_TRIANGLES: usize = 12;

/// `Corner` of mesh.wgsl, in metres from the foot of a tree of scale 1.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Vertex {
    pub(crate) place: [f32; 3],
    normal: [i8; 4],
    uv: [f32; 2],
    color: [u8; 4],
}

/// A level of a mesh.
#[derive(Clone, Debug)]
pub(crate) struct MeshLevel {
    /// Material and indices.
    pub(crate) parts: Vec<(usize, Range<u32>)>,
    pub(crate) triangles: u64,
    /// Mean area of a triangle in square metres.
    pub(crate) area: f64,
}

/// All levels of a species, finest first.
#[derive(Clone, Debug, Default)]
pub(crate) struct Mesh {
    pub(crate) vertices: Vec<Vertex>,
    pub(crate) indices: Vec<u32>,
    pub(crate) levels: Vec<MeshLevel>,
}

impl Mesh {
    /// The source alone, or with its chain.
    pub(crate) fn new(soup: &TriangleSoup, stance: &Stance, chain: bool) -> Self {
        let mut mesh = Self { vertices: vertices(soup, stance), ..Self::default() };
        let parts: Vec<Part> = (0..soup.materials.len())
            .map(|m| Part::new(soup, m, &mesh.vertices))
            .filter(|p| !p.indices.is_empty())
            .collect();
        let all: usize = parts.iter().map(|p| p.indices.len() / 3).sum();
        mesh.add_level(parts.iter().map(|p| (p.material, p.indices.clone())).collect());
        let mut wanted = all as f64 / 4.0;
        while chain && mesh.levels.last().is_some_and(|l| l.triangles as f64 > 1.6 * COARSEST) {
            let share = wanted.max(COARSEST) / all as f64;
            let level =
                parts.iter().map(|p| (p.material, p.reduced(share, &mut mesh.vertices))).collect();
            let before = mesh.levels.last().map_or(0, |l| l.triangles);
            mesh.add_level(level);
            let stuck = mesh.levels.last().is_some_and(|l| l.triangles * 4 > before * 3);
            if stuck || wanted <= COARSEST {
                break;
            }
            wanted /= 4.0;
        }
        mesh
    }

    fn add_level(&mut self, parts: Vec<(usize, Vec<u32>)>) {
        let (mut ranges, mut area) = (Vec::new(), 0.0);
        let start = self.indices.len();
        for (material, indices) in parts.into_iter().filter(|p| !p.1.is_empty()) {
            area += total_area(&self.vertices, &indices);
            let first = self.indices.len() as u32;
            self.indices.extend(meshopt::optimize_vertex_cache(&indices, self.vertices.len()));
            ranges.push((material, first..self.indices.len() as u32));
        }
        let triangles = ((self.indices.len() - start) / 3) as u64;
        let area = area / triangles.max(1) as f64;
        self.levels.push(MeshLevel { parts: ranges, triangles, area });
    }
}

/// The triangles of a material.
struct Part {
    material: usize,
    indices: Vec<u32>,
    places: Vec<[f32; 3]>,
    /// First indices of pieces in the order in which they are kept, if it is foliage: pieces of coarse
    /// levels are also in finer ones.
    pieces: Option<Vec<Vec<u32>>>,
}

impl Part {
    fn new(soup: &TriangleSoup, material: usize, vertices: &[Vertex]) -> Self {
        let whole = |t: &[u32; 3]| t.iter().all(|&v| soup.positions[v as usize].is_finite());
        let of = soup.triangles.iter().zip(&soup.triangle_materials);
        let indices: Vec<u32> = of
            .filter(|(t, m)| usize::from(**m) == material && whole(t))
            .flat_map(|(t, _)| *t)
            .collect();
        let finite = |v: &Vertex| v.place.map(|x| if x.is_finite() { x } else { 0.0 });
        let places: Vec<[f32; 3]> = vertices.iter().map(finite).collect();
        let pieces = pieces(&indices, &places);
        let foliage = pieces.len() >= PIECES && indices.len() / 3 <= pieces.len() * PIECE_TRIANGLES;
        Self { material, indices, places, pieces: foliage.then_some(pieces) }
    }

    fn reduced(&self, share: f64, vertices: &mut Vec<Vertex>) -> Vec<u32> {
        let target = ((self.indices.len() / 3) as f64 * share).ceil().max(6.0) as usize * 3;
        match &self.pieces {
            Some(pieces) => thinned(pieces, target, self.indices.len(), vertices),
            None => simplified(&self.indices, &self.places, target),
        }
    }
}

fn simplified(indices: &[u32], places: &[[f32; 3]], target: usize) -> Vec<u32> {
    let adapter = meshopt::VertexDataAdapter::new(bytemuck::cast_slice(places), 12, 0);
    let adapter = adapter.expect("12 bytes a place");
    let options = meshopt::SimplifyOptions::Prune;
    let kept = meshopt::simplify(indices, &adapter, target, f32::MAX, options, None);
    if kept.len() <= target * 3 / 2 {
        return kept;
    }
    let rough = meshopt::simplify_sloppy(indices, &adapter, target, f32::MAX, None);
    if rough.is_empty() || rough.len() > kept.len() { kept } else { rough }
}

/// The first pieces until there are `target` indices, enlarged about their middles.
fn thinned(pieces: &[Vec<u32>], target: usize, all: usize, vertices: &mut Vec<Vertex>) -> Vec<u32> {
    let mut count = 0;
    let kept = pieces.iter().take_while(|p| {
        let room = count < target;
        count += p.len();
        room
    });
    let kept: Vec<&Vec<u32>> = kept.collect();
    if kept.iter().map(|p| p.len()).sum::<usize>() == all {
        return kept.into_iter().flatten().copied().collect();
    }
    let area =
        |of: &mut dyn Iterator<Item = &Vec<u32>>| of.map(|p| total_area(vertices, p)).sum::<f64>();
    let whole = area(&mut pieces.iter());
    let stays = area(&mut kept.iter().copied()).max(f64::MIN_POSITIVE);
    let grow = (whole / stays).sqrt().max(1.0) as f32;
    let mut out = Vec::new();
    for piece in kept {
        let place = |v: u32| Vec3::from_array(vertices[v as usize].place);
        let middle = piece.iter().map(|&v| place(v)).sum::<Vec3>() / piece.len() as f32;
        let mut moved: Vec<(u32, u32)> = Vec::new();
        for &v in piece {
            let new = match moved.iter().find(|m| m.0 == v) {
                Some(m) => m.1,
                None => {
                    let mut vertex = vertices[v as usize];
                    let from = Vec3::from_array(vertex.place);
                    vertex.place = (middle + (from - middle) * grow).to_array();
                    vertices.push(vertex);
                    moved.push((v, vertices.len() as u32 - 1));
                    vertices.len() as u32 - 1
                }
            };
            out.push(new);
        }
    }
    out
}

/// Indices of what hangs together, in an order without order.
fn pieces(indices: &[u32], places: &[[f32; 3]]) -> Vec<Vec<u32>> {
    // Vertices at one place are one.
    let adapter = meshopt::VertexDataAdapter::new(bytemuck::cast_slice(places), 12, 0);
    let same = meshopt::generate_position_remap(&adapter.expect("12 bytes a place"));
    let mut parent: Vec<u32> = (0..places.len() as u32).collect();
    fn root(parent: &mut [u32], mut v: u32) -> u32 {
        while parent[v as usize] != v {
            parent[v as usize] = parent[parent[v as usize] as usize];
            v = parent[v as usize];
        }
        v
    }
    for t in indices.as_chunks::<3>().0 {
        let a = root(&mut parent, same[t[0] as usize]);
        for &v in &t[1..] {
            let b = root(&mut parent, same[v as usize]);
            parent[b as usize] = a;
        }
    }
    let mut number = vec![u32::MAX; places.len()];
    let mut pieces: Vec<Vec<u32>> = Vec::new();
    for t in indices.as_chunks::<3>().0 {
        let r = root(&mut parent, same[t[0] as usize]) as usize;
        if number[r] == u32::MAX {
            number[r] = pieces.len() as u32;
            pieces.push(Vec::new());
        }
        pieces[number[r] as usize].extend(t);
    }
    let mut keyed: Vec<(u64, Vec<u32>)> =
        (0u64..).zip(pieces).map(|(i, p)| (mixed(i), p)).collect();
    keyed.sort_by_key(|k| k.0);
    keyed.into_iter().map(|k| k.1).collect()
}

/// Scrambles a number (the finaliser of SplitMix64).
fn mixed(i: u64) -> u64 {
    let mut v = i.wrapping_add(0x9e37_79b9_7f4a_7c15);
    v = (v ^ (v >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    v = (v ^ (v >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    v ^ (v >> 31)
}

fn total_area(vertices: &[Vertex], indices: &[u32]) -> f64 {
    let place = |v: u32| Vec3::from_array(vertices[v as usize].place);
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(place);
        f64::from((b - a).cross(c - a).length()) * 0.5
    };
    indices.as_chunks::<3>().0.iter().map(area).sum()
}

/// The soup's vertices about a tree's foot; normals that are not there are those of the triangles.
fn vertices(soup: &TriangleSoup, stance: &Stance) -> Vec<Vertex> {
    let mut normals = soup.normals.clone();
    normals.resize(soup.positions.len(), Vec3::ZERO);
    let unknown: Vec<bool> = normals.iter().map(|n| n.length_squared() < 1e-12).collect();
    for t in &soup.triangles {
        let [a, b, c] = t.map(|v| soup.positions[v as usize]);
        let flat = (b - a).cross(c - a);
        for v in t.map(|v| v as usize).into_iter().filter(|&v| unknown[v] && flat.is_finite()) {
            normals[v] += flat;
        }
    }
    let vertex = |i: usize| {
        let place = (soup.origin + soup.positions[i].as_dvec3() - stance.anchor) * stance.unit;
        let n = normals[i].normalize_or(Vec3::Y).to_array();
        let [x, y, z] = n.map(|v| (v * 127.0).round() as i8);
        let [r, g, b, a] = soup.colors.get(i).copied().unwrap_or([1.0; 4]);
        let [r, g, b] = [r, g, b].map(linear_to_srgb8);
        Vertex {
            place: place.as_vec3().to_array(),
            normal: [x, y, z, 0],
            uv: soup.uvs.get(i).copied().unwrap_or_default().to_array(),
            color: [r, g, b, (a.clamp(0.0, 1.0) * 255.0).round() as u8],
        }
    };
    (0..soup.positions.len()).map(vertex).collect()
}
