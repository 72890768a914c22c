//! The foliage pass: a level's mesh, bent by the wind where its vertices are read.

use crate::MOST_LAYERS;
use crate::bind::{self, Kind};
use crate::device::Gpu;
use crate::error::GpuError;
use crate::frame::{FrameUniform, Stage};
use crate::materials::MaterialTables;
use crate::shader::Shader;
use crate::target::{COLOR, DEPTH};
use crate::wind::WindModel;
use bytemuck::{Pod, Zeroable};
use forest_foliage::{FoliageBlock, LevelHeader, Posed, VertexRecord};
use forest_pack::Pack;
use forest_points::UvRange;
use forest_raster::{Light, SHADOW_BIAS, SHADOW_SIDE, sun_camera};
use forest_soup::Camera;
use glam::DVec3;
use wgpu::{
    BindGroup, BindGroupLayout, BindingResource, Buffer, BufferUsages, Color, CommandEncoder,
    LoadOp, Operations, PrimitiveTopology, RenderPass, RenderPassColorAttachment,
    RenderPassDepthStencilAttachment, RenderPassDescriptor, RenderPipeline, ShaderStages, StoreOp,
    Texture, TextureFormat, TextureView, TextureViewDescriptor,
};

/// `Foliage` of foliage.wgsl.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct FoliageUniform {
    origin: [f32; 3],
    pivot_step: f32,
    fade: [f32; 2],
    first_vertex: u32,
    first_triangle: u32,
    flutter: f32,
    swing: f32,
    windy: u32,
    sunlit: f32,
    turning: [f32; 3],
    through: f32,
}

/// `SunView` of foliage.wgsl.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct SunViewUniform {
    eye: [f32; 3],
    scale: f32,
    right: [f32; 3],
    side: f32,
    down: [f32; 3],
    bias: f32,
    forward: [f32; 3],
    near: f32,
    range: f32,
    zero: [f32; 3],
}

/// A shadow map for each layer, and what its pass binds.
#[derive(Debug)]
struct Shadow {
    /// Depths along the sun's axis, in two parts.
    maps: [TextureView; MOST_LAYERS],
    /// For the depth test.
    test: TextureView,
    /// The sun's camera: `Frame` of common.wgsl, and `SunView`.
    frame: Buffer,
    view: Buffer,
    frame_group: BindGroup,
    uniforms: [Buffer; MOST_LAYERS],
    groups: [BindGroup; MOST_LAYERS],
    /// A sun is there in this frame.
    drawn: bool,
}

/// The foliage of a pack on a device, and what a frame needs of it.
#[derive(Debug)]
pub(crate) struct FoliageModel<'p> {
    pub(crate) block: FoliageBlock<'p>,
    /// First vertex and triangle of each level.
    firsts: Vec<[u32; 2]>,
    uniforms: [Buffer; MOST_LAYERS],
    pub(crate) wind: WindModel,
    groups: [BindGroup; MOST_LAYERS],
    shadow: Shadow,
    /// Levels of the last frame.
    layers: Vec<usize>,
}

impl<'p> FoliageModel<'p> {
    pub(crate) fn load(gpu: &Gpu, pass: &FoliagePass, pack: &'p Pack) -> Result<Self, GpuError> {
        let block = FoliageBlock::open(pack)?;
        let (mut materials, mut textures) = block.materials()?;
        // The dictionary is a texture of its own.
        materials.pop();
        textures.pop();
        let plain = UvRange { min: [0.0; 2], step: [1.0; 2] };
        let ranges = vec![plain; materials.len()];
        let tables = MaterialTables::load(gpu, &materials, &textures, &ranges, true)?;
        let dictionary = dictionary(gpu, &block)?;
        let mut firsts = Vec::new();
        let mut at = [0u32; 2];
        for level in &block.header.levels {
            firsts.push(at);
            at = [at[0] + level.vertices, at[1] + level.triangles() as u32];
        }
        let vertices: Vec<&[u8]> = block.vertices.iter().map(|v| bytemuck::cast_slice(v)).collect();
        let indices: Vec<&[u8]> = block.indices.iter().map(|t| bytemuck::cast_slice(t)).collect();
        let vertices = gpu.storage("vertices", &vertices)?;
        let indices = gpu.storage("indices", &indices)?;
        let wind = WindModel::load(gpu, &block)?;
        let size = size_of::<FoliageUniform>() as u64;
        let uniform = || gpu.buffer("foliage", size, BufferUsages::UNIFORM);
        let (uniforms, shadow_uniforms) = ([uniform()?, uniform()?], [uniform()?, uniform()?]);
        let dictionary = dictionary.create_view(&TextureViewDescriptor::default());
        let target = |what, format| gpu.render_target(what, [SHADOW_SIDE; 2], format);
        let map = || target("shadow map", COLOR);
        let maps = [map()?, map()?];
        let test = target("depth of a shadow map", DEPTH)?;
        // A pass cannot read what it writes.
        let nothing = gpu.texture("no shadow map", [4, 4], 1, COLOR)?;
        let nothing = nothing.create_view(&TextureViewDescriptor::default());
        let size = |size| size as u64;
        let frame = size(size_of::<FrameUniform>());
        let frame = gpu.buffer("frame of a shadow map", frame, BufferUsages::UNIFORM)?;
        let view = size(size_of::<SunViewUniform>());
        let view = gpu.buffer("sun's view", view, BufferUsages::UNIFORM)?;
        let group = |uniform: &Buffer, map: &TextureView| {
            let all = [
                vertices.as_entire_binding(),
                indices.as_entire_binding(),
                tables.materials.as_entire_binding(),
                tables.images.as_entire_binding(),
                wind.branches.as_entire_binding(),
                BindingResource::TextureView(&tables.sheet),
                wind.poses.as_entire_binding(),
                uniform.as_entire_binding(),
                BindingResource::TextureView(&dictionary),
                view.as_entire_binding(),
                BindingResource::TextureView(map),
            ];
            bind::group(&gpu.device, "foliage", &pass.layout, &all)
        };
        let groups = [0, 1].map(|slot| group(&uniforms[slot], &maps[slot]));
        let shadow_groups = [0, 1].map(|slot| group(&shadow_uniforms[slot], &nothing));
        let frame_layout = &pass.frame_layout;
        let frame_group =
            bind::group(&gpu.device, "sun", frame_layout, &[frame.as_entire_binding()]);
        let shadow = Shadow {
            maps,
            test,
            frame,
            view,
            frame_group,
            uniforms: shadow_uniforms,
            groups: shadow_groups,
            drawn: false,
        };
        let layers = Vec::with_capacity(MOST_LAYERS);
        Ok(Self { block, firsts, uniforms, wind, groups, shadow, layers })
    }

    pub(crate) fn stage(&self) -> Stage {
        let [low, high] = self.block.bounds();
        Stage { middle: 0.5 * (low + high), half_diagonal: 0.5 * low.distance(high) }
    }

    /// Uploads what `layers` draw for `camera`: levels and fades; branches stand as `posed`, or at rest.
    pub(crate) fn prepare(
        &mut self,
        gpu: &Gpu,
        camera: &Camera,
        posed: Option<&Posed>,
        light: &Light,
        layers: impl Iterator<Item = (usize, [f32; 2])>,
    ) {
        self.layers.clear();
        let from_eye = |eye: DVec3| (self.block.origin() - eye).as_vec3().to_array();
        let sun = match light {
            Light::Sun(sun) => Some(sun_camera(self.block.bounds(), sun.to_sun)),
            Light::Albedo => None,
        };
        self.shadow.drawn = sun.is_some();
        if let Some(sun) = &sun {
            let stage = self.stage();
            let frame = FrameUniform::new(sun, &Light::Albedo, &stage);
            gpu.queue.write_buffer(&self.shadow.frame, 0, bytemuck::bytes_of(&frame));
            let view = sun_view(sun, camera, stage.half_diagonal, frame.range());
            gpu.queue.write_buffer(&self.shadow.view, 0, bytemuck::bytes_of(&view));
        }
        let (flutter, swing) = posed.map(Posed::flutter).unwrap_or_default();
        for (slot, (level, fade)) in layers.take(MOST_LAYERS).enumerate() {
            let [first_vertex, first_triangle] = self.firsts[level];
            let uniform = FoliageUniform {
                origin: from_eye(camera.eye),
                pivot_step: self.block.header.pivot_step as f32,
                fade,
                first_vertex,
                first_triangle,
                flutter,
                swing,
                windy: posed.is_some().into(),
                sunlit: self.block.header.levels[level].sunlit,
                turning: from_eye(camera.eye),
                through: self.block.header.translucency,
            };
            if let Some(sun) = &sun {
                let own = FoliageUniform { origin: from_eye(sun.eye), fade: [0.0, 1.0], ..uniform };
                let to = &self.shadow.uniforms[slot];
                gpu.queue.write_buffer(to, 0, bytemuck::bytes_of(&own));
            }
            gpu.queue.write_buffer(&self.uniforms[slot], 0, bytemuck::bytes_of(&uniform));
            self.layers.push(level);
        }
    }

    fn levels(&self) -> impl Iterator<Item = &LevelHeader> {
        self.layers.iter().map(|l| &self.block.header.levels[*l])
    }

    /// Triangles of the last frame.
    pub(crate) fn triangles(&self) -> u64 {
        self.levels().map(|l| l.triangles()).sum()
    }

    /// Bytes of the last frame's vertices and indices.
    pub(crate) fn bytes(&self) -> u64 {
        let vertex = size_of::<VertexRecord>() as u64;
        self.levels().map(|l| vertex * u64::from(l.vertices) + 12 * l.triangles()).sum()
    }

    /// Draw calls of the last frame.
    pub(crate) fn calls(&self) -> u64 {
        self.levels().map(|l| l.draws.len() as u64).sum()
    }
}

fn sun_view(
    sun: &Camera,
    camera: &Camera,
    half_diagonal: f64,
    [near, range]: [f32; 2],
) -> SunViewUniform {
    let vector = |v: DVec3| v.as_vec3().to_array();
    SunViewUniform {
        eye: vector(sun.eye - camera.eye),
        scale: sun.pixels_per_unit(1.0) as f32,
        right: vector(sun.right),
        side: SHADOW_SIDE as f32,
        down: vector(-sun.up),
        bias: (SHADOW_BIAS * half_diagonal) as f32,
        forward: vector(sun.forward),
        near,
        range,
        zero: [0.0; 3],
    }
}

/// The dictionary: as it is stored where the device reads its blocks, else decoded.
fn dictionary(gpu: &Gpu, block: &FoliageBlock) -> Result<Texture, GpuError> {
    let [width, height] = block.header.atlas;
    let (format, texels) = if block.header.blocks && gpu.takes_blocks() {
        (TextureFormat::Bc7RgbaUnormSrgb, block.stored()?.swap_remove(0).bytes.into_owned())
    } else {
        let texels = block.dictionary()?.texels;
        (TextureFormat::Rgba8UnormSrgb, texels.as_flattened().to_vec())
    };
    let texture = gpu.texture("dictionary", [width, height], 1, format)?;
    gpu.write_texels(&texture, [0; 3], [width, height, 1], &texels);
    Ok(texture)
}

/// The pass.
#[derive(Debug)]
pub(crate) struct FoliagePass {
    layout: BindGroupLayout,
    frame_layout: BindGroupLayout,
    pipeline: RenderPipeline,
    shadow: RenderPipeline,
}

impl FoliagePass {
    pub(crate) fn new(gpu: &Gpu, frame_layout: &BindGroupLayout) -> Self {
        let device = &gpu.device;
        let r = Kind::Read;
        let (u, t) = (Kind::Uniform, Kind::Texture);
        let kinds = [r, r, r, r, r, Kind::TextureArray, r, u, t, u, t];
        let layout = bind::layout(device, "foliage", ShaderStages::VERTEX_FRAGMENT, &kinds);
        let module = Shader::Foliage.module(device);
        let both = crate::pipeline::layout(device, &[frame_layout, &layout]);
        let list = PrimitiveTopology::TriangleList;
        let pipeline =
            crate::pipeline::opaque(device, &module, &both, ["vertex", "fragment"], list);
        let entries = ["vertex", "shadow_fragment"];
        let shadow = crate::pipeline::opaque(device, &module, &both, entries, list);
        Self { layout, frame_layout: frame_layout.clone(), pipeline, shadow }
    }

    /// Draws what the sun sees of each layer, if there is a sun.
    pub(crate) fn shade(&self, encoder: &mut CommandEncoder, model: &FoliageModel) {
        let shadow = &model.shadow;
        if !shadow.drawn {
            return;
        }
        // Beyond the range, where nothing is.
        let far = Color { r: 2.0, ..Color::BLACK };
        for (slot, level) in model.levels().enumerate() {
            let mut pass = encoder.begin_render_pass(&RenderPassDescriptor {
                label: Some("shadow map"),
                color_attachments: &[Some(RenderPassColorAttachment {
                    view: &shadow.maps[slot],
                    depth_slice: None,
                    resolve_target: None,
                    ops: Operations { load: LoadOp::Clear(far), store: StoreOp::Store },
                })],
                depth_stencil_attachment: Some(RenderPassDepthStencilAttachment {
                    view: &shadow.test,
                    depth_ops: Some(Operations {
                        load: LoadOp::Clear(0.0),
                        store: StoreOp::Discard,
                    }),
                    stencil_ops: None,
                }),
                timestamp_writes: None,
                occlusion_query_set: None,
                multiview_mask: None,
            });
            pass.set_bind_group(0, &shadow.frame_group, &[]);
            pass.set_pipeline(&self.shadow);
            draw_level(&mut pass, level, &shadow.groups[slot]);
        }
    }

    pub(crate) fn draw(&self, pass: &mut RenderPass, model: &FoliageModel) {
        pass.set_pipeline(&self.pipeline);
        for (slot, level) in model.levels().enumerate() {
            draw_level(pass, level, &model.groups[slot]);
        }
    }
}

fn draw_level(pass: &mut RenderPass, level: &LevelHeader, group: &BindGroup) {
    pass.set_bind_group(1, group, &[]);
    let mut first = 0;
    for draw in &level.draws {
        let end = first + 3 * draw.triangles;
        let material = u32::from(draw.material);
        pass.draw(first..end, material..material + 1);
        first = end;
    }
}
