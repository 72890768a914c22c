//! Many parallel views of one soup, as fast as may be: what view atlases are captured with.
//!
//! [`CaptureScene`] sorts a soup once and draws any number of views of it, one thread a view. It
//! differs from [`crate::rasterize`] in what makes it fast: corners are snapped to 1/256 of a
//! sample, so that edges are exact integers; the samples of a texel lie on a sheared grid instead
//! of random places; a triangle smaller than a texel shows its mean colour and normal. Partial
//! opacity follows the same hash rule.

mod blocks;
mod deep;
mod fill;
mod prepare;
mod resolve;
mod sky;

pub use deep::{DeepHit, DeepPicture};
pub use sky::Skylight;

use crate::picture::Picture;
use crate::surface::Surfaces;
use blocks::{BLOCK, Samples};
use fill::{Places, Slab, Vertex};
use forest_soup::{AlphaMode, Camera, CoverageMap, Projection, TriangleSoup};
use glam::{DVec3, Vec2, Vec3};
use prepare::{Cluster, Prepared};

/// Sides of a picture's sample grid are at most this: fixed-point corners must fit 32 bits.
const MAX_GRID: u32 = 1 << 15;

/// One picture of an atlas.
#[derive(Clone, Debug, PartialEq)]
pub struct Capture {
    /// Colour, coverage, depth and normal; the depth counts from the camera's eye.
    pub picture: Picture,
    /// Share of the sky that is seen, cosine-weighted about the normal, mean over all samples:
    /// premultiplied by coverage. Empty if nobody asked.
    pub sky: Vec<f32>,
}

/// What can be captured: a soup, or a level of it that looks the same at that size.
pub trait Subject: Sync {
    /// The picture that a parallel `camera` sees, with at least `samples × samples` samples a pixel.
    fn capture(&self, camera: &Camera, samples: u32, buffers: &mut Buffers) -> Capture;
}

/// Memory that one thread's views share.
#[derive(Default)]
pub struct Buffers {
    vertices: Vec<Vertex>,
    samples: Samples,
}

/// A soup, sorted and shaded for many parallel views.
pub struct CaptureScene<'a> {
    soup: &'a TriangleSoup,
    surfaces: &'a Surfaces,
    triangles: Vec<Prepared>,
    /// Numbers of their vertices in the scene.
    corners: Vec<[u32; 3]>,
    clusters: Vec<Cluster>,
    /// Used vertices, about `middle`.
    positions: Vec<Vec3>,
    /// Texture coordinates of used vertices.
    uvs: Vec<Vec2>,
    /// Coverage of each material; `None` where the exact rule must be asked.
    coverage: Vec<Option<CoverageMap>>,
    /// Middle of the box, in the world.
    middle: DVec3,
    /// Half the diagonal of the box.
    radius: f64,
    skylight: Option<Skylight>,
}

/// A view's sample grid over the scene.
struct Grid {
    /// Samples along a side of a pixel.
    samples: u32,
    /// Samples across and down.
    size: [u32; 2],
    /// World length of a sample.
    step: f64,
    /// Depth of the scene's front.
    depth: f64,
    /// Towards the eye.
    back: Vec3,
    projection: FixedProjection,
    places: Places,
}

impl<'a> CaptureScene<'a> {
    /// Sorts and shades `soup`, whose materials `surfaces` holds. Triangles with corners that are
    /// not finite are left out.
    ///
    /// # Panics
    /// If the soup breaks its own rules ([`TriangleSoup::validate`]).
    pub fn new(soup: &'a TriangleSoup, surfaces: &'a Surfaces) -> Self {
        let bounds = soup.bounds();
        let empty = bounds.is_empty();
        let middle = if empty { DVec3::ZERO } else { bounds.center() };
        let prepare::Sorted { triangles, corners, clusters, sources } =
            prepare::prepare(soup, surfaces, middle);
        let position = |&v: &u32| (soup.positions[v as usize].as_dvec3() - middle).as_vec3();
        let uv = |&v: &u32| soup.uvs.get(v as usize).copied().unwrap_or(Vec2::ZERO);
        let coverage = |m: &forest_soup::Material| match (m.texture, m.alpha_mode) {
            (None, _) | (_, AlphaMode::Opaque) => None,
            (Some(t), _) => Some(CoverageMap::new(&soup.textures[t as usize], m)),
        };
        // Vertex alpha changes what an alpha test shows.
        let plain = soup.colors.iter().all(|c| c[3] == 1.0);
        let materials: &[_] = if plain { &soup.materials } else { &[] };
        Self {
            soup,
            surfaces,
            triangles,
            corners,
            clusters,
            positions: sources.iter().map(position).collect(),
            uvs: sources.iter().map(uv).collect(),
            coverage: materials.iter().map(coverage).collect(),
            middle: soup.origin + middle,
            radius: if empty { 0.0 } else { bounds.half_diagonal() },
            skylight: None,
        }
    }

    /// Draws the scene into the sample buffer of `buffers`.
    fn draw(&self, camera: &Camera, samples: u32, buffers: &mut Buffers) -> Grid {
        let grid = self.grid(camera, samples);
        buffers.vertices.resize(self.positions.len(), Vertex::default());
        self.draw_slab(&grid, Slab::ALL, buffers);
        grid
    }

    /// Draws what lies in `slab` into the sample buffer of `buffers`, whose vertices are allocated.
    fn draw_slab(&self, grid: &Grid, slab: Slab, buffers: &mut Buffers) {
        buffers.samples.clear(grid.size);
        // Compiled for the vector instructions of several machines; the results are the same.
        pulp::Arch::new().dispatch(FillAll { scene: self, grid, slab, buffers });
    }

    /// The sample grid of a view.
    fn grid(&self, camera: &Camera, samples: u32) -> Grid {
        let Projection::Orthographic { height } = camera.projection else {
            panic!("captures are parallel views");
        };
        let largest = camera.width.max(camera.height).max(1);
        // Pixels are blocks, but for the single samples of depth maps.
        let most = (MAX_GRID / largest / BLOCK * BLOCK).max(1);
        let samples = if samples <= 1 { 1 } else { samples.next_multiple_of(BLOCK).min(most) };
        let size = [camera.width * samples, camera.height * samples];
        let offset = self.middle - camera.eye;
        let step = height / f64::from(size[1]);
        let projection = FixedProjection::new(camera, size, step, offset, self.radius);
        Grid {
            samples,
            size,
            step,
            depth: offset.dot(camera.forward) - 1.001 * self.radius,
            back: -camera.forward.as_vec3(),
            projection,
            places: Places::new(samples),
        }
    }

    /// Draws all triangles, cluster by cluster from front to back: what is hidden is mostly met when
    /// it is hidden already.
    #[inline(always)]
    fn fill_all(&self, grid: &Grid, slab: Slab, Buffers { vertices, samples }: &mut Buffers) {
        let projection = &grid.projection;
        let mut order: Vec<(f32, u32)> =
            (0..).zip(&self.clusters).map(|(i, c)| (projection.nearest(c), i)).collect();
        order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for (nearest, c) in order {
            let cluster = &self.clusters[c as usize];
            if slab.misses(nearest, nearest + 2.0 * cluster.radius) {
                continue;
            }
            if self.is_cluster_hidden(cluster, projection, nearest, samples) {
                continue;
            }
            let range = cluster.vertices.start as usize..cluster.vertices.end as usize;
            for (to, p) in vertices[range.clone()].iter_mut().zip(&self.positions[range]) {
                *to = projection.vertex(*p);
            }
            for i in cluster.triangles.clone() {
                self.fill(i, vertices, &grid.places, slab, samples);
            }
        }
    }
}

/// [`CaptureScene::fill_all`], for `pulp`: a closure would not be inlined.
struct FillAll<'a, 's> {
    scene: &'a CaptureScene<'s>,
    grid: &'a Grid,
    slab: Slab,
    buffers: &'a mut Buffers,
}

impl pulp::WithSimd for FillAll<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        self.scene.fill_all(self.grid, self.slab, self.buffers);
    }
}

/// From the scene to fixed-point sample coordinates.
struct FixedProjection {
    right: Vec3,
    down: Vec3,
    forward: Vec3,
    x: f32,
    y: f32,
    /// Of a world unit.
    scale: f32,
    /// Depth of the scene's middle from its front: vertices have no negative depth.
    front: f32,
}

impl FixedProjection {
    /// For a scene whose middle is `offset` from the eye, on samples `step` wide.
    fn new(camera: &Camera, size: [u32; 2], step: f64, offset: DVec3, radius: f64) -> Self {
        let scale = f64::from(fill::ONE) / step;
        let half = |n: u32| f64::from(n) * 0.5 * f64::from(fill::ONE);
        Self {
            right: (camera.right * scale).as_vec3(),
            down: (-camera.up * scale).as_vec3(),
            forward: camera.forward.as_vec3(),
            x: (half(size[0]) + offset.dot(camera.right) * scale) as f32,
            y: (half(size[1]) - offset.dot(camera.up) * scale) as f32,
            scale: scale as f32,
            front: 1.001 * radius as f32,
        }
    }

    #[inline(always)]
    fn vertex(&self, p: Vec3) -> Vertex {
        // What lies far outside is pulled near: it is not seen either way. (`as` saturates.)
        let limit = |v: f32| (v.round_ties_even() as i32).clamp(-fill::LIMIT, fill::LIMIT);
        Vertex {
            x: limit(p.dot(self.right) + self.x),
            y: limit(p.dot(self.down) + self.y),
            z: p.dot(self.forward) + self.front,
        }
    }

    /// Depth from the scene's front that nothing of a cluster is nearer than.
    #[inline(always)]
    fn nearest(&self, c: &Cluster) -> f32 {
        c.center.dot(self.forward) + self.front - c.radius
    }
}

impl Subject for CaptureScene<'_> {
    fn capture(&self, camera: &Camera, samples: u32, buffers: &mut Buffers) -> Capture {
        let grid = self.draw(camera, samples, buffers);
        self.resolve(&grid, buffers, [camera.width, camera.height])
    }
}

#[cfg(test)]
mod tests;
