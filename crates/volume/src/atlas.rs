//! Codewords laid out as a picture.

use crate::header::{ATLAS_WIDTH, Coding};

/// Codewords as they are looked up: sRGB of colour words, alpha of alpha words.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Codewords {
    /// Texels along the side of a word.
    pub texels: u32,
    /// Colour words, one after the other.
    pub colors: Vec<[u8; 3]>,
    /// Alpha words, one after the other.
    pub alphas: Vec<u8>,
}

impl Codewords {
    /// The atlas as it is stored: word k takes the k-th square, row by row; colour word k and alpha
    /// word k share it. What no word takes is 0.
    pub(crate) fn encode(&self, coding: Coding) -> Vec<u8> {
        let height = coding.atlas_height(self.texels);
        let mut rgba = vec![[0u8; 4]; (ATLAS_WIDTH * height) as usize];
        for (i, color) in (0..).zip(&self.colors) {
            rgba[place(i, self.texels)][..3].copy_from_slice(color);
        }
        for (i, alpha) in (0..).zip(&self.alphas) {
            rgba[place(i, self.texels)][3] = *alpha;
        }
        let rgba = rgba.as_flattened();
        match coding {
            Coding::Codebook { block: true, .. } => {
                let (width, stride) = (ATLAS_WIDTH, ATLAS_WIDTH * 4);
                let surface = intel_tex_2::RgbaSurface { data: rgba, width, height, stride };
                intel_tex_2::bc3::compress_blocks(&surface)
            }
            _ => rgba.to_vec(),
        }
    }

    /// Reads a stored atlas of [`Coding::atlas_bytes`] bytes.
    pub(crate) fn decode(stored: &[u8], coding: Coding, texels: u32) -> Self {
        let Coding::Codebook { colors, alphas, block } = coding else {
            return Self { texels, colors: Vec::new(), alphas: Vec::new() };
        };
        let decoded;
        let rgba = if block {
            decoded = decode_bc3(stored, coding.atlas_height(texels));
            &decoded
        } else {
            stored
        };
        let rgba = rgba.as_chunks::<4>().0;
        let t2 = texels * texels;
        let at = |i| rgba[place(i, texels)];
        let color = |i| {
            let [r, g, b, _] = at(i);
            [r, g, b]
        };
        Self {
            texels,
            colors: (0..colors * t2).map(color).collect(),
            alphas: (0..alphas * t2).map(|i| at(i)[3]).collect(),
        }
    }
}

/// Where texel `i`, counted through all words, lies in the atlas.
fn place(i: u32, texels: u32) -> usize {
    let (word, texel) = (i / (texels * texels), i % (texels * texels));
    let across = ATLAS_WIDTH / texels;
    let x = word % across * texels + texel % texels;
    let y = word / across * texels + texel / texels;
    (y * ATLAS_WIDTH + x) as usize
}

impl Codewords {
    /// The RGBA texels of a compressed atlas of this height: for devices that do not read its blocks.
    pub fn decode_blocks(stored: &[u8], height: u32) -> Vec<u8> {
        decode_bc3(stored, height)
    }
}

fn decode_bc3(stored: &[u8], height: u32) -> Vec<u8> {
    let pitch = ATLAS_WIDTH as usize * 4;
    let mut out = vec![0; pitch * height as usize];
    for (i, block) in stored.as_chunks::<16>().0.iter().enumerate() {
        let across = (ATLAS_WIDTH / 4) as usize;
        let (x, y) = (i % across, i / across);
        bcdec_rs::bc3(block, &mut out[y * 4 * pitch + x * 16..], pitch);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_come_back_from_the_atlas() {
        for texels in [2u32, 4, 8] {
            let t2 = (texels * texels) as usize;
            let colors: Vec<[u8; 3]> =
                (0..300 * t2).map(|i| [i as u8, (i / 7) as u8, (i / 300) as u8]).collect();
            let alphas: Vec<u8> = (0..17 * t2).map(|i| (i * 3) as u8).collect();
            let words = Codewords { texels, colors, alphas };
            let coding = Coding::Codebook { colors: 300, alphas: 17, block: false };
            let stored = words.encode(coding);
            assert_eq!(stored.len() as u64, coding.atlas_bytes(texels));
            assert_eq!(Codewords::decode(&stored, coding, texels), words);
        }
    }

    #[test]
    fn a_word_of_four_texels_is_a_block() {
        // Words of one colour survive block compression within its five bits.
        let colors = (0..200).flat_map(|k| vec![[k, 255 - k, 128]; 16]).collect();
        let alphas = (0..200).flat_map(|k| vec![k; 16]).collect();
        let words = Codewords { texels: 4, colors, alphas };
        let coding = Coding::Codebook { colors: 200, alphas: 200, block: true };
        let stored = words.encode(coding);
        assert_eq!(stored.len() as u64, coding.atlas_bytes(4));
        let back = Codewords::decode(&stored, coding, 4);
        for (a, b) in back.colors.as_flattened().iter().zip(words.colors.as_flattened()) {
            assert!(a.abs_diff(*b) <= 5, "{a} {b}");
        }
        assert!(back.alphas.iter().zip(&words.alphas).all(|(a, b)| a.abs_diff(*b) <= 1));
    }
}
