//! Billboards to codewords: paper 004, section 4.1.

use crate::atlas::Codewords;
use crate::error::VolumeError;
use crate::header::Coding;
use crate::options::{Blank, CodebookOptions, CodebookSize, MAX_WORDS, Space};
use forest_soup::{linear_to_srgb8, srgb8_to_linear};
use forest_vq::{TrainOptions, Training, Vectors, lab_to_linear, linear_to_lab, train};
use rayon::prelude::*;

/// Billboards by the numbers of their codewords.
#[derive(Clone, Debug)]
pub struct Quantised {
    /// How many codewords, and whether they are compressed.
    pub coding: Coding,
    /// The codewords as a reader sees them.
    pub words: Codewords,
    /// The atlas as it is stored.
    pub(crate) atlas: Vec<u8>,
    /// Colour word of each billboard.
    pub colors: Vec<u32>,
    /// Alpha word of each billboard.
    pub alphas: Vec<u32>,
    /// How near it is to the billboards.
    pub quality: Quality,
    /// How the training went.
    pub effort: [Effort; 2],
}

/// How a codebook was found: of colour, and of alpha.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Effort {
    /// Rounds of the last training.
    pub rounds: usize,
    /// Distances computed in it.
    pub distances: u64,
}

/// Differences of coded billboards from the originals.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quality {
    /// Peak signal to noise ratio of the sRGB values of texels that are not transparent, in dB:
    /// 255² over the mean square of the three channels. Infinite for no difference.
    pub color_psnr: f64,
    /// The same of alpha, over all texels.
    pub alpha_psnr: f64,
    /// Mean CIELab difference (ΔE, 1976) of texels that are not transparent.
    pub delta_e: f64,
}

/// Fewest codewords that are tried for a PSNR.
const FEWEST: usize = 16;

/// Finds codebooks for billboards of `side × side` texels, given one after the other.
///
/// # Errors
/// When no codebook reaches the quality asked for.
pub fn quantise(
    texels: &[[u8; 4]],
    side: u32,
    options: &CodebookOptions,
) -> Result<Quantised, VolumeError> {
    options.validate().map_err(VolumeError::Options)?;
    let t2 = (side * side) as usize;
    let (color_vectors, alpha_vectors) =
        (color_vectors(texels, t2, options)?, alpha_vectors(texels, t2)?);
    let colors = |training: &Training| color_words(training, options);
    let (color, color_words) = search(
        &color_vectors,
        options,
        &|t| color_psnr(texels, t2, &colors(t), &t.indices),
        &colors,
    )?;
    let (alpha, alpha_words) = search(
        &alpha_vectors,
        options,
        &|t| alpha_psnr(texels, t2, &alpha_words(t), &t.indices),
        &alpha_words,
    )?;
    let coding = Coding::Codebook {
        colors: color.codebook.len() as u32,
        alphas: alpha.codebook.len() as u32,
        block: options.block,
    };
    let words = Codewords { texels: side, colors: color_words, alphas: alpha_words };
    let atlas = words.encode(coding);
    let words = Codewords::decode(&atlas, coding, side);
    let quality = Quality {
        color_psnr: color_psnr(texels, t2, &words.colors, &color.indices),
        alpha_psnr: alpha_psnr(texels, t2, &words.alphas, &alpha.indices),
        delta_e: delta_e(texels, t2, &words.colors, &color.indices),
    };
    let effort =
        [&color, &alpha].map(|t| Effort { rounds: t.history.len(), distances: t.distances });
    let (colors, alphas) = (color.indices, alpha.indices);
    Ok(Quantised { coding, words, atlas, colors, alphas, quality, effort })
}

/// Trains a codebook of the size that is asked for, or the smallest that is good enough.
fn search<W>(
    vectors: &Vectors,
    options: &CodebookOptions,
    psnr: &dyn Fn(&Training) -> f64,
    words: &dyn Fn(&Training) -> W,
) -> Result<(Training, W), VolumeError> {
    let trained = |codewords| {
        let options = TrainOptions {
            codewords,
            seed: options.seed,
            centers: options.centers,
            ..TrainOptions::default()
        };
        train(vectors, None, &options)
    };
    let wanted = match options.size {
        CodebookSize::Words(n) => {
            let training = trained(n)?;
            let words = words(&training);
            return Ok((training, words));
        }
        CodebookSize::Psnr(wanted) => wanted,
    };
    let mut size = FEWEST;
    loop {
        let training = trained(size)?;
        let reached = psnr(&training);
        if reached >= wanted {
            let words = words(&training);
            return Ok((training, words));
        }
        // Fewer words than asked for are all that there are.
        if size == MAX_WORDS || training.codebook.len() < size {
            return Err(VolumeError::Quality { wanted, words: training.codebook.len(), reached });
        }
        size *= 2;
    }
}

/// A billboard's colours, three numbers a texel.
fn color_vectors(
    texels: &[[u8; 4]],
    t2: usize,
    options: &CodebookOptions,
) -> Result<Vectors, VolumeError> {
    let values: Vec<f32> = texels
        .par_chunks(t2)
        .flat_map_iter(|billboard| {
            let blank = blank_color(billboard, options.blank);
            billboard.iter().flat_map(move |&[r, g, b, a]| {
                let color = if a > 0 { [r, g, b] } else { blank };
                coordinates(color, options.space)
            })
        })
        .collect();
    Ok(Vectors::new(3 * t2, values)?)
}

fn alpha_vectors(texels: &[[u8; 4]], t2: usize) -> Result<Vectors, VolumeError> {
    Ok(Vectors::new(t2, texels.iter().map(|t| f32::from(t[3])).collect())?)
}

/// What blank texels of a billboard hold.
fn blank_color(billboard: &[[u8; 4]], blank: Blank) -> [u8; 3] {
    let mut sum = [0.0f32; 4];
    for &[r, g, b, a] in billboard {
        let alpha = f32::from(a);
        for (to, c) in sum.iter_mut().zip([r, g, b]) {
            *to += alpha * srgb8_to_linear(c);
        }
        sum[3] += alpha;
    }
    if blank == Blank::Black || sum[3] == 0.0 {
        return [0; 3];
    }
    [0, 1, 2].map(|k| linear_to_srgb8(sum[k] / sum[3]))
}

fn lab(color: [u8; 3]) -> [f32; 3] {
    linear_to_lab(color.map(srgb8_to_linear))
}

fn coordinates(color: [u8; 3], space: Space) -> [f32; 3] {
    match space {
        Space::Lab => lab(color),
        Space::Rgb => color.map(f32::from),
    }
}

/// Colour words in sRGB.
fn color_words(training: &Training, options: &CodebookOptions) -> Vec<[u8; 3]> {
    let dimension = training.codebook.dimension();
    let to_srgb = |v: &[f32; 3]| match options.space {
        Space::Lab => lab_to_linear(*v).map(linear_to_srgb8),
        Space::Rgb => v.map(|v| v.round().clamp(0.0, 255.0) as u8),
    };
    let mut words: Vec<[u8; 3]> =
        training.codebook.words().as_chunks::<3>().0.iter().map(to_srgb).collect();
    if options.blank == Blank::Black {
        words.chunks_exact_mut(dimension / 3).for_each(fill_black);
    }
    words
}

/// "Every black pixel in the quantized texture [is replaced] with the color of the brightest pixel"
/// (section 4.1.1): colour words are shared by billboards whose opaque texels lie elsewhere.
fn fill_black(word: &mut [[u8; 3]]) {
    let light = |c: &[u8; 3]| c.iter().map(|v| u32::from(*v)).sum::<u32>();
    let brightest = *word.iter().max_by_key(|c| light(c)).expect("a word has texels");
    word.iter_mut().filter(|c| **c == [0; 3]).for_each(|c| *c = brightest);
}

fn alpha_words(training: &Training) -> Vec<u8> {
    training.codebook.words().iter().map(|v| v.round().clamp(0.0, 255.0) as u8).collect()
}

/// Sum and count over billboards, in chunks whose sums do not depend on the threads.
fn mean(
    texels: &[[u8; 4]],
    t2: usize,
    indices: &[u32],
    difference: &(dyn Fn(usize, [u8; 4]) -> Option<f64> + Sync),
) -> f64 {
    const CHUNK: usize = 4096;
    let sums: Vec<(f64, u64)> = texels
        .par_chunks(CHUNK * t2)
        .zip(indices.par_chunks(CHUNK))
        .map(|(texels, indices)| {
            let mut sum = (0.0, 0);
            for (billboard, &word) in texels.chunks_exact(t2).zip(indices) {
                for (i, &texel) in billboard.iter().enumerate() {
                    if let Some(d) = difference(word as usize * t2 + i, texel) {
                        sum = (sum.0 + d, sum.1 + 1);
                    }
                }
            }
            sum
        })
        .collect();
    let (sum, count) = sums.iter().fold((0.0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
    sum / count.max(1) as f64
}

fn psnr(mean_square: f64) -> f64 {
    10.0 * (255.0 * 255.0 / mean_square).log10()
}

fn color_psnr(texels: &[[u8; 4]], t2: usize, words: &[[u8; 3]], indices: &[u32]) -> f64 {
    psnr(mean(texels, t2, indices, &|i, [r, g, b, a]| {
        let square = |(p, q): (u8, u8)| f64::from(p.abs_diff(q)).powi(2);
        (a > 0).then(|| [r, g, b].into_iter().zip(words[i]).map(square).sum::<f64>() / 3.0)
    }))
}

fn alpha_psnr(texels: &[[u8; 4]], t2: usize, words: &[u8], indices: &[u32]) -> f64 {
    psnr(mean(texels, t2, indices, &|i, texel| {
        Some(f64::from(texel[3].abs_diff(words[i])).powi(2))
    }))
}

fn delta_e(texels: &[[u8; 4]], t2: usize, words: &[[u8; 3]], indices: &[u32]) -> f64 {
    let labs: Vec<[f32; 3]> = words.iter().map(|&w| lab(w)).collect();
    mean(texels, t2, indices, &|i, [r, g, b, a]| {
        let square = |(p, q): (f32, f32)| f64::from(p - q).powi(2);
        let (p, q) = (lab([r, g, b]), labs[i]);
        (a > 0).then(|| p.into_iter().zip(q).map(square).sum::<f64>().sqrt())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Billboards of 4 texels: green ones of several shades, with holes; two are alike.
    fn billboards() -> Vec<[u8; 4]> {
        let shade = |i: u8| {
            [
                [10, 60 + i, 20, 255],
                [30, 100 + i, 40, 128],
                [7, 7, 7, 0],
                [60, 140, 5 * (i % 9), 255],
            ]
        };
        (0..80).chain(79..80).flat_map(shade).collect()
    }

    #[test]
    fn as_many_words_as_billboards_lose_nothing() {
        for centers in [forest_vq::Centers::Nearest, forest_vq::Centers::Mean] {
            for space in [Space::Lab, Space::Rgb] {
                let options = CodebookOptions {
                    size: CodebookSize::Words(200),
                    centers,
                    space,
                    ..Default::default()
                };
                let q = quantise(&billboards(), 2, &options).unwrap();
                assert_eq!(q.coding, Coding::Codebook { colors: 80, alphas: 1, block: false });
                assert_eq!(q.quality.color_psnr, f64::INFINITY, "{centers:?} {space:?}");
                assert_eq!((q.quality.alpha_psnr, q.quality.delta_e), (f64::INFINITY, 0.0));
                assert_eq!(q.colors[79], q.colors[80]);
            }
        }
    }

    #[test]
    fn the_smallest_codebook_that_is_good_enough_is_found() {
        let size = |db| {
            let options = CodebookOptions { size: CodebookSize::Psnr(db), ..Default::default() };
            let q = quantise(&billboards(), 2, &options).unwrap();
            let Coding::Codebook { colors, .. } = q.coding else { panic!("codebooks") };
            assert!(q.quality.color_psnr >= db);
            colors
        };
        let (coarse, fine) = (size(20.0), size(45.0));
        assert!(coarse == 16 && fine > 16, "{coarse} {fine}");
    }

    #[test]
    fn black_texels_of_words_take_the_brightest_colour() {
        let blank = Blank::Black;
        let options =
            CodebookOptions { blank, size: CodebookSize::Words(80), ..Default::default() };
        let q = quantise(&billboards(), 2, &options).unwrap();
        for (word, texels) in q.words.colors.chunks_exact(4).enumerate() {
            assert!(texels.iter().all(|c| *c != [0; 3]), "{word}");
            // The third texel was blank: it has the colour of the brightest, the second or fourth.
            assert!(texels[2] == texels[1] || texels[2] == texels[3], "{texels:?}");
        }
    }

    #[test]
    fn blank_and_full_billboards_are_words_of_their_own() {
        let texels = [vec![[0, 0, 0, 0]; 4], vec![[200, 10, 10, 255]; 4]].concat();
        let q = quantise(&texels, 2, &CodebookOptions::default()).unwrap();
        assert_eq!(q.quality.color_psnr, f64::INFINITY);
        assert_eq!(q.words.alphas.len(), 8);
        assert_ne!(q.alphas[0], q.alphas[1]);
    }
}
