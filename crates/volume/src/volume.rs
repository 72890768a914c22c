//! A volume in memory: nodes, and the billboards that they have for each camera.

use crate::billboards::{CameraBillboards, billboards};
use crate::cells::{Cells, NONE, Opacity, cells};
use crate::coverage::coverage;
use crate::error::VolumeError;
use crate::frame::CameraFrame;
use crate::header::NodeRecord;
use crate::lattice::Lattice;
use crate::matte::Matte;
use crate::options::VolumeOptions;
use crate::photograph::{MAX_CAMERAS, Seen, Shot, Stand, photographs};
use crate::prune::pruned;
use crate::tomography::{TomographyOptions, TomographyReport, estimate};
use forest_raster::{CaptureScene, Surfaces};
use forest_soup::{Photograph, TriangleSoup};
use glam::{DVec3, UVec3};
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// A tree as an octree of billboards, textures not compressed.
#[derive(Clone, Debug)]
pub struct Volume {
    /// The cells.
    pub lattice: Lattice,
    /// The source's box in the world.
    pub bounds: [DVec3; 2],
    /// The cameras.
    pub cameras: Vec<CameraFrame>,
    /// Levels, from the root down.
    pub levels: Vec<VolumeLevel>,
    /// What it was asked for.
    pub options: VolumeOptions,
    /// What was found on the way.
    pub report: VolumeReport,
}

/// A level of a [`Volume`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VolumeLevel {
    /// The nodes; see [`NodeRecord`].
    pub nodes: Vec<NodeRecord>,
    /// Cameras for which nodes have billboards: one bit each, 32-bit words, each node's together.
    pub masks: Vec<u32>,
    /// sRGB and alpha of billboards, `texels²` each.
    pub texels: Vec<[u8; 4]>,
}

/// Counts of a level.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LevelCounts {
    /// Cells that hold something.
    pub cells: u64,
    /// Pairs of a cell and a camera: billboards before pruning.
    pub pairs: u64,
    /// Of these, pruned: hidden from the camera (and its neighbours), or within what is.
    pub hidden: u64,
    /// Of these, not hidden, but without anything to show.
    pub blank: u64,
}

/// What a bake found on the way.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VolumeReport {
    /// From the root down.
    pub levels: Vec<LevelCounts>,
    /// Photographing a mesh.
    pub photographs: Duration,
    /// Measuring or estimating opacity.
    pub opacity: Duration,
    /// Making billboards, all threads' time together: of the finest level, of all others.
    pub billboards: [Duration; 2],
    /// The estimate from mattes.
    pub tomography: Option<TomographyReport>,
}

/// Opacity of cells that a photograph shows and no axis' rays met: less than one ray.
const TRACE: f32 = 1.0 / 1024.0;

impl Volume {
    /// Makes a volume of a mesh, photographed from `stand`. `progress` is told how many cameras are
    /// done.
    ///
    /// # Errors
    /// When an option makes no sense, or nothing of the soup has an extent.
    pub fn from_mesh(
        soup: &TriangleSoup,
        surfaces: &Surfaces,
        stand: Stand,
        options: &VolumeOptions,
        progress: &(dyn Fn(u64) + Sync),
    ) -> Result<Self, VolumeError> {
        options.validate().map_err(VolumeError::Options)?;
        check_cameras(stand.directions().len())?;
        soup.validate()?;
        // About the soup's own origin: wherever it stands, the same is baked.
        let (origin, soup) = (soup.origin, &TriangleSoup { origin: DVec3::ZERO, ..soup.clone() });
        let bounds = soup.bounds();
        if bounds.is_empty() || bounds.size().max_element() <= 0.0 {
            let what = "no triangle with finite corners and an extent";
            return Err(VolumeError::NothingToSee(what.into()));
        }
        let bounds = [bounds.min, bounds.max];
        let lattice = cube(bounds, options.branching, options.levels);
        let start = Instant::now();
        let scene = CaptureScene::new(soup, surfaces);
        let shots = photographs(&scene, bounds, &lattice, options.texels, stand);
        let taken = start.elapsed();
        drop(scene);
        let start = Instant::now();
        let mut opacity = coverage(&lattice, soup, surfaces);
        mark(&lattice, &shots, &mut opacity);
        let report =
            VolumeReport { photographs: taken, opacity: start.elapsed(), ..Default::default() };
        let mut made = Self::assemble(lattice, bounds, &shots, &opacity, options, report, progress);
        made.lattice.corner += origin;
        made.bounds = made.bounds.map(|b| b + origin);
        Ok(made)
    }

    /// Makes a volume of photographs with mattes. Levels whose cells would be finer than their
    /// pixels are left out. `progress` is told of rounds and cameras.
    ///
    /// # Errors
    /// When an option makes no sense, mattes show nothing, or they contradict each other.
    pub fn from_photographs(
        photos: &[Photograph],
        tomography: &TomographyOptions,
        options: &VolumeOptions,
        progress: &(dyn Fn(u64) + Sync),
    ) -> Result<Self, VolumeError> {
        options.validate().map_err(VolumeError::Options)?;
        if !(tomography.relaxation > 0.0 && tomography.relaxation <= 1.0) {
            let value = tomography.relaxation;
            return Err(VolumeError::Options(format!(
                "a relaxation of {value}; above 0, at most 1"
            )));
        }
        check_cameras(photos.len())?;
        for photo in photos {
            if photo.pixels.iter().all(|p| p[3] == 0) {
                let what = format!("{}: its matte is empty", photo.name);
                return Err(VolumeError::NothingToSee(what));
            }
            if photo.pixels.iter().all(|p| p[3] == 255) {
                let what = "its matte is opaque everywhere: cut the background away (alpha)";
                return Err(VolumeError::Inconsistent(format!("{}: {what}", photo.name)));
            }
        }
        let start = Instant::now();
        let mattes: Vec<Matte> = photos.par_iter().map(Matte::new).collect();
        let bounds = crate::hull::bounds(photos, &mattes)?;
        let mut lattice = cube(bounds, options.branching, options.levels);
        while lattice.levels > 0 && cell_pixels(&lattice, photos) < 1.0 {
            lattice.levels -= 1;
        }
        let steps = AtomicU64::new(0);
        let tick = |_| progress(steps.fetch_add(1, Ordering::Relaxed) + 1);
        let (opacity, estimated) = estimate(&lattice, photos, &mattes, tomography, &tick)?;
        let report = VolumeReport {
            opacity: start.elapsed(),
            tomography: Some(estimated),
            ..Default::default()
        };
        let shots: Vec<Shot> = photos.iter().map(Shot::of).collect();
        Ok(Self::assemble(lattice, bounds, &shots, &opacity, options, report, &tick))
    }

    /// Billboards of all cameras, and the nodes that hold them.
    fn assemble(
        lattice: Lattice,
        bounds: [DVec3; 2],
        shots: &[Shot],
        opacity: &Opacity,
        options: &VolumeOptions,
        mut report: VolumeReport,
        progress: &(dyn Fn(u64) + Sync),
    ) -> Self {
        let levels = cells(&lattice, opacity);
        let radius = 0.5 * bounds[0].distance(bounds[1]);
        let frame = |s: &Shot| CameraFrame::of(&s.camera, lattice.middle(), radius);
        let frames: Vec<CameraFrame> = shots.iter().map(frame).collect();
        let done = AtomicU64::new(0);
        let mut cameras: Vec<CameraBillboards> = shots
            .par_iter()
            .zip(&frames)
            .map(|(shot, frame)| {
                let made = billboards(&lattice, &levels, shot, frame, options);
                progress(done.fetch_add(1, Ordering::Relaxed) + 1);
                made
            })
            .collect();
        report.billboards =
            [cameras.iter().map(|c| c.finest).sum(), cameras.iter().map(|c| c.coarser).sum()];
        let pruned = pruned(&levels, &cameras, &frames, options.prune_by);
        let t2 = (options.texels * options.texels) as usize;
        cameras.par_iter_mut().zip(&pruned).for_each(|(camera, pruned)| {
            camera
                .levels
                .iter_mut()
                .zip(pruned)
                .for_each(|(level, pruned)| level.remove(pruned, t2));
        });
        let count = |level: usize| {
            let (cells, all) = (levels[level].places.len() as u64, cameras.len() as u64);
            let of = |p: &Vec<Vec<bool>>| p[level].iter().filter(|p| **p).count() as u64;
            let hidden = pruned.iter().map(of).sum();
            let kept: u64 = cameras.iter().map(|c| c.levels[level].cells.len() as u64).sum();
            LevelCounts { cells, pairs: cells * all, hidden, blank: cells * all - hidden - kept }
        };
        report.levels = (0..levels.len()).map(count).collect();
        let levels = nodes(&levels, &cameras, options.texels);
        Self { lattice, bounds, cameras: frames, levels, options: *options, report }
    }

    /// All billboards' texels, level by level from the root down.
    pub fn texels(&self) -> Vec<[u8; 4]> {
        self.levels.iter().flat_map(|l| &l.texels).copied().collect()
    }

    /// Number of billboards.
    pub fn billboards(&self) -> u64 {
        let t2 = u64::from(self.options.texels * self.options.texels);
        self.levels.iter().map(|l| l.texels.len() as u64 / t2).sum()
    }
}

fn check_cameras(n: usize) -> Result<(), VolumeError> {
    if !(1..=MAX_CAMERAS as usize).contains(&n) {
        return Err(VolumeError::Options(format!("{n} cameras; from 1 to {MAX_CAMERAS}")));
    }
    Ok(())
}

/// The cube about a box, a little larger: nothing lies on its faces.
fn cube(bounds: [DVec3; 2], branching: crate::Branching, levels: u32) -> Lattice {
    let side = (bounds[1] - bounds[0]).max_element() * (1.0 + 1e-3);
    let corner = (bounds[0] + bounds[1]) * 0.5 - 0.5 * side;
    Lattice { corner, side, branching, levels }
}

/// Pixels along the side of a finest cell, in the sharpest photograph.
fn cell_pixels(lattice: &Lattice, photos: &[Photograph]) -> f64 {
    let pixels = |p: &Photograph| {
        let depth = (lattice.middle() - p.camera.eye).dot(p.camera.forward);
        // A camera within the volume sees some of it larger than this.
        let density = p.camera.pixels_per_area(depth.max(0.5 * lattice.side));
        lattice.cell_side(lattice.levels) * density.sqrt()
    };
    photos.iter().map(pixels).fold(0.0, f64::max)
}

/// Makes sure that what deep pictures show lies in a cell.
fn mark(lattice: &Lattice, shots: &[Shot], opacity: &mut Opacity) {
    let finest = lattice.levels;
    let n = f64::from(lattice.cells(finest));
    for shot in shots {
        let Seen::Deep(deep) = &shot.seen else { continue };
        let missing: Vec<UVec3> = (0..deep.width * deep.height)
            .into_par_iter()
            .flat_map_iter(|i| {
                let (x, y) = (f64::from(i % deep.width) + 0.5, f64::from(i / deep.width) + 0.5);
                let (from, along) = shot.camera.ray(x, y).expect("no lens");
                let known = &opacity.0[finest as usize];
                deep.hits(i as usize).iter().filter_map(move |hit| {
                    let at = lattice.local(finest, from + along * f64::from(hit.depth));
                    let place = at.clamp(DVec3::ZERO, DVec3::splat(n - 1.0)).as_uvec3();
                    (known[lattice.dense(finest, place)] == 0.0).then_some(place)
                })
            })
            .collect();
        for mut place in missing {
            for level in (0..=finest).rev() {
                let cell = &mut opacity.0[level as usize][lattice.dense(level, place)];
                if *cell > 0.0 {
                    break;
                }
                *cell = TRACE;
                place /= lattice.branching.factor();
            }
        }
    }
}

/// Nodes and billboards, node by node and then camera by camera. Cells without any are left out.
fn nodes(levels: &[Cells], cameras: &[CameraBillboards], texels: u32) -> Vec<VolumeLevel> {
    let words = cameras.len().div_ceil(32);
    let t2 = (texels * texels) as usize;
    let mut out: Vec<VolumeLevel> = Vec::new();
    // New numbers of the nodes of the level below.
    let mut below: Vec<u32> = Vec::new();
    for (level, cells) in levels.iter().enumerate().rev() {
        let mut masks = vec![0u32; cells.places.len() * words];
        for (c, camera) in cameras.iter().enumerate() {
            for &cell in &camera.levels[level].cells {
                masks[cell as usize * words + c / 32] |= 1 << (c % 32);
            }
        }
        let mut made = VolumeLevel::default();
        let mut numbers = vec![NONE; cells.places.len()];
        let mut next = vec![0; cameras.len()];
        let mut billboards = 0;
        for (i, place) in cells.places.iter().enumerate() {
            let (first_child, children) = kept_children(cells, i, &below);
            let mask = &masks[i * words..][..words];
            // The root stays, whatever it holds.
            if children == 0 && level > 0 && mask.iter().all(|m| *m == 0) {
                continue;
            }
            numbers[i] = made.nodes.len() as u32;
            made.nodes.push(NodeRecord {
                place: place.to_array().map(|v| v as u16),
                opacity: (cells.opacity[i] * 255.0).round() as u8,
                zero: 0,
                children,
                first_child,
                first_billboard: billboards,
            });
            made.masks.extend_from_slice(mask);
            for (c, camera) in cameras.iter().enumerate() {
                if mask[c / 32] >> (c % 32) & 1 == 1 {
                    let from = &camera.levels[level].texels[next[c] * t2..][..t2];
                    made.texels.extend_from_slice(from);
                    next[c] += 1;
                    billboards += 1;
                }
            }
        }
        below = numbers;
        out.push(made);
    }
    out.reverse();
    out
}

/// The first child and the mask of children of cell `i` that are kept, by their new numbers.
fn kept_children(cells: &Cells, i: usize, below: &[u32]) -> (u32, u32) {
    let Some(&(first, mask)) = cells.children.get(i) else { return (0, 0) };
    let (mut child, mut kept, mut kept_first) = (first, 0, 0);
    for k in (0..27).filter(|k| mask >> k & 1 == 1) {
        let number = below[child as usize];
        if number != NONE {
            if kept == 0 {
                kept_first = number;
            }
            kept |= 1 << k;
        }
        child += 1;
    }
    (kept_first, kept)
}
