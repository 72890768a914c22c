//! How a tree is sampled and lit: a style, and what its crown lets through.

use forest_foliage::{ALL_WAYS, CrownLight, CrownShade, Gain};
use forest_pack::{Pack, PackError};
use forest_raster::{Style, Sun};
use glam::DVec3;

/// A style on what stands alone, or on a crown. A plain [`Style`] turns into one, without a crown.
#[derive(Clone, Copy, Debug)]
pub struct Lit<'a> {
    /// Samples and light.
    pub style: Style,
    crown: Option<Shares<'a>>,
}

/// Of what comes through a crown, what an eye sees of the sun and of the sky.
#[derive(Clone, Copy, Debug)]
struct Shares<'a> {
    seen: [f32; 2],
    shade: &'a CrownShade,
}

impl From<Style> for Lit<'_> {
    fn from(style: Style) -> Self {
        Self { style, crown: None }
    }
}

impl From<&Style> for Lit<'_> {
    fn from(style: &Style) -> Self {
        Self { style: *style, crown: None }
    }
}

impl Lit<'_> {
    /// Shares of the sun and of the sky that are seen at `place` of a block of this middle, in the world, and
    /// half diagonal: what the crown lets through to what is drawn with this gain, and the estimate of
    /// [`Sun::seen`].
    pub(crate) fn seen(
        &self,
        place: DVec3,
        middle: DVec3,
        half_diagonal: f64,
        gain: Gain,
    ) -> [f32; 2] {
        let estimate = self.style.light.seen(place - middle, half_diagonal);
        let Some(Shares { seen, shade }) = self.crown else { return [estimate, 1.0] };
        let [sun, sky] = shade.at(place).map(|share| share * gain.factor());
        [estimate * seen[0] * sun, seen[1] * sky]
    }

    /// Share of a texel of views that is lit as leaves that face all ways.
    pub(crate) fn all_ways(&self) -> f32 {
        if self.crown.is_some() { ALL_WAYS } else { 0.0 }
    }
}

/// A style on the crown of a pack, whose shade is found once for many pictures.
#[derive(Clone, Debug)]
pub struct CrownStyle {
    style: Style,
    crown: Option<(CrownShade, CrownLight)>,
}

impl CrownStyle {
    /// `style` on what `pack` holds: with the light on its crown, if it is known there and a sun shines.
    ///
    /// # Errors
    /// When the section is damaged.
    pub fn read(pack: &Pack, style: &Style) -> Result<Self, PackError> {
        let on = |sun: &Sun, crown: CrownLight| (crown.shade(sun.to_sun), crown);
        let crown = match style.light.sun() {
            Some(sun) => CrownLight::read(pack)?.map(|crown| on(sun, crown)),
            None => None,
        };
        Ok(Self { style: *style, crown })
    }

    /// As an eye in direction `to_eye`, a unit vector, of the middle of the tree's box sees it.
    pub fn seen_from(&self, to_eye: DVec3) -> Lit<'_> {
        let crown = self.crown.as_ref().zip(self.style.light.sun()).map(|((shade, crown), sun)| {
            Shares { seen: [crown.sunlit(sun.to_sun, to_eye), crown.skylit(to_eye)], shade }
        });
        Lit { style: self.style, crown }
    }

    /// Whether a sun shines on a crown.
    pub fn is_on_crown(&self) -> bool {
        self.crown.is_some()
    }
}
