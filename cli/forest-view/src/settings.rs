//! What is shown and how: what flags set, and the window's controls change.

use crate::args::{Args, Representation};
use anyhow::Result;
use forest_foliage::Wind;
use forest_gpu::{Candidate, Goal, Model, What};
use forest_points::{PixelArea, Thresholds};
use forest_raster::Light;
use forest_soup::Camera;
use forest_views::Lookup;
use forest_volume::{Blending, Detail};

/// The controls.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Settings {
    pub(crate) representation: Representation,
    /// s_m in square pixels.
    pub(crate) finest: f64,
    /// Triangles only.
    pub(crate) triangles: bool,
    /// s_M over s_m; infinite for no triangles.
    pub(crate) ratio: f64,
    pub(crate) bias: f64,
    pub(crate) lookup: Lookup,
    /// Of a volume or of foliage; by the width of texels without.
    pub(crate) level: Option<u32>,
    pub(crate) blending: Blending,
    pub(crate) texel: f64,
    pub(crate) goal: Goal,
    pub(crate) wind: Wind,
    pub(crate) light: Light,
    pub(crate) side: u32,
}

impl Settings {
    pub(crate) fn new(args: &Args, model: &Model) -> Self {
        let finest = args.finest.unwrap_or(1.0);
        Self {
            representation: args.what.unwrap_or_else(|| usual(model)),
            finest,
            triangles: false,
            ratio: args.largest.map_or(Thresholds::LARGEST_RATIO, |s_max| s_max / finest),
            bias: args.bias,
            lookup: args.lookup.into(),
            level: args.level,
            blending: args.blend.into(),
            texel: args.texel,
            goal: args
                .fps
                .map_or(Goal::Error(args.error.unwrap_or(forest_gpu::JUST_NOTICEABLE)), Goal::Rate),
            wind: args.wind.unwrap_or_default(),
            light: args.light.light(args.self_shadow),
            side: args.samples,
        }
    }

    /// What to draw of `model` for `camera`; of representation auto the best of `all` candidates,
    /// when `now` is drawn already.
    pub(crate) fn what(
        &self,
        model: &Model,
        camera: &Camera,
        all: &[Candidate],
        now: Option<&What>,
    ) -> Option<What> {
        match self.representation {
            Representation::Auto => {
                let chosen = self.goal.choose(all, now).map(|c| c.what);
                // Not measured from there: what the pack has.
                let plain = || Self { representation: there(model), ..self.clone() };
                chosen.or_else(|| plain().what(model, camera, all, now))
            }
            Representation::Points => Some(What::Points(self.thresholds())),
            Representation::Views => model.views().map(|views| {
                let chosen = forest_views::select(views, camera, self.lookup, self.texel);
                What::Views(chosen.level, self.lookup)
            }),
            Representation::Volume => Some(What::Volume(self.detail(), self.blending)),
            Representation::Foliage => model.foliage().map(|foliage| {
                let chosen = self.level.map(|l| l as usize);
                What::Foliage(chosen.unwrap_or_else(|| foliage.select(camera, self.texel)))
            }),
        }
    }

    fn thresholds(&self) -> Thresholds {
        if self.triangles {
            return Thresholds::TRIANGLES;
        }
        Thresholds {
            finest: PixelArea(self.finest),
            largest: PixelArea(self.finest * self.ratio),
            depth_bias: PixelArea(self.bias),
        }
    }

    fn detail(&self) -> Detail {
        match self.level {
            Some(level) => Detail::Level(level),
            None => Detail::Planes { texel: self.texel, fade: Detail::FADE },
        }
    }
}

/// Auto where the pack has a measured table, else what it has.
pub(crate) fn usual(model: &Model) -> Representation {
    if model.is_measured() { Representation::Auto } else { there(model) }
}

/// The first representation that the pack has.
fn there(model: &Model) -> Representation {
    let all = [
        (model.points().is_some(), Representation::Points),
        (model.views().is_some(), Representation::Views),
        (model.volume().is_some(), Representation::Volume),
    ];
    all.into_iter().find(|(there, _)| *there).map_or(Representation::Foliage, |(_, what)| what)
}

/// Whether the pack has what was asked for.
pub(crate) fn check(settings: &Settings, model: &Model) -> Result<()> {
    let what = match settings.representation {
        Representation::Auto if !model.is_measured() => {
            let pack = model.pack().path().display();
            let text = "--as auto needs a table measured under base colours: bake with --measure, or eval --embed";
            return Err(crate::failure::Usage(format!("{pack}: {text}")).into());
        }
        Representation::Auto => return Ok(()),
        Representation::Points => What::Points(settings.thresholds()),
        Representation::Views => What::Views(0, settings.lookup),
        Representation::Volume => What::Volume(settings.detail(), settings.blending),
        Representation::Foliage => What::Foliage(settings.level.unwrap_or(0) as usize),
    };
    let is_volume = settings.representation == Representation::Volume;
    if let (Some(level), Some(volume), true) = (settings.level, model.volume(), is_volume) {
        let finest = volume.header.levels.len() as u32 - 1;
        if level > finest {
            let pack = model.pack().path().display();
            let text = format!("--level {level}: the finest level of {pack} is {finest}");
            return Err(crate::failure::Usage(text).into());
        }
    }
    Ok(model.check(&what)?)
}
