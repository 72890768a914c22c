//! How bright leaves are: weights of sun and sky, fitted to rays with shadows.
//!
//! What lies on cards is lit as leaves that face all ways, where the shadow map says that the sun is seen,
//! and by the share of the sky that the card sees ([`forest_raster::scattered`]). Leaves of one card do not
//! shade each other, and those that are seen are not the mean of all: both are made good by one weight each,
//! for which the mean light of a few pictures is that of the truth (docs/LIGHT.md).

use crate::crown::CrownLight;
use crate::density::Density;
use forest_raster::{
    Light, Picture, RayScene, Sampling, ShadowMap, Style, Sun, Surfaces, rasterize,
    rasterize_shadowed,
};
use forest_soup::{Camera, Material, TriangleSoup, luminance};
use glam::DVec3;
use std::sync::Arc;

/// Suns, each with a view of its own.
const SUNS: u32 = 6;

/// Pixels of a picture's side, and samples along the side of a pixel.
const SIDE: u32 = 96;
const SAMPLES: u32 = 2;

/// Weights beyond these are not believed.
const WEIGHTS: std::ops::RangeInclusive<f64> = 0.25..=1.5;

/// Suns by which the light on crowns is fitted, all around the eye.
const CROWN_SUNS: u32 = 20;

/// Views by which the size of cards is fitted.
const COVER_VIEWS: u32 = 8;

/// The truth: light of pictures under each sun, and under the sky.
pub(crate) struct Brightness {
    bounds: [DVec3; 2],
    /// In sunlight, and in skylight.
    light: Vec<[f64; 2]>,
    /// Of all pictures together, in pixels.
    coverage: f64,
    crown: CrownLight,
}

/// Light of a picture in sunlight and in skylight: sums over its pixels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    pub(crate) to_sun: DVec3,
    pub(crate) to_eye: DVec3,
    /// With shadows.
    pub(crate) truth: [f64; 2],
    /// By what comes through the crown to each place.
    pub(crate) open: [f64; 2],
}

fn direction(yaw: f64, pitch: f64) -> DVec3 {
    let (yaw, pitch) = (yaw.to_radians(), pitch.to_radians());
    DVec3::new(yaw.sin() * pitch.cos(), pitch.sin(), yaw.cos() * pitch.cos())
}

fn setting(i: u32, bounds: [DVec3; 2]) -> (DVec3, Camera) {
    let pitch = if i.is_multiple_of(2) { 30.0 } else { 55.0 };
    let to_sun = direction(f64::from(i) * 360.0 / f64::from(SUNS), pitch);
    // Around the tree at another pace than the sun: from before it, beside it and behind it.
    (to_sun, Camera::around(bounds, [f64::from(i) * 107.0, 10.0], None, [SIDE; 2]))
}

/// As many suns as there may be at each angle from the eye, at several heights.
fn crown_setting(i: u32, bounds: [DVec3; 2]) -> (DVec3, Camera) {
    let (step, side) = (f64::from(i), if i.is_multiple_of(2) { 1.0 } else { -1.0 });
    let eye = [step * 107.0, [5.0, 15.0, 30.0, 50.0][i as usize % 4]];
    let around = side * step * 180.0 / f64::from(CROWN_SUNS - 1);
    let pitch = [20.0, 35.0, 60.0][i as usize % 3];
    (direction(eye[0] + around, pitch), Camera::around(bounds, eye, None, [SIDE; 2]))
}

/// In sunlight alone, in skylight alone.
fn styles(to_sun: DVec3) -> [Style; 2] {
    [[1.0, 0.0], [0.0, 1.0]].map(|[sun, sky]| {
        let (sun, sky) = ([sun; 3], [sky; 3]);
        let light = Light::Sun(Sun { to_sun, sun, sky, translucency: 1.0, darkest: 1.0 });
        Style { sampling: Sampling { side: SAMPLES, seed: 1 }, light }
    })
}

/// Views from which coverage is measured: as many from everywhere above the horizon.
fn cover_views(bounds: [DVec3; 2]) -> impl Iterator<Item = Camera> {
    (0..COVER_VIEWS).map(move |i| {
        let pitch = ((f64::from(i) + 0.5) / f64::from(COVER_VIEWS)).asin().to_degrees();
        Camera::around(bounds, [f64::from(i) * 137.5, pitch], None, [SIDE; 2])
    })
}

/// Pixels that a soup covers.
fn covered(soup: &TriangleSoup, surfaces: &Surfaces, camera: &Camera) -> f64 {
    let sampling = Sampling { side: SAMPLES, seed: 1 };
    let picture = rasterize(soup, surfaces, camera, &sampling.into());
    picture.pixels.iter().map(|p| f64::from(p[3])).sum()
}

fn mean(picture: &Picture) -> f64 {
    picture.pixels.iter().map(|p| f64::from(luminance([p[0], p[1], p[2]]))).sum()
}

/// [`mean`] of a picture of which a share `through` of the light comes through to each place.
fn mean_through(
    soup: &TriangleSoup,
    surfaces: &Surfaces,
    camera: &Camera,
    light: Light,
    through: &dyn Fn(DVec3) -> f64,
) -> f64 {
    // A sample for a pixel, whose place is known.
    let camera = Camera { width: SIDE * SAMPLES, height: SIDE * SAMPLES, ..*camera };
    let style = Style { sampling: Sampling::MIDDLE, light };
    let picture = rasterize(soup, surfaces, &camera, &style);
    let pixels = (0..).zip(picture.pixels.iter().zip(&picture.depth));
    let seen = pixels.filter(|(_, (_, depth))| depth.is_finite()).map(|(i, (p, depth))| {
        let [x, y] = [i % camera.width, i / camera.width].map(|v| f64::from(v) + 0.5);
        let place = camera.unproject(x, y, f64::from(*depth));
        f64::from(luminance([p[0], p[1], p[2]])) * through(place)
    });
    seen.sum::<f64>() / f64::from(SAMPLES * SAMPLES)
}

impl Brightness {
    /// Of `soup`, whose materials `surfaces` holds.
    pub(crate) fn of(soup: &TriangleSoup, surfaces: &Surfaces) -> Self {
        let bounds = soup.bounds();
        let bounds = [bounds.min, bounds.max].map(|p| soup.origin + p);
        let rays = RayScene::new(soup, surfaces);
        let truth = |(to_sun, camera): &(DVec3, Camera)| {
            styles(*to_sun).map(|style| mean(&rays.picture(camera, &style)))
        };
        // What is lit by them has the light's own translucency.
        let plain = |m: &Material| Material { translucency: 1.0, ..m.clone() };
        let plain: Vec<Material> = soup.materials.iter().map(plain).collect();
        let plain = Surfaces::new(&plain, &soup.textures);
        let density = Density::of(soup, surfaces);
        let crown = |i: u32| {
            let (to_sun, camera) = crown_setting(i, bounds);
            let shade = density.shade(to_sun);
            let [sun, sky] = styles(to_sun);
            let open = [(0, sun), (1, sky)].map(|(k, style)| {
                let through = |place| f64::from(shade.at(place)[k]);
                mean_through(soup, &plain, &camera, style.light, &through)
            });
            let to_eye = camera.to_eye(0.5 * (bounds[0] + bounds[1]));
            Sample { to_sun, to_eye, truth: truth(&(to_sun, camera)), open }
        };
        let views = cover_views(bounds);
        let coverage = views.map(|camera| covered(soup, surfaces, &camera)).sum();
        let samples: Vec<Sample> = (0..CROWN_SUNS).map(crown).collect();
        Self {
            bounds,
            coverage,
            light: (0..SUNS).map(|i| truth(&setting(i, bounds))).collect(),
            crown: CrownLight::fit(density, &samples),
        }
    }

    /// Coverage of the truth over that of `level`.
    pub(crate) fn coverage_over(&self, level: &TriangleSoup, surfaces: &Surfaces) -> f64 {
        let views = cover_views(self.bounds);
        self.coverage / views.map(|camera| covered(level, surfaces, &camera)).sum::<f64>()
    }

    /// The light on representations without shadow maps.
    pub(crate) fn crown(self) -> CrownLight {
        self.crown
    }

    /// Weights of sun and sky for the last of `level`'s materials, so that it is as bright in the mean.
    pub(crate) fn weights(&self, level: &mut TriangleSoup, surfaces: &Surfaces) -> [f64; 2] {
        let cards = |weight: f32, soup: &mut TriangleSoup| {
            let dictionary = soup.materials.len() as u16 - 1;
            let pairs = soup.triangles.iter().zip(&soup.triangle_materials);
            for v in pairs.filter(|(_, m)| **m == dictionary).flat_map(|(t, _)| t) {
                soup.sunlit[*v as usize] = weight;
            }
        };
        let skylit = level.skylit.clone();
        let (mut wood, mut all) = ([0.0; 2], [0.0; 2]);
        for (weight, sums) in [(0.0, &mut wood), (1.0, &mut all)] {
            cards(weight, level);
            level.skylit = skylit.iter().zip(&level.sunlit).map(|(s, w)| s * w).collect();
            for i in 0..SUNS {
                let (to_sun, camera) = setting(i, self.bounds);
                let map = Arc::new(ShadowMap::new(level, surfaces, self.bounds, to_sun));
                let [sun, sky] = styles(to_sun);
                let lit = rasterize_shadowed(level, surfaces, &camera, &sun, map);
                sums[0] += mean(&lit);
                sums[1] += mean(&rasterize(level, surfaces, &camera, &sky));
            }
        }
        level.skylit = skylit;
        [0, 1].map(|k| {
            let truth: f64 = self.light.iter().map(|l| l[k]).sum();
            let weight = (truth - wood[k]) / (all[k] - wood[k]);
            if weight.is_finite() { weight.clamp(*WEIGHTS.start(), *WEIGHTS.end()) } else { 1.0 }
        })
    }
}
