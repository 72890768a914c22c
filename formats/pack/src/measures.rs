//! Section [`crate::kind::MEASURES`]: what each level of each representation costs, and how far it
//! is from the source. One layout for all representations.
//!
//! Times are not stored: the same input gives the same bytes whenever, and with any number of threads.

use crate::{Pack, PackError, PackWriter, SectionId, header, kind};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// No table has more rows.
pub const MAX_ROWS: usize = 4096;

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
    /// The light: levels of a pack are usually measured under base colours.
    pub light: Light,
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

    /// The rows of other representations and lights than those of `newer`, and all of `newer`.
    pub fn merged(&self, newer: &Self) -> Self {
        let key = |r: &Measure| (r.representation, r.light);
        let kept = self.rows.iter().filter(|r| newer.rows.iter().all(|n| key(n) != key(r)));
        let rows: Vec<Measure> = kept.chain(&newer.rows).copied().collect();
        let mut method = newer.method.clone();
        if rows.len() > newer.rows.len() && self.method != method {
            method = format!("{}; {method}", self.method);
        }
        Self { method, rows }
    }

    /// The rows of other representations than this one.
    pub fn without(&self, representation: u16) -> Self {
        let rows = self.rows.iter().filter(|r| r.representation != representation);
        Self { method: self.method.clone(), rows: rows.copied().collect() }
    }

    /// Checks the rules of SPEC.md, section 4.3.
    ///
    /// # Errors
    /// The first broken rule, with the row, the field, the value and the limit.
    pub fn validate(&self) -> Result<(), String> {
        if self.rows.len() > MAX_ROWS {
            return Err(format!("{} rows; the limit is {MAX_ROWS}", self.rows.len()));
        }
        if self.method.contains(char::is_control) {
            return Err(format!("method {:?} has control characters", self.method));
        }
        for (i, r) in self.rows.iter().enumerate() {
            r.validate().map_err(|problem| format!("row {i}: {problem}"))?;
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

    /// Least and greatest measured pixel height for a need's representation and light.
    pub fn heights(&self, need: &Need) -> (f32, f32) {
        let asked = |r: &&Measure| r.representation == need.representation && r.light == need.light;
        range(self.rows.iter().filter(asked).map(|r| r.pixel_height))
    }

    /// What is known of each level at the needed height: the worst of the elevations that may be
    /// met, and of the measured heights next below and above, for the level that means the same cut
    /// in square pixels. What was not measured in all of them is left out. Beyond the measured
    /// heights and elevations the nearest count, and the choice says so.
    pub fn choices(&self, need: &Need) -> Vec<Choice> {
        let asked = |r: &&Measure| r.representation == need.representation && r.light == need.light;
        let rows: Vec<&Measure> = self.rows.iter().filter(asked).collect();
        let (low, high) = range(rows.iter().flat_map(|r| r.elevation));
        let elevation = need.elevation.map(|e| e.clamp(low, high.max(low)));
        let holds = |r: &Measure| {
            let [from, to] = r.elevation;
            elevation.is_none_or(|e| from <= e && (e < to || e == high))
        };
        let rows: Vec<&Measure> = rows.into_iter().filter(|r| holds(r)).collect();
        let (smallest, largest) = range(rows.iter().map(|r| r.pixel_height));
        let height = need.pixel_height.clamp(smallest, largest.max(smallest));
        let beyond = elevation != need.elevation || height != need.pixel_height;
        let below = range(rows.iter().map(|r| r.pixel_height).filter(|h| *h <= height)).1;
        let above = range(rows.iter().map(|r| r.pixel_height).filter(|h| *h >= height)).0;
        // By level (as bits: a key), the worst of what was measured and in how many places.
        let mut places = BTreeSet::new();
        let mut levels: BTreeMap<[u32; 3], (Choice, usize)> = BTreeMap::new();
        for r in rows.iter().filter(|r| r.pixel_height == below || r.pixel_height == above) {
            let error = match need.error {
                ErrorKind::Flip => r.flip_worst,
                ErrorKind::Rmse => r.rmse_worst,
            };
            places.insert((r.pixel_height.to_bits(), r.elevation.map(f32::to_bits)));
            let (level, primitives) = (r.level, r.primitives);
            let new = (Choice { level, primitives, error, beyond }, 0);
            let (choice, seen) = levels.entry(level.map(f32::to_bits)).or_insert(new);
            choice.error = choice.error.max(error);
            choice.primitives = choice.primitives.max(primitives);
            *seen += 1;
        }
        levels.into_values().filter(|(_, seen)| *seen == places.len()).map(|(c, _)| c).collect()
    }
}

/// Least and largest; (∞, −∞) for nothing.
fn range(values: impl Iterator<Item = f32>) -> (f32, f32) {
    values.fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)))
}

impl Measure {
    fn validate(&self) -> Result<(), String> {
        let within = |name: &str, v: f32, low: f32, high: f32| {
            if (low..=high).contains(&v) {
                return Ok(());
            }
            Err(format!("{name} is {v}; it must be within {low} and {high}"))
        };
        for v in self.level {
            within("a level", v, 0.0, f32::INFINITY)?;
        }
        for v in self.elevation {
            within("an elevation", v, -90.0, 90.0)?;
        }
        within("the upper elevation", self.elevation[1], self.elevation[0], 90.0)?;
        within("pixel height", self.pixel_height, f32::MIN_POSITIVE, f32::MAX)?;
        within("primitives", self.primitives, 0.0, f32::MAX)?;
        within("bytes", self.bytes, 0.0, f32::MAX)?;
        for v in [self.rmse, self.rmse_worst, self.flip, self.flip_worst] {
            within("an error", v, 0.0, f32::MAX)?;
        }
        within("SSIM", self.ssim, -1.0, 1.0)?;
        within("coverage", self.coverage, -1.0, f32::MAX)
    }
}

/// A level and what the table promises of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice {
    /// As in [`Measure::level`].
    pub level: [f32; 3],
    /// Primitives drawn: the mean over views of the worst band and height.
    pub primitives: f32,
    /// The error that was asked about: the worst view of the worst band and height.
    pub error: f32,
    /// The need lies beyond what was measured: the promise is that of the nearest height and
    /// elevation.
    pub beyond: bool,
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
        Need {
            representation,
            pixel_height,
            elevation,
            light: Light::Albedo,
            error: ErrorKind::Flip,
        }
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
        assert!(!between.beyond);
        // Beyond all heights and elevations the nearest count, and it is said.
        let far = t.cheapest(&need(2.0, Some(5.0)), 0.061).unwrap();
        assert_eq!((far.level[0], far.beyond), (4.0, true));
        assert!(t.cheapest(&need(64.0, Some(90.0)), 1.0).is_some_and(|c| !c.beyond));
        // A level that was not measured in all bands is not chosen for all.
        assert_eq!(level(t.cheapest(&need(256.0, None), 1.0)), Some(1.0));
        assert_eq!(level(t.cheapest(&need(256.0, Some(40.0)), 1.0)), Some(16.0));
        let lit = Need { light: Light::Sun, ..need(64.0, None) };
        assert_eq!(t.cheapest(&lit, 1.0), None);
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
        let want = "row 3: an error is NaN; it must be within 0 and";
        assert!(t.validate().unwrap_err().starts_with(want), "{:?}", t.validate());
        let breaks: [fn(&mut Measure); 6] = [
            |r| r.pixel_height = 0.0,
            |r| r.level[1] = -1.0,
            |r| r.elevation = [30.0, 20.0],
            |r| r.elevation = [-91.0, 20.0],
            |r| r.ssim = 1.5,
            |r| r.primitives = f32::INFINITY,
        ];
        for change in breaks {
            let mut t = table();
            change(&mut t.rows[1]);
            assert!(t.validate().unwrap_err().starts_with("row 1: "));
        }
        let mut t = table();
        t.rows = vec![t.rows[0]; MAX_ROWS + 1];
        assert_eq!(t.validate().unwrap_err(), "4097 rows; the limit is 4096");
        let t = Measures { method: "\u{1b}[2J".into(), ..table() };
        assert!(t.validate().unwrap_err().contains("control characters"));
    }

    #[test]
    fn new_rows_replace_those_of_their_representation_and_light() {
        let mut old = table();
        old.rows[0].representation = 99;
        old.rows[1].light = Light::Sun;
        let newer =
            Measures { method: "newer".into(), rows: vec![row(2.0, 64.0, [0.0, 9.0], 1.0, 0.1)] };
        let merged = old.merged(&newer);
        assert_eq!(merged.rows, [old.rows[0], old.rows[1], newer.rows[0]]);
        assert_eq!(merged.method, "made; newer");
        assert_eq!(old.without(kind::POINTS_HEADER).rows, [old.rows[0]]);
    }
}
