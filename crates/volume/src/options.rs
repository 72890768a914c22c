//! What a bake of a volume is asked for.

use crate::lattice::Branching;
use serde::{Deserialize, Serialize};

/// Where the textures of coarser levels come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Coarse {
    /// The photographs, as those of the finest level (paper 004, section 3.1).
    Photographs,
    /// The textures of the level below, one over the other: what the paper decided against.
    Below,
}

/// From where a cell must be hidden for a camera to have no billboard of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Prune {
    /// From the camera itself (paper 004, section 3.2): viewers beside it see holes.
    Own,
    /// From the camera and its six nearest neighbours.
    Neighbours,
}

/// In which space codebooks are trained.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Space {
    /// CIELab, D65 (paper 004, section 4.1).
    Lab,
    /// sRGB, as Beers, Agrawala, Chaddha 1996.
    Rgb,
}

/// How many codewords.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CodebookSize {
    /// At most so many, of colours and of alphas: 1 … 65536.
    Words(usize),
    /// As few, of powers of two from 16 on, as hold this PSNR in dB: of the sRGB values of texels
    /// that are not transparent, and of alpha.
    Psnr(f64),
}

/// What texels without opacity hold while codebooks are trained.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Blank {
    /// The mean colour of their billboard: no codeword is spent on which texels are blank.
    Mean,
    /// Black; black texels of codewords then take the colour of the brightest (paper 004, section
    /// 4.1.1).
    Black,
}

/// How codebooks are trained.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CodebookOptions {
    /// How many codewords.
    pub size: CodebookSize,
    /// Colour space of distances.
    pub space: Space,
    /// Codewords are vectors of the training set (the paper's change, section 4.1.2) or means.
    pub centers: forest_vq::Centers,
    /// Blank texels.
    pub blank: Blank,
    /// Names the draw of the first codewords.
    pub seed: u64,
    /// Compress the atlas of codewords by BC3 (DXT5, section 5).
    pub block: bool,
}

impl Default for CodebookOptions {
    /// 512 of each, in CIELab, taken from the training set, not block-compressed.
    fn default() -> Self {
        Self {
            size: CodebookSize::Words(512),
            space: Space::Lab,
            centers: forest_vq::Centers::Nearest,
            blank: Blank::Mean,
            seed: 1,
            block: false,
        }
    }
}

/// What a bake of a volume is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolumeOptions {
    /// How cells are cut.
    pub branching: Branching,
    /// Levels below the root.
    pub levels: u32,
    /// Texels along the side of a billboard: 2, 4 or 8.
    pub texels: u32,
    /// A cell has no billboard for a camera from which what is before it hides more than this share
    /// of it, 0 … 1; 1 keeps all.
    pub prune: f64,
    /// From where.
    pub prune_by: Prune,
    /// Textures of coarser levels.
    pub coarse: Coarse,
}

impl Default for VolumeOptions {
    /// The paper's: an octree of 7 levels below the root, 4 × 4 texels.
    fn default() -> Self {
        Self {
            branching: Branching::Octree,
            levels: Branching::Octree.usual_levels(),
            texels: 4,
            prune: 0.98,
            prune_by: Prune::Neighbours,
            coarse: Coarse::Photographs,
        }
    }
}

/// Most codewords.
pub(crate) const MAX_WORDS: usize = 65536;

impl VolumeOptions {
    /// Checks ranges.
    ///
    /// # Errors
    /// The first option that makes no sense, its value and the limit.
    pub fn validate(&self) -> Result<(), String> {
        let most = self.branching.most_levels();
        if self.levels > most {
            return Err(format!("{} levels below the root; at most {most}", self.levels));
        }
        if ![2, 4, 8].contains(&self.texels) {
            return Err(format!("{} texels a side of a billboard; 2, 4 or 8", self.texels));
        }
        if !(0.0..=1.0).contains(&self.prune) {
            return Err(format!("billboards pruned above {}; from 0 to 1", self.prune));
        }
        Ok(())
    }
}

impl CodebookOptions {
    /// Checks ranges.
    ///
    /// # Errors
    /// The first option that makes no sense, its value and the limit.
    pub fn validate(&self) -> Result<(), String> {
        match self.size {
            CodebookSize::Words(n) if !(1..=MAX_WORDS).contains(&n) => {
                Err(format!("{n} codewords; from 1 to {MAX_WORDS}"))
            }
            CodebookSize::Psnr(db) if !(db > 0.0 && db < 200.0) => {
                Err(format!("a PSNR of {db} dB; above 0 and below 200"))
            }
            _ => Ok(()),
        }
    }
}
