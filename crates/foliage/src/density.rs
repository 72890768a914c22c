//! How dense a tree is, in a coarse grid, and how much light comes through it.
//!
//! Density is extinction: how many surfaces a way meets per length, measured by parallel rays along the three
//! axes through everything ([`forest_raster::layers()`]). Along a way the light falls by Beer's and Lambert's
//! law, exp(−∫ density ds): leaves lie as if by chance. That is the density factor of Candussi et al. 2005,
//! which counts the leaves around a leaf, with a direction: against rays it is nearly as good as a
//! shadow map (docs/LIGHT.md), and serves points, views and volumes, which have none.

use forest_raster::{Surfaces, layers};
use forest_soup::{Camera, Projection, TriangleSoup};
use glam::{DVec3, IVec3, UVec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Most cells along the longest side of a tree's box, beside the empty ones around it.
const SIDE: u32 = 32;

/// A grid has no more cells along a side.
const MOST_SIDE: u32 = 64;

/// Rays along the side of a cell.
const RAYS: u32 = 8;

/// The side of a cell is no smaller.
const LEAST: f64 = 1e-30;

/// Directions from which the sky is seen.
const SKY: u32 = 32;

/// A grid over the box of a tree and a cell around it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Density {
    /// Corner of the grid in the world: that of least coordinates.
    low: [f64; 3],
    /// Side of a cell in world units.
    cell: f64,
    /// Cells along x, y and z.
    size: [u32; 3],
    /// Density of 255, per world unit.
    densest: f32,
    /// Density of each cell in parts of the densest / 255, x fastest, then y.
    density: Vec<u8>,
    /// Share of the sky that is seen from the middle of each cell, all around, in 255ths.
    sky: Vec<u8>,
}

impl Density {
    /// Of a tree.
    pub(crate) fn of(soup: &TriangleSoup, surfaces: &Surfaces) -> Self {
        let bounds = soup.bounds();
        let extent = bounds.size().max(DVec3::ZERO);
        // About as many cells as triangles: fewer have nothing to tell.
        let side = (soup.triangles.len() as f64).cbrt().ceil().clamp(1.0, SIDE.into());
        let cell = (extent.max_element() / side).max(LEAST);
        let size = (extent / cell).ceil().as_uvec3().clamp(UVec3::ONE, UVec3::splat(SIDE)) + 2;
        let low = soup.origin + bounds.center() - 0.5 * cell * size.as_dvec3();
        let mut met = vec![0u32; size.element_product() as usize];
        let grid = Grid { low, cell, size };
        for axis in 0..3 {
            for place in grid.surfaces(soup, surfaces, axis) {
                met[grid.index(place)] += 1;
            }
        }
        // Surfaces on RAYS² ways of a cell's length along each axis.
        let ways = f64::from(3 * RAYS * RAYS) * cell;
        let densest = f64::from(met.iter().copied().max().unwrap_or(0)) / ways;
        let step = densest * ways / 255.0;
        let density = met.iter().map(|n| (f64::from(*n) / step.max(1e-9)).round() as u8).collect();
        let (low, size, densest) = (low.to_array(), size.to_array(), densest as f32);
        let mut own = Self { low, cell, size, densest, density, sky: Vec::new() };
        own.sky = own.openness();
        own
    }

    /// The rule that is broken, if one is.
    pub(crate) fn problem(&self) -> Option<String> {
        let cells = self.size.iter().map(|s| *s as usize).product::<usize>();
        let Self { cell, densest, size, .. } = self;
        if !self.low.iter().all(|v| v.is_finite()) || !cell.is_finite() || *cell <= 0.0 {
            return Some(format!("cells of {cell} from {:?}; finite, larger than 0", self.low));
        }
        if size.iter().any(|s| !(1..=MOST_SIDE).contains(s)) {
            return Some(format!("{size:?} cells of density; from 1 to {MOST_SIDE} a side"));
        }
        if !densest.is_finite() || *densest < 0.0 {
            return Some(format!("a density of {densest}; finite, 0 or more"));
        }
        let stored = [self.density.len(), self.sky.len()];
        let counts = stored.iter().any(|n| *n != cells);
        counts.then(|| format!("{stored:?} cells of density and sky; {cells} by the header"))
    }

    fn grid(&self) -> Grid {
        Grid { low: self.low.into(), cell: self.cell, size: self.size.into() }
    }

    /// Share of the light from direction `to` that comes through to each cell's middle.
    fn through(&self, to: DVec3) -> impl IndexedParallelIterator<Item = f64> {
        let grid = self.grid();
        let factor = f64::from(self.densest) / 255.0 * self.cell;
        // A cell's length at a time, out of the grid from any cell.
        let most = (f64::from(grid.size.max_element()) * 3.0f64.sqrt()).ceil() as u32;
        (0..self.density.len()).into_par_iter().map(move |i| {
            let from = grid.middle(i);
            let mut sum = 0.0;
            for n in 0..most {
                let at = from + to * (f64::from(n) + 0.5);
                if at.cmplt(DVec3::ZERO).any() || at.cmpgt(grid.size.as_dvec3()).any() {
                    break;
                }
                sum += grid.mean(at, |i| [f64::from(self.density[i])])[0];
            }
            (-sum * factor).exp()
        })
    }

    /// The sky as each cell sees it: the mean over directions all around.
    fn openness(&self) -> Vec<u8> {
        let mut sums = vec![0.0; self.density.len()];
        for k in 0..SKY {
            // On a spiral: as many everywhere.
            let y = 1.0 - (2.0 * f64::from(k) + 1.0) / f64::from(SKY);
            let (sin, cos) = (f64::from(k) * TAU * 0.381_966_011_250_105).sin_cos();
            let flat = (1.0 - y * y).sqrt();
            let open = self.through(DVec3::new(flat * cos, y, flat * sin));
            sums.par_iter_mut().zip(open).for_each(|(sum, open)| *sum += open);
        }
        sums.into_iter().map(|s| byte(s / f64::from(SKY))).collect()
    }

    /// What of the light of a sun in direction `to_sun`, and of the sky, comes through.
    pub(crate) fn shade(&self, to_sun: DVec3) -> CrownShade {
        let sun: Vec<u8> = self.through(to_sun).map(byte).collect();
        let texels = sun.into_iter().zip(&self.sky).map(|(sun, sky)| [sun, *sky]).collect();
        CrownShade { grid: self.grid(), texels }
    }
}

fn byte(share: f64) -> u8 {
    (share * 255.0).round() as u8
}

/// How much of the light of one sun, and of the sky, comes through a crown to places in it.
#[derive(Clone, Debug)]
pub struct CrownShade {
    grid: Grid,
    texels: Vec<[u8; 2]>,
}

impl CrownShade {
    /// Shares of the sun and of the sky, `0..=1`, at a place in the world: linear between the middles of
    /// cells; outside of the grid those of its nearest place.
    pub fn at(&self, place: DVec3) -> [f32; 2] {
        let at = (place - self.grid.low) / self.grid.cell;
        self.grid.mean(at, |i| self.texels[i].map(f64::from)).map(|v| (v / 255.0) as f32)
    }

    /// Corner of least coordinates in the world, and side of a cell.
    pub fn frame(&self) -> (DVec3, f64) {
        (self.grid.low, self.grid.cell)
    }

    /// Cells along x, y and z.
    pub fn size(&self) -> [u32; 3] {
        self.grid.size.to_array()
    }

    /// Shares of the sun and of the sky in the middles of cells in 255ths, x fastest, then y.
    pub fn texels(&self) -> &[[u8; 2]] {
        &self.texels
    }
}

#[derive(Clone, Copy, Debug)]
struct Grid {
    low: DVec3,
    cell: f64,
    size: UVec3,
}

impl Grid {
    /// Places, in cells, of all that rays along an axis meet.
    fn surfaces(&self, soup: &TriangleSoup, surfaces: &Surfaces, axis: usize) -> Vec<DVec3> {
        let size = self.size.as_dvec3();
        let forward = -DVec3::AXES[axis];
        let half = 0.5 * self.cell * size;
        let middle = self.low + half;
        let eye = middle - forward * (half[axis] + self.cell);
        // Wide enough for all sides.
        let side = self.size.max_element();
        let height = f64::from(side) * self.cell;
        let projection = Projection::Orthographic { height };
        let camera = Camera::new(eye, forward, projection, [side * RAYS; 2]);
        let step = 1.0 / f64::from(RAYS);
        let place = |hit: forest_raster::LayerHit| {
            let [x, y] = [hit.pixel % camera.width, hit.pixel / camera.width];
            let [x, y] = [x, y].map(|v| (f64::from(v) + 0.5) * step - 0.5 * f64::from(side));
            let along = forward * f64::from(hit.depth);
            (eye + along - self.low) / self.cell + camera.right * x - camera.up * y
        };
        layers(soup, surfaces, &camera).into_iter().map(place).collect()
    }

    /// Number of the cell in which `at` lies, in cells.
    fn index(&self, at: DVec3) -> usize {
        let at = at.floor().as_ivec3().clamp(IVec3::ZERO, self.last());
        self.number(at)
    }

    fn number(&self, at: IVec3) -> usize {
        let [x, y, z] = at.to_array().map(|v| v as usize);
        (z * self.size.y as usize + y) * self.size.x as usize + x
    }

    fn last(&self) -> IVec3 {
        self.size.as_ivec3() - 1
    }

    /// Middle of cell number `i`, in cells.
    fn middle(&self, i: usize) -> DVec3 {
        let [nx, ny] = [self.size.x as usize, self.size.y as usize];
        DVec3::new((i % nx) as f64, (i / nx % ny) as f64, (i / nx / ny) as f64) + 0.5
    }

    /// Linear between the middles of the cells around `at`, in cells: lit_block.wgsl has it too.
    fn mean<const N: usize>(&self, at: DVec3, of: impl Fn(usize) -> [f64; N]) -> [f64; N] {
        let at = (at - 0.5).clamp(DVec3::ZERO, self.last().as_dvec3());
        let low = at.floor();
        let share = at - low;
        let low = low.as_ivec3();
        let mut sum = [0.0; N];
        for k in 0..8 {
            let off = IVec3::new(k & 1, k >> 1 & 1, k >> 2);
            let near = DVec3::select(off.cmpeq(IVec3::ONE), share, 1.0 - share);
            let weight = near.element_product();
            let values = of(self.number((low + off).min(self.last())));
            sum.iter_mut().zip(values).for_each(|(sum, v)| *sum += weight * v);
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use forest_soup::Material;
    use glam::Vec3;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    /// Small squares that face all ways, at random places of a cube of side 2 about `origin`.
    fn cloud(count: u32, half: f32, origin: DVec3) -> TriangleSoup {
        let mut random = Pcg64Mcg::seed_from_u64(7);
        let mut soup = TriangleSoup {
            origin,
            materials: vec![Material::default()],
            ..TriangleSoup::default()
        };
        for i in 0..count {
            let [x, y, z, turn, up]: [f32; 5] =
                std::array::from_fn(|_| random.random_range(-1.0f32..1.0));
            let flat = (1.0 - up * up).sqrt();
            let (sin, cos) = (turn * std::f32::consts::PI).sin_cos();
            let normal = Vec3::new(flat * cos, up, flat * sin);
            let (a, b) = normal.any_orthonormal_pair();
            let middle = Vec3::new(x, y, z);
            let corners = [-a - b, a - b, a + b, b - a].map(|v| middle + v * half);
            soup.positions.extend(corners);
            soup.triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|v: u32| v + 4 * i)));
        }
        soup.triangle_materials = vec![0; soup.triangles.len()];
        soup
    }

    fn of(soup: &TriangleSoup) -> Density {
        Density::of(soup, &Surfaces::new(&soup.materials, &soup.textures))
    }

    #[test]
    fn light_through_leaves_at_random_falls_as_beer_and_lambert_say() {
        // A leaf hides half of its area in the mean: density = area / volume / 2.
        let (count, half) = (200_000, 0.0063f32);
        let origin = DVec3::new(1e6, 20.0, -3e5);
        let density = of(&cloud(count, half, origin));
        assert_eq!(density.problem(), None);
        let per_unit = 0.5 * f64::from(count) * f64::from(4.0 * half * half) / 8.0;
        // Way in the cube to a place, for one of its height below the face through which the light comes.
        for (to_sun, way) in [(DVec3::Y, 1.0), (DVec3::new(0.6, 0.8, 0.0), 1.25)] {
            let shade = density.shade(to_sun);
            for depth in [0.25, 0.5, 1.0, 1.5] {
                // Far enough from the side for no light to come through it. Single ways miss more leaves or
                // fewer: the mean over many.
                let places = (0..400).map(|i| {
                    let across = |i: i32| f64::from(i) / 20.0 - 0.475;
                    DVec3::new(across(i % 20) - 0.5, 1.0 - depth, across(i / 20))
                });
                let light = places.map(|p| f64::from(shade.at(origin + p)[0])).sum::<f64>() / 400.0;
                let want = (-per_unit * way * depth).exp();
                assert!((light - want).abs() < 0.03, "{to_sun} {depth}: {light}, not {want}");
            }
        }
    }

    #[test]
    fn light_in_the_open_is_whole_and_the_sky_is_hidden_within() {
        let density = of(&cloud(20_000, 0.03, DVec3::ZERO));
        let shade = density.shade(DVec3::Y);
        assert!(shade.at(DVec3::new(0.0, 1.2, 0.0))[0] > 0.98);
        assert!(shade.at(DVec3::new(0.0, 50.0, 0.0))[0] > 0.98);
        // From a face half of the sky is open, from the middle little.
        let [face, middle] = [DVec3::X, DVec3::ZERO].map(|p| shade.at(p)[1]);
        assert!((0.4..0.65).contains(&face) && middle < 0.3, "{face} {middle}");
    }

    #[test]
    fn a_triangle_flat_or_without_extent_has_a_grid() {
        for corners in [[Vec3::ZERO, Vec3::X, Vec3::Z], [Vec3::ONE; 3]] {
            let soup = TriangleSoup {
                positions: corners.into(),
                triangles: vec![[0, 1, 2]],
                triangle_materials: vec![0],
                materials: vec![Material::default()],
                ..TriangleSoup::default()
            };
            let density = of(&soup);
            assert_eq!(density.problem(), None);
            let shade = density.shade(DVec3::Y);
            assert!(shade.at(DVec3::ZERO).iter().all(|v| (0.0..=1.0).contains(v)));
        }
    }

    #[test]
    fn broken_rules_are_told() {
        let sound = of(&cloud(50, 0.1, DVec3::ZERO));
        let told = |change: &dyn Fn(&mut Density)| {
            let mut own = sound.clone();
            change(&mut own);
            own.problem().unwrap()
        };
        assert!(told(&|d| d.cell = 0.0).contains("cells of 0"));
        assert!(told(&|d| d.low[1] = f64::NAN).contains("finite"));
        assert!(told(&|d| d.size[2] = 65).contains("1 to 64"));
        assert!(told(&|d| d.densest = -1.0).contains("-1"));
        assert!(told(&|d| d.sky.push(0)).contains("by the header"));
    }
}
