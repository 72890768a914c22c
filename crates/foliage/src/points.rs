//! What moves the points of a pack: each point, and each corner of its triangles, hangs on the branch of the
//! foliage that is nearest to it. So points bend as the finest level of foliage does, and a change from one
//! to the other moves nothing in the wind.

use crate::block::FoliageBlock;
use crate::wind::{Hung, Pose};
use forest_pack::{Codec, Pack, PackError, PackWriter, SectionId, kind};
use forest_points::PointsBlock;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use rstar::RTree;
use rstar::primitives::GeomWithData;
use std::borrow::Cow;

/// Sections of points and of triangles.
const POINTS: SectionId = SectionId::new(kind::WIND_POINTS, 0);
const CORNERS: SectionId = SectionId::new(kind::WIND_TRIANGLES, 0);

/// What moves each point of a block, and each corner of its triangles.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PointsWind<'a> {
    /// One a point, in the order of the block's.
    pub points: Cow<'a, [Hung]>,
    /// One a corner; empty if the block has no triangles.
    pub corners: Cow<'a, [[Hung; 3]]>,
}

/// Surfaces of the foliage are asked every so many texels of its finest level.
const SPACING: f64 = 6.0;

/// A place on the foliage, and what moves it.
type Place = GeomWithData<[f32; 3], Hung>;

impl PointsWind<'static> {
    /// Hangs the points of a block on the foliage of the same source.
    pub fn new(foliage: &FoliageBlock, block: &PointsBlock) -> Self {
        let near = RTree::bulk_load(places(foliage));
        let from = block.origin() - foliage.origin();
        let hung = |position: DVec3| {
            let p = (from + position * block.scale()).as_vec3();
            near.nearest_neighbor(p.to_array()).map_or_else(Hung::default, |found| found.data)
        };
        let points = block.cells.par_iter().flat_map_iter(|cell| {
            let points = block.cell_points(cell).iter();
            points.map(|p| hung(block.position(cell, p.position)))
        });
        let corners = block.cells.par_iter().flat_map_iter(|cell| {
            let triangles = block.cell_triangles(cell).iter();
            triangles.map(|t| t.corners.map(|c| hung(block.position(cell, c.position))))
        });
        Self { points: points.collect(), corners: corners.collect() }
    }
}

impl<'a> PointsWind<'a> {
    /// Those of a pack whose foliage moves `branches` records, if they are there.
    ///
    /// # Errors
    /// When a section is damaged, or does not fit the block or the branches.
    pub fn read(
        pack: &'a Pack,
        block: &PointsBlock,
        branches: usize,
    ) -> Result<Option<Self>, PackError> {
        if !pack.contains(POINTS) {
            return Ok(None);
        }
        let points: &[Hung] = pack.records(POINTS)?;
        let corners: &[[Hung; 3]] =
            if block.triangles.is_empty() { &[] } else { pack.records(CORNERS)? };
        let broken = |id, problem| Err(PackError::invalid(pack.path(), id, problem));
        for (id, have, want) in [
            (POINTS, points.len(), block.points.len()),
            (CORNERS, corners.len(), block.triangles.len()),
        ] {
            if have != want {
                return broken(id, format!("{have} entries; the points have {want}"));
            }
        }
        for (id, all) in [(POINTS, points), (CORNERS, corners.as_flattened())] {
            if let Some((i, h)) = (0..).zip(all).find(|(_, h)| usize::from(h.branch) >= branches) {
                let problem = format!("entry {i} hangs on branch {} of {branches}", h.branch);
                return broken(id, problem);
            }
        }
        Ok(Some(Self { points: points.into(), corners: corners.into() }))
    }

    /// Adds the sections to a pack.
    ///
    /// # Errors
    /// When they cannot be written.
    pub fn write(&self, writer: &mut PackWriter) -> Result<(), PackError> {
        writer.add(POINTS, Codec::None, bytemuck::cast_slice(&self.points))?;
        if !self.corners.is_empty() {
            writer.add(CORNERS, Codec::None, bytemuck::cast_slice(&self.corners))?;
        }
        Ok(())
    }
}

/// Points of a pack in the wind.
#[derive(Clone, Debug)]
pub struct BentPoints<'a> {
    foliage: &'a FoliageBlock<'a>,
    wind: &'a PointsWind<'a>,
    pose: &'a Pose,
}

impl<'a> BentPoints<'a> {
    /// Points that hang on `foliage` as `wind` says, whose branches stand as `pose`.
    pub fn new(foliage: &'a FoliageBlock, wind: &'a PointsWind, pose: &'a Pose) -> Self {
        Self { foliage, wind, pose }
    }

    /// What moves a point, by its place in the block's array.
    pub fn point(&self, index: u32) -> Hung {
        self.wind.points[index as usize]
    }

    /// What moves the corners of a triangle, by its place in the block's array.
    pub fn corners(&self, index: u32) -> [Hung; 3] {
        self.wind.corners[index as usize]
    }

    /// Where something is that rests at `place` in the world.
    pub fn place(&self, hung: Hung, place: DVec3) -> DVec3 {
        let rest = (place - self.foliage.origin()).as_vec3();
        let branches = self.foliage.branches;
        let moved = self.pose.place(branches, hung, rest);
        self.foliage.origin() + moved.as_dvec3()
    }

    /// Which way something points there that rests along `direction`.
    pub fn direction(&self, hung: Hung, direction: DVec3) -> DVec3 {
        let rest = direction.as_vec3();
        self.pose.direction(hung, rest).as_dvec3().normalize_or_zero()
    }
}

/// Places at most, for as many triangles: 4 million, but one corner and more of each.
const MOST_PLACES: f64 = 4e6;

/// Places all over the finest level, and what moves them there.
fn places(foliage: &FoliageBlock) -> Vec<Place> {
    let vertices = foliage.vertices[0];
    let longest = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| Vec3::from(vertices[v as usize].position));
        f64::from(a.distance(b).max(b.distance(c)).max(c.distance(a)))
    };
    let steps = |t: &[u32; 3], spacing: f64| (longest(t) / spacing).ceil().clamp(1.0, 256.0);
    let count = |spacing: f64| -> f64 {
        foliage.indices[0].par_iter().map(|t| (steps(t, spacing) + 1.0).powi(2) * 0.5).sum()
    };
    // No finer than single precision tells, nor than memory holds.
    let mut spacing = (SPACING * foliage.header.levels[0].texel).max(f64::from(f32::MIN_POSITIVE));
    // At least a triangle's corners.
    let most = MOST_PLACES.max(2.0 * foliage.indices[0].len() as f64);
    while count(spacing) > most {
        spacing *= 2.0;
    }
    let of = |t: &[u32; 3]| {
        let corners = t.map(|v| &vertices[v as usize]);
        let [a, b, c] = corners.map(|v| Vec3::from(v.position));
        let steps = (steps(t, spacing) as u32).max(1);
        let grid = (0..=steps).flat_map(move |i| (0..=steps - i).map(move |j| [i, j]));
        grid.map(move |[i, j]| {
            let [u, v] = [i, j].map(|k| k as f32 / steps as f32);
            let weights = [1.0 - u - v, u, v];
            let most = (0..3).max_by(|a, b| weights[*a].total_cmp(&weights[*b])).unwrap_or(0);
            let hung = corners[most].hung;
            // Between corners of one branch; else as the nearest corner.
            let hung = if corners.iter().all(|c| c.hung.branch == hung.branch) {
                let share: f32 = (0..3).map(|k| weights[k] * corners[k].hung.share()).sum();
                Hung::new(hung.branch.into(), share)
            } else {
                hung
            };
            let place = a * weights[0] + b * weights[1] + c * weights[2];
            Place::new(place.to_array(), hung)
        })
    };
    foliage.indices[0].par_iter().flat_map_iter(of).collect()
}
