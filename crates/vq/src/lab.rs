//! Colours as the eye tells them apart.
//!
//! CIELab 1976 (CIE 15) of linear colours with the primaries of sRGB and the white D65, by the crate
//! `palette`. Distances in it are about those that people see: what codebooks of colours are
//! trained in.

use palette::{FromColor, Lab, LinSrgb, white_point::D65};

/// Lightness L, 0 … 100, and the axes a (green to red) and b (blue to yellow), about ±128, of linear
/// red, green and blue, 0 … 1. Outside that range the formula goes on.
pub fn linear_to_lab(rgb: [f32; 3]) -> [f32; 3] {
    let lab: Lab<D65, f32> = Lab::from_color(LinSrgb::from(rgb));
    [lab.l, lab.a, lab.b]
}

/// The inverse of [`linear_to_lab`], by less than 1/1024 on colours in range; colours that no screen
/// shows come out below 0 or above 1.
pub fn lab_to_linear([l, a, b]: [f32; 3]) -> [f32; 3] {
    LinSrgb::from_color(Lab::<D65, f32>::new(l, a, b)).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By numpy in f64: matrix of IEC 61966-2-1, white (0.95047, 1, 1.08883), CIE 15 formula.
    const EXPECTED: [([f32; 3], [f32; 3]); 10] = [
        ([0.0, 0.0, 0.0], [0.0000, 0.0000, 0.0000]),
        ([1.0, 1.0, 1.0], [100.0000, 0.0000, 0.0000]),
        ([1.0, 0.0, 0.0], [53.2408, 80.0925, 67.2032]),
        ([0.0, 1.0, 0.0], [87.7347, -86.1827, 83.1793]),
        ([0.0, 0.0, 1.0], [32.2970, 79.1875, -107.8602]),
        ([0.2, 0.5, 0.1], [69.9883, -38.2150, 43.0482]),
        ([0.001, 0.002, 0.0005], [1.5167, -1.5487, 1.5667]),
        ([1e-06, 1e-06, 1e-06], [0.0009, 0.0000, 0.0000]),
        ([0.18, 0.18, 0.18], [49.4961, 0.0000, 0.0000]),
        ([0.9, 0.4, 0.02], [74.7561, 17.1842, 71.3074]),
    ];

    #[test]
    fn known_colours() {
        for (rgb, want) in EXPECTED {
            let lab = linear_to_lab(rgb);
            for (got, want) in lab.iter().zip(want) {
                assert!((got - want).abs() < 0.02, "{rgb:?}: {lab:?}");
            }
        }
    }

    #[test]
    fn there_and_back() {
        // Dense, with the corners and edges of the cube, and dark colours.
        let steps = (0..=32).map(|i| i as f32 / 32.0);
        let values: Vec<f32> = [1e-30, 1e-8, 1e-5, 1e-4, 1e-3, 0.004, 0.008856, 0.01, 0.999]
            .into_iter()
            .chain(steps)
            .collect();
        let mut worst = 0f32;
        for &r in &values {
            for &g in &values {
                for &b in &values {
                    let back = lab_to_linear(linear_to_lab([r, g, b]));
                    for (x, y) in back.into_iter().zip([r, g, b]) {
                        worst = worst.max((x - y).abs());
                    }
                }
            }
        }
        assert!(worst <= 1.0 / 1024.0, "{worst}");
    }
}
