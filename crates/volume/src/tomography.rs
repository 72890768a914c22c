//! Opacity of cells from the mattes of photographs.
//!
//! Emission–absorption tomography: the optical depth −ln(1 − alpha) of a ray is the sum over the
//! cells that it crosses of their density times the way through them. Densities are found by the
//! simultaneous algebraic reconstruction technique (A. Andersen, A. Kak, "Simultaneous algebraic
//! reconstruction technique (SART)", Ultrasonic Imaging 6, 1984): each subset of photographs spreads
//! what its rays still lack over their cells, by the way through them; densities stay ≥ 0. It goes
//! level by level, and only what holds something is refined (paper 004, section 2.1, after Reche
//! et al. 2004).

use crate::cells::{Cells, Opacity};
use crate::error::VolumeError;
use crate::lattice::Lattice;
use crate::march::{LocalRay, walk};
use crate::matte::Matte;
use forest_soup::Photograph;
use glam::UVec3;
use rayon::prelude::*;

/// How densities are estimated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TomographyOptions {
    /// Rounds over all photographs on each level.
    pub rounds: u32,
    /// Share of what a ray lacks that a round makes up, above 0 and at most 1.
    pub relaxation: f64,
}

impl Default for TomographyOptions {
    fn default() -> Self {
        Self { rounds: 8, relaxation: 0.7 }
    }
}

/// What an estimate came to.
#[derive(Clone, Debug, PartialEq)]
pub struct TomographyReport {
    /// Cells that were estimated on each level, from the root down; 0 where none was needed.
    pub cells: Vec<u64>,
    /// Root mean square difference of each photograph's matte and the volume's, on the finest
    /// level.
    pub residuals: Vec<f64>,
}

/// Level of the first estimate.
const FIRST: u32 = 3;

/// Alpha above which a matte says no more than "opaque".
const OPAQUE: f64 = 0.99;

/// Opacity below which a cell holds nothing: on coarser levels a twig may be all of it.
const EMPTY: f32 = 0.02;
const EMPTY_COARSE: f32 = 0.004;

/// Photographs whose corrections are taken together.
const SUBSET: usize = 4;

/// A ray's cells, and what it should lose in them.
struct Measured {
    ray: LocalRay,
    depth: f64,
    saturated: bool,
}

/// Estimates the opacity of all cells.
///
/// # Errors
/// When no cell is covered in all mattes that see it, or all are next to transparent.
pub(crate) fn estimate(
    lattice: &Lattice,
    photos: &[Photograph],
    mattes: &[Matte],
    options: &TomographyOptions,
    progress: &(dyn Fn(u64) + Sync),
) -> Result<(Opacity, TomographyReport), VolumeError> {
    let first = FIRST.min(lattice.levels);
    let n = lattice.cells(first);
    let mut places: Vec<UVec3> =
        (0..n * n * n).map(|i| UVec3::new(i % n, i / n % n, i / (n * n))).collect();
    let mut densities = vec![0.1f32; places.len()];
    let mut report = TomographyReport { cells: vec![0; first as usize], residuals: Vec::new() };
    for level in first..=lattice.levels {
        let level = Level { lattice, level, photos, mattes };
        (places, densities) = level.carve(places, densities)?;
        report.cells.push(places.len() as u64);
        let cells = Cells::new(lattice.cells(level.level), places, Vec::new());
        for _ in 0..options.rounds {
            level.round(&cells, &mut densities, options.relaxation as f32);
            progress(1);
        }
        let last = level.level == lattice.levels;
        if last {
            report.residuals = level.residuals(&cells, &densities);
        }
        let least = if last { EMPTY } else { EMPTY_COARSE };
        let kept: Vec<(UVec3, f32)> = cells
            .places
            .into_iter()
            .zip(densities)
            .filter(|(_, density)| opacity(*density) > least)
            .collect();
        if kept.is_empty() {
            let what =
                format!("no cell of level {} stops more than {least} of the light", level.level);
            return Err(VolumeError::NothingToSee(what));
        }
        (places, densities) = kept.into_iter().unzip();
        if !last {
            (places, densities) = refined(lattice, &places, &densities);
        }
    }
    let mut finest = vec![0.0; (lattice.cells(lattice.levels) as usize).pow(3)];
    for (&place, &density) in places.iter().zip(&densities) {
        finest[lattice.dense(lattice.levels, place)] = opacity(density);
    }
    Ok((Opacity::from_finest(lattice, finest), report))
}

/// What a cell of this density stops along its side.
fn opacity(density: f32) -> f32 {
    1.0 - (-density).exp()
}

/// The children of cells, as dense for each world unit.
fn refined(lattice: &Lattice, places: &[UVec3], densities: &[f32]) -> (Vec<UVec3>, Vec<f32>) {
    let branching = lattice.branching;
    let factor = branching.factor();
    let children = places.iter().zip(densities).flat_map(|(&place, &density)| {
        (0..branching.children())
            .map(move |c| (place * factor + branching.place(c), density / factor as f32))
    });
    children.unzip()
}

struct Level<'a> {
    lattice: &'a Lattice,
    level: u32,
    photos: &'a [Photograph],
    mattes: &'a [Matte],
}

impl Level<'_> {
    /// Rays of a photograph through the middles of squares about as wide as two thirds of a cell.
    fn rays(&self, photo: &Photograph, matte: &Matte) -> Vec<Measured> {
        let camera = &photo.camera;
        let depth = (self.lattice.middle() - camera.eye).dot(camera.forward);
        let side = self.lattice.cell_side(self.level);
        let wide = side * camera.pixels_per_area(depth.max(side)).sqrt();
        let step = ((wide / 1.5) as u32).max(1);
        let [columns, rows] = camera.size.map(|n| n / step);
        let square = |i: u32| f64::from(i * step) + 0.5 * f64::from(step);
        (0..rows * columns)
            .filter_map(|i| {
                let (column, row) = (i % columns, i / columns);
                let (origin, direction) = camera.ray(square(column), square(row))?;
                let alpha = matte.mean([column * step, row * step], [step, step]);
                Some(Measured {
                    ray: LocalRay { origin: self.lattice.local(self.level, origin), direction },
                    depth: -(1.0 - alpha.min(OPAQUE)).ln(),
                    saturated: alpha >= OPAQUE,
                })
            })
            .collect()
    }

    /// Leaves out cells in which a photograph sees nothing at all, or that none sees.
    fn carve(
        &self,
        places: Vec<UVec3>,
        densities: Vec<f32>,
    ) -> Result<(Vec<UVec3>, Vec<f32>), VolumeError> {
        let verdict = |place: &UVec3| {
            let center = self.lattice.center(self.level, *place);
            let half = 0.5 * self.lattice.cell_side(self.level);
            let mut seen = false;
            for (photo, matte) in self.photos.iter().zip(self.mattes) {
                match matte.shows(&photo.camera, center, half) {
                    Some(true) => seen = true,
                    Some(false) => return false,
                    None => {}
                }
            }
            seen
        };
        let keep: Vec<bool> = places.par_iter().map(verdict).collect();
        let kept = places.into_iter().zip(densities).zip(keep).filter(|(_, keep)| *keep);
        let (places, densities): (Vec<UVec3>, Vec<f32>) = kept.map(|(cell, _)| cell).unzip();
        if places.is_empty() {
            return Err(VolumeError::Inconsistent(format!(
                "no place of level {} is covered in all mattes that show it",
                self.level
            )));
        }
        Ok((places, densities))
    }

    /// One round over all photographs, a subset at a time.
    fn round(&self, cells: &Cells, densities: &mut [f32], relaxation: f32) {
        let subsets = self.photos.len().div_ceil(SUBSET);
        for subset in 0..subsets {
            // Photographs far from each other in the list, and so around the tree.
            let members: Vec<usize> = (subset..self.photos.len()).step_by(subsets).collect();
            let corrections: Vec<Vec<[f32; 2]>> = members
                .into_par_iter()
                .map(|i| {
                    let mut sums = vec![[0.0f32; 2]; densities.len()];
                    let mut met = Vec::new();
                    for measured in self.rays(&self.photos[i], &self.mattes[i]) {
                        self.correct(cells, &measured, densities, &mut met, &mut sums);
                    }
                    sums
                })
                .collect();
            densities.par_iter_mut().enumerate().for_each(|(i, density)| {
                let (lack, way) =
                    corrections.iter().fold((0.0, 0.0), |s, c| (s.0 + c[i][0], s.1 + c[i][1]));
                if way > 0.0 {
                    *density = (*density + relaxation * lack / way).max(0.0);
                }
            });
        }
    }

    /// Adds to each cell of a ray what the ray lacks, and the way through the cell.
    fn correct(
        &self,
        cells: &Cells,
        measured: &Measured,
        densities: &[f32],
        met: &mut Vec<(u32, f32)>,
        sums: &mut [[f32; 2]],
    ) {
        met.clear();
        let (mut all, mut depth) = (0.0, 0.0);
        walk(cells, &measured.ray, 0.0, |cell, enter, leave| {
            let way = (leave - enter) as f32;
            met.push((cell, way));
            all += way;
            depth += way * densities[cell as usize];
            true
        });
        let lack = measured.depth as f32 - depth;
        // An opaque matte says only that there is at least so much.
        let lack = if measured.saturated { lack.max(0.0) } else { lack };
        for &(cell, way) in met.iter() {
            let sum = &mut sums[cell as usize];
            sum[0] += way * lack / all;
            sum[1] += way;
        }
    }

    /// Of each photograph, the root mean square difference of the mattes.
    fn residuals(&self, cells: &Cells, densities: &[f32]) -> Vec<f64> {
        let residual = |(photo, matte): (&Photograph, &Matte)| {
            let (mut square, mut count) = (0.0, 0.0);
            for measured in self.rays(photo, matte) {
                let mut depth = 0.0;
                walk(cells, &measured.ray, 0.0, |cell, enter, leave| {
                    depth += (leave - enter) * f64::from(densities[cell as usize]);
                    true
                });
                // Where both are empty nothing is compared.
                if depth > 0.0 || measured.depth > 0.0 {
                    square += ((-measured.depth).exp() - (-depth.min(-(1.0 - OPAQUE).ln())).exp())
                        .powi(2);
                    count += 1.0;
                }
            }
            (square / f64::max(count, 1.0)).sqrt()
        };
        self.photos.par_iter().zip(self.mattes).map(residual).collect()
    }
}
