//! What to draw for a camera: which level, which views, and the square that shows them.

use crate::block::ViewsBlock;
use crate::directions::Blend;
use forest_pack::kind;
use forest_pack::measures::{ErrorKind, Light, Need};
use forest_soup::Camera;
use serde::{Deserialize, Serialize};

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

/// The views that `lookup` takes for `camera`, and their shares.
pub fn views(block: &ViewsBlock, camera: &Camera, lookup: Lookup) -> Blend {
    let from = camera.to_eye(block.center());
    match lookup {
        Lookup::Nearest => [(block.directions().nearest(from), 1.0), (0, 0.0), (0, 0.0)],
        Lookup::Blend | Lookup::Depth => block.directions().blend(from),
    }
}

impl ViewsBlock<'_> {
    /// What a pack's measured table is to be asked for this block before `camera`, under base
    /// colours.
    pub fn need(&self, camera: &Camera, error: ErrorKind) -> Need {
        let distance = (self.center() - camera.eye).dot(camera.forward).max(f64::MIN_POSITIVE);
        let [min, max] = self.header.bounds;
        let longest = (0..3).map(|k| max[k] - min[k]).fold(0.0, f64::max);
        let to_eye = camera.to_eye(self.center());
        Need {
            representation: kind::VIEWS_HEADER,
            pixel_height: (longest * camera.pixels_per_unit(distance)) as f32,
            elevation: Some(to_eye.y.clamp(-1.0, 1.0).asin().to_degrees() as f32),
            light: Light::Albedo,
            error,
        }
    }
}
