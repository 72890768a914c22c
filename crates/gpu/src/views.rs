//! The views pass: one quad, each sample a ray through one to three views.

use crate::MOST_LAYERS;
use crate::bind::{self, Kind};
use crate::device::Gpu;
use crate::error::GpuError;
use crate::frame::Stage;
use crate::shader::Shader;
use crate::textures::array_view;
use bytemuck::{Pod, Zeroable};
use forest_pack::Pack;
use forest_soup::Camera;
use forest_views::{Blend, Channel, Lookup, Quality, ViewFrame, ViewsBlock, decode, views};
use glam::IVec2;
use std::borrow::Cow;
use wgpu::{
    BindGroup, BindGroupLayout, BindingResource, Buffer, BufferUsages, PrimitiveTopology,
    RenderPass, RenderPipeline, ShaderStages, Texture, TextureFormat,
};

/// `Sprite` of views.wgsl.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct SpriteUniform {
    eye: [f32; 3],
    half: f32,
    views: [u32; 4],
    shares: [f32; 4],
    low: [f32; 2],
    high: [f32; 2],
    fade: [f32; 2],
    side: f32,
    reach: f32,
    through_depth: u32,
    has_normals: u32,
    has_sky: u32,
    wide_depth: u32,
    page: [u32; 2],
    zero: [u32; 2],
}

/// `ViewFrame` of views.wgsl.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct FrameRecord {
    right: [f32; 4],
    up: [f32; 4],
    back: [f32; 4],
}

/// The views of a pack on a device.
#[derive(Debug)]
pub(crate) struct ViewsModel<'p> {
    pub(crate) block: ViewsBlock<'p>,
    sprites: [Buffer; MOST_LAYERS],
    /// Of each level, for each layer of a frame.
    groups: Vec<[BindGroup; MOST_LAYERS]>,
    /// Level of each layer of the frame.
    layers: Vec<usize>,
    drawn: ViewsDrawn,
}

/// What a frame of views took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct ViewsDrawn {
    pub(crate) views: u64,
    pub(crate) bytes: u64,
}

impl<'p> ViewsModel<'p> {
    pub(crate) fn load(gpu: &Gpu, pass: &ViewsPass, pack: &'p Pack) -> Result<Self, GpuError> {
        let block = ViewsBlock::open(pack)?;
        let size = size_of::<SpriteUniform>() as u64;
        let sprite = || gpu.buffer("sprite", size, BufferUsages::UNIFORM);
        let sprites = [sprite()?, sprite()?];
        let frames = frame_records(&block);
        let frames = gpu.storage("frames of views", &[bytemuck::cast_slice(&frames)])?;
        let blocks = gpu.takes_blocks();
        let mut groups = Vec::new();
        for level in 0..block.header.levels.len() {
            let tiles = gpu.storage("tiles", &[bytemuck::cast_slice(block.tiles[level])])?;
            let pages = |channel| -> Result<_, GpuError> {
                Ok(array_view(&pages(gpu, &block, channel, level, blocks)?))
            };
            let depth = block.stored(Channel::Depth, level)?;
            let depth = gpu.storage("depth of views", &[&depth])?;
            let (color, normal) = (pages(Channel::Color)?, pages(Channel::Normal)?);
            let sky = pages(Channel::Sky)?;
            let group = |slot: usize| {
                let all = [
                    sprites[slot].as_entire_binding(),
                    tiles.as_entire_binding(),
                    frames.as_entire_binding(),
                    BindingResource::TextureView(&color),
                    BindingResource::TextureView(&normal),
                    depth.as_entire_binding(),
                    BindingResource::TextureView(&sky),
                ];
                bind::group(&gpu.device, "views", &pass.layout, &all)
            };
            groups.push([group(0), group(1)]);
        }
        let layers = Vec::with_capacity(MOST_LAYERS);
        Ok(Self { block, sprites, groups, layers, drawn: ViewsDrawn::default() })
    }

    pub(crate) fn stage(&self) -> Stage {
        let (middle, half_diagonal) = (self.block.center(), self.block.half_diagonal());
        Stage { middle, half_diagonal }
    }

    /// Uploads what `layers` draw for `camera`, which has the size of the samples. Views are chosen
    /// by direction only; levels that are not there are left out.
    pub(crate) fn prepare(
        &mut self,
        gpu: &Gpu,
        camera: &Camera,
        layers: impl Iterator<Item = (usize, Lookup, [f32; 2])>,
    ) {
        self.layers.clear();
        self.drawn = ViewsDrawn::default();
        let there = self.block.header.levels.len();
        for (slot, (level, lookup, fade)) in
            layers.filter(|l| l.0 < there).take(MOST_LAYERS).enumerate()
        {
            let chosen = views(&self.block, camera, lookup);
            let sprite = self.sprite(camera, level, lookup, &chosen, fade);
            gpu.queue.write_buffer(&self.sprites[slot], 0, bytemuck::bytes_of(&sprite));
            self.layers.push(level);
            let used = chosen.iter().filter(|v| v.1 > 0.0);
            self.drawn.views += used.clone().count() as u64;
            self.drawn.bytes +=
                used.map(|v| self.block.tile_bytes(level, v.0, lookup)).sum::<u64>();
        }
    }

    fn sprite(
        &self,
        camera: &Camera,
        level: usize,
        lookup: Lookup,
        chosen: &Blend,
        fade: [f32; 2],
    ) -> SpriteUniform {
        let header = &self.block.header;
        let (low, high) = self.block.pixels(camera, level);
        let edge = |v: IVec2| [v.x as f32, v.y as f32];
        // All of the picture, for a camera within the tree.
        let whole = IVec2::new(camera.width as i32, camera.height as i32);
        let (low, high) = (low.max(IVec2::ZERO), high.min(whole - 1).saturating_add(IVec2::ONE));
        let used: Vec<(u32, f32)> = chosen.iter().filter(|v| v.1 > 0.0).copied().collect();
        let all: f32 = used.iter().map(|v| v.1).sum();
        let mut sprite = SpriteUniform {
            eye: ((camera.eye - self.block.center()) / header.half).as_vec3().to_array(),
            half: header.half as f32,
            views: [0, 0, 0, used.len() as u32],
            low: edge(low),
            // Outside of the picture altogether: nothing.
            high: if low.cmple(high).all() { edge(high) } else { edge(low) },
            fade,
            side: header.levels[level].texels as f32,
            reach: (header.radius / header.half) as f32,
            through_depth: (lookup == Lookup::Depth && header.channels.depth).into(),
            has_normals: header.channels.normal.into(),
            has_sky: header.channels.sky.into(),
            wide_depth: (header.quality == Quality::Lossless).into(),
            page: header.levels[level].page,
            zero: [0; 2],
            shares: [0.0; 4],
        };
        for (i, (view, share)) in used.into_iter().enumerate() {
            sprite.views[i] = view;
            sprite.shares[i] = share / all;
        }
        sprite
    }

    pub(crate) fn drawn(&self) -> ViewsDrawn {
        self.drawn
    }

    /// Draw calls of the last frame.
    pub(crate) fn calls(&self) -> u64 {
        self.layers.len() as u64
    }
}

/// The frames of all views.
pub(crate) fn frame_records(block: &ViewsBlock) -> Vec<FrameRecord> {
    let vector = |v: glam::DVec3| v.as_vec3().extend(0.0).to_array();
    let record = |f: &ViewFrame| FrameRecord {
        right: vector(f.right),
        up: vector(f.up),
        back: vector(f.back),
    };
    block.frames.iter().map(record).collect()
}

/// A channel of a level as textures: as it is stored where the device reads blocks, else decoded.
fn pages(
    gpu: &Gpu,
    block: &ViewsBlock,
    channel: Channel,
    level: usize,
    blocks: bool,
) -> Result<Texture, GpuError> {
    let header = &block.header.levels[level];
    let compressed = block.header.quality == Quality::Block && blocks;
    let format = page_format(channel, compressed);
    let texels = page_texels(block, channel, level, compressed)?;
    if texels.is_empty() {
        return gpu.texture_array("a channel that is not there", [4, 4], 1, format);
    }
    let [width, height] = header.page;
    let texture = gpu.texture_array("pages of views", header.page, header.pages, format)?;
    gpu.write_texels(&texture, [0; 3], [width, height, header.pages], &texels);
    Ok(texture)
}

/// The format of a channel's texels on the device.
pub(crate) fn page_format(channel: Channel, compressed: bool) -> TextureFormat {
    match (channel, compressed) {
        (Channel::Color, true) => TextureFormat::Bc7RgbaUnormSrgb,
        (Channel::Color, false) => TextureFormat::Rgba8UnormSrgb,
        (Channel::Normal, true) => TextureFormat::Bc5RgUnorm,
        (Channel::Normal, false) => TextureFormat::Rg8Unorm,
        (Channel::Depth | Channel::Sky, true) => TextureFormat::Bc4RUnorm,
        (Channel::Depth | Channel::Sky, false) => TextureFormat::R8Unorm,
    }
}

/// The pages of a channel of a level in that format; empty if it is not stored. Of depth that is not
/// compressed, the upper bytes.
pub(crate) fn page_texels<'a>(
    block: &ViewsBlock<'a>,
    channel: Channel,
    level: usize,
    compressed: bool,
) -> Result<Cow<'a, [u8]>, GpuError> {
    let stored = block.stored(channel, level)?;
    if compressed || stored.is_empty() {
        return Ok(stored);
    }
    let plain = match block.header.quality {
        Quality::Lossless => stored,
        Quality::Block => {
            let width = block.header.levels[level].page[0];
            Cow::Owned(decode(channel, block.header.quality, width, &stored))
        }
    };
    Ok(match channel {
        Channel::Depth => plain.iter().skip(1).step_by(2).copied().collect::<Vec<u8>>().into(),
        _ => plain,
    })
}

/// The pipeline.
#[derive(Debug)]
pub(crate) struct ViewsPass {
    pipeline: RenderPipeline,
    layout: BindGroupLayout,
}

impl ViewsPass {
    pub(crate) fn new(gpu: &Gpu, frame_layout: &BindGroupLayout) -> Self {
        let (r, t) = (Kind::Read, Kind::TextureArray);
        let kinds = [Kind::Uniform, r, r, t, t, r, t];
        let layout = bind::layout(&gpu.device, "views", ShaderStages::VERTEX_FRAGMENT, &kinds);
        let pipeline = crate::pipeline::opaque(
            &gpu.device,
            &Shader::Views.module(&gpu.device),
            &crate::pipeline::layout(&gpu.device, &[frame_layout, &layout]),
            ["vertex", "fragment"],
            PrimitiveTopology::TriangleStrip,
        );
        Self { pipeline, layout }
    }

    pub(crate) fn draw(&self, pass: &mut RenderPass, model: &ViewsModel) {
        pass.set_pipeline(&self.pipeline);
        for (slot, level) in model.layers.iter().enumerate() {
            pass.set_bind_group(1, &model.groups[*level][slot], &[]);
            pass.draw(0..4, 0..1);
        }
    }
}
