//! A species of a scene: a pack, and how its trees stand.

use crate::error::SceneError;
use forest_pack::Pack;
use forest_points::{PixelArea, PointsBlock, Thresholds, select, spheroid, within_budget};
use forest_soup::{Camera, Projection};
use forest_views::ViewsBlock;
use glam::{DVec3, Vec3};

/// What all trees of a species have in common.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stance {
    /// Where the pack's tree touches the ground, in the pack's world.
    pub anchor: DVec3,
    /// Metres in a unit of the pack.
    pub unit: f64,
    /// Least and largest scale of trees.
    pub scale: [f64; 2],
    /// Box about the tree of scale 1, in metres from the anchor.
    pub bounds: [DVec3; 2],
}

impl Stance {
    /// That of a block. `height` is that of its box in metres (without: a unit is a metre). Without
    /// `anchor` it is the pack's zero if that lies in its box, else the middle of the box's bottom.
    pub fn new(
        block: &PointsBlock,
        height: Option<f64>,
        anchor: Option<[f64; 3]>,
        scale: [f64; 2],
    ) -> Self {
        let [min, max] =
            [block.header.min, block.header.max].map(|v| block.to_world(DVec3::from_array(v)));
        let is_in = min.cmple(DVec3::ZERO).all() && max.cmpge(DVec3::ZERO).all();
        let usual = match is_in {
            true => DVec3::ZERO,
            false => DVec3::new((min.x + max.x) * 0.5, min.y, (min.z + max.z) * 0.5),
        };
        let anchor = anchor.map_or(usual, DVec3::from_array);
        let tall = (max.y - min.y).max(f64::MIN_POSITIVE);
        let unit = height.map_or(1.0, |h| h / tall);
        let bounds = [(min - anchor) * unit, (max - anchor) * unit];
        Self { anchor, unit, scale, bounds }
    }

    /// Radius about the anchor that holds the tree of scale 1, in metres.
    pub fn reach(&self) -> f64 {
        let [min, max] = self.bounds;
        min.abs().max(max.abs()).length()
    }
}

/// A few large points that stand for a tree where only its shadow is asked for.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Canopy {
    /// The points.
    pub points: Vec<CanopyPoint>,
}

/// A point of a [`Canopy`], at scale 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CanopyPoint {
    /// Metres from the anchor.
    pub off: Vec3,
    /// Radius in metres.
    pub radius: f32,
    /// Optical depth times the area it is spread over, in square metres: −ln(1 − opacity) times the
    /// mean projected area.
    pub thickness: f32,
    /// Optical depth through it: −ln(1 − opacity).
    pub depth: f32,
}

/// What is behind more than this is not told apart from what is behind all.
const MOST_OPACITY: f64 = 0.98;

impl Canopy {
    /// No canopy has more points.
    pub const MOST: u64 = 256;

    /// At most `most` points of a block, the finest such cut.
    pub fn new(block: &PointsBlock, stance: &Stance, most: u64) -> Self {
        let (camera, thresholds) = cut(block, most.min(Self::MOST));
        let cut = select(block, &camera, &thresholds);
        let points = cut.points(block).map(|(_, cell, p)| {
            let place = block.to_world(block.position(cell, p.position));
            let radius = block.radius(p) * block.scale() * stance.unit;
            let opacity = p.opacity().min(MOST_OPACITY);
            let area = spheroid::mean_projected_area(radius, p.flatness_step(), 1.0);
            let depth = -(1.0 - opacity).ln();
            CanopyPoint {
                off: ((place - stance.anchor) * stance.unit).as_vec3(),
                radius: radius as f32,
                thickness: (depth * area) as f32,
                depth: depth as f32,
            }
        });
        Self { points: points.collect() }
    }

    /// Area of the smallest points that any canopy of a block has, in square world units of the pack: what
    /// light asks of it.
    pub fn finest_area(block: &PointsBlock) -> f64 {
        let (camera, thresholds) = cut(block, Self::MOST);
        let pixels = camera.pixels_per_unit(1.0);
        thresholds.finest.0 / (pixels * pixels)
    }

    /// Optical depth that a leaf has before it on the mean within its own point: light falls on a layer
    /// of depth t by the mean of e^−x for x from 0 to t. What a map of larger texels cannot show.
    pub fn clump(&self) -> f64 {
        let part = |t: f64| if t > 1e-6 { (1.0 - (-t).exp()) / t } else { 1.0 };
        let weight = |p: &CanopyPoint| f64::from(p.thickness);
        let all: f64 = self.points.iter().map(weight).sum();
        let lit: f64 = self.points.iter().map(|p| weight(p) * part(p.depth.into())).sum();
        if all > 0.0 { -(lit / all).ln() } else { 0.0 }
    }
}

/// The finest cut of at most so many points, without triangles.
fn cut(block: &PointsBlock, most: u64) -> (Camera, Thresholds) {
    let size = block.half_diagonal() * 2.0;
    let projection = Projection::Orthographic { height: size };
    // Seen from anywhere: without perspective all cells are cut alike.
    let eye = block.middle() + DVec3::Z * size;
    let camera = Camera::new(eye, -DVec3::Z, projection, [1024, 1024]);
    let coarsest = Thresholds {
        finest: PixelArea(f64::INFINITY),
        largest: PixelArea(f64::INFINITY),
        depth_bias: PixelArea(0.0),
    };
    let found = within_budget(block, &camera, f64::INFINITY, most);
    let thresholds = found.map_or(coarsest, |(thresholds, _)| thresholds);
    (camera, thresholds)
}

/// A species as it is opened.
#[derive(Debug)]
pub struct Species {
    /// The pack.
    pub pack: Pack,
    /// How its trees stand.
    pub stance: Stance,
}

impl Species {
    /// The points of its pack.
    ///
    /// # Errors
    /// When the pack has none, or they are damaged.
    pub fn points(&self) -> Result<PointsBlock<'_>, SceneError> {
        Ok(PointsBlock::open(&self.pack)?)
    }

    /// The views of its pack, if there are any.
    ///
    /// # Errors
    /// When they are damaged.
    pub fn views(&self) -> Result<Option<ViewsBlock<'_>>, SceneError> {
        let there = ViewsBlock::is_in(&self.pack).then(|| ViewsBlock::open(&self.pack));
        Ok(there.transpose()?)
    }
}
