//! The triangles of a points pack with their materials and textures.

use crate::bind;
use crate::device::Gpu;
use crate::error::GpuError;
use crate::sheet::{Place, Sheet};
use crate::textures::array_view;
use bytemuck::{Pod, Zeroable};
use forest_pack::Pack;
use forest_points::{PointsBlock, UvRange, read_materials};
use forest_soup::{AlphaMode, Material, Texture, Wrap};
use wgpu::{BindGroup, BindGroupLayout, BindingResource, Buffer, TextureFormat};

/// `Material` of triangles.wgsl.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct MaterialRecord {
    base: [f32; 4],
    uv_min: [f32; 2],
    uv_step: [f32; 2],
    rule: u32,
    cutoff: f32,
    /// Bit 0: unlit. Bit 1: its triangles have vertex colours.
    flags: u32,
    image: u32,
}

/// `Image` of triangles.wgsl.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct ImageRecord {
    corner: [u32; 2],
    layer: u32,
    zero: u32,
    size: [u32; 2],
    wrap: [u32; 2],
}

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
        let sizes: Vec<[u32; 2]> = textures.iter().map(|t| [t.width, t.height]).collect();
        let sheet = Sheet::new(gpu, &sizes)?;
        let sheet_texture = sheet.texture(gpu, "textures", TextureFormat::Rgba8UnormSrgb)?;
        for (texture, place) in textures.iter().zip(&sheet.places) {
            let [x, y] = place.corner;
            let size = [texture.width, texture.height, 1];
            let origin = [x, y, place.layer];
            gpu.write_texels(&sheet_texture, origin, size, texture.texels.as_flattened());
        }
        let images: Vec<ImageRecord> =
            textures.iter().zip(&sheet.places).map(|(t, p)| image_record(t, p)).collect();
        let ranges = &block.header.uv_ranges;
        let materials: Vec<MaterialRecord> = materials
            .iter()
            .zip(ranges)
            .map(|(m, range)| material_record(m, range, !block.triangle_colors.is_empty()))
            .collect();
        let colors: &[u8] = bytemuck::cast_slice(block.triangle_colors);
        let triangles = gpu.storage("triangles", &[bytemuck::cast_slice(block.triangles)])?;
        let materials = gpu.storage("materials", &[bytemuck::cast_slice(&materials)])?;
        let images = gpu.storage("images", &[bytemuck::cast_slice(&images)])?;
        let colors = gpu.storage("vertex colours", &[colors])?;
        let sheet = array_view(&sheet_texture);
        let tables = [&triangles, cells, &materials, &images, &colors];
        let mut all: Vec<BindingResource> = tables.map(Buffer::as_entire_binding).into();
        all.push(BindingResource::TextureView(&sheet));
        all.extend(runs);
        let group = bind::group(&gpu.device, "triangles", layout, &all);
        let [width, height] = [sheet_texture.width(), sheet_texture.height()].map(u64::from);
        let texels = 4 * width * height * u64::from(sheet_texture.depth_or_array_layers());
        let bytes = texels + triangles.size() + materials.size() + images.size() + colors.size();
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

fn material_record(m: &Material, range: &UvRange, colors: bool) -> MaterialRecord {
    let (rule, cutoff) = match m.alpha_mode {
        AlphaMode::Opaque => (0, 0.0),
        AlphaMode::Mask { cutoff } => (1, cutoff),
        AlphaMode::Blend => (2, 0.0),
    };
    let image = m.texture.unwrap_or(u32::MAX);
    let flags = u32::from(m.unlit) | u32::from(colors) << 1;
    let (uv_min, uv_step) = (range.min, range.step);
    MaterialRecord { base: m.base_color, uv_min, uv_step, rule, cutoff, flags, image }
}

fn image_record(t: &Texture, place: &Place) -> ImageRecord {
    let wrap = t.wrap.map(|w| match w {
        Wrap::Repeat => 0,
        Wrap::Mirror => 1,
        Wrap::Clamp => 2,
    });
    let size = [t.width, t.height];
    ImageRecord { corner: place.corner, layer: place.layer, zero: 0, size, wrap }
}
