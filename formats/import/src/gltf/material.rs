//! Materials, textures, samplers, images.

use super::buffers::Buffers;
use super::missing;
use crate::source::Source;
use crate::{ImportError, picture};
use forest_soup::{AlphaMode, Material, Relief, Texture, Wrap};
use gltf::json::extensions::texture::TextureTransform;
use gltf::json::texture::{Info, WrappingMode};
use gltf::json::validation::Checked;
use gltf::json::{Root, material::AlphaMode as JsonAlphaMode};
use serde_json::Value;
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::sync::Arc;

/// How a material's texture is laid on: the set of coordinates, and the affine map of
/// KHR_texture_transform as two rows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Look {
    pub(crate) uv_set: u32,
    pub(crate) transform: [[f64; 3]; 2],
}

/// The textures that materials use.
#[derive(Default)]
pub(crate) struct Textures {
    pub(crate) list: Vec<Arc<Texture>>,
    /// From glTF texture to `list`.
    pub(crate) of: HashMap<usize, u32>,
    decoded: HashMap<(usize, [Wrap; 2]), u32>,
    images: HashMap<usize, (String, image::DynamicImage)>,
}

/// Decodes the images of all textures that are used, each once for each way of wrapping it.
pub(crate) fn textures(
    source: &mut Source,
    root: &Root,
    buffers: &Buffers,
) -> Result<Textures, ImportError> {
    let mut textures = Textures::default();
    for (i, m) in root.materials.iter().enumerate() {
        let user = format!("material {i}");
        if let Some(t) = base_color(source, root, i)?.texture {
            textures.decode(source, root, buffers, &user, t.index)?;
        }
        let Some(normal) = &m.normal_texture else { continue };
        match textures.decode(source, root, buffers, &user, normal.index.value()) {
            // A tree without its bumps is still that tree.
            Err(ImportError::Unsupported { what, .. }) => {
                source.warn(format!("{user}: its normal texture needs {what}: left out"));
            }
            other => other?,
        }
    }
    Ok(textures)
}

impl Textures {
    /// Decodes glTF texture `index`, which `user` names.
    fn decode(
        &mut self,
        source: &mut Source,
        root: &Root,
        buffers: &Buffers,
        user: &str,
        index: usize,
    ) -> Result<(), ImportError> {
        if self.of.contains_key(&index) {
            return Ok(());
        }
        let element = format!("texture {index}");
        let count = root.textures.len();
        let texture = root
            .textures
            .get(index)
            .ok_or_else(|| missing(source, user, "texture", index, count))?;
        let others = texture.extensions.as_ref().map(|e| &e.others);
        let webp =
            others.and_then(|o| o.get("EXT_texture_webp")).and_then(|e| e["source"].as_u64());
        let image = match webp.map(|i| i as usize).unwrap_or(texture.source.value()) {
            // The crate's mark for "no source".
            i if i == u32::MAX as usize => {
                let extension = others.and_then(|o| o.keys().next());
                let name = extension.map_or("a texture without source", |e| e.as_str());
                return Err(source.unsupported(format!("{element}: {name}")));
            }
            i => i,
        };
        let wrap = wrap(source, root, &element, texture.sampler.map(|s| s.value()))?;
        let slot = match self.decoded.get(&(image, wrap)) {
            Some(&slot) => slot,
            None => {
                if let Entry::Vacant(e) = self.images.entry(image) {
                    e.insert(decode_image(source, root, buffers, image)?);
                }
                let (name, picture) = &self.images[&image];
                self.list.push(Arc::new(picture::texture(name.clone(), picture, wrap)));
                let slot = self.list.len() as u32 - 1;
                self.decoded.insert((image, wrap), slot);
                slot
            }
        };
        self.of.insert(index, slot);
        Ok(())
    }
}

fn decode_image(
    source: &mut Source,
    root: &Root,
    buffers: &Buffers,
    index: usize,
) -> Result<(String, image::DynamicImage), ImportError> {
    let count = root.images.len();
    let image =
        root.images.get(index).ok_or_else(|| missing(source, "file", "image", index, count))?;
    let mut element = format!("image {index}");
    let bytes = match (&image.uri, image.buffer_view) {
        (Some(uri), _) => {
            if !uri.starts_with("data:") {
                element = format!("image {index} ({uri})");
            }
            source.uri(&element, uri)?.whole().map_err(|e| source.io(e))?
        }
        (None, Some(view)) => buffers.view(source, root, view.value())?.bytes.into_owned(),
        (None, None) => return Err(source.invalid(element, "neither uri nor bufferView")),
    };
    let picture = picture::decode(source, &element, &bytes)?;
    let named = |n: &String| !n.starts_with("data:");
    let name = image.name.clone().or_else(|| image.uri.clone().filter(named));
    Ok((name.unwrap_or(element), picture))
}

fn wrap(
    source: &Source,
    root: &Root,
    element: &str,
    sampler: Option<usize>,
) -> Result<[Wrap; 2], ImportError> {
    let Some(index) = sampler else { return Ok([Wrap::Repeat; 2]) };
    let count = root.samplers.len();
    let sampler = root
        .samplers
        .get(index)
        .ok_or_else(|| missing(source, element, "sampler", index, count))?;
    let mode = |m: &Checked<WrappingMode>| match m {
        Checked::Valid(WrappingMode::ClampToEdge) => Ok(Wrap::Clamp),
        Checked::Valid(WrappingMode::MirroredRepeat) => Ok(Wrap::Mirror),
        Checked::Valid(WrappingMode::Repeat) => Ok(Wrap::Repeat),
        Checked::Invalid => Err(source.invalid(format!("sampler {index}"), "unknown wrap mode")),
    };
    Ok([mode(&sampler.wrap_s)?, mode(&sampler.wrap_t)?])
}

/// Base colour of a material: factor and texture.
struct BaseColor {
    factor: [f32; 4],
    texture: Option<BaseTexture>,
}

struct BaseTexture {
    index: usize,
    look: Look,
}

/// From pbrMetallicRoughness or, where a material has it, KHR_materials_pbrSpecularGlossiness.
fn base_color(source: &Source, root: &Root, i: usize) -> Result<BaseColor, ImportError> {
    let m = &root.materials[i];
    let others = m.extensions.as_ref().map(|e| &e.others);
    if let Some(gloss) = others.and_then(|o| o.get("KHR_materials_pbrSpecularGlossiness")) {
        let fail = |e: serde_json::Error| {
            source.invalid(format!("material {i}"), format!("pbrSpecularGlossiness: {e}"))
        };
        let factor = gloss.get("diffuseFactor").cloned().map(serde_json::from_value).transpose();
        let info = gloss.get("diffuseTexture").cloned().map(serde_json::from_value::<Info>);
        let info = info.transpose().map_err(fail)?;
        let texture = info.map(|t| BaseTexture { index: t.index.value(), look: of_info(&t) });
        return Ok(BaseColor { factor: factor.map_err(fail)?.unwrap_or([1.0; 4]), texture });
    }
    let pbr = &m.pbr_metallic_roughness;
    let texture = pbr.base_color_texture.as_ref();
    Ok(BaseColor {
        factor: pbr.base_color_factor.0,
        texture: texture.map(|t| BaseTexture { index: t.index.value(), look: of_info(t) }),
    })
}

fn of_info(info: &Info) -> Look {
    let transform = info.extensions.as_ref().and_then(|e| e.texture_transform.as_ref());
    look(info.tex_coord, transform)
}

/// KHR_texture_transform: uv′ = translation · rotation · scale · uv, rotation counter-clockwise in
/// a space whose v points down.
fn look(uv_set: u32, transform: Option<&TextureTransform>) -> Look {
    let Some(t) = transform else {
        return Look { uv_set, transform: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] };
    };
    let [sx, sy] = t.scale.0.map(f64::from);
    let [ox, oy] = t.offset.0.map(f64::from);
    let (sin, cos) = f64::from(t.rotation.0).sin_cos();
    Look {
        uv_set: t.tex_coord.unwrap_or(uv_set),
        transform: [[cos * sx, sin * sy, ox], [-sin * sx, cos * sy, oy]],
    }
}

/// KHR_materials_diffuse_transmission, by its factors: of light on the far side the share f shines through, of
/// light on the near one 1 − f comes back. A surface is said here to give back all of its colour, and f over
/// 1 − f of it from behind, at most all. Materials without the extension, and those of files without it, let
/// light through as the light says.
fn translucency(source: &Source, m: &gltf::json::Material, i: usize) -> Result<f32, ImportError> {
    let others = m.extensions.as_ref().map(|e| &e.others);
    let Some(own) = others.and_then(|o| o.get("KHR_materials_diffuse_transmission")) else {
        return Ok(Material::default().translucency);
    };
    let share = own.get("diffuseTransmissionFactor").map_or(Some(0.0), Value::as_f64);
    match share.filter(|s| (0.0..=1.0).contains(s)) {
        Some(share) => Ok((share / (1.0 - share)).min(1.0) as f32),
        None => {
            let problem = format!("diffuseTransmissionFactor {own}; it must be within 0 and 1");
            Err(source.invalid(format!("material {i}"), problem))
        }
    }
}

/// The normal texture of material `i`, and how it is laid on.
fn relief(
    source: &Source,
    m: &gltf::json::Material,
    i: usize,
    textures: &HashMap<usize, u32>,
) -> Result<Option<(Relief, Look)>, ImportError> {
    let Some(normal) = &m.normal_texture else { return Ok(None) };
    // It was left out.
    let Some(&texture) = textures.get(&normal.index.value()) else { return Ok(None) };
    let limit = Relief::MOST_SCALE;
    // What is no number is not within the limit either.
    if !(-limit..=limit).contains(&normal.scale) {
        let problem = format!("normalTexture scale {}; from -{limit} to {limit}", normal.scale);
        return Err(source.invalid(format!("material {i}"), problem));
    }
    let fail = |e: serde_json::Error| {
        source.invalid(format!("material {i}"), format!("normalTexture transform: {e}"))
    };
    let transform = normal.extensions.as_ref().and_then(|e| e.others.get("KHR_texture_transform"));
    let transform: Option<TextureTransform> =
        transform.cloned().map(serde_json::from_value).transpose().map_err(fail)?;
    let look = look(normal.tex_coord, transform.as_ref());
    Ok(Some((Relief { texture, scale: normal.scale }, look)))
}

/// Material `i` and how its textures are laid on.
pub(crate) fn material(
    source: &mut Source,
    root: &Root,
    i: usize,
    textures: &HashMap<usize, u32>,
) -> Result<(Material, Option<Look>), ImportError> {
    let m = &root.materials[i];
    let base = base_color(source, root, i)?;
    if base.factor.iter().any(|v| !v.is_finite()) {
        let problem = format!("base colour {:?}", base.factor);
        return Err(source.invalid(format!("material {i}"), problem));
    }
    let alpha_mode = match m.alpha_mode.as_ref() {
        Checked::Valid(JsonAlphaMode::Opaque) => AlphaMode::Opaque,
        Checked::Valid(JsonAlphaMode::Mask) => {
            AlphaMode::Mask { cutoff: m.alpha_cutoff.map_or(0.5, |c| c.0) }
        }
        Checked::Valid(JsonAlphaMode::Blend) => AlphaMode::Blend,
        Checked::Invalid => {
            return Err(source.invalid(format!("material {i}"), "unknown alpha mode"));
        }
    };
    let look = base.texture.as_ref().map(|t| t.look);
    let relief = match (relief(source, m, i, textures)?, look) {
        (Some((_, own)), Some(look)) if own != look => {
            source.warn(format!(
                "material {i}: its normal texture has other coordinates than its colour: left out"
            ));
            None
        }
        (relief, _) => relief,
    };
    let extensions = m.extensions.as_ref();
    let material = Material {
        name: m.name.clone().unwrap_or_default(),
        base_color: base.factor,
        texture: base.texture.as_ref().map(|t| textures[&t.index]),
        relief: relief.map(|r| r.0),
        alpha_mode,
        double_sided: m.double_sided,
        unlit: extensions.is_some_and(|e| {
            e.unlit.is_some() || e.others.get("KHR_materials_unlit").is_some_and(Value::is_object)
        }),
        translucency: translucency(source, m, i)?,
        scattered: false,
    };
    Ok((material, look.or(relief.map(|r| r.1))))
}
