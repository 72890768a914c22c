//! Materials and their textures on a device.

use crate::device::Gpu;
use crate::error::GpuError;
use crate::sheet::{Place, Sheet};
use crate::textures::array_view;
use bytemuck::{Pod, Zeroable};
use forest_points::UvRange;
use forest_soup::{AlphaMode, Material, Texture, Wrap};
use std::sync::Arc;
use wgpu::{Buffer, TextureFormat, TextureView};

/// `Material` of surface.wgsl.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct MaterialRecord {
    base: [f32; 4],
    uv_min: [f32; 2],
    uv_step: [f32; 2],
    rule: u32,
    cutoff: f32,
    /// Bit 0: unlit. Bit 1: its triangles have vertex colours. From bit 8: translucency in steps.
    flags: u32,
    image: u32,
    relief: u32,
    relief_scale: f32,
    zero: [u32; 2],
}

/// `Image` of surface.wgsl.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct ImageRecord {
    corner: [u32; 2],
    layer: u32,
    zero: u32,
    size: [u32; 2],
    wrap: [u32; 2],
}

/// Steps of a material's translucency.
pub(crate) const TRANSLUCENCY_STEPS: f64 = 65535.0;

/// The tables of surface.wgsl.
#[derive(Debug)]
pub(crate) struct MaterialTables {
    pub(crate) materials: Buffer,
    pub(crate) images: Buffer,
    pub(crate) sheet: TextureView,
    /// That they take on the device.
    pub(crate) bytes: u64,
}

impl MaterialTables {
    /// `ranges` are how texture coordinates are coded, one a material; `colors` says whether triangles
    /// have vertex colours.
    pub(crate) fn load(
        gpu: &Gpu,
        materials: &[Material],
        textures: &[Arc<Texture>],
        ranges: &[UvRange],
        colors: bool,
    ) -> Result<Self, GpuError> {
        let sizes: Vec<[u32; 2]> = textures.iter().map(|t| [t.width, t.height]).collect();
        let sheet = Sheet::new(gpu, &sizes)?;
        let texture = sheet.texture(gpu, "textures", TextureFormat::Rgba8UnormSrgb)?;
        for (t, place) in textures.iter().zip(&sheet.places) {
            let [x, y] = place.corner;
            let (origin, size) = ([x, y, place.layer], [t.width, t.height, 1]);
            gpu.write_texels(&texture, origin, size, t.texels.as_flattened());
        }
        let images: Vec<ImageRecord> =
            textures.iter().zip(&sheet.places).map(|(t, p)| image_record(t, p)).collect();
        let records = materials.iter().zip(ranges).map(|(m, r)| material_record(m, r, colors));
        let records: Vec<MaterialRecord> = records.collect();
        let materials = gpu.storage("materials", &[bytemuck::cast_slice(&records)])?;
        let images = gpu.storage("images", &[bytemuck::cast_slice(&images)])?;
        let [width, height] = [texture.width(), texture.height()].map(u64::from);
        let texels = 4 * width * height * u64::from(texture.depth_or_array_layers());
        let bytes = texels + materials.size() + images.size();
        Ok(Self { materials, images, sheet: array_view(&texture), bytes })
    }
}

fn material_record(m: &Material, range: &UvRange, colors: bool) -> MaterialRecord {
    let (rule, cutoff) = match m.alpha_mode {
        AlphaMode::Opaque => (0, 0.0),
        AlphaMode::Mask { cutoff } => (1, cutoff),
        AlphaMode::Blend => (2, 0.0),
    };
    let image = m.texture.unwrap_or(u32::MAX);
    let through = (f64::from(m.translucency) * TRANSLUCENCY_STEPS).round() as u32;
    let flags = u32::from(m.unlit) | u32::from(colors) << 1 | through << 8;
    let (uv_min, uv_step) = (range.min, range.step);
    let (relief, relief_scale) = m.relief.map_or((u32::MAX, 0.0), |r| (r.texture, r.scale));
    MaterialRecord {
        base: m.base_color,
        uv_min,
        uv_step,
        rule,
        cutoff,
        flags,
        image,
        relief,
        relief_scale,
        zero: [0; 2],
    }
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
