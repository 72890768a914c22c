//! KTX 2.0 texture arrays (Khronos KTX File Format Specification, version 2.0): only what views need.

/// A block-compressed format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Format {
    /// sRGB colour and linear alpha.
    Bc7Srgb,
    /// Two channels.
    Bc5,
    /// One channel.
    Bc4,
}

/// A square texture array with all its mips.
#[derive(Clone, Debug)]
pub(crate) struct TextureArray {
    pub(crate) format: Format,
    /// Texels along a side of the finest level.
    pub(crate) side: u32,
    pub(crate) layers: u32,
    /// Blocks of all layers, for each level, finest first.
    pub(crate) levels: Vec<Vec<u8>>,
}

const IDENTIFIER: [u8; 12] =
    [0xab, b'K', b'T', b'X', b' ', b'2', b'0', 0xbb, b'\r', b'\n', 0x1a, b'\n'];

/// Rows point down, columns to the right.
const ORIENTATION: &[u8] = b"KTXorientation\0rd\0";
const WRITER: &[u8] =
    concat!("KTXwriter\0forest-bake ", env!("CARGO_PKG_VERSION"), "\0").as_bytes();

impl Format {
    /// VkFormat.
    fn vulkan(self) -> u32 {
        match self {
            Self::Bc7Srgb => 146,
            Self::Bc5 => 141,
            Self::Bc4 => 139,
        }
    }

    fn block_bytes(self) -> u32 {
        match self {
            Self::Bc7Srgb | Self::Bc5 => 16,
            Self::Bc4 => 8,
        }
    }

    /// The basic data format descriptor (Khronos Data Format Specification 1.3, chapter 5), with its
    /// total size before it.
    fn descriptor(self) -> Vec<u8> {
        let (model, transfer, samples): (u8, u8, &[(u16, u8, u8)]) = match self {
            // (bit offset, bits − 1, channel)
            Self::Bc7Srgb => (134, 2, &[(0, 127, 0)]),
            Self::Bc5 => (132, 1, &[(0, 63, 0), (64, 63, 1)]),
            Self::Bc4 => (131, 1, &[(0, 63, 0)]),
        };
        let block = 24 + 16 * samples.len() as u32;
        let mut out = Vec::new();
        out.extend((block + 4).to_le_bytes());
        out.extend(0u32.to_le_bytes()); // Khronos, basic format
        out.extend((2u32 | block << 16).to_le_bytes()); // version 1.3
        out.extend([model, 1, transfer, 0]); // BT.709 primaries, straight alpha
        out.extend([3, 3, 0, 0]); // blocks of 4 × 4
        out.extend([self.block_bytes() as u8, 0, 0, 0, 0, 0, 0, 0]);
        for &(offset, bits, channel) in samples {
            out.extend(offset.to_le_bytes());
            out.extend([bits, channel]);
            out.extend([0; 4]); // position
            out.extend(0u32.to_le_bytes());
            out.extend(u32::MAX.to_le_bytes());
        }
        out
    }
}

impl TextureArray {
    /// The file.
    pub(crate) fn to_bytes(&self) -> Vec<u8> {
        let levels = self.levels.len();
        let descriptor = self.format.descriptor();
        let mut values = Vec::new();
        for pair in [ORIENTATION, WRITER] {
            values.extend((pair.len() as u32).to_le_bytes());
            values.extend(pair);
            values.resize(values.len().next_multiple_of(4), 0);
        }
        let descriptor_at = 80 + 24 * levels;
        let values_at = descriptor_at + descriptor.len();
        let align = self.format.block_bytes() as usize;
        // The coarsest level comes first in the file.
        let mut at = values_at + values.len();
        let mut places = vec![0; levels];
        for i in (0..levels).rev() {
            at = at.next_multiple_of(align);
            places[i] = at;
            at += self.levels[i].len();
        }
        let mut out = Vec::with_capacity(at);
        out.extend(IDENTIFIER);
        let words =
            [self.format.vulkan(), 1, self.side, self.side, 0, self.layers, 1, levels as u32, 0];
        let index = [descriptor_at, descriptor.len(), values_at, values.len()].map(|v| v as u32);
        words.iter().chain(&index).for_each(|w| out.extend(w.to_le_bytes()));
        out.extend([0; 16]); // no supercompression data
        for (place, level) in places.iter().zip(&self.levels) {
            let length = level.len() as u64;
            [*place as u64, length, length].iter().for_each(|w| out.extend(w.to_le_bytes()));
        }
        out.extend(descriptor);
        out.extend(values);
        for i in (0..levels).rev() {
            out.resize(places[i], 0);
            out.extend(&self.levels[i]);
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_independent_reader_finds_everything() {
        for (format, bytes, vulkan) in [
            (Format::Bc7Srgb, 16, ktx2::Format::BC7_SRGB_BLOCK),
            (Format::Bc5, 16, ktx2::Format::BC5_UNORM_BLOCK),
            (Format::Bc4, 8, ktx2::Format::BC4_UNORM_BLOCK),
        ] {
            let blocks = |side: u32| (side.div_ceil(4).pow(2) * 3) as usize * bytes;
            let levels: Vec<Vec<u8>> = [8, 4, 2, 1].map(|s| vec![s as u8; blocks(s)]).into();
            let file = TextureArray { format, side: 8, layers: 3, levels: levels.clone() };
            let file = file.to_bytes();
            let reader = ktx2::Reader::new(&file).expect("a sound file");
            let h = reader.header();
            assert_eq!(h.format, Some(vulkan));
            assert_eq!((h.pixel_width, h.pixel_height, h.pixel_depth), (8, 8, 0));
            assert_eq!((h.layer_count, h.face_count, h.level_count), (3, 1, 4));
            let read: Vec<Vec<u8>> = reader.levels().map(|l| l.data.to_vec()).collect();
            assert_eq!(read, levels);
            let values: Vec<_> = reader.key_value_data().collect();
            assert_eq!(values[0], ("KTXorientation", &b"rd\0"[..]));
            assert_eq!(reader.dfd_blocks().len(), 1);
        }
    }
}
