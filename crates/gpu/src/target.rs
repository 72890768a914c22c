//! What pictures are drawn into.

use crate::bind::{self, Kind};
use crate::device::Gpu;
use crate::error::GpuError;
use wgpu::{
    BindGroup, BindGroupLayout, Buffer, BufferUsages, Extent3d, ShaderStages, Texture,
    TextureDescriptor, TextureDimension, TextureFormat, TextureUsages, TextureView,
};

/// Premultiplied linear RGBA.
pub(crate) const COLOR: TextureFormat = TextureFormat::Rgba16Float;
/// 1 near … 0 far.
pub(crate) const DEPTH: TextureFormat = TextureFormat::Depth32Float;

/// The samples of a picture: colour, depth, and the points that the compute shader found.
#[derive(Debug)]
pub struct Target {
    /// Pixels.
    pub(crate) size: [u32; 2],
    /// Samples along the side of a pixel.
    pub(crate) side: u32,
    pub(crate) color: Texture,
    pub(crate) color_view: TextureView,
    pub(crate) depth: Texture,
    pub(crate) depth_view: TextureView,
    /// Eight bytes a sample.
    pub(crate) kept: Buffer,
    pub(crate) splat_group: BindGroup,
    pub(crate) found_group: BindGroup,
}

/// The layouts of a target's groups.
#[derive(Debug)]
pub(crate) struct TargetLayouts {
    pub(crate) splat: BindGroupLayout,
    pub(crate) found: BindGroupLayout,
}

impl TargetLayouts {
    pub(crate) fn new(gpu: &Gpu) -> Self {
        let layout = |label, stages, kind| bind::layout(&gpu.device, label, stages, &[kind]);
        Self {
            splat: layout("samples, written", ShaderStages::COMPUTE, Kind::Write),
            found: layout("samples, read", ShaderStages::FRAGMENT, Kind::Read),
        }
    }
}

impl Target {
    pub(crate) fn new(
        gpu: &Gpu,
        layouts: &TargetLayouts,
        size: [u32; 2],
        side: u32,
    ) -> Result<Self, GpuError> {
        let [width, height] = size.map(|n| n.max(1).saturating_mul(side));
        let limit = gpu.device.limits().max_texture_dimension_2d.into();
        gpu.within("samples of a picture", width.max(height).into(), "a side", limit)?;
        let texture = |label, format, usage| {
            gpu.device.create_texture(&TextureDescriptor {
                label: Some(label),
                size: Extent3d { width, height, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: TextureDimension::D2,
                format,
                usage: usage | TextureUsages::RENDER_ATTACHMENT,
                view_formats: &[],
            })
        };
        let read = TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_SRC;
        let color = texture("colour", COLOR, read);
        let depth = texture("depth", DEPTH, TextureUsages::TEXTURE_BINDING);
        let bytes = 8 * u64::from(width) * u64::from(height);
        let kept = gpu.buffer("samples of points", bytes, BufferUsages::STORAGE)?;
        let group =
            |layout| bind::group(&gpu.device, "samples", layout, &[kept.as_entire_binding()]);
        Ok(Self {
            size,
            side,
            splat_group: group(&layouts.splat),
            found_group: group(&layouts.found),
            color_view: color.create_view(&Default::default()),
            depth_view: depth.create_view(&Default::default()),
            color,
            depth,
            kept,
        })
    }

    /// Pixels across and down.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Samples along the side of a pixel.
    pub fn side(&self) -> u32 {
        self.side
    }
}
