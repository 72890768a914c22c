//! What got worse since a baseline.

use crate::event::Done;
use crate::summary::Summary;
use std::fmt::{Display, Formatter, Result};

/// A measure of an asset that got worse.
#[derive(Clone, Debug, PartialEq)]
pub struct Worse {
    /// The asset.
    pub asset: String,
    /// Which measure; empty if the asset was there and is not.
    pub measure: String,
    /// Of the baseline.
    pub before: f64,
    /// Now.
    pub now: f64,
}

impl Display for Worse {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let Self { asset, measure, before, now } = self;
        if measure.is_empty() {
            return write!(f, "{asset}: is in the baseline, and not there now");
        }
        let change = 100.0 * (now / before - 1.0);
        write!(f, "{asset}: {measure} {before} → {now} ({change:+.1} %)")
    }
}

/// What of `now` is worse than in `baseline` by more than a share: bytes, counts and errors are better if they are
/// less. Assets that the baseline does not have are not judged.
pub fn worse(baseline: &Summary, now: &Summary, share: f64) -> Vec<Worse> {
    let mut out = Vec::new();
    for old in &baseline.assets {
        let Some(before) = &old.done else { continue };
        let new = now.assets.iter().find(|a| a.name == old.name).and_then(|a| a.done.as_ref());
        let asset = old.name.clone();
        let Some(new) = new else {
            let measure = String::new();
            out.push(Worse { asset, measure, before: f64::NAN, now: f64::NAN });
            continue;
        };
        let of_new = measures(new);
        for (measure, before) in measures(before) {
            let found = of_new.iter().find(|m| m.0 == measure);
            // What is not measured any more is not known to be as good.
            let now = found.map_or(f64::INFINITY, |m| m.1);
            if now > before * (1.0 + share) {
                out.push(Worse { asset: asset.clone(), measure, before, now });
            }
        }
    }
    out
}

fn measures(done: &Done) -> Vec<(String, f64)> {
    let bytes = std::iter::once(("bytes".to_string(), done.bytes as f64));
    let counts = done.counts.iter().map(|(name, n)| (name.clone(), *n as f64));
    let errors = done.errors.iter().map(|(name, e)| (name.clone(), *e));
    bytes.chain(counts).chain(errors).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::summary::{AssetSummary, Status};

    fn summary(assets: &[(&str, u64, f64)]) -> Summary {
        let one = |(name, bytes, flip): &(&str, u64, f64)| AssetSummary {
            name: (*name).into(),
            status: Status::Baked,
            error: None,
            done: Some(Done {
                bytes: *bytes,
                errors: [("points.flip".to_string(), *flip)].into(),
                ..Done::default()
            }),
        };
        let assets = assets.iter().map(one).collect();
        Summary { schema: String::new(), generator: String::new(), seconds: 0.0, assets }
    }

    #[test]
    fn what_grew_by_more_than_the_share_is_worse() {
        let before = summary(&[("ash", 1000, 0.1), ("elm", 1000, 0.1), ("oak", 1000, 0.1)]);
        let now = summary(&[("ash", 1019, 0.1021), ("elm", 900, 0.05), ("new", 5, 0.5)]);
        let found = worse(&before, &now, 0.02);
        let told: Vec<String> = found.iter().map(Worse::to_string).collect();
        assert_eq!(
            told,
            [
                "ash: points.flip 0.1 → 0.1021 (+2.1 %)",
                "oak: is in the baseline, and not there now"
            ]
        );
        assert_eq!(worse(&before, &before, 0.0), []);
    }
}
