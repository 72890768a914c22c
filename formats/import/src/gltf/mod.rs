//! glTF 2.0.
//!
//! The `gltf` crate parses container and JSON schema; what indices point at is checked here, node
//! transforms are read in `f64`, and extensions that the crate refuses are resolved here.

mod accessor;
mod buffers;
mod material;
mod nodes;
mod primitive;
#[cfg(test)]
mod tests;

use crate::ImportError;
use crate::files::Content;
use crate::source::Source;
use buffers::{Buffers, Part};
use forest_soup::{Material, Model};
use gltf::json::Root;

/// Extensions that may be required: read here, or without effect on shape and base colour.
const SUPPORTED: &[&str] = &[
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_texture_transform",
    "KHR_xmp_json_ld",
];

/// Reads a `.glb` or `.gltf`.
pub(crate) fn load(source: &mut Source) -> Result<Model, ImportError> {
    let content = source.content();
    let (json, blob) = split(source, content)?;
    let json = &*json;
    let root: Root =
        gltf::json::deserialize::from_slice(json).map_err(|e| source.invalid("JSON", e))?;
    if let Some(extension) =
        root.extensions_required.iter().find(|e| !SUPPORTED.contains(&e.as_str()))
    {
        return Err(source.unsupported(format!("the glTF extension {extension}")));
    }
    let version = root.asset.min_version.as_ref().unwrap_or(&root.asset.version);
    if !version.starts_with("2.") {
        return Err(source.unsupported(format!("glTF version {version}")));
    }
    let buffers = Buffers::read(source, &root, blob)?;
    let textures = material::textures(source, &root, &buffers)?;
    let mut model = Model { textures: textures.list, ..Model::default() };
    let mut looks = Vec::new();
    for i in 0..root.materials.len() {
        let (material, look) = material::material(source, &root, i, &textures.of)?;
        model.materials.push(material);
        looks.push(look);
    }
    if model.materials.len() >= usize::from(u16::MAX) {
        let problem = format!("{}; the limit is {}", model.materials.len(), u16::MAX - 1);
        return Err(source.invalid("materials", problem));
    }
    // Primitives without a material get glTF's default one.
    let default = model.materials.len() as u16;
    let mut uses_default = false;
    let mut of_mesh = Vec::new();
    for (m, mesh) in root.meshes.iter().enumerate() {
        let first = model.meshes.len() as u32;
        for (p, primitive) in mesh.primitives.iter().enumerate() {
            let element = format!("mesh {m} primitive {p}");
            let material = primitive.material.map(|i| i.value());
            let look = match material {
                Some(i) => Some(looks.get(i).ok_or_else(|| {
                    source.invalid(&element, format!("material {i} of {}", looks.len()))
                })?),
                None => None,
            };
            let index = material.map_or(default, |i| i as u16);
            let read = primitive::mesh(source, &root, &buffers, &element, primitive, look)?;
            if let Some(mut mesh) = read {
                uses_default |= material.is_none();
                mesh.material = index;
                model.meshes.push(mesh);
            }
        }
        of_mesh.push(first..model.meshes.len() as u32);
    }
    if uses_default {
        model.materials.push(Material::default());
    }
    model.instances = nodes::instances(source, json, &root, &buffers, &of_mesh)?;
    Ok(model)
}

/// The JSON and, of a binary container, where its binary chunk lies.
fn split(source: &Source, content: Content) -> Result<(Vec<u8>, Option<Part>), ImportError> {
    let io = |e| source.io(e);
    let range = |from: u64, to: u64| content.range(from..to).map_err(io);
    let word = |at: u64| {
        let bytes = range(at, at + 4)?;
        Ok::<_, ImportError>(
            bytes.and_then(|b| <[u8; 4]>::try_from(&*b).ok()).map(u32::from_le_bytes),
        )
    };
    let invalid = |problem: &str| Err(source.invalid("glb container", problem));
    if word(0)? != Some(u32::from_le_bytes(*b"glTF")) {
        return Ok((content.whole().map_err(io)?, None));
    }
    match word(4)? {
        Some(2) => {}
        Some(other) => return Err(source.unsupported(format!("binary glTF version {other}"))),
        None => return invalid("it ends within its header"),
    }
    let length = match word(8)?.map(u64::from) {
        Some(length) if length >= 20 && length <= content.len() => length,
        Some(length) => {
            let has = content.len();
            return invalid(&format!(
                "its header says {length} bytes; it has {has}, and 20 at least"
            ));
        }
        None => return invalid("it ends within its header"),
    };
    let json_length = word(12)?.map_or(0, u64::from);
    if word(16)? != Some(u32::from_le_bytes(*b"JSON")) {
        return invalid("its first chunk is not the JSON");
    }
    let json_end = 20 + json_length;
    if json_end > length {
        return invalid(&format!("its JSON of {json_length} bytes goes beyond its end"));
    }
    let json = range(20, json_end)?.unwrap_or_default().into_owned();
    let is_binary =
        json_end + 8 <= length && word(json_end + 4)? == Some(u32::from_le_bytes(*b"BIN\0"));
    if !is_binary {
        return Ok((json, None));
    }
    let start = json_end + 8;
    let end = start + word(json_end)?.map_or(0, u64::from);
    if end > length {
        return invalid(&format!("its binary chunk of {} bytes goes beyond its end", end - start));
    }
    Ok((json, Some(Part { content, range: start..end })))
}

/// An index that points at nothing.
fn missing(source: &Source, element: &str, what: &str, index: usize, count: usize) -> ImportError {
    source.invalid(element, format!("{what} {index} of {count}"))
}
