//! What is in foliage.

use crate::output;
use forest_foliage::{FoliageBlock, WoodWay};
use serde::Serialize;
use std::fmt::Write;

/// Lengths are world units.
#[derive(Serialize)]
pub(super) struct FoliageReport {
    min: [f64; 3],
    max: [f64; 3],
    /// Triangles of the source's wood and leaves.
    source_triangles: [u64; 2],
    /// Trunk, its branches, theirs, all others.
    branches: [u32; 4],
    /// Branches that bend by themselves.
    wind_branches: u32,
    /// Texels across and down the dictionary.
    dictionary: [u32; 2],
    /// In BC7 blocks, else RGBA.
    blocks: bool,
    /// Finest first.
    levels: Vec<LevelReport>,
}

#[derive(Serialize)]
struct LevelReport {
    texel: f64,
    vertices: u32,
    triangles: u64,
    /// tubes or simplified.
    wood: String,
    tubes: u32,
    sheets: u32,
    cards: u32,
    hidden: u32,
}

impl FoliageReport {
    pub(super) fn of(block: &FoliageBlock) -> Self {
        let h = &block.header;
        let [min, max] = block.bounds().map(|p| p.to_array());
        Self {
            min,
            max,
            source_triangles: h.source,
            branches: h.branches,
            wind_branches: h.wind,
            dictionary: h.atlas,
            blocks: h.blocks,
            levels: h
                .levels
                .iter()
                .map(|l| LevelReport {
                    texel: l.texel,
                    vertices: l.vertices,
                    triangles: l.triangles(),
                    wood: match l.wood {
                        WoodWay::Tubes => "tubes".into(),
                        WoodWay::Simplified => "simplified".into(),
                    },
                    tubes: l.tubes,
                    sheets: l.sheets,
                    cards: l.cards,
                    hidden: l.hidden,
                })
                .collect(),
        }
    }

    pub(super) fn text(&self, t: &mut String) -> std::fmt::Result {
        let [wood, leaves] = self.source_triangles.map(output::count);
        let [trunk, first, second, more] = self.branches;
        let [w, h] = self.dictionary;
        writeln!(t, "foliage")?;
        writeln!(t, "  source triangles    {wood} of wood, {leaves} of leaves")?;
        writeln!(t, "  branches            {trunk} + {first} + {second} + {more} by order")?;
        writeln!(t, "  bent by wind        {}", output::count(self.wind_branches.into()))?;
        writeln!(
            t,
            "  dictionary          {w} × {h} texels, {}",
            if self.blocks { "BC7" } else { "RGBA" }
        )?;
        for (i, l) in self.levels.iter().enumerate() {
            writeln!(
                t,
                "  level {i}             texel {:.4}, {} triangles: {} branches ({}), {} sheets, {} cards, {} \
                 hidden",
                l.texel,
                output::count(l.triangles),
                l.tubes,
                l.wood,
                l.sheets,
                l.cards,
                l.hidden
            )?;
        }
        Ok(())
    }
}
