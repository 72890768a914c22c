//! Triangles into the sample buffer, in fixed point, a block of samples at a time.

use super::blocks::{BLOCK, LANES, NOTHING, Samples};
use super::prepare::{Cluster, Prepared};
use super::{CaptureScene, FixedProjection};
use crate::opacity::covers;
use forest_soup::CoverageMap;
use glam::Vec2;

/// A sample's width in fixed point.
pub(super) const ONE: i32 = 1 << BITS;
const BITS: i32 = 8;

/// A block's width in fixed point.
const BLOCK_ONE: i32 = ONE * BLOCK as i32;

/// Corners are within this, in fixed point.
pub(super) const LIMIT: i32 = 1 << 26;

/// A projected vertex: fixed-point sample coordinates, x right and y down, and depth.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Vertex {
    pub(super) x: i32,
    pub(super) y: i32,
    pub(super) z: f32,
}

/// Where the samples of blocks lie, in fixed point from the block's corner. Each row of a pixel's
/// samples is moved to the right by another part of a sample, so that upright edges have fine
/// steps.
pub(super) struct Places {
    x: Vec<[i32; LANES]>,
    y: [i32; LANES],
}

impl Places {
    /// For `samples` a side of a pixel: 1, or a multiple of the block's.
    pub(super) fn new(samples: u32) -> Self {
        let phases = samples.div_ceil(BLOCK);
        let row = |lane: usize| lane as i32 / BLOCK as i32;
        let place = |phase: u32, lane: usize| {
            let column = lane as i32 % BLOCK as i32;
            let number = (phase * BLOCK) as i32 + row(lane);
            let shear = if samples == 1 {
                0
            } else {
                (2 * number + 1) * ONE / (2 * samples as i32) - ONE / 2
            };
            column * ONE + ONE / 2 + shear
        };
        Self {
            x: (0..phases).map(|p| std::array::from_fn(|lane| place(p, lane))).collect(),
            y: std::array::from_fn(|lane| row(lane) * ONE + ONE / 2),
        }
    }

    /// Samples of the blocks in a row of blocks.
    #[inline(always)]
    fn of_row(&self, y: u32) -> &[i32; LANES] {
        &self.x[y as usize % self.x.len()]
    }

    /// Fixed-point place of sample (x, y) of the grid.
    pub(super) fn of(&self, x: u32, y: u32) -> [i32; 2] {
        let lane = (y % BLOCK * BLOCK + x % BLOCK) as usize;
        let corner = |v: u32| (v / BLOCK) as i32 * BLOCK_ONE;
        [corner(x) + self.of_row(y / BLOCK)[lane], corner(y) + self.y[lane]]
    }
}

/// A triangle's linear functions.
#[derive(Clone, Copy)]
pub(super) struct Planes {
    origin: [i32; 2],
    /// Corners two and three about the first.
    edges: [[i32; 2]; 2],
    /// Twice the area.
    area: i64,
}

impl Planes {
    /// `None` without area.
    #[inline(always)]
    pub(super) fn new([a, b, c]: [Vertex; 3]) -> Option<Self> {
        let edges = [[b.x - a.x, b.y - a.y], [c.x - a.x, c.y - a.y]];
        let [[bx, by], [cx, cy]] = edges.map(|e| e.map(i64::from));
        let area = bx * cy - cx * by;
        (area != 0).then_some(Self { origin: [a.x, a.y], edges, area })
    }

    /// Area in square samples.
    #[inline(always)]
    pub(super) fn samples(&self) -> f32 {
        self.area.unsigned_abs() as f32 * (0.5 / (ONE * ONE) as f32)
    }

    /// What a linear function gains along x and y from gains towards corners two and three.
    #[inline(always)]
    fn slopes(&self, [b, c]: [f32; 2]) -> [f32; 2] {
        let [[bx, by], [cx, cy]] = self.edges.map(|e| e.map(|v| v as f32));
        let scale = 1.0 / self.area as f32;
        [(b * cy - c * by) * scale, (c * bx - b * cx) * scale]
    }

    /// Barycentric weights at a place.
    pub(super) fn weights(&self, [x, y]: [i32; 2]) -> [f32; 3] {
        let (x, y) = ((x - self.origin[0]) as f32, (y - self.origin[1]) as f32);
        let ([bx, by], [cx, cy]) = (self.slopes([1.0, 0.0]), self.slopes([0.0, 1.0]));
        let (b, c) = (bx * x + by * y, cx * x + cy * y);
        [1.0 - b - c, b, c]
    }
}

/// The edge functions of a triangle: ≥ 0 inside, for every edge. On a shared edge those of both
/// triangles are exact negatives, so that no sample falls between.
struct Edges {
    /// A corner on each edge.
    at: [[i32; 2]; 3],
    /// Gain along x and y.
    gain: [[i32; 2]; 3],
    /// The most that a value gains from a block's corner to one of its samples, which the shear
    /// moves by half a sample at most.
    reach: [i64; 3],
}

impl Edges {
    #[inline(always)]
    fn new([a, b, c]: [Vertex; 3], area: i64) -> Self {
        let sign = if area < 0 { -1 } else { 1 };
        let ends = [(a, b), (b, c), (c, a)];
        let gain = ends.map(|(p, q)| [(p.y - q.y) * sign, (q.x - p.x) * sign]);
        let most = |g: i32| i64::from(g.max(0)) * i64::from(BLOCK_ONE);
        Self {
            at: ends.map(|(p, _)| [p.x, p.y]),
            gain,
            reach: gain.map(|[gx, gy]| most(gx) + most(gy)),
        }
    }

    /// Values at a place.
    #[inline(always)]
    fn at(&self, x: i32, y: i32) -> [i64; 3] {
        std::array::from_fn(|k| {
            let ([px, py], [gx, gy]) = (self.at[k], self.gain[k]);
            i64::from(gx) * i64::from(x - px) + i64::from(gy) * i64::from(y - py)
        })
    }

    /// Gains from a block to the next on its right.
    #[inline(always)]
    fn steps(&self) -> [i64; 3] {
        self.gain.map(|[gx, _]| i64::from(gx) * i64::from(BLOCK_ONE))
    }

    /// Gains from a block's corner to its samples; wrapped where an edge is [`MOST_GAIN`] long.
    #[inline(always)]
    fn lanes(&self, xs: &[i32; LANES], ys: &[i32; LANES]) -> [[i32; LANES]; 3] {
        let mut out = [[0i32; LANES]; 3];
        for ([gx, gy], out) in self.gain.into_iter().zip(&mut out) {
            for lane in 0..LANES {
                out[lane] = gx.wrapping_mul(xs[lane]).wrapping_add(gy.wrapping_mul(ys[lane]));
            }
        }
        out
    }

    /// Negative for samples that are outside of a block whose corner has the values `corner`.
    #[inline(always)]
    fn outside(corner: [i64; 3], lanes: &[[i32; LANES]; 3]) -> [i32; LANES] {
        // Within the block an edge that passes near it has small values; of one far away only the
        // sign counts.
        let [a, b, c] = corner.map(|v| v.clamp(-(1 << 30), 1 << 30) as i32);
        let mut sign = [0i32; LANES];
        for lane in 0..LANES {
            sign[lane] = (a + lanes[0][lane]) | (b + lanes[1][lane]) | (c + lanes[2][lane]);
        }
        sign
    }

    /// The same for edges of any length.
    #[inline(never)]
    fn outside_wide(&self, corner: [i64; 3], xs: &[i32; LANES], ys: &[i32; LANES]) -> [i32; LANES] {
        let value = |k: usize, lane: usize| {
            let [gx, gy] = self.gain[k].map(i64::from);
            corner[k] + gx * i64::from(xs[lane]) + gy * i64::from(ys[lane])
        };
        std::array::from_fn(|lane| -i32::from((0..3).any(|k| value(k, lane) < 0)))
    }

    /// Whether a block, by the values at its corner, lies outside of an edge.
    #[inline(always)]
    fn misses(&self, corner: [i64; 3]) -> bool {
        let [a, b, c] = std::array::from_fn(|k| corner[k] + self.reach[k]);
        (a | b | c) < 0
    }
}

/// What is drawn lies between two depths (bits), the front one included.
#[derive(Clone, Copy)]
pub(super) struct Slab {
    pub(super) front: i32,
    pub(super) back: i32,
}

impl Slab {
    /// Everything.
    pub(super) const ALL: Self = Self { front: 0, back: NOTHING };

    /// From one depth to another, from the scene's front.
    pub(super) fn new(front: f32, back: f32) -> Self {
        Self { front: depth_bits(front.max(0.0)), back: depth_bits(back.max(0.0)) }
    }

    /// Whether what reaches over these depths lies outside.
    #[inline(always)]
    pub(super) fn misses(&self, nearest: f32, farthest: f32) -> bool {
        depth_bits(nearest.max(0.0)) >= self.back || depth_bits(farthest.max(0.0)) < self.front
    }
}

/// Gains within this keep the values of a block in 32 bits: for edges of up to 1024 samples.
const MOST_GAIN: i32 = 1 << 18;

impl CaptureScene<'_> {
    /// Whether all samples that a cluster might win show something nearer than `nearest`.
    #[inline(always)]
    pub(super) fn is_cluster_hidden(
        &self,
        c: &Cluster,
        projection: &FixedProjection,
        nearest: f32,
        samples: &Samples,
    ) -> bool {
        let middle = projection.vertex(c.center);
        let reach = ((c.radius * projection.scale) as i32).saturating_add(ONE);
        let range = |at: i32, n| blocks(at.saturating_sub(reach), at.saturating_add(reach), n);
        match (range(middle.x, samples.size[0]), range(middle.y, samples.size[1])) {
            (Some(columns), Some(rows)) => {
                samples.is_hidden(columns, rows, depth_bits(nearest.max(0.0)))
            }
            _ => true,
        }
    }

    /// Draws triangle number `i`.
    #[inline(always)]
    pub(super) fn fill(
        &self,
        i: u32,
        vertices: &[Vertex],
        places: &Places,
        slab: Slab,
        samples: &mut Samples,
    ) {
        let corners = self.corners[i as usize];
        let [a, b, c] = corners.map(|v| vertices[v as usize]);
        let (left, right) = (a.x.min(b.x).min(c.x), a.x.max(b.x).max(c.x));
        let (top, bottom) = (a.y.min(b.y).min(c.y), a.y.max(b.y).max(c.y));
        let columns = blocks(left - ONE / 2, right + ONE / 2, samples.size[0]);
        let rows = blocks(top, bottom, samples.size[1]);
        let (Some(columns), Some(rows)) = (columns, rows) else { return };
        let Some(planes) = Planes::new([a, b, c]) else { return };
        let t = &self.triangles[i as usize];
        let coverage = t.translucent.then(|| self.coverage(t, corners, &planes));
        let depth = DepthPlane::new(&planes, [a.z, b.z, c.z]);
        let nearest = depth_bits(depth.range[0]);
        let edges = Edges::new([a, b, c], planes.area);
        let wide = edges.gain.iter().flatten().any(|g| g.abs() > MOST_GAIN);
        samples.touch(columns, rows);
        let steps = edges.steps();
        let (mut lanes, mut slopes) = ([[0; LANES]; 3], [0.0; LANES]);
        for y in rows[0]..=rows[1] {
            let (xs, ys) = (places.of_row(y), &places.y);
            // Samples lie alike in all rows of blocks, unless pixels are several blocks high.
            if y == rows[0] || places.x.len() > 1 {
                (lanes, slopes) = (edges.lanes(xs, ys), depth.lanes(xs, ys));
            }
            let top = y as i32 * BLOCK_ONE;
            let mut corner = edges.at(columns[0] as i32 * BLOCK_ONE, top);
            for x in columns[0]..=columns[1] {
                let at = [x as i32 * BLOCK_ONE, top];
                let here = corner;
                corner = std::array::from_fn(|k| corner[k] + steps[k]);
                let number = samples.number(x, y);
                if samples.farthest[number] < nearest || edges.misses(here) {
                    continue;
                }
                let outside = if wide {
                    edges.outside_wide(here, xs, ys)
                } else {
                    Edges::outside(here, &lanes)
                };
                let depths = depth.block(at, &slopes);
                let block = samples.block_mut(number);
                // The sign bit of each says whether the triangle wins the sample.
                let mut wins = [0i32; LANES];
                for lane in 0..LANES {
                    let inside = !(depths[lane] - slab.front) & (depths[lane] - slab.back);
                    wins[lane] = !outside[lane] & inside & (depths[lane] - block.depth[lane]);
                }
                if let Some(coverage) = &coverage {
                    for (lane, wins) in wins.iter_mut().enumerate().filter(|(_, w)| **w < 0) {
                        let (column, row) = (lane as u32 % BLOCK, lane as u32 / BLOCK);
                        let grid = [x * BLOCK + column, y * BLOCK + row];
                        let place = [at[0] + xs[lane], at[1] + ys[lane]];
                        *wins = -i32::from(coverage.covers(&planes, place, grid));
                    }
                }
                let mut farthest = 0;
                for lane in 0..LANES {
                    let mask = wins[lane] >> 31;
                    let depth = (depths[lane] & mask) | (block.depth[lane] & !mask);
                    block.depth[lane] = depth;
                    let winner = (i as i32 & mask) | (block.triangle[lane] as i32 & !mask);
                    block.triangle[lane] = winner as u32;
                    farthest = farthest.max(depth);
                }
                samples.farthest[number] = farthest;
            }
        }
    }

    #[inline(always)]
    fn coverage<'t>(&'t self, t: &'t Prepared, corners: [u32; 3], planes: &Planes) -> Coverage<'t> {
        let [a, b, c] = corners.map(|v| self.uvs[v as usize]);
        match self.coverage.get(usize::from(t.material)) {
            Some(Some(map)) => {
                let level = map.level(t.texels / planes.samples());
                let [ux, uy] = planes.slopes([b.x - a.x, c.x - a.x]);
                let [vx, vy] = planes.slopes([b.y - a.y, c.y - a.y]);
                let slopes = [Vec2::new(ux, vx), Vec2::new(uy, vy)];
                Coverage::Map { map, level, uv: a, slopes, id: t.id }
            }
            _ => Coverage::Exact { scene: self, uvs: [a, b, c], t },
        }
    }

    #[inline]
    pub(super) fn tint(&self, t: &Prepared, w: [f32; 3]) -> [f32; 4] {
        if self.soup.colors.is_empty() {
            return [1.0; 4];
        }
        let [a, b, c] = self.soup.triangles[t.id as usize].map(|v| self.soup.colors[v as usize]);
        std::array::from_fn(|k| a[k] * w[0] + b[k] * w[1] + c[k] * w[2])
    }
}

/// First and last of `count` blocks with samples from `from` to `to`, in fixed point.
#[inline(always)]
fn blocks(from: i32, to: i32, count: u32) -> Option<[u32; 2]> {
    // A block's outermost samples lie half a sample within it.
    let first = (from + ONE / 2 - 1).div_euclid(BLOCK_ONE).max(0);
    let last = (to - ONE / 2).div_euclid(BLOCK_ONE).min(count as i32 - 1);
    (first <= last).then_some([first as u32, last as u32])
}

/// Where a translucent triangle covers.
enum Coverage<'a> {
    /// By its texture, at the resolution of the samples: texture coordinates at the first corner
    /// and their gains along x and y.
    Map { map: &'a CoverageMap, level: usize, uv: Vec2, slopes: [Vec2; 2], id: u32 },
    /// By the exact rule.
    Exact { scene: &'a CaptureScene<'a>, uvs: [Vec2; 3], t: &'a Prepared },
}

impl Coverage<'_> {
    /// Whether sample `grid`, at `place` in fixed point, is covered by the hash rule.
    #[inline(always)]
    fn covers(&self, planes: &Planes, place: [i32; 2], [x, y]: [u32; 2]) -> bool {
        match self {
            Coverage::Map { map, level, uv, slopes, id } => {
                let [dx, dy] = [place[0] - planes.origin[0], place[1] - planes.origin[1]];
                let uv = *uv + slopes[0] * dx as f32 + slopes[1] * dy as f32;
                let opacity = map.nearest(*level, uv);
                opacity > 0 && covers(*id, x, y, opacity)
            }
            Coverage::Exact { scene, uvs: [a, b, c], t } => {
                let w = planes.weights(place);
                let surface = scene.surfaces.get(t.material).expect("as when it was prepared");
                let uv = *a * w[0] + *b * w[1] + *c * w[2];
                let coverage = surface.coverage(uv, scene.tint(t, w)[3]);
                covers(t.id, x, y, (coverage * 255.0).round() as u8)
            }
        }
    }
}

/// Bits of a depth, which is not negative: as integers they sort as the depths do.
#[inline(always)]
fn depth_bits(depth: f32) -> i32 {
    depth.to_bits() as i32
}

/// Depth over a triangle.
struct DepthPlane {
    origin: [i32; 2],
    first: f32,
    slopes: [f32; 2],
    range: [f32; 2],
}

impl DepthPlane {
    #[inline(always)]
    fn new(planes: &Planes, [a, b, c]: [f32; 3]) -> Self {
        let range = [a.min(b).min(c), a.max(b).max(c)];
        Self { origin: planes.origin, first: a, slopes: planes.slopes([b - a, c - a]), range }
    }

    /// Gains from a block's corner to its samples.
    #[inline(always)]
    fn lanes(&self, xs: &[i32; LANES], ys: &[i32; LANES]) -> [f32; LANES] {
        let mut out = [0.0; LANES];
        for lane in 0..LANES {
            out[lane] = self.slopes[0] * xs[lane] as f32 + self.slopes[1] * ys[lane] as f32;
        }
        out
    }

    /// Bits of the depths at the samples of the block at `at`.
    #[inline(always)]
    fn block(&self, at: [i32; 2], lanes: &[f32; LANES]) -> [i32; LANES] {
        let [x, y] = [(at[0] - self.origin[0]) as f32, (at[1] - self.origin[1]) as f32];
        let corner = self.first + self.slopes[0] * x + self.slopes[1] * y;
        let mut out = [0; LANES];
        for lane in 0..LANES {
            let z = corner + lanes[lane];
            // Slivers extrapolate wildly: stay within the corners' depths.
            let z = if z > self.range[0] { z } else { self.range[0] };
            out[lane] = depth_bits(if z < self.range[1] { z } else { self.range[1] });
        }
        out
    }
}
