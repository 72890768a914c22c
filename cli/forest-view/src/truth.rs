//! The tree that a pack was baked from, drawn on the CPU: what levels are compared with.

use anyhow::Result;
use forest_import::{Block, Limits};
use forest_raster::{Light, Picture, Sampling, Style, Surfaces, rasterize};
use forest_soup::{Camera, TriangleSoup};
use std::path::Path;

/// A tree and its materials.
#[derive(Debug)]
pub(crate) struct Truth {
    soup: TriangleSoup,
    surfaces: Surfaces,
}

impl Truth {
    /// Reads a tree, or a block of several (.toml).
    pub(crate) fn load(path: &Path, max_triangles: u64) -> Result<Self> {
        let block = Block::parse(&[path.to_string_lossy()])?;
        let loaded = block.load(&Limits::default())?;
        let soup = loaded.model.flatten(max_triangles)?;
        let surfaces = Surfaces::new(&soup.materials, &soup.textures);
        Ok(Self { soup, surfaces })
    }

    /// The tree as `camera` sees it.
    pub(crate) fn picture(&self, camera: &Camera, light: &Light, side: u32) -> Picture {
        let style = Style { sampling: Sampling { side, seed: 1 }, light: *light };
        rasterize(&self.soup, &self.surfaces, camera, &style)
    }
}
