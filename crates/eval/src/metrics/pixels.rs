//! Metrics that look at one pixel at a time. Pictures are cropped already.

use forest_raster::Picture;

/// Root mean square difference of premultiplied linear RGBA.
pub(super) fn rmse(a: &Picture, b: &Picture) -> f64 {
    let pairs = a.pixels.as_flattened().iter().zip(b.pixels.as_flattened());
    let sum: f64 = pairs.map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2)).sum();
    if a.pixels.is_empty() { 0.0 } else { (sum / (4 * a.pixels.len()) as f64).sqrt() }
}

fn covered(p: &Picture) -> f64 {
    p.pixels.iter().map(|v| f64::from(v[3])).sum()
}

/// Mean coverage of `b` minus that of `a`.
pub(super) fn coverage(a: &Picture, b: &Picture) -> f64 {
    if a.pixels.is_empty() { 0.0 } else { (covered(b) - covered(a)) / a.pixels.len() as f64 }
}

/// Coverage of `b` over that of `a`, minus one.
pub(super) fn coverage_ratio(a: &Picture, b: &Picture) -> Option<f64> {
    let truth = covered(a);
    (truth > 0.0).then(|| covered(b) / truth - 1.0)
}

/// Σ min / Σ max of coverage (Ruzicka's similarity); 1 for two empty pictures.
pub(super) fn silhouette_iou(a: &Picture, b: &Picture) -> f64 {
    let (mut low, mut high) = (0.0, 0.0);
    for (a, b) in a.pixels.iter().zip(&b.pixels) {
        low += f64::from(a[3].min(b[3]));
        high += f64::from(a[3].max(b[3]));
    }
    if high > 0.0 { low / high } else { 1.0 }
}

/// Root mean square difference of depth, each pixel weighted by the lesser coverage.
pub(super) fn depth(a: &Picture, b: &Picture) -> Option<f64> {
    let (mut sum, mut weight) = (0.0, 0.0);
    for i in 0..a.pixels.len() {
        let w = f64::from(a.pixels[i][3].min(b.pixels[i][3]));
        if w > 0.0 {
            sum += w * (f64::from(a.depth[i]) - f64::from(b.depth[i])).powi(2);
            weight += w;
        }
    }
    (weight > 0.0).then(|| (sum / weight).sqrt())
}
