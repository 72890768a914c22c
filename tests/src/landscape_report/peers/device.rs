//! Buffers, groups and pipelines without their ceremony.

use forest_gpu::Gpu;
use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindGroupLayoutDescriptor,
    BindGroupLayoutEntry, BindingResource, BindingType, Buffer, BufferBindingType,
    BufferDescriptor, BufferUsages, ColorTargetState, ColorWrites, CompareFunction,
    DepthStencilState, Extent3d, FragmentState, PipelineLayoutDescriptor, PrimitiveState,
    PrimitiveTopology, RenderPipeline, RenderPipelineDescriptor, SamplerBindingType, ShaderModule,
    ShaderModuleDescriptor, ShaderSource, ShaderStages, Texture, TextureDescriptor,
    TextureDimension, TextureFormat, TextureSampleType, TextureUsages, TextureViewDimension,
    VertexBufferLayout, VertexState,
};

pub(crate) const COLOR: TextureFormat = TextureFormat::Rgba16Float;
pub(crate) const DEPTH: TextureFormat = TextureFormat::Depth32Float;
pub(crate) const PICTURE: TextureFormat = TextureFormat::Rgba32Float;

/// What a binding is.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Kind {
    Uniform,
    Read,
    Texture,
    Array,
    Sampler,
    /// Texels that are loaded.
    Texels,
}

/// The layout of a group whose binding number i is `kinds[i]`.
pub(crate) fn layout(gpu: &Gpu, kinds: &[Kind]) -> BindGroupLayout {
    let buffer = |ty| BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    let texture = |filterable, view_dimension| BindingType::Texture {
        sample_type: TextureSampleType::Float { filterable },
        view_dimension,
        multisampled: false,
    };
    let entry = |(binding, kind): (u32, &Kind)| BindGroupLayoutEntry {
        binding,
        visibility: ShaderStages::VERTEX_FRAGMENT,
        ty: match kind {
            Kind::Uniform => buffer(BufferBindingType::Uniform),
            Kind::Read => buffer(BufferBindingType::Storage { read_only: true }),
            Kind::Texture => texture(true, TextureViewDimension::D2),
            Kind::Array => texture(true, TextureViewDimension::D2Array),
            Kind::Sampler => BindingType::Sampler(SamplerBindingType::Filtering),
            Kind::Texels => texture(false, TextureViewDimension::D2),
        },
        count: None,
    };
    let entries: Vec<BindGroupLayoutEntry> = (0..).zip(kinds).map(entry).collect();
    let label = Some("peer");
    gpu.device.create_bind_group_layout(&BindGroupLayoutDescriptor { label, entries: &entries })
}

/// A group whose binding number i is `resources[i]`.
pub(crate) fn group(
    gpu: &Gpu,
    layout: &BindGroupLayout,
    resources: &[BindingResource],
) -> BindGroup {
    let entries: Vec<BindGroupEntry> = (0..)
        .zip(resources)
        .map(|(binding, r)| BindGroupEntry { binding, resource: r.clone() })
        .collect();
    let label = Some("peer");
    gpu.device.create_bind_group(&BindGroupDescriptor { label, layout, entries: &entries })
}

/// An empty buffer; its size is at least a record's.
pub(crate) fn empty(gpu: &Gpu, size: u64, usage: BufferUsages) -> Buffer {
    gpu.device.create_buffer(&BufferDescriptor {
        label: Some("peer"),
        size: size.next_multiple_of(16).max(64),
        usage: usage | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

/// A buffer of these bytes.
pub(crate) fn filled(gpu: &Gpu, bytes: &[u8], usage: BufferUsages) -> Buffer {
    let buffer = empty(gpu, bytes.len() as u64, usage);
    gpu.queue.write_buffer(&buffer, 0, bytes);
    buffer
}

pub(crate) fn module(gpu: &Gpu, parts: &[&str]) -> ShaderModule {
    let source = ShaderSource::Wgsl(parts.concat().into());
    gpu.device.create_shader_module(ShaderModuleDescriptor { label: Some("peer"), source })
}

/// What a pipeline draws.
pub(crate) struct Draws<'a> {
    pub(crate) module: &'a ShaderModule,
    pub(crate) fragment: &'a str,
    pub(crate) groups: &'a [&'a BindGroupLayout],
    pub(crate) vertices: &'a [Option<VertexBufferLayout<'a>>],
    pub(crate) topology: PrimitiveTopology,
    pub(crate) format: TextureFormat,
    /// 1 is near.
    pub(crate) depth: Option<CompareFunction>,
}

pub(crate) fn pipeline(gpu: &Gpu, draws: &Draws) -> RenderPipeline {
    let groups: Vec<Option<&BindGroupLayout>> = draws.groups.iter().map(|g| Some(*g)).collect();
    let layout = gpu.device.create_pipeline_layout(&PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &groups,
        immediate_size: 0,
    });
    let target =
        ColorTargetState { format: draws.format, blend: None, write_mask: ColorWrites::ALL };
    gpu.device.create_render_pipeline(&RenderPipelineDescriptor {
        label: Some("peer"),
        layout: Some(&layout),
        vertex: VertexState {
            module: draws.module,
            entry_point: Some("vertex"),
            compilation_options: Default::default(),
            buffers: draws.vertices,
        },
        // Every surface is seen from both sides.
        primitive: PrimitiveState { topology: draws.topology, ..Default::default() },
        depth_stencil: draws.depth.map(|compare| DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(compare == CompareFunction::Greater),
            depth_compare: Some(compare),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: Default::default(),
        fragment: Some(FragmentState {
            module: draws.module,
            entry_point: Some(draws.fragment),
            compilation_options: Default::default(),
            targets: &[Some(target)],
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// What is drawn into, or read.
pub(crate) fn target(gpu: &Gpu, [width, height]: [u32; 2], format: TextureFormat) -> Texture {
    gpu.device.create_texture(&TextureDescriptor {
        label: Some("peer"),
        size: Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format,
        usage: TextureUsages::RENDER_ATTACHMENT
            | TextureUsages::TEXTURE_BINDING
            | TextureUsages::COPY_SRC,
        view_formats: &[],
    })
}
