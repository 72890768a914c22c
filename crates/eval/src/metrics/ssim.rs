//! Structural similarity: Z. Wang, A. Bovik, H. Sheikh, E. Simoncelli, "Image quality assessment:
//! from error visibility to structural similarity", IEEE TIP 2004, with the paper's Gaussian
//! windows (σ = 1.5, 11 × 11 pixels) and constants, channel by channel on sRGB values.
//!
//! Our own because `image-compare` sums its covariances over a window where the formula has means,
//! which makes its C₂ 64 times too small.

use super::Framed;
use forest_raster::Picture;
use rayon::prelude::*;

/// Pixels from the middle of a window to its edge.
const REACH: usize = 5;
const SIGMA: f64 = 1.5;
const C1: f64 = 0.01 * 0.01;
const C2: f64 = 0.03 * 0.03;

/// Mean over the pictures' pixels and channels; windows reach into the grey around them. 1 for
/// empty pictures.
pub(super) fn ssim(a: &Picture, b: &Picture, background: f32) -> f64 {
    if a.pixels.is_empty() {
        return 1.0;
    }
    let [a, b] = [a, b].map(|p| Framed::new(p, background, REACH as u32));
    let width = a.width as usize;
    let channel = |p: &Framed, c: usize| -> Vec<f64> {
        p.rgb.iter().map(|v| f64::from(v[c]) / 255.0).collect()
    };
    let means = (0..3usize).into_par_iter().map(|c| {
        let (x, y) = (channel(&a, c), channel(&b, c));
        let product =
            |p: &[f64], q: &[f64]| p.iter().zip(q).map(|(p, q)| p * q).collect::<Vec<_>>();
        let windows = [
            smooth(&x, width),
            smooth(&y, width),
            smooth(&product(&x, &x), width),
            smooth(&product(&y, &y), width),
            smooth(&product(&x, &y), width),
        ];
        let n = windows[0].len();
        let sum: f64 = (0..n).map(|i| of_window(windows.each_ref().map(|w| w[i]))).sum();
        sum / n as f64
    });
    // Summed in order: no result depends on how threads share the work.
    means.collect::<Vec<f64>>().iter().sum::<f64>() / 3.0
}

/// Equation 13 of the paper, from the window's means of x, y, x², y² and xy.
fn of_window([x, y, xx, yy, xy]: [f64; 5]) -> f64 {
    let (vx, vy, cov) = (xx - x * x, yy - y * y, xy - x * y);
    (2.0 * x * y + C1) * (2.0 * cov + C2) / ((x * x + y * y + C1) * (vx + vy + C2))
}

/// Gaussian means of the windows that lie within the picture.
fn smooth(values: &[f64], width: usize) -> Vec<f64> {
    let weight = |i: usize| (-0.5 * ((i as f64 - REACH as f64) / SIGMA).powi(2)).exp();
    let sum: f64 = (0..=2 * REACH).map(weight).sum();
    let kernel: Vec<f64> = (0..=2 * REACH).map(|i| weight(i) / sum).collect();
    let inner = width - 2 * REACH;
    let rows: Vec<f64> = values
        .chunks_exact(width)
        .flat_map(|row| row.windows(kernel.len()))
        .map(|w| w.iter().zip(&kernel).map(|(v, k)| v * k).sum())
        .collect();
    let height = rows.len() / inner;
    let mut out = vec![0.0; inner * (height - 2 * REACH)];
    for (y, line) in out.chunks_exact_mut(inner).enumerate() {
        for (k, source) in kernel.iter().zip(rows[y * inner..].chunks_exact(inner)) {
            for (o, v) in line.iter_mut().zip(source) {
                *o += k * v;
            }
        }
    }
    out
}
