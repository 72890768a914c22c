//! What is judged: the pack, and other ways to draw the same tree with fewer primitives.

use forest_draw::{FoliageScene, ViewsLevel, VolumeScene, point_ellipses};
use forest_foliage::Wind;
use forest_points::{Cut, PixelArea, PointsBlock, Thresholds, select_into};
use forest_raster::{DisplayList, Ellipse, Picture, Style, Surfaces, draw, rasterize};
use forest_soup::{Camera, TriangleSoup};
use forest_views::Lookup;
use forest_volume::{Blending, Detail};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::time::Instant;

/// One way to draw a tree.
pub struct Contender<'a> {
    /// A short name.
    pub name: &'static str,
    /// What it is, in a sentence.
    pub what: &'static str,
    pub(crate) way: Way<'a>,
}

pub(crate) enum Way<'a> {
    /// Points through `select`.
    Points {
        block: &'a PointsBlock<'a>,
        surfaces: Option<&'a Surfaces>,
        /// k over s_m.
        bias: f64,
        look: Look,
    },
    /// All triangles of a pack.
    Triangles { block: &'a PointsBlock<'a>, surfaces: &'a Surfaces },
    /// A random part of the finest points, enlarged to keep their area.
    RandomPoints { block: &'a PointsBlock<'a> },
    /// Views, level by level, looked up in one way.
    Views { levels: &'a [ViewsLevel<'a>], lookup: Lookup },
    /// A volume, level by level.
    Volume { scene: &'a VolumeScene<'a>, only: Option<u32> },
    /// Foliage at rest, level by level.
    Foliage { scene: &'a FoliageScene<'a> },
    /// Levels of a mesh, finest first, with the share of triangles that each was asked for.
    Meshes { levels: &'a [(f64, Cow<'a, TriangleSoup>)], surfaces: &'a Surfaces },
}

/// How points are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Look {
    /// With their opacity.
    Translucent,
    /// Opaque and as much smaller.
    Opaque,
}

/// The setting of a quality knob.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Knob {
    /// Thresholds of a points pack, in square pixels.
    Points {
        /// Points smaller than this give way to their parent.
        s_m: f64,
        /// Points larger than this give way to triangles.
        s_max: f64,
        /// Depth bias.
        k: f64,
    },
    /// Share of the primitives that is asked for.
    Share(f64),
    /// A level of views.
    Views {
        /// Texels along the side of a whole tile.
        texels: u32,
        /// How views are looked up.
        lookup: ViewsLookup,
    },
    /// A level of foliage.
    Foliage {
        /// Its number; 0 is the finest.
        level: u32,
    },
    /// A level of a volume.
    Volume {
        /// Its number; 0 is the root.
        level: u32,
    },
}

/// How a picture is made of views: [`forest_views::Lookup`], as reports name it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ViewsLookup {
    /// The nearest view.
    Nearest,
    /// Three views, by their shares.
    Blend,
    /// Three views, through their depth.
    Depth,
}

impl From<Lookup> for ViewsLookup {
    fn from(lookup: Lookup) -> Self {
        match lookup {
            Lookup::Nearest => Self::Nearest,
            Lookup::Blend => Self::Blend,
            Lookup::Depth => Self::Depth,
        }
    }
}

impl Knob {
    /// The setting that means the same cut for a parallel camera under which the tree is `factor`
    /// times as high.
    pub(crate) fn nearer(self, factor: f64) -> Self {
        match self {
            Knob::Points { s_m, s_max, k } => {
                let area = factor * factor;
                Knob::Points { s_m: s_m * area, s_max: s_max * area, k: k * area }
            }
            other => other,
        }
    }

    /// As `select` of points wants it; `None` for others.
    pub fn thresholds(&self) -> Option<Thresholds> {
        match *self {
            Knob::Points { s_m, s_max, k } => Some(Thresholds {
                finest: PixelArea(s_m),
                largest: PixelArea(s_max),
                depth_bias: PixelArea(k),
            }),
            Knob::Share(_) | Knob::Views { .. } | Knob::Volume { .. } | Knob::Foliage { .. } => {
                None
            }
        }
    }
}

/// What a picture cost.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Cost {
    /// Points, triangles, views and billboards drawn.
    pub primitives: f64,
    /// Bytes of records that a renderer looks at to draw them.
    pub bytes: f64,
    /// Time of `select` in nanoseconds (the median of five); null where nothing is selected.
    pub select_ns: Option<f64>,
    /// Time of the picture in milliseconds, by the renderer that the report names; in the first view
    /// only, null in the others.
    pub render_ms: Option<f64>,
}

/// Bytes of a triangle in an indexed mesh: three 32-bit indices and, at half a vertex a triangle,
/// position, normal and texture coordinates of 32 bytes.
const MESH_TRIANGLE_BYTES: f64 = 12.0 + 16.0;

impl Contender<'_> {
    /// Of a volume, looks at one level only.
    pub fn only_level(&mut self, level: u32) {
        if let Way::Volume { only, .. } = &mut self.way {
            *only = Some(level);
        }
    }

    /// The knob's settings for the sweep's values of s_m and shares, finest first.
    pub(crate) fn knobs(&self, s_m: &[f64], shares: &[f64]) -> Vec<Knob> {
        match &self.way {
            Way::Points { bias, .. } => s_m
                .iter()
                .map(|&s| Knob::Points {
                    s_m: s,
                    s_max: Thresholds::LARGEST_RATIO * s,
                    k: bias * s,
                })
                .collect(),
            Way::Triangles { .. } => vec![Knob::Points { s_m: 0.0, s_max: 0.0, k: 0.0 }],
            Way::Views { levels, lookup } => levels
                .iter()
                .map(|l| Knob::Views { texels: l.side(), lookup: (*lookup).into() })
                .collect(),
            Way::Volume { scene, only } => {
                let levels = 0..scene.block().header.levels.len() as u32;
                let levels = only.map_or(levels, |level| level..level + 1);
                levels.rev().map(|level| Knob::Volume { level }).collect()
            }
            Way::Foliage { scene } => {
                let levels = 0..scene.block().header.levels.len() as u32;
                levels.map(|level| Knob::Foliage { level }).collect()
            }
            Way::RandomPoints { .. } => shares.iter().map(|&s| Knob::Share(s)).collect(),
            Way::Meshes { levels, .. } => levels.iter().map(|l| Knob::Share(l.0)).collect(),
        }
    }

    /// Draws with `knob`, one of [`Contender::knobs`].
    pub(crate) fn draw(&self, camera: &Camera, knob: Knob, style: &Style) -> (Picture, Cost) {
        match (&self.way, knob) {
            (Way::Points { block, surfaces, look, .. }, knob) => {
                let thresholds = knob.thresholds().expect("points have thresholds");
                draw_points(block, *surfaces, camera, thresholds, *look, style)
            }
            (Way::Triangles { block, surfaces }, _) => {
                let (all, look) = (Thresholds::TRIANGLES, Look::Translucent);
                draw_points(block, Some(*surfaces), camera, all, look, style)
            }
            (Way::RandomPoints { block }, Knob::Share(share)) => {
                draw_random(block, camera, share, style)
            }
            (Way::Meshes { levels, surfaces }, Knob::Share(share)) => {
                let (_, soup) = levels.iter().find(|l| l.0 == share).expect("a level");
                let primitives = soup.triangles.len() as f64;
                let cost = Cost {
                    primitives,
                    bytes: primitives * MESH_TRIANGLE_BYTES,
                    select_ns: None,
                    render_ms: None,
                };
                (rasterize(soup, surfaces, camera, style), cost)
            }
            (Way::Views { levels, lookup }, Knob::Views { texels, .. }) => {
                let level = levels.iter().find(|l| l.side() == texels).expect("a level");
                let (picture, drawn) = level.draw(camera, *lookup, style);
                let (primitives, bytes) = (drawn.views as f64, drawn.bytes as f64);
                (picture, Cost { primitives, bytes, select_ns: None, render_ms: None })
            }
            (Way::Volume { scene, .. }, Knob::Volume { level }) => {
                let detail = Detail::Level(level);
                let (picture, drawn) =
                    scene.draw(camera, detail, Blending::Shares, Style::from(style.sampling));
                let (primitives, bytes) = (drawn.billboards as f64, drawn.bytes);
                (picture, Cost { primitives, bytes, select_ns: None, render_ms: None })
            }
            (Way::Foliage { scene }, Knob::Foliage { level }) => {
                let level = level as usize;
                let picture = scene.draw(camera, level, &Wind::default(), style);
                let (primitives, bytes) = scene.cost(level);
                (picture, Cost { primitives, bytes, select_ns: None, render_ms: None })
            }
            _ => unreachable!("a contender is drawn with its own knobs"),
        }
    }
}

/// Median of five runs into a warm cut.
fn select_ns(block: &PointsBlock, camera: &Camera, t: &Thresholds) -> f64 {
    let mut cut = Cut::default();
    select_into(block, camera, t, &mut cut);
    let mut runs: Vec<u128> = (0..5)
        .map(|_| {
            let start = Instant::now();
            select_into(block, camera, t, &mut cut);
            start.elapsed().as_nanos()
        })
        .collect();
    runs.sort_unstable();
    runs[2] as f64
}

fn draw_points(
    block: &PointsBlock,
    surfaces: Option<&Surfaces>,
    camera: &Camera,
    thresholds: Thresholds,
    look: Look,
    style: &Style,
) -> (Picture, Cost) {
    let mut frame =
        forest_draw::PointsFrame::new(block, surfaces, camera, &thresholds, style, None);
    if look == Look::Opaque {
        frame.ellipses().iter_mut().for_each(make_opaque);
    }
    let (drawn, bytes) = (frame.drawn(), frame.bytes() as f64);
    let primitives = drawn.primitives() as f64;
    let select_ns = Some(select_ns(block, camera, &thresholds));
    (frame.draw(), Cost { primitives, bytes, select_ns, render_ms: None })
}

/// The same projected area without translucency.
fn make_opaque(e: &mut Ellipse) {
    e.radius *= (f64::from(e.opacity) / 255.0).sqrt();
    e.opacity = u8::MAX;
}

/// R. Cook, J. Halstead, M. Planck, D. Ryu, "Stochastic simplification of aggregate detail",
/// SIGGRAPH 2007, without its colour correction: keep a random `share`, scale areas by its inverse.
fn draw_random(block: &PointsBlock, camera: &Camera, share: f64, style: &Style) -> (Picture, Cost) {
    let all = Thresholds {
        finest: PixelArea(0.0),
        largest: PixelArea(f64::INFINITY),
        depth_bias: PixelArea(0.0),
    };
    let cut = forest_points::select(block, camera, &all);
    // A stable order of chance: every smaller share is a part of every larger one.
    let mut ellipses = point_ellipses(block, &cut, camera, style, None, &|id| chance(id) < share);
    ellipses.iter_mut().for_each(|e| e.radius /= share.sqrt());
    let primitives = ellipses.len() as f64;
    let bytes = primitives * size_of::<forest_points::PointRecord>() as f64;
    let picture = draw(&DisplayList::of_ellipses(ellipses), camera, style);
    (picture, Cost { primitives, bytes, select_ns: None, render_ms: None })
}

/// A number in `0..1` for each id, far from that of the hash rule of opacity.
fn chance(id: u32) -> f64 {
    let mut v =
        u64::from(id).wrapping_add(0x9e37_79b9_7f4a_7c15).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    v = (v ^ v >> 31).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((v ^ v >> 29) >> 11) as f64 / (1u64 << 53) as f64
}
