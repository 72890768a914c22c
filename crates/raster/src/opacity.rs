//! Opacity without sorting or blending: the hash rule.

/// Whether a point of opacity `opacity`/255 covers a sample: in the mean over samples it covers
/// its opacity, and the same answer is given by every renderer.
///
/// `id` is stable (the point's index in the pack, mixed with an instance's number if there are
/// many) and `x`, `y` are the sample's integer coordinates in the picture's sample grid. Only
/// 32-bit integer operations are used, so that a shader can do the same. The mixing steps are
/// those of C. Wellons' `lowbias32`.
#[inline]
pub fn covers(id: u32, x: u32, y: u32, opacity: u8) -> bool {
    if opacity == u8::MAX {
        return true;
    }
    // 16 bits of the hash as a fraction of one, against opacity/255, without a division.
    hash(id, x, y) * 255 < u32::from(opacity) << 16
}

/// The number in `0..1` that [`covers`] compares opacities with: for choices between more than two.
#[inline]
pub fn sample_hash(id: u32, x: u32, y: u32) -> f32 {
    hash(id, x, y) as f32 / 65536.0
}

/// 16 bits.
#[inline]
fn hash(id: u32, x: u32, y: u32) -> u32 {
    let sample = mix(x.wrapping_mul(0x9e37_79b9) ^ y.rotate_left(16));
    mix(id ^ sample) >> 16
}

/// A bijection of 32-bit words that scatters them.
pub(crate) fn mix(mut v: u32) -> u32 {
    v ^= v >> 16;
    v = v.wrapping_mul(0x7feb_352d);
    v ^= v >> 15;
    v = v.wrapping_mul(0x846c_a68b);
    v ^ v >> 16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coverage_over_samples_is_the_opacity() {
        for opacity in [0u8, 1, 17, 128, 254, 255] {
            for id in [0u32, 1, 77_777] {
                let n = 1 << 10;
                let hits: u32 =
                    (0..n * n).map(|i| u32::from(covers(id, i % n, i / n, opacity))).sum();
                let got = f64::from(hits) / f64::from(n * n);
                // Five standard deviations of a fair draw.
                assert!((got - f64::from(opacity) / 255.0).abs() < 0.0025, "{opacity} {id} {got}");
            }
        }
    }

    #[test]
    fn two_points_cover_independently() {
        let n = 512;
        let both =
            (0..n * n).filter(|i| covers(5, i % n, i / n, 128) && covers(6, i % n, i / n, 128));
        let got = both.count() as f64 / f64::from(n * n);
        assert!((got - 0.252).abs() < 0.004, "{got}");
    }
}
