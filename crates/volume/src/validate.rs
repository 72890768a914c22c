//! The rules of SPEC.md, section 7, in one place.

use crate::header::{Coding, NodeRecord, VolumeHeader};
use crate::options::MAX_WORDS;
use crate::photograph::MAX_CAMERAS;
use forest_pack::kind;

/// Texels of all billboards: 4 GiB of them.
const MAX_ALL_TEXELS: u64 = 1 << 30;

/// Checks the header alone: before anything is read that its numbers describe.
///
/// # Errors
/// The first broken rule, with the field, the value and the limit.
pub(crate) fn validate_header(h: &VolumeHeader) -> Result<(), String> {
    let numbers = h.corner.iter().chain(h.bounds.as_flattened());
    // Sums of positions stay finite too.
    if let Some(v) = numbers.clone().find(|v| v.is_nan() || v.abs() >= 1e300) {
        return Err(format!("a position is {v}; it must be within ±1e300"));
    }
    if !(h.side > 0.0 && h.side < 1e300) {
        return Err(format!("the side is {}; it must be above 0 and below 1e300", h.side));
    }
    if (0..3).any(|k| h.bounds[0][k] > h.bounds[1][k]) {
        return Err(format!("box {:?} is inside out", h.bounds));
    }
    if ![2, 4, 8].contains(&h.texels) {
        return Err(format!("{} texels a side of a billboard; 2, 4 or 8", h.texels));
    }
    if !(0.0..=1.0).contains(&h.prune) {
        return Err(format!("pruned above {}; from 0 to 1", h.prune));
    }
    if !(1..=MAX_CAMERAS as usize).contains(&h.cameras.len()) {
        return Err(format!("{} cameras; from 1 to {MAX_CAMERAS}", h.cameras.len()));
    }
    for (i, camera) in h.cameras.iter().enumerate() {
        camera.validate().map_err(|e| format!("camera {i}: {e}"))?;
    }
    let most = h.branching.most_levels() as usize + 1;
    if !(1..=most).contains(&h.levels.len()) {
        return Err(format!("{} levels; from 1 to {most}", h.levels.len()));
    }
    if h.levels[0].nodes != 1 {
        return Err(format!("{} roots", h.levels[0].nodes));
    }
    for (l, level) in h.levels.iter().enumerate() {
        let places = u64::from(h.branching.factor()).pow(3 * l as u32);
        if u64::from(level.nodes) > places {
            return Err(format!("level {l} has {} nodes in {places} places", level.nodes));
        }
        let most = u64::from(level.nodes) * h.cameras.len() as u64;
        if u64::from(level.billboards) > most {
            return Err(format!("level {l} has {} billboards; at most {most}", level.billboards));
        }
    }
    let billboards: u64 = h.levels.iter().map(|l| u64::from(l.billboards)).sum();
    let texels = billboards * h.billboard_texels() as u64;
    if texels > MAX_ALL_TEXELS {
        return Err(format!(
            "{billboards} billboards of {texels} texels; at most {MAX_ALL_TEXELS}"
        ));
    }
    if let Coding::Codebook { colors, alphas, .. } = h.coding {
        for (name, n) in [("colour", colors), ("alpha", alphas)] {
            if !(1..=MAX_WORDS).contains(&(n as usize)) {
                return Err(format!("{n} {name} codewords; from 1 to {MAX_WORDS}"));
            }
        }
    }
    Ok(())
}

/// A level as it is stored.
pub(crate) struct StoredLevel<'a> {
    pub(crate) nodes: &'a [NodeRecord],
    pub(crate) masks: &'a [u32],
}

/// Checks nodes and masks against a sound header. An error names the section's kind and level.
///
/// # Errors
/// The first broken rule, with the element, the value and the limit.
pub(crate) fn validate(h: &VolumeHeader, levels: &[StoredLevel]) -> Result<(), (u16, u32, String)> {
    for (l, (stored, level)) in (0..).zip(levels.iter().zip(&h.levels)) {
        let fail = |kind, problem: String| Err((kind, l, problem));
        if stored.nodes.len() != level.nodes as usize {
            let problem = format!("{} nodes; the header says {}", stored.nodes.len(), level.nodes);
            return fail(kind::VOLUME_NODES, problem);
        }
        let words = level.nodes as usize * h.mask_words();
        if stored.masks.len() != words {
            let problem = format!("{} words of masks; expected {words}", stored.masks.len());
            return fail(kind::VOLUME_CAMERAS, problem);
        }
        let next = levels.get(l as usize + 1).map_or(&[][..], |next| next.nodes);
        if let Err((kind, problem)) = validate_level(h, stored, level.billboards, next) {
            return fail(kind, problem);
        }
    }
    match levels.first().map(|l| l.nodes[0].place) {
        Some([0, 0, 0]) => Ok(()),
        place => Err((kind::VOLUME_NODES, 0, format!("the root is at {place:?}"))),
    }
}

/// Nodes must tile the billboards of their level and the nodes of the next.
fn validate_level(
    h: &VolumeHeader,
    stored: &StoredLevel,
    billboards: u32,
    next: &[NodeRecord],
) -> Result<(), (u16, String)> {
    let cameras = h.cameras.len();
    let words = h.mask_words();
    let (mut billboard, mut child) = (0u32, 0u32);
    for (i, (node, mask)) in stored.nodes.iter().zip(stored.masks.chunks_exact(words)).enumerate() {
        let fail = |problem: String| Err((kind::VOLUME_NODES, format!("node {i} {problem}")));
        let used: u32 = mask.iter().map(|m| m.count_ones()).sum();
        let beyond = !cameras.is_multiple_of(32) && mask[words - 1] >> (cameras % 32) != 0;
        if beyond {
            let problem = format!("node {i} has billboards of cameras beyond the {cameras}");
            return Err((kind::VOLUME_CAMERAS, problem));
        }
        if node.zero != 0 {
            return fail(format!("has {} where 0 must be", node.zero));
        }
        if node.first_billboard != billboard {
            return fail(format!("starts at billboard {}, not {billboard}", node.first_billboard));
        }
        billboard = billboard.saturating_add(used);
        if u64::from(node.children) >> h.branching.children() != 0 {
            return fail(format!(
                "has children {:#x} of {}",
                node.children,
                h.branching.children()
            ));
        }
        if node.children != 0 && node.first_child != child {
            return fail(format!("starts at child {}, not {child}", node.first_child));
        }
        if node.children == 0 && node.first_child != 0 {
            return fail(format!("has no child and starts at child {}", node.first_child));
        }
        for k in (0..h.branching.children()).filter(|k| node.children >> k & 1 == 1) {
            let Some(found) = next.get(child as usize) else {
                return fail(format!("has child {child} of {}", next.len()));
            };
            let place = node.place() * h.branching.factor() + h.branching.place(k);
            if found.place() != place {
                return fail(format!("has child {child} at {}, not {place}", found.place()));
            }
            child += 1;
        }
    }
    if billboard != billboards {
        let problem = format!("{billboard} billboards; the header says {billboards}");
        return Err((kind::VOLUME_CAMERAS, problem));
    }
    if child as usize != next.len() {
        let problem = format!("{child} children; the next level has {} nodes", next.len());
        return Err((kind::VOLUME_NODES, problem));
    }
    Ok(())
}
