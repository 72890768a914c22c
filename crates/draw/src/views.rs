//! The views representation: a square of samples, each a ray through one to three views.

use crate::lit::Lit;
use forest_foliage::Gain;
use forest_pack::PackError;
use forest_raster::{DisplayList, Picture, Sprite, SpriteHit, covers, draw};
use forest_soup::{Camera, Projection};
use forest_views::{
    Blend, COVER, Found, Hit, Lookup, PICK, Ray, Texels, ViewSampler, ViewsBlock, views,
};
use glam::{DVec3, IVec2};
use std::sync::Arc;

/// One level of a pack's views, decoded.
#[derive(Clone, Debug)]
pub struct ViewsLevel<'a> {
    block: &'a ViewsBlock<'a>,
    level: usize,
    texels: Texels,
}

/// What a picture of views took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ViewsDrawn {
    /// Views that were looked at.
    pub views: u64,
    /// Stored bytes of their tiles, in the channels that the look-up reads.
    pub bytes: u64,
}

impl<'a> ViewsLevel<'a> {
    /// Reads and decodes `level`, an index into the header's.
    ///
    /// # Errors
    /// When a section is damaged.
    pub fn read(block: &'a ViewsBlock<'a>, level: usize) -> Result<Self, PackError> {
        Ok(Self { block, level, texels: block.texels(level)? })
    }

    /// The views.
    pub fn block(&self) -> &'a ViewsBlock<'a> {
        self.block
    }

    /// Texels along the side of a whole tile.
    pub fn side(&self) -> u32 {
        self.block.header.levels[self.level].texels
    }

    /// Draws the tree as `camera` sees it.
    pub fn draw<'l>(
        &self,
        camera: &Camera,
        lookup: Lookup,
        lit: impl Into<Lit<'l>>,
    ) -> (Picture, ViewsDrawn) {
        let lit = lit.into();
        let chosen = views(self.block, camera, lookup);
        let impostor = Arc::new(Impostor::new(self, camera, lookup, chosen, lit));
        let mut list = DisplayList::default();
        list.sprite(impostor);
        (draw(&list, camera, &lit.style), self.drawn(lookup, &chosen))
    }

    fn drawn(&self, lookup: Lookup, chosen: &Blend) -> ViewsDrawn {
        let used = chosen.iter().filter(|v| v.1 > 0.0);
        let bytes = used.clone().map(|v| self.block.tile_bytes(self.level, v.0, lookup)).sum();
        ViewsDrawn { views: used.count() as u64, bytes }
    }
}

/// A tree as its views show it to one camera.
#[derive(Debug)]
struct Impostor<'a> {
    camera: &'a Camera,
    lookup: Lookup,
    views: Vec<(ViewSampler<'a>, f32)>,
    /// World units in half a tile.
    half: f64,
    /// From the centre of the tiles to the eye, in units of half a tile.
    eye: DVec3,
    pixels: (IVec2, IVec2),
    /// Depth of the front of the ball that holds the tree.
    nearest: f64,
    lit: Lit<'a>,
    half_diagonal: f64,
    center: DVec3,
    /// The views know what they see of the sky.
    own_sky: bool,
}

impl<'a> Impostor<'a> {
    fn new(
        level: &'a ViewsLevel,
        camera: &'a Camera,
        lookup: Lookup,
        chosen: Blend,
        lit: Lit<'a>,
    ) -> Self {
        let header = &level.block.header;
        let center = level.block.center();
        let lookup = match lookup {
            Lookup::Depth if !header.channels.depth => Lookup::Blend,
            other => other,
        };
        let sampler = |&(view, share): &(u32, f32)| {
            (ViewSampler::new(level.block, &level.texels, level.level, view), share)
        };
        let depth = (center - camera.eye).dot(camera.forward);
        Self {
            camera,
            lookup,
            views: chosen.iter().filter(|v| v.1 > 0.0).map(sampler).collect(),
            half: header.half,
            eye: (camera.eye - center) / header.half,
            pixels: level.block.pixels(camera, level.level),
            nearest: depth - header.radius,
            lit,
            half_diagonal: level.block.half_diagonal(),
            center,
            own_sky: header.channels.sky,
        }
    }

    /// The ray of picture coordinates (x, y).
    fn ray(&self, x: f64, y: f64) -> Ray {
        let camera = self.camera;
        let right = x - f64::from(camera.width) * 0.5;
        let up = f64::from(camera.height) * 0.5 - y;
        let aside = (camera.right * right + camera.up * up) / camera.pixels_per_unit(1.0);
        match camera.projection {
            Projection::Orthographic { .. } => {
                let origin = self.eye + aside / self.half;
                Ray { origin, direction: camera.forward, from: f64::NEG_INFINITY }
            }
            Projection::Perspective { .. } => {
                let direction = (camera.forward + aside).normalize();
                Ray { origin: self.eye, direction, from: 0.0 }
            }
        }
    }

    /// The views in the order that a sample asks them: drawn by their shares, the others after it.
    fn order(&self, grid: (u32, u32)) -> impl Iterator<Item = &ViewSampler<'a>> {
        let mut left = uniform(PICK, grid);
        let all: f32 = self.views.iter().map(|v| v.1).sum();
        let first = self.views.iter().position(|v| {
            left -= v.1 / all;
            left < 0.0
        });
        let first = first.unwrap_or(self.views.len().saturating_sub(1));
        let (before, after) = self.views.split_at(first);
        after.iter().chain(before).map(|v| &v.0)
    }

    fn find(&self, ray: &Ray, grid: (u32, u32)) -> Option<Hit> {
        if self.lookup != Lookup::Depth {
            let found = self.order(grid).next()?.at_plane(ray);
            let Found::Hit(hit) = found else { return None };
            let opacity = (hit.alpha * 255.0).round() as u8;
            return covers(COVER, grid.0, grid.1, opacity).then_some(hit);
        }
        let threshold = uniform(COVER, grid);
        let mut asked: Vec<&ViewSampler> = Vec::with_capacity(self.views.len());
        for view in self.order(grid) {
            match view.along_depth(ray, threshold) {
                // What lies where another view saw nothing is not there.
                Found::Hit(hit) => {
                    let unseen = |v: &&ViewSampler| v.hides(ray, hit.distance, threshold);
                    return asked.iter().all(unseen).then_some(hit);
                }
                Found::Empty => return None,
                // Another view may see what this one does not.
                Found::Hidden => asked.push(view),
            }
        }
        None
    }
}

/// A number in `0..1` for each sample, by the hash rule of opacity.
fn uniform(id: u32, (x, y): (u32, u32)) -> f32 {
    forest_raster::sample_hash(id, x, y)
}

impl Sprite for Impostor<'_> {
    fn pixels(&self) -> (IVec2, IVec2) {
        self.pixels
    }

    fn nearest(&self) -> f64 {
        self.nearest
    }

    fn sample(&self, x: f64, y: f64, grid: (u32, u32)) -> Option<SpriteHit> {
        let ray = self.ray(x, y);
        let hit = self.find(&ray, grid)?;
        let at = ray.origin + ray.direction * hit.distance;
        let depth = ((at - self.eye) * self.half).dot(self.camera.forward);
        let perspective = matches!(self.camera.projection, Projection::Perspective { .. });
        if perspective && depth <= 0.0 {
            return None;
        }
        // On the side that is seen: views a few degrees off may see the other.
        let normal = hit.normal;
        let normal = if normal.dot(ray.direction) > 0.0 { -normal } else { normal };
        let place = self.center + at * self.half;
        let [sunlit, skylit] = self.lit.seen(place, self.center, self.half_diagonal, Gain::VIEWS);
        let sky = if self.own_sky { hit.sky } else { skylit };
        let scattered = self.lit.all_ways();
        Some(SpriteHit { depth, rgb: hit.rgb, normal: normal.as_vec3(), scattered, sunlit, sky })
    }
}
