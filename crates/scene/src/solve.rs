//! Ways to prune the packs of a scene, what each takes, and how far pictures are expected to be off by it.

use crate::budget::{Candidate, Choice, frontier};
use crate::error::SceneError;
use crate::expected::Expected;
use crate::filled::filled;
use crate::need::{Fineness, SpeciesNeed, needs};
use crate::scene::Scene;
use crate::species::Species;
use forest_pack::kind;
use forest_points::{PointsNeed, Thresholds, pruned_bytes};
use forest_views::{Channel, ViewsBlock};
use std::ops::Range;

/// Smallest points of candidates: from as large as the tree by factors of two.
const STEPS: i32 = 32;

/// Room for what stands around sections.
const AROUND: u64 = 4096;

/// The candidates of each species, and the best choices of one each.
#[derive(Clone, Debug)]
pub struct Solved {
    /// Of each species, needs to prune its pack to.
    pub candidates: Vec<Vec<(SpeciesNeed, Candidate)>>,
    /// The smallest first.
    pub front: Vec<Choice>,
}

impl Solved {
    /// The needs of a choice.
    pub fn needs(&self, choice: &Choice) -> Vec<SpeciesNeed> {
        choice.picks.iter().zip(&self.candidates).map(|(i, c)| c[*i].0.clone()).collect()
    }
}

/// Finds the best choices for a scene whose packs have measured tables.
///
/// # Errors
/// When a pack is damaged, or has no table of its points (and of its views by three, if it has views).
pub fn solve(scene: &Scene, drawn: &Fineness) -> Result<Solved, SceneError> {
    let all = needs(scene, drawn)?;
    let by_points = needs(scene, &Fineness { impostors: 0.0, ..*drawn })?;
    let filled = filled(scene, drawn.height);
    let mut candidates = Vec::new();
    for ((species, filled), [need, points]) in
        scene.species.iter().zip(&filled).zip(all.iter().zip(&by_points).map(|(a, b)| [a, b]))
    {
        let expected = Expected::read(species)?;
        let (block, views) = (species.points()?, species.views()?);
        let [always, materials] = fixed_bytes(species, block.cells.len());
        let of = |need: SpeciesNeed| {
            let texels = match (&views, &need.views) {
                (Some(views), Some(levels)) => views_bytes(views, levels),
                _ => 0,
            };
            let [points, triangles] = pruned_bytes(&block, &need.points);
            let materials = if triangles > 0 { materials } else { 0 };
            let bytes = always + materials + points + triangles + texels;
            let error = expected.error(&need, filled, drawn);
            (need, Candidate { bytes, error })
        };
        let ways = ways(need, &points.points, expected.longest());
        candidates.push(ways.into_iter().map(of).collect::<Vec<_>>());
    }
    let plain: Vec<Vec<Candidate>> =
        candidates.iter().map(|c| c.iter().map(|(_, c)| *c).collect()).collect();
    Ok(Solved { front: frontier(&plain), candidates })
}

/// All that is needed, and coarser: points down to those that are needed without views, for a tree so many
/// units of its pack large, and all, some, or no levels of views.
fn ways(need: &SpeciesNeed, points: &PointsNeed, longest: f64) -> Vec<SpeciesNeed> {
    let levels = need.views.clone().unwrap_or(0..0);
    let mut views: Vec<Option<Range<usize>>> =
        levels.clone().map(|first| Some(first..levels.end)).collect();
    views.push(None);
    let areas = (0..STEPS).map(|step| longest * longest * 0.5f64.powi(step));
    let coarser = areas.filter(|a| *a > points.finest).map(|finest| {
        let largest = points.largest.max(finest * Thresholds::LARGEST_RATIO);
        PointsNeed { finest, largest }
    });
    let all_points: Vec<PointsNeed> = coarser.chain([*points]).collect();
    let with = |points: &PointsNeed| {
        let points = *points;
        views.iter().map(move |v| SpeciesNeed { points, views: v.clone() })
    };
    [need.clone()].into_iter().chain(all_points.iter().flat_map(with)).collect()
}

/// Bytes of the colour and depth of levels of views.
fn views_bytes(views: &ViewsBlock, levels: &Range<usize>) -> u64 {
    let channels = [Channel::Color, Channel::Depth];
    let level = |l: usize| {
        let texels: u64 = channels.iter().map(|c| views.channel_bytes(*c, l)).sum();
        texels + size_of_val(views.tiles[l]) as u64
    };
    levels.clone().map(level).sum()
}

/// Bytes of what any pruned pack has, cells with the numbers of their points and tables; and of the materials
/// and textures that one with triangles has.
fn fixed_bytes(species: &Species, cells: usize) -> [u64; 2] {
    let records = [kind::POINTS, kind::POINTS_TRIANGLES, kind::POINTS_TRIANGLE_COLORS];
    let (mut always, mut materials) = (8 * cells as u64 + AROUND, 0);
    for (id, section) in species.pack.sections().filter(|(id, _)| id.kind < kind::VIEWS_HEADER) {
        let bytes = section.length.next_multiple_of(64);
        match id.kind {
            kind::MATERIALS.. => materials += bytes,
            kind if !records.contains(&kind) => always += bytes,
            _ => {}
        }
    }
    [always, materials]
}
