//! The passes, and how a picture is put together.

use crate::MOST_LAYERS;
use crate::bind::{self, Kind};
use crate::device::Gpu;
use crate::error::GpuError;
use crate::foliage::FoliagePass;
use crate::frame::{Frame, FrameUniform, What, supersampled};
use crate::model::Model;
use crate::points::PointsPass;
use crate::shade::{self, ShadeModel};
use crate::target::{Target, TargetLayouts};
use crate::timer::Timer;
use crate::views::ViewsPass;
use crate::volume::VolumePass;
use forest_foliage::{Posed, Sway};
use wgpu::{
    BindGroup, BindGroupLayout, Buffer, BufferUsages, Color, CommandEncoder, LoadOp, Operations,
    RenderPassColorAttachment, RenderPassDepthStencilAttachment, RenderPassDescriptor,
    ShaderStages, StoreOp,
};

/// The pipelines of all passes on a device.
#[derive(Debug)]
pub struct Renderer {
    pub(crate) points: PointsPass,
    pub(crate) views: ViewsPass,
    pub(crate) volume: VolumePass,
    pub(crate) foliage: FoliagePass,
    targets: TargetLayouts,
    uniform: Buffer,
    group: BindGroup,
    /// Of what is lit by its crown: the layout of group 0, and the group where no crown is.
    lit: BindGroupLayout,
    open: BindGroup,
}

/// What a picture took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Drawn {
    /// Points that were looked at: a prefix of each cell's array, of which nearly all are drawn.
    pub points: u64,
    /// Triangles.
    pub triangles: u64,
    /// Views that were looked at.
    pub views: u64,
    /// Cells of volumes.
    pub cells: u64,
    /// Bytes of the records, tiles and codes that these are.
    pub bytes: u64,
    /// Draw calls and dispatches.
    pub calls: u64,
}

impl Drawn {
    /// Points, triangles, views and cells.
    pub fn primitives(&self) -> u64 {
        self.points + self.triangles + self.views + self.cells
    }
}

/// How points are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// Take 32-bit atomics in two runs even where the device has 64-bit ones.
    pub narrow_atomics: bool,
    /// Pixels of the largest box that the compute shader fills; larger points are drawn as quads.
    pub splat_most: u32,
}

impl Default for Options {
    /// The best atomics there are; boxes up to 16 × 16 pixels.
    fn default() -> Self {
        Self { narrow_atomics: false, splat_most: 256 }
    }
}

impl Renderer {
    /// Builds the pipelines.
    ///
    /// # Errors
    /// When the device refuses one.
    pub fn new(gpu: &Gpu, options: &Options) -> Result<Self, GpuError> {
        let stages = ShaderStages::VERTEX_FRAGMENT | ShaderStages::COMPUTE;
        let layout = bind::layout(&gpu.device, "frame", stages, &[Kind::Uniform]);
        let size = size_of::<FrameUniform>() as u64;
        let uniform = gpu.buffer("frame", size, BufferUsages::UNIFORM)?;
        let group = bind::group(&gpu.device, "frame", &layout, &[uniform.as_entire_binding()]);
        let kinds = [Kind::Uniform, Kind::Texture3d];
        let lit = bind::layout(&gpu.device, "lit frame", stages, &kinds);
        let open = shade::open(gpu, &lit, &uniform);
        let targets = TargetLayouts::new(gpu);
        let renderer = Self {
            points: PointsPass::new(gpu, &lit, &targets, options),
            views: ViewsPass::new(gpu, &lit),
            volume: VolumePass::new(gpu, &lit),
            foliage: FoliagePass::new(gpu, &layout),
            targets,
            uniform,
            group,
            lit,
            open,
        };
        gpu.finish()?;
        Ok(renderer)
    }

    /// Room for a picture of `size` pixels with `side` × `side` samples each.
    ///
    /// # Errors
    /// When the device does not take so many.
    pub fn target(&self, gpu: &Gpu, size: [u32; 2], side: u32) -> Result<Target, GpuError> {
        let target = Target::new(gpu, &self.targets, size, side.clamp(1, 16))?;
        gpu.check()?;
        Ok(target)
    }

    /// Draws `frame` into `target`, which must have the size of its camera, and gives the work to the
    /// device without waiting for it. At most two layers of each representation are drawn.
    ///
    /// # Errors
    /// When the pack lacks a layer's representation or level.
    pub fn render(
        &self,
        gpu: &Gpu,
        model: &mut Model,
        target: &Target,
        frame: &Frame,
        timer: Option<&Timer>,
    ) -> Result<Drawn, GpuError> {
        model.check_layers(frame.layers)?;
        let samples = supersampled(&frame.camera, target.side);
        let posed = model.posed(&frame.wind, &frame.camera);
        let sway = model.sway(&frame.wind, posed.as_ref());
        let mut uniform = FrameUniform::new(&samples, &frame.light, model.stage());
        uniform = uniform.with_sway(&sway, &samples);
        if let Some((crown, sun)) = model.crown.as_ref().zip(frame.light.sun()) {
            let last = model.shade.take();
            let shade = ShadeModel::follow(last, gpu, &self.lit, &self.uniform, crown, sun.to_sun);
            let to_eye = frame.camera.to_eye(model.stage().middle);
            uniform = uniform.with_crown(crown, &shade, to_eye, &samples);
            model.shade = Some(shade);
        }
        if let Some((foliage, posed)) = model.foliage.as_ref().zip(posed.as_ref()) {
            foliage.wind.prepare(gpu, posed);
            if model.points.as_ref().is_some_and(|p| p.is_tied) {
                uniform = uniform.with_branches(foliage.block.origin(), &samples);
            }
        }
        gpu.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&uniform));
        let drawn = prepare(gpu, model, &samples, frame, posed.as_ref(), &sway);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        if let Some(timer) = timer {
            timer.begin(&mut encoder);
        }
        self.encode(&mut encoder, model, target, frame);
        if let Some(timer) = timer {
            timer.end(&mut encoder);
        }
        gpu.queue.submit([encoder.finish()]);
        Ok(drawn)
    }

    fn encode(&self, encoder: &mut CommandEncoder, model: &Model, target: &Target, frame: &Frame) {
        let draws = |wanted: fn(&What) -> bool| frame.layers.iter().any(|l| wanted(&l.what));
        let points = model.points.as_ref().filter(|_| draws(|w| matches!(w, What::Points(_))));
        let views = model.views.as_ref().filter(|_| draws(|w| matches!(w, What::Views(..))));
        let volume = model.volume.as_ref().filter(|_| draws(|w| matches!(w, What::Volume(..))));
        let foliage = model.foliage.as_ref().filter(|_| draws(|w| matches!(w, What::Foliage(_))));
        let lit = model.shade.as_ref().map_or(&self.open, |s| &s.group);
        if let Some(points) = points {
            self.points.splat(encoder, lit, points, target);
        }
        if let Some(foliage) = foliage {
            self.foliage.shade(encoder, foliage);
        }
        let mut pass = encoder.begin_render_pass(&RenderPassDescriptor {
            label: Some("tree"),
            color_attachments: &[Some(RenderPassColorAttachment {
                view: &target.color_view,
                depth_slice: None,
                resolve_target: None,
                ops: Operations { load: LoadOp::Clear(Color::TRANSPARENT), store: StoreOp::Store },
            })],
            depth_stencil_attachment: Some(RenderPassDepthStencilAttachment {
                view: &target.depth_view,
                depth_ops: Some(Operations { load: LoadOp::Clear(0.0), store: StoreOp::Discard }),
                stencil_ops: None,
            }),
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        });
        pass.set_bind_group(0, lit, &[]);
        if let Some(points) = points {
            self.points.draw(&mut pass, points, target);
        }
        if let Some(views) = views {
            self.views.draw(&mut pass, views);
        }
        if let Some(foliage) = foliage {
            pass.set_bind_group(0, &self.group, &[]);
            self.foliage.draw(&mut pass, foliage);
            pass.set_bind_group(0, lit, &[]);
        }
        // Over all that is opaque.
        if let Some(volume) = volume {
            self.volume.draw(&mut pass, volume);
        }
    }
}

/// Chooses and uploads what the layers draw: levels for pixels, places for samples.
fn prepare(
    gpu: &Gpu,
    model: &mut Model,
    samples: &forest_soup::Camera,
    frame: &Frame,
    posed: Option<&Posed>,
    sway: &Sway,
) -> Drawn {
    let mut drawn = Drawn::default();
    let layers = frame.layers.iter();
    if let Some(model) = &mut model.points {
        let chosen = layers.clone().filter_map(|l| match l.what {
            What::Points(thresholds) => Some((thresholds, l.fade)),
            _ => None,
        });
        if chosen.clone().next().is_some() {
            // What hangs on branches does not lean besides.
            let sway = if model.is_tied { &Sway::default() } else { sway };
            model.prepare(gpu, &frame.camera, sway, chosen.take(MOST_LAYERS));
            let took = model.drawn();
            drawn.points += took.points;
            drawn.triangles += took.triangles;
            drawn.bytes += model.bytes();
            drawn.calls += model.calls();
        }
    }
    if let Some(model) = &mut model.views {
        let chosen = layers.clone().filter_map(|l| match l.what {
            What::Views(level, lookup) => Some((level, lookup, l.fade)),
            _ => None,
        });
        if chosen.clone().next().is_some() {
            model.prepare(gpu, samples, chosen);
            drawn.views += model.drawn().views;
            drawn.bytes += model.drawn().bytes;
            drawn.calls += model.calls();
        }
    }
    if let Some(model) = &mut model.foliage {
        let chosen = layers.clone().filter_map(|l| match l.what {
            What::Foliage(level) => Some((level, l.fade)),
            _ => None,
        });
        if chosen.clone().next().is_some() {
            model.prepare(gpu, &frame.camera, posed, &frame.light, chosen);
            drawn.triangles += model.triangles();
            drawn.bytes += model.bytes();
            drawn.calls += model.calls();
        }
    }
    if let Some(model) = &mut model.volume {
        let chosen = layers.filter_map(|l| match l.what {
            What::Volume(detail, blending) => Some((detail, blending, l.fade)),
            _ => None,
        });
        if chosen.clone().next().is_some() {
            model.prepare(gpu, &frame.camera, chosen);
            drawn.cells += model.cells();
            drawn.bytes += model.bytes();
            drawn.calls += model.calls();
        }
    }
    drawn
}
