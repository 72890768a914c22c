//! Foliage as one glb: its levels as a chain of MSFT_lod, the views on crossed planes as the last one, and
//! the wind as vertex attributes.
//! What it holds: docs/GLB.md.

mod buffer;
mod level;
mod materials;
mod planes;

use crate::ExportError;
use crate::picture::ExportFile;
use buffer::Binary;
use forest_foliage::wind::{FLUTTER, FLUTTER_FREQUENCY, RISE, STEADY, SWINGS};
use forest_foliage::{BranchRecord, FoliageBlock, Wind};
use forest_views::ViewsBlock;
use glam::DVec3;
use gltf::binary::{Glb, Header};
use level::Levels;
use materials::Materials;
use planes::Planes;
use serde_json::{Value, json};
use std::borrow::Cow;
use std::f64::consts::PI;

/// The screen that switches are told for, in pixels.
const SCREEN: [f64; 2] = [1920.0, 1080.0];

/// From this many sizes away from the world's zero the node is moved there, not the vertices, which have 24
/// bits.
const FAR: f64 = 1000.0;

/// World place of the zero of a tree's exported vertices.
pub(crate) fn place(foliage: &FoliageBlock) -> DVec3 {
    let [min, max] = foliage.bounds();
    let far = foliage.origin().abs().max_element() > FAR * min.distance(max);
    if far { foliage.origin() } else { DVec3::ZERO }
}

/// Of a glb's document and buffer: its length has 32 bits and counts headers and padding too.
const MOST_BYTES: usize = u32::MAX as usize - 64;

/// `NAME.glb`: all levels of the foliage, and the views as the last one if the pack has them. Its first node
/// has the switches in `extras.MSFT_screencoverage`, as shares of the screen's area, and the branches in
/// `extras.forest_wind`; attributes of vertices are those of docs/GLB.md.
///
/// # Errors
/// When the pack is damaged, or a texture too large.
pub fn levels(
    foliage: &FoliageBlock,
    views: Option<&ViewsBlock>,
    name: &str,
) -> Result<ExportFile, ExportError> {
    let [min, max] = foliage.bounds();
    let place = place(foliage);
    let far = place != DVec3::ZERO;
    let (mut binary, mut materials) = (Binary::default(), Materials::default());
    let (mut meshes, mut nodes) = (Vec::new(), Vec::new());
    let mut add = |mesh: Value, name: &str, texel: f64, triangles: usize| {
        let mut node = json!({
            "name": name, "mesh": meshes.len(),
            "extras": { "texel": texel, "triangles": triangles },
        });
        if far {
            node["translation"] = place.to_array().to_vec().into();
        }
        meshes.push(mesh);
        nodes.push(node);
    };
    let mut finer = Levels::read(foliage, place)?;
    let mut texels: Vec<f64> = Vec::new();
    for (l, header) in foliage.header.levels.iter().enumerate() {
        let name = format!("{name}_LOD{l}");
        let mesh = finer.mesh(l, &name, &mut binary, &mut materials)?;
        add(mesh, &name, header.texel, header.triangles() as usize);
        texels.push(header.texel);
    }
    if let Some(views) = views {
        // As much coarser than the last level as that is than the one before.
        let texel = 2.0 * texels.last().copied().unwrap_or(0.0);
        let planes = Planes::new(views, texel);
        let name = format!("{name}_LOD{}", texels.len());
        let mesh = planes.mesh(&name, place, &mut binary, &mut materials)?;
        add(mesh, &name, texel, planes.triangles());
        texels.push(texel);
    }
    let wind = binary.view(bytemuck::cast_slice(foliage.branches), None);
    let first = &mut nodes[0];
    first["extras"]["forest_wind"] = json!({
        "bufferView": wind,
        "branches": foliage.branches.len(),
        "byteStride": size_of::<BranchRecord>(),
        "steady": STEADY,
        "swings": SWINGS.to_vec(),
        "rise": RISE,
        "flutter": FLUTTER,
        "flutterFrequency": FLUTTER_FREQUENCY,
        "frequency": Wind::default().frequency,
        "origin": (foliage.origin() - place).to_array().to_vec(),
    });
    let mut used = materials.used;
    if texels.len() > 1 {
        first["extensions"] =
            json!({ "MSFT_lod": { "ids": (1..texels.len()).collect::<Vec<_>>() } });
        first["extras"]["MSFT_screencoverage"] = coverages(&texels, 0.5 * min.distance(max)).into();
        used.insert("MSFT_lod");
    }
    let mut document = json!({
        "asset": {
            "version": "2.0",
            "generator": concat!("forest-bake ", env!("CARGO_PKG_VERSION")),
        },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": nodes,
        "meshes": meshes,
        "materials": materials.materials,
        "textures": materials.textures,
        "images": materials.images,
        "samplers": materials.samplers,
        "accessors": binary.accessors,
        "bufferViews": binary.views,
        "buffers": [{ "byteLength": binary.bytes.len() }],
        "extensionsUsed": used,
    });
    // Lists have an element or are not there.
    let object = document.as_object_mut().expect("an object");
    object.retain(|_, v| v.as_array().is_none_or(|a| !a.is_empty()));
    let text = document.to_string();
    let length = text.len() + binary.bytes.len();
    if length > MOST_BYTES {
        let problem = format!("the levels take {length} bytes; a glb holds {MOST_BYTES}");
        return Err(ExportError::Unsuited(problem));
    }
    let glb = Glb {
        // The length is that of what is written.
        header: Header { magic: *b"glTF", version: 2, length: 0 },
        json: Cow::Owned(text.into_bytes()),
        bin: Some(Cow::Owned(binary.bytes)),
    };
    let bytes = glb.to_vec().expect("memory takes all that is written");
    Ok(ExportFile { name: format!("{name}.glb"), bytes })
}

/// Of each level, the share of the screen below which the next one takes over; 0 for the last.
fn coverages(texels: &[f64], radius: f64) -> Vec<f64> {
    let at = |next: &f64| {
        let pixels = radius / next;
        (PI * pixels * pixels / (SCREEN[0] * SCREEN[1])).min(1.0)
    };
    texels.iter().skip(1).map(at).chain([0.0]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_level_is_shown_until_the_next_ones_texels_are_pixels() {
        // A sphere of 100 pixels radius where a pixel is 0.1 units wide, then of 50.
        let got = coverages(&[0.05, 0.1, 0.2], 10.0);
        let area = |r: f64| PI * r * r / (1920.0 * 1080.0);
        assert_eq!(got, [area(100.0), area(50.0), 0.0]);
        assert_eq!(coverages(&[1.0], 10.0), [0.0]);
    }
}
