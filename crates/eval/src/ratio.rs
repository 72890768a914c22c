//! How many primitives another way needs for the same error.

use crate::contender::Knob;
use crate::metrics::Errors;
use crate::sweep::Row;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// An error that a cut can be chosen by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Metric {
    /// Mean FLIP.
    Flip,
    /// Root mean square difference of premultiplied linear RGBA.
    Rmse,
}

impl Metric {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Flip, Self::Rmse];

    /// Its value.
    pub fn of(self, e: &Errors) -> f64 {
        match self {
            Self::Flip => e.flip,
            Self::Rmse => e.rmse,
        }
    }
}

/// Primitives of `other` over those of `base` at equal error.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Ratio {
    /// The way that is praised.
    pub base: String,
    /// The way that it is compared with.
    pub other: String,
    /// Equal in which error.
    pub metric: Metric,
    /// Height of the tree in pixels.
    pub height: u32,
    /// Median over the views of the geometric mean over all errors that both reach.
    pub median: f64,
    /// The smallest of a view.
    pub least: f64,
    /// The largest of a view.
    pub most: f64,
    /// Views in which the ways have errors in common.
    pub views: u32,
}

/// Errors at which two curves are compared.
const PROBES: usize = 16;

/// Errors that two curves must share, as a factor: a ratio over less says little.
const OVERLAP: f64 = 1.5;

/// Ratios of `base` and every other contender, where they share errors over a factor of 1.5 or more.
pub fn ratios(rows: &[Row], base: &str) -> Vec<Ratio> {
    let mut names: Vec<&str> = Vec::new();
    let mut heights: Vec<u32> = Vec::new();
    // A view is one primitive however much it shows.
    let rows = || rows.iter().filter(|r| !matches!(r.knob, Knob::Views { .. }));
    for r in rows() {
        if !names.contains(&r.contender.as_str()) {
            names.push(&r.contender);
        }
        if !heights.contains(&r.height) {
            heights.push(r.height);
        }
    }
    let views = rows().map(|r| r.view + 1).max().unwrap_or(0);
    let mut out = Vec::new();
    for other in names.iter().filter(|n| **n != base) {
        for metric in Metric::ALL {
            for &height in &heights {
                let of = |name: &str, view: u32| {
                    Curve::new(
                        rows().filter(|r| {
                            r.contender == name && r.view == view && r.height == height
                        }),
                        metric,
                    )
                };
                let mut by_view: Vec<f64> =
                    (0..views).filter_map(|v| of(base, v).ratio(&of(other, v))).collect();
                by_view.sort_by(f64::total_cmp);
                if let (Some(&least), Some(&most)) = (by_view.first(), by_view.last()) {
                    out.push(Ratio {
                        base: base.into(),
                        other: (*other).into(),
                        metric,
                        height,
                        median: median(&by_view),
                        least,
                        most,
                        views: by_view.len() as u32,
                    });
                }
            }
        }
    }
    out
}

/// Of sorted values, not none.
fn median(sorted: &[f64]) -> f64 {
    let n = sorted.len();
    (sorted[(n - 1) / 2] + sorted[n / 2]) * 0.5
}

/// The fewest primitives for each error: logarithms, errors ascending, counts descending.
struct Curve(Vec<[f64; 2]>);

impl Curve {
    fn new<'a>(rows: impl Iterator<Item = &'a Row>, metric: Metric) -> Self {
        let mut points: Vec<[f64; 2]> = rows
            .filter(|r| metric.of(&r.errors) > 0.0 && r.cost.primitives > 0.0)
            .map(|r| [metric.of(&r.errors).ln(), r.cost.primitives.ln()])
            .collect();
        points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
        // Whoever costs as much for a larger error is never chosen.
        let mut least = f64::INFINITY;
        points.retain(|p| {
            p[1] < least && {
                least = p[1];
                true
            }
        });
        Self(points)
    }

    /// Logarithm of the fewest primitives at an error within the curve.
    fn at(&self, error: f64) -> f64 {
        let i = self.0.partition_point(|p| p[0] < error).clamp(1, self.0.len() - 1);
        let ([e0, n0], [e1, n1]) = (self.0[i - 1], self.0[i]);
        n0 + (n1 - n0) * ((error - e0) / (e1 - e0)).clamp(0.0, 1.0)
    }

    /// Geometric mean of other's over our primitives, over the errors that both reach.
    fn ratio(&self, other: &Self) -> Option<f64> {
        if self.0.len() < 2 || other.0.len() < 2 {
            return None;
        }
        let ends = |c: &Self| [c.0[0][0], c.0[c.0.len() - 1][0]];
        let ([a0, a1], [b0, b1]) = (ends(self), ends(other));
        let (from, to) = (a0.max(b0), a1.min(b1));
        if to - from < OVERLAP.ln() {
            return None;
        }
        let sum: f64 = (0..PROBES)
            .map(|i| from + (to - from) * (i as f64 + 0.5) / PROBES as f64)
            .map(|e| other.at(e) - self.at(e))
            .sum();
        Some((sum / PROBES as f64).exp())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contender::Cost;

    /// A curve n = c/error over `errors`.
    fn rows(name: &str, c: f64, errors: &[f64], view: u32) -> Vec<Row> {
        let cost = |n| Cost { primitives: n, bytes: 0.0, select_ns: None, render_ms: None };
        let errors_of = |flip| Errors {
            rmse: flip * 2.0,
            psnr: None,
            ssim: 0.0,
            flip,
            coverage: 0.0,
            coverage_ratio: None,
            silhouette_iou: 0.0,
            depth: None,
        };
        let row = |e: &f64| Row {
            contender: name.into(),
            height: 64,
            view,
            knob: Knob::Share(0.5),
            cost: cost(c / e),
            errors: errors_of(*e),
        };
        errors.iter().map(row).collect()
    }

    #[test]
    fn ratio_of_two_power_laws_is_that_of_their_factors() {
        let mut all = rows("a", 10.0, &[0.01, 0.02, 0.08], 0);
        all.extend(rows("b", 30.0, &[0.015, 0.03, 0.3], 0));
        all.extend(rows("a", 10.0, &[0.01, 0.08], 1));
        all.extend(rows("b", 50.0, &[0.015, 0.3], 1));
        // Worse and dearer: not on the curve.
        all.extend(rows("b", 5000.0, &[0.02], 1));
        let found = ratios(&all, "a");
        assert_eq!(found.len(), 2);
        for r in found {
            assert!((r.least - 3.0).abs() < 1e-9 && (r.most - 5.0).abs() < 1e-9, "{r:?}");
            assert!((r.median - 4.0).abs() < 1e-9 && r.views == 2);
        }
    }

    #[test]
    fn curves_without_common_errors_have_no_ratio() {
        let mut all = rows("a", 10.0, &[0.01, 0.02], 0);
        all.extend(rows("b", 10.0, &[0.1, 0.2], 0));
        assert_eq!(ratios(&all, "a"), vec![]);
        // Nor have those that share only a little.
        all.extend(rows("c", 10.0, &[0.015, 0.2], 0));
        assert_eq!(ratios(&all, "a"), vec![]);
    }
}
