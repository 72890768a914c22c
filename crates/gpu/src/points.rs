//! The points pass: small points by a compute shader, large ones as quads, triangles beyond.

use crate::bind::{self, Kind};
use crate::device::Gpu;
use crate::error::GpuError;
use crate::foliage::FoliageModel;
use crate::frame::Stage;
use crate::renderer::Options;
use crate::shader::Shader;
use crate::target::{Target, TargetLayouts};
use crate::triangles::TrianglesModel;
use crate::wind;
use crate::{CHUNK, MOST_LAYERS};
use bytemuck::{Pod, Zeroable};
use forest_foliage::{PointsWind, Sway};
use forest_pack::Pack;
use forest_points::{
    CellRecord, Cut, Order, PixelArea, PointRecord, PointsBlock, SizeCode, Thresholds,
    TriangleRecord, select_into,
};
use forest_soup::Camera;
use wgpu::{
    BindGroup, BindGroupLayout, BindingResource, Buffer, BufferUsages, CommandEncoder,
    ComputePassDescriptor, ComputePipeline, ComputePipelineDescriptor, Features,
    PipelineCompilationOptions, PrimitiveTopology, RenderPass, RenderPipeline, ShaderStages,
};

const STRIP: PrimitiveTopology = PrimitiveTopology::TriangleStrip;

/// 64-bit atomics.
pub(crate) const WIDE: Features =
    Features::SHADER_INT64.union(Features::SHADER_INT64_ATOMIC_MIN_MAX);

/// Most large points of a picture that are drawn as quads; what is beyond takes the slow way.
const MOST_LARGE: u64 = 1 << 20;

/// Bytes before the list of large points: the arguments of the draw.
const LIST_START: u64 = 16;

/// `Cell` of cell.wgsl.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct CellUniform {
    origin: [f32; 3],
    step: f32,
    fine: i32,
    coarse: i32,
    fade: [f32; 2],
    turn: [f32; 2],
    size: f32,
    radii: u32,
    first_point: u32,
    first_triangle: u32,
    mask: u32,
    clump: f32,
    cut: f32,
    foot: f32,
    lean: [f32; 2],
}

/// `Chunk` of chunk.wgsl.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct ChunkRecord {
    cell: u32,
    first: u32,
    count: u32,
    zero: u32,
}

/// The points of a pack on a device, and what a frame needs of them.
#[derive(Debug)]
pub(crate) struct PointsModel<'p> {
    pub(crate) block: PointsBlock<'p>,
    pub(crate) triangles: Option<TrianglesModel>,
    cells: Buffer,
    chunks: Buffer,
    large: Buffer,
    splat_group: BindGroup,
    draw_group: BindGroup,
    /// What moves points, and corners of triangles.
    wind_groups: [BindGroup; 2],
    /// They hang on the pack's branches.
    pub(crate) is_tied: bool,
    frame: PointsFrame,
}

/// What is drawn of the points; kept from frame to frame.
#[derive(Debug, Default)]
struct PointsFrame {
    cut: Cut,
    cells: Vec<CellUniform>,
    chunks: Vec<ChunkRecord>,
    dispatch: [u32; 2],
    /// Triangles and the cell they are of.
    draws: Vec<(std::ops::Range<u32>, u32)>,
    drawn: PointsDrawn,
}

/// What a frame of points took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct PointsDrawn {
    /// Points that are looked at: a few more than are drawn.
    pub(crate) points: u64,
    pub(crate) triangles: u64,
}

impl<'p> PointsModel<'p> {
    pub(crate) fn load(
        gpu: &Gpu,
        pass: &PointsPass,
        pack: &'p Pack,
        foliage: Option<&FoliageModel>,
    ) -> Result<Self, GpuError> {
        let block = PointsBlock::open(pack)?;
        let bytes = |n: usize, size: usize| n as u64 * MOST_LAYERS as u64 * size as u64;
        let points = gpu.storage("points", &[bytemuck::cast_slice(block.points)])?;
        let storage = BufferUsages::STORAGE;
        let rows = bytes(block.cells.len(), size_of::<CellUniform>());
        let cells = gpu.buffer("cells of points", rows, storage)?;
        // Dispatches are rectangles: up to twice as many chunks are asked for.
        let most: u32 = block.cells.iter().map(|c| c.points.div_ceil(CHUNK)).sum();
        let rows = (padded(most as usize * MOST_LAYERS) * size_of::<ChunkRecord>()) as u64;
        let chunks = gpu.buffer("chunks of points", rows, storage)?;
        let most = block.points.len() as u64 * MOST_LAYERS as u64;
        let list = most.min(MOST_LARGE) * 8 + LIST_START;
        let large = gpu.buffer("large points", list, storage | BufferUsages::INDIRECT)?;
        let radii: Vec<f32> = (0..=SizeCode::INFINITE.bits())
            .filter_map(SizeCode::from_bits)
            .map(|code| (block.radius_of(code) * block.scale()) as f32)
            .collect();
        let radii = gpu.storage("radii", &[bytemuck::cast_slice(&radii)])?;
        fn whole(b: &Buffer) -> BindingResource<'_> {
            b.as_entire_binding()
        }
        let splat_group = bind::group(
            &gpu.device,
            "points, splatted",
            &pass.splat_layout,
            &[&points, &cells, &radii, &chunks, &large].map(whole),
        );
        let draw_group = bind::group(
            &gpu.device,
            "points, drawn",
            &pass.draw_layout,
            &[&points, &cells, &radii, &large].map(whole),
        );
        let triangles = match block.triangles.is_empty() {
            true => None,
            false => {
                Some(TrianglesModel::load(gpu, &pass.triangles_layout, pack, &block, &cells, None)?)
            }
        };
        let hung = match foliage {
            Some(f) => PointsWind::read(pack, &block, f.block.branches.len())?,
            None => None,
        };
        let wind = foliage.map(|f| &f.wind);
        let hung = hung.as_ref().map(|h| [&*h.points, h.corners.as_flattened()]);
        let group = |k: usize| wind::group(gpu, &pass.wind_layout, wind.zip(hung.map(|h| h[k])));
        let wind_groups = [group(0)?, group(1)?];
        Ok(Self {
            is_tied: hung.is_some(),
            block,
            triangles,
            cells,
            chunks,
            large,
            splat_group,
            draw_group,
            wind_groups,
            frame: PointsFrame::default(),
        })
    }

    /// Half the diagonal and the middle of the block.
    pub(crate) fn stage(&self) -> Stage {
        Stage { middle: self.block.middle(), half_diagonal: self.block.half_diagonal() }
    }

    /// Chooses and uploads what `layers` draw for `camera`.
    pub(crate) fn prepare(
        &mut self,
        gpu: &Gpu,
        camera: &Camera,
        sway: &Sway,
        layers: impl Iterator<Item = (Thresholds, [f32; 2])>,
    ) {
        let (block, frame) = (&self.block, &mut self.frame);
        frame.cells.clear();
        frame.chunks.clear();
        frame.draws.clear();
        frame.drawn = PointsDrawn::default();
        for (mut thresholds, fade) in layers.take(MOST_LAYERS) {
            // Without triangles points are drawn however large.
            if block.triangles.is_empty() {
                thresholds.largest = PixelArea(f64::INFINITY);
            }
            select_into(block, camera, &thresholds, &mut frame.cut);
            for cut in &frame.cut.cells {
                let cell = frame.cells.len() as u32;
                let record = &block.cells[cut.cell as usize];
                let all = block.header.order == Order::Paper;
                let code = |c| if all { i32::MAX } else { c };
                frame.cells.push(CellUniform {
                    fine: code(cut.fine),
                    coarse: code(cut.coarse),
                    fade,
                    first_point: block.point_offset(cut.cell),
                    first_triangle: block.triangle_offset(cut.cell),
                    ..cell_uniform(block, record, camera, sway)
                });
                for first in cut.points.clone().step_by(CHUNK as usize) {
                    let count = CHUNK.min(cut.points.end - first);
                    frame.chunks.push(ChunkRecord { cell, first, count, zero: 0 });
                }
                frame.drawn.points += cut.points.len() as u64;
                frame.drawn.triangles += cut.triangles.len() as u64;
                if !cut.triangles.is_empty() {
                    frame.draws.push((cut.triangles.clone(), cell));
                }
            }
        }
        let across = MOST_GROUPS.min(frame.chunks.len());
        let down = frame.chunks.len().div_ceil(across.max(1));
        frame.dispatch = [across as u32, down as u32];
        frame.chunks.resize(across * down, ChunkRecord::zeroed());
        gpu.queue.write_buffer(&self.cells, 0, bytemuck::cast_slice(&frame.cells));
        gpu.queue.write_buffer(&self.chunks, 0, bytemuck::cast_slice(&frame.chunks));
        // Four corners, no instance yet.
        gpu.queue.write_buffer(&self.large, 0, bytemuck::cast_slice(&[4u32, 0, 0, 0]));
    }

    /// What the last frame took.
    pub(crate) fn drawn(&self) -> PointsDrawn {
        self.frame.drawn
    }

    /// Draw calls and dispatches of the last frame.
    pub(crate) fn calls(&self) -> u64 {
        self.frame.draws.len() as u64 + 3
    }

    /// Bytes of the records that are looked at.
    pub(crate) fn bytes(&self) -> u64 {
        self.frame.drawn.points * size_of::<PointRecord>() as u64
            + self.frame.drawn.triangles * size_of::<TriangleRecord>() as u64
    }
}

/// Most workgroups along an axis of a dispatch, by WebGPU's limits.
const MOST_GROUPS: usize = 65_535;

/// As many chunks as a dispatch of `n` has at most.
fn padded(n: usize) -> usize {
    n.next_multiple_of(MOST_GROUPS.min(n.max(1)))
}

fn cell_uniform(
    block: &PointsBlock,
    cell: &CellRecord,
    camera: &Camera,
    sway: &Sway,
) -> CellUniform {
    // In f64 down to the eye: blocks far from the world's zero lose nothing.
    let zero = block.to_world(block.position(cell, [0; 3])) - camera.eye;
    CellUniform {
        origin: zero.as_vec3().to_array(),
        step: (block.step(cell) * block.scale()) as f32,
        fine: 0,
        coarse: 0,
        fade: [0.0; 2],
        turn: [1.0, 0.0],
        size: 1.0,
        radii: 0,
        first_point: 0,
        first_triangle: 0,
        mask: 0,
        clump: 0.0,
        cut: f32::NEG_INFINITY,
        foot: (f64::from(sway.foot) - camera.eye.y) as f32,
        lean: sway.lean.to_array(),
    }
}

/// The pipelines.
#[derive(Debug)]
pub(crate) struct PointsPass {
    /// One run with 64-bit atomics, two without.
    splat: Vec<ComputePipeline>,
    large: RenderPipeline,
    small: RenderPipeline,
    triangles: RenderPipeline,
    splat_layout: BindGroupLayout,
    draw_layout: BindGroupLayout,
    triangles_layout: BindGroupLayout,
    wind_layout: BindGroupLayout,
}

impl PointsPass {
    pub(crate) fn new(
        gpu: &Gpu,
        frame_layout: &BindGroupLayout,
        targets: &TargetLayouts,
        options: &Options,
    ) -> Self {
        let device = &gpu.device;
        let wide = !options.narrow_atomics && gpu.has(WIDE);
        let (r, w) = (Kind::Read, Kind::Write);
        let stages = ShaderStages::COMPUTE;
        let splat_layout = bind::layout(device, "points, splatted", stages, &[r, r, r, r, w]);
        let stages = ShaderStages::VERTEX_FRAGMENT;
        let draw_layout = bind::layout(device, "points, drawn", stages, &[r, r, r, r]);
        let triangles_layout =
            bind::layout(device, "triangles", stages, &[r, r, r, r, r, Kind::TextureArray]);
        let all = ShaderStages::VERTEX_FRAGMENT | ShaderStages::COMPUTE;
        let wind_layout = wind::layout(gpu, all);
        let groups = [frame_layout, &splat_layout, &targets.splat, &wind_layout];
        let layout = crate::pipeline::layout(device, &groups);
        let module = if wide { Shader::Splat64 } else { Shader::Splat32 }.module(device);
        let splat = |run: f64| {
            let most = ("SPLAT_MOST", f64::from(options.splat_most));
            let constants = [most, ("RUN", run)];
            device.create_compute_pipeline(&ComputePipelineDescriptor {
                label: Some("splat"),
                layout: Some(&layout),
                module: &module,
                entry_point: Some("splat"),
                compilation_options: PipelineCompilationOptions {
                    constants: if wide { &constants[..1] } else { &constants },
                    ..Default::default()
                },
                cache: None,
            })
        };
        let runs: &[f64] = if wide { &[0.0] } else { &[0.0, 1.0] };
        let module = Shader::Points.module(device);
        let groups = [frame_layout, &draw_layout, &targets.found, &wind_layout];
        let layout = crate::pipeline::layout(device, &groups);
        let draw = |vertex, fragment| {
            crate::pipeline::opaque(device, &module, &layout, [vertex, fragment], STRIP)
        };
        let groups = [frame_layout, &triangles_layout, &targets.found, &wind_layout];
        let by_triangle = crate::pipeline::layout(device, &groups);
        Self {
            splat: runs.iter().map(|run| splat(*run)).collect(),
            large: draw("large_vertex", "large_fragment"),
            small: draw("full_vertex", "small_fragment"),
            triangles: crate::pipeline::opaque(
                device,
                &Shader::Triangles.module(device),
                &by_triangle,
                ["vertex", "fragment"],
                PrimitiveTopology::TriangleList,
            ),
            splat_layout,
            draw_layout,
            triangles_layout,
            wind_layout,
        }
    }

    /// Splats the small points into the target's buffer, and lists the large ones.
    pub(crate) fn splat(
        &self,
        encoder: &mut CommandEncoder,
        frame_group: &BindGroup,
        model: &PointsModel,
        target: &Target,
    ) {
        encoder.clear_buffer(&target.kept, 0, None);
        let [across, down] = model.frame.dispatch;
        for pipeline in &self.splat {
            let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor::default());
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, frame_group, &[]);
            pass.set_bind_group(1, &model.splat_group, &[]);
            pass.set_bind_group(2, &target.splat_group, &[]);
            pass.set_bind_group(3, &model.wind_groups[0], &[]);
            pass.dispatch_workgroups(across, down, 1);
        }
    }

    /// Draws triangles, large points, and what the splats found.
    pub(crate) fn draw(&self, pass: &mut RenderPass, model: &PointsModel, target: &Target) {
        pass.set_bind_group(2, &target.found_group, &[]);
        if let Some(triangles) = &model.triangles {
            pass.set_bind_group(3, &model.wind_groups[1], &[]);
            pass.set_pipeline(&self.triangles);
            pass.set_bind_group(1, triangles.group(), &[]);
            for (range, cell) in &model.frame.draws {
                pass.draw(3 * range.start..3 * range.end, *cell..cell + 1);
            }
        }
        pass.set_bind_group(1, &model.draw_group, &[]);
        pass.set_bind_group(3, &model.wind_groups[0], &[]);
        pass.set_pipeline(&self.large);
        pass.draw_indirect(&model.large, 0);
        pass.set_pipeline(&self.small);
        pass.draw(0..3, 0..1);
    }
}
