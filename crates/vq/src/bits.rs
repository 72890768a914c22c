//! Indices in as few bits as they need.
//!
//! Value `i` takes bits `i · bits ..` of the stream, counted from the lowest bit of the first byte;
//! the stream ends with zero bits at a multiple of 4 bytes, as a GPU reads words. With 3 bits,
//! 1, 2, 7 make `0b1_1101_0001`, the bytes `d1 01 00 00`.

/// Bits of a number below `count`: 0 for one word or none.
pub fn bits_for(count: usize) -> u32 {
    usize::BITS - count.saturating_sub(1).leading_zeros()
}

/// Packs `values` in `bits` each, 0 … 16: `⌈values · bits / 32⌉ · 4` bytes.
///
/// # Panics
/// If `bits` is above 16, or a value has more bits.
pub fn pack_bits(values: &[u32], bits: u32) -> Vec<u8> {
    assert!(bits <= 16, "{bits} bits; the limit is 16");
    let words = (values.len() as u64 * u64::from(bits)).div_ceil(32);
    let mut bytes = Vec::with_capacity(words as usize * 4);
    let (mut held, mut filled) = (0u64, 0);
    for &value in values {
        assert!(value >> bits == 0, "{value} has more than {bits} bits");
        held |= u64::from(value) << filled;
        filled += bits;
        if filled >= 32 {
            bytes.extend_from_slice(&(held as u32).to_le_bytes());
            held >>= 32;
            filled -= 32;
        }
    }
    if filled > 0 {
        bytes.extend_from_slice(&(held as u32).to_le_bytes());
    }
    bytes
}

/// Value `i` of what [`pack_bits`] made with the same `bits`.
///
/// # Panics
/// If `bits` is above 16, or the value is not wholly in `bytes`.
pub fn read_bits(bytes: &[u8], bits: u32, i: usize) -> u32 {
    assert!(bits <= 16, "{bits} bits; the limit is 16");
    let (mut value, mut at) = (0, i as u64 * u64::from(bits));
    let mut read = 0;
    while read < bits {
        // What is left of this byte.
        let part = (8 - (at % 8) as u32).min(bits - read);
        let byte = u32::from(bytes[(at / 8) as usize]) >> (at % 8);
        value |= (byte & ((1 << part) - 1)) << read;
        read += part;
        at += u64::from(part);
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_example_of_the_head() {
        assert_eq!(pack_bits(&[1, 2, 7], 3), [0xd1, 1, 0, 0]);
        assert_eq!(pack_bits(&[0x1234, 0xffff, 1], 16), [0x34, 0x12, 0xff, 0xff, 1, 0, 0, 0]);
        assert!(pack_bits(&[0, 0, 0], 0).is_empty());
        assert_eq!(read_bits(&[], 0, 5), 0);
    }

    #[test]
    fn bits_hold_every_index() {
        let want =
            [(0, 0), (1, 0), (2, 1), (3, 2), (4, 2), (5, 3), (512, 9), (513, 10), (65536, 16)];
        for (count, bits) in want {
            assert_eq!(bits_for(count), bits, "{count}");
        }
    }

    #[test]
    #[should_panic(expected = "8 has more than 3 bits")]
    fn values_that_do_not_fit_are_refused() {
        pack_bits(&[8], 3);
    }

    proptest! {
        #[test]
        fn what_was_packed_is_read((bits, values) in (0u32..=16).prop_flat_map(|bits| {
            (Just(bits), prop::collection::vec(0..1u32 << bits, 0..200))
        })) {
            let bytes = pack_bits(&values, bits);
            prop_assert_eq!(bytes.len(), (values.len() * bits as usize).div_ceil(32) * 4);
            let back: Vec<u32> = (0..values.len()).map(|i| read_bits(&bytes, bits, i)).collect();
            prop_assert_eq!(&back, &values);
            // Bit by bit, the slow way.
            let bit = |b: usize| u32::from(bytes[b / 8] >> (b % 8) & 1);
            for (i, value) in values.iter().enumerate() {
                let at = i * bits as usize;
                let slow = (0..bits).fold(0, |v, b| v | bit(at + b as usize) << b);
                prop_assert_eq!(slow, *value);
            }
            let used = values.len() * bits as usize;
            prop_assert!((used..bytes.len() * 8).all(|b| bit(b) == 0));
        }
    }
}
