//! A landscape on a device.

use crate::bind;
use crate::device::Gpu;
use crate::error::GpuError;
use crate::frame::FrameUniform;
use crate::landscape::MOST_BANDS;
use crate::landscape::frame::{Bands, LandUniform, LandscapeDrawn, LightMapUniform};
use crate::landscape::impostors::Impostors;
use crate::landscape::pass::LandscapeRenderer;
use crate::landscape::tables::{SpeciesRecord, Tables};
use crate::points::{CellUniform, ChunkRecord};
use crate::triangles::TrianglesModel;
use bytemuck::{Pod, Zeroable};
use forest_foliage::Wind;
use forest_raster::Light;
use forest_scene::{Ground, PATCH, Patch, Scene, Tile, ground_vertices, instances};
use wgpu::{
    BindGroup, BindingResource, Buffer, BufferBinding, BufferDescriptor, BufferSize, BufferUsages,
};

/// Cells that are drawn of all trees of a frame.
const MOST_CELLS: u64 = 1 << 18;
/// Runs of points of a band.
const MOST_CHUNKS: u64 = 1 << 19;
/// Trees of a band whose cells are chosen one by one.
const MOST_NEAR: u64 = 1 << 16;
/// Points of a frame that are drawn as quads.
const MOST_LARGE: u64 = 1 << 18;
/// Runs of triangles of a frame, of each species.
const MOST_RUNS: u32 = 1 << 15;

/// Words of `Work` before its list.
pub(crate) const WORK_HEAD: usize = 12;

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

/// A scene on a device.
#[derive(Debug)]
pub struct Landscape<'s> {
    scene: &'s Scene,
    ground: Ground,
    tiles: Vec<Tile>,
    reach: Vec<f64>,
    species: Vec<SpeciesRecord>,
    maps: [LightMapUniform; 2],
    light: Light,
    wind: Wind,
    pub(crate) frame: Buffer,
    pub(crate) land: Buffer,
    pub(crate) land_group: BindGroup,
    patches: Buffer,
    pub(crate) ground_group: BindGroup,
    tile_list: Buffer,
    pub(crate) work: Buffer,
    pub(crate) arguments: Buffer,
    pub(crate) steps_group: BindGroup,
    pub(crate) large: Buffer,
    pub(crate) large_group: BindGroup,
    pub(crate) triangles: Vec<Option<TrianglesModel>>,
    /// Without views there are none.
    pub(crate) impostors: Impostors,
    pub(crate) has_views: bool,
    pub(crate) counted: Buffer,
    /// What the groups of a target's passes bind of it.
    pub(crate) choose: Vec<Buffer>,
    pub(crate) splat: Vec<Buffer>,
    pub(crate) bands: Bands,
    pub(crate) patch_count: u32,
    bytes: u64,
}

impl<'s> Landscape<'s> {
    /// Uploads a scene, and makes its opacity maps for its sun and for the sky.
    ///
    /// # Errors
    /// When a pack is damaged or lacks points, or the device does not take the points of all species in
    /// one buffer.
    pub fn load(
        gpu: &Gpu,
        renderer: &LandscapeRenderer,
        scene: &'s Scene,
    ) -> Result<Self, GpuError> {
        let mut tables = Tables::default();
        let blocks: Vec<_> = scene.species.iter().map(|s| s.points()).collect::<Result<_, _>>()?;
        let views: Vec<_> = scene.species.iter().map(|s| s.views()).collect::<Result<_, _>>()?;
        for ((species, block), views) in scene.species.iter().zip(&blocks).zip(&views) {
            tables.add(species, block, views.as_ref())?;
        }
        for (i, record) in (0..).zip(&mut tables.species) {
            (record.first_run, record.runs) = (i * MOST_RUNS, MOST_RUNS);
        }
        let storage = BufferUsages::STORAGE;
        let table = |what: &str, bytes: &[u8]| gpu.storage(what, &[bytes]);
        let parts: Vec<&[u8]> = blocks.iter().map(|b| bytemuck::cast_slice(b.points)).collect();
        let points = gpu.storage("points of all species", &parts)?;
        let cells =
            gpu.buffer("cells of trees", MOST_CELLS * size_of::<CellUniform>() as u64, storage)?;
        let radii = table("radii", bytemuck::cast_slice(&tables.radii))?;
        let trees = table("trees", bytemuck::cast_slice(&scene.trees))?;
        let codes = table("size codes", bytemuck::cast_slice(&tables.codes()))?;
        let species = table("species", bytemuck::cast_slice(&tables.species))?;
        let stocks = table("cells of species", bytemuck::cast_slice(&tables.stocks))?;
        let work_bytes = WORK_HEAD as u64 * 4 + MOST_NEAR * 8;
        let work = gpu.buffer("work", work_bytes, storage | BufferUsages::COPY_SRC)?;
        let chunk = size_of::<ChunkRecord>() as u64;
        let chunks = gpu.buffer("chunks of points", MOST_CHUNKS * chunk, storage)?;
        let kinds = scene.species.len() as u64;
        let runs_each = u64::from(MOST_RUNS) * 16;
        let runs = gpu.buffer("runs of triangles", kinds * runs_each, storage)?;
        let indirect = storage | BufferUsages::INDIRECT;
        let there: Vec<_> = views.iter().flatten().collect();
        let (planted, count) = ([&trees, &species], scene.trees.len() as u64);
        let impostors = Impostors::load(gpu, renderer, &there, &tables.views, planted, count)?;
        let arguments = gpu.buffer("arguments", 32, indirect)?;
        let large = gpu.buffer("large points", MOST_LARGE * 8 + 16, indirect)?;
        let tiles = instances::tiles(&scene.trees);
        // A tile may lie in every band.
        let list = (size_of::<[[u32; 4]; MOST_BANDS]>() + MOST_BANDS * tiles.len() * 8) as u64;
        let tile_list = gpu.buffer("tiles", list, storage)?;

        let light = scene.file.sun.light();
        let [sun, sky] = scene.opacity_maps()?;
        let sun_map = table("light of the sun", bytemuck::cast_slice(&sun.texels))?;
        let sky_map = table("light of the sky", bytemuck::cast_slice(&sky.texels))?;
        let uniform = |what, size| gpu.buffer(what, size as u64, BufferUsages::UNIFORM);
        let frame = uniform("frame", size_of::<FrameUniform>())?;
        let land = uniform("land", size_of::<LandUniform>())?;
        let layouts = &renderer.layouts;
        fn whole(b: &Buffer) -> BindingResource<'_> {
            b.as_entire_binding()
        }
        let group = |label, layout, all: &[&Buffer]| {
            let all: Vec<BindingResource> = all.iter().map(|b| whole(b)).collect();
            bind::group(&gpu.device, label, layout, &all)
        };
        let land_group = group("land", &layouts.land, &[&frame, &land, &sun_map, &sky_map]);

        let ground = Ground::new(&scene.land);
        let vertices = ground_vertices(&scene.land, &scene.file.land);
        let vertices = table("points of the ground", bytemuck::cast_slice(&vertices))?;
        let most = scene.land.points.map(|n| u64::from((n - 1).div_ceil(PATCH)));
        let patches = gpu.buffer("patches", most[0] * most[1] * 16, storage)?;
        let grid = uniform("grid", size_of::<GridUniform>())?;
        let cell = scene.land.cell().map(|v| v as f32);
        let points_across = GridUniform { points: scene.land.points, cell };
        gpu.queue.write_buffer(&grid, 0, bytemuck::bytes_of(&points_across));
        let ground_group = group("ground", &layouts.ground, &[&patches, &vertices, &grid]);

        let mut triangles = Vec::new();
        for (i, (species, block)) in (0..).zip(scene.species.iter().zip(&blocks)) {
            let runs = BindingResource::Buffer(BufferBinding {
                buffer: &runs,
                offset: i * runs_each,
                size: BufferSize::new(runs_each),
            });
            let layout = &layouts.triangles;
            triangles.push(match block.triangles.is_empty() {
                true => None,
                false => Some(TrianglesModel::load(
                    gpu,
                    layout,
                    &species.pack,
                    block,
                    &cells,
                    Some(runs),
                )?),
            });
        }
        let counted = gpu.device.create_buffer(&BufferDescriptor {
            label: Some("counted"),
            size: WORK_HEAD as u64 * 4,
            usage: BufferUsages::COPY_DST | BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let steps_group = group("steps", &layouts.steps, &[&work, &arguments]);
        let large_group = group("large points", &layouts.large, &[&points, &cells, &radii, &large]);
        let stances = scene.stances();
        let choose = [&points, &tile_list, &radii, &trees, &species, &stocks, &work, &cells]
            .into_iter()
            .chain([&chunks, &codes, &runs, impostors.boards()])
            .cloned()
            .collect();
        let splat = [&points, &cells, &radii, &chunks, &large, &work].map(Buffer::clone).into();
        let all = [&points, &cells, &radii, &trees, &species, &stocks, &work, &chunks, &codes]
            .into_iter()
            .chain([&runs, &large, &tile_list, &sun_map, &sky_map, &vertices])
            .chain([&patches]);
        let bytes = all.map(Buffer::size).sum::<u64>()
            + triangles.iter().flatten().map(|t| t.bytes()).sum::<u64>()
            + impostors.bytes();
        gpu.finish()?;
        Ok(Self {
            scene,
            ground,
            tiles,
            species: tables.species,
            reach: stances.iter().map(|s| s.reach() * s.scale[1]).collect(),
            maps: [&sun, &sky].map(LightMapUniform::new),
            light,
            wind: Wind::default(),
            frame,
            land,
            land_group,
            patches,
            ground_group,
            tile_list,
            work,
            arguments,
            steps_group,
            large,
            large_group,
            triangles,
            has_views: !there.is_empty(),
            impostors,
            counted,
            choose,
            splat,
            bands: Bands::default(),
            patch_count: 0,
            bytes,
        })
    }

    /// The wind that its trees stand in from now on; calm at first.
    pub fn set_wind(&mut self, wind: Wind) {
        self.wind = wind;
    }

    /// The scene.
    pub fn scene(&self) -> &'s Scene {
        self.scene
    }

    /// Bytes that it takes on the device, without targets.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// What the last frame took; waits for it.
    ///
    /// # Errors
    /// When the device failed.
    pub fn drawn(&self, gpu: &Gpu) -> Result<LandscapeDrawn, GpuError> {
        let bytes = crate::timer::read(gpu, &self.counted)?;
        let words: Vec<u32> = bytemuck::pod_collect_to_vec(&bytes);
        let ground = u64::from(self.patch_count * 2 * PATCH * PATCH);
        let [trees, points, triangles, left_out, beyond, impostors] =
            [4, 5, 6, 7, 8, 9].map(|i| u64::from(words[i]));
        let looked_at = self.bands.trees;
        Ok(LandscapeDrawn {
            looked_at,
            trees,
            impostors,
            points,
            triangles,
            ground,
            left_out,
            beyond,
        })
    }

    /// Chooses tiles and patches, and uploads what a frame needs.
    pub(crate) fn prepare(
        &mut self,
        gpu: &Gpu,
        camera: &forest_soup::Camera,
        detail: &crate::landscape::LandscapeDetail,
        side: u32,
        bands: usize,
    ) {
        let samples = crate::frame::supersampled(camera, side);
        let frame = FrameUniform::of_land(&samples, &self.light);
        let land = LandUniform::new(self.maps, camera, detail, &self.scene.file.sky, side)
            .with_wind(&self.wind);
        let queue = &gpu.queue;
        queue.write_buffer(&self.frame, 0, bytemuck::bytes_of(&frame));
        queue.write_buffer(&self.land, 0, bytemuck::bytes_of(&land));
        let far = self.species.iter().map(|s| s.drawn_by_views_from(camera, detail));
        let far = far.fold(0.0, f64::max);
        self.bands.fill(&self.tiles, &self.reach, camera, bands, far);
        let head: &[u8] = bytemuck::cast_slice(&self.bands.firsts);
        queue.write_buffer(&self.tile_list, 0, head);
        let list = bytemuck::cast_slice(&self.bands.tiles);
        queue.write_buffer(&self.tile_list, head.len() as u64, list);
        let patches = self.ground.select(&self.scene.land, camera, detail.ground);
        self.patch_count = patches.len() as u32;
        let record = |p: Patch| PatchRecord { corner: p.corner, stride: p.stride, skirt: p.skirt };
        let patches: Vec<PatchRecord> = patches.into_iter().map(record).collect();
        queue.write_buffer(&self.patches, 0, bytemuck::cast_slice(&patches));
        queue.write_buffer(&self.work, 0, bytemuck::cast_slice(&[0u32; WORK_HEAD]));
        self.impostors.clear(gpu);
        // Four corners, no instance yet.
        queue.write_buffer(&self.large, 0, bytemuck::cast_slice(&[4u32, 0, 0, 0]));
    }
}

const _: () = assert!(size_of::<CellUniform>() == 80);
