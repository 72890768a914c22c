//! Small structured sections: serde + bincode 2, fixed-width little-endian integers, a size limit.
//!
//! bincode is final upstream; this module is the only place that knows it.

use crate::{Codec, Pack, PackError, PackWriter, SectionId};
use serde::{Deserialize, Serialize, de::DeserializeOwned};

/// No header section is larger: 16 MiB.
pub const LIMIT: usize = 16 << 20;

const CONFIG: bincode::config::Configuration<
    bincode::config::LittleEndian,
    bincode::config::Fixint,
    bincode::config::Limit<LIMIT>,
> = bincode::config::standard().with_fixed_int_encoding().with_limit::<LIMIT>();

/// Adds `value` as header section `id`.
///
/// # Errors
/// When the pack cannot be written, or `value` takes more than [`LIMIT`] bytes (names of a hundred
/// thousand trees, say): a reader would refuse it.
pub fn write<T: Serialize>(
    writer: &mut PackWriter,
    id: SectionId,
    value: &T,
) -> Result<(), PackError> {
    let invalid = |problem: String| PackError::invalid(writer.path(), id, problem);
    let bytes = bincode::serde::encode_to_vec(value, CONFIG).map_err(|e| invalid(e.to_string()))?;
    if bytes.len() > LIMIT {
        return Err(invalid(format!("{} bytes of header; the limit is {LIMIT}", bytes.len())));
    }
    writer.add(id, Codec::None, &bytes)
}

/// Decodes section `id` of `pack`; every byte of it must be used.
///
/// # Errors
/// A missing or damaged section, or one that does not decode to `T`.
pub fn decode<T: DeserializeOwned>(pack: &Pack, id: SectionId) -> Result<T, PackError> {
    let bytes = pack.bytes(id, LIMIT as u64)?;
    let (value, used) = bincode::serde::decode_from_slice(&bytes, CONFIG)
        .map_err(|e| PackError::invalid(pack.path(), id, e))?;
    if used != bytes.len() {
        let problem = format!("{} bytes, of which the header uses {used}", bytes.len());
        return Err(PackError::invalid(pack.path(), id, problem));
    }
    Ok(value)
}

/// Section [`crate::kind::META`]: where the pack comes from.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Meta {
    /// Program and version that wrote the pack.
    pub generator: String,
    /// BLAKE3 over the source files, their placements and everything else that was read.
    pub source_hash: [u8; 32],
    /// The sources, in the order given.
    pub sources: Vec<Source>,
    /// The preset and options of `forest-bake all`; empty where representations were baked one by one.
    pub options: Vec<String>,
}

/// One source file of a pack.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Source {
    /// File name without its folder.
    pub name: String,
    /// BLAKE3 of the file and of the files it refers to.
    pub hash: [u8; 32],
    /// The placement, as it was given; empty for none.
    pub placement: String,
}

/// Section [`crate::kind::MATERIALS`].
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
pub struct Materials {
    /// Materials, in the order that triangle records refer to.
    pub materials: Vec<MaterialHeader>,
    /// Textures; the texels of number i are in section `TEXTURE[i]`.
    pub textures: Vec<TextureHeader>,
}

/// One material (glTF 2.0 terms).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MaterialHeader {
    /// Name in the source.
    pub name: String,
    /// Linear RGB and alpha.
    pub base_color: [f32; 4],
    /// Number of the texture.
    pub texture: Option<u32>,
    /// Number of the normal texture, and what multiplies its x and y.
    pub relief: Option<(u32, f32)>,
    /// 0 opaque, 1 mask, 2 blend.
    pub alpha_mode: u8,
    /// Cutoff of the mask mode; 0 in the others.
    pub alpha_cutoff: f32,
    /// Both faces are seen.
    pub double_sided: bool,
    /// The colour is shown without lighting.
    pub unlit: bool,
    /// Share of a light's translucency that the surface has, 0 … 1.
    pub translucency: f32,
}

/// One texture's size and wrap modes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TextureHeader {
    /// Name in the source.
    pub name: String,
    /// Texels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Along u and v: 0 repeat, 1 mirror, 2 clamp.
    pub wrap: [u8; 2],
}
