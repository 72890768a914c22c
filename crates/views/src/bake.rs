//! Views of a tree into the sections of a pack.

use crate::codec::{Channel, decode, encode};
use crate::error::ViewsError;
use crate::fit::Frame;
use crate::header::{LevelHeader, TileRecord, ViewFrame, ViewsHeader};
use crate::options::{Quality, ViewsOptions};
use crate::pack_tiles::{Layout, arrange};
use crate::tile::{TileLevel, cutoff, levels};
use crate::validate::validate_header;
use forest_pack::{Codec, PackWriter, SectionId, header, kind};
use forest_raster::{Buffers, Subject};
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Views that a thread captures with the same buffers.
const BATCH: u32 = 8;

/// What a bake did.
#[derive(Clone, Debug, PartialEq)]
pub struct BakeReport {
    /// The header that was written.
    pub header: ViewsHeader,
    /// Radius of the sphere about the source's box, in world units: what half a tile would be
    /// without fitting.
    pub sphere: f64,
    /// Texels of the finest level.
    pub texels: TexelCounts,
    /// Stored bytes of all levels and channels.
    pub bytes: u64,
    /// Capturing views; summed over threads it is up to as many times more.
    pub capture: Duration,
    /// Of that, filtering views to levels, dilating and rounding: share of the threads' time.
    pub filter_share: f64,
    /// Packing and encoding.
    pub encode: Duration,
}

/// Texels of the finest level: how well tiles are filled.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TexelCounts {
    /// Of whole tiles.
    pub tiles: u64,
    /// Of what is stored of them.
    pub stored: u64,
    /// Of the pages, with what lies between tiles.
    pub pages: u64,
    /// That show something.
    pub seen: u64,
}

/// Captures `subject` and adds the sections of the views representation to `writer`. `progress` is
/// told how many views are captured.
///
/// # Errors
/// When an option makes no sense or the pack cannot be written.
pub fn bake(
    subject: &dyn Subject,
    frame: &Frame,
    options: &ViewsOptions,
    writer: &mut PackWriter,
    progress: &(dyn Fn(u64) + Sync),
) -> Result<BakeReport, ViewsError> {
    options.validate().map_err(ViewsError::Options)?;
    let start = Instant::now();
    let (done, filtering) = (AtomicU64::new(0), AtomicU64::new(0));
    let count = options.directions.count();
    let views: Vec<Vec<TileLevel>> = (0..count.div_ceil(BATCH))
        .into_par_iter()
        .flat_map_iter(|batch| {
            let mut buffers = Buffers::default();
            let views = batch * BATCH..((batch + 1) * BATCH).min(count);
            let tiles: Vec<_> = views
                .map(|i| {
                    let (tile, spent) = view(subject, frame, options, i, &mut buffers);
                    filtering.fetch_add(spent.as_nanos() as u64, Ordering::Relaxed);
                    progress(done.fetch_add(1, Ordering::Relaxed) + 1);
                    tile
                })
                .collect();
            tiles
        })
        .collect();
    let capture = start.elapsed();
    let start = Instant::now();
    let mut header = ViewsHeader {
        center: frame.center.to_array(),
        half: frame.half,
        radius: frame.radius,
        bounds: frame.bounds.map(|b| b.to_array()),
        directions: options.directions,
        channels: options.channels,
        quality: options.quality,
        fit: options.fit,
        samples: options.samples_a_texel(),
        levels: Vec::new(),
    };
    let mut texels = TexelCounts::default();
    let mut bytes = 0;
    for level in 0..=options.texels.trailing_zeros() {
        let tiles: Vec<&TileLevel> = views.iter().map(|v| &v[level as usize]).collect();
        let layout = arrange(&tiles, options.max_page);
        let info =
            LevelHeader { texels: options.texels >> level, page: layout.page, pages: layout.pages };
        header.levels.push(info);
        // What the reader would refuse is not written.
        validate_header(&header).map_err(ViewsError::Options)?;
        if level == 0 {
            texels = TexelCounts::of(&tiles, &info);
        }
        let stored = encoded(options, &tiles, &layout);
        let records = records(options.quality, &tiles, &layout, &stored[0].1);
        let id = |kind| SectionId::new(kind, level);
        let rows: &[u8] = bytemuck::cast_slice(&records);
        writer.add(id(kind::VIEWS_TILES), Codec::None, rows)?;
        for (channel, data) in &stored {
            bytes += data.len() as u64;
            writer.add(id(section_kind(*channel)), Codec::None, data)?;
        }
    }
    header::write(writer, SectionId::new(kind::VIEWS_HEADER, 0), &header)?;
    let threads = rayon::current_num_threads() as f64;
    let spent = Duration::from_nanos(filtering.load(Ordering::Relaxed)).as_secs_f64();
    let filter_share = spent / threads / capture.as_secs_f64().max(1e-9);
    let encode = start.elapsed();
    Ok(BakeReport { header, sphere: frame.sphere, texels, bytes, capture, filter_share, encode })
}

/// The section kind of a channel's pages.
pub(crate) fn section_kind(channel: Channel) -> u16 {
    match channel {
        Channel::Color => kind::VIEWS_COLOR,
        Channel::Normal => kind::VIEWS_NORMAL,
        Channel::Depth => kind::VIEWS_DEPTH,
        Channel::Sky => kind::VIEWS_SKY,
    }
}

impl ViewsOptions {
    fn samples_a_texel(&self) -> u32 {
        self.samples_a_side().pow(2)
    }

    /// The channels that are stored.
    fn stored(&self) -> impl Iterator<Item = (usize, Channel)> + '_ {
        Channel::ALL.into_iter().enumerate().filter(|(_, c)| self.channels.has(*c))
    }
}

/// View `i` at all levels, and the time that its filtering took.
fn view(
    subject: &dyn Subject,
    frame: &Frame,
    options: &ViewsOptions,
    i: u32,
    buffers: &mut Buffers,
) -> (Vec<TileLevel>, Duration) {
    let from = options.directions.direction(i);
    let (camera, distance) = (frame.camera(from, options.texels), frame.eye_distance());
    let capture = subject.capture(&camera, options.samples_a_side(), buffers);
    let start = Instant::now();
    let view = ViewFrame::new(from);
    let tiles = levels(&capture, &view, distance, frame.radius, options.samples_a_side());
    (tiles, start.elapsed())
}

/// The pages of each stored channel, encoded.
fn encoded(
    options: &ViewsOptions,
    tiles: &[&TileLevel],
    layout: &Layout,
) -> Vec<(Channel, Vec<u8>)> {
    let channels = options.stored();
    channels
        .map(|(k, channel)| {
            let raw = pages(tiles, layout, k, channel.raw_bytes());
            (channel, encode(channel, options.quality, layout.page[0], &raw))
        })
        .collect()
}

/// Channel `k` of all tiles, laid into pages one under the other.
fn pages(tiles: &[&TileLevel], layout: &Layout, k: usize, bytes: usize) -> Vec<u8> {
    let [width, height] = layout.page.map(|v| v as usize);
    let mut out = vec![0; width * height * layout.pages as usize * bytes];
    for (tile, &(page, [x, y])) in tiles.iter().zip(&layout.places) {
        let row = tile.width as usize * bytes;
        for (r, from) in tile.raw[k].chunks_exact(row.max(1)).enumerate() {
            let at = ((page as usize * height + y as usize + r) * width + x as usize) * bytes;
            out[at..at + row].copy_from_slice(from);
        }
    }
    out
}

/// The tile table: alpha thresholds are those of the texels as they will be read.
fn records(
    quality: Quality,
    tiles: &[&TileLevel],
    layout: &Layout,
    color: &[u8],
) -> Vec<TileRecord> {
    let [width, height] = layout.page;
    let read = decode(Channel::Color, quality, width, color);
    let record = |(tile, &(page, [x, y])): (&&TileLevel, &(u32, [u32; 2]))| {
        let first = |row| ((page * height + y + row) as usize * width as usize + x as usize) * 4;
        let rows = (0..tile.height).map(|row| &read[first(row)..][..tile.width as usize * 4]);
        let alphas = rows.flat_map(|row| row.as_chunks::<4>().0.iter().map(|t| t[3]));
        TileRecord {
            x: x as u16,
            y: y as u16,
            page: page as u16,
            cutoff: u16::from(cutoff(alphas, tile.passing)),
            left: tile.left as i16,
            top: tile.top as i16,
            width: tile.width as u16,
            height: tile.height as u16,
        }
    };
    tiles.iter().zip(&layout.places).map(record).collect()
}

impl TexelCounts {
    fn of(tiles: &[&TileLevel], level: &LevelHeader) -> Self {
        let seen = |t: &&TileLevel| t.raw[0].as_chunks::<4>().0.iter().filter(|c| c[3] > 0).count();
        Self {
            tiles: u64::from(level.texels).pow(2) * tiles.len() as u64,
            stored: tiles.iter().map(|t| u64::from(t.width * t.height)).sum(),
            pages: level.page_texels(),
            seen: tiles.iter().map(|t| seen(t) as u64).sum(),
        }
    }
}
