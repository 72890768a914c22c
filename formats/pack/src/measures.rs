//! Section [`crate::kind::MEASURES`]: what each level of each representation costs, and how far it
//! is from the source. One layout for all representations.
//!
//! Times are not stored: the same input gives the same bytes on every machine.

use crate::{Pack, PackError, PackWriter, SectionId, header, kind};
use serde::{Deserialize, Serialize};

const ID: SectionId = SectionId::new(kind::MEASURES, 0);

/// The measured table of a pack.
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
pub struct Measures {
    /// How it was measured, for people: views, samples, light, background.
    pub method: String,
    /// The rows; their order means nothing.
    pub rows: Vec<Measure>,
}

/// One level at one pixel height, seen from one band of elevations: means over the views in it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measure {
    /// Kind of the representation's header section: [`kind::POINTS_HEADER`] for points.
    pub representation: u16,
    /// What selects the level; what the numbers mean is the representation's business. For points:
    /// s_m, s_M and k in square pixels.
    pub level: [f32; 3],
    /// Height of the block in pixels: of the longest side of its box.
    pub pixel_height: f32,
    /// Elevations above the horizon in degrees, lowest and highest.
    pub elevation: [f32; 2],
    /// The light.
    pub light: Light,
    /// Points, triangles or billboards drawn.
    pub primitives: f32,
    /// Bytes of records that are looked at.
    pub bytes: f32,
    /// Root mean square error of premultiplied linear RGBA: the mean over the views.
    pub rmse: f32,
    /// The largest of a view.
    pub rmse_worst: f32,
    /// Mean FLIP error over the views.
    pub flip: f32,
    /// The largest of a view.
    pub flip_worst: f32,
    /// Structural similarity.
    pub ssim: f32,
    /// Coverage over the source's coverage, minus one.
    pub coverage: f32,
}

/// Light under which a level was judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Light {
    /// Base colours.
    Albedo,
    /// A sun and a sky.
    Sun,
}

/// An error that a level can be chosen by: the largest of the measured views counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorKind {
    /// Mean FLIP.
    Flip,
    /// Root mean square error of premultiplied linear RGBA.
    Rmse,
}

/// What a level is wanted for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Need {
    /// Kind of the representation's header section.
    pub representation: u16,
    /// Height of the block in pixels.
    pub pixel_height: f32,
    /// Elevation of the camera above the block's horizon in degrees; `None` for all.
    pub elevation: Option<f32>,
    /// Which error counts.
    pub error: ErrorKind,
}

impl Measures {
    /// The table of a pack, if it has one.
    ///
    /// # Errors
    /// When the section is damaged or breaks a rule.
    pub fn read(pack: &Pack) -> Result<Option<Self>, PackError> {
        if !pack.contains(ID) {
            return Ok(None);
        }
        let table: Self = header::decode(pack, ID)?;
        table.validate().map_err(|problem| PackError::invalid(pack.path(), ID, problem))?;
        Ok(Some(table))
    }

    /// Adds the table to a pack.
    ///
    /// # Errors
    /// When the disk is full or a row breaks a rule.
    pub fn write(&self, writer: &mut PackWriter) -> Result<(), PackError> {
        self.validate().map_err(|problem| PackError::invalid(writer.path(), ID, problem))?;
        header::write(writer, ID, self)
    }

    /// Checks the rules of SPEC.md, section 4.3.
    ///
    /// # Errors
    /// The first broken rule, with the row and the value.
    pub fn validate(&self) -> Result<(), String> {
        for (i, r) in self.rows.iter().enumerate() {
            let size = [r.pixel_height, r.primitives, r.bytes];
            let errors = [r.rmse, r.rmse_worst, r.flip, r.flip_worst];
            let level = r.level;
            let sound = level.iter().all(|v| !v.is_nan())
                && size.iter().chain(&errors).all(|v| v.is_finite() && *v >= 0.0)
                && r.ssim.is_finite()
                && r.coverage.is_finite()
                && r.pixel_height > 0.0
                && r.elevation[0] <= r.elevation[1];
            if !sound {
                return Err(format!("row {i} has a value out of range: {r:?}"));
            }
        }
        Ok(())
    }

    /// The level with the fewest primitives whose error is at most `limit`, and what it promises.
    pub fn cheapest(&self, need: &Need, limit: f32) -> Option<Choice> {
        let good = self.choices(need).into_iter().filter(|c| c.error <= limit);
        good.min_by(|a, b| a.primitives.total_cmp(&b.primitives).then(a.error.total_cmp(&b.error)))
    }

    /// The level with the least error that draws at most `limit` primitives.
    pub fn best_within(&self, need: &Need, limit: f32) -> Option<Choice> {
        let good = self.choices(need).into_iter().filter(|c| c.primitives <= limit);
        good.min_by(|a, b| a.error.total_cmp(&b.error).then(a.primitives.total_cmp(&b.primitives)))
    }

    /// What is known of each level at the needed height: the worst of the elevations that may be
    /// met. Between two measured heights both bounds hold, for the level that means the same cut
    /// in square pixels; beyond them the nearest counts, and nothing is promised.
    fn choices(&self, need: &Need) -> Vec<Choice> {
        let mut rows: Vec<&Measure> = self
            .rows
            .iter()
            .filter(|r| r.representation == need.representation && r.light == Light::Albedo)
            .filter(|r| {
                need.elevation.is_none_or(|e| {
                    let [from, to] = r.elevation;
                    (from..to).contains(&e.clamp(-89.9, 89.9))
                })
            })
            .collect();
        rows.sort_by(|a, b| a.pixel_height.total_cmp(&b.pixel_height));
        let below = rows.iter().rev().find(|r| r.pixel_height <= need.pixel_height);
        let above = rows.iter().find(|r| r.pixel_height >= need.pixel_height);
        let heights: Vec<f32> = below.into_iter().chain(above).map(|r| r.pixel_height).collect();
        let mut choices: Vec<Choice> = Vec::new();
        for r in rows.iter().filter(|r| heights.contains(&r.pixel_height)) {
            let error = match need.error {
                ErrorKind::Flip => r.flip_worst,
                ErrorKind::Rmse => r.rmse_worst,
            };
            match choices.iter_mut().find(|c| c.level == r.level) {
                Some(c) => {
                    c.error = c.error.max(error);
                    c.primitives = c.primitives.max(r.primitives);
                    c.heights |= 1 << u32::from(r.pixel_height != heights[0]);
                }
                None => {
                    let heights = 1 << u32::from(r.pixel_height != heights[0]);
                    let (level, primitives) = (r.level, r.primitives);
                    choices.push(Choice { level, primitives, error, heights });
                }
            }
        }
        // A level that was measured on one side only promises nothing in between.
        let all = if heights.first() == heights.last() { 1 } else { 3 };
        choices.retain(|c| c.heights == all);
        choices
    }
}

/// A level and what the table promises of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice {
    /// As in [`Measure::level`].
    pub level: [f32; 3],
    /// Primitives drawn, at most, in the mean over a band's views.
    pub primitives: f32,
    /// The error that was asked about, at most.
    pub error: f32,
    /// Which of the bracketing heights it was measured at.
    heights: u8,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(s_m: f32, pixel_height: f32, band: [f32; 2], primitives: f32, flip: f32) -> Measure {
        Measure {
            representation: kind::POINTS_HEADER,
            level: [s_m, 16.0 * s_m, 0.0],
            pixel_height,
            elevation: band,
            light: Light::Albedo,
            primitives,
            bytes: 16.0 * primitives,
            rmse: flip * 2.0,
            rmse_worst: flip * 3.0,
            flip,
            flip_worst: flip * 1.5,
            ssim: 0.9,
            coverage: 0.0,
        }
    }

    fn table() -> Measures {
        let (low, high) = ([-90.0, 20.0], [20.0, 90.0]);
        let rows = vec![
            row(1.0, 64.0, low, 1000.0, 0.02),
            row(4.0, 64.0, low, 300.0, 0.04),
            row(1.0, 64.0, high, 1100.0, 0.03),
            row(4.0, 64.0, high, 310.0, 0.05),
            row(1.0, 256.0, low, 9000.0, 0.03),
            row(4.0, 256.0, low, 4000.0, 0.06),
            row(1.0, 256.0, high, 9100.0, 0.03),
            row(16.0, 256.0, high, 900.0, 0.01),
        ];
        Measures { method: "made".into(), rows }
    }

    fn need(pixel_height: f32, elevation: Option<f32>) -> Need {
        let representation = kind::POINTS_HEADER;
        Need { representation, pixel_height, elevation, error: ErrorKind::Flip }
    }

    #[test]
    fn the_cheapest_that_is_good_enough_is_chosen() {
        let t = table();
        let level = |c: Option<Choice>| c.map(|c| c.level[0]);
        assert_eq!(level(t.cheapest(&need(64.0, Some(5.0)), 0.061)), Some(4.0));
        assert_eq!(level(t.cheapest(&need(64.0, Some(5.0)), 0.05)), Some(1.0));
        // All elevations: the worst band counts, 1.5 × 0.05.
        assert_eq!(level(t.cheapest(&need(64.0, None), 0.061)), Some(1.0));
        assert_eq!(t.cheapest(&need(64.0, None), 0.01), None);
        // Between two heights the worse one counts, and what was measured at one only does not.
        let between = t.cheapest(&need(100.0, Some(5.0)), 0.07).unwrap();
        assert_eq!((between.level[0], between.primitives), (1.0, 9000.0));
        assert_eq!(level(t.cheapest(&need(100.0, Some(40.0)), 1.0)), Some(1.0));
        // Beyond all heights the nearest counts.
        assert_eq!(level(t.cheapest(&need(2.0, Some(5.0)), 0.061)), Some(4.0));
        let other = Need { representation: 99, ..need(64.0, None) };
        assert_eq!(t.cheapest(&other, 1.0), None);
    }

    #[test]
    fn the_best_within_a_budget_is_chosen() {
        let t = table();
        let best = |n| t.best_within(&need(64.0, Some(5.0)), n).map(|c| c.level[0]);
        assert_eq!((best(1e6), best(500.0), best(100.0)), (Some(1.0), Some(4.0), None));
        let rmse = Need { error: ErrorKind::Rmse, ..need(64.0, Some(5.0)) };
        assert!((t.best_within(&rmse, 1e6).unwrap().error - 0.06).abs() < 1e-6);
    }

    #[test]
    fn broken_rows_are_named() {
        let mut t = table();
        t.rows[3].flip = f32::NAN;
        assert!(t.validate().unwrap_err().starts_with("row 3"));
        let mut t = table();
        t.rows[1].pixel_height = 0.0;
        assert!(t.validate().unwrap_err().starts_with("row 1"));
    }
}
