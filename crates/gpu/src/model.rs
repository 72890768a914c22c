//! A pack on a device.

use crate::device::Gpu;
use crate::error::GpuError;
use crate::foliage::FoliageModel;
use crate::frame::{Layer, Stage, What};
use crate::points::PointsModel;
use crate::renderer::Renderer;
use crate::shade::ShadeModel;
use crate::views::ViewsModel;
use crate::volume::VolumeModel;
use forest_foliage::sway::USUAL_LIMBER;
use forest_foliage::{CrownLight, FoliageBlock, Posed, Sway, Wind};
use forest_pack::measures::{Light, Measure, Measures};
use forest_pack::{Pack, kind};
use forest_points::PointsBlock;
use forest_soup::Camera;
use forest_views::ViewsBlock;
use forest_volume::VolumeBlock;
use glam::DVec3;

/// The representations of a pack, uploaded from its memory map.
#[derive(Debug)]
pub struct Model<'p> {
    pack: &'p Pack,
    pub(crate) points: Option<PointsModel<'p>>,
    pub(crate) views: Option<ViewsModel<'p>>,
    pub(crate) volume: Option<VolumeModel<'p>>,
    pub(crate) foliage: Option<FoliageModel<'p>>,
    measures: Option<Measures>,
    /// What of the light its crown shows.
    pub(crate) crown: Option<CrownLight>,
    /// What comes through it, under the sun of the last frame that had one.
    pub(crate) shade: Option<ShadeModel>,
    stage: Stage,
    bounds: [DVec3; 2],
}

impl<'p> Model<'p> {
    /// Checks and uploads all representations of `pack`.
    ///
    /// # Errors
    /// When a section is damaged or breaks a rule, when the device does not take what is in it, or
    /// when there is nothing to draw.
    pub fn load(gpu: &Gpu, renderer: &Renderer, pack: &'p Pack) -> Result<Self, GpuError> {
        let there = |is_in: bool| is_in.then_some(());
        let views = there(ViewsBlock::is_in(pack))
            .map(|()| ViewsModel::load(gpu, &renderer.views, pack))
            .transpose()?;
        let volume = there(VolumeBlock::is_in(pack))
            .map(|()| VolumeModel::load(gpu, &renderer.volume, pack))
            .transpose()?;
        let foliage = there(FoliageBlock::is_in(pack))
            .map(|()| FoliageModel::load(gpu, &renderer.foliage, pack))
            .transpose()?;
        // After what they may hang on.
        let points = there(PointsBlock::is_in(pack))
            .map(|()| PointsModel::load(gpu, &renderer.points, pack, foliage.as_ref()))
            .transpose()?;
        let (measures, crown) = (Measures::read(pack)?, CrownLight::read(pack)?);
        gpu.finish()?;
        let (stage, bounds) = if let Some(p) = &points {
            let [min, max] = [p.block.header.min, p.block.header.max];
            (p.stage(), [min, max].map(|v| p.block.to_world(v.into())))
        } else if let Some(v) = &views {
            let bounds = v.block.header.bounds.map(|b| v.block.center() + DVec3::from_array(b));
            (v.stage(), bounds)
        } else if let Some(v) = &volume {
            (v.stage(), v.block.header.bounds.map(DVec3::from_array))
        } else if let Some(f) = &foliage {
            (f.stage(), f.block.bounds())
        } else {
            let pack = pack.path().display().to_string();
            return Err(GpuError::Nothing { pack });
        };
        Ok(Self {
            pack,
            points,
            views,
            volume,
            foliage,
            measures,
            crown,
            shade: None,
            stage,
            bounds,
        })
    }

    /// The pack.
    pub fn pack(&self) -> &'p Pack {
        self.pack
    }

    /// The box around the source, in the world.
    pub fn bounds(&self) -> [DVec3; 2] {
        self.bounds
    }

    /// The points, if the pack has them.
    pub fn points(&self) -> Option<&PointsBlock<'p>> {
        self.points.as_ref().map(|p| &p.block)
    }

    /// The views, if the pack has them.
    pub fn views(&self) -> Option<&ViewsBlock<'p>> {
        self.views.as_ref().map(|v| &v.block)
    }

    /// The volume, if the pack has one.
    pub fn volume(&self) -> Option<&VolumeBlock<'p>> {
        self.volume.as_ref().map(|v| &v.block)
    }

    /// The foliage, if the pack has it.
    pub fn foliage(&self) -> Option<&FoliageBlock<'p>> {
        self.foliage.as_ref().map(|f| &f.block)
    }

    /// What of the light its crown shows, if the pack knows it: what stands for shadows on all but foliage.
    pub fn crown(&self) -> Option<&CrownLight> {
        self.crown.as_ref()
    }

    /// The measured table, if the pack has one.
    pub fn measures(&self) -> Option<&Measures> {
        self.measures.as_ref()
    }

    /// Whether levels can be chosen by the table: it has rows of a representation that is here, under base
    /// colours.
    pub fn is_measured(&self) -> bool {
        let here = |kind: u16| match kind {
            kind::POINTS_HEADER => self.points.is_some(),
            kind::VIEWS_HEADER => self.views.is_some(),
            kind::VOLUME_HEADER => self.volume.is_some(),
            kind::FOLIAGE_HEADER => self.foliage.is_some(),
            _ => false,
        };
        let counts = |r: &Measure| r.light == Light::Albedo && here(r.representation);
        self.measures.as_ref().is_some_and(|m| m.rows.iter().any(counts))
    }

    /// Whether the pack has what `what` draws.
    ///
    /// # Errors
    /// The representation or level that it has not.
    pub fn check(&self, what: &What) -> Result<(), GpuError> {
        let missing = match what {
            What::Points(_) => self.points.is_none().then(|| "points".to_string()),
            What::Views(level, _) => match &self.views {
                None => Some("views".into()),
                Some(v) if *level >= v.block.header.levels.len() => {
                    Some(format!("level {level} of views"))
                }
                Some(_) => None,
            },
            What::Foliage(level) => match &self.foliage {
                None => Some("foliage".into()),
                Some(f) if *level >= f.block.header.levels.len() => {
                    Some(format!("level {level} of foliage"))
                }
                Some(_) => None,
            },
            What::Volume(..) => self.volume.is_none().then(|| "volume".into()),
        };
        let pack = self.pack.path().display().to_string();
        missing.map_or(Ok(()), |what| Err(GpuError::Missing { pack, what }))
    }

    /// How branches stand in `wind`, where they are known; `None` in a calm.
    pub(crate) fn posed(&self, wind: &Wind, camera: &Camera) -> Option<Posed> {
        let block = self.foliage().filter(|_| wind.strength > 0.0)?;
        Some(Posed::new(block, wind, 0.0, camera.eye))
    }

    /// How the whole tree leans in `wind`, its foot in the world: the mean of what its branches do, where
    /// they are known.
    pub(crate) fn sway(&self, wind: &Wind, posed: Option<&Posed>) -> Sway {
        let [min, max] = self.bounds.map(|p| p.y as f32);
        match self.foliage().zip(posed) {
            _ if wind.strength <= 0.0 => Sway::default(),
            None => Sway::new(USUAL_LIMBER, min, max - min, wind, 0.0),
            Some((block, posed)) => {
                let own = Sway::of(block, posed);
                Sway { foot: (f64::from(own.foot) + block.origin().y) as f32, ..own }
            }
        }
    }

    pub(crate) fn stage(&self) -> &Stage {
        &self.stage
    }

    pub(crate) fn check_layers(&self, layers: &[Layer]) -> Result<(), GpuError> {
        layers.iter().try_for_each(|l| self.check(&l.what))
    }
}
