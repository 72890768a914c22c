//! What to draw for a camera: which level, which views, and the square that shows them.

use crate::block::ViewsBlock;
use crate::codec::Channel;
use crate::directions::Blend;
use forest_pack::kind;
use forest_pack::measures::{ErrorKind, Light, Need};
use forest_soup::{Camera, Projection};
use glam::{DVec3, IVec2};
use serde::{Deserialize, Serialize};

/// Numbers for the hash rule: which view shows a sample.
pub const PICK: u32 = 0x7669_6577;
/// Whether its texel covers it.
pub const COVER: u32 = 0x636f_7672;

/// How a picture is made of views.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Lookup {
    /// The view whose direction is nearest (paper 001, section 3.4).
    Nearest,
    /// The three views around, each with its share of the samples (their future work).
    Blend,
    /// As blend, and in each view the ray is followed to where the view's depth says that it meets
    /// the tree (the z-field of Bruneton and Neyret 2012).
    Depth,
}

impl Lookup {
    /// All ways, the cheapest first.
    pub const ALL: [Self; 3] = [Self::Nearest, Self::Blend, Self::Depth];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Nearest => "nearest",
            Self::Blend => "blend",
            Self::Depth => "depth",
        }
    }
}

/// What to draw.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Selection {
    /// The level: an index into the header's.
    pub level: usize,
    /// Views and their shares.
    pub views: Blend,
}

/// The coarsest level whose texels are at most `texel` pixels wide, and the views that `lookup`
/// takes, for a block that `camera` sees. Without depth in the pack [`Lookup::Depth`] is
/// [`Lookup::Blend`].
pub fn select(block: &ViewsBlock, camera: &Camera, lookup: Lookup, texel: f64) -> Selection {
    let distance = (block.center() - camera.eye).dot(camera.forward).max(f64::MIN_POSITIVE);
    let pixels = 2.0 * block.header.half * camera.pixels_per_unit(distance);
    let fine = |l: &&crate::header::LevelHeader| pixels / f64::from(l.texels) <= texel;
    let level = block.header.levels.iter().take_while(fine).count().max(1) - 1;
    Selection { level, views: views(block, camera, lookup) }
}

/// The views that `lookup` takes for `camera`, and their shares; those without any are not looked at.
pub fn views(block: &ViewsBlock, camera: &Camera, lookup: Lookup) -> Blend {
    let from = camera.to_eye(block.center());
    match lookup {
        Lookup::Nearest => [(block.directions().nearest(from), 1.0), (0, 0.0), (0, 0.0)],
        Lookup::Blend => block.directions().blend(from),
        // Those without a share are still asked for what the others do not see: along a baked direction one
        // view has all of it, and rays of a perspective camera pass behind what it sees.
        Lookup::Depth => block.directions().blend(from).map(|(v, s)| (v, s.max(ASKED_LAST))),
    }
}

/// Share of a view that is asked last.
const ASKED_LAST: f32 = 1e-6;

impl ViewsBlock<'_> {
    /// Stored bytes of a view's tile in the channels that `lookup` reads; base colours need no light.
    pub fn tile_bytes(&self, level: usize, view: u32, lookup: Lookup) -> u64 {
        let reads = |c: &Channel| {
            matches!((c, lookup), (Channel::Color, _) | (Channel::Depth, Lookup::Depth))
        };
        let block: u64 = Channel::ALL
            .into_iter()
            .filter(|c| self.header.channels.has(*c) && reads(c))
            .map(|c| c.block_bytes(self.header.quality))
            .sum();
        let t = &self.tiles[level][view as usize];
        u64::from(t.width / 4) * u64::from(t.height / 4) * block
    }

    /// First and last pixel of the box around all that `level` shows to `camera`: around the ball that
    /// holds the source, and the texels at its edge, which are blurred by their width.
    pub fn pixels(&self, camera: &Camera, level: usize) -> (IVec2, IVec2) {
        let texel = 2.0 * self.header.half / f64::from(self.header.levels[level].texels);
        ball_pixels(camera, self.center(), self.header.radius + 2.0 * texel)
    }

    /// What a pack's measured table is to be asked for this block before `camera`, under base
    /// colours.
    pub fn need(&self, camera: &Camera, error: ErrorKind) -> Need {
        let bounds = self.header.bounds.map(|b| self.center() + DVec3::from_array(b));
        let (height, elevation) = camera.sees(bounds);
        Need {
            representation: kind::VIEWS_HEADER,
            pixel_height: height as f32,
            elevation: Some(elevation as f32),
            light: Light::Albedo,
            error,
        }
    }
}

/// First and last pixel of the box around a ball's picture.
fn ball_pixels(camera: &Camera, center: DVec3, radius: f64) -> (IVec2, IVec2) {
    let to = center - camera.eye;
    let (depth, aside) = (to.dot(camera.forward), [to.dot(camera.right), -to.dot(camera.up)]);
    let middle = [camera.width, camera.height].map(|n| f64::from(n) * 0.5);
    let scale = camera.pixels_per_unit(1.0);
    let ends = |k: usize| match camera.projection {
        Projection::Orthographic { .. } => {
            Some([aside[k] - radius, aside[k] + radius].map(|v| middle[k] + v * scale))
        }
        // The angles of the two tangents in the plane of this axis.
        Projection::Perspective { .. } => {
            let (angle, distance) = (aside[k].atan2(depth), aside[k].hypot(depth));
            let half = (radius / distance).min(1.0).asin();
            let seen = distance > radius && angle.abs() + half < std::f64::consts::FRAC_PI_2;
            seen.then(|| [angle - half, angle + half].map(|a| middle[k] + a.tan() * scale))
        }
    };
    match (ends(0), ends(1)) {
        (Some(x), Some(y)) => {
            let pixel = |i: usize| IVec2::new(x[i].floor() as i32, y[i].floor() as i32);
            (pixel(0), pixel(1))
        }
        // Around the eye, or reaching behind it: anywhere.
        _ if depth > -radius => (IVec2::MIN, IVec2::MAX),
        _ => (IVec2::ONE, IVec2::ZERO),
    }
}
