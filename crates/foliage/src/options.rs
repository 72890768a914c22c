//! What a bake of foliage is asked for.

use crate::parts::PartsOptions;

/// Options of a bake.
#[derive(Clone, Debug, PartialEq)]
pub struct FoliageOptions {
    /// What is wood and what is leaf.
    pub parts: PartsOptions,
    /// World units of a texel of the finest level; `None` for 1/512 of the tree's height.
    pub texel: Option<f64>,
    /// Number of levels; texels of each are twice as large as those of the one before.
    pub levels: u32,
    /// Store the dictionary in BC7 blocks, as graphics devices read them; else as RGBA.
    pub blocks: bool,
}

/// Texels along the height of the finest level, if nothing else is asked for.
const USUAL_TEXELS: f64 = 512.0;

/// Most levels.
pub(crate) const MOST_LEVELS: u32 = 8;

impl Default for FoliageOptions {
    fn default() -> Self {
        Self { parts: PartsOptions::default(), texel: None, levels: 4, blocks: true }
    }
}

impl FoliageOptions {
    /// Checks the options.
    ///
    /// # Errors
    /// The first that makes no sense, with its limit.
    pub fn validate(&self) -> Result<(), String> {
        if !(1..=MOST_LEVELS).contains(&self.levels) {
            return Err(format!("{} levels; from 1 to {MOST_LEVELS}", self.levels));
        }
        match self.texel {
            Some(t) if !(t > 0.0 && t.is_finite()) => Err(format!("texels of {t}; above 0")),
            _ => Ok(()),
        }
    }

    /// The finest texel of a tree of this height, or this size if it has none.
    pub(crate) fn finest(&self, height: f64, size: f64) -> f64 {
        let height = if height > 0.05 * size { height } else { size };
        self.texel.unwrap_or(height / USUAL_TEXELS)
    }
}
