//! The light on a crown as representations without shadow maps have it: shares of sun and sky, fitted to rays.
//!
//! Foliage has a shadow map, and the sky that each card sees. Points, views and volumes have their normals
//! (volumes: leaves that face all ways). How much light comes through to a place is that of a coarse grid of
//! the tree's density ([`CrownShade`]). Of what comes through, an eye sees more or less by its angle to the
//! sun: from where the sun stands no shadow is seen (the hotspot, which Bruneton & Neyret 2012 ask for). That
//! is measured by rays when foliage is baked, and fitted by a smooth fall over the angle, a peak about the
//! antisolar point as exp(−angle/width) (the hotspot kernel of J. M. Chen, S. G. Leblanc, "A four-scale
//! bidirectional reflectance model based on canopy architecture", IEEE TGRS 35 (1997)), and the height of the
//! sun. So a change of representation does not change brightness.

use crate::density::{CrownShade, Density};
use crate::fit::Sample;
use forest_pack::{Pack, PackError, PackWriter, SectionId, header, kind};
use glam::DVec3;
use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

/// Section `light.crown`.
const ID: SectionId = SectionId::new(kind::LIGHT_CROWN, 0);

/// Width of the hotspot in radians: shadows of leaves and twigs are seen from farther off.
const HOTSPOT: f64 = 0.4;

/// Factor on the light that comes through a crown, by what is drawn. An eye sees a little deeper into points and
/// views than into the source, where less light comes, and less deep into a volume: without it both samples
/// and two real trees are 1 to 8 % too dark and 3 to 7 % too bright. It is the mean over them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gain(f32);

impl Gain {
    /// What is drawn as the source: triangles.
    pub const SOURCE: Self = Self(1.0);
    /// Points.
    pub const POINTS: Self = Self(1.02);
    /// Views.
    pub const VIEWS: Self = Self(1.03);
    /// Billboards of volumes.
    pub const VOLUME: Self = Self(0.96);

    /// Factor on the light.
    pub const fn factor(self) -> f32 {
        self.0
    }
}

/// Share of a texel of views, on a crown, that is lit as leaves that face all ways
/// ([`forest_raster::scattered`]): its normal is the mean of many that were turned to the eye, and by it alone
/// a texel would be too bright with the sun behind the eye, and too dark beside it.
pub const ALL_WAYS: f32 = 0.75;

/// Shares of the light that a crown shows; without shadows they are 1.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CrownLight {
    /// Weights of what is seen of the sunlight that comes through: a sum of 1, (1 + cos γ)/2, exp(−γ/0.4) and
    /// the sines of the elevations of sun and eye, with γ the angle between the directions to both. Within
    /// ±4.
    pub sun: [f32; 5],
    /// Of what is seen of the light of the sky that comes through: a sum of 1 and the sine of the eye's
    /// elevation. Within ±4.
    pub sky: [f32; 2],
    /// Where light comes through.
    pub(crate) density: Density,
}

/// What the share of the sun is a sum of.
fn sun_terms(to_sun: DVec3, to_eye: DVec3) -> [f64; 5] {
    let cos = to_sun.dot(to_eye).clamp(-1.0, 1.0);
    [1.0, 0.5 + 0.5 * cos, (-cos.acos() / HOTSPOT).exp(), to_sun.y, to_eye.y]
}

/// What the share of the sky is a sum of.
fn sky_terms(to_eye: DVec3) -> [f64; 2] {
    [1.0, to_eye.y]
}

/// A sum of terms by their weights, of what it can be.
fn share<const N: usize>(terms: [f64; N], weights: [f32; N]) -> f32 {
    let weighted = terms.into_iter().zip(weights).map(|(t, w)| t * f64::from(w));
    weighted.sum::<f64>().clamp(0.0, 2.0) as f32
}

/// The weights for which the sum of terms times `open` is nearest to `truth`, in parts of it; a constant 1
/// where nothing is known.
fn weights<const N: usize>(rows: impl Iterator<Item = ([f64; N], f64, f64)>) -> [f32; N] {
    let (mut normal, mut right) = (SMatrix::<f64, N, N>::zeros(), SVector::<f64, N>::zeros());
    for (terms, open, truth) in rows.filter(|(.., truth)| *truth > 0.0) {
        let row = SVector::from(terms.map(|t| t * open / truth));
        normal += row * row.transpose();
        right += row;
    }
    // Terms that the samples cannot tell apart share what there is.
    let ridge = 1e-6 * normal.trace();
    normal += SMatrix::identity() * ridge;
    let found = normal.cholesky().map(|c| c.solve(&right));
    let found = found.map(|w| w.data.0[0].map(|v| (v as f32).clamp(-MOST, MOST)));
    found.unwrap_or_else(|| std::array::from_fn(|i| f32::from(i == 0)))
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
        let weights = own.sun.iter().chain(&own.sky);
        if let Some(weight) = weights.clone().find(|w| !(-MOST..=MOST).contains(*w)) {
            let problem = format!("a weight of sun or sky is {weight}; within ±{MOST}");
            return Err(PackError::invalid(pack.path(), ID, problem));
        }
        if let Some(problem) = own.density.problem() {
            return Err(PackError::invalid(pack.path(), ID, problem));
        }
        Ok(Some(own))
    }

    pub(crate) fn write(&self, writer: &mut PackWriter) -> Result<(), PackError> {
        header::write(writer, ID, self)
    }

    /// Of the sunlight that comes through, what is seen by an eye in direction `to_eye` of the tree, `0..=2`;
    /// both are unit vectors.
    pub fn sunlit(&self, to_sun: DVec3, to_eye: DVec3) -> f32 {
        share(sun_terms(to_sun, to_eye), self.sun)
    }

    /// The same of the light of the sky.
    pub fn skylit(&self, to_eye: DVec3) -> f32 {
        share(sky_terms(to_eye), self.sky)
    }

    /// Where the light of a sun in direction `to_sun`, a unit vector, and of the sky comes through.
    pub fn shade(&self, to_sun: DVec3) -> CrownShade {
        self.density.shade(to_sun)
    }

    /// The weights for which the light is nearest to the truth of `samples`, in parts of it.
    pub(crate) fn fit(density: Density, samples: &[Sample]) -> Self {
        let sun = |s: &Sample| (sun_terms(s.to_sun, s.to_eye), s.open[0], s.truth[0]);
        let sky = |s: &Sample| (sky_terms(s.to_eye), s.open[1], s.truth[1]);
        let samples = samples.iter();
        Self { sun: weights(samples.clone().map(sun)), sky: weights(samples.map(sky)), density }
    }
}

/// Largest weight.
const MOST: f32 = 4.0;

#[cfg(test)]
mod tests {
    use super::*;
    use forest_raster::Surfaces;
    use forest_soup::{Material, TriangleSoup};
    use glam::Vec3;

    /// Weights on the crown of one leaf.
    fn on_a_leaf(sun: [f32; 5], sky: [f32; 2]) -> CrownLight {
        CrownLight { sun, sky, density: leaf() }
    }

    fn leaf() -> Density {
        let soup = TriangleSoup {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            triangles: vec![[0, 1, 2]],
            triangle_materials: vec![0],
            materials: vec![Material::default()],
            ..TriangleSoup::default()
        };
        Density::of(&soup, &Surfaces::new(&soup.materials, &[]))
    }

    #[test]
    fn shares_that_made_the_truth_are_found_again() {
        let made = on_a_leaf([0.25, 0.2, 0.5, -0.1, 0.2], [0.6, 0.3]);
        let sample = |i: u32| {
            let (yaw, pitch) = (f64::from(i) * 0.3, 0.3 + 0.2 * f64::from(i % 4));
            let to_sun = DVec3::new(yaw.sin() * pitch.cos(), pitch.sin(), yaw.cos() * pitch.cos());
            let up = 0.1 * f64::from(i % 5);
            let to_eye = DVec3::new(0.0, up, (1.0 - up * up).sqrt());
            let open = 2.0 + f64::from(i % 3);
            let seen = [made.sunlit(to_sun, to_eye), made.skylit(to_eye)].map(f64::from);
            Sample { to_sun, to_eye, truth: [open * seen[0], 3.0 * seen[1]], open: [open, 3.0] }
        };
        let samples: Vec<Sample> = (0..11).map(sample).collect();
        let found = CrownLight::fit(leaf(), &samples);
        let (got, want) = (found.sun.iter().chain(&found.sky), made.sun.iter().chain(&made.sky));
        for (got, want) in got.zip(want) {
            assert!((got - want).abs() < 2e-3, "{found:?}");
        }
        let none = CrownLight::fit(leaf(), &[]);
        assert_eq!((none.sun, none.sky), ([1.0, 0.0, 0.0, 0.0, 0.0], [1.0, 0.0]));
    }

    #[test]
    fn the_hotspot_is_brightest() {
        let crown = on_a_leaf([0.2, 0.2, 0.5, 0.0, 0.0], [1.0, 0.0]);
        let at = |degrees: f64| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            crown.sunlit(DVec3::Z, DVec3::new(sin, 0.0, cos))
        };
        assert!((at(0.0) - 0.9).abs() < 1e-6 && at(10.0) < 0.8);
        assert!(at(10.0) > at(60.0) && at(60.0) > at(170.0));
    }
}
