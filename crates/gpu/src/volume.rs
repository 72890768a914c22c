//! The volume pass: billboards from back to front, decompressed where they are drawn.

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
use forest_volume::{
    ATLAS_WIDTH, Blending, Branching, Codewords, Coding, Detail, NodeRecord, Selection,
    VolumeBlock, select_into,
};
use glam::DVec3;
use wgpu::{
    BindGroup, BindGroupLayout, BindingResource, Buffer, BufferUsages, RenderPass, RenderPipeline,
    ShaderStages, Texture, TextureFormat,
};

/// Texels along the sides of the textures that hold raw billboards, one after the other.
pub(crate) const RAW_SIDE: u32 = 2048;

/// Levels of the deepest tree, the root included.
pub(crate) const MOST_LEVELS: usize = Branching::Octree.most_levels() as usize + 1;

/// `Shown` of volume.wgsl.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
struct ShownUniform {
    right: [f32; 3],
    share: f32,
    up: [f32; 3],
    camera: u32,
    half: [f32; 2],
    zero: [f32; 2],
}

/// `Level` of volume.wgsl.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
struct LevelUniform {
    codes: [u32; 2],
    nodes: u32,
    side: f32,
}

/// `Volume` of volume.wgsl.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct VolumeUniform {
    corner: [f32; 3],
    texels: u32,
    fade: [f32; 2],
    shown: u32,
    mask_words: u32,
    bits: [u32; 2],
    over: u32,
    coded: u32,
    cameras: [ShownUniform; 2],
    levels: [LevelUniform; MOST_LEVELS],
}

/// `Item` of volume.wgsl.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct ItemRecord {
    level: u32,
    node: u32,
    weight: f32,
    zero: u32,
}

/// The volume of a pack on a device, and what a frame needs of it.
#[derive(Debug)]
pub(crate) struct VolumeModel<'p> {
    pub(crate) block: VolumeBlock<'p>,
    levels: [LevelUniform; MOST_LEVELS],
    uniforms: [Buffer; MOST_LAYERS],
    items: [Buffer; MOST_LAYERS],
    groups: [BindGroup; MOST_LAYERS],
    selection: Selection,
    records: Vec<ItemRecord>,
    /// Items of each layer.
    counts: Vec<u32>,
}

impl<'p> VolumeModel<'p> {
    pub(crate) fn load(gpu: &Gpu, pass: &VolumePass, pack: &'p Pack) -> Result<Self, GpuError> {
        let block = VolumeBlock::open(pack)?;
        let header = &block.header;
        // The shader counts bits of codes, and texels, in 32 bits.
        let billboards: u64 = header.levels.iter().map(|l| u64::from(l.billboards)).sum();
        let texels = billboards * header.billboard_texels() as u64;
        gpu.within("billboards", billboards.max(texels / 16), "", (1 << 28) - 1)?;
        let nodes: Vec<&[u8]> = block.nodes.iter().map(|n| bytemuck::cast_slice(n)).collect();
        let masks: Vec<&[u8]> = block.masks.iter().map(|m| bytemuck::cast_slice(m)).collect();
        let mut levels = [LevelUniform::default(); MOST_LEVELS];
        let mut codes: Vec<&[u8]> = Vec::new();
        let (mut word, mut node) = (0, 0);
        for (l, level) in (0..).zip(&header.levels) {
            let [colors, alphas] = block.stored_codes(l)?;
            let side = block.lattice().cell_side(l) as f32;
            let [a, b] = [colors, alphas].map(|c| c.len() as u32 / 4);
            levels[l as usize] = LevelUniform { codes: [word, word + a], nodes: node, side };
            codes.extend([colors, alphas]);
            word += a + b;
            node += level.nodes;
        }
        let words = match header.coding {
            Coding::Texels => raw_texels(gpu, &block, &mut levels)?,
            Coding::Codebook { .. } => atlas(gpu, &block)?,
        };
        let nodes = gpu.storage("nodes", &nodes)?;
        let masks = gpu.storage("camera masks", &masks)?;
        let codes = gpu.storage("codes", &codes)?;
        let words = array_view(&words);
        let list = u64::from(node) * size_of::<ItemRecord>() as u64;
        let uniform =
            || gpu.buffer("volume", size_of::<VolumeUniform>() as u64, BufferUsages::UNIFORM);
        let list = || gpu.buffer("cells of a volume", list, BufferUsages::STORAGE);
        let (uniforms, items) = ([uniform()?, uniform()?], [list()?, list()?]);
        let groups = [0, 1].map(|slot| {
            let buffers = [&uniforms[slot], &items[slot], &nodes, &masks, &codes];
            let buffers = buffers.map(|b: &Buffer| b.as_entire_binding());
            let all: Vec<BindingResource> =
                buffers.into_iter().chain([BindingResource::TextureView(&words)]).collect();
            bind::group(&gpu.device, "volume", &pass.layout, &all)
        });
        let (selection, records) = (Selection::default(), Vec::new());
        let counts = Vec::with_capacity(MOST_LAYERS);
        Ok(Self { block, levels, uniforms, items, groups, selection, records, counts })
    }

    pub(crate) fn stage(&self) -> Stage {
        let [low, high] = self.block.header.bounds.map(DVec3::from_array);
        let half_diagonal = 0.5 * low.distance(high);
        Stage { middle: 0.5 * (low + high), half_diagonal }
    }

    /// Chooses and uploads what `layers` draw for `camera`.
    pub(crate) fn prepare(
        &mut self,
        gpu: &Gpu,
        camera: &Camera,
        layers: impl Iterator<Item = (Detail, Blending, [f32; 2])>,
    ) {
        self.counts.clear();
        for (slot, (detail, blending, fade)) in layers.take(MOST_LAYERS).enumerate() {
            select_into(&self.block, camera, detail, &mut self.selection);
            self.records.clear();
            self.records.extend(self.selection.items.iter().map(|i| ItemRecord {
                level: i.level,
                node: i.node,
                weight: i.weight,
                zero: 0,
            }));
            let uniform = self.uniform(camera, blending, fade);
            gpu.queue.write_buffer(&self.uniforms[slot], 0, bytemuck::bytes_of(&uniform));
            gpu.queue.write_buffer(&self.items[slot], 0, bytemuck::cast_slice(&self.records));
            self.counts.push(self.records.len() as u32);
        }
    }

    fn uniform(&self, camera: &Camera, blending: Blending, fade: [f32; 2]) -> VolumeUniform {
        let header = &self.block.header;
        let (bits, coded) = match header.coding {
            Coding::Texels => ([0; 2], 0),
            Coding::Codebook { colors, alphas, .. } => {
                ([colors, alphas].map(|n| forest_volume::code_bits(n as usize)), 1)
            }
        };
        let mut cameras = [ShownUniform::default(); 2];
        for (to, chosen) in cameras.iter_mut().zip(&self.selection.cameras) {
            *to = ShownUniform {
                right: chosen.right.as_vec3().to_array(),
                share: chosen.share,
                up: chosen.up.as_vec3().to_array(),
                camera: chosen.camera,
                half: header.cameras[chosen.camera as usize].half_size(1.0).map(|v| v as f32),
                zero: [0.0; 2],
            };
        }
        VolumeUniform {
            corner: (DVec3::from_array(header.corner) - camera.eye).as_vec3().to_array(),
            texels: header.texels,
            fade,
            shown: self.selection.cameras.len().min(2) as u32,
            mask_words: header.mask_words() as u32,
            bits,
            over: (blending == Blending::Over).into(),
            coded,
            cameras,
            levels: self.levels,
        }
    }

    /// Cells of the last frame.
    pub(crate) fn cells(&self) -> u64 {
        self.counts.iter().map(|n| u64::from(*n)).sum()
    }

    /// Bytes of the cells' nodes and of their billboards for two cameras.
    pub(crate) fn bytes(&self) -> u64 {
        let cell = size_of::<NodeRecord>() as f64 + 2.0 * self.block.billboard_bytes();
        (self.cells() as f64 * cell) as u64
    }

    /// Draw calls of the last frame.
    pub(crate) fn calls(&self) -> u64 {
        self.counts.len() as u64
    }
}

/// Raw billboards of all levels in rows of [`RAW_SIDE`] texels; each level starts a row.
fn raw_texels(
    gpu: &Gpu,
    block: &VolumeBlock,
    levels: &mut [LevelUniform; MOST_LEVELS],
) -> Result<Texture, GpuError> {
    let row = RAW_SIDE as usize * 4;
    let stored: Vec<&[u8]> = (0..block.header.levels.len() as u32)
        .map(|l| block.stored_texels(l))
        .collect::<Result<_, _>>()?;
    let rows: usize = stored.iter().map(|s| s.len().div_ceil(row)).sum();
    let layers = (rows as u32).div_ceil(RAW_SIDE).max(1);
    let format = TextureFormat::Rgba8UnormSrgb;
    let texture = gpu.texture_array("billboards", [RAW_SIDE; 2], layers, format)?;
    let mut at = 0u32;
    for (level, texels) in levels.iter_mut().zip(stored) {
        level.codes = [at, 0];
        let mut left = texels;
        while !left.is_empty() {
            // Whole rows of a layer, or what is left of the last row.
            let (layer, y) = (at / RAW_SIDE, at % RAW_SIDE);
            let whole = (left.len() / row).min((RAW_SIDE - y) as usize);
            let (width, height) = match whole {
                0 => ((left.len() / 4) as u32, 1),
                n => (RAW_SIDE, n as u32),
            };
            let (now, rest) = left.split_at(width as usize * 4 * height as usize);
            gpu.write_texels(&texture, [0, y, layer], [width, height, 1], now);
            left = rest;
            at += height;
        }
    }
    Ok(texture)
}

/// The atlas of codewords: as it is stored where the device reads its blocks, else decoded.
fn atlas(gpu: &Gpu, block: &VolumeBlock) -> Result<Texture, GpuError> {
    let coding = block.header.coding;
    let stored = block.stored_atlas()?;
    let height = coding.atlas_height(block.header.texels);
    let blocks = matches!(coding, Coding::Codebook { block: true, .. });
    let decoded;
    let (format, texels) = if blocks && gpu.takes_blocks() {
        (TextureFormat::Bc3RgbaUnormSrgb, stored)
    } else if blocks {
        decoded = Codewords::decode_blocks(stored, height);
        (TextureFormat::Rgba8UnormSrgb, &decoded[..])
    } else {
        (TextureFormat::Rgba8UnormSrgb, stored)
    };
    let texture = gpu.texture_array("codewords", [ATLAS_WIDTH, height], 1, format)?;
    gpu.write_texels(&texture, [0; 3], [ATLAS_WIDTH, height, 1], texels);
    Ok(texture)
}

/// The pipeline.
#[derive(Debug)]
pub(crate) struct VolumePass {
    pipeline: RenderPipeline,
    layout: BindGroupLayout,
}

impl VolumePass {
    pub(crate) fn new(gpu: &Gpu, frame_layout: &BindGroupLayout) -> Self {
        let r = Kind::Read;
        let kinds = [Kind::Uniform, r, r, r, r, Kind::TextureArray];
        let layout = bind::layout(&gpu.device, "volume", ShaderStages::VERTEX_FRAGMENT, &kinds);
        let pipeline = crate::pipeline::blended(
            &gpu.device,
            &Shader::Volume.module(&gpu.device),
            &crate::pipeline::layout(&gpu.device, &[frame_layout, &layout]),
            ["vertex", "fragment"],
        );
        Self { pipeline, layout }
    }

    pub(crate) fn draw(&self, pass: &mut RenderPass, model: &VolumeModel) {
        pass.set_pipeline(&self.pipeline);
        for (group, count) in model.groups.iter().zip(&model.counts) {
            pass.set_bind_group(1, group, &[]);
            pass.draw(0..4, 0..*count);
        }
    }
}
