//! What to draw for a camera: which cells, in which order, and the cameras whose billboards show them.

use crate::block::VolumeBlock;
use crate::header::NodeRecord;
use forest_soup::{Camera, Projection};
use glam::{DQuat, DVec3, UVec3};

/// How fine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Detail {
    /// All cells of one level, 0 is the root; where the tree ends above it, what is there.
    Level(u32),
    /// By planes upright to the view (paper 004, section 3.1): cells before a level's plane are
    /// drawn finer, those behind it by their parent.
    Planes {
        /// Width in pixels that texels of billboards have at most.
        texel: f64,
        /// Share of a plane's distance, before and behind it, over which a cell and its children
        /// are faded into each other; 0 … 1.
        fade: f64,
    },
}

impl Detail {
    /// Texels of a pixel, faded over a tenth of the distance.
    pub const PIXEL: Self = Self::Planes { texel: 1.0, fade: Self::FADE };

    /// The share over which levels are faded if nothing else is asked for.
    pub const FADE: f64 = 0.1;
}

/// How the billboards of two cameras make one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Blending {
    /// Their mean by the cameras' shares; what one of them does not know is the other's alone.
    Shares,
    /// One over the other, each made as much more transparent as its share is smaller (paper 004,
    /// section 2.1). Two that show the same hide less than one of them.
    Over,
}

/// A camera whose billboards are drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraShare {
    /// Its number.
    pub camera: u32,
    /// Its share; those of a selection add up to 1.
    pub share: f32,
    /// To the right of its billboards as they are drawn: parallel to the picture.
    pub right: DVec3,
    /// To the top of its billboards.
    pub up: DVec3,
}

/// A node to draw.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Item {
    /// Its level.
    pub level: u32,
    /// Its number there.
    pub node: u32,
    /// Above 0 and at most 1. What a node of opacity o leaves through is (1 − o)^weight: a cell and
    /// its children, whose weights add up to 1, hide together what one of them would.
    pub weight: f32,
}

/// What a fading opaque texel lets through at least, before it fades: else it would not.
pub const LEAST_THROUGH: f32 = 1.0 / 256.0;

/// What to draw.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Selection {
    /// One or two cameras, the nearest first.
    pub cameras: Vec<CameraShare>,
    /// Nodes, from back to front.
    pub items: Vec<Item>,
}

/// The nodes that represent the volume to `camera`, and the cameras of the bake to show them. Along
/// every way from the root to a leaf of the tree the weights add up to 1, but for cells nearer than
/// four of their sides to a perspective eye, which fade, and what is behind it. The order is exact for
/// every camera, also within the volume: no cell hides one that is drawn after it.
pub fn select(block: &VolumeBlock, camera: &Camera, detail: Detail) -> Selection {
    let mut selection = Selection::default();
    select_into(block, camera, detail, &mut selection);
    selection
}

/// As [`select`], into a selection that is kept from frame to frame: its items are allocated once.
pub fn select_into(
    block: &VolumeBlock,
    camera: &Camera,
    detail: Detail,
    selection: &mut Selection,
) {
    let mut items = std::mem::take(&mut selection.items);
    items.clear();
    let mut walk = Walk {
        block,
        camera,
        planes: planes(block, camera, detail),
        fade: match detail {
            Detail::Planes { fade, .. } => fade.clamp(0.0, 1.0),
            Detail::Level(_) => 0.0,
        },
        items,
    };
    walk.node(0, 0, 1.0);
    *selection = Selection { cameras: nearest_cameras(block, camera), items: walk.items };
}

/// For each level the distance along the camera's axis from which its texels are fine enough;
/// infinite and falling from the root down for parallel cameras and fixed levels.
pub fn planes(block: &VolumeBlock, camera: &Camera, detail: Detail) -> Vec<f64> {
    let lattice = block.lattice();
    (0..block.header.levels.len() as u32)
        .map(|level| match detail {
            Detail::Level(wanted) => {
                if level < wanted {
                    f64::INFINITY
                } else {
                    f64::NEG_INFINITY
                }
            }
            Detail::Planes { texel, .. } => {
                let width = lattice.cell_side(level) / f64::from(block.header.texels);
                match camera.projection {
                    Projection::Orthographic { .. } => {
                        let fine = width * camera.pixels_per_unit(1.0) <= texel;
                        if fine { f64::NEG_INFINITY } else { f64::INFINITY }
                    }
                    Projection::Perspective { .. } => camera.pixels_per_unit(1.0) * width / texel,
                }
            }
        })
        .collect()
}

/// The two cameras whose directions are nearest to the viewer's, with the weights of C. Buehler et
/// al., "Unstructured lumigraph rendering" (2001), section 3.2: the angle's inverse, less what the
/// third nearest would have. So shares change without a step when the viewer moves, also where
/// another camera becomes the second.
fn nearest_cameras(block: &VolumeBlock, camera: &Camera) -> Vec<CameraShare> {
    let header = &block.header;
    let [low, high] = header.bounds.map(DVec3::from_array);
    let (middle, radius) = ((low + high) * 0.5, 0.5 * low.distance(high));
    let to_viewer = match camera.projection {
        // Within the tree no direction is the tree's: the axis is the picture's.
        Projection::Perspective { .. } if camera.eye.distance(middle) > radius => {
            (camera.eye - middle).normalize()
        }
        _ => -camera.forward,
    };
    let mut order: Vec<(f64, u32)> = (0..)
        .zip(&header.cameras)
        .map(|(i, c)| (c.axes()[2].angle_between(to_viewer), i))
        .collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let third = order.get(2).map_or(f64::INFINITY, |c| c.0);
    let weight = |angle: f64| {
        let near = 1.0 / angle.max(1e-6);
        if third.is_finite() { (near - 1.0 / third.max(1e-6)).max(0.0) } else { near }
    };
    let weights: Vec<f64> = order.iter().take(2).map(|c| weight(c.0)).collect();
    let sum: f64 = weights.iter().sum();
    // Three at one angle have no weight: the first takes all.
    let share = |i: usize| if sum > 0.0 { weights[i] / sum } else { f64::from(u8::from(i == 0)) };
    let back = -camera.forward;
    let shown = (0..weights.len()).map(|i| {
        let [right, up, from] = header.cameras[order[i].1 as usize].axes();
        let turn = DQuat::from_rotation_arc(from, back);
        let share = share(i) as f32;
        CameraShare { camera: order[i].1, share, right: turn * right, up: turn * up }
    });
    shown.filter(|c| c.share > 0.0).collect()
}

/// Weight of a cell by its distance along the axis, in its sides: billboards around the eye, huge
/// and blurred, fade away as it passes through them.
fn near_fade(sides: f64) -> f32 {
    ((sides - 1.0) / 3.0).clamp(0.0, 1.0) as f32
}

struct Walk<'a> {
    block: &'a VolumeBlock<'a>,
    camera: &'a Camera,
    planes: Vec<f64>,
    fade: f64,
    items: Vec<Item>,
}

impl Walk<'_> {
    fn node(&mut self, level: u32, number: u32, weight: f32) {
        let node = self.block.nodes[level as usize][number as usize];
        let lattice = self.block.lattice();
        let center = lattice.center(level, node.place());
        let depth = (center - self.camera.eye).dot(self.camera.forward);
        let reach = 0.5 * lattice.cell_side(level) * self.camera.forward.abs().element_sum();
        let perspective = matches!(self.camera.projection, Projection::Perspective { .. });
        if perspective && depth + reach <= 0.0 {
            return;
        }
        let own = match node.children {
            0 => 1.0,
            _ => self.share(level, depth),
        };
        let near = match self.camera.projection {
            Projection::Orthographic { .. } => 1.0,
            Projection::Perspective { .. } => near_fade(depth / lattice.cell_side(level)),
        };
        if own * near > 0.0 {
            self.items.push(Item { level, node: number, weight: weight * own * near });
        }
        if own < 1.0 {
            self.children(level, node, center, weight * (1.0 - own));
        }
    }

    /// Share of a node, the rest being its children's: 1 behind its level's plane.
    fn share(&self, level: u32, depth: f64) -> f32 {
        let plane = self.planes[level as usize];
        let band = plane * self.fade;
        if !plane.is_finite() || band <= 0.0 {
            return if depth >= plane { 1.0 } else { 0.0 };
        }
        let t = ((depth - plane) / (2.0 * band) + 0.5).clamp(0.0, 1.0);
        (t * t * (3.0 - 2.0 * t)) as f32
    }

    /// Children from back to front: along each axis, slabs farther from the eye's own first. A box
    /// can only be hidden by one on the eye's side of a plane between them.
    fn children(&mut self, level: u32, node: NodeRecord, center: DVec3, weight: f32) {
        let branching = self.block.header.branching;
        let f = branching.factor();
        let side = self.block.lattice().cell_side(level);
        let orders: [[u32; 3]; 3] = std::array::from_fn(|k| {
            let eye = match self.camera.projection {
                Projection::Orthographic { .. } if self.camera.forward[k] > 0.0 => -1.0,
                Projection::Orthographic { .. } => f64::INFINITY,
                Projection::Perspective { .. } => {
                    ((self.camera.eye[k] - center[k]) / side + 0.5) * f64::from(f)
                }
            };
            // `as` saturates: an eye outside is in the nearest slab.
            let slab = (eye as u32).min(f - 1);
            let mut order = [0u32, 1, 2];
            order[..f as usize].sort_by_key(|i| std::cmp::Reverse(i.abs_diff(slab)));
            order
        });
        let slabs = |k: usize| orders[k].into_iter().take(f as usize);
        for z in slabs(2) {
            for y in slabs(1) {
                for x in slabs(0) {
                    let child = branching.child(UVec3::new(x, y, z));
                    if node.children >> child & 1 == 1 {
                        let before = (node.children & ((1 << child) - 1)).count_ones();
                        self.node(level + 1, node.first_child + before, weight);
                    }
                }
            }
        }
    }
}
