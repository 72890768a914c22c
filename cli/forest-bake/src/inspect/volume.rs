//! What is in a volume.

use crate::output;
use forest_volume::{Coding, VolumeBlock};
use serde::Serialize;
use std::fmt::Write;

/// Lengths are world units.
#[derive(Serialize)]
pub(super) struct VolumeReport {
    min: [f64; 3],
    max: [f64; 3],
    branching: String,
    /// Side of the root cell.
    side: f64,
    cameras: usize,
    /// Texels along the side of a billboard.
    texels: u32,
    coding: String,
    /// Bits a billboard, without the atlas.
    billboard_bits: u32,
    atlas_bytes: u64,
    /// From the root down.
    levels: Vec<LevelReport>,
}

#[derive(Serialize)]
struct LevelReport {
    nodes: u32,
    billboards: u32,
}

impl VolumeReport {
    pub(super) fn of(block: &VolumeBlock) -> Self {
        let h = &block.header;
        let [min, max] = h.bounds;
        Self {
            min,
            max,
            branching: format!("{:?}", h.branching).to_lowercase(),
            side: h.side,
            cameras: h.cameras.len(),
            texels: h.texels,
            coding: match h.coding {
                Coding::Texels => "texels".into(),
                Coding::Codebook { colors, alphas, block } => {
                    let stored = if block { "BC3" } else { "RGBA" };
                    format!("{colors} colour and {alphas} alpha codewords, {stored}")
                }
            },
            billboard_bits: h.coding.billboard_bits(h.billboard_texels()),
            atlas_bytes: h.coding.atlas_bytes(h.texels),
            levels: h
                .levels
                .iter()
                .map(|l| LevelReport { nodes: l.nodes, billboards: l.billboards })
                .collect(),
        }
    }

    pub(super) fn text(&self, t: &mut String) -> std::fmt::Result {
        writeln!(t, "volume")?;
        writeln!(t, "  cells               {}, {:.3} wide", self.branching, self.side)?;
        writeln!(t, "  cameras             {}", self.cameras)?;
        writeln!(t, "  billboards          {}² texels, {}", self.texels, self.coding)?;
        let atlas = output::bytes(self.atlas_bytes);
        writeln!(t, "  bits a billboard    {}, and an atlas of {atlas}", self.billboard_bits)?;
        for (i, l) in self.levels.iter().enumerate() {
            let [nodes, billboards] = [l.nodes, l.billboards].map(|n| output::count(n.into()));
            writeln!(t, "  level {i}             {nodes} nodes, {billboards} billboards")?;
        }
        Ok(())
    }
}
