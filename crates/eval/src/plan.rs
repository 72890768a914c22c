//! What a sweep looks at, and its rules.

use crate::error::EvalError;
use forest_raster::{Light, Sampling};

/// Linear grey behind pictures where a metric wants a background.
pub const BACKGROUND: f32 = 0.5;

/// What a sweep looks at.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Heights of the tree in pixels: the largest first, and divisors of it.
    pub heights: Vec<u32>,
    /// Held-out view directions.
    pub views: u32,
    /// Thresholds s_m in square pixels, > 0.
    pub s_m: Vec<f64>,
    /// Shares of primitives for contenders without thresholds, in `0..=1`.
    pub shares: Vec<f64>,
    /// Light, on truth and contenders. The truth's sun throws shadows, the contenders' does not.
    pub light: Light,
    /// Samples of a pixel, of truth and contenders.
    pub sampling: Sampling,
    /// Camera steps of the popping test; 0 leaves it out.
    pub steps: u32,
}

impl Default for Plan {
    /// Four views of 256 to 4 pixels: under two minutes for a tree of 200,000 triangles.
    fn default() -> Self {
        Self {
            heights: vec![256, 64, 16, 4],
            views: 4,
            s_m: vec![0.5, 2.0, 8.0, 32.0, 128.0],
            shares: vec![0.3, 0.1, 0.03, 0.01, 0.003, 0.001, 0.0001],
            light: Light::Albedo,
            sampling: Sampling::TRUTH,
            steps: 12,
        }
    }
}

impl Plan {
    /// Sixteen views of 1024 to 4 pixels, thresholds in steps of two.
    pub fn full() -> Self {
        Self {
            heights: (2..=10).rev().map(|p| 1 << p).collect(),
            views: 16,
            s_m: (-2..=8).map(f64::from).map(f64::exp2).collect(),
            ..Self::default()
        }
    }

    /// `albedo` or `sun`.
    pub fn light_name(&self) -> &'static str {
        match self.light {
            Light::Albedo => "albedo",
            Light::Sun(_) => "sun",
        }
    }

    /// Checks the plan's rules.
    ///
    /// # Errors
    /// The first option that makes no sense, its value and the rule.
    pub fn check(&self) -> Result<(), EvalError> {
        let fail = |option, value, rule| Err(EvalError::Plan { option, value, rule });
        let heights = format!("{:?}", self.heights);
        if self.heights.is_empty() || self.heights.iter().any(|h| !(1..=4096).contains(h)) {
            return fail("--heights", heights, "numbers from 1 to 4096");
        }
        let descend = self.heights.windows(2).all(|w| w[0] > w[1]);
        if !descend || self.heights.iter().any(|h| !self.heights[0].is_multiple_of(*h)) {
            return fail("--heights", heights, "the largest first, and smaller divisors of it");
        }
        if !(1..=1024).contains(&self.views) {
            return fail("--views", self.views.to_string(), "from 1 to 1024");
        }
        if self.s_m.is_empty() || self.s_m.iter().any(|s| !(1e-6..=1e12).contains(s)) {
            let rule = "areas from 1e-6 to 1e12 square pixels";
            return fail("--s-m", format!("{:?}", self.s_m), rule);
        }
        if self.shares.is_empty() || self.shares.iter().any(|s| !(*s > 0.0 && *s <= 1.0)) {
            return fail("shares", format!("{:?}", self.shares), "above 0 and at most 1");
        }
        Ok(())
    }
}
