//! `--light`.

use forest_raster::Light;

/// The light on a picture.
#[derive(Clone, Copy, clap::ValueEnum)]
pub(crate) enum LightArg {
    /// Base colours.
    Albedo,
    /// A sun from the left, and light from everywhere.
    Sun,
}

impl LightArg {
    pub(crate) fn light(self) -> Light {
        match self {
            LightArg::Albedo => Light::Albedo,
            LightArg::Sun => Light::MORNING,
        }
    }
}
