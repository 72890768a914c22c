//! What a picture is made of: the camera, the light, and the layers.

use crate::shade::ShadeModel;
use bytemuck::{Pod, Zeroable};
use forest_foliage::{CrownLight, Sway, Wind};
use forest_points::Thresholds;
use forest_raster::Light;
use forest_soup::{Camera, Projection};
use forest_views::Lookup;
use forest_volume::{Blending, Detail};
use glam::DVec3;

/// A picture to be drawn.
#[derive(Clone, Debug)]
pub struct Frame<'a> {
    /// From where, with the size of the target in pixels; levels are chosen for these.
    pub camera: Camera,
    /// The light. Foliage has a shadow map; the others have the estimate of [`forest_raster::Sun::seen`], with
    /// the shares of the pack's [`CrownLight`] if it knows them. Volumes are base colours, and lit, if it
    /// does; else they are in the light of their photographs.
    pub light: Light,
    /// The wind that foliage stands in.
    pub wind: Wind,
    /// What is drawn; layers with fades share the samples of the picture.
    pub layers: &'a [Layer],
}

/// A level of a representation, or a part of its samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layer {
    /// What is drawn.
    pub what: What,
    /// The share of all samples it is drawn on, as a range within 0 … 1. Two levels fade into each
    /// other as `[0, t]` and `[t, 1]`: each sample shows one of them, so that nothing is covered
    /// twice and there are no holes.
    pub fade: [f32; 2],
}

/// A level of a representation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum What {
    /// Points, and triangles where points would be too large.
    Points(Thresholds),
    /// Views of a level: an index into the header's.
    Views(usize, Lookup),
    /// A volume.
    Volume(Detail, Blending),
    /// Foliage of a level: an index into the header's.
    Foliage(usize),
}

impl Layer {
    /// All of it.
    pub fn whole(what: What) -> Self {
        Self { what, fade: [0.0, 1.0] }
    }
}

/// The block that a picture shows, as the camera needs it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stage {
    /// Middle of the source's box.
    pub(crate) middle: DVec3,
    pub(crate) half_diagonal: f64,
}

/// Half the diagonal of a block without extent is taken for this: shaders divide by it.
const LEAST_SIZE: f64 = 1e-30;

/// `Frame` of common.wgsl.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct FrameUniform {
    right: [f32; 3],
    scale: f32,
    down: [f32; 3],
    parallel: u32,
    forward: [f32; 3],
    near: f32,
    size: [f32; 2],
    depth: [f32; 2],
    to_sun: [f32; 3],
    lit: u32,
    sun: [f32; 3],
    translucency: f32,
    sky: [f32; 3],
    darkest: f32,
    middle: [f32; 3],
    half_diagonal: f32,
    lean: [f32; 2],
    foot: f32,
    bends: u32,
    root: [f32; 3],
    relit: u32,
    crown: [f32; 2],
    zero: [f32; 2],
    shade_low: [f32; 3],
    shade_scale: f32,
}

impl FrameUniform {
    /// `camera` must have the size of the samples.
    pub(crate) fn new(camera: &Camera, light: &Light, stage: &Stage) -> Self {
        let vector = |v: DVec3| v.as_vec3().to_array();
        let parallel = matches!(camera.projection, Projection::Orthographic { .. });
        let off = stage.middle - camera.eye;
        let half_diagonal = stage.half_diagonal.max(LEAST_SIZE);
        // A parallel camera sees a tree's length before and behind it.
        let reach = 4.0 * half_diagonal;
        // Nothing of the tree is nearer. OpenGL, which stretches 0 … 1 to −1 … 1, rounds what is far
        // behind this to one depth.
        let near = (1e-6 * half_diagonal).max(off.dot(camera.forward) - 1.5 * half_diagonal);
        let nearest = off.dot(camera.forward) - reach;
        let mut u = Self {
            right: vector(camera.right),
            scale: camera.pixels_per_unit(1.0) as f32,
            down: vector(-camera.up),
            parallel: parallel.into(),
            forward: vector(camera.forward),
            near: near as f32,
            size: [camera.width as f32, camera.height as f32],
            depth: [nearest as f32, (0.5 / reach) as f32],
            half_diagonal: half_diagonal as f32,
            middle: vector(off),
            darkest: 1.0,
            crown: [1.0; 2],
            ..Self::zeroed()
        };
        if let Light::Sun(sun) = light {
            u.lit = 1;
            u.to_sun = vector(sun.to_sun);
            u.sun = sun.sun;
            u.translucency = sun.translucency;
            u.sky = sun.sky;
            u.darkest = sun.darkest;
        }
        u
    }
}

impl FrameUniform {
    /// Of a block that leans before `camera`; its foot is in the world.
    pub(crate) fn with_sway(self, sway: &Sway, camera: &Camera) -> Self {
        let foot = (f64::from(sway.foot) - camera.eye.y) as f32;
        Self { lean: sway.lean.to_array(), foot, ..self }
    }

    /// Of a crown before `camera`, whose middle sees it in direction `to_eye`, under the sun of `shade`.
    pub(crate) fn with_crown(
        self,
        crown: &CrownLight,
        shade: &ShadeModel,
        to_eye: DVec3,
        camera: &Camera,
    ) -> Self {
        let seen = [crown.sunlit(shade.to_sun, to_eye), crown.skylit(to_eye)];
        let shade_low = (shade.low - camera.eye).as_vec3().to_array();
        let shade_scale = (1.0 / shade.cell) as f32;
        Self { crown: seen, relit: 1, shade_low, shade_scale, ..self }
    }

    /// Of points that bend with branches whose zero is `root` in the world.
    pub(crate) fn with_branches(self, root: DVec3, camera: &Camera) -> Self {
        Self { bends: 1, root: (root - camera.eye).as_vec3().to_array(), ..self }
    }

    /// Of a parallel camera: the depth that is 1 in the depth buffer, and the range behind it.
    pub(crate) fn range(&self) -> [f32; 2] {
        [self.depth[0], 1.0 / self.depth[1]]
    }

    /// With another nearest distance.
    pub(crate) fn with_near(self, near: f64) -> Self {
        Self { near: near as f32, ..self }
    }
}

/// The camera with `side` times as many pixels along each side.
pub(crate) fn supersampled(camera: &Camera, side: u32) -> Camera {
    Camera { width: camera.width * side, height: camera.height * side, ..*camera }
}
