//! The triangles of a points pack with their materials and textures.

use crate::bind;
use crate::device::Gpu;
use crate::error::GpuError;
use crate::materials::MaterialTables;
use forest_pack::Pack;
use forest_points::{PointsBlock, read_materials};
use wgpu::{BindGroup, BindGroupLayout, BindingResource, Buffer};

/// Triangles on a device.
#[derive(Debug)]
pub(crate) struct TrianglesModel {
    group: BindGroup,
    bytes: u64,
}

impl TrianglesModel {
    /// Those of `block`; `cells` is the table of what a frame draws, `runs` that of a landscape.
    pub(crate) fn load(
        gpu: &Gpu,
        layout: &BindGroupLayout,
        pack: &Pack,
        block: &PointsBlock,
        cells: &Buffer,
        runs: Option<BindingResource>,
    ) -> Result<Self, GpuError> {
        let (materials, textures) = read_materials(pack)?;
        let ranges = &block.header.uv_ranges;
        let colored = !block.triangle_colors.is_empty();
        let tables = MaterialTables::load(gpu, &materials, &textures, ranges, colored)?;
        let colors: &[u8] = bytemuck::cast_slice(block.triangle_colors);
        let triangles = gpu.storage("triangles", &[bytemuck::cast_slice(block.triangles)])?;
        let colors = gpu.storage("vertex colours", &[colors])?;
        let buffers = [&triangles, cells, &tables.materials, &tables.images, &colors];
        let mut all: Vec<BindingResource> = buffers.map(Buffer::as_entire_binding).into();
        all.push(BindingResource::TextureView(&tables.sheet));
        all.extend(runs);
        let group = bind::group(&gpu.device, "triangles", layout, &all);
        let bytes = tables.bytes + triangles.size() + colors.size();
        Ok(Self { group, bytes })
    }

    /// Bytes that they take on the device.
    pub(crate) fn bytes(&self) -> u64 {
        self.bytes
    }

    pub(crate) fn group(&self) -> &BindGroup {
        &self.group
    }
}
