//! The view and the light: the same opacity maps as our renderer's.

use anyhow::{Result, bail};
use bytemuck::{Pod, Zeroable};
use forest_raster::Light;
use forest_scene::{OpacityMap, Sky};
use forest_soup::{Camera, Projection};
use glam::DVec3;

/// Nearest distance that is drawn, in metres.
const NEAR: f32 = 0.05;

/// `LightMap` of common.wgsl.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct MapUniform {
    light: [f32; 3],
    texel: f32,
    corner: [f32; 2],
    size: [u32; 2],
    low: f32,
    steps: f32,
    zero: [u32; 2],
}

impl MapUniform {
    pub(crate) fn new(map: &OpacityMap) -> Self {
        let [low, high] = map.heights;
        Self {
            light: map.to_light.as_vec3().to_array(),
            texel: map.texel as f32,
            corner: map.corner.map(|v| v as f32),
            size: map.size,
            low: low as f32,
            steps: (f64::from(u16::MAX) / (high - low)) as f32,
            zero: [0; 2],
        }
    }
}

/// `View` of common.wgsl.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct ViewUniform {
    right: [f32; 3],
    wide: f32,
    up: [f32; 3],
    tall: f32,
    forward: [f32; 3],
    near: f32,
    eye: [f32; 3],
    zero: f32,
    eye_rest: [f32; 3],
    translucency: f32,
    to_sun: [f32; 3],
    zero1: f32,
    sun: [f32; 3],
    zero2: f32,
    sky: [f32; 3],
    zero3: f32,
    horizon: [f32; 3],
    zero4: f32,
    zenith: [f32; 3],
    zero5: f32,
    maps: [MapUniform; 2],
}

impl ViewUniform {
    /// # Errors
    /// For a parallel camera.
    pub(crate) fn new(
        camera: &Camera,
        light: &Light,
        sky: &Sky,
        maps: [MapUniform; 2],
    ) -> Result<Self> {
        let Projection::Perspective { fov_y } = camera.projection else {
            bail!("peers draw in perspective only");
        };
        let Light::Sun(sun) = light else { bail!("peers draw in sunlight only") };
        let tall = 1.0 / (fov_y * 0.5).tan();
        let vector = |v: DVec3| v.as_vec3().to_array();
        let eye = camera.eye.as_vec3();
        Ok(Self {
            right: vector(camera.right),
            wide: (tall * f64::from(camera.height) / f64::from(camera.width)) as f32,
            up: vector(camera.up),
            tall: tall as f32,
            forward: vector(camera.forward),
            near: NEAR,
            eye: eye.to_array(),
            eye_rest: vector(camera.eye - eye.as_dvec3()),
            translucency: sun.translucency,
            to_sun: vector(sun.to_sun),
            sun: sun.sun,
            sky: sun.sky,
            horizon: sky.horizon,
            zenith: sky.zenith,
            maps,
            ..Self::zeroed()
        })
    }
}
