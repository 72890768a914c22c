//! The foliage representation: its meshes, bent by the wind.

use forest_foliage::{FoliageBlock, Posed, VertexRecord, Wind};
use forest_pack::PackError;
use forest_raster::{Light, Picture, ShadowMap, Style, Surfaces, rasterize, rasterize_shadowed};
use forest_soup::{Camera, Material, Texture, TriangleSoup};
use std::sync::Arc;

/// A pack's foliage with its materials, ready to be drawn.
#[derive(Clone, Debug)]
pub struct FoliageScene<'a> {
    block: &'a FoliageBlock<'a>,
    materials: Vec<Material>,
    textures: Vec<Arc<Texture>>,
    surfaces: Surfaces,
}

impl<'a> FoliageScene<'a> {
    /// Reads and decodes materials and the dictionary.
    ///
    /// # Errors
    /// When a section is missing or damaged.
    pub fn read(block: &'a FoliageBlock<'a>) -> Result<Self, PackError> {
        let (materials, textures) = block.materials()?;
        let surfaces = Surfaces::new(&materials, &textures);
        Ok(Self { block, materials, textures, surfaces })
    }

    /// The foliage.
    pub fn block(&self) -> &'a FoliageBlock<'a> {
        self.block
    }

    /// A level as a soup, as `camera` sees it in `wind`.
    pub fn soup(&self, camera: &Camera, level: usize, wind: &Wind) -> TriangleSoup {
        let posed = (wind.strength > 0.0).then(|| Posed::new(self.block, wind, 0.0, camera.eye));
        self.block.soup(level, posed, &self.materials, &self.textures)
    }

    /// Draws a level as `camera` sees it in `wind`: under a sun with the shadows of its own map, and what
    /// lies on cards as leaves that face all ways (docs/LIGHT.md).
    pub fn draw(&self, camera: &Camera, level: usize, wind: &Wind, style: &Style) -> Picture {
        let soup = self.soup(camera, level, wind);
        let Light::Sun(sun) = style.light else {
            return rasterize(&soup, &self.surfaces, camera, style);
        };
        let map = ShadowMap::new(&soup, &self.surfaces, self.block.bounds(), sun.to_sun);
        rasterize_shadowed(&soup, &self.surfaces, camera, style, Arc::new(map))
    }

    /// Triangles of a level, and bytes of its vertices and indices.
    pub fn cost(&self, level: usize) -> (f64, f64) {
        let header = &self.block.header.levels[level];
        let triangles = header.triangles() as f64;
        let vertices = f64::from(header.vertices) * size_of::<VertexRecord>() as f64;
        (triangles, vertices + 12.0 * triangles)
    }
}
