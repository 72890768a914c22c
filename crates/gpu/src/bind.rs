//! Bind groups without their ceremony.

use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindGroupLayoutDescriptor,
    BindGroupLayoutEntry, BindingResource, BindingType, BufferBindingType, Device, ShaderStages,
    TextureSampleType, TextureViewDimension,
};

/// What a binding is; texels are only ever loaded, never filtered.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Kind {
    Uniform,
    Read,
    Write,
    Texture,
    TextureArray,
    Texture3d,
}

/// The layout of a group whose binding number i is `kinds[i]`.
pub(crate) fn layout(
    device: &Device,
    label: &str,
    stages: ShaderStages,
    kinds: &[Kind],
) -> BindGroupLayout {
    let buffer = |ty| BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    let texture = |view_dimension| BindingType::Texture {
        sample_type: TextureSampleType::Float { filterable: false },
        view_dimension,
        multisampled: false,
    };
    let entries: Vec<BindGroupLayoutEntry> = (0..)
        .zip(kinds)
        .map(|(binding, kind)| BindGroupLayoutEntry {
            binding,
            visibility: stages,
            ty: match kind {
                Kind::Uniform => buffer(BufferBindingType::Uniform),
                Kind::Read => buffer(BufferBindingType::Storage { read_only: true }),
                Kind::Write => buffer(BufferBindingType::Storage { read_only: false }),
                Kind::Texture => texture(TextureViewDimension::D2),
                Kind::TextureArray => texture(TextureViewDimension::D2Array),
                Kind::Texture3d => texture(TextureViewDimension::D3),
            },
            count: None,
        })
        .collect();
    device.create_bind_group_layout(&BindGroupLayoutDescriptor {
        label: Some(label),
        entries: &entries,
    })
}

/// A group whose binding number i is `resources[i]`.
pub(crate) fn group(
    device: &Device,
    label: &str,
    layout: &BindGroupLayout,
    resources: &[BindingResource],
) -> BindGroup {
    let entries: Vec<BindGroupEntry> = (0..)
        .zip(resources)
        .map(|(binding, resource)| BindGroupEntry { binding, resource: resource.clone() })
        .collect();
    device.create_bind_group(&BindGroupDescriptor { label: Some(label), layout, entries: &entries })
}
