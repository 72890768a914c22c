//! Pictures that know what is behind what they show.

use super::fill::Slab;
use super::{Buffers, CaptureScene, Vertex};
use forest_soup::{Camera, linear_to_srgb8};

/// What a ray meets first in a slab.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeepHit {
    /// Depth along the camera's axis from its eye, in world units.
    pub depth: f32,
    /// Its colour, sRGB.
    pub rgb: [u8; 3],
}

/// A parallel picture of one sample a pixel, cut into slabs of equal thickness: of each slab, the
/// first thing that a ray meets in it. Of thin slabs little hides anything else.
#[derive(Clone, Debug, PartialEq)]
pub struct DeepPicture {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Depth of the front of the first slab.
    pub front: f64,
    /// Thickness of slabs, in world units.
    pub thickness: f64,
    /// Where the hits of each pixel start, row 0 on top; and one more.
    first: Vec<u32>,
    hits: Vec<DeepHit>,
}

impl DeepPicture {
    /// What the ray through the middle of pixel `y · width + x` meets, from front to back: one hit
    /// a slab at most.
    #[inline]
    pub fn hits(&self, pixel: usize) -> &[DeepHit] {
        &self.hits[self.first[pixel] as usize..self.first[pixel + 1] as usize]
    }

    /// Number of the slab at a depth.
    #[inline]
    pub fn slab(&self, depth: f64) -> i64 {
        ((depth - self.front) / self.thickness).floor() as i64
    }
}

impl CaptureScene<'_> {
    /// The deep picture that a parallel `camera` sees in slabs of `thickness` world units.
    ///
    /// # Panics
    /// If the camera is not parallel, or the thickness not above 0.
    pub fn deep(&self, camera: &Camera, thickness: f64, buffers: &mut Buffers) -> DeepPicture {
        assert!(thickness > 0.0, "slabs {thickness} thick");
        let grid = self.grid(camera, 1);
        buffers.vertices.resize(self.positions.len(), Vertex::default());
        let count = (2.002 * self.radius / thickness).ceil().max(1.0) as u32;
        let mut found: Vec<(u32, DeepHit)> = Vec::new();
        let wall = |slab: u32| (f64::from(slab) * thickness) as f32;
        for slab in 0..count {
            self.draw_slab(&grid, Slab::new(wall(slab), wall(slab + 1)), buffers);
            let samples = &buffers.samples;
            let [columns, rows] = samples.touched_samples(grid.size);
            for (y, x) in rows.flat_map(|y| columns.clone().map(move |x| (y, x))) {
                if let Some((depth, triangle)) = samples.get(x, y) {
                    let shaded = self.sample(&grid, &buffers.vertices, [x, y], triangle, depth);
                    let depth = (grid.depth + f64::from(depth)) as f32;
                    let rgb = shaded.rgb.map(linear_to_srgb8);
                    found.push((y * grid.size[0] + x, DeepHit { depth, rgb }));
                }
            }
        }
        let [width, height] = grid.size;
        let (first, hits) = by_pixel((width * height) as usize, &found);
        DeepPicture { width, height, front: grid.depth, thickness, first, hits }
    }
}

/// Hits by pixel, otherwise in their order.
fn by_pixel(pixels: usize, found: &[(u32, DeepHit)]) -> (Vec<u32>, Vec<DeepHit>) {
    let mut first = vec![0u32; pixels + 1];
    for (pixel, _) in found {
        first[*pixel as usize + 1] += 1;
    }
    for i in 1..first.len() {
        first[i] += first[i - 1];
    }
    let mut next = first.clone();
    let mut hits = vec![DeepHit { depth: 0.0, rgb: [0; 3] }; found.len()];
    for (pixel, hit) in found {
        let at = &mut next[*pixel as usize];
        hits[*at as usize] = *hit;
        *at += 1;
    }
    (first, hits)
}
