//! How much of the sky each triangle sees, from the depth of captures themselves.

use super::fill::Vertex;
use super::{Buffers, CaptureScene};
use forest_soup::{Camera, Projection};
use glam::DVec3;
use rayon::prelude::*;

/// Directions that the sky is seen from: spread over the whole sphere, as the sky of
/// [`crate::Light::Sun`] is.
const DIRECTIONS: u32 = 128;

/// Pixels across the depth maps.
const SIDE: u32 = 512;

/// A place must lie this many pixels of the depth map behind another to be hidden by it.
const BIAS: f64 = 1.0;

/// Nor more than this many times as far for a slanting triangle.
const MOST_SLANT: f32 = 8.0;

/// Barycentric coordinates of the three places at which a triangle looks at the sky.
const PLACES: [[f32; 3]; 3] = {
    let (near, far) = (2.0 / 3.0, 1.0 / 6.0);
    [[near, far, far], [far, near, far], [far, far, near]]
};

/// The cosine-weighted share of the sky that the triangles of a scene see: on both faces, at three
/// places each, linear between them.
#[derive(Clone, Debug)]
pub struct Skylight(Vec<[[f32; 3]; 2]>);

impl Skylight {
    /// Mean over a face of triangle `i`.
    #[inline]
    pub(super) fn mean(&self, i: u32, front: bool) -> f32 {
        let [a, b, c] = self.0[i as usize][usize::from(front)];
        (a + b + c) / 3.0
    }

    /// At barycentric coordinates `w` of a face of triangle `i`.
    #[inline]
    pub(super) fn at(&self, i: u32, front: bool, w: [f32; 3]) -> f32 {
        let values = self.0[i as usize][usize::from(front)];
        // The linear function through the three places.
        let sum: f32 = (0..3).map(|k| (2.0 * w[k] - 1.0 / 3.0) * values[k]).sum();
        sum.clamp(0.0, 1.0)
    }
}

/// Sums over directions of cosines, and of those from which a place is seen.
type Sums = Vec<[[[f32; 2]; 3]; 2]>;

impl CaptureScene<'_> {
    /// Measures the sky that every triangle sees; captures show it from now on.
    pub fn with_skylight(mut self) -> Self {
        // Sums of fixed groups of directions, added in order: no result depends on the threads.
        const GROUP: u32 = 16;
        let groups: Vec<Sums> = (0..DIRECTIONS / GROUP)
            .into_par_iter()
            .map(|g| {
                let mut buffers = Buffers::default();
                let mut sums = vec![[[[0.0; 2]; 3]; 2]; self.triangles.len()];
                for d in g * GROUP..(g + 1) * GROUP {
                    self.look(direction(d), &mut buffers, &mut sums);
                }
                sums
            })
            .collect();
        let mut sky = Vec::with_capacity(self.triangles.len());
        for i in 0..self.triangles.len() {
            sky.push([0, 1].map(|face| {
                [0, 1, 2].map(|k| {
                    let [seen, all] = groups.iter().fold([0.0, 0.0], |s: [f32; 2], g| {
                        let [seen, all] = g[i][face][k];
                        [s[0] + seen, s[1] + all]
                    });
                    if all > 0.0 { seen / all } else { 1.0 }
                })
            }));
        }
        self.skylight = Some(Skylight(sky));
        self
    }

    /// Adds what is seen from `from`.
    fn look(&self, from: DVec3, buffers: &mut Buffers, sums: &mut Sums) {
        let eye = self.middle + from * (2.0 * self.radius);
        let projection = Projection::Orthographic { height: 2.0 * self.radius };
        let camera = Camera::new(eye, -from, projection, [SIDE; 2]);
        let grid = self.draw(&camera, 1, buffers);
        let to_sky = from.as_vec3();
        let bias = (BIAS * grid.step) as f32;
        for ((i, t), sum) in (0..).zip(&self.triangles).zip(sums) {
            let cos = t.normal.dot(to_sky);
            // The face that is turned to this part of the sky: as the triangle itself is turned.
            let face = usize::from(t.own.dot(to_sky) >= 0.0);
            let cos = if face == 1 { cos } else { -cos };
            if cos <= 0.0 {
                continue;
            }
            // A slanting triangle is as much nearer at the other side of a pixel.
            let slant = 1.0 / t.own.dot(to_sky).abs().max(1.0 / MOST_SLANT);
            let vertex = |v: u32| grid.projection.vertex(self.positions[v as usize]);
            let corners = self.corners[i as usize].map(vertex);
            for (k, place) in sum[face].iter_mut().enumerate() {
                place[1] += cos;
                if self.is_seen(i, corners, PLACES[k], buffers, SIDE, bias * slant) {
                    place[0] += cos;
                }
            }
        }
    }

    /// Whether nothing but triangle `id` itself lies before the place `w` of it.
    fn is_seen(
        &self,
        id: u32,
        corners: [Vertex; 3],
        w: [f32; 3],
        buffers: &Buffers,
        side: u32,
        bias: f32,
    ) -> bool {
        let mix =
            |of: fn(&Vertex) -> f32| -> f32 { corners.iter().zip(w).map(|(v, w)| of(v) * w).sum() };
        let pixel = |v: f32| (v as i32) >> 8;
        let (x, y) = (pixel(mix(|v| v.x as f32)), pixel(mix(|v| v.y as f32)));
        if x < 0 || y < 0 || x >= side as i32 || y >= side as i32 {
            return true;
        }
        let hit = buffers.samples.get(x as u32, y as u32);
        hit.is_none_or(|(nearest, i)| i == id || mix(|v| v.z) <= nearest + bias)
    }
}

/// Direction number `i` of [`DIRECTIONS`], spread by the golden angle.
fn direction(i: u32) -> DVec3 {
    let y = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(DIRECTIONS);
    let (sin, cos) = (f64::from(i) * 2.399_963_229_728_653).sin_cos();
    let flat = (1.0 - y * y).sqrt();
    DVec3::new(sin * flat, y, cos * flat)
}
