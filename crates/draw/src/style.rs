//! How a picture is sampled and lit.

use glam::DVec3;

/// Light on the surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum Light {
    /// Base colours as they are.
    #[default]
    Albedo,
    /// Base colour × (ambient + (1 − ambient)·|n·l|); no shadows. Leaves shine through: both
    /// faces are lit alike.
    Sun {
        /// Unit vector towards the sun.
        to_sun: DVec3,
        /// Share of the light that comes from everywhere, in `0..=1`.
        ambient: f32,
    },
}

impl Light {
    /// A high sun from the left, behind the camera's shoulder.
    pub const MORNING: Self =
        Self::Sun { to_sun: DVec3::new(-0.48, 0.72, 0.501_199), ambient: 0.45 };

    pub(crate) fn factor(&self, normal: DVec3) -> f32 {
        match *self {
            Light::Albedo => 1.0,
            Light::Sun { to_sun, ambient } => {
                ambient + (1.0 - ambient) * normal.dot(to_sun).abs() as f32
            }
        }
    }
}

/// How a picture is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Style {
    /// Samples a side of a pixel: `samples²` in all, at least 1.
    pub samples: u32,
    /// Light.
    pub light: Light,
}

impl Default for Style {
    /// 16 samples a pixel, base colours.
    fn default() -> Self {
        Self { samples: 4, light: Light::Albedo }
    }
}
