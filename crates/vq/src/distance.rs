//! Squared distances, summed in one order whatever the machine.
//!
//! Sixteen partial sums, whole on AVX-512 and in parts elsewhere, are folded in halves; nothing is
//! contracted to fused operations. Vectors are padded with zeros to whole sixteens.

/// Partial sums.
pub(crate) const LANES: usize = 16;

/// Squared distance of padded vectors.
#[inline(always)]
pub(crate) fn squared(a: &[f32], b: &[f32]) -> f32 {
    let mut sums = [0f32; LANES];
    for (a, b) in a.as_chunks::<LANES>().0.iter().zip(b.as_chunks::<LANES>().0) {
        for l in 0..LANES {
            let d = a[l] - b[l];
            sums[l] += d * d;
        }
    }
    let eight: [f32; 8] = std::array::from_fn(|l| sums[l] + sums[l + 8]);
    let four: [f32; 4] = std::array::from_fn(|l| eight[l] + eight[l + 4]);
    (four[0] + four[2]) + (four[1] + four[3])
}

/// Squared distance of padded vectors: what distortions are summed from.
#[inline(always)]
pub(crate) fn squared_f64(a: &[f32], b: &[f32]) -> f64 {
    let mut sums = [0f64; LANES];
    for (a, b) in a.as_chunks::<LANES>().0.iter().zip(b.as_chunks::<LANES>().0) {
        for l in 0..LANES {
            let d = f64::from(a[l]) - f64::from(b[l]);
            sums[l] += d * d;
        }
    }
    let eight: [f64; 8] = std::array::from_fn(|l| sums[l] + sums[l + 8]);
    let four: [f64; 4] = std::array::from_fn(|l| eight[l] + eight[l + 4]);
    (four[0] + four[2]) + (four[1] + four[3])
}
