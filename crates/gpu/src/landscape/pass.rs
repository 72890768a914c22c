//! The pipelines of landscapes, and how a frame is put together.

use crate::bind::{self, Kind};
use crate::device::Gpu;
use crate::error::GpuError;
use crate::landscape::frame::LandscapeDetail;
use crate::landscape::impostors::{Impostors, SORTED_AT_ONCE};
use crate::landscape::model::{Landscape, WORK_HEAD};
use crate::landscape::target::LandscapeTarget;
use crate::landscape::{MOST_BANDS, PATCH_VERTICES};
use crate::pipeline;
use crate::points::WIDE;
use crate::renderer::Options;
use crate::shader::{Shader, Step};
use crate::target::TargetLayouts;
use crate::timer::Timer;
use forest_soup::{Camera, Projection};
use wgpu::{
    BindGroup, BindGroupLayout, BindingResource, Buffer, Color, CommandEncoder, ComputePass,
    ComputePipeline, ComputePipelineDescriptor, LoadOp, Operations, PipelineCompilationOptions,
    PrimitiveTopology, RenderPass, RenderPassColorAttachment, RenderPassDepthStencilAttachment,
    RenderPassDescriptor, RenderPipeline, ShaderModule, ShaderStages, StoreOp,
};

/// Bands of a frame, where points leave colours at once.
const BANDS: usize = 8;

const _: () = assert!(BANDS <= MOST_BANDS);

/// Storage buffers that a shader binds.
const STORAGE_BUFFERS: u32 = 16;

/// The layouts of a landscape's groups.
#[derive(Debug)]
pub(crate) struct Layouts {
    pub(crate) land: BindGroupLayout,
    pub(crate) ground: BindGroupLayout,
    pub(crate) start: BindGroupLayout,
    pub(crate) near: BindGroupLayout,
    pub(crate) choose: BindGroupLayout,
    pub(crate) steps: BindGroupLayout,
    pub(crate) splat: BindGroupLayout,
    pub(crate) found: BindGroupLayout,
    pub(crate) large: BindGroupLayout,
    pub(crate) triangles: BindGroupLayout,
    pub(crate) sort: BindGroupLayout,
    pub(crate) impostors: BindGroupLayout,
}

impl Layouts {
    fn new(gpu: &Gpu) -> Self {
        let (r, w, u) = (Kind::Read, Kind::Write, Kind::Uniform);
        let drawn = ShaderStages::VERTEX_FRAGMENT;
        let compute = ShaderStages::COMPUTE;
        let layout =
            |label, stages, kinds: &[Kind]| bind::layout(&gpu.device, label, stages, kinds);
        let choose = [r, r, r, r, r, r, w, w, w, r, r, w, w];
        let pages = Kind::TextureArray;
        Self {
            land: layout("land", drawn | compute, &[u, u, r, r]),
            ground: layout("ground", drawn, &[r, r, u]),
            start: layout("start", compute, &[w, Kind::Texture]),
            near: layout("nearness", compute, &[r, w]),
            choose: layout("choose", compute, &choose),
            steps: layout("steps", compute, &[w, w]),
            splat: layout("splat", compute, &[r, r, r, r, w, r, r]),
            found: layout("found", drawn, &[r]),
            large: layout("large points", drawn, &[r, r, r, r]),
            triangles: layout("triangles of trees", drawn, &[r, r, r, r, r, pages, r]),
            sort: layout("sort", compute, &[w, w, w]),
            impostors: layout("impostors", drawn, &[r, r, r, r, r, r, r, pages, pages]),
        }
    }
}

/// The pipelines of landscapes on a device.
#[derive(Debug)]
pub struct LandscapeRenderer {
    pub(crate) layouts: Layouts,
    pub(crate) targets: TargetLayouts,
    ground: RenderPipeline,
    start: ComputePipeline,
    blocks: ComputePipeline,
    levels: ComputePipeline,
    /// One run with 64-bit atomics, two without.
    cull: Vec<ComputePipeline>,
    choose: ComputePipeline,
    splat: Vec<ComputePipeline>,
    between: [ComputePipeline; 3],
    sort: [ComputePipeline; 2],
    resolve: RenderPipeline,
    large: RenderPipeline,
    triangles: RenderPipeline,
    impostors: RenderPipeline,
}

impl LandscapeRenderer {
    /// Builds the pipelines.
    ///
    /// # Errors
    /// When the device refuses one, or binds too few buffers.
    pub fn new(gpu: &Gpu, options: &Options) -> Result<Self, GpuError> {
        let most = gpu.device.limits().max_storage_buffers_per_shader_stage;
        if most < STORAGE_BUFFERS {
            let missing = format!("{most} storage buffers a stage; {STORAGE_BUFFERS} are needed");
            return Err(GpuError::Unsuited { adapter: gpu.name(), missing });
        }
        let layouts = Layouts::new(gpu);
        let targets = TargetLayouts::new(gpu);
        let device = &gpu.device;
        let wide = !options.narrow_atomics && gpu.has(WIDE);
        let runs: &[f64] = if wide { &[0.0] } else { &[0.0, 1.0] };
        let module = |step| Shader::Landscape(step).module(device);
        let compute = |module: &ShaderModule,
                       entry: &str,
                       groups: &[&BindGroupLayout],
                       constants: &[(&str, f64)]| {
            device.create_compute_pipeline(&ComputePipelineDescriptor {
                label: Some(entry),
                layout: Some(&pipeline::layout(device, groups)),
                module,
                entry_point: Some(entry),
                compilation_options: PipelineCompilationOptions { constants, ..Default::default() },
                cache: None,
            })
        };
        let land = &layouts.land;
        let drawn = |step, groups: &[&BindGroupLayout], entries, topology| {
            let layout = pipeline::layout(device, groups);
            pipeline::opaque(device, &module(step), &layout, entries, topology)
        };
        let most = ("SPLAT_MOST", f64::from(options.splat_most));
        let near = module(Step::Nearness);
        let (choose, splat) = (module(Step::Choose(wide)), module(Step::Splat(wide)));
        let choosing = [land, &layouts.choose, &targets.splat];
        let splatting = [land, &layouts.splat, &targets.splat];
        let between = module(Step::Between);
        let step = |entry| compute(&between, entry, &[&layouts.steps], &[]);
        let sorting = module(Step::Sort);
        let sort = |entry| compute(&sorting, entry, &[&layouts.sort], &[]);
        let list = PrimitiveTopology::TriangleList;
        let plain = ["vertex", "fragment"];
        let renderer = Self {
            ground: drawn(Step::Ground, &[land, &layouts.ground], plain, list),
            start: compute(&module(Step::Start), "start", &[land, &layouts.start], &[]),
            blocks: compute(&near, "blocks", &[land, &layouts.near], &[]),
            levels: compute(&near, "levels", &[land, &layouts.near], &[]),
            cull: runs
                .iter()
                .map(|run| compute(&choose, "cull", &choosing, &[("RUN", *run)]))
                .collect(),
            choose: compute(&choose, "choose", &choosing, &[]),
            splat: runs
                .iter()
                .map(|run| compute(&splat, "splat", &splatting, &[most, ("RUN", *run)]))
                .collect(),
            between: [step("after_cull"), step("after_choose"), step("next_band")],
            sort: [sort("places"), sort("sort")],
            resolve: pipeline::covering(
                device,
                &module(Step::Resolve),
                &pipeline::layout(device, &[land, &layouts.found]),
            ),
            large: drawn(
                Step::Large,
                &[land, &layouts.large],
                ["large_vertex", "large_fragment"],
                PrimitiveTopology::TriangleStrip,
            ),
            impostors: drawn(
                Step::Impostors,
                &[land, &layouts.impostors],
                plain,
                PrimitiveTopology::TriangleStrip,
            ),
            triangles: drawn(Step::Triangles, &[land, &layouts.triangles], plain, list),
            layouts,
            targets,
        };
        gpu.finish()?;
        Ok(renderer)
    }

    /// Draws a landscape into `target`, which must have the size of the camera, and gives the work to
    /// the device without waiting for it. Parallel cameras see nothing.
    pub fn render(
        &self,
        gpu: &Gpu,
        landscape: &mut Landscape,
        target: &LandscapeTarget,
        camera: &Camera,
        detail: &LandscapeDetail,
        timer: Option<&Timer>,
    ) {
        if matches!(camera.projection, Projection::Orthographic { .. }) {
            return;
        }
        // Two runs know colours only when all depths are: no band can be before another.
        let bands = if self.splat.len() == 1 { BANDS } else { 1 };
        landscape.prepare(gpu, camera, detail, target.samples.side(), bands);
        gpu.queue.write_buffer(&target.nearness, 0, bytemuck::cast_slice(&target.head));
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        if let Some(timer) = timer {
            timer.begin(&mut encoder);
        }
        self.draw_ground(&mut encoder, landscape, target);
        self.splat_trees(gpu, &mut encoder, landscape, target, bands);
        self.draw_rest(&mut encoder, landscape, target);
        if let Some(timer) = timer {
            timer.end(&mut encoder);
        }
        let counted = WORK_HEAD as u64 * 4;
        encoder.copy_buffer_to_buffer(&landscape.work, 0, &landscape.counted, 0, counted);
        gpu.queue.submit([encoder.finish()]);
    }

    fn draw_ground(
        &self,
        encoder: &mut CommandEncoder,
        land: &Landscape,
        target: &LandscapeTarget,
    ) {
        let start = (LoadOp::Clear(Color::TRANSPARENT), LoadOp::Clear(0.0));
        let mut pass = begin(encoder, target, start);
        pass.set_pipeline(&self.ground);
        pass.set_bind_group(0, &land.land_group, &[]);
        pass.set_bind_group(1, &land.ground_group, &[]);
        pass.draw(0..PATCH_VERTICES, 0..land.patch_count);
    }

    fn splat_trees(
        &self,
        gpu: &Gpu,
        encoder: &mut CommandEncoder,
        land: &Landscape,
        target: &LandscapeTarget,
        bands: usize,
    ) {
        let group = |label, layout, buffers: &[Buffer], at: usize| {
            let mut all: Vec<BindingResource> =
                buffers.iter().map(Buffer::as_entire_binding).collect();
            all.insert(at, target.nearness.as_entire_binding());
            bind::group(&gpu.device, label, layout, &all)
        };
        let choose = group("choose", &self.layouts.choose, &land.choose, 9);
        let splat = group("splat", &self.layouts.splat, &land.splat, 6);
        let [width, height] = target.samples.size().map(|n| n * target.samples.side());
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_bind_group(0, &land.land_group, &[]);
        pass.set_bind_group(1, &target.start, &[]);
        pass.set_pipeline(&self.start);
        pass.dispatch_workgroups(width.div_ceil(8), height.div_ceil(8), 1);
        self.measure_nearness(&mut pass, target);
        for (b, [_, tiles, ..]) in land.bands.firsts.iter().copied().enumerate().take(bands) {
            if tiles > 0 {
                self.draw_band(&mut pass, land, target, [&choose, &splat], tiles);
                if b + 1 < bands {
                    self.measure_nearness(&mut pass, target);
                }
            }
            self.step(&mut pass, land, 2);
        }
        if land.has_views {
            let groups = (land.scene().trees.len() as u32).div_ceil(SORTED_AT_ONCE);
            let across = groups.clamp(1, u16::MAX.into());
            pass.set_bind_group(0, &land.impostors.sort_group, &[]);
            pass.set_pipeline(&self.sort[0]);
            pass.dispatch_workgroups(1, 1, 1);
            pass.set_pipeline(&self.sort[1]);
            pass.dispatch_workgroups(across, groups.div_ceil(across), 1);
        }
    }

    fn draw_band(
        &self,
        pass: &mut ComputePass,
        land: &Landscape,
        target: &LandscapeTarget,
        [choose, splat]: [&BindGroup; 2],
        tiles: u32,
    ) {
        let across = tiles.min(u16::MAX.into());
        let down = tiles.div_ceil(across);
        for (run, (cull, points)) in self.cull.iter().zip(&self.splat).enumerate() {
            pass.set_bind_group(0, &land.land_group, &[]);
            pass.set_bind_group(1, choose, &[]);
            pass.set_bind_group(2, &target.samples.splat_group, &[]);
            pass.set_pipeline(cull);
            pass.dispatch_workgroups(across, down, 1);
            if run == 0 {
                self.step(pass, land, 0);
                pass.set_bind_group(0, &land.land_group, &[]);
                pass.set_bind_group(1, choose, &[]);
                pass.set_pipeline(&self.choose);
                pass.dispatch_workgroups_indirect(&land.arguments, 0);
                self.step(pass, land, 1);
                pass.set_bind_group(0, &land.land_group, &[]);
            }
            pass.set_bind_group(1, splat, &[]);
            pass.set_pipeline(points);
            pass.dispatch_workgroups_indirect(&land.arguments, 16);
        }
    }

    fn step(&self, pass: &mut ComputePass, land: &Landscape, which: usize) {
        pass.set_pipeline(&self.between[which]);
        pass.set_bind_group(0, &land.steps_group, &[]);
        pass.dispatch_workgroups(1, 1, 1);
        pass.set_bind_group(0, &land.land_group, &[]);
    }

    fn measure_nearness(&self, pass: &mut ComputePass, target: &LandscapeTarget) {
        let [across, down] = target.blocks;
        pass.set_bind_group(1, &target.near, &[]);
        pass.set_pipeline(&self.blocks);
        pass.dispatch_workgroups(across.div_ceil(8), down.div_ceil(8), 1);
        pass.set_pipeline(&self.levels);
        pass.dispatch_workgroups(1, 1, 1);
    }

    fn draw_rest(&self, encoder: &mut CommandEncoder, land: &Landscape, target: &LandscapeTarget) {
        let mut pass = begin(encoder, target, (LoadOp::Load, LoadOp::Load));
        pass.set_bind_group(0, &land.land_group, &[]);
        pass.set_bind_group(1, &target.found, &[]);
        pass.set_pipeline(&self.resolve);
        pass.draw(0..3, 0..1);
        pass.set_pipeline(&self.triangles);
        for (i, triangles) in (0..).zip(&land.triangles) {
            if let Some(triangles) = triangles {
                pass.set_bind_group(1, triangles.group(), &[]);
                let draw = Impostors::draw_of_triangles(i);
                pass.draw_indirect(land.impostors.boards(), draw);
            }
        }
        if land.has_views {
            pass.set_bind_group(1, &land.impostors.group, &[]);
            pass.set_pipeline(&self.impostors);
            pass.draw_indirect(&land.impostors.draw, 0);
        }
        pass.set_bind_group(1, &land.large_group, &[]);
        pass.set_pipeline(&self.large);
        pass.draw_indirect(&land.large, 0);
    }
}

/// A pass on the target's colours and depths.
fn begin<'e>(
    encoder: &'e mut CommandEncoder,
    target: &LandscapeTarget,
    (color, depth): (LoadOp<Color>, LoadOp<f32>),
) -> RenderPass<'e> {
    encoder.begin_render_pass(&RenderPassDescriptor {
        label: Some("landscape"),
        color_attachments: &[Some(RenderPassColorAttachment {
            view: &target.samples.color_view,
            depth_slice: None,
            resolve_target: None,
            ops: Operations { load: color, store: StoreOp::Store },
        })],
        depth_stencil_attachment: Some(RenderPassDepthStencilAttachment {
            view: &target.depth,
            depth_ops: Some(Operations { load: depth, store: StoreOp::Store }),
            stencil_ops: None,
        }),
        timestamp_writes: None,
        occlusion_query_set: None,
        multiview_mask: None,
    })
}
