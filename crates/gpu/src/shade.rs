//! What comes through a crown: a small texture that follows the sun.

use crate::bind;
use crate::device::Gpu;
use forest_foliage::{CrownLight, CrownShade};
use glam::DVec3;
use wgpu::util::{DeviceExt, TextureDataOrder};
use wgpu::{
    BindGroup, BindGroupLayout, BindingResource, Buffer, Extent3d, TextureDescriptor,
    TextureDimension, TextureFormat, TextureUsages,
};

/// Group 0 of what is lit by `lit_block.wgsl`: the frame, and [`CrownShade`] as a texture.
#[derive(Debug)]
pub(crate) struct ShadeModel {
    pub(crate) group: BindGroup,
    /// Corner of the grid in the world, and side of a cell.
    pub(crate) low: DVec3,
    pub(crate) cell: f64,
    pub(crate) to_sun: DVec3,
}

impl ShadeModel {
    /// That of `crown` under a sun in direction `to_sun`; `last` if the sun still stands there.
    pub(crate) fn follow(
        last: Option<Self>,
        gpu: &Gpu,
        layout: &BindGroupLayout,
        frame: &Buffer,
        crown: &CrownLight,
        to_sun: DVec3,
    ) -> Self {
        if let Some(last) = last.filter(|l| l.to_sun == to_sun) {
            return last;
        }
        let shade: CrownShade = crown.shade(to_sun);
        let group = group(gpu, layout, frame, shade.size(), shade.texels());
        let (low, cell) = shade.frame();
        Self { group, low, cell, to_sun }
    }
}

/// Group 0 in the open.
pub(crate) fn open(gpu: &Gpu, layout: &BindGroupLayout, frame: &Buffer) -> BindGroup {
    group(gpu, layout, frame, [1; 3], &[[255; 2]])
}

fn group(
    gpu: &Gpu,
    layout: &BindGroupLayout,
    frame: &Buffer,
    [width, height, depth]: [u32; 3],
    texels: &[[u8; 2]],
) -> BindGroup {
    let descriptor = TextureDescriptor {
        label: Some("shade"),
        size: Extent3d { width, height, depth_or_array_layers: depth },
        mip_level_count: 1,
        sample_count: 1,
        dimension: TextureDimension::D3,
        format: TextureFormat::Rg8Unorm,
        usage: TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    };
    let order = TextureDataOrder::LayerMajor;
    let bytes = texels.as_flattened();
    let texture = gpu.device.create_texture_with_data(&gpu.queue, &descriptor, order, bytes);
    let view = texture.create_view(&Default::default());
    let resources = [frame.as_entire_binding(), BindingResource::TextureView(&view)];
    bind::group(&gpu.device, "lit frame", layout, &resources)
}
