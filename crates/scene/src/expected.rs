//! The error that a scene's pictures are expected to have by a pruned pack, from its measured table.

use crate::error::SceneError;
use crate::filled::{Filled, HEIGHT_BANDS, band_height};
use crate::impostor::{Impostor, LEAST_IMPOSTOR};
use crate::need::{Fineness, SpeciesNeed};
use crate::species::Species;
use forest_pack::kind;
use forest_pack::measures::{self, ErrorKind, Light, Measures, Need};
use forest_views::Lookup;

/// What is known of a species' pack.
#[derive(Clone, Debug)]
pub(crate) struct Expected {
    impostor: Option<Impostor>,
    /// World units of the pack in its longest side.
    longest: f64,
    /// Sides of tiles over the longest side.
    tile: f64,
    /// Of each band of heights, s_m and error of points, the finest first; texels and error of views.
    points: Vec<Vec<[f64; 2]>>,
    views: Vec<Vec<[f64; 2]>>,
}

impl Expected {
    /// Reads the table of a pack.
    ///
    /// # Errors
    /// When the pack is damaged, or its table knows nothing of its points, or of its views.
    pub(crate) fn read(species: &Species) -> Result<Self, SceneError> {
        let path = species.pack.path();
        let missing = |what: &str| {
            let problem =
                format!("knows nothing of {what} under base colours: forest-bake eval --embed");
            SceneError::invalid(path, "the measured table", problem)
        };
        let table = Measures::read(&species.pack)?.ok_or_else(|| missing("anything"))?;
        let views = species.views()?;
        let impostor = views.as_ref().map(|v| Impostor::new(v, &species.stance));
        let [min, max] = species.stance.bounds;
        let metres = (max - min).max_element();
        let rows = |representation: u16, keep: &dyn Fn(&measures::Choice) -> bool| {
            let of = |band| {
                let mut found: Vec<[f64; 2]> = table
                    .choices(&need(representation, band_height(band)))
                    .into_iter()
                    .filter(|c| keep(c))
                    .map(|c| [f64::from(c.level[0]), f64::from(c.error)])
                    .collect();
                found.sort_by(|a, b| a[0].total_cmp(&b[0]));
                found
            };
            (0..HEIGHT_BANDS).map(of).collect::<Vec<_>>()
        };
        let plain = |c: &measures::Choice| c.level[2] == 0.0 && c.level[0] > 0.0;
        let blend = |c: &measures::Choice| c.level[1] == f32::from(Lookup::Blend as u8);
        let points = rows(kind::POINTS_HEADER, &plain);
        if points.iter().all(Vec::is_empty) {
            return Err(missing("points"));
        }
        let by_views = rows(kind::VIEWS_HEADER, &blend);
        if impostor.is_some() && by_views.iter().all(Vec::is_empty) {
            return Err(missing("blended views"));
        }
        Ok(Self {
            tile: impostor.as_ref().map_or(0.0, |i| i.side / metres),
            impostor,
            longest: metres / species.stance.unit,
            points,
            views: by_views,
        })
    }

    /// World units of the pack in its longest side.
    pub(crate) fn longest(&self) -> f64 {
        self.longest
    }

    /// What a pack pruned to `need` adds to the error of pictures that its trees fill so.
    pub(crate) fn error(&self, need: &SpeciesNeed, filled: &Filled, drawn: &Fineness) -> f64 {
        let of = |(band, share): (usize, &f64)| share * self.of_band(band, need, drawn);
        filled.iter().enumerate().filter(|(_, share)| **share > 0.0).map(of).sum()
    }

    /// The error of a tree of a band.
    fn of_band(&self, band: usize, need: &SpeciesNeed, drawn: &Fineness) -> f64 {
        let height = band_height(band);
        if let (Some(impostor), Some(levels)) = (&self.impostor, &need.views) {
            let finest = impostor.texels >> (levels.start - impostor.levels.start);
            let tile = height * self.tile;
            let [_, largest] = impostor.range(finest, drawn.finest, drawn.impostors);
            if tile >= LEAST_IMPOSTOR && tile < largest {
                let finer = (f64::from(finest) / tile).log2().round().max(0.0);
                let level = (finer as usize).min(levels.len() - 1);
                // A texel twice as wide is twice as far off.
                return between(&self.views[band], f64::from(finest >> level), |r| 1.0 / r);
            }
        }
        let pixels = height / self.longest;
        let finest = drawn.finest.0.max(need.points.finest * pixels * pixels);
        // The error of points grows about as the root of their area.
        between(&self.points[band], finest, f64::sqrt)
    }
}

fn need(representation: u16, height: f64) -> Need {
    let (elevation, light, error) = (None, Light::Albedo, ErrorKind::Flip);
    Need { representation, pixel_height: height as f32, elevation, light, error }
}

/// The value at `x` of rows that are sorted by x: on a line over log x between two. Beyond them it is that of
/// the nearest times `grown` of how far beyond, no less and up to 1.
fn between(rows: &[[f64; 2]], x: f64, grown: fn(f64) -> f64) -> f64 {
    let above = rows.partition_point(|r| r[0] < x);
    let beyond = |[at, error]: [f64; 2]| (error * grown(x / at).max(1.0)).min(1.0);
    match (above.checked_sub(1).map(|i| rows[i]), rows.get(above)) {
        (Some([x0, y0]), Some([x1, y1])) => y0 + (y1 - y0) * ((x / x0).ln() / (x1 / x0).ln()),
        (Some(last), None) => beyond(last),
        (None, Some(first)) => beyond(*first),
        (None, None) => 1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_between_and_beyond_what_was_measured() {
        let rows = [[1.0, 0.01], [4.0, 0.03]];
        let of = |x| between(&rows, x, f64::sqrt);
        assert!((of(2.0) - 0.02).abs() < 1e-12);
        // Points of four times the area are twice as far off; finer ones no better than measured.
        assert!((of(16.0) - 0.06).abs() < 1e-12 && (of(0.1) - 0.01).abs() < 1e-12);
        assert_eq!(of(1e9), 1.0);
        // Half as many texels are twice as far off.
        assert!((between(&[[8.0, 0.1], [16.0, 0.05]], 4.0, |r| 1.0 / r) - 0.2).abs() < 1e-12);
        assert_eq!(between(&[], 4.0, f64::sqrt), 1.0);
    }
}
