//! The rules of SPEC.md, section 8, in one place.

use crate::dictionary::MOST_SIDE;
use crate::header::{DICTIONARY, FoliageHeader, VertexRecord};
use crate::options;
use crate::wind::{BranchRecord, MOST_FLEXIBLE, MOST_LEVELS, NO_BRANCH};
use forest_pack::kind;

/// The section's kind and index, and the broken rule.
type Broken = (u16, u32, String);

/// Checks the header alone: before anything is read that its numbers describe.
///
/// # Errors
/// The first broken rule, with the field, the value and the limit.
pub(crate) fn validate_header(h: &FoliageHeader) -> Result<(), String> {
    let numbers = h.origin.iter().chain(h.bounds.as_flattened());
    if let Some(v) = numbers.clone().find(|v| v.is_nan() || v.abs() >= 1e300) {
        return Err(format!("a position is {v}; it must be within ±1e300"));
    }
    if (0..3).any(|k| h.bounds[0][k] > h.bounds[1][k]) {
        return Err(format!("box {:?} is inside out", h.bounds));
    }
    let is_length = |v: f64| v > 0.0 && v < 1e300;
    if !is_length(h.pivot_step) {
        return Err(format!("steps of pivots are {}; above 0 and below 1e300", h.pivot_step));
    }
    if h.atlas.iter().any(|s| !(16..=MOST_SIDE).contains(s) || s % 16 != 0) {
        return Err(format!(
            "dictionary of {:?} texels; multiples of 16 up to {MOST_SIDE}",
            h.atlas
        ));
    }
    if !(1..=options::MOST_LEVELS as usize).contains(&h.levels.len()) {
        return Err(format!("{} levels; from 1 to {}", h.levels.len(), options::MOST_LEVELS));
    }
    if !(1..=u32::from(u16::MAX)).contains(&h.wind) {
        return Err(format!("{} branches in the wind; from 1 to {}", h.wind, u16::MAX));
    }
    if !(0.0..=1.0).contains(&h.translucency) {
        return Err(format!("leaves have a translucency of {}; from 0 to 1", h.translucency));
    }
    for (l, level) in h.levels.iter().enumerate() {
        let coarser = l == 0 || level.texel > h.levels[l - 1].texel;
        if !is_length(level.texel) || !coarser {
            return Err(format!("level {l} has texels of {}; they must grow", level.texel));
        }
        if level.wood_vertices > level.vertices || !(0.0..=2.0).contains(&level.sunlit) {
            let (wood, all, sunlit) = (level.wood_vertices, level.vertices, level.sunlit);
            return Err(format!(
                "level {l}: {wood} of {all} vertices are wood; cards get {sunlit} of the sun"
            ));
        }
        if level.triangles() > u64::from(u32::MAX) {
            return Err(format!("level {l} has {} triangles; below 2³²", level.triangles()));
        }
    }
    Ok(())
}

/// Checks every invariant of a foliage representation that renderers rely on.
///
/// # Errors
/// The first broken rule, with the element, the value and the limit.
pub fn validate(
    h: &FoliageHeader,
    branches: &[BranchRecord],
    vertices: &[&[VertexRecord]],
    indices: &[&[[u32; 3]]],
) -> Result<(), (u16, u32, String)> {
    validate_header(h).map_err(|problem| (kind::FOLIAGE_HEADER, 0, problem))?;
    wind(h, branches).map_err(|problem| (kind::WIND_BRANCHES, 0, problem))?;
    for (l, level) in h.levels.iter().enumerate() {
        let (v, t) = (vertices[l], indices[l]);
        let broken =
            |kind, problem: String| -> Result<(), Broken> { Err((kind, l as u32, problem)) };
        if v.len() != level.vertices as usize {
            let problem = format!("{} vertices; the header has {}", v.len(), level.vertices);
            return broken(kind::FOLIAGE_VERTICES, problem);
        }
        if t.len() as u64 != level.triangles() {
            let problem = format!("{} triangles; the header has {}", t.len(), level.triangles());
            return broken(kind::FOLIAGE_INDICES, problem);
        }
        if let Some(i) = t.iter().position(|t| t.iter().any(|&i| i >= level.vertices)) {
            let problem = format!("triangle {i} uses vertices {:?} of {}", t[i], level.vertices);
            return broken(kind::FOLIAGE_INDICES, problem);
        }
        for (i, v) in v.iter().enumerate() {
            if v.position.iter().chain(&v.uv).any(|x| !x.is_finite()) {
                let problem = format!("vertex {i} is at {:?}, {:?}", v.position, v.uv);
                return broken(kind::FOLIAGE_VERTICES, problem);
            }
            if u32::from(v.hung.branch) >= h.wind {
                let problem = format!("vertex {i} hangs on branch {} of {}", v.hung.branch, h.wind);
                return broken(kind::FOLIAGE_VERTICES, problem);
            }
        }
    }
    Ok(())
}

fn wind(h: &FoliageHeader, branches: &[BranchRecord]) -> Result<(), String> {
    if branches.len() != h.wind as usize {
        return Err(format!("{} branches; the header has {}", branches.len(), h.wind));
    }
    for (i, b) in branches.iter().enumerate() {
        let places = b.base.iter().chain(&b.linear).chain(&b.square);
        if places.clone().any(|v| !v.is_finite()) || !(b.length > 0.0 && b.length.is_finite()) {
            return Err(format!("branch {i} is not finite or {} long", b.length));
        }
        let shares = [b.at, b.phase, b.flexibility / MOST_FLEXIBLE, b.frequency / 16.0];
        if shares.iter().any(|s| !(0.0..=1.0).contains(s)) {
            return Err(format!(
                "branch {i}: place, phase, flexibility or frequency is {shares:?}"
            ));
        }
        let parent = branches[..i].get(b.parent as usize);
        let level = parent.map_or(0, |p| p.level + 1);
        if (b.parent == NO_BRANCH) == parent.is_some()
            || (parent.is_none() && b.parent != NO_BRANCH)
        {
            return Err(format!("branch {i} grows from {}", b.parent));
        }
        if b.level != level || level >= MOST_LEVELS {
            return Err(format!("branch {i} is of level {}, not {level} < {MOST_LEVELS}", b.level));
        }
    }
    Ok(())
}

/// Whether a draw's material is one of `materials`.
pub(crate) fn is_material(material: u16, materials: usize) -> bool {
    material == DICTIONARY || usize::from(material) < materials
}
