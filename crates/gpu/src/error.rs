//! What can go wrong on a graphics device.

use forest_pack::PackError;

/// Why something cannot be drawn.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GpuError {
    /// There is nothing to draw with.
    #[error(
        "no graphics adapter{wanted}: install a Vulkan driver; where there is no graphics card, \
         Mesa's software driver will do (Debian, Ubuntu: apt install mesa-vulkan-drivers){found}"
    )]
    NoAdapter {
        /// What was asked for, in words; empty for any.
        wanted: String,
        /// What is there, in words.
        found: String,
    },
    /// The adapter lacks something that no way around is built for.
    #[error("adapter {adapter}: {missing}")]
    Unsuited {
        /// Its name.
        adapter: String,
        /// What it lacks.
        missing: String,
    },
    /// Data larger than the device takes.
    #[error("{what}: {size} {unit}; the limit of {adapter} is {limit}")]
    TooLarge {
        /// Of what.
        what: String,
        /// How large it is.
        size: u64,
        /// In what.
        unit: &'static str,
        /// The largest that would do.
        limit: u64,
        /// Name of the adapter.
        adapter: String,
    },
    /// The pack lacks what was to be drawn.
    #[error("{pack}: has no {what}")]
    Missing {
        /// Its file.
        pack: String,
        /// The representation or level.
        what: String,
    },
    /// The pack has nothing to draw.
    #[error("{pack}: has neither points nor views nor a volume")]
    Nothing {
        /// Its file.
        pack: String,
    },
    /// The device refused, or went away.
    #[error("the graphics device failed: {0}")]
    Device(String),
    /// The pack is damaged or breaks a rule.
    #[error(transparent)]
    Pack(#[from] PackError),
    /// The scene is.
    #[error(transparent)]
    Scene(#[from] forest_scene::SceneError),
}
