//! The sRGB transfer function (IEC 61966-2-1) and its inverse: used at the edges only.

use std::sync::LazyLock;

static TO_LINEAR: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|i| srgb_to_linear(i as f64 / 255.0) as f32));

/// sRGB code value in `0..=255` to linear light in `0..=1`.
pub fn srgb8_to_linear(code: u8) -> f32 {
    TO_LINEAR[code as usize]
}

/// sRGB value in `0..=1` to linear light in `0..=1`.
pub fn srgb_to_linear(v: f64) -> f64 {
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// Linear light to the nearest sRGB code value; values outside `0..=1` are clamped, NaN becomes 0.
pub fn linear_to_srgb8(v: f32) -> u8 {
    // The code values halfway between two neighbours, in linear light: a search in this table
    // rounds exactly and needs no power function.
    static MIDPOINTS: LazyLock<[f32; 255]> =
        LazyLock::new(|| std::array::from_fn(|i| srgb_to_linear((i as f64 + 0.5) / 255.0) as f32));
    MIDPOINTS.partition_point(|&m| m <= v) as u8
}

/// Relative luminance (ITU-R BT.709 primaries) of a linear RGB colour.
pub fn luminance(rgb: [f32; 3]) -> f32 {
    0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_value_survives_the_round_trip() {
        for code in 0..=255 {
            assert_eq!(linear_to_srgb8(srgb8_to_linear(code)), code);
        }
    }

    #[test]
    fn known_values_of_the_standard() {
        assert_eq!(linear_to_srgb8(0.5), 188); // 0.7354 · 255 = 187.5
        assert!((srgb8_to_linear(128) - 0.215_860_5).abs() < 1e-6);
        assert_eq!(linear_to_srgb8(-1.0), 0);
        assert_eq!(linear_to_srgb8(7.0), 255);
        assert_eq!(linear_to_srgb8(f32::NAN), 0);
    }
}
