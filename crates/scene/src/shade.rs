//! How much light reaches a place between the trees: a terrain-aligned opacity map.
//!
//! The land is looked at along the light. Each texel of the ground plane (y = 0, where light rays meet
//! it) keeps the optical depth of the trees that its rays meet, and the slab of heights that has the mean
//! and the variance of what they meet; between the slab's top and its bottom the light fades. Made once for a light, looked up by every
//! point and pixel; in the manner of deep opacity maps (C. Yuksel, J. Keyser, "Deep opacity maps",
//! 2008), with one layer. Hills cast no shadow.

use crate::instances::Instance;
use crate::land::Land;
use crate::species::{Canopy, Stance};
use glam::DVec3;
use rayon::prelude::*;

/// Steps of stored optical depth for a depth of 1.
pub const DEPTH_STEPS: f32 = 1024.0;

/// Light from the whole sky goes, in the mean, so many times as far through a layer as light from
/// straight above: the diffusivity factor (W. M. Elsasser 1942).
pub const DIFFUSE: f64 = 1.66;

/// Lights are taken for at least this high above the horizon (sine of the elevation).
pub const LOWEST_LIGHT: f64 = 0.1;

/// What [`Texel`] heights are counted in: the whole range.
pub const HEIGHT_STEPS: f64 = 65535.0;

/// A texel: top and bottom of the slab as shares of [`OpacityMap::heights`], optical depth in
/// [`DEPTH_STEPS`], and a zero.
pub type Texel = [u16; 4];

/// The map for one light.
#[derive(Clone, Debug, PartialEq)]
pub struct OpacityMap {
    /// Unit vector towards the light.
    pub to_light: DVec3,
    /// Texels along x and z.
    pub size: [u32; 2],
    /// Where the first texel begins on the ground plane.
    pub corner: [f64; 2],
    /// Metres of a texel.
    pub texel: f64,
    /// Heights of codes 0 and 65535.
    pub heights: [f64; 2],
    /// Rows of x.
    pub texels: Vec<Texel>,
}

/// What casts shadows.
#[derive(Clone, Copy, Debug)]
pub struct Casters<'a> {
    /// The trees.
    pub trees: &'a [Instance],
    /// Of each species.
    pub stances: &'a [Stance],
    /// Of each species.
    pub canopies: &'a [Canopy],
}

/// Rows of texels that are made together.
const STRIP: usize = 32;

impl OpacityMap {
    /// Makes the map of `land` with at most `most` texels a side, none smaller than `least` metres.
    pub fn new(land: &Land, casters: &Casters, to_light: DVec3, least: f64, most: u32) -> Self {
        let to_light = raised(to_light);
        let [low, high] = land.range().map(f64::from);
        let tall = |s: &Stance| s.bounds[1].y.max(0.0) * s.scale[1];
        let top = high + casters.stances.iter().map(tall).fold(1.0, f64::max) * 1.1;
        // Where rays through the lowest and highest places of the border meet the plane.
        let shear = [to_light.x, to_light.z].map(|v| v / to_light.y);
        let edge = |k: usize, side: f64| {
            let at = |h: f64| side * 0.5 * land.size[k] - shear[k] * h;
            [at(low), at(top)]
        };
        let corner: [f64; 2] = std::array::from_fn(|k| edge(k, -1.0)[0].min(edge(k, -1.0)[1]));
        let end: [f64; 2] = std::array::from_fn(|k| edge(k, 1.0)[0].max(edge(k, 1.0)[1]));
        let wide = (end[0] - corner[0]).max(end[1] - corner[1]);
        let texel = least.max(wide / f64::from(most));
        let size: [u32; 2] =
            std::array::from_fn(|k| ((end[k] - corner[k]) / texel).ceil().max(1.0) as u32);
        let mut map =
            Self { to_light, size, corner, texel, heights: [low - 1.0, top], texels: Vec::new() };
        let [width, rows] = size.map(|n| n as usize);
        let strips = map.strips(casters, rows.div_ceil(STRIP));
        let texels: Vec<Vec<Texel>> = strips
            .into_par_iter()
            .enumerate()
            .map(|(s, trees)| {
                let first = s * STRIP;
                let mut strip = Strip::new(width, first, STRIP.min(rows - first));
                for i in trees {
                    map.cast(casters, &casters.trees[i as usize], &mut strip);
                }
                strip.texels(&map)
            })
            .collect();
        map.texels = texels.concat();
        map
    }

    /// The trees whose shadows may touch each strip.
    fn strips(&self, casters: &Casters, count: usize) -> Vec<Vec<u32>> {
        let mut strips = vec![Vec::new(); count];
        let slant = 1.0 / self.to_light.y;
        for (i, tree) in (0..).zip(casters.trees) {
            let stance = &casters.stances[tree.species()];
            let reach = stance.reach() * tree.scale(stance.scale) * (1.0 + slant) + self.texel;
            let z = self.on_plane(DVec3::from_array(tree.position.map(f64::from)))[1];
            let row = |z: f64| ((z - self.corner[1]) / self.texel / STRIP as f64).max(0.0) as usize;
            for strip in strips.iter_mut().take(row(z + reach) + 1).skip(row(z - reach)) {
                strip.push(i);
            }
        }
        strips
    }

    /// Where the light ray through `place` meets the ground plane.
    fn on_plane(&self, place: DVec3) -> [f64; 2] {
        let down = place.y / self.to_light.y;
        [place.x - self.to_light.x * down, place.z - self.to_light.z * down]
    }

    fn cast(&self, casters: &Casters, tree: &Instance, strip: &mut Strip) {
        let species = tree.species();
        let (sin, cos) = (tree.yaw() as f32).sin_cos();
        let scale = tree.scale(casters.stances[species].scale) as f32;
        let [px, py, pz] = tree.position;
        let spread = (self.texel * self.texel * self.to_light.y) as f32;
        for p in &casters.canopies[species].points {
            let off = p.off * scale;
            let [x, y, z] =
                [px + off.x * cos + off.z * sin, py + off.y, pz - off.x * sin + off.z * cos];
            let at = self.on_plane(DVec3::new(x.into(), y.into(), z.into()));
            let radius = p.radius * scale;
            // The square of the disc's area, as wide as a texel at least. A ball has a fifth of its squared
            // radius for variance.
            let half = (radius * 0.886).max(0.5 * self.texel as f32) / self.texel as f32;
            let [u, v] = std::array::from_fn(|k| ((at[k] - self.corner[k]) / self.texel) as f32);
            let depth = p.thickness * scale * scale / spread;
            strip.add([u, v], half, depth, [y, 0.2 * radius * radius]);
        }
    }

    /// Share of the light that reaches `place`, from 1 above the trees down.
    pub fn seen(&self, place: DVec3) -> f32 {
        let at = self.on_plane(place);
        let [u, v] = std::array::from_fn(|k| ((at[k] - self.corner[k]) / self.texel - 0.5) as f32);
        let (u0, v0) = (u.floor(), v.floor());
        let (fu, fv) = (u - u0, v - v0);
        let depth = |du: f32, dv: f32| self.depth([u0 + du, v0 + dv], place.y);
        let top = depth(0.0, 0.0) * (1.0 - fu) + depth(1.0, 0.0) * fu;
        let bottom = depth(0.0, 1.0) * (1.0 - fu) + depth(1.0, 1.0) * fu;
        (-(top * (1.0 - fv) + bottom * fv)).exp()
    }

    /// Optical depth above height `y` in a texel; 0 beside the map.
    fn depth(&self, [u, v]: [f32; 2], y: f64) -> f32 {
        let [w, h] = self.size.map(|n| n as f32);
        if !(u >= 0.0 && v >= 0.0 && u < w && v < h) {
            return 0.0;
        }
        let [top, bottom, depth, _] = self.texels[v as usize * self.size[0] as usize + u as usize];
        if depth == 0 {
            return 0.0;
        }
        let y = (y - self.heights[0]) / (self.heights[1] - self.heights[0]) * HEIGHT_STEPS;
        let share = (f32::from(top) - y as f32) / (f32::from(top) - f32::from(bottom)).max(1.0);
        f32::from(depth) / DEPTH_STEPS * share.clamp(0.0, 1.0)
    }
}

/// A light, not lower than [`LOWEST_LIGHT`].
fn raised(to_light: DVec3) -> DVec3 {
    let light = to_light.normalize_or(DVec3::Y);
    if light.y >= LOWEST_LIGHT {
        return light;
    }
    let flat = DVec3::new(light.x, 0.0, light.z).normalize_or(DVec3::X);
    flat * (1.0 - LOWEST_LIGHT * LOWEST_LIGHT).sqrt() + DVec3::Y * LOWEST_LIGHT
}

/// Rows of the map in the making.
struct Strip {
    width: usize,
    row: usize,
    depth: Vec<f32>,
    /// Sums of heights above the first one met, and of their squares, weighted by depth.
    first: Vec<f32>,
    sums: Vec<[f32; 2]>,
}

impl Strip {
    fn new(width: usize, row: usize, rows: usize) -> Self {
        let n = width * rows;
        Self { width, row, depth: vec![0.0; n], first: vec![0.0; n], sums: vec![[0.0; 2]; n] }
    }

    /// Spreads `depth` (times a texel's area), of this mean height and variance, over the square of half
    /// width `half` about `at`.
    fn add(&mut self, at: [f32; 2], half: f32, depth: f32, [height, variance]: [f32; 2]) {
        let rows = self.depth.len() / self.width;
        let share = 1.0 / (4.0 * half * half);
        let v = at[1] - self.row as f32;
        let clip = |from: f32, n: usize| (from.max(0.0) as usize).min(n);
        let overlap = |k: usize, middle: f32| {
            let k = k as f32;
            ((middle + half).min(k + 1.0) - (middle - half).max(k)).max(0.0)
        };
        for j in clip(v - half, rows)..clip((v + half).ceil(), rows) {
            for i in clip(at[0] - half, self.width)..clip((at[0] + half).ceil(), self.width) {
                let part = overlap(i, at[0]) * overlap(j, v) * share;
                if part > 0.0 {
                    let t = j * self.width + i;
                    if self.depth[t] == 0.0 {
                        self.first[t] = height;
                    }
                    let (d, h) = (depth * part, height - self.first[t]);
                    self.depth[t] += d;
                    self.sums[t][0] += d * h;
                    self.sums[t][1] += d * (h * h + variance);
                }
            }
        }
    }

    fn texels(&self, map: &OpacityMap) -> Vec<Texel> {
        let [low, high] = map.heights;
        let code = |h: f32| ((f64::from(h) - low) / (high - low) * HEIGHT_STEPS).round() as u16;
        let depth = |d: f32| (d * DEPTH_STEPS).round() as u16;
        let texel = |i: usize| match self.depth[i] > 0.0 {
            true => {
                let [mean, square] = self.sums[i].map(|s| s / self.depth[i]);
                // An even slab's variance is a twelfth of its squared thickness.
                let half = (3.0 * (square - mean * mean).max(0.0)).sqrt();
                let middle = self.first[i] + mean;
                let [top, bottom] = [middle + half, middle - half].map(code);
                [top, bottom, depth(self.depth[i]).max(1), 0]
            }
            false => [0; 4],
        };
        (0..self.depth.len()).map(texel).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::species::CanopyPoint;
    use glam::Vec3;

    fn land() -> Land {
        Land { points: [2, 2], size: [100.0, 100.0], heights: vec![0.0; 4] }
    }

    /// One tree in the middle: a ball of radius 4 m, 10 m above the ground, of thickness 40 m².
    fn map(to_light: DVec3) -> OpacityMap {
        let points =
            vec![CanopyPoint { off: Vec3::Y * 10.0, radius: 4.0, thickness: 40.0, depth: 1.0 }];
        let bounds = [DVec3::new(-4.0, 0.0, -4.0), DVec3::new(4.0, 14.0, 4.0)];
        let stance = Stance { anchor: DVec3::ZERO, unit: 1.0, scale: [1.0, 1.0], bounds };
        let casters = Casters {
            trees: &[Instance::new([0.0; 3], 0, 0, 0)],
            stances: &[stance],
            canopies: &[Canopy { points }],
        };
        OpacityMap::new(&land(), &casters, to_light, 1.0, 256)
    }

    #[test]
    fn the_light_fades_through_the_slab() {
        let map = map(DVec3::Y);
        // 40 m² over the square of half width 0.886 · 4 m.
        let depth = 40.0 / (4.0 * 3.544f32 * 3.544);
        let at = |y: f64| map.seen(DVec3::new(0.0, y, 0.0));
        assert_eq!(at(20.0), 1.0);
        // The slab with a ball's variance is 2·√0.6 radii thick.
        let half = 4.0 * 0.6f64.sqrt();
        for (y, share) in [(10.0 + half, 0.0f32), (10.0, 0.5), (10.0 - half, 1.0), (0.0, 1.0)] {
            assert!((at(y) - (-depth * share).exp()).abs() < 2e-3, "{y}: {}", at(y));
        }
        assert_eq!(map.seen(DVec3::new(9.0, 0.0, 0.0)), 1.0);
        assert_eq!(map.seen(DVec3::new(900.0, 0.0, 0.0)), 1.0);
    }

    #[test]
    fn shadows_fall_away_from_the_light() {
        // From the west, 45 degrees high: the shadow of a ball 10 m up falls 10 m to the east.
        let map = map(DVec3::new(-1.0, 1.0, 0.0).normalize());
        assert_eq!(map.seen(DVec3::ZERO), 1.0);
        let dark = map.seen(DVec3::new(10.0, 0.0, 0.0));
        let spread = 4.0 * 3.544f32 * 3.544 * std::f32::consts::FRAC_1_SQRT_2;
        assert!((dark - (-40.0 / spread).exp()).abs() < 0.02, "{dark}");
        // Halfway down the ray is as dark; above the tree it is light.
        assert!((map.seen(DVec3::new(6.0, 4.0, 0.0)) - dark).abs() < 1e-3);
        assert_eq!(map.seen(DVec3::new(-10.0, 20.0, 0.0)), 1.0);
    }

    #[test]
    fn all_thickness_is_kept() {
        for light in [DVec3::Y, DVec3::new(0.6, 0.7, -0.2).normalize()] {
            let map = map(light);
            let all: f64 = map.texels.iter().map(|t| f64::from(t[2])).sum();
            let area = map.texel * map.texel * light.y;
            let kept = all / f64::from(DEPTH_STEPS) * area;
            assert!((kept - 40.0).abs() < 0.1, "{kept}");
        }
    }

    #[test]
    fn low_lights_are_raised() {
        let map = map(DVec3::new(1.0, -0.3, 0.0));
        assert!((map.to_light.y - LOWEST_LIGHT).abs() < 1e-12 && map.to_light.is_normalized());
        assert!(map.size.iter().all(|n| *n <= 256));
    }
}
