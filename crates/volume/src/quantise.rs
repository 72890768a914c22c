//! Billboards to codewords: paper 004, section 4.1.

use crate::atlas::Codewords;
use crate::error::VolumeError;
use crate::header::Coding;
use crate::options::{Blank, CodebookOptions, CodebookSize, MAX_WORDS, Space};
use forest_soup::{linear_to_srgb8, srgb8_to_linear};
use forest_vq::{TrainOptions, Training, Vectors, assign, lab_to_linear, linear_to_lab, train};
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

/// Billboards that codebooks are trained on at most, evenly through all: more change little.
const TRAINING: usize = 1 << 18;

/// Billboards whose codewords are looked up together.
const CHUNK: usize = 1 << 16;

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
    let billboards = Billboards { texels, t2: (side * side) as usize, options };
    let color = Book::of(&billboards, Part::Color)?;
    let alpha = Book::of(&billboards, Part::Alpha)?;
    let coding = Coding::Codebook {
        colors: color.training.codebook.len() as u32,
        alphas: alpha.training.codebook.len() as u32,
        block: options.block,
    };
    let words = Codewords {
        texels: side,
        colors: billboards.color_words(&color.training),
        alphas: alpha_words(&alpha.training),
    };
    let atlas = words.encode(coding);
    let words = Codewords::decode(&atlas, coding, side);
    let quality = Quality {
        color_psnr: billboards.color_psnr(&words.colors, &color.indices),
        alpha_psnr: billboards.alpha_psnr(&words.alphas, &alpha.indices),
        delta_e: billboards.delta_e(&words.colors, &color.indices),
    };
    let effort = [&color.training, &alpha.training]
        .map(|t| Effort { rounds: t.history.len(), distances: t.distances });
    let (colors, alphas) = (color.indices, alpha.indices);
    Ok(Quantised { coding, words, atlas, colors, alphas, quality, effort })
}

/// What a codebook is of.
#[derive(Clone, Copy)]
enum Part {
    Color,
    Alpha,
}

/// What is to be coded.
struct Billboards<'a> {
    texels: &'a [[u8; 4]],
    /// Texels of each.
    t2: usize,
    options: &'a CodebookOptions,
}

/// A codebook, and the words of all billboards.
struct Book {
    training: Training,
    indices: Vec<u32>,
}

impl Book {
    /// A codebook of the size that is asked for, or the smallest that is good enough.
    fn of(billboards: &Billboards, part: Part) -> Result<Self, VolumeError> {
        let count = billboards.texels.len() / billboards.t2;
        let step = count.div_ceil(TRAINING).max(1);
        // One of each few, not always the same one: billboards lie camera by camera.
        let one = |i: usize| (i + scattered(i / step) % step).min(count - 1);
        let sample = (0..count).step_by(step).map(|i| &billboards.texels[one(i) * billboards.t2..]);
        let sample: Vec<[u8; 4]> = sample.flat_map(|b| &b[..billboards.t2]).copied().collect();
        let vectors = billboards.vectors(&sample, part)?;
        let trained = |codewords| -> Result<Self, VolumeError> {
            let options = TrainOptions {
                codewords,
                seed: billboards.options.seed,
                centers: billboards.options.centers,
                ..TrainOptions::default()
            };
            let mut training = train(&vectors, None, &options)?;
            let indices = match step {
                1 => std::mem::take(&mut training.indices),
                _ => billboards.assign(&training, part)?,
            };
            Ok(Self { training, indices })
        };
        let wanted = match billboards.options.size {
            CodebookSize::Words(n) => return trained(n),
            CodebookSize::Psnr(wanted) => wanted,
        };
        let mut size = FEWEST;
        loop {
            let book = trained(size)?;
            let reached = match part {
                Part::Color => {
                    let words = billboards.as_read(billboards.color_words(&book.training), vec![]);
                    billboards.color_psnr(&words.colors, &book.indices)
                }
                Part::Alpha => {
                    let words = billboards.as_read(vec![], alpha_words(&book.training));
                    billboards.alpha_psnr(&words.alphas, &book.indices)
                }
            };
            if reached >= wanted {
                return Ok(book);
            }
            // Fewer words than asked for are all that there are.
            let words = book.training.codebook.len();
            if size == MAX_WORDS || words < size {
                return Err(VolumeError::Quality { wanted, words, reached });
            }
            size *= 2;
        }
    }
}

impl Billboards<'_> {
    /// The vectors of some billboards: three numbers a texel, or one.
    fn vectors(&self, texels: &[[u8; 4]], part: Part) -> Result<Vectors, VolumeError> {
        let (t2, options) = (self.t2, self.options);
        Ok(match part {
            Part::Alpha => Vectors::new(t2, texels.iter().map(|t| f32::from(t[3])).collect())?,
            Part::Color => {
                let values = texels.par_chunks(t2).flat_map_iter(|billboard| {
                    let blank = blank_color(billboard, options.blank);
                    billboard.iter().flat_map(move |&[r, g, b, a]| {
                        let color = if a > 0 { [r, g, b] } else { blank };
                        coordinates(color, options.space)
                    })
                });
                Vectors::new(3 * t2, values.collect())?
            }
        })
    }

    /// Words as a reader sees them: those of colour and of alpha do not touch each other.
    fn as_read(&self, colors: Vec<[u8; 3]>, alphas: Vec<u8>) -> Codewords {
        let count = |words: usize| (words / self.t2) as u32;
        let coding = Coding::Codebook {
            colors: count(colors.len()),
            alphas: count(alphas.len()),
            block: self.options.block,
        };
        let words = Codewords { texels: self.t2.isqrt() as u32, colors, alphas };
        Codewords::decode(&words.encode(coding), coding, words.texels)
    }

    /// The nearest word of every billboard.
    fn assign(&self, training: &Training, part: Part) -> Result<Vec<u32>, VolumeError> {
        let mut out = Vec::with_capacity(self.texels.len() / self.t2);
        for chunk in self.texels.chunks(CHUNK * self.t2) {
            out.extend(assign(&training.codebook, &self.vectors(chunk, part)?));
        }
        Ok(out)
    }

    /// Colour words in sRGB.
    fn color_words(&self, training: &Training) -> Vec<[u8; 3]> {
        let to_srgb = |v: &[f32; 3]| match self.options.space {
            Space::Lab => lab_to_linear(*v).map(linear_to_srgb8),
            Space::Rgb => v.map(|v| v.round().clamp(0.0, 255.0) as u8),
        };
        let mut words: Vec<[u8; 3]> =
            training.codebook.words().as_chunks::<3>().0.iter().map(to_srgb).collect();
        if self.options.blank == Blank::Black {
            words.chunks_exact_mut(self.t2).for_each(fill_black);
        }
        words
    }

    /// Mean over texels that have a difference, in chunks whose sums do not depend on the threads:
    /// `difference` is told the texel's place among all words.
    fn mean(
        &self,
        indices: &[u32],
        difference: &(dyn Fn(usize, [u8; 4]) -> Option<f64> + Sync),
    ) -> f64 {
        let sums: Vec<(f64, u64)> = self
            .texels
            .par_chunks(CHUNK * self.t2)
            .zip(indices.par_chunks(CHUNK))
            .map(|(texels, indices)| {
                let mut sum = (0.0, 0);
                for (billboard, &word) in texels.chunks_exact(self.t2).zip(indices) {
                    for (i, &texel) in billboard.iter().enumerate() {
                        if let Some(d) = difference(word as usize * self.t2 + i, texel) {
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

    fn color_psnr(&self, words: &[[u8; 3]], indices: &[u32]) -> f64 {
        psnr(self.mean(indices, &|i, [r, g, b, a]| {
            let square = |(p, q): (u8, u8)| f64::from(p.abs_diff(q)).powi(2);
            (a > 0).then(|| [r, g, b].into_iter().zip(words[i]).map(square).sum::<f64>() / 3.0)
        }))
    }

    fn alpha_psnr(&self, words: &[u8], indices: &[u32]) -> f64 {
        psnr(self.mean(indices, &|i, texel| Some(f64::from(texel[3].abs_diff(words[i])).powi(2))))
    }

    fn delta_e(&self, words: &[[u8; 3]], indices: &[u32]) -> f64 {
        let labs: Vec<[f32; 3]> = words.iter().map(|&w| lab(w)).collect();
        self.mean(indices, &|i, [r, g, b, a]| {
            let square = |(p, q): (f32, f32)| f64::from(p - q).powi(2);
            (a > 0).then(|| lab([r, g, b]).into_iter().zip(labs[i]).map(square).sum::<f64>().sqrt())
        })
    }
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

/// A number that has nothing to do with its neighbours'.
fn scattered(i: usize) -> usize {
    ((i as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40) as usize
}

fn psnr(mean_square: f64) -> f64 {
    10.0 * (255.0 * 255.0 / mean_square).log10()
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
    fn a_quality_is_that_of_what_is_read_also_behind_block_compression() {
        let psnr = |db| CodebookOptions {
            size: CodebookSize::Psnr(db),
            block: true,
            ..Default::default()
        };
        // 5-6-5 end points: no codebook is this good.
        let refused = quantise(&billboards(), 2, &psnr(60.0));
        assert!(matches!(refused, Err(VolumeError::Quality { wanted: 60.0, .. })));
        assert!(quantise(&billboards(), 2, &psnr(20.0)).unwrap().quality.color_psnr >= 20.0);
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
