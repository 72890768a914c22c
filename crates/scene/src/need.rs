//! What a scene can ever ask of its packs.

use crate::error::SceneError;
use crate::impostor::{Impostor, LEAST_IMPOSTOR};
use crate::scene::Scene;
use crate::sight::Sight;
use crate::species::Canopy;
use forest_points::{PixelArea, PointsNeed};
use glam::{DQuat, DVec3};
use rayon::prelude::*;
use std::ops::Range;

/// How finely a landscape is drawn, at the finest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fineness {
    /// Height of pictures in pixels.
    pub height: u32,
    /// s_m.
    pub finest: PixelArea,
    /// s_M.
    pub largest: PixelArea,
    /// How many times as large as they are as fine as points views may be; 0 for none.
    pub impostors: f64,
}

/// What a scene asks of a species' pack.
#[derive(Clone, Debug, PartialEq)]
pub struct SpeciesNeed {
    /// Of its points and triangles.
    pub points: PointsNeed,
    /// Levels of its views that are drawn; without any, none.
    pub views: Option<Range<usize>>,
}

/// Sizes and distances may be rounded in pictures: what lies so near a limit counts on both sides.
const SLACK: f64 = 1.01;

/// What is asked of a species, over all trees and eyes.
#[derive(Clone, Copy, Debug)]
struct Asked {
    /// Pixels of a unit of the pack, where points are drawn.
    points: f64,
    /// Least and largest pixels along the side of a tile that is drawn.
    tiles: [f64; 2],
}

const NOTHING: Asked = Asked { points: 0.0, tiles: [f64::INFINITY, 0.0] };

impl Asked {
    fn and(self, other: Self) -> Self {
        let tiles = [self.tiles[0].min(other.tiles[0]), self.tiles[1].max(other.tiles[1])];
        Self { points: self.points.max(other.points), tiles }
    }
}

/// The need of each species from all cameras of a scene and all pictures of its paths, however the camera
/// turns. Of trees that a camera stands in everything is needed.
///
/// # Errors
/// When the views of a pack are damaged.
pub fn needs(scene: &Scene, drawn: &Fineness) -> Result<Vec<SpeciesNeed>, SceneError> {
    // Eyes, and pixels of a metre at a distance of one.
    let eyes: Vec<(DVec3, f64)> = sights(scene)
        .iter()
        .map(|s| {
            let camera = s.camera(&scene.land, [drawn.height; 2]);
            (camera.eye, camera.pixels_per_unit(1.0))
        })
        .collect();
    let stances = scene.stances();
    let impostors = scene
        .species
        .iter()
        .map(|s| Ok(s.views()?.map(|v| Impostor::new(&v, &s.stance))))
        .collect::<Result<Vec<_>, SceneError>>()?;
    let none = || vec![NOTHING; stances.len()];
    let asked = scene
        .trees
        .par_iter()
        .fold(none, |mut asked, tree| {
            let (stance, impostor) = (&stances[tree.species()], &impostors[tree.species()]);
            let scale = tree.scale(stance.scale);
            let foot = DVec3::from_array(tree.position.map(f64::from));
            for (eye, pixels) in &eyes {
                let nearest = (foot.distance(*eye) - stance.reach() * scale).max(0.0);
                let points = pixels * stance.unit * scale / nearest;
                let one = impostor.as_ref().map_or(Asked { points, ..NOTHING }, |i| {
                    let middle = foot + (DQuat::from_rotation_y(tree.yaw()) * i.center) * scale;
                    let distance = middle.distance(*eye);
                    let asked = by_size(points, pixels * i.side * scale / distance, i, drawn);
                    if i.is_within(scale, distance / SLACK) {
                        Asked { points, ..asked }
                    } else {
                        asked
                    }
                });
                let entry = &mut asked[tree.species()];
                *entry = entry.and(one);
            }
            asked
        })
        .reduce(none, |a, b| a.into_iter().zip(b).map(|(a, b)| a.and(b)).collect());
    let area = |a: PixelArea, pixels: f64| a.0 / (pixels * pixels);
    // Light falls through points, whatever is drawn.
    let light = scene
        .species
        .iter()
        .map(|s| Ok(Canopy::finest_area(&s.points()?)))
        .collect::<Result<Vec<_>, SceneError>>()?;
    let need = |((asked, impostor), light): ((Asked, &Option<Impostor>), f64)| SpeciesNeed {
        points: PointsNeed {
            finest: area(drawn.finest, asked.points).min(light),
            largest: area(drawn.largest, asked.points),
        },
        views: impostor.as_ref().and_then(|i| levels(i, asked.tiles, drawn)),
    };
    Ok(asked.into_iter().zip(&impostors).zip(light).map(need).collect())
}

/// All cameras of a scene and all pictures of its paths.
pub(crate) fn sights(scene: &Scene) -> Vec<Sight> {
    let along = scene.file.paths.iter().flat_map(|path| scene.file.along(path));
    scene.file.cameras.iter().cloned().chain(along).collect()
}

/// What a tree asks for whose pack's units have so many pixels, and whose tiles so many along a side.
fn by_size(points: f64, tile: f64, impostor: &Impostor, drawn: &Fineness) -> Asked {
    let [alone, largest] = impostor.range(impostor.texels, drawn.finest, drawn.impostors);
    let by_points = tile * SLACK >= alone || tile < LEAST_IMPOSTOR * SLACK;
    let by_views = tile < largest * SLACK && tile * SLACK >= LEAST_IMPOSTOR;
    Asked {
        points: if by_points { points } else { 0.0 },
        tiles: if by_views { [tile; 2] } else { NOTHING.tiles },
    }
}

/// The levels that tiles of these sizes are drawn of.
fn levels(impostor: &Impostor, [least, most]: [f64; 2], drawn: &Fineness) -> Option<Range<usize>> {
    if most == 0.0 {
        return None;
    }
    let Range { start, end } = impostor.levels.clone();
    // The level is the nearest power of two: tree.wgsl, board_of.
    let level = |tile: f64| (f64::from(impostor.texels) / tile).log2().round().max(0.0) as usize;
    let mut first = (start + level(most * SLACK)).min(end - 1);
    let last = (start + level(least / SLACK)).min(end - 1);
    // Without its finer levels a pack is drawn by views as far as it was.
    let same = |level: usize| {
        let texels = impostor.texels >> (level - start);
        let [alone, _] = impostor.range(texels, drawn.finest, drawn.impostors);
        f64::from(texels) >= impostor.apart || most * SLACK <= alone
    };
    while first > start && !same(first) {
        first -= 1;
    }
    Some(first..last + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn impostor() -> Impostor {
        let (center, side) = (DVec3::Y, 10.0);
        Impostor { center, side, texels: 128, apart: 50.0, levels: 1..7 }
    }

    fn drawn(finest: f64) -> Fineness {
        let finest = PixelArea(finest);
        Fineness { height: 720, finest, largest: finest, impostors: 1.0 }
    }

    #[test]
    fn levels_are_those_of_the_sizes_that_are_seen() {
        // Alone up to 40 pixels at s_m 1. 32 texels would do for 25 pixels, but up to 25.6 alone.
        let of = |tiles| levels(&impostor(), tiles, &drawn(1.0));
        assert_eq!(of([5.0, 20.0]), Some(3..6 + 1));
        assert_eq!(of([10.0, 39.0]), Some(2..5 + 1));
        assert_eq!(of(NOTHING.tiles), None);
        // Trees that fade are drawn as far as by the whole pack.
        assert_eq!(of([10.0, 45.0]), Some(2..5 + 1));
    }

    #[test]
    fn trees_ask_for_points_beside_the_sizes_of_views() {
        let of = |tile| by_size(7.0, tile, &impostor(), &drawn(4.0));
        // Alone up to 80, none from 100 on.
        assert_eq!((of(60.0).points, of(60.0).tiles), (0.0, [60.0; 2]));
        assert_eq!((of(90.0).points, of(90.0).tiles), (7.0, [90.0; 2]));
        assert_eq!((of(120.0).points, of(120.0).tiles[1]), (7.0, 0.0));
        assert_eq!((of(3.0).points, of(3.0).tiles[1]), (7.0, 0.0));
    }
}
