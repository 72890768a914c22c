//! The volume representation: billboards of cells, sorted and blended.

use crate::lit::Lit;
use forest_foliage::Gain;
use forest_pack::PackError;
use forest_raster::{Layer, Picture, composite};
use forest_soup::{Camera, srgb8_to_linear};
use forest_volume::{
    Blending, CameraShare, Detail, Item, LEAST_THROUGH, Selection, VolumeBlock, select,
};
use glam::{DVec2, DVec3, IVec2};

/// What a picture of a volume took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VolumeDrawn {
    /// Cells of the cut.
    pub cells: u64,
    /// Billboards drawn.
    pub billboards: u64,
    /// Bytes of these billboards' codes and of the atlas.
    pub bytes: f64,
}

/// A pack's volume, decoded.
#[derive(Clone, Debug)]
pub struct VolumeScene<'a> {
    block: &'a VolumeBlock<'a>,
    /// Of each level.
    texels: Vec<Vec<[u8; 4]>>,
}

impl<'a> VolumeScene<'a> {
    /// Reads and decodes all billboards.
    ///
    /// # Errors
    /// When a section is damaged.
    pub fn read(block: &'a VolumeBlock<'a>) -> Result<Self, PackError> {
        Ok(Self { block, texels: block.texels()? })
    }

    /// The volume.
    pub fn block(&self) -> &'a VolumeBlock<'a> {
        self.block
    }

    /// Draws the tree as `camera` sees it. Under a sun it is lit as leaves that face all ways
    /// ([`forest_raster::scattered`]), by the estimate of [`forest_raster::Sun::seen`]; what was made of
    /// photographs has their light in it, and is drawn as it is ([`forest_raster::Light::Albedo`]).
    pub fn draw<'l>(
        &self,
        camera: &Camera,
        detail: Detail,
        blending: Blending,
        lit: impl Into<Lit<'l>>,
    ) -> (Picture, VolumeDrawn) {
        let lit = lit.into();
        let selection = select(self.block, camera, detail);
        let layers: Vec<Billboard> = selection
            .items
            .iter()
            .filter_map(|item| self.layer(camera, &selection, item, blending, &lit))
            .collect();
        let billboards = layers.iter().map(|l| l.faces.iter().flatten().count() as u64).sum();
        let header = &self.block.header;
        let bytes = billboards as f64 * self.block.billboard_bytes()
            + header.coding.atlas_bytes(header.texels) as f64;
        let drawn = VolumeDrawn { cells: selection.items.len() as u64, billboards, bytes };
        (composite(&layers, camera, lit.style.sampling), drawn)
    }

    fn layer(
        &self,
        camera: &Camera,
        selection: &Selection,
        item: &Item,
        blending: Blending,
        lit: &Lit,
    ) -> Option<Billboard<'_>> {
        let lattice = self.block.lattice();
        let node = &self.block.nodes[item.level as usize][item.node as usize];
        let center = lattice.center(item.level, node.place());
        let (x, y, depth) = camera.project(center);
        let [min, max] = self.block.header.bounds.map(DVec3::from_array);
        let (middle, half_diagonal) = (0.5 * (min + max), 0.5 * min.distance(max));
        let [sunlit, skylit] = lit.seen(center, middle, half_diagonal, Gain::VOLUME);
        let scale = camera.pixels_per_unit(depth);
        let mut faces = [None; 2];
        for (face, chosen) in faces.iter_mut().zip(&selection.cameras) {
            *face = self.face(camera, chosen, item, scale);
        }
        let reach = faces.iter().flatten().fold(DVec2::ZERO, |r, f| r.max(f.reach));
        faces.iter().any(Option::is_some).then_some(Billboard {
            at: DVec2::new(x, y),
            depth,
            reach,
            faces,
            texels: self.block.header.texels,
            weight: item.weight,
            blending,
            light: lit.style.light.scattered(camera.to_eye(center), sunlit, skylit),
        })
    }

    /// A camera's billboard of a cell, where a world unit takes `scale` pixels.
    fn face(
        &self,
        camera: &Camera,
        chosen: &CameraShare,
        item: &Item,
        scale: f64,
    ) -> Option<Face<'_>> {
        let header = &self.block.header;
        let number = self.block.billboard(item.level as usize, item.node, chosen.camera)?;
        let t2 = header.billboard_texels();
        let texels = &self.texels[item.level as usize][number as usize * t2..][..t2];
        let side = self.block.lattice().cell_side(item.level);
        let half = header.cameras[chosen.camera as usize].half_size(side).map(|h| h * scale);
        let pixels = |v: DVec3| DVec2::new(v.dot(camera.right), -v.dot(camera.up));
        let (right, down) = (pixels(chosen.right), -pixels(chosen.up));
        let texel = 0.5 * f64::from(header.texels);
        Some(Face {
            texels,
            share: chosen.share,
            across: right * (texel / half[0]),
            down: down * (texel / half[1]),
            reach: right.abs() * half[0] + down.abs() * half[1],
        })
    }
}

/// A camera's billboard on the picture.
#[derive(Clone, Copy, Debug)]
struct Face<'a> {
    texels: &'a [[u8; 4]],
    share: f32,
    /// Texels to the right, and down, for each pixel.
    across: DVec2,
    down: DVec2,
    /// Half the box around it, in pixels.
    reach: DVec2,
}

impl Face<'_> {
    /// Premultiplied linear RGBA `off` pixels from the middle.
    #[inline]
    fn sample(&self, off: DVec2, side: u32) -> [f32; 4] {
        let half = 0.5 * f64::from(side);
        let (x, y) = (half + off.dot(self.across), half + off.dot(self.down));
        // A sample on the edge that two billboards share must not fall between them by rounding.
        let inside = -EDGE..f64::from(side) + EDGE;
        if !(inside.contains(&x) && inside.contains(&y)) {
            return [0.0; 4];
        }
        // `as` makes 0 of what is below.
        let [x, y] = [x, y].map(|v| (v as u32).min(side - 1));
        let [r, g, b, a] = self.texels[(y * side + x) as usize];
        let alpha = f32::from(a) * (1.0 / 255.0);
        let [r, g, b] = [r, g, b].map(|c| srgb8_to_linear(c) * alpha);
        [r, g, b, alpha]
    }
}

/// How far out of a billboard, in texels, a sample still is on its edge.
const EDGE: f64 = 1e-6;

/// A cell on the picture.
struct Billboard<'a> {
    at: DVec2,
    depth: f64,
    reach: DVec2,
    faces: [Option<Face<'a>>; 2],
    texels: u32,
    weight: f32,
    blending: Blending,
    /// Factors on its colour.
    light: [f32; 3],
}

impl Layer for Billboard<'_> {
    fn pixels(&self) -> (IVec2, IVec2) {
        let pixel = |v: DVec2| v.floor().as_ivec2();
        (pixel(self.at - self.reach), pixel(self.at + self.reach))
    }

    fn depth(&self) -> f64 {
        self.depth
    }

    #[inline]
    fn sample(&self, x: f64, y: f64) -> [f32; 4] {
        let off = DVec2::new(x, y) - self.at;
        let mut color = [0.0f32; 4];
        match self.blending {
            Blending::Shares => {
                let mut shares = 0.0;
                for face in self.faces.iter().flatten() {
                    let sample = face.sample(off, self.texels);
                    shares += face.share;
                    color.iter_mut().zip(sample).for_each(|(c, s)| *c += face.share * s);
                }
                color = color.map(|c| c / shares);
            }
            Blending::Over => {
                for face in self.faces.iter().flatten() {
                    let through = 1.0 - color[3];
                    let sample = face.sample(off, self.texels);
                    color.iter_mut().zip(sample).for_each(|(c, s)| *c += through * face.share * s);
                }
            }
        }
        if self.weight < 1.0 && color[3] > 0.0 {
            let alpha = 1.0 - (1.0 - color[3]).max(LEAST_THROUGH).powf(self.weight);
            let scale = alpha / color[3];
            color = color.map(|c| c * scale);
        }
        color.iter_mut().zip(self.light).for_each(|(c, l)| *c *= l);
        color
    }
}
