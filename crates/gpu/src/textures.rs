//! Textures straight from packs.

use crate::device::Gpu;
use crate::error::GpuError;
use wgpu::{
    Backend, Extent3d, Origin3d, TexelCopyBufferLayout, TexelCopyTextureInfo, Texture,
    TextureAspect, TextureDescriptor, TextureDimension, TextureFormat, TextureUsages, TextureView,
    TextureViewDescriptor, TextureViewDimension,
};

impl Gpu {
    /// An array of `layers` empty textures for loading texels from.
    ///
    /// # Errors
    /// When it is larger than the device takes.
    pub(crate) fn texture_array(
        &self,
        what: &str,
        [width, height]: [u32; 2],
        layers: u32,
        format: TextureFormat,
    ) -> Result<Texture, GpuError> {
        let limits = self.device.limits();
        self.within(what, layers.into(), "layers", limits.max_texture_array_layers.into())?;
        // OpenGL does not know an array of one layer for what it is.
        let least = if self.adapter.get_info().backend == Backend::Gl { 2 } else { 1 };
        self.texture(what, [width, height], layers.max(least), format)
    }

    /// Empty textures for loading texels from.
    ///
    /// # Errors
    /// When they are larger than the device takes.
    pub(crate) fn texture(
        &self,
        what: &str,
        [width, height]: [u32; 2],
        layers: u32,
        format: TextureFormat,
    ) -> Result<Texture, GpuError> {
        let limit = self.device.limits().max_texture_dimension_2d;
        self.within(what, width.max(height).into(), "texels a side", limit.into())?;
        Ok(self.device.create_texture(&TextureDescriptor {
            label: Some(what),
            size: Extent3d { width, height, depth_or_array_layers: layers },
            mip_level_count: 1,
            sample_count: 1,
            dimension: TextureDimension::D2,
            format,
            usage: TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST,
            view_formats: &[],
        }))
    }

    /// A view of a texture that is drawn into, and read.
    ///
    /// # Errors
    /// When it is larger than the device takes.
    pub(crate) fn render_target(
        &self,
        what: &str,
        [width, height]: [u32; 2],
        format: TextureFormat,
    ) -> Result<TextureView, GpuError> {
        let limit = self.device.limits().max_texture_dimension_2d;
        self.within(what, width.max(height).into(), "texels a side", limit.into())?;
        let texture = self.device.create_texture(&TextureDescriptor {
            label: Some(what),
            size: Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: TextureDimension::D2,
            format,
            usage: TextureUsages::TEXTURE_BINDING | TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        });
        Ok(texture.create_view(&TextureViewDescriptor::default()))
    }

    /// Writes texels, or rows of blocks, into a box of one or more layers from `origin` on.
    pub(crate) fn write_texels(
        &self,
        texture: &Texture,
        origin: [u32; 3],
        [width, height, layers]: [u32; 3],
        data: &[u8],
    ) {
        let [x, y, z] = origin;
        let format = texture.format();
        let (block, _) = format.block_dimensions();
        let bytes = format.block_copy_size(None).unwrap_or(4);
        self.queue.write_texture(
            TexelCopyTextureInfo {
                texture,
                mip_level: 0,
                origin: Origin3d { x, y, z },
                aspect: TextureAspect::All,
            },
            data,
            TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(width / block * bytes),
                rows_per_image: Some(height / block),
            },
            Extent3d { width, height, depth_or_array_layers: layers },
        );
    }
}

/// A view of all layers.
pub(crate) fn array_view(texture: &Texture) -> TextureView {
    texture.create_view(&TextureViewDescriptor {
        dimension: Some(TextureViewDimension::D2Array),
        ..Default::default()
    })
}
