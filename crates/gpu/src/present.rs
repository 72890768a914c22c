//! From samples to pixels: on a screen, or in memory.

use crate::bind::{self, Kind};
use crate::device::Gpu;
use crate::error::GpuError;
use crate::pipeline;
use crate::shader::Shader;
use crate::target::{COLOR, Target};
use bytemuck::{Pod, Zeroable};
use forest_raster::Picture;
use half::f16;
use wgpu::{
    BindGroup, BindGroupLayout, BindingResource, Buffer, BufferDescriptor, BufferUsages, Color,
    CommandEncoder, Extent3d, LoadOp, Operations, RenderPassColorAttachment, RenderPassDescriptor,
    RenderPipeline, ShaderStages, StoreOp, TexelCopyBufferInfo, TexelCopyBufferLayout, Texture,
    TextureDescriptor, TextureDimension, TextureFormat, TextureUsages, TextureView,
};

/// The format of pictures that are read back.
const PICTURE: TextureFormat = TextureFormat::Rgba8UnormSrgb;

/// How samples become pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Linear grey behind the tree.
    pub background: f32,
    /// Straight alpha instead of the grey.
    pub alpha: bool,
    /// Pixels from the left that another picture takes.
    pub split: f32,
}

impl Default for Look {
    /// Over the grey that `forest-bake draw` has too.
    fn default() -> Self {
        Self { background: Picture::BACKGROUND, alpha: false, split: 0.0 }
    }
}

/// `Present` of present.wgsl.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct PresentUniform {
    side: u32,
    alpha: u32,
    background: f32,
    split: f32,
}

/// Shows a target in textures of one format.
#[derive(Debug)]
pub struct Presenter {
    pipeline: RenderPipeline,
    layout: BindGroupLayout,
    uniform: Buffer,
    other: Texture,
}

/// A target, ready to be shown.
#[derive(Debug)]
pub struct Shown {
    group: BindGroup,
    side: u32,
}

impl Presenter {
    /// For textures of `format`, which must be an sRGB one.
    ///
    /// # Errors
    /// When the device refuses.
    pub fn new(gpu: &Gpu, format: TextureFormat) -> Result<Self, GpuError> {
        let kinds = [Kind::Texture, Kind::Uniform, Kind::Texture];
        let layout = bind::layout(&gpu.device, "present", ShaderStages::FRAGMENT, &kinds);
        let pipeline = pipeline::full(
            &gpu.device,
            &Shader::Present.module(&gpu.device),
            &pipeline::layout(&gpu.device, &[&layout]),
            format,
        );
        let size = size_of::<PresentUniform>() as u64;
        let uniform = gpu.buffer("present", size, BufferUsages::UNIFORM)?;
        let other = picture_texture(gpu, [1, 1])?;
        Ok(Self { pipeline, layout, uniform, other })
    }

    /// Sets the picture on the left of [`Look::split`]: premultiplied linear RGBA, `size[0]` a row.
    ///
    /// # Errors
    /// When it is larger than the device takes.
    pub fn compare_with(
        &mut self,
        gpu: &Gpu,
        size: [u32; 2],
        pixels: &[[f32; 4]],
    ) -> Result<(), GpuError> {
        self.other = picture_texture(gpu, size)?;
        let halves: Vec<f16> = pixels.as_flattened().iter().map(|v| f16::from_f32(*v)).collect();
        let [width, height] = size;
        gpu.write_texels(&self.other, [0; 3], [width, height, 1], bytemuck::cast_slice(&halves));
        gpu.check()
    }

    /// Binds a target; to be asked for again after [`Presenter::compare_with`].
    pub fn bind(&self, gpu: &Gpu, target: &Target) -> Shown {
        let other = self.other.create_view(&Default::default());
        let resources = [
            BindingResource::TextureView(&target.color_view),
            self.uniform.as_entire_binding(),
            BindingResource::TextureView(&other),
        ];
        let group = bind::group(&gpu.device, "present", &self.layout, &resources);
        Shown { group, side: target.side }
    }

    /// Shows a target in `view`.
    pub fn present(
        &self,
        gpu: &Gpu,
        encoder: &mut CommandEncoder,
        shown: &Shown,
        view: &TextureView,
        look: &Look,
    ) {
        let &Look { background, split, .. } = look;
        let uniform =
            PresentUniform { side: shown.side, alpha: look.alpha.into(), background, split };
        gpu.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&uniform));
        let mut pass = encoder.begin_render_pass(&RenderPassDescriptor {
            label: Some("present"),
            color_attachments: &[Some(RenderPassColorAttachment {
                view,
                depth_slice: None,
                resolve_target: None,
                ops: Operations { load: LoadOp::Clear(Color::TRANSPARENT), store: StoreOp::Store },
            })],
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &shown.group, &[]);
        pass.draw(0..3, 0..1);
    }
}

/// Pixels of a target as they would be shown: 8-bit sRGB, straight alpha, row 0 on top.
///
/// # Errors
/// When the device failed.
pub fn read_picture(
    gpu: &Gpu,
    target: &Target,
    look: &Look,
    other: Option<([u32; 2], &[[f32; 4]])>,
) -> Result<Vec<[u8; 4]>, GpuError> {
    let mut presenter = Presenter::new(gpu, PICTURE)?;
    if let Some((size, pixels)) = other {
        presenter.compare_with(gpu, size, pixels)?;
    }
    let [width, height] = target.size;
    let texture = gpu.device.create_texture(&TextureDescriptor {
        label: Some("picture"),
        size: Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format: PICTURE,
        usage: TextureUsages::RENDER_ATTACHMENT | TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let shown = presenter.bind(gpu, target);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let view = texture.create_view(&Default::default());
    presenter.present(gpu, &mut encoder, &shown, &view, look);
    gpu.queue.submit([encoder.finish()]);
    let bytes = read_texture(gpu, &texture, 4)?;
    Ok(bytes.as_chunks::<4>().0.to_vec())
}

/// Samples of a target: premultiplied linear RGBA in half precision, row 0 on top.
///
/// # Errors
/// When the device failed.
pub fn read_samples(gpu: &Gpu, target: &Target) -> Result<Vec<[f32; 4]>, GpuError> {
    let bytes = read_texture(gpu, &target.color, 8)?;
    let value = |b: &[u8; 2]| f16::from_le_bytes(*b).to_f32();
    let pixel = |b: &[u8; 8]| {
        let [r, g, b, a] = b.as_chunks::<2>().0 else { return [0.0; 4] };
        [value(r), value(g), value(b), value(a)]
    };
    Ok(bytes.as_chunks::<8>().0.iter().map(pixel).collect())
}

fn picture_texture(gpu: &Gpu, size: [u32; 2]) -> Result<Texture, GpuError> {
    gpu.texture("a picture to compare with", size, 1, COLOR)
}

/// A texture's bytes without the padding of its rows.
fn read_texture(gpu: &Gpu, texture: &Texture, texel: u32) -> Result<Vec<u8>, GpuError> {
    let (width, height) = (texture.width(), texture.height());
    let row = width * texel;
    let pitch = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let size = u64::from(pitch) * u64::from(height);
    gpu.within("a picture", size, "bytes", gpu.device.limits().max_buffer_size)?;
    let buffer = gpu.device.create_buffer(&BufferDescriptor {
        label: Some("picture"),
        size,
        usage: BufferUsages::COPY_DST | BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let layout =
        TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(pitch), rows_per_image: None };
    encoder.copy_texture_to_buffer(
        texture.as_image_copy(),
        TexelCopyBufferInfo { buffer: &buffer, layout },
        Extent3d { width, height, depth_or_array_layers: 1 },
    );
    gpu.queue.submit([encoder.finish()]);
    let bytes = crate::timer::read(gpu, &buffer)?;
    Ok(bytes.chunks_exact(pitch as usize).flat_map(|r| &r[..row as usize]).copied().collect())
}
