//! Levels of detail of the terrain: a quadtree of square patches.

use crate::land::Land;
use forest_soup::{Camera, Projection};
use glam::DVec3;
use rayon::prelude::*;

/// Cells along a side of a patch as it is drawn.
pub const PATCH: u32 = 16;

/// A patch to draw: [`PATCH`] × [`PATCH`] cells of `stride` points each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// Its first point.
    pub corner: [u32; 2],
    /// Points from one of its vertices to the next.
    pub stride: u32,
    /// Metres that its border is drawn down, so that no sky is seen between patches of two levels.
    pub skirt: f32,
}

/// The quadtree: how far each patch of each level is off the land.
#[derive(Clone, Debug)]
pub struct Ground {
    /// From stride 1 up; the last level has one patch.
    levels: Vec<Level>,
}

#[derive(Clone, Debug)]
struct Level {
    across: [u32; 2],
    /// Of each patch, the largest vertical distance to the land in metres, not less than that of
    /// those within; and its lowest and highest height.
    error: Vec<f32>,
    range: Vec<[f32; 2]>,
}

impl Ground {
    /// Measures a land.
    pub fn new(land: &Land) -> Self {
        let mut levels: Vec<Level> = Vec::new();
        for stride in std::iter::successors(Some(1u32), |s| Some(s * 2)) {
            let across = land.points.map(|n| (n - 1).div_ceil(stride * PATCH));
            let all: Vec<(f32, [f32; 2])> = (0..across[0] * across[1])
                .into_par_iter()
                .map(|i| measure(land, [i % across[0], i / across[0]], stride))
                .collect();
            let (mut error, range): (Vec<f32>, Vec<[f32; 2]>) = all.into_iter().unzip();
            if let Some(finer) = levels.last() {
                for (i, e) in error.iter_mut().enumerate() {
                    let i = i as u32;
                    let within = finer.within([i % across[0], i / across[0]]);
                    *e = within.map(|k| finer.error[k]).fold(*e, f32::max);
                }
            }
            levels.push(Level { across, error, range });
            if across == [1, 1] {
                break;
            }
        }
        Self { levels }
    }

    /// The patches to draw for `camera`, such that the drawn surface is nowhere more than `most`
    /// pixels off the land; the nearest first. What is beside the picture is left out.
    pub fn select(&self, land: &Land, camera: &Camera, most: f64) -> Vec<Patch> {
        let mut chosen = Vec::new();
        self.visit(land, camera, most, self.levels.len() - 1, [0, 0], &mut chosen);
        chosen.sort_by(|a: &(f64, Patch), b| a.0.total_cmp(&b.0));
        chosen.into_iter().map(|(_, patch)| patch).collect()
    }

    fn visit(
        &self,
        land: &Land,
        camera: &Camera,
        most: f64,
        level: usize,
        at: [u32; 2],
        chosen: &mut Vec<(f64, Patch)>,
    ) {
        let here = &self.levels[level];
        let stride = 1 << level;
        let corner = at.map(|v| v * stride * PATCH);
        let i = (at[1] * here.across[0] + at[0]) as usize;
        let [low, high] = here.range[i].map(f64::from);
        let far = corner.map(|v| v + stride * PATCH);
        let (a, b) = (land.place(corner[0], corner[1]), land.place(far[0], far[1]));
        let (min, max) = (DVec3::new(a.x, low, a.z), DVec3::new(b.x, high, b.z));
        if is_beside(camera, min, max) {
            return;
        }
        let distance = distance(camera, min, max);
        let pixels = f64::from(here.error[i]) * camera.pixels_per_unit(distance);
        // Something that is 0 · ∞ pixels large is exact.
        if level == 0 || here.error[i] == 0.0 || pixels <= most {
            // Of two neighbours the coarser one may be as far off as this one.
            let allowed = (most / camera.pixels_per_unit(distance)) as f32;
            let skirt = 2.0 * allowed.max(here.error[i]);
            chosen.push((distance, Patch { corner, stride, skirt }));
            return;
        }
        let finer = &self.levels[level - 1];
        for child in finer.within(at) {
            let child = child as u32;
            let at = [child % finer.across[0], child / finer.across[0]];
            self.visit(land, camera, most, level - 1, at, chosen);
        }
    }
}

impl Level {
    /// Numbers of the patches of this level that lie in patch `at` of the next coarser one.
    fn within(&self, at: [u32; 2]) -> impl Iterator<Item = usize> + use<> {
        let [nx, nz] = self.across;
        let inside = move |[x, z]: [u32; 2]| (x < nx && z < nz).then_some((z * nx + x) as usize);
        let corners = [[0, 0], [1, 0], [0, 1], [1, 1]];
        corners.into_iter().filter_map(move |[x, z]| inside([2 * at[0] + x, 2 * at[1] + z]))
    }
}

/// Largest vertical distance between the land and the patch, and the patch's lowest and highest
/// height. Both surfaces are flat on the fine triangles, so that points are enough.
fn measure(land: &Land, at: [u32; 2], stride: u32) -> (f32, [f32; 2]) {
    let first = at.map(|v| v * stride * PATCH);
    let end: [u32; 2] =
        std::array::from_fn(|k| (first[k] + stride * PATCH).min(land.points[k] - 1));
    let (mut most, mut range) = (0.0f64, [f32::INFINITY, f32::NEG_INFINITY]);
    for j in first[1]..=end[1] {
        for i in first[0]..=end[0] {
            let h = land.at(i, j);
            range = [range[0].min(h), range[1].max(h)];
            if stride > 1 {
                let p = land.place(i, j);
                most = most.max((land.height_by(stride, p.x, p.z) - f64::from(h)).abs());
            }
        }
    }
    // Up, and by a rounding of the heights themselves.
    (if most > 0.0 { (most as f32).next_up() } else { 0.0 }, range)
}

/// Distance from the eye to the nearest place of a box; any to a parallel one.
fn distance(camera: &Camera, min: DVec3, max: DVec3) -> f64 {
    match camera.projection {
        Projection::Orthographic { .. } => 1.0,
        Projection::Perspective { .. } => camera.eye.clamp(min, max).distance(camera.eye),
    }
}

/// Whether all of a box is beyond one side of the picture, or behind the eye.
pub fn is_beside(camera: &Camera, min: DVec3, max: DVec3) -> bool {
    let (middle, half) = ((min + max) * 0.5 - camera.eye, (max - min) * 0.5);
    let beyond =
        |normal: DVec3, offset: f64| normal.dot(middle) + offset + normal.abs().dot(half) < 0.0;
    let [w, h] = [camera.width, camera.height].map(f64::from);
    match camera.projection {
        Projection::Perspective { fov_y } => {
            let tall = (fov_y * 0.5).tan();
            let wide = tall * w / h;
            let (f, r, u) = (camera.forward, camera.right, camera.up);
            [f, f * wide + r, f * wide - r, f * tall + u, f * tall - u]
                .into_iter()
                .any(|normal| beyond(normal, 0.0))
        }
        Projection::Orthographic { height } => {
            let (tall, wide) = (0.5 * height, 0.5 * height * w / h);
            let sides = [(camera.right, wide), (camera.up, tall)];
            sides.into_iter().any(|(axis, reach)| beyond(axis, reach) || beyond(-axis, reach))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fractal::{Fractal, diamond_square};

    fn camera(eye: DVec3, forward: DVec3) -> Camera {
        Camera::new(eye, forward, Projection::Perspective { fov_y: 1.0 }, [1280, 720])
    }

    /// The drawn height at (x, z).
    fn drawn(land: &Land, patches: &[Patch], x: f64, z: f64) -> Option<f64> {
        let [cx, cz] = land.cell();
        let at = [(x + 0.5 * land.size[0]) / cx, (z + 0.5 * land.size[1]) / cz];
        let holds = |p: &&Patch| {
            (0..2).all(|k| {
                let first = f64::from(p.corner[k]);
                at[k] >= first && at[k] <= first + f64::from(p.stride * PATCH)
            })
        };
        patches.iter().find(holds).map(|p| land.height_by(p.stride, x, z))
    }

    #[test]
    fn the_drawn_ground_is_within_half_a_pixel() {
        let rough = Fractal { cells: 512, range: 60.0, smoothness: 1.2 };
        let land = diamond_square(&rough, 2000.0, 3);
        let ground = Ground::new(&land);
        for (x, z, above) in [(0.0, 0.0, 2.0), (300.0, -500.0, 60.0), (-900.0, 900.0, 500.0)] {
            let eye = DVec3::new(x, land.height(x, z) + above, z);
            let camera = camera(eye, DVec3::new(0.3, -0.2, -1.0));
            let patches = ground.select(&land, &camera, 0.5);
            let all = (land.points[0] as usize - 1) / PATCH as usize;
            assert!(patches.len() < all * all, "{}", patches.len());
            let (mut worst, mut seen) = (0.0f64, 0);
            for k in 0..40_000u32 {
                let [x, z] = [k % 200, k / 200].map(|v| f64::from(v) * 10.0 - 997.0);
                let Some(height) = drawn(&land, &patches, x, z) else { continue };
                let place = DVec3::new(x, land.height(x, z), z);
                let pixels = camera.pixels_per_unit(place.distance(eye));
                worst = worst.max((height - place.y).abs() * pixels);
                seen += 1;
            }
            assert!(worst <= 0.5 && worst > 0.05 && seen > 1000, "{worst}, {seen}");
        }
    }

    #[test]
    fn what_is_seen_is_drawn() {
        let land = diamond_square(&Fractal { cells: 128, range: 40.0, smoothness: 1.0 }, 900.0, 8);
        let ground = Ground::new(&land);
        let camera = camera(DVec3::new(0.0, 120.0, 440.0), DVec3::new(0.1, -0.3, -1.0));
        let patches = ground.select(&land, &camera, 0.5);
        let mut seen = 0;
        for k in 0..10_000u32 {
            let [x, z] = [k % 100, k / 100].map(|v| f64::from(v) * 9.0 - 449.0);
            let (px, py, depth) = camera.project(DVec3::new(x, land.height(x, z), z));
            if depth > 0.0 && (0.0..1280.0).contains(&px) && (0.0..720.0).contains(&py) {
                assert!(drawn(&land, &patches, x, z).is_some(), "{x}, {z}");
                seen += 1;
            }
        }
        assert!(seen > 1000, "{seen}");
        assert!(patches.windows(2).all(|w| w[0].stride <= 64 && w[1].stride <= 64));
    }

    #[test]
    fn lands_of_any_size_have_a_quadtree() {
        for points in [[2, 2], [17, 33], [100, 37]] {
            let count = points[0] as usize * points[1] as usize;
            let heights = (0..count).map(|i| (i % 7) as f32).collect();
            let land = Land { points, size: [50.0, 20.0], heights };
            let ground = Ground::new(&land);
            let camera = camera(DVec3::new(0.0, 90.0, 0.0), -DVec3::Y);
            let patches = ground.select(&land, &camera, 0.0);
            assert!(patches.iter().all(|p| p.stride == 1));
            assert_eq!(drawn(&land, &patches, 3.0, 2.0), Some(land.height(3.0, 2.0)));
        }
    }
}
