//! The tree that a pack was baked from, drawn on the CPU: what levels are compared with.

use anyhow::Result;
use forest_import::{Block, Limits};
use forest_raster::{Light, Picture, RayScene, Sampling, Style, Surfaces, rasterize};
use forest_soup::{Camera, TriangleSoup};
use std::path::Path;

/// A tree and its materials.
#[derive(Debug)]
pub(crate) struct Truth {
    soup: TriangleSoup,
    surfaces: Surfaces,
    /// The sun casts shadows.
    shadows: bool,
}

impl Truth {
    /// Reads a tree, or a block of several (.toml). `shadows` says whether what it is compared with has any.
    pub(crate) fn load(path: &Path, max_triangles: u64, shadows: bool) -> Result<Self> {
        let block = Block::parse(&[path.to_string_lossy()])?;
        let loaded = block.load(&Limits::default())?;
        let soup = loaded.model.flatten(max_triangles)?;
        let surfaces = Surfaces::new(&soup.materials, &soup.textures);
        Ok(Self { soup, surfaces, shadows })
    }

    /// The tree as `camera` sees it.
    pub(crate) fn picture(&self, camera: &Camera, light: &Light, side: u32) -> Picture {
        let style = Style { sampling: Sampling { side, seed: 1 }, light: *light };
        if self.shadows && matches!(light, Light::Sun(_)) {
            return RayScene::new(&self.soup, &self.surfaces).picture(camera, &style);
        }
        rasterize(&self.soup, &self.surfaces, camera, &style)
    }
}
