//! Which trees of a landscape are drawn by views instead of points, and by which level of them.

use crate::species::Stance;
use forest_points::PixelArea;
use forest_views::{Dome, ViewsBlock};
use glam::DVec3;
use std::f64::consts::TAU;
use std::ops::Range;

/// Pixels along the side of the smallest tile that is drawn; smaller trees are a few points.
pub const LEAST_IMPOSTOR: f64 = 4.0;

/// Views are all there is of a tree up to so much of the size at which they are as fine as points; from
/// there on points take over.
pub const IMPOSTOR_FADE: f64 = 0.8;

/// Levels are drawn of up to so many times the pixels at which views differ by one.
const FINER: f64 = 3.0;

/// The views of a species as its trees are drawn by them.
#[derive(Clone, Debug, PartialEq)]
pub struct Impostor {
    /// Middle of the tiles, in metres from the foot of a tree of scale 1.
    pub center: DVec3,
    /// Side of a tile in metres, of a tree of scale 1.
    pub side: f64,
    /// Texels along the side of a tile of the finest level that is drawn.
    pub texels: u32,
    /// Pixels along the side of a tile at which what lies a quarter of it before its middle moves by a
    /// pixel between a direction and the nearest view.
    pub apart: f64,
    /// The levels that are drawn: none much finer than views differ, none smaller than an impostor.
    pub levels: Range<usize>,
}

impl Impostor {
    /// How trees of this stance are drawn by these views.
    pub fn new(views: &ViewsBlock, stance: &Stance) -> Self {
        let header = &views.header;
        let all = if views.directions().dome == Dome::Upper { TAU } else { 2.0 * TAU };
        let step = (all / f64::from(views.directions().count())).sqrt();
        let apart = 1.0 / (0.25 * 0.5 * step);
        let levels = &header.levels;
        let fits = levels.iter().position(|l| f64::from(l.texels) <= FINER * apart);
        let first = fits.unwrap_or(levels.len() - 1);
        let small = levels.iter().position(|l| f64::from(l.texels) < LEAST_IMPOSTOR);
        let end = small.unwrap_or(levels.len()).max(first + 1);
        Self {
            center: (views.center() - stance.anchor) * stance.unit,
            side: 2.0 * header.half * stance.unit,
            texels: levels[first].texels,
            apart,
            levels: first..end,
        }
    }

    /// Whether a tree of this scale is drawn by points, however small it is in the picture: its tile may
    /// hold an eye at this distance from its middle.
    pub fn is_within(&self, scale: f64, distance: f64) -> bool {
        distance < self.side * scale
    }

    /// Pixels along the side of a tile up to which it may be off by no more than one, with texels no
    /// larger than one, if the finest level has so many texels.
    pub fn most_pixels(&self, texels: u32) -> f64 {
        self.apart.min(texels.into())
    }

    /// Pixels along the side of a tile up to which a tree is drawn by views alone, and from which by none,
    /// where points have s_m of `finest` square pixels and the finest level so many texels: as large as
    /// texels and what views are off by are as large as points, times `impostors`.
    pub fn range(&self, texels: u32, finest: PixelArea, impostors: f64) -> [f64; 2] {
        let largest = self.most_pixels(texels) * finest.0.sqrt() * impostors;
        [IMPOSTOR_FADE * largest, largest]
    }
}
