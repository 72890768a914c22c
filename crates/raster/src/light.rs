//! Light on surfaces: none, or a sun and a sky.

use glam::{DVec3, Vec3};
use std::f64::consts::PI;

/// What a picture shows of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum Light {
    /// Base colours as they are.
    #[default]
    Albedo,
    /// A sun and a uniform sky on matt surfaces.
    Sun(Sun),
}

/// A distant sun and a uniform sky.
///
/// A matt surface of base colour c and normal n (turned towards the eye) shows
/// c·(sun·(max(n·l, 0) + translucency·max(−n·l, 0))·V + sky·S). V is 1 where the sun is seen and S
/// the cosine-weighted share of the sky that is seen; pictures without shadows have both at 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sun {
    /// Unit vector towards the sun.
    pub to_sun: DVec3,
    /// Radiance that a white surface facing the sun shows: irradiance over π, linear RGB.
    pub sun: [f32; 3],
    /// Radiance of the sky, linear RGB.
    pub sky: [f32; 3],
    /// Share of the sunlight on the far side that shines through, in `0..=1`.
    pub translucency: f32,
    /// Estimated self-shadow of blocks of points: share of the sun at the side that is farthest from
    /// it, in `0..=1`; 1 for none. See [`Sun::seen`].
    pub darkest: f32,
}

impl Light {
    /// A high sun from the left, behind the camera's shoulder; leaves shine through.
    pub const MORNING: Self = Self::Sun(Sun {
        to_sun: DVec3::new(-0.48, 0.72, 0.501_199),
        sun: [0.55; 3],
        sky: [0.45; 3],
        translucency: 1.0,
        darkest: 1.0,
    });

    /// Factors on the base colour of a surface whose unit normal `normal` faces the eye, without
    /// shadows.
    pub fn unshadowed(&self, normal: Vec3) -> [f32; 3] {
        self.factors(normal, 1.0, 1.0)
    }

    /// The sun, if there is one.
    pub fn sun(&self) -> Option<&Sun> {
        match self {
            Light::Albedo => None,
            Light::Sun(sun) => Some(sun),
        }
    }

    /// [`Sun::seen`]; 1 without a sun.
    pub fn seen(&self, off: DVec3, half_diagonal: f64) -> f32 {
        match self {
            Light::Albedo => 1.0,
            Light::Sun(sun) => sun.seen(off, half_diagonal),
        }
    }

    /// Factors on the base colour of leaves that face all ways, seen along the unit vector `to_eye`, where a
    /// share `sunlit` of the sun and `skylit` of the sky is seen: [`scattered`].
    pub fn scattered(&self, to_eye: DVec3, sunlit: f32, skylit: f32) -> [f32; 3] {
        match self {
            Light::Albedo => [1.0; 3],
            Light::Sun(sun) => sun.scattered(to_eye, sunlit, skylit),
        }
    }

    /// Factors on a base colour where only a share `sunlit` of the sun and `skylit` of the sky is seen.
    pub fn factors(&self, normal: Vec3, sunlit: f32, skylit: f32) -> [f32; 3] {
        match self {
            Light::Albedo => [1.0; 3],
            Light::Sun(sun) => sun.factors(normal, sunlit, skylit),
        }
    }
}

impl Sun {
    /// Share of the sun that is estimated to be seen `off` from the middle of a block of this half
    /// diagonal (Gilet, Meyer, Neyret 2005, section 5.3: L_M = 1, L_m = [`Sun::darkest`]).
    ///
    /// As printed, L = L_M + (Z − 1)/2·(L_M − L_m) with their Z (−1 at the front, 1 at the back)
    /// darkens the side nearest to the light. Here Z is measured along the light, −1 where it comes
    /// in, and L = L_M − (Z + 1)/2·(L_M − L_m); it weighs the sunlight, the sky is not shadowed.
    pub fn seen(&self, off: DVec3, half_diagonal: f64) -> f32 {
        let half = half_diagonal.max(f64::MIN_POSITIVE);
        let z = (-off.dot(self.to_sun) / half).clamp(-1.0, 1.0) as f32;
        1.0 - 0.5 * (z + 1.0) * (1.0 - self.darkest)
    }

    /// Factors on the base colour of leaves that face all ways, seen along a unit vector to the eye.
    pub(crate) fn scattered(&self, to_eye: DVec3, sunlit: f32, skylit: f32) -> [f32; 3] {
        let cos = to_eye.dot(self.to_sun);
        let direct = scattered(cos, f64::from(self.translucency)) as f32 * sunlit;
        std::array::from_fn(|k| self.sun[k] * direct + self.sky[k] * skylit)
    }

    /// The light on a surface that has this share of its translucency.
    pub(crate) fn through(&self, share: f32) -> Self {
        Self { translucency: self.translucency * share, ..*self }
    }

    /// Factors on the base colour where `sunlit` of the sun and `skylit` of the sky is seen.
    pub(crate) fn factors(&self, normal: Vec3, sunlit: f32, skylit: f32) -> [f32; 3] {
        let cos = normal.dot(self.to_sun.as_vec3());
        let direct = (cos.max(0.0) + self.translucency * (-cos).max(0.0)) * sunlit;
        std::array::from_fn(|k| self.sun[k] * direct + self.sky[k] * skylit)
    }
}

/// What leaves that face all ways alike give back of light from `cosine` to the direction in which they are
/// seen, over a leaf that faces both: the mean of max(n·l, 0) + t·max(−n·l, 0) over normals n turned to the
/// eye, by their projected area n·v (J. K. Shultis, R. B. Myneni, "Radiative transfer in vegetation canopies
/// with anisotropic scattering", J. Quant. Spectrosc. Radiat. Transfer 39 (1988), for uniform normals).
/// The light of impostors, whose texels hold many leaves: impostor.wgsl has it too.
pub fn scattered(cosine: f64, translucency: f64) -> f64 {
    let c = cosine.clamp(-1.0, 1.0);
    let (angle, s) = (c.acos(), (1.0 - c * c).sqrt());
    2.0 / (3.0 * PI) * (s + (PI - angle) * c + translucency * (s - angle * c))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scattered_light_is_the_mean_over_leaves_that_face_all_ways() {
        for degrees in [0.0f64, 30.0, 77.0, 90.0, 140.0, 180.0] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let (eye, light) = (DVec3::Y, DVec3::new(sin, cos, 0.0));
            let (mut sum, mut weight) = (0.0, 0.0);
            // Normals on a spiral: as many everywhere.
            let count = 20_000;
            for k in 0..count {
                let y = 1.0 - (f64::from(k) + 0.5) * 2.0 / f64::from(count);
                let (sin, cos) = (f64::from(k) * 2.399_963_229_728_653).sin_cos();
                let flat = (1.0 - y * y).sqrt();
                let mut n = DVec3::new(flat * cos, y, flat * sin);
                n *= if n.dot(eye) < 0.0 { -1.0 } else { 1.0 };
                let cosine = n.dot(light);
                sum += n.dot(eye) * (cosine.max(0.0) + 0.6 * (-cosine).max(0.0));
                weight += n.dot(eye);
            }
            let mean = sum / weight;
            assert!((scattered(cos, 0.6) - mean).abs() < 1e-4, "{degrees}: {mean}");
        }
    }

    #[test]
    fn the_far_side_gets_what_shines_through() {
        let sun = Sun {
            to_sun: DVec3::Y,
            sun: [2.0; 3],
            sky: [0.5; 3],
            translucency: 0.25,
            darkest: 1.0,
        };
        assert_eq!(Light::Sun(sun).unshadowed(Vec3::Y), [2.5; 3]);
        assert_eq!(Light::Sun(sun).unshadowed(Vec3::NEG_Y), [1.0; 3]);
        assert_eq!(sun.factors(Vec3::Y, 0.0, 0.5), [0.25; 3]);
        assert_eq!(Light::Albedo.unshadowed(Vec3::X), [1.0; 3]);
    }

    #[test]
    fn the_side_away_from_the_sun_is_darkest() {
        let sun =
            Sun { to_sun: DVec3::Y, sun: [2.0; 3], sky: [0.5; 3], translucency: 0.0, darkest: 0.2 };
        let seen = |y: f64| sun.seen(DVec3::new(7.0, y, -3.0), 2.0);
        for (y, want) in [(2.0, 1.0), (0.0, 0.6), (-2.0, 0.2), (-9.0, 0.2)] {
            assert!((seen(y) - want).abs() < 1e-6, "{y}: {}", seen(y));
        }
        assert_eq!(Light::Albedo.seen(DVec3::Y, 1.0), 1.0);
        // A block without extent.
        assert!(Light::Sun(sun).seen(DVec3::ZERO, 0.0).is_finite());
    }
}
