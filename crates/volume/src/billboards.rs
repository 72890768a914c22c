//! The textures of cells, as one camera sees them.
//!
//! Each ray of a photograph is followed through the cells of a level. What it shows is shared
//! among them: each cell stops as much as its opacity lets it, all of them made denser or thinner
//! together until they stop what the matte says (the rule of section 2.1 of paper 004, "the input
//! images, the depth of the cell in the tree and the alpha/opacity values", made to add up). A
//! texel's alpha is then what the cell stopped of the light that *reached* it, so that billboards
//! one over the other give the photograph again. Deep pictures of a mesh say what each cell stops.

use crate::cells::Cells;
use crate::frame::CameraFrame;
use crate::lattice::Lattice;
use crate::march::{LocalRay, walk};
use crate::options::{Coarse, VolumeOptions};
use crate::photograph::{Seen, Shot};
use forest_raster::{DeepHit, DeepPicture};
use forest_soup::{PhotoCamera, Photograph, linear_to_srgb8, srgb8_to_linear};
use glam::DVec3;
use std::time::{Duration, Instant};

/// One camera's billboards of one level.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct LevelBillboards {
    /// Numbers of the cells that have one, ascending.
    pub(crate) cells: Vec<u32>,
    /// sRGB and alpha, `texels²` a billboard, row 0 on top.
    pub(crate) texels: Vec<[u8; 4]>,
    /// Of each cell of the level, whether what is before it hides it from the camera.
    pub(crate) hidden: Vec<bool>,
}

/// One camera's billboards, and the time that the finest level and the others took.
pub(crate) struct CameraBillboards {
    pub(crate) levels: Vec<LevelBillboards>,
    pub(crate) finest: Duration,
    pub(crate) coarser: Duration,
}

/// What rays found at a texel.
#[derive(Clone, Copy, Default)]
struct Found {
    /// Light that comes through what is in front, in rays.
    light: f32,
    /// Light that reached the cell there, in rays.
    reach: f32,
    /// Of that, what the cell stopped.
    stopped: f32,
    /// Linear RGB of what it stopped.
    rgb: [f32; 3],
}

/// Rays that must reach a texel; what lacks is made up by the cell's mean opacity.
const LEAST_REACH: f32 = 0.5;

/// Rays along the side of a texel: of the finest level, and of coarser ones, which have more to
/// show. Billboards are wider than their cells; there are up to three times as many.
const RAYS_A_TEXEL: [f64; 2] = [1.5, 2.0];

/// Light that is not followed any more in a photograph.
const DARK: f32 = 1.0 / 256.0;

/// Alpha above which a matte is opaque: what is behind it is unknown.
const OPAQUE: f32 = 1.0 - 1.0 / 512.0;

/// All levels of one camera.
pub(crate) fn billboards(
    lattice: &Lattice,
    levels: &[Cells],
    shot: &Shot,
    frame: &CameraFrame,
    options: &VolumeOptions,
) -> CameraBillboards {
    let start = Instant::now();
    let camera = Rays { lattice, shot, frame, options, shares: frame.silhouette(options.texels) };
    let mut out = vec![camera.level(lattice.levels, &levels[lattice.levels as usize])];
    let finest = start.elapsed();
    let start = Instant::now();
    for level in (0..lattice.levels).rev() {
        let cells = &levels[level as usize];
        let billboards = match options.coarse {
            Coarse::Photographs => camera.level(level, cells),
            Coarse::Below => {
                let below = out.last().expect("the level below");
                crate::below::average(lattice, cells, below, frame, options.texels)
            }
        };
        out.push(billboards);
    }
    out.reverse();
    CameraBillboards { levels: out, finest, coarser: start.elapsed() }
}

/// A photograph's rays.
struct Rays<'a> {
    lattice: &'a Lattice,
    shot: &'a Shot<'a>,
    frame: &'a CameraFrame,
    options: &'a VolumeOptions,
    /// Of each texel, the share that a cell's picture covers.
    shares: Vec<f64>,
}

/// Finds the texel of a billboard that a ray meets.
struct TexelFinder {
    right: DVec3,
    up: DVec3,
    back: DVec3,
    /// Texels a cell side, over the half size: across and down.
    scale: [f64; 2],
    texels: u32,
}

impl TexelFinder {
    fn new(frame: &CameraFrame, texels: u32) -> Self {
        let [right, up, back] = frame.axes();
        let scale = frame.half_size(1.0).map(|h| 0.5 * f64::from(texels) / h);
        Self { right, up, back, scale, texels }
    }

    /// The texel where `ray` crosses the plane of the billboard about `center`, in cells; the
    /// nearest one where it passes by.
    #[inline]
    fn texel(&self, ray: &LocalRay, center: DVec3) -> usize {
        let to = center - ray.origin;
        let along = ray.direction.dot(self.back);
        let t = if along.abs() > 0.05 { to.dot(self.back) / along } else { to.dot(ray.direction) };
        let off = ray.direction * t - to;
        let half = f64::from(self.texels) * 0.5;
        // `as` saturates below at 0.
        let x = ((half + off.dot(self.right) * self.scale[0]) as u32).min(self.texels - 1);
        let y = ((half - off.dot(self.up) * self.scale[1]) as u32).min(self.texels - 1);
        (y * self.texels + x) as usize
    }
}

impl Rays<'_> {
    fn level(&self, level: u32, cells: &Cells) -> LevelBillboards {
        let t2 = self.shares.len();
        let mut found = vec![Found::default(); cells.places.len() * t2];
        let step = self.step(level);
        let camera = &self.shot.camera;
        let [columns, rows] = camera.size.map(|n| (f64::from(n) / step) as u32);
        let finder = TexelFinder::new(self.frame, self.options.texels);
        let mut met: Vec<(u32, f32)> = Vec::new();
        for [column, row] in tiled(columns, rows) {
            let [x, y] = [column, row].map(|i| (f64::from(i) + 0.5) * step);
            let Some((origin, direction)) = camera.ray(x, y) else { continue };
            let ray = LocalRay { origin: self.lattice.local(level, origin), direction };
            let pixel = y as usize * camera.size[0] as usize + x as usize;
            let texel = |cell: u32| {
                let center = cells.places[cell as usize].as_dvec3() + 0.5;
                cell as usize * t2 + finder.texel(&ray, center)
            };
            match &self.shot.seen {
                Seen::Photograph(photo) => {
                    met.clear();
                    walk(cells, &ray, 0.0, |cell, enter, leave| {
                        met.push((cell, optical_depth(cells, cell) * (leave - enter) as f32));
                        true
                    });
                    let (rgb, alpha) = mean_pixel(photo, [x, y], step);
                    share(&met, alpha, &mut |cell, light, stopped| {
                        let to = &mut found[texel(cell)];
                        to.light += light;
                        to.reach += light;
                        to.stop(stopped, rgb);
                    });
                }
                Seen::Deep(deep) => {
                    // Depths in cells.
                    let unit = self.lattice.cell_side(level) * direction.dot(camera.forward);
                    let mut cut = DeepRay { deep, hits: deep.hits(pixel), next: 0, unit };
                    walk(cells, &ray, 0.0, |cell, enter, leave| {
                        let to = &mut found[texel(cell)];
                        let passage = cut.between(enter, leave);
                        to.light += cut.light();
                        match passage {
                            Passage::Hit(rgb) => {
                                to.reach += 1.0;
                                to.stop(1.0, rgb.map(srgb8_to_linear));
                            }
                            Passage::Clear => to.reach += 1.0,
                            Passage::Unknown => {}
                        }
                        true
                    });
                }
            }
        }
        self.finish(level, cells, step, &found)
    }

    /// Pixels between rays: as many rays as texels of the level need.
    fn step(&self, level: u32) -> f64 {
        let texel = self.lattice.cell_side(level) / f64::from(self.options.texels);
        let camera = &self.shot.camera;
        let depth = (self.lattice.middle() - camera.eye).dot(camera.forward);
        let pixels = texel * camera.pixels_per_area(depth.max(0.1 * self.lattice.side)).sqrt();
        let rays = RAYS_A_TEXEL[usize::from(level < self.lattice.levels)];
        // Pictures are neither enlarged more than fourfold nor walked in less than 16 rays.
        let least = f64::from(camera.size[0].min(camera.size[1])) / 16.0;
        // Whole pixels keep rays in the middle of pixels.
        let step = pixels / rays;
        let step = if step >= 0.99 { (step + 0.01).floor() } else { step.max(0.25) };
        step.min(least.max(0.25))
    }

    /// Texels from what rays found; cells that are hidden or show nothing get none.
    fn finish(&self, level: u32, cells: &Cells, step: f64, found: &[Found]) -> LevelBillboards {
        let t2 = self.shares.len();
        let [w, h] = self.frame.half_size(self.lattice.cell_side(level));
        let texel_area = 4.0 * w * h / t2 as f64;
        let all: f64 = self.shares.iter().sum();
        let mut out = LevelBillboards::default();
        for (i, found) in found.chunks_exact(t2).enumerate() {
            let center = self.lattice.center(level, cells.places[i]);
            let rays = texel_area * ray_density(&self.shot.camera, center) / (step * step);
            let light: f32 = found.iter().map(|f| f.light).sum();
            out.hidden.push(f64::from(light) < (1.0 - self.options.prune) * rays * all);
            if found.iter().any(|f| f.stopped > 0.0) {
                out.cells.push(i as u32);
                let whole = Found::sum(found);
                let texel =
                    |(f, &share): (&Found, &f64)| f.texel(cells.opacity[i], share as f32, &whole);
                out.texels.extend(found.iter().zip(&self.shares).map(texel));
            }
        }
        out
    }
}

/// All places of a grid, square by square: neighbouring rays meet the same cells.
fn tiled(columns: u32, rows: u32) -> impl Iterator<Item = [u32; 2]> {
    const TILE: u32 = 16;
    let starts = |n: u32| (0..n).step_by(TILE as usize);
    let corners = starts(rows).flat_map(move |y| starts(columns).map(move |x| [x, y]));
    corners.flat_map(move |[x0, y0]| {
        let xs = x0..(x0 + TILE).min(columns);
        (y0..(y0 + TILE).min(rows)).flat_map(move |y| xs.clone().map(move |x| [x, y]))
    })
}

/// Pixels that a square world unit about `at` covers.
fn ray_density(camera: &PhotoCamera, at: DVec3) -> f64 {
    let depth = (at - camera.eye).dot(camera.forward);
    camera.pixels_per_area(depth.max(1e-9))
}

/// Optical depth of a cell along its side.
fn optical_depth(cells: &Cells, cell: u32) -> f32 {
    -(1.0 - cells.opacity[cell as usize].min(OPAQUE)).ln()
}

/// Linear RGB, not premultiplied, and alpha of a photograph in the mean over a square `side` pixels
/// wide about (x, y).
fn mean_pixel(photo: &Photograph, [x, y]: [f64; 2], side: f64) -> ([f32; 3], f32) {
    let [width, height] = photo.camera.size;
    let range = |at: f64, n: u32| {
        let from = ((at - 0.5 * side).round().max(0.0) as u32).min((at as u32).min(n - 1));
        from..(from + (side as u32).max(1)).min(n)
    };
    let (mut sum, mut count) = ([0.0f32; 4], 0.0);
    for row in range(y, height) {
        for column in range(x, width) {
            let [r, g, b, a] = photo.pixels[(row * width + column) as usize];
            let alpha = f32::from(a) / 255.0;
            for (to, v) in sum.iter_mut().zip([r, g, b].map(srgb8_to_linear)) {
                *to += alpha * v;
            }
            sum[3] += alpha;
            count += 1.0;
        }
    }
    let scale = if sum[3] > 0.0 { 1.0 / sum[3] } else { 0.0 };
    ([sum[0] * scale, sum[1] * scale, sum[2] * scale], sum[3] / count)
}

/// Shares what a pixel shows among the cells that its ray meets, given with their optical depths:
/// `to` is told the light that reaches each cell, and what it stops of it.
fn share(met: &[(u32, f32)], alpha: f32, to: &mut dyn FnMut(u32, f32, f32)) {
    let all: f32 = met.iter().map(|m| m.1).sum();
    let scale = -(1.0 - alpha.min(OPAQUE)).ln() / all;
    // What is behind an opaque front is unknown: it is made denser, but not thinner.
    let scale = if alpha >= OPAQUE { scale.max(1.0) } else { scale };
    let mut light = 1.0;
    for &(cell, depth) in met {
        let stopped = light * (1.0 - (-scale * depth).exp());
        to(cell, light, stopped);
        light -= stopped;
        if light < DARK {
            break;
        }
    }
}

/// A ray of a deep picture, walked from front to back.
struct DeepRay<'a> {
    deep: &'a DeepPicture,
    hits: &'a [DeepHit],
    next: usize,
    /// World units of depth to a unit of the walk.
    unit: f64,
}

/// What is known of a ray between two places.
enum Passage {
    /// It meets this colour (sRGB).
    Hit([u8; 3]),
    /// It meets nothing.
    Clear,
    /// Something before hides it.
    Unknown,
}

impl DeepRay<'_> {
    /// What comes through to where it has been followed.
    fn light(&self) -> f32 {
        if self.next == 0 { 1.0 } else { 0.0 }
    }

    fn between(&mut self, enter: f64, leave: f64) -> Passage {
        let depth = |t: f64| t * self.unit;
        let (enter, leave) = (depth(enter), depth(leave));
        while self.hits.get(self.next).is_some_and(|h| f64::from(h.depth) < enter) {
            self.next += 1;
        }
        if let Some(hit) = self.hits.get(self.next).filter(|h| f64::from(h.depth) < leave) {
            return Passage::Hit(hit.rgb);
        }
        let slab = self.deep.slab(0.5 * (enter + leave));
        let before = self.next.checked_sub(1).map(|i| f64::from(self.hits[i].depth));
        match before {
            Some(depth) if self.deep.slab(depth) == slab => Passage::Unknown,
            _ => Passage::Clear,
        }
    }
}

impl Found {
    fn stop(&mut self, light: f32, rgb: [f32; 3]) {
        self.stopped += light;
        for (sum, v) in self.rgb.iter_mut().zip(rgb) {
            *sum += light * v;
        }
    }

    fn sum(all: &[Self]) -> Self {
        let mut sum = Self::default();
        for f in all {
            sum.reach += f.reach;
            sum.stopped += f.stopped;
            (0..3).for_each(|k| sum.rgb[k] += f.rgb[k]);
        }
        sum
    }

    /// Linear RGB of what was stopped; black for nothing.
    fn color(&self) -> [f32; 3] {
        let scale = if self.stopped > 0.0 { 1.0 / self.stopped } else { 0.0 };
        self.rgb.map(|v| v * scale)
    }

    /// A texel of a billboard that found `whole`; its share `inside` lies in the cell's picture.
    /// Outside, neighbours' billboards overlap with this one. A thing that ends at the wall covers
    /// its share of the texel. Of a thing that goes on in the neighbour each stops, as
    /// transmittances multiply, the power of its share, so that both together stop it. The fuller
    /// the cell, the more likely things go on.
    fn texel(&self, opacity: f32, inside: f32, whole: &Self) -> [u8; 4] {
        let unknown = (LEAST_REACH - self.reach).max(0.0);
        let alpha = ((self.stopped + unknown * opacity) / (self.reach + unknown)).min(1.0);
        let full = whole.stopped / whole.reach.max(whole.stopped);
        let (ends, goes_on) = (alpha * inside, 1.0 - (1.0 - alpha).powf(inside));
        let shared = ends + (goes_on - ends) * full;
        let rgb = if self.stopped > 0.0 { self.color() } else { whole.color() };
        let [r, g, b] = rgb.map(linear_to_srgb8);
        [r, g, b, (shared * 255.0).round() as u8]
    }
}
