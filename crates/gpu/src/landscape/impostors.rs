//! Impostors: far trees as quads that show views.
//!
//! The views of all species lie in one sheet, so that all impostors are one draw, from near to far:
//! light is the dear part of a sample, and what is hidden is not lit.

use crate::bind;
use crate::device::Gpu;
use crate::error::GpuError;
use crate::landscape::RUN_TRIANGLES;
use crate::landscape::pass::LandscapeRenderer;
use crate::sheet::{Place, Sheet};
use crate::textures::array_view;
use crate::views::{FrameRecord, frame_records, page_format, page_texels};
use bytemuck::{Pod, Zeroable};
use forest_scene::{Impostor, MOST_SPECIES, Stance};
use forest_views::{Channel, Directions, Quality, TileRecord, ViewsBlock};
use glam::DVec3;
use std::f64::consts::{PI, TAU};
use wgpu::{BindGroup, BindingResource, Buffer, BufferUsages, Texture};

/// Steps of a compass around, and from the nadir to the zenith.
pub(crate) const COMPASS: [u32; 2] = [256, 128];

/// Buckets that impostors are sorted into by distance, and those of an octave: up to 65 km.
pub(crate) const BUCKETS: u32 = 1024;
pub(crate) const BUCKETS_PER_OCTAVE: u32 = 64;

/// Words of `Boards` before the draws of triangles, and before its list.
const BEFORE_DRAWS: usize = 4 + BUCKETS as usize;
const BOARDS_HEAD: usize = BEFORE_DRAWS + 4 * MOST_SPECIES;

/// Impostors that a workgroup sorts.
pub(crate) const SORTED_AT_ONCE: u32 = 256;

/// What `Species` of tree.wgsl has of its views.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ViewsRecord {
    pub(crate) center: [f32; 3],
    pub(crate) side: f32,
    pub(crate) texels: f32,
    pub(crate) most: f32,
    pub(crate) levels: u32,
    pub(crate) first_level: u32,
    pub(crate) first_frame: u32,
    pub(crate) first_compass: u32,
}

/// `Level` of impostor.wgsl.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct LevelRecord {
    first_tile: u32,
    has_depth: u32,
    texels: f32,
    reach: f32,
}

/// The views of all species, but for their texels.
#[derive(Debug, Default)]
pub(crate) struct ViewTables {
    levels: Vec<LevelRecord>,
    frames: Vec<FrameRecord>,
    compass: Vec<[u32; 2]>,
    tiles: u32,
    /// Of each species that has views.
    rules: Vec<Impostor>,
}

impl ViewTables {
    /// Adds the views of a species.
    pub(crate) fn add(&mut self, views: &ViewsBlock, stance: &Stance) -> ViewsRecord {
        let header = &views.header;
        let rule = Impostor::new(views, stance);
        let record = ViewsRecord {
            center: rule.center.as_vec3().to_array(),
            side: rule.side as f32,
            texels: rule.texels as f32,
            most: rule.most_pixels(rule.texels) as f32,
            levels: rule.levels.len() as u32,
            first_level: self.levels.len() as u32,
            first_frame: self.frames.len() as u32,
            first_compass: self.compass.len() as u32,
        };
        for level in rule.levels.clone() {
            self.levels.push(LevelRecord {
                first_tile: self.tiles,
                has_depth: header.channels.depth.into(),
                texels: header.levels[level].texels as f32,
                reach: (header.radius / header.half) as f32,
            });
            self.tiles += views.tiles[level].len() as u32;
        }
        self.frames.extend(frame_records(views));
        self.compass.extend(compass(views.directions()));
        self.rules.push(rule);
        record
    }
}

/// By direction to the eye, three views of 16 bits and the shares of the first two of 8.
fn compass(directions: &Directions) -> Vec<[u32; 2]> {
    let [around, up] = COMPASS;
    let entry = |row: u32, column: u32| {
        let elevation = ((f64::from(row) + 0.5) / f64::from(up) - 0.5) * PI;
        let azimuth = ((f64::from(column) + 0.5) / f64::from(around) - 0.5) * TAU;
        let (y, flat) = elevation.sin_cos();
        let (x, z) = azimuth.sin_cos();
        let [a, b, c] = directions.blend(DVec3::new(x * flat, y, z * flat));
        let share = |s: f32| (s * 255.0).round() as u32;
        [a.0 | b.0 << 16, c.0 | share(a.1) << 16 | share(b.1) << 24]
    };
    (0..up).flat_map(|row| (0..around).map(move |column| entry(row, column))).collect()
}

/// The impostors of a landscape on a device.
#[derive(Debug)]
pub(crate) struct Impostors {
    /// Counts, and trees as they are found.
    boards: Buffer,
    /// The arguments of the draw.
    pub(crate) draw: Buffer,
    pub(crate) sort_group: BindGroup,
    pub(crate) group: BindGroup,
    bytes: u64,
}

impl Impostors {
    /// Those of species with these views; `trees` and `species` are the tables of them, for `count`
    /// trees.
    pub(crate) fn load(
        gpu: &Gpu,
        renderer: &LandscapeRenderer,
        views: &[&ViewsBlock],
        tables: &ViewTables,
        [trees, species]: [&Buffer; 2],
        count: u64,
    ) -> Result<Self, GpuError> {
        let storage = BufferUsages::STORAGE;
        // Where there are no views there are no impostors.
        let room = if views.is_empty() { 1 } else { count.max(1) };
        let indirect = storage | BufferUsages::INDIRECT;
        let boards = gpu.buffer("impostors", BOARDS_HEAD as u64 * 4 + room * 8, indirect)?;
        let sorted = gpu.buffer("sorted impostors", room * 4, storage)?;
        let draw = gpu.buffer("draw of impostors", 16, indirect)?;
        let pages = Pages::load(gpu, views, &tables.rules)?;
        let tiles = gpu.storage("tiles", &[bytemuck::cast_slice(&pages.tiles)])?;
        let levels = gpu.storage("levels", &[bytemuck::cast_slice(&tables.levels)])?;
        let frames = gpu.storage("frames", &[bytemuck::cast_slice(&tables.frames)])?;
        let compass = gpu.storage("compass of views", &[bytemuck::cast_slice(&tables.compass)])?;
        let textures = pages.textures.each_ref().map(array_view);
        let buffers = [trees, species, &sorted, &levels, &tiles, &frames, &compass];
        let mut all: Vec<BindingResource> = buffers.map(Buffer::as_entire_binding).into();
        all.extend(textures.iter().map(BindingResource::TextureView));
        let to_sort = [&boards, &sorted, &draw].map(Buffer::as_entire_binding);
        let own = [&boards, &sorted, &levels, &tiles, &frames, &compass];
        let bytes = own.map(Buffer::size).iter().sum::<u64>()
            + pages.textures.iter().map(texture_bytes).sum::<u64>();
        let layouts = &renderer.layouts;
        Ok(Self {
            sort_group: bind::group(&gpu.device, "sort", &layouts.sort, &to_sort),
            group: bind::group(&gpu.device, "impostors", &layouts.impostors, &all),
            boards,
            draw,
            bytes,
        })
    }

    /// Where the culling shader puts them.
    pub(crate) fn boards(&self) -> &Buffer {
        &self.boards
    }

    /// Forgets those of the last frame, and all runs of triangles.
    pub(crate) fn clear(&self, gpu: &Gpu) {
        let mut head = [0u32; BOARDS_HEAD];
        head[BEFORE_DRAWS..].iter_mut().step_by(4).for_each(|v| *v = 3 * RUN_TRIANGLES);
        gpu.queue.write_buffer(&self.boards, 0, bytemuck::cast_slice(&head));
    }

    /// Where in [`Impostors::boards`] the draw of a species' triangles lies, in bytes.
    pub(crate) fn draw_of_triangles(species: u64) -> u64 {
        4 * BEFORE_DRAWS as u64 + 16 * species
    }

    /// Bytes that they take on the device.
    pub(crate) fn bytes(&self) -> u64 {
        self.bytes
    }
}

/// Colours and depths of all levels, and where tiles lie in them.
struct Pages {
    textures: [Texture; 2],
    tiles: Vec<TileRecord>,
}

impl Pages {
    fn load(gpu: &Gpu, all: &[&ViewsBlock], rules: &[Impostor]) -> Result<Self, GpuError> {
        let is_block = |v: &&ViewsBlock| v.header.quality == Quality::Block;
        let compressed = gpu.takes_blocks() && all.iter().all(is_block);
        let drawn = || {
            let both = all.iter().zip(rules);
            both.flat_map(|(views, rule)| rule.levels.clone().map(move |level| (*views, level)))
        };
        let sizes: Vec<[u32; 2]> = drawn()
            .flat_map(|(v, l)| {
                let level = &v.header.levels[l];
                (0..level.pages).map(|_| level.page)
            })
            .collect();
        let sheet = Sheet::new(gpu, &sizes)?;
        let texture = |what, channel| sheet.texture(gpu, what, page_format(channel, compressed));
        let textures = [
            texture("colours of views", Channel::Color)?,
            texture("depths of views", Channel::Depth)?,
        ];
        let mut tiles = Vec::new();
        let mut first = 0;
        for (views, level) in drawn() {
            let count = views.header.levels[level].pages as usize;
            let places = &sheet.places[first..first + count];
            first += count;
            tiles.extend(views.tiles[level].iter().map(|tile| moved(tile, places)));
            let channels = [Channel::Color, Channel::Depth];
            for (texture, channel) in textures.iter().zip(channels) {
                let texels = page_texels(views, channel, level, compressed)?;
                if !texels.is_empty() {
                    let page = views.header.levels[level].page;
                    let bytes = texels.len() / count;
                    for (place, texels) in places.iter().zip(texels.chunks_exact(bytes)) {
                        let origin = [place.corner[0], place.corner[1], place.layer];
                        gpu.write_texels(texture, origin, [page[0], page[1], 1], texels);
                    }
                }
            }
        }
        Ok(Self { textures, tiles })
    }
}

/// A tile where its page lies in the sheet.
fn moved(tile: &TileRecord, places: &[Place]) -> TileRecord {
    let place = &places[usize::from(tile.page)];
    TileRecord {
        x: tile.x + place.corner[0] as u16,
        y: tile.y + place.corner[1] as u16,
        page: place.layer as u16,
        ..*tile
    }
}

fn texture_bytes(texture: &Texture) -> u64 {
    let (across, down) = texture.format().block_dimensions();
    let blocks = u64::from(texture.width().div_ceil(across))
        * u64::from(texture.height().div_ceil(down))
        * u64::from(texture.depth_or_array_layers());
    blocks * u64::from(texture.format().block_copy_size(None).unwrap_or(4))
}

#[cfg(test)]
mod tests {
    use super::*;
    use forest_views::Dome;

    #[test]
    fn a_compass_points_at_the_views_around() {
        let directions = Directions::octahedral(64, Dome::Upper);
        let compass = compass(&directions);
        let [around, up] = COMPASS;
        // Half-way up, towards +x: azimuths are from +z to +x.
        let [row, column] = [up * 3 / 4, around * 3 / 4];
        let [ab, c] = compass[(row * around + column) as usize];
        let views = [ab & 0xffff, ab >> 16, c & 0xffff];
        let toward = DVec3::new(0.5f64.sqrt(), 0.5f64.sqrt(), 0.0);
        let closeness = |v: u32| directions.direction(v).dot(toward);
        let mut best: Vec<u32> = (0..64).collect();
        best.sort_by(|a, b| closeness(*b).total_cmp(&closeness(*a)));
        assert!(views.contains(&best[0]), "{views:?} without {}", best[0]);
        // Shares are 255 at most.
        assert!((c >> 16 & 0xff) + (c >> 24) <= 256);
    }

    #[test]
    fn tiles_move_with_their_pages() {
        let tile = TileRecord { x: 8, y: 4, page: 1, width: 4, height: 4, ..Default::default() };
        let at = |corner, layer| Place { corner, layer };
        let places = [at([0, 0], 0), at([100, 200], 3)];
        let there = moved(&tile, &places);
        assert_eq!((there.x, there.y, there.page, there.width), (108, 204, 3, 4));
    }
}
