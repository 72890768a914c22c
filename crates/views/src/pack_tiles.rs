//! Tiles into pages.

use crate::tile::TileLevel;
use etagere::{AllocatorOptions, AtlasAllocator, size2};

/// Where a level's tiles lie.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Layout {
    /// Texels across and down a page.
    pub(crate) page: [u32; 2],
    pub(crate) pages: u32,
    /// Page and place of each tile.
    pub(crate) places: Vec<(u32, [u32; 2])>,
}

/// Packs tiles into pages of at most `most × most` texels: one page of about their area if they
/// fit, else as many as it takes.
pub(crate) fn arrange(tiles: &[&TileLevel], most: u32) -> Layout {
    let mut order: Vec<usize> = (0..tiles.len()).filter(|&i| tiles[i].width > 0).collect();
    // Shelves want tiles of like height beside each other.
    order.sort_by_key(|&i| (std::cmp::Reverse((tiles[i].height, tiles[i].width)), i));
    let area: u64 = order.iter().map(|&i| u64::from(tiles[i].width * tiles[i].height)).sum();
    let widest = order.iter().map(|&i| tiles[i].width).max().unwrap_or(0);
    let mut side = (area.isqrt() as u32 + 1).max(widest).next_multiple_of(4);
    while side < most {
        let layout = fill(tiles, &order, [side, most]);
        // About square: wider until it is not higher than wide.
        if layout.pages <= 1 && layout.page[1] <= side {
            return layout;
        }
        side = (side + side / 16 + 4).next_multiple_of(4);
    }
    fill(tiles, &order, [most, most])
}

fn fill(tiles: &[&TileLevel], order: &[usize], [width, height]: [u32; 2]) -> Layout {
    let options = AllocatorOptions { alignment: size2(4, 4), ..AllocatorOptions::default() };
    let new = || AtlasAllocator::with_options(size2(width as i32, height as i32), &options);
    let mut pages: Vec<AtlasAllocator> = Vec::new();
    let mut out = Layout { page: [0; 2], pages: 0, places: vec![(0, [0; 2]); tiles.len()] };
    for &i in order {
        let size = size2(tiles[i].width as i32, tiles[i].height as i32);
        let found = pages.iter_mut().enumerate().find_map(|(p, a)| Some((p, a.allocate(size)?)));
        let (page, place) = found.unwrap_or_else(|| {
            pages.push(new());
            let last = pages.len() - 1;
            (last, pages[last].allocate(size).expect("a tile fits an empty page"))
        });
        let at = [place.rectangle.min.x as u32, place.rectangle.min.y as u32];
        out.places[i] = (page as u32, at);
        out.page =
            [out.page[0].max(at[0] + tiles[i].width), out.page[1].max(at[1] + tiles[i].height)];
    }
    out.pages = pages.len() as u32;
    out
}
