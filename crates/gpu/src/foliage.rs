//! The foliage pass: a level's mesh, bent by the wind where its vertices are read.

use crate::MOST_LAYERS;
use crate::bind::{self, Kind};
use crate::device::Gpu;
use crate::error::GpuError;
use crate::frame::Stage;
use crate::materials::MaterialTables;
use crate::shader::Shader;
use bytemuck::{Pod, Zeroable};
use forest_foliage::{BranchPose, FoliageBlock, Posed, VertexRecord, Wind};
use forest_pack::Pack;
use forest_points::UvRange;
use forest_soup::Camera;
use wgpu::{
    BindGroup, BindGroupLayout, BindingResource, Buffer, BufferUsages, PrimitiveTopology,
    RenderPass, RenderPipeline, ShaderStages, Texture, TextureFormat, TextureViewDescriptor,
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
    zero: u32,
}

/// The foliage of a pack on a device, and what a frame needs of it.
#[derive(Debug)]
pub(crate) struct FoliageModel<'p> {
    pub(crate) block: FoliageBlock<'p>,
    /// First vertex and triangle of each level.
    firsts: Vec<[u32; 2]>,
    uniforms: [Buffer; MOST_LAYERS],
    poses: Buffer,
    groups: [BindGroup; MOST_LAYERS],
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
        let branches = gpu.storage("branches", &[bytemuck::cast_slice(block.branches)])?;
        let bytes = (block.branches.len() * size_of::<BranchPose>()) as u64;
        let poses = gpu.buffer("poses of branches", bytes, BufferUsages::STORAGE)?;
        let size = size_of::<FoliageUniform>() as u64;
        let uniform = || gpu.buffer("foliage", size, BufferUsages::UNIFORM);
        let uniforms = [uniform()?, uniform()?];
        let dictionary = dictionary.create_view(&TextureViewDescriptor::default());
        let groups = [0, 1].map(|slot| {
            let all = [
                vertices.as_entire_binding(),
                indices.as_entire_binding(),
                tables.materials.as_entire_binding(),
                tables.images.as_entire_binding(),
                branches.as_entire_binding(),
                BindingResource::TextureView(&tables.sheet),
                poses.as_entire_binding(),
                uniforms[slot].as_entire_binding(),
                BindingResource::TextureView(&dictionary),
            ];
            bind::group(&gpu.device, "foliage", &pass.layout, &all)
        });
        let layers = Vec::with_capacity(MOST_LAYERS);
        Ok(Self { block, firsts, uniforms, poses, groups, layers })
    }

    pub(crate) fn stage(&self) -> Stage {
        let [low, high] = self.block.bounds();
        Stage { middle: 0.5 * (low + high), half_diagonal: 0.5 * low.distance(high) }
    }

    /// Uploads what `layers` draw for `camera`: levels and fades.
    pub(crate) fn prepare(
        &mut self,
        gpu: &Gpu,
        camera: &Camera,
        wind: &Wind,
        layers: impl Iterator<Item = (usize, [f32; 2])>,
    ) {
        self.layers.clear();
        let posed = Posed::new(&self.block, wind, 0.0, camera.eye);
        let poses = &posed.pose().branches;
        gpu.queue.write_buffer(&self.poses, 0, bytemuck::cast_slice(poses));
        let (flutter, swing) = posed.flutter();
        for (slot, (level, fade)) in layers.take(MOST_LAYERS).enumerate() {
            let [first_vertex, first_triangle] = self.firsts[level];
            let uniform = FoliageUniform {
                origin: (self.block.origin() - camera.eye).as_vec3().to_array(),
                pivot_step: self.block.header.pivot_step as f32,
                fade,
                first_vertex,
                first_triangle,
                flutter,
                swing,
                windy: (wind.strength > 0.0).into(),
                zero: 0,
            };
            gpu.queue.write_buffer(&self.uniforms[slot], 0, bytemuck::bytes_of(&uniform));
            self.layers.push(level);
        }
    }

    fn levels(&self) -> impl Iterator<Item = &forest_foliage::LevelHeader> {
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
    pipeline: RenderPipeline,
}

impl FoliagePass {
    pub(crate) fn new(gpu: &Gpu, frame_layout: &BindGroupLayout) -> Self {
        let device = &gpu.device;
        let r = Kind::Read;
        let kinds = [r, r, r, r, r, Kind::TextureArray, r, Kind::Uniform, Kind::Texture];
        let layout = bind::layout(device, "foliage", ShaderStages::VERTEX_FRAGMENT, &kinds);
        let pipeline = crate::pipeline::opaque(
            device,
            &Shader::Foliage.module(device),
            &crate::pipeline::layout(device, &[frame_layout, &layout]),
            ["vertex", "fragment"],
            PrimitiveTopology::TriangleList,
        );
        Self { layout, pipeline }
    }

    pub(crate) fn draw(&self, pass: &mut RenderPass, model: &FoliageModel) {
        pass.set_pipeline(&self.pipeline);
        for (slot, level) in model.levels().enumerate() {
            pass.set_bind_group(1, &model.groups[slot], &[]);
            let mut first = 0;
            for draw in &level.draws {
                let end = first + 3 * draw.triangles;
                let material = u32::from(draw.material);
                pass.draw(first..end, material..material + 1);
                first = end;
            }
        }
    }
}
