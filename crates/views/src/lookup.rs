//! Rays through views: from a sample of a picture to a texel.

use crate::block::{Texels, ViewsBlock, decode_height, decode_normal};
use crate::header::{TileRecord, ViewFrame};
use forest_soup::srgb8_to_linear;
use glam::DVec3;

/// A ray about the centre of the tiles, in units of half a tile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// A place on it.
    pub origin: DVec3,
    /// Its unit direction, away from the eye.
    pub direction: DVec3,
    /// Distance from which it counts: 0 for a ray from an eye, −∞ for a parallel one.
    pub from: f64,
}

/// What a ray finds in a view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Found {
    /// Nothing anywhere along the ray, as far as the view knows.
    Empty,
    /// A surface.
    Hit(Hit),
    /// Nothing where the view sees the ray; but other parts of it lie behind what the view sees.
    Hidden,
}

/// A place on the surface of a tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance along the ray, in units of half a tile.
    pub distance: f64,
    /// Coverage in `0..=1`.
    pub alpha: f32,
    /// Linear RGB, not premultiplied.
    pub rgb: [f32; 3],
    /// World-space unit normal on the side of the view's camera; the view's direction where no
    /// normals are stored.
    pub normal: DVec3,
    /// Share of the sky that is seen; 1 where it is not stored.
    pub sky: f32,
}

/// One view at one level, ready to be asked.
#[derive(Clone, Copy, Debug)]
pub struct ViewSampler<'a> {
    texels: &'a Texels,
    tile: &'a TileRecord,
    frame: &'a ViewFrame,
    /// Texels along the side of the whole tile.
    side: f64,
    /// Radius of the ball that holds the tree, in units of half a tile.
    reach: f64,
}

/// How far before what a view sees another view's hit still counts as behind it, in texels: a
/// texel's depth is the mean of what it shows.
pub const SLACK: f64 = 16.0;

/// Neighbouring texels whose depths differ by at most this many texels show one surface.
pub const JOINED: f64 = 4.0;

/// Most texels that a ray is followed through.
pub const MOST_STEPS: f64 = 256.0;

/// Cosine of a ray with the direction towards a view's camera above which, more than 85° off, the view
/// can say nothing. (A parallel camera that looks straight up from below an upper dome sees nothing.)
pub const BEHIND: f64 = -0.087;

impl<'a> ViewSampler<'a> {
    /// View `view` of `block` at `level`, whose decoded texels are `texels`.
    pub fn new(block: &'a ViewsBlock, texels: &'a Texels, level: usize, view: u32) -> Self {
        let header = &block.header;
        Self {
            texels,
            tile: &block.tiles[level][view as usize],
            frame: &block.frames[view as usize],
            side: f64::from(header.levels[level].texels),
            reach: header.radius / header.half,
        }
    }

    /// What is seen where the ray meets the plane through the centre that faces the view.
    pub fn at_plane(&self, ray: &Ray) -> Found {
        let Some(path) = Path::new(self, ray) else { return Found::Empty };
        let [x, y] = path.texel(0.0);
        match self.shade(x, y, path.distance(0.0)) {
            Some(hit) if hit.alpha > 0.0 && hit.distance >= ray.from => Found::Hit(hit),
            _ => Found::Empty,
        }
    }

    /// Follows the ray through the view's depth to the first texel of coverage above `threshold`
    /// that it meets.
    pub fn along_depth(&self, ray: &Ray, threshold: f32) -> Found {
        let Some(path) = Path::new(self, ray) else { return Found::Empty };
        // Heights towards the camera of the view, from the front of the ball to its back.
        let steps = (2.0 * self.reach * path.speed).ceil().clamp(1.0, MOST_STEPS);
        let stride = -2.0 * self.reach / steps;
        let joined = JOINED * 2.0 / self.side;
        let mut hidden = false;
        // The surface that the ray was before in the texel before this one.
        let mut ahead: Option<f64> = None;
        // Where nothing is stored nothing is met.
        let [top, bottom] = path.heights_within(self.tile);
        let first = ((self.reach - top) / -stride - 1.0).max(0.0) as u32;
        let end = ((self.reach - bottom) / -stride + 1.0).clamp(0.0, steps) as u32;
        for n in first..end {
            let near = self.reach + stride * f64::from(n);
            let far = near + stride;
            if path.distance(far) < ray.from {
                continue; // behind the eye
            }
            let Some(surface) = self.surface(path.texel(0.5 * (near + far)), threshold) else {
                ahead = None;
                continue;
            };
            if far > surface {
                ahead = Some(surface);
                continue; // still before it
            }
            // A surface that rises along the ray is met between two texels.
            let met = ahead.take().is_some_and(|before| surface - before <= joined);
            if near >= surface || met {
                let [x, y] = path.texel(surface.min(near));
                let distance = path.distance(surface.min(near));
                return self.shade(x, y, distance).map_or(Found::Empty, Found::Hit);
            }
            hidden = true;
        }
        if hidden { Found::Hidden } else { Found::Empty }
    }

    /// Whether the place at `distance` along the ray lies behind what the view sees.
    pub fn hides(&self, ray: &Ray, distance: f64, threshold: f32) -> bool {
        let place = ray.origin + ray.direction * distance;
        let ViewFrame { right, up, back } = *self.frame;
        let scale = 0.5 * self.side;
        let texel = [(place.dot(right) + 1.0) * scale, (1.0 - place.dot(up)) * scale];
        self.surface(texel, threshold)
            .is_some_and(|surface| place.dot(back) < surface + SLACK * 2.0 / self.side)
    }

    /// Height towards the view's camera of what texel `at` shows, if it covers more than
    /// `threshold`.
    fn surface(&self, [x, y]: [f64; 2], threshold: f32) -> Option<f64> {
        let i = self.texels.index(self.tile, x.floor() as i32, y.floor() as i32)?;
        let covers = f32::from(self.texels.color[i][3]) > threshold * 255.0;
        covers.then(|| self.reach * decode_height(self.texels.depth[i]))
    }

    /// The four texels about (x, y), in texels of the whole tile.
    fn shade(&self, x: f64, y: f64, distance: f64) -> Option<Hit> {
        let (x, y) = (x - 0.5, y - 0.5);
        let (x0, y0) = (x.floor(), y.floor());
        let (fx, fy) = ((x - x0) as f32, (y - y0) as f32);
        let (x0, y0) = (x0 as i32, y0 as i32);
        let corners = [
            (0, 0, (1.0 - fx) * (1.0 - fy)),
            (1, 0, fx * (1.0 - fy)),
            (0, 1, (1.0 - fx) * fy),
            (1, 1, fx * fy),
        ];
        let (mut alpha, mut rgb, mut weight) = (0.0, [0.0; 3], 0.0);
        let mut best = (0.0, usize::MAX);
        for (dx, dy, share) in corners {
            // What is not stored covers nothing.
            let Some(i) = self.texels.index(self.tile, x0 + dx, y0 + dy) else { continue };
            let [r, g, b, a] = self.texels.color[i];
            alpha += share * f32::from(a) / 255.0;
            for (sum, c) in rgb.iter_mut().zip([r, g, b]) {
                *sum += share * srgb8_to_linear(c);
            }
            weight += share;
            // Normals and sky of the texel that shows most.
            let part = share * (f32::from(a) + 1.0);
            if part > best.0 {
                best = (part, i);
            }
        }
        if weight <= 0.0 {
            return None;
        }
        let stored = |present: bool| if present { best.1 } else { usize::MAX };
        let normal = self.texels.normal.get(stored(best.0 > 0.0));
        let sky = self.texels.sky.get(stored(best.0 > 0.0));
        Some(Hit {
            distance,
            alpha,
            rgb: rgb.map(|c| c / weight),
            normal: normal.map_or(self.frame.back, |n| decode_normal(*n, self.frame)),
            sky: sky.map_or(1.0, |s| f32::from(*s) / 255.0),
        })
    }
}

/// A ray as a view sees it: texel coordinates are linear in the height towards the view's camera.
struct Path {
    /// At height 0.
    start: [f64; 2],
    /// Per unit of height.
    gain: [f64; 2],
    /// Length of `gain`.
    speed: f64,
    /// Distance along the ray at height 0, and its gain.
    distance: [f64; 2],
}

impl Path {
    /// `None` for a ray that comes from behind the view.
    fn new(view: &ViewSampler, ray: &Ray) -> Option<Self> {
        let ViewFrame { right, up, back } = *view.frame;
        let slope = ray.direction.dot(back);
        if slope > BEHIND {
            return None;
        }
        let (h, dh) = (ray.origin.dot(back), 1.0 / slope);
        let at_zero = ray.origin - ray.direction * (h * dh);
        let scale = 0.5 * view.side;
        let start = [(at_zero.dot(right) + 1.0) * scale, (1.0 - at_zero.dot(up)) * scale];
        let gain = [ray.direction.dot(right) * dh * scale, -ray.direction.dot(up) * dh * scale];
        let speed = gain[0].hypot(gain[1]);
        Some(Self { start, gain, speed, distance: [-h * dh, dh] })
    }

    /// The heights between which the ray is before the stored part of a tile: from the higher to the
    /// lower one.
    fn heights_within(&self, tile: &TileRecord) -> [f64; 2] {
        let (mut top, mut bottom) = (f64::INFINITY, f64::NEG_INFINITY);
        let ends = [(tile.left, tile.width), (tile.top, tile.height)];
        for (k, (from, size)) in ends.into_iter().enumerate() {
            let [a, b] = [f64::from(from), f64::from(from) + f64::from(size)]
                .map(|edge| (edge - self.start[k]) / self.gain[k]);
            // A ray that does not move along this axis is within for all heights, or for none.
            if self.gain[k] == 0.0 {
                let inside =
                    (f64::from(from)..f64::from(from) + f64::from(size)).contains(&self.start[k]);
                if !inside {
                    return [f64::NEG_INFINITY, f64::INFINITY];
                }
                continue;
            }
            (top, bottom) = (top.min(a.max(b)), bottom.max(a.min(b)));
        }
        [top, bottom]
    }

    fn texel(&self, height: f64) -> [f64; 2] {
        [self.start[0] + self.gain[0] * height, self.start[1] + self.gain[1] * height]
    }

    fn distance(&self, height: f64) -> f64 {
        self.distance[0] + self.distance[1] * height
    }
}
