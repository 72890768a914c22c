//! The rules of SPEC.md, section 6, in one place.

use crate::codec::Channel;
use crate::directions::MAX_VIEWS;
use crate::header::{MAX_TEXELS, TileRecord, ViewsHeader};
use forest_pack::kind;

/// Largest page side.
const MAX_PAGE: u32 = 16384;

/// Most pages of a level.
const MAX_PAGES: u32 = 2048;

/// Checks the header alone: before anything is read that its numbers describe.
///
/// # Errors
/// The first broken rule, with the field, the value and the limit.
pub(crate) fn validate_header(h: &ViewsHeader) -> Result<(), String> {
    h.directions.validate()?;
    let numbers = h.center.iter().chain(h.bounds.as_flattened());
    if let Some(v) = numbers.clone().find(|v| !v.is_finite()) {
        return Err(format!("a position is {v}; it must be finite"));
    }
    for (name, v) in [("half a tile", h.half), ("radius", h.radius)] {
        if !(v > 0.0 && v < 1e300) {
            return Err(format!("{name} is {v}; it must be above 0 and below 1e300"));
        }
    }
    if (0..3).any(|k| h.bounds[0][k] > h.bounds[1][k]) {
        return Err(format!("box {:?} is inside out", h.bounds));
    }
    if !(1..=1 << 12).contains(&h.samples) {
        return Err(format!("{} samples a texel; from 1 to 4096", h.samples));
    }
    let Some(finest) = h.levels.first() else { return Err("no levels".into()) };
    if !finest.texels.is_power_of_two() || finest.texels > MAX_TEXELS {
        let texels = finest.texels;
        return Err(format!("{texels} texels a tile; powers of two from 1 to {MAX_TEXELS}"));
    }
    for (i, level) in h.levels.iter().enumerate() {
        let want = finest.texels.checked_shr(i as u32).unwrap_or(0);
        if level.texels != want || want == 0 {
            return Err(format!("level {i} has {} texels a tile; expected {want}", level.texels));
        }
        for side in level.page {
            if side > MAX_PAGE || !side.is_multiple_of(4) {
                let problem = "multiples of 4 up to";
                return Err(format!("level {i} has pages of {side} texels; {problem} {MAX_PAGE}"));
            }
        }
        if level.pages > MAX_PAGES {
            return Err(format!("level {i} has {} pages; the limit is {MAX_PAGES}", level.pages));
        }
    }
    Ok(())
}

/// Checks tiles and the lengths of the channels' sections against a sound header. An error names
/// the section's kind and level.
///
/// # Errors
/// The first broken rule, with the element, the value and the limit.
pub(crate) fn validate(
    h: &ViewsHeader,
    tiles: &[&[TileRecord]],
    lengths: &dyn Fn(Channel) -> Vec<Option<u64>>,
) -> Result<(), (u16, u32, String)> {
    debug_assert!(h.directions.count() <= MAX_VIEWS);
    for (l, (level, tiles)) in (0..).zip(h.levels.iter().zip(tiles)) {
        let fail = |problem: String| Err((kind::VIEWS_TILES, l, problem));
        if tiles.len() != h.directions.count() as usize {
            return fail(format!("{} tiles for {} views", tiles.len(), h.directions.count()));
        }
        for (i, t) in tiles.iter().enumerate() {
            if (t.width == 0) != (t.height == 0) {
                return fail(format!("tile {i} is {}×{} texels", t.width, t.height));
            }
            if !(1..=255).contains(&t.cutoff) {
                return fail(format!("tile {i} has cutoff {}; from 1 to 255", t.cutoff));
            }
            if t.width == 0 {
                continue;
            }
            if [t.x, t.y, t.width, t.height].iter().any(|v| !v.is_multiple_of(4)) {
                return fail(format!("tile {i} is not in whole blocks: {t:?}"));
            }
            let ends = [(t.x, t.width, level.page[0]), (t.y, t.height, level.page[1])];
            if ends.iter().any(|(at, size, page)| u32::from(*at) + u32::from(*size) > *page)
                || u32::from(t.page) >= level.pages
            {
                return fail(format!("tile {i} leaves its page: {t:?} of {level:?}"));
            }
            let most = level.texels as i32 + 4;
            for (at, size) in [(t.left, t.width), (t.top, t.height)] {
                if at < -1 || i32::from(at) + i32::from(size) > most {
                    let problem = format!("tile {i} covers {at} and {size} on of {most} texels");
                    return fail(problem);
                }
            }
        }
    }
    for channel in Channel::ALL {
        let kind = crate::bake::section_kind(channel);
        for (l, (found, level)) in (0..).zip(lengths(channel).into_iter().zip(&h.levels)) {
            let want = h.channels.has(channel).then(|| channel.level_bytes(h.quality, level));
            if found != want {
                let text = |n: Option<u64>| n.map_or("no section".into(), |n| format!("{n} bytes"));
                let problem = format!("{}; the header asks for {}", text(found), text(want));
                return Err((kind, l, problem));
            }
        }
    }
    Ok(())
}
