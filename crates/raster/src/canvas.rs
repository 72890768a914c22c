//! The sample buffer: depth-tested, filled in horizontal bands by all threads, shaded once.
//!
//! Every band keeps depth and the number of the nearest thing for each sample, and looks at colours
//! only when all is drawn. A translucent surface is asked for its coverage at each sample that it
//! might win; things are drawn from front to back, so that few are asked in vain.

use crate::light::Light;
use crate::list::{DisplayList, Ellipse, Fragment, Triangle};
use crate::opacity::covers;
use crate::picture::{Picture, PixelMean};
use crate::sampling::{Pattern, Sampling};
use crate::sprite::{Sprite, SpriteHit};
use forest_soup::{Camera, Projection};
use glam::IVec2;
use rayon::prelude::*;

/// How a picture is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Style {
    /// Samples of a pixel.
    pub sampling: Sampling,
    /// Light.
    pub light: Light,
}

impl From<Sampling> for Style {
    /// Base colours.
    fn from(sampling: Sampling) -> Self {
        Self { sampling, light: Light::Albedo }
    }
}

impl Default for Style {
    /// 64 samples a pixel, base colours.
    fn default() -> Self {
        Self { sampling: Sampling::TRUTH, light: Light::Albedo }
    }
}

/// Draws `list` as `camera` sees it; shadows are those of the list's map.
pub fn draw(list: &DisplayList, camera: &Camera, style: &Style) -> Picture {
    let canvas = Canvas {
        list,
        pattern: Pattern::new(style.sampling),
        light: style.light,
        parallel: matches!(camera.projection, Projection::Orthographic { .. }),
        width: camera.width,
        height: camera.height,
        camera,
    };
    canvas.picture()
}

/// Samples in a band: they and their numbers take about 8 MB.
const BAND_SAMPLES: usize = 1 << 20;

/// No thing.
const NONE: u32 = u32::MAX;

struct Canvas<'a> {
    list: &'a DisplayList<'a>,
    pattern: Pattern,
    light: Light,
    parallel: bool,
    width: u32,
    height: u32,
    camera: &'a Camera,
}

/// Samples of a few rows of pixels.
struct Band {
    /// First row of pixels.
    top: u32,
    rows: u32,
    width: u32,
    keys: Vec<f32>,
    ids: Vec<u32>,
}

impl Canvas<'_> {
    fn picture(&self) -> Picture {
        let row = (self.width as usize * self.pattern.count()).max(1);
        // At least two bands for each thread, as far as there are rows.
        let share = self.height.div_ceil(2 * rayon::current_num_threads() as u32).max(1);
        let rows = ((BAND_SAMPLES / row) as u32).clamp(1, share.min(16));
        let mut out = Picture::empty(self.width, self.height);
        let lists = self.bins(rows);
        let bands: Vec<Picture> = lists
            .into_par_iter()
            .enumerate()
            .map(|(b, list)| {
                let top = b as u32 * rows;
                let mut band = Band::new(self, top, rows.min(self.height - top));
                for i in list {
                    self.put(i, &mut band);
                }
                self.resolve(&band)
            })
            .collect();
        let mut first = 0;
        for band in bands {
            let end = first + band.pixels.len();
            out.pixels[first..end].copy_from_slice(&band.pixels);
            out.depth[first..end].copy_from_slice(&band.depth);
            out.normal[first..end].copy_from_slice(&band.normal);
            first = end;
        }
        out
    }

    /// For each band the numbers of the things that touch it, nearest first.
    fn bins(&self, rows: u32) -> Vec<Vec<u32>> {
        let mut order: Vec<(f32, u32)> = (0..self.list.len() as u32)
            .into_par_iter()
            .map(|i| (self.list.nearest_key(i, self.parallel), i))
            .collect();
        order.par_sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut bins = vec![Vec::new(); self.height.div_ceil(rows) as usize];
        for (_, i) in order {
            let (top, bottom) = self.list.rows(i);
            if bottom >= 0 && top < self.height as i32 {
                let first = top.max(0) as usize / rows as usize;
                let last = (bottom as usize / rows as usize).min(bins.len() - 1);
                bins[first..=last].iter_mut().for_each(|l| l.push(i));
            }
        }
        bins
    }

    fn put(&self, i: u32, band: &mut Band) {
        match self.list.thing(i) {
            Thing::Triangle(t) if t.surface.translucent => self.translucent(i, t, band),
            Thing::Triangle(t) => self.opaque(i, t, band),
            Thing::Ellipse(e) => self.ellipse(i, e, band),
            Thing::Sprite(s) => self.sprite(i, s, band),
        }
    }

    fn sprite(&self, i: u32, sprite: &dyn Sprite, band: &mut Band) {
        let nearest = depth_key(sprite.nearest(), self.parallel);
        let (min, max) = sprite.pixels();
        for (x, y) in band.pixels(min, max) {
            let (xs, ys) = self.pattern.pixel(x, y);
            let (keys, ids) = band.pixel(self, x, y);
            for s in 0..xs.len() {
                if keys[s] <= nearest {
                    continue;
                }
                let (px, py) = (f64::from(x) + f64::from(xs[s]), f64::from(y) + f64::from(ys[s]));
                let Some(hit) = sprite.sample(px, py, self.pattern.grid(x, y, s)) else { continue };
                let key = depth_key(hit.depth, self.parallel);
                if key < keys[s] {
                    keys[s] = key;
                    ids[s] = i;
                }
            }
        }
    }

    fn opaque(&self, i: u32, t: &Triangle, band: &mut Band) {
        for (x, y) in band.pixels(t.min, t.max) {
            let Some(near) = Nearby::new(t, x, y) else { continue };
            let (xs, ys) = self.pattern.pixel(x, y);
            let (keys, ids) = band.pixel(self, x, y);
            for (((key, id), &dx), &dy) in keys.iter_mut().zip(ids).zip(xs).zip(ys) {
                let (inside, k) = near.test(dx, dy);
                let wins = inside & (k < *key);
                *key = if wins { k } else { *key };
                *id = if wins { i } else { *id };
            }
        }
    }

    fn translucent(&self, i: u32, t: &Triangle, band: &mut Band) {
        let mut wins = [false; 256];
        for (x, y) in band.pixels(t.min, t.max) {
            let Some(near) = Nearby::new(t, x, y) else { continue };
            let (xs, ys) = self.pattern.pixel(x, y);
            let (keys, ids) = band.pixel(self, x, y);
            for (((win, key), &dx), &dy) in wins.iter_mut().zip(&*keys).zip(xs).zip(ys) {
                let (inside, k) = near.test(dx, dy);
                *win = inside & (k < *key);
            }
            for (s, _) in wins[..xs.len()].iter().enumerate().filter(|w| *w.1) {
                let opacity = (t.coverage(near.edges(xs[s], ys[s])) * 255.0).round() as u8;
                let (gx, gy) = self.pattern.grid(x, y, s);
                if covers(t.id, gx, gy, opacity) {
                    keys[s] = near.test(xs[s], ys[s]).1;
                    ids[s] = i;
                }
            }
        }
    }

    fn ellipse(&self, i: u32, e: &Ellipse, band: &mut Band) {
        let key = depth_key(e.depth, self.parallel);
        let (min, max) = e.pixels();
        let squeeze = (1.0 / (e.ratio * e.ratio) - 1.0) as f32;
        let reach = (e.radius * e.radius) as f32;
        let [mx, my] = e.minor.as_vec2().to_array();
        let mut wins = [false; 256];
        for (x, y) in band.pixels(min, max) {
            let (cx, cy) = ((e.center.x - f64::from(x)) as f32, (e.center.y - f64::from(y)) as f32);
            let (xs, ys) = self.pattern.pixel(x, y);
            let (keys, ids) = band.pixel(self, x, y);
            for (((win, &k), &sx), &sy) in wins.iter_mut().zip(&*keys).zip(xs).zip(ys) {
                let (dx, dy) = (sx - cx, sy - cy);
                let along = dx * mx + dy * my;
                *win = (dx * dx + dy * dy + along * along * squeeze <= reach) & (key < k);
            }
            for (s, win) in wins[..xs.len()].iter().enumerate() {
                let (gx, gy) = self.pattern.grid(x, y, s);
                if *win && covers(e.id, gx, gy, e.opacity) {
                    keys[s] = key;
                    ids[s] = i;
                }
            }
        }
    }

    /// Shades samples and box-filters them to pixels.
    fn resolve(&self, band: &Band) -> Picture {
        let mut out = Picture::empty(self.width, band.rows);
        let count = self.pattern.count();
        let share = 1.0 / count as f32;
        let samples = band.keys.chunks_exact(count).zip(band.ids.chunks_exact(count));
        for (p, (keys, ids)) in samples.enumerate() {
            let (x, y) = (p as u32 % self.width, band.top + p as u32 / self.width);
            let (xs, ys) = self.pattern.pixel(x, y);
            let mut mean = PixelMean::default();
            for s in (0..count).filter(|&s| ids[s] != NONE) {
                let (px, py) = (f64::from(x) + f64::from(xs[s]), f64::from(y) + f64::from(ys[s]));
                let f = self.fragment(ids[s], px, py, self.pattern.grid(x, y, s));
                let depth = if self.parallel { keys[s] } else { -1.0 / keys[s] };
                let [r, g, b] = self.lit(f, px, py, depth);
                mean.add([r, g, b, 1.0], depth, f.normal.to_array(), share);
            }
            mean.store(&mut out, p);
        }
        out
    }

    /// The colour of what is seen at picture coordinates (x, y) in this depth.
    fn lit(&self, f: Fragment, x: f64, y: f64, depth: f32) -> [f32; 3] {
        let Light::Sun(sun) = &self.light else { return f.rgb };
        if f.unlit {
            return f.rgb;
        }
        let mut sunlit = f.sunlit;
        let place = || self.camera.unproject(x, y, f64::from(depth));
        if let (Some(map), true) = (&self.list.shadow, f.shadowed) {
            sunlit *= map.seen(place());
        }
        let sun = sun.through(f.translucency);
        let [mut all, mut one] = [[0.0; 3]; 2];
        if f.scattered > 0.0 {
            all = sun.scattered(self.camera.to_eye(place()), sunlit, f.sky);
        }
        if f.scattered < 1.0 {
            one = sun.factors(f.normal, sunlit, f.sky);
        }
        std::array::from_fn(|k| f.rgb[k] * (one[k] + (all[k] - one[k]) * f.scattered))
    }

    fn fragment(&self, i: u32, x: f64, y: f64, grid: (u32, u32)) -> Fragment {
        match self.list.thing(i) {
            Thing::Triangle(t) => t.shade(x, y),
            // An ellipse comes lit.
            Thing::Ellipse(e) => Fragment { normal: e.normal, ..Fragment::unlit(e.rgb) },
            Thing::Sprite(s) => match s.sample(x, y, grid) {
                Some(hit) => {
                    let SpriteHit { rgb, normal, scattered, sunlit, sky, .. } = hit;
                    let plain = Fragment::unlit(rgb);
                    Fragment { normal, unlit: false, scattered, sunlit, sky, ..plain }
                }
                // The same answer as before: it was a hit.
                None => Fragment::unlit([0.0; 3]),
            },
        }
    }
}

fn depth_key(depth: f64, parallel: bool) -> f32 {
    (if parallel { depth } else { -1.0 / depth }) as f32
}

/// A triangle's planes about one pixel.
struct Nearby {
    edges: [[f32; 3]; 3],
    key: [f32; 3],
    key_range: [f32; 2],
}

impl Nearby {
    /// `None` if no sample of the pixel can be inside.
    #[inline]
    fn new(t: &Triangle, x: u32, y: u32) -> Option<Self> {
        let edges = t.edges.planes.map(|p| p.within(x, y));
        if edges.iter().any(|[e, ex, ey]| e + ex.max(0.0) + ey.max(0.0) < 0.0) {
            return None;
        }
        Some(Self { edges, key: t.key.within(x, y), key_range: t.key_range })
    }

    /// Edge functions at the sample at (dx, dy) of the pixel.
    #[inline]
    fn edges(&self, dx: f32, dy: f32) -> [f32; 3] {
        self.edges.map(|[v, vx, vy]| v + vx * dx + vy * dy)
    }

    /// Whether that sample is inside, and its depth key.
    #[inline]
    fn test(&self, dx: f32, dy: f32) -> (bool, f32) {
        let [a, b, c] = self.edges(dx, dy);
        // Shared edges belong to both triangles: no cracks, and the nearer one wins.
        let inside = (a >= 0.0) & (b >= 0.0) & (c >= 0.0);
        let [v, vx, vy] = self.key;
        // Slivers extrapolate wildly: stay within the corners' depths.
        (inside, (v + vx * dx + vy * dy).max(self.key_range[0]).min(self.key_range[1]))
    }
}

/// One of a list.
enum Thing<'a> {
    Triangle(&'a Triangle<'a>),
    Ellipse(&'a Ellipse),
    Sprite(&'a dyn Sprite),
}

impl DisplayList<'_> {
    fn len(&self) -> usize {
        self.triangles.len() + self.ellipses.len() + self.sprites.len()
    }

    /// Triangles first, then ellipses, then sprites.
    fn thing(&self, i: u32) -> Thing<'_> {
        let i = i as usize;
        let (triangles, ellipses) = (self.triangles.len(), self.ellipses.len());
        if let Some(t) = self.triangles.get(i) {
            Thing::Triangle(t)
        } else if let Some(e) = self.ellipses.get(i - triangles) {
            Thing::Ellipse(e)
        } else {
            Thing::Sprite(&*self.sprites[i - triangles - ellipses])
        }
    }

    fn nearest_key(&self, i: u32, parallel: bool) -> f32 {
        match self.thing(i) {
            Thing::Triangle(t) => t.key_range[0],
            Thing::Ellipse(e) => depth_key(e.depth, parallel),
            Thing::Sprite(s) => depth_key(s.nearest(), parallel),
        }
    }

    /// Topmost and bottommost row of pixels it may touch.
    fn rows(&self, i: u32) -> (i32, i32) {
        let (min, max) = match self.thing(i) {
            Thing::Triangle(t) => (t.min, t.max),
            Thing::Ellipse(e) => e.pixels(),
            Thing::Sprite(s) => s.pixels(),
        };
        (min.y, max.y)
    }
}

impl Band {
    fn new(canvas: &Canvas, top: u32, rows: u32) -> Self {
        let n = canvas.width as usize * rows as usize * canvas.pattern.count();
        Self { top, rows, width: canvas.width, keys: vec![f32::INFINITY; n], ids: vec![NONE; n] }
    }

    /// Pixels of the band in a box, both ends included.
    fn pixels(&self, min: IVec2, max: IVec2) -> impl Iterator<Item = (u32, u32)> + use<> {
        let range = |lo: i32, hi: i32, from: u32, to: u32| {
            let first = lo.max(from as i32) as u32;
            first..(hi.saturating_add(1).max(first as i32) as u32).min(to).max(first)
        };
        let xs = range(min.x, max.x, 0, self.width);
        range(min.y, max.y, self.top, self.top + self.rows)
            .flat_map(move |y| xs.clone().map(move |x| (x, y)))
    }

    /// Keys and numbers of a pixel's samples.
    #[inline]
    fn pixel(&mut self, canvas: &Canvas, x: u32, y: u32) -> (&mut [f32], &mut [u32]) {
        let count = canvas.pattern.count();
        let first = ((y - self.top) as usize * canvas.width as usize + x as usize) * count;
        (&mut self.keys[first..first + count], &mut self.ids[first..first + count])
    }
}
