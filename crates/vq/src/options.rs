//! What a training is asked for.

use crate::error::VqError;

/// What stands for the vectors of a cluster.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Centers {
    /// Their mean: the generalised Lloyd algorithm.
    Mean,
    /// The one of them that is nearest to their mean (paper 004, section 4.1.2): nothing is
    /// averaged, so contrast stays; the distortion is a little higher.
    Nearest,
}

/// Where training starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seeding {
    /// Each word is drawn by its squared distance from those before it (D. Arthur,
    /// S. Vassilvitskii, "k-means++: the advantages of careful seeding", SODA 2007), the best of
    /// a few such draws.
    PlusPlus,
    /// Words are drawn evenly from the distinct vectors.
    Random,
}

/// What a training is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrainOptions {
    /// Words at most, ≥ 1.
    pub codewords: usize,
    /// Rounds over all vectors at most, ≥ 1. Shorter rounds over samples of them come before.
    pub iterations: u32,
    /// A round over all vectors is the last if it lowered the distortion by less than this share,
    /// 0 ≤ and < 1.
    pub tolerance: f64,
    /// Of the random numbers: the same seed gives the same codebook on every machine.
    pub seed: u64,
    /// What stands for a cluster.
    pub centers: Centers,
    /// Where training starts.
    pub seeding: Seeding,
}

impl Default for TrainOptions {
    /// 512 words of original vectors, as in the paper; at most 30 rounds, until one gains less than
    /// a ten-thousandth.
    fn default() -> Self {
        Self {
            codewords: 512,
            iterations: 30,
            tolerance: 1e-4,
            seed: 1,
            centers: Centers::Nearest,
            seeding: Seeding::PlusPlus,
        }
    }
}

impl TrainOptions {
    /// Checks ranges.
    ///
    /// # Errors
    /// [`VqError::Option`] for the first one that makes no sense.
    pub fn validate(&self) -> Result<(), VqError> {
        let refuse = |name, value, limit| Err(VqError::Option { name, value, limit });
        if self.codewords == 0 || u32::try_from(self.codewords).is_err() {
            return refuse("codewords", self.codewords as f64, "from 1 to 4294967295");
        }
        if self.iterations == 0 {
            return refuse("iterations", 0.0, "at least 1");
        }
        if !(0.0..1.0).contains(&self.tolerance) {
            return refuse("tolerance", self.tolerance, "from 0 to below 1");
        }
        Ok(())
    }
}
