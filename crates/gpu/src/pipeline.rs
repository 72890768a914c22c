//! Render pipelines: all draw into the samples of a [`crate::Target`].

use crate::target::{COLOR, DEPTH};
use wgpu::{
    BindGroupLayout, BlendState, ColorTargetState, ColorWrites, CompareFunction, DepthStencilState,
    Device, FragmentState, PipelineLayout, PipelineLayoutDescriptor, PrimitiveState,
    PrimitiveTopology, RenderPipeline, RenderPipelineDescriptor, ShaderModule, VertexState,
};

pub(crate) fn layout(device: &Device, groups: &[&BindGroupLayout]) -> PipelineLayout {
    let groups: Vec<Option<&BindGroupLayout>> = groups.iter().map(|g| Some(*g)).collect();
    device.create_pipeline_layout(&PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &groups,
        immediate_size: 0,
    })
}

/// Triangles that hide what is behind them.
pub(crate) fn opaque(
    device: &Device,
    module: &ShaderModule,
    layout: &PipelineLayout,
    entries: [&str; 2],
    topology: PrimitiveTopology,
) -> RenderPipeline {
    let nearer = CompareFunction::Greater;
    build(device, module, layout, entries, topology, None, Some(nearer))
}

/// A triangle about the picture that covers whatever is there.
pub(crate) fn covering(
    device: &Device,
    module: &ShaderModule,
    layout: &PipelineLayout,
) -> RenderPipeline {
    let entries = ["vertex", "fragment"];
    let list = PrimitiveTopology::TriangleList;
    build(device, module, layout, entries, list, None, Some(CompareFunction::Always))
}

/// Strips of premultiplied colours, each over what was drawn before, hidden by what is opaque.
pub(crate) fn blended(
    device: &Device,
    module: &ShaderModule,
    layout: &PipelineLayout,
    entries: [&str; 2],
) -> RenderPipeline {
    let strip = PrimitiveTopology::TriangleStrip;
    let over = Some(BlendState::PREMULTIPLIED_ALPHA_BLENDING);
    build(device, module, layout, entries, strip, over, None)
}

/// A triangle about a picture of this format, without depth.
pub(crate) fn full(
    device: &Device,
    module: &ShaderModule,
    layout: &PipelineLayout,
    format: wgpu::TextureFormat,
) -> RenderPipeline {
    let target = ColorTargetState { format, blend: None, write_mask: ColorWrites::ALL };
    let entries = ["vertex", "fragment"];
    let primitive = PrimitiveTopology::TriangleList;
    describe(device, module, layout, entries, primitive, target, None)
}

fn build(
    device: &Device,
    module: &ShaderModule,
    layout: &PipelineLayout,
    entries: [&str; 2],
    topology: PrimitiveTopology,
    blend: Option<BlendState>,
    written: Option<CompareFunction>,
) -> RenderPipeline {
    let target = ColorTargetState { format: COLOR, blend, write_mask: ColorWrites::ALL };
    let depth = DepthStencilState {
        format: DEPTH,
        depth_write_enabled: Some(written.is_some()),
        // 1 is near. Of equal depths the first wins.
        depth_compare: Some(written.unwrap_or(CompareFunction::Greater)),
        stencil: Default::default(),
        bias: Default::default(),
    };
    describe(device, module, layout, entries, topology, target, Some(depth))
}

fn describe(
    device: &Device,
    module: &ShaderModule,
    layout: &PipelineLayout,
    [vertex, fragment]: [&str; 2],
    topology: PrimitiveTopology,
    target: ColorTargetState,
    depth_stencil: Option<DepthStencilState>,
) -> RenderPipeline {
    device.create_render_pipeline(&RenderPipelineDescriptor {
        label: Some(vertex),
        layout: Some(layout),
        vertex: VertexState {
            module,
            entry_point: Some(vertex),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: PrimitiveState { topology, ..Default::default() },
        depth_stencil,
        multisample: Default::default(),
        fragment: Some(FragmentState {
            module,
            entry_point: Some(fragment),
            compilation_options: Default::default(),
            targets: &[Some(target)],
        }),
        multiview_mask: None,
        cache: None,
    })
}
