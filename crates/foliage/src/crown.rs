//! The light on a crown as representations without shadow maps have it: shares of sun and sky, fitted to rays.
//!
//! Foliage has a shadow map, and the sky that each card sees. Points, views and volumes have their normals
//! (volumes: leaves that face all ways). How much of the sun a crown shows depends, nearly, on the angle
//! between the eye and the sun alone: from where the sun stands no shadow is seen (the hotspot, which Bruneton
//! & Neyret 2012 ask for), from the side and against the light most of what is seen lies in shadow. That is
//! measured by rays when foliage is baked, and fitted by a smooth fall over the angle, a peak about the
//! antisolar point as exp(−angle/width) (the hotspot kernel of J. M. Chen, S. G. Leblanc, "A four-scale
//! bidirectional reflectance model based on canopy architecture", IEEE TGRS 35 (1997)), and the height of the
//! sun. So a change of representation does not change brightness.

use crate::fit::Sample;
use forest_pack::{Pack, PackError, PackWriter, SectionId, header, kind};
use forest_raster::{Light, Sun};
use glam::DVec3;
use nalgebra::{Matrix4, Vector4};
use serde::{Deserialize, Serialize};

/// Section `light.crown`.
const ID: SectionId = SectionId::new(kind::LIGHT_CROWN, 0);

/// Width of the hotspot in radians: shadows of leaves and twigs are seen from farther off.
const HOTSPOT: f64 = 0.4;

/// Shares of the light that a crown shows; without shadows they are 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CrownLight {
    /// Weights of what the share of the sun is a sum of: 1, (1 + cos γ)/2, exp(−γ/0.4) and the sine of the
    /// sun's elevation, with γ the angle between the directions to the eye and to the sun. Within ±4.
    pub sun: [f32; 4],
    /// Share of the sky, `0..=2`.
    pub sky: f32,
}

/// What the share of the sun is a sum of.
fn terms(to_sun: DVec3, to_eye: DVec3) -> [f64; 4] {
    let cos = to_sun.dot(to_eye).clamp(-1.0, 1.0);
    [1.0, 0.5 + 0.5 * cos, (-cos.acos() / HOTSPOT).exp(), to_sun.y]
}

impl CrownLight {
    /// That of a pack, if it is known there.
    ///
    /// # Errors
    /// When the section is damaged or a number is out of range.
    pub fn read(pack: &Pack) -> Result<Option<Self>, PackError> {
        if !pack.contains(ID) {
            return Ok(None);
        }
        let own: Self = header::decode(pack, ID)?;
        if let Some(weight) = own.sun.iter().find(|w| !(-MOST..=MOST).contains(*w)) {
            let problem = format!("a weight of the sun is {weight}; within ±{MOST}");
            return Err(PackError::invalid(pack.path(), ID, problem));
        }
        if !(0.0..=2.0).contains(&own.sky) {
            let problem = format!("{} of the sky is seen; from 0 to 2", own.sky);
            return Err(PackError::invalid(pack.path(), ID, problem));
        }
        Ok(Some(own))
    }

    pub(crate) fn write(&self, writer: &mut PackWriter) -> Result<(), PackError> {
        header::write(writer, ID, self)
    }

    /// Share of the sun that is seen by an eye in direction `to_eye` of the tree; both are unit vectors.
    pub fn sunlit(&self, to_sun: DVec3, to_eye: DVec3) -> f32 {
        let weighted = terms(to_sun, to_eye).into_iter().zip(self.sun);
        weighted.map(|(t, w)| t * f64::from(w)).sum::<f64>().clamp(0.0, 1.0) as f32
    }

    /// What `light` is on this crown, seen from `to_eye`.
    pub fn light(&self, light: Light, to_eye: DVec3) -> Light {
        match self.sunlight(light, to_eye) {
            Light::Sun(sun) => Light::Sun(Sun { sky: sun.sky.map(|v| v * self.sky), ..sun }),
            other => other,
        }
    }

    /// The same for what knows its own share of the sky.
    pub fn sunlight(&self, light: Light, to_eye: DVec3) -> Light {
        match light {
            Light::Sun(sun) => {
                let share = self.sunlit(sun.to_sun, to_eye);
                Light::Sun(Sun { sun: sun.sun.map(|v| v * share), ..sun })
            }
            other => other,
        }
    }

    /// The weights for which the light is nearest to the truth of `samples`, in parts of it.
    pub(crate) fn fit(samples: &[Sample]) -> Self {
        let (mut normal, mut right) = (Matrix4::zeros(), Vector4::zeros());
        let mut sky = [0.0; 2];
        for s in samples.iter().filter(|s| s.truth[0] > 0.0) {
            let row = terms(s.to_sun, s.to_eye).map(|t| t * s.open[0] / s.truth[0]);
            let row = Vector4::from(row);
            normal += row * row.transpose();
            right += row;
            sky = [sky[0] + s.truth[1], sky[1] + s.open[1]];
        }
        // Terms that the samples cannot tell apart share what there is.
        let ridge = 1e-6 * normal.trace();
        normal += Matrix4::identity() * ridge;
        let found = normal.cholesky().map(|c| c.solve(&right));
        let sun = found.map(|w| w.data.0[0].map(|v| (v as f32).clamp(-MOST, MOST)));
        let share = sky[0] / sky[1];
        Self {
            sun: sun.unwrap_or([1.0, 0.0, 0.0, 0.0]),
            sky: if share.is_finite() { share.clamp(0.0, 2.0) as f32 } else { 1.0 },
        }
    }
}

/// Largest weight.
const MOST: f32 = 4.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_that_made_the_truth_are_found_again() {
        let made = CrownLight { sun: [0.25, 0.2, 0.5, -0.1], sky: 0.6 };
        let sample = |i: u32| {
            let (yaw, pitch) = (f64::from(i) * 0.3, 0.3 + 0.2 * f64::from(i % 4));
            let to_sun = DVec3::new(yaw.sin() * pitch.cos(), pitch.sin(), yaw.cos() * pitch.cos());
            let open = 2.0 + f64::from(i % 3);
            let truth = [open * f64::from(made.sunlit(to_sun, DVec3::Z)), 3.0 * 0.6];
            Sample { to_sun, to_eye: DVec3::Z, truth, open: [open, 3.0] }
        };
        let samples: Vec<Sample> = (0..11).map(sample).collect();
        let found = CrownLight::fit(&samples);
        for (got, want) in found.sun.iter().zip(made.sun) {
            assert!((got - want).abs() < 2e-3, "{found:?}");
        }
        assert!((found.sky - 0.6).abs() < 1e-6);
        let none = CrownLight::fit(&[]);
        assert_eq!(none.light(Light::MORNING, DVec3::X), Light::MORNING);
    }

    #[test]
    fn the_hotspot_is_brightest() {
        let crown = CrownLight { sun: [0.2, 0.2, 0.5, 0.0], sky: 1.0 };
        let at = |degrees: f64| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            crown.sunlit(DVec3::Z, DVec3::new(sin, 0.0, cos))
        };
        assert!((at(0.0) - 0.9).abs() < 1e-6 && at(10.0) < 0.8);
        assert!(at(10.0) > at(60.0) && at(60.0) > at(170.0));
    }
}
