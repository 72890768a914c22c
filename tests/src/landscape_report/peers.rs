//! Peers: what engines commonly do with a forest, in our light and with our ground.
//!
//! * [`Peer::FullMeshes`]: every tree its source's mesh, the nearest ones up to a budget of triangles.
//! * [`Peer::LodChain`]: levels of meshes by what they are on the screen, without transitions.
//! * [`Peer::Billboards`]: a quad a tree, of eight views around it.
//!
//! All are instanced and drawn from near to far with alpha tests, after culling by tile and by tree.

mod boards;
mod cull;
mod device;
mod kinds;
mod light;
mod lods;
mod texture;

use anyhow::{Result, ensure};
use bytemuck::{Pod, Zeroable};
use cull::{Culling, Kind as Culled};
use device::{COLOR, DEPTH, Draws, Kind, PICTURE};
use forest_gpu::Gpu;
use forest_raster::Light;
use forest_scene::{
    Canopy, DEPTH_STEPS, DIFFUSE, Ground, Land, PATCH, Scene, Sky, Species, ground_vertices,
};
use forest_soup::{Camera, TriangleSoup};
use kinds::{Stock, TreePipelines};
use light::{MapUniform, ViewUniform};
use lods::Mesh;
use wgpu::{
    BindGroup, BindingResource, Buffer, BufferDescriptor, BufferUsages, Color, CommandEncoder,
    CompareFunction, Extent3d, LoadOp, MapMode, Operations, PrimitiveTopology,
    RenderPassColorAttachment, RenderPassDepthStencilAttachment, RenderPassDescriptor,
    RenderPipeline, StoreOp, TexelCopyBufferInfo, TexelCopyBufferLayout, Texture, TextureView,
};

/// Triangles of a frame of full meshes, unless told otherwise.
const TRIANGLE_BUDGET: u64 = 60_000_000;
/// Square pixels that a triangle of a level has on average before a finer one is taken, unless told
/// otherwise.
const TRIANGLE_PIXELS: f64 = 4.0;

/// Pixels that the ground may be off: ours.
const GROUND: f64 = 0.5;

/// A way to draw a forest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Peer {
    /// Every tree whole, while triangles last.
    FullMeshes,
    /// Levels of detail.
    LodChain,
    /// Quads that face the camera.
    Billboards,
}

impl Peer {
    /// All of them.
    pub(crate) const ALL: [Self; 3] = [Self::FullMeshes, Self::LodChain, Self::Billboards];
}

/// What a frame took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct PeerDrawn {
    /// Triangles of trees.
    pub(crate) triangles: u64,
    /// Draw calls, with those of ground and sky.
    pub(crate) draw_calls: u64,
    /// Trees that were drawn.
    pub(crate) trees: u64,
    /// Trees before the camera that were not: the budget was spent.
    pub(crate) left_out: u64,
}

/// `Tree` of common.wgsl.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct TreeRecord {
    foot: [f32; 3],
    scale: f32,
    turn: [f32; 2],
    yaw: f32,
    dark: f32,
}

/// `Patch` of ground.wgsl.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct PatchRecord {
    corner: [u32; 2],
    stride: u32,
    skirt: f32,
}

/// `Grid` of ground.wgsl.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct GridUniform {
    points: [u32; 2],
    cell: [f32; 2],
}

/// A scene on the device as a peer draws it, and its picture.
pub(crate) struct PeerModel {
    size: [u32; 2],
    land: Land,
    ground: Ground,
    culling: Culling,
    stocks: Vec<Stock>,
    light: Light,
    sky: Sky,
    maps: [MapUniform; 2],
    /// Most triangles of a frame of [`Peer::FullMeshes`].
    pub(crate) triangle_budget: u64,
    /// Square pixels of a triangle of [`Peer::LodChain`] on average, from which a finer level is taken.
    pub(crate) triangle_pixels: f64,
    view: Buffer,
    list: Buffer,
    patches: Buffer,
    view_group: BindGroup,
    ground_group: BindGroup,
    trees: TreePipelines,
    ground_pipeline: RenderPipeline,
    sky_pipeline: RenderPipeline,
    resolve: (RenderPipeline, BindGroup),
    samples: TextureView,
    depth: TextureView,
    pixels: Texture,
    bytes: u64,
}

/// Share of all light that the clump around a leaf lets through, of each species: ours.
fn clumps(scene: &Scene) -> Result<Vec<f32>> {
    let of = |s: &Species| -> Result<f32> {
        let canopy = Canopy::new(&s.points()?, &s.stance, Canopy::MOST);
        Ok((-canopy.clump()).exp() as f32)
    };
    scene.species.iter().map(of).collect()
}

impl PeerModel {
    /// Uploads a scene whose species were baked from `soups`.
    ///
    /// # Errors
    /// When the scene's packs are damaged or the device fails.
    pub(crate) fn new(
        gpu: &Gpu,
        scene: &Scene,
        soups: &[TriangleSoup],
        peer: Peer,
        size: [u32; 2],
        samples: u32,
    ) -> Result<Self> {
        ensure!(soups.len() == scene.species.len(), "{} sources of trees", soups.len());
        let common = format!(
            "const DEPTH_STEPS = {DEPTH_STEPS:?};\nconst DIFFUSE = {DIFFUSE:?};\nconst PATCH = {PATCH}u;\nconst SAMPLES = {samples};\n{}",
            include_str!("peers/common.wgsl")
        );
        let read = Kind::Read;
        let view_layout = device::layout(gpu, &[Kind::Uniform, read, read, read, read]);
        let ground_layout = device::layout(gpu, &[read, read, Kind::Uniform]);
        let trees = TreePipelines::new(gpu, &common, &view_layout);
        let stances = scene.stances();
        let stocks: Vec<Stock> = soups
            .iter()
            .zip(&stances)
            .map(|(soup, stance)| match peer {
                Peer::Billboards => Stock::boards(gpu, &trees, soup, stance),
                _ => {
                    let mesh = Mesh::new(soup, stance, peer == Peer::LodChain);
                    Stock::meshes(gpu, &trees, soup, mesh)
                }
            })
            .collect();
        let culled = stances.iter().zip(&stocks).map(|(s, stock)| Culled::new(s, stock.levels()));
        let culling = Culling::new(scene, culled.collect(), peer);
        let maps = scene.opacity_maps()?;
        let dark = clumps(scene)?;
        let records: Vec<TreeRecord> = scene
            .trees
            .iter()
            .map(|t| {
                let yaw = t.yaw();
                TreeRecord {
                    foot: t.position,
                    scale: t.scale(stances[t.species()].scale) as f32,
                    turn: [yaw.cos() as f32, yaw.sin() as f32],
                    yaw: yaw as f32,
                    dark: dark[t.species()],
                }
            })
            .collect();
        let storage = BufferUsages::STORAGE;
        let table = |bytes: &[u8]| device::filled(gpu, bytes, storage);
        let view = device::empty(gpu, size_of::<ViewUniform>() as u64, BufferUsages::UNIFORM);
        let list = device::empty(gpu, records.len() as u64 * 4, storage);
        let [sun, sky] = [&maps[0], &maps[1]].map(|m| table(bytemuck::cast_slice(&m.texels)));
        let records = table(bytemuck::cast_slice(&records));
        let whole = |all: &[&Buffer], layout| {
            let all: Vec<BindingResource> = all.iter().map(|b| b.as_entire_binding()).collect();
            device::group(gpu, layout, &all)
        };
        let view_group = whole(&[&view, &sun, &sky, &records, &list], &view_layout);
        let vertices = ground_vertices(&scene.land, &scene.file.land);
        let vertices = table(bytemuck::cast_slice(&vertices));
        let most = scene.land.points.map(|n| u64::from((n - 1).div_ceil(PATCH)));
        let patches = device::empty(gpu, most[0] * most[1] * 16, storage);
        let cell = scene.land.cell().map(|v| v as f32);
        let grid = GridUniform { points: scene.land.points, cell };
        let grid = device::filled(gpu, bytemuck::bytes_of(&grid), BufferUsages::UNIFORM);
        let ground_group = whole(&[&patches, &vertices, &grid], &ground_layout);
        let ground_module = device::module(gpu, &[&common, include_str!("peers/ground.wgsl")]);
        let ground_draws = Draws {
            module: &ground_module,
            fragment: "fragment",
            groups: &[&view_layout, &ground_layout],
            vertices: &[],
            topology: PrimitiveTopology::TriangleList,
            format: COLOR,
            depth: Some(CompareFunction::Greater),
        };
        let sky_module = device::module(gpu, &[&common, include_str!("peers/sky.wgsl")]);
        let sky_draws = Draws {
            module: &sky_module,
            groups: &[&view_layout],
            depth: Some(CompareFunction::GreaterEqual),
            ..ground_draws
        };
        let resolve_module = device::module(gpu, &[&common, include_str!("peers/resolve.wgsl")]);
        let resolve_layout = device::layout(gpu, &[Kind::Texels]);
        let resolve_draws = Draws {
            module: &resolve_module,
            groups: &[&resolve_layout],
            format: PICTURE,
            depth: None,
            ..ground_draws
        };
        let many = size.map(|n| n * samples);
        let target = |format| device::target(gpu, many, format).create_view(&Default::default());
        let color = target(COLOR);
        let bound = [BindingResource::TextureView(&color)];
        let resolve_group = device::group(gpu, &resolve_layout, &bound);
        let all = [&view, &list, &sun, &sky, &records, &vertices, &patches];
        let bytes = all.into_iter().map(Buffer::size).sum::<u64>()
            + stocks.iter().map(Stock::bytes).sum::<u64>();
        let model = Self {
            size,
            land: scene.land.clone(),
            ground: Ground::new(&scene.land),
            culling,
            stocks,
            light: scene.file.sun.light(),
            sky: scene.file.sky,
            maps: [&maps[0], &maps[1]].map(MapUniform::new),
            triangle_budget: TRIANGLE_BUDGET,
            triangle_pixels: TRIANGLE_PIXELS,
            view,
            list,
            patches,
            view_group,
            ground_group,
            trees,
            ground_pipeline: device::pipeline(gpu, &ground_draws),
            sky_pipeline: device::pipeline(gpu, &sky_draws),
            resolve: (device::pipeline(gpu, &resolve_draws), resolve_group),
            depth: target(DEPTH),
            samples: color,
            pixels: device::target(gpu, size, PICTURE),
            bytes,
        };
        gpu.finish()?;
        Ok(model)
    }

    /// Draws a frame and waits for it; `camera` has the size of the picture.
    ///
    /// # Errors
    /// When the device fails, or the camera is a parallel one.
    pub(crate) fn render(&mut self, gpu: &Gpu, camera: &Camera) -> Result<PeerDrawn> {
        ensure!([camera.width, camera.height] == self.size, "a camera of another size");
        let view = ViewUniform::new(camera, &self.light, &self.sky, self.maps)?;
        gpu.queue.write_buffer(&self.view, 0, bytemuck::bytes_of(&view));
        self.culling.fill(camera, self.triangle_budget, self.triangle_pixels);
        gpu.queue.write_buffer(&self.list, 0, bytemuck::cast_slice(&self.culling.list));
        let patches = self.ground.select(&self.land, camera, GROUND);
        let record = |p: &forest_scene::Patch| PatchRecord {
            corner: p.corner,
            stride: p.stride,
            skirt: p.skirt,
        };
        let patches: Vec<PatchRecord> = patches.iter().map(record).collect();
        gpu.queue.write_buffer(&self.patches, 0, bytemuck::cast_slice(&patches));
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let drawn = self.draw(&mut encoder, patches.len() as u32);
        gpu.queue.submit([encoder.finish()]);
        gpu.finish()?;
        Ok(drawn)
    }

    fn draw(&self, encoder: &mut CommandEncoder, patches: u32) -> PeerDrawn {
        let mut pass = encoder.begin_render_pass(&RenderPassDescriptor {
            label: Some("peer"),
            color_attachments: &[Some(cleared(&self.samples))],
            depth_stencil_attachment: Some(RenderPassDepthStencilAttachment {
                view: &self.depth,
                depth_ops: Some(Operations { load: LoadOp::Clear(0.0), store: StoreOp::Discard }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        let left_out = self.culling.left_out;
        let mut drawn = PeerDrawn { draw_calls: 2, left_out, ..PeerDrawn::default() };
        pass.set_bind_group(0, &self.view_group, &[]);
        for run in &self.culling.runs {
            let stock = &self.stocks[run.species];
            let trees = run.first..run.first + run.count;
            drawn.draw_calls += stock.draw(&mut pass, &self.trees, run.level, trees);
            drawn.trees += u64::from(run.count);
            drawn.triangles += stock.triangles(run.level) * u64::from(run.count);
        }
        // Most of the ground is behind trees.
        pass.set_pipeline(&self.ground_pipeline);
        pass.set_bind_group(1, &self.ground_group, &[]);
        pass.draw(0..6 * (PATCH + 2) * (PATCH + 2), 0..patches);
        pass.set_pipeline(&self.sky_pipeline);
        pass.draw(0..3, 0..1);
        drawn
    }

    /// Linear RGB of the last frame, the mean of all samples of a pixel.
    ///
    /// # Errors
    /// When the device fails.
    pub(crate) fn picture(&self, gpu: &Gpu) -> Result<Vec<[f32; 3]>> {
        let [width, height] = self.size;
        let row = width * 16;
        let pitch = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = gpu.device.create_buffer(&BufferDescriptor {
            label: Some("picture"),
            size: u64::from(pitch) * u64::from(height),
            usage: BufferUsages::COPY_DST | BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let target = self.pixels.create_view(&Default::default());
        let mut pass = encoder.begin_render_pass(&RenderPassDescriptor {
            label: Some("pixels"),
            color_attachments: &[Some(cleared(&target))],
            ..Default::default()
        });
        pass.set_pipeline(&self.resolve.0);
        pass.set_bind_group(0, &self.resolve.1, &[]);
        pass.draw(0..3, 0..1);
        drop(pass);
        let layout =
            TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(pitch), rows_per_image: None };
        encoder.copy_texture_to_buffer(
            self.pixels.as_image_copy(),
            TexelCopyBufferInfo { buffer: &buffer, layout },
            Extent3d { width, height, depth_or_array_layers: 1 },
        );
        gpu.queue.submit([encoder.finish()]);
        buffer.map_async(MapMode::Read, .., |_| {});
        gpu.finish()?;
        let bytes = buffer.get_mapped_range(..)?.to_vec();
        let rows = bytes.chunks_exact(pitch as usize);
        let pixel = |p: &[f32; 4]| [p[0], p[1], p[2]];
        let pixels = rows.flat_map(|r| {
            let row: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&r[..row as usize]);
            row.into_iter().map(|p| pixel(&p))
        });
        Ok(pixels.collect())
    }

    /// Bytes that it takes on the device, without what is drawn into.
    pub(crate) fn device_bytes(&self) -> u64 {
        self.bytes
    }
}

fn cleared(view: &TextureView) -> RenderPassColorAttachment<'_> {
    RenderPassColorAttachment {
        view,
        depth_slice: None,
        resolve_target: None,
        ops: Operations { load: LoadOp::Clear(Color::TRANSPARENT), store: StoreOp::Store },
    }
}
