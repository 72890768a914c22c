//! Which trees are before the camera, from near to far, in runs for one draw each.

use crate::peers::Peer;
use forest_scene::{Instance, Scene, Stance, Tile, instances, is_beside};
use forest_soup::{Camera, Projection};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Bands of distance begin at so many metres; each is twice as wide as the one before it.
const FIRST_BAND: f32 = 32.0;

/// What culling knows of a species.
#[derive(Clone, Debug)]
pub(crate) struct Kind {
    /// Ball about a tree of scale 1, from its foot.
    middle: Vec3,
    radius: f32,
    scale: [f64; 2],
    reach: f64,
    /// Triangles, and mean area of one, of each level from the finest.
    pub(crate) levels: Vec<(u64, f64)>,
}

impl Kind {
    pub(crate) fn new(stance: &Stance, levels: Vec<(u64, f64)>) -> Self {
        let [min, max] = stance.bounds;
        Self {
            middle: ((min + max) * 0.5).as_vec3(),
            radius: ((max - min).length() * 0.5) as f32,
            scale: stance.scale,
            reach: stance.reach() * stance.scale[1],
            levels,
        }
    }
}

/// Trees that are drawn at once: a range of the list.
#[derive(Clone, Debug)]
pub(crate) struct Run {
    pub(crate) species: usize,
    pub(crate) level: usize,
    pub(crate) first: u32,
    pub(crate) count: u32,
}

/// The trees of a scene.
#[derive(Debug)]
pub(crate) struct Culling {
    trees: Vec<Instance>,
    tiles: Vec<Tile>,
    kinds: Vec<Kind>,
    peer: Peer,
    /// Numbers of the trees to draw.
    pub(crate) list: Vec<u32>,
    pub(crate) runs: Vec<Run>,
    pub(crate) left_out: u64,
}

#[derive(Clone, Copy)]
struct Seen {
    distance: f32,
    key: u32,
    tree: u32,
}

/// The frustum as five planes through the eye.
struct Frustum {
    eye: DVec3,
    planes: [Vec3; 5],
    pixels: f64,
}

impl Frustum {
    fn new(camera: &Camera) -> Self {
        let fov_y = match camera.projection {
            Projection::Perspective { fov_y } => fov_y,
            Projection::Orthographic { .. } => 1.0,
        };
        let tall = (fov_y * 0.5).tan();
        let wide = tall * f64::from(camera.width) / f64::from(camera.height);
        let (f, r, u) = (camera.forward, camera.right, camera.up);
        let planes = [f, f * wide + r, f * wide - r, f * tall + u, f * tall - u];
        let planes = planes.map(|p| p.normalize().as_vec3());
        Self { eye: camera.eye, planes, pixels: camera.pixels_per_unit(1.0) }
    }
}

impl Culling {
    pub(crate) fn new(scene: &Scene, kinds: Vec<Kind>, peer: Peer) -> Self {
        let trees = scene.trees.clone();
        let tiles = instances::tiles(&trees);
        Self { trees, tiles, kinds, peer, list: vec![], runs: vec![], left_out: 0 }
    }

    /// Fills the list and its runs: full meshes of at most `budget` triangles, or levels whose triangles
    /// have at most so many square `pixels`.
    pub(crate) fn fill(&mut self, camera: &Camera, budget: u64, pixels: f64) {
        let frustum = Frustum::new(camera);
        let seen = |tile: &Tile| -> Vec<Seen> {
            let r = DVec3::splat(self.kinds[tile.species].reach);
            let min = Vec3::from_array(tile.min).as_dvec3() - r;
            let max = Vec3::from_array(tile.max).as_dvec3() + r;
            if is_beside(camera, min, max) {
                return Vec::new();
            }
            (tile.first..tile.first + tile.count)
                .filter_map(|t| self.look(&frustum, pixels, t))
                .collect()
        };
        let mut all: Vec<Seen> = self.tiles.par_iter().flat_map_iter(seen).collect();
        self.left_out = 0;
        if self.peer == Peer::FullMeshes {
            all.par_sort_unstable_by(|a, b| a.distance.total_cmp(&b.distance));
            let mut triangles = 0;
            let fits = all.iter().take_while(|s| {
                let species = self.trees[s.tree as usize].species();
                triangles += self.kinds[species].levels[0].0;
                triangles <= budget
            });
            let fits = fits.count();
            self.left_out = (all.len() - fits) as u64;
            all.truncate(fits);
        }
        all.par_sort_unstable_by(|a, b| {
            (a.key.cmp(&b.key)).then(a.distance.total_cmp(&b.distance)).then(a.tree.cmp(&b.tree))
        });
        self.list.clear();
        self.list.extend(all.iter().map(|s| s.tree));
        self.runs.clear();
        let mut first = 0;
        for run in all.chunk_by(|a, b| a.key == b.key) {
            let [_, species, level, _] = run[0].key.to_be_bytes().map(usize::from);
            self.runs.push(Run { species, level, first, count: run.len() as u32 });
            first += run.len() as u32;
        }
    }

    fn look(&self, frustum: &Frustum, most: f64, number: u32) -> Option<Seen> {
        let tree = &self.trees[number as usize];
        let species = tree.species();
        let kind = &self.kinds[species];
        let scale = tree.scale(kind.scale);
        let (sin, cos) = (tree.yaw() as f32).sin_cos();
        let m = kind.middle * scale as f32;
        let turned = Vec3::new(m.x * cos + m.z * sin, m.y, m.z * cos - m.x * sin);
        let foot = Vec3::from_array(tree.position).as_dvec3() - frustum.eye;
        let middle = foot.as_vec3() + turned;
        let radius = kind.radius * scale as f32;
        if frustum.planes.iter().any(|p| p.dot(middle) < -radius) {
            return None;
        }
        let distance = middle.length();
        // As engines do, by the size at the middle of the tree.
        let at = f64::from(distance.max(0.25 * radius));
        let pixels = (frustum.pixels / at * scale).powi(2);
        let fine = |l: &(u64, f64)| l.1 * pixels <= most;
        let level = kind.levels.iter().rposition(fine).unwrap_or(0);
        let band = (distance / FIRST_BAND).max(1.0).log2() as u32;
        let key = u32::from_be_bytes([band as u8, species as u8, level as u8, 0]);
        Some(Seen { distance, key, tree: number })
    }
}
