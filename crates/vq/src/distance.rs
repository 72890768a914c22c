//! Squared distances, summed in one order whatever the machine.
//!
//! Vectors are padded with zeros to whole sixteens. Sixteen partial sums, one register of AVX-512 and
//! several elsewhere, are folded in halves; nothing is contracted to fused operations.

use pulp::Simd;

/// Numbers of a [`Lanes`].
pub(crate) const LANES: usize = 16;

/// Sixteen numbers of a vector, aligned as registers want them.
#[derive(Clone, Copy)]
#[repr(align(64))]
pub(crate) struct Lanes<T = f32>(pub(crate) [T; LANES]);

/// `values`, padded.
pub(crate) fn pad(values: &[f32]) -> impl Iterator<Item = Lanes> {
    values.chunks(LANES).map(|chunk| {
        let mut lanes = [0.0; LANES];
        lanes[..chunk.len()].copy_from_slice(chunk);
        Lanes(lanes)
    })
}

/// Sixteen numbers in registers of the machine: only the first `LANES / S::F32_LANES` are used.
///
/// Written out, as what compilers make of plain loops here depends on what the sums are used for.
pub(crate) struct Registers<S: Simd>(pub(crate) [S::f32s; LANES]);

impl<S: Simd> Registers<S> {
    #[inline(always)]
    pub(crate) fn new(simd: S, lanes: &Lanes) -> Self {
        let mut parts = [simd.splat_f32s(0.0); LANES];
        parts.iter_mut().zip(Self::parts(lanes)).for_each(|(to, part)| *to = *part);
        Self(parts)
    }

    /// The registers of sixteen numbers in memory.
    #[inline(always)]
    pub(crate) fn parts(lanes: &Lanes) -> &[S::f32s] {
        S::as_simd_f32s(&lanes.0).0
    }

    #[inline(always)]
    pub(crate) fn lanes(self) -> Lanes {
        let mut lanes = Lanes([0f32; LANES]);
        let parts = S::as_mut_simd_f32s(&mut lanes.0).0;
        parts.iter_mut().zip(self.0).for_each(|(to, part)| *to = part);
        lanes
    }

    /// Bit `l` says whether number `l` is `most` or less.
    #[inline(always)]
    pub(crate) fn at_most(self, simd: S, most: f32) -> u32 {
        const BITS: Lanes = {
            let mut bits = [1f32; LANES];
            let mut l = 1;
            while l < LANES {
                bits[l] = 2.0 * bits[l - 1];
                l += 1;
            }
            Lanes(bits)
        };
        let (most, none) = (simd.splat_f32s(most), simd.splat_f32s(0.0));
        let mut sum = none;
        for (part, bits) in self.0.into_iter().zip(Self::parts(&BITS)) {
            let mask = simd.less_than_or_equal_f32s(part, most);
            sum = simd.add_f32s(sum, simd.select_f32s(mask, *bits, none));
        }
        // Whole numbers below 65,536: exact in any order.
        simd.reduce_sum_f32s(sum) as u32
    }
}

/// Squared distance. `S` says how many of the sums are in a register, nothing else.
#[inline(always)]
pub(crate) fn squared<S: Simd>(simd: S, a: &[Lanes], b: &[Lanes]) -> f32 {
    let mut sums = Registers::<S>([simd.splat_f32s(0.0); LANES]);
    for (a, b) in a.iter().zip(b) {
        let (a, b) = (Registers::<S>::parts(a), Registers::<S>::parts(b));
        for ((sum, a), b) in sums.0.iter_mut().zip(a).zip(b) {
            let d = simd.sub_f32s(*a, *b);
            *sum = simd.add_f32s(*sum, simd.mul_f32s(d, d));
        }
    }
    let sums = sums.lanes().0;
    let eight: [f32; 8] = std::array::from_fn(|l| sums[l] + sums[l + 8]);
    let four: [f32; 4] = std::array::from_fn(|l| eight[l] + eight[l + 4]);
    (four[0] + four[2]) + (four[1] + four[3])
}
