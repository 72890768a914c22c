//! What a bake of views is asked for.

use crate::codec::Channel;
use crate::directions::{Directions, Dome};
use serde::{Deserialize, Serialize};

/// Channels beside colour and coverage.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Channels {
    /// Normals.
    pub normal: bool,
    /// Depth.
    pub depth: bool,
    /// Share of the sky that is seen (ambient occlusion).
    pub sky: bool,
}

impl Channels {
    /// Whether a channel is stored; colour always is.
    pub fn has(&self, channel: Channel) -> bool {
        match channel {
            Channel::Color => true,
            Channel::Normal => self.normal,
            Channel::Depth => self.depth,
            Channel::Sky => self.sky,
        }
    }

    /// All of them.
    pub const ALL: Self = Self { normal: true, depth: true, sky: true };
    /// None of them.
    pub const COLOR: Self = Self { normal: false, depth: false, sky: false };
}

/// How texels are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Quality {
    /// As they are: 8 bits a channel, 16 of depth.
    Lossless,
    /// BC7 colour, BC5 normals, BC4 depth and sky: what a GPU reads compressed.
    Block,
}

/// How tiles are framed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Fit {
    /// The smallest square about the middle of the box that holds the tree in every view.
    Tight,
    /// The square about the bounding sphere of the box.
    Sphere,
}

/// What a bake of views is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewsOptions {
    /// Where views are taken from.
    pub directions: Directions,
    /// Texels along the side of a tile at its finest level: a power of two, 1 … 4096.
    pub texels: u32,
    /// Samples along the side of a texel, at least.
    pub samples: u32,
    /// Channels to bake.
    pub channels: Channels,
    /// How texels are stored.
    pub quality: Quality,
    /// How tiles are framed.
    pub fit: Fit,
    /// Longest side of an atlas page in texels: a multiple of 4, at least a tile.
    pub max_page: u32,
}

impl Default for ViewsOptions {
    /// 17 × 17 views of 256 texels from above the horizon, all channels, compressed.
    fn default() -> Self {
        Self {
            directions: Directions::octahedral(300, Dome::Upper),
            texels: 256,
            samples: 4,
            channels: Channels::ALL,
            quality: Quality::Block,
            fit: Fit::Tight,
            max_page: 4096,
        }
    }
}

/// Samples across the largest capture: each thread holds its square, 8 bytes a sample.
const MAX_GRID: u32 = 16384;

/// Texels of all views at the finest level, which are held while levels are packed: 12 bytes each.
const MAX_BAKED_TEXELS: u64 = 1 << 29;

/// Samples along the side of the smallest capture: tiny tiles are not sampled less.
const LEAST_GRID: u32 = 64;

impl ViewsOptions {
    /// Samples along the side of a texel of the finest level that are taken: whole blocks of four.
    pub fn samples_a_side(&self) -> u32 {
        self.samples.max(LEAST_GRID.div_ceil(self.texels)).next_multiple_of(4)
    }

    /// Checks ranges.
    ///
    /// # Errors
    /// The first option that makes no sense, its value and the limit.
    pub fn validate(&self) -> Result<(), String> {
        self.directions.validate()?;
        if !self.texels.is_power_of_two() || self.texels > crate::header::MAX_TEXELS {
            return Err(format!("{} texels a tile; powers of two from 1 to 4096", self.texels));
        }
        if !(1..=16).contains(&self.samples) {
            return Err(format!("{} samples a side; from 1 to 16", self.samples));
        }
        let grid = self.texels * self.samples_a_side();
        if grid > MAX_GRID {
            let samples = self.samples_a_side();
            let what = format!("tiles of {} texels with {samples} samples a side", self.texels);
            return Err(format!("{what}: {grid} samples across; the limit is {MAX_GRID}"));
        }
        let all = u64::from(self.directions.count()) * u64::from(self.texels).pow(2);
        if all > MAX_BAKED_TEXELS {
            let views = self.directions.count();
            let what = format!("{views} views of {}² texels", self.texels);
            return Err(format!("{what}: {all} texels; the limit is {MAX_BAKED_TEXELS}"));
        }
        // A tile with its gutter must fit a page.
        let least = (self.texels + 2).next_multiple_of(4);
        if !(least..=16384).contains(&self.max_page) || !self.max_page.is_multiple_of(4) {
            let page = self.max_page;
            return Err(format!("pages of {page} texels; multiples of 4 from {least} to 16384"));
        }
        Ok(())
    }
}
