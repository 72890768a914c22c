//! Materials and textures as the pack holds them.

use forest_pack::header::{self, MaterialHeader, Materials, TextureHeader};
use forest_pack::{Compressed, Pack, PackError, PackWriter, SectionId, kind};
use forest_soup::{AlphaMode, Material, Relief, Texture, Wrap};
use rayon::prelude::*;
use std::sync::Arc;

const ID: SectionId = SectionId::new(kind::MATERIALS, 0);

/// Largest texture that is read back: 16384² RGBA.
const MAX_TEXTURE_BYTES: u64 = 1 << 30;

/// Most that all textures of a pack may decode to.
const MAX_BYTES: u64 = 8 << 30;

/// Writes sections `materials` and `texture[n]`.
///
/// # Errors
/// When the pack cannot be written.
pub fn write_materials(
    writer: &mut PackWriter,
    materials: &[Material],
    textures: &[Arc<Texture>],
) -> Result<(), PackError> {
    let table = Materials {
        materials: materials.iter().map(material_header).collect(),
        textures: textures.iter().map(|t| texture_header(t)).collect(),
    };
    header::write(writer, ID, &table)?;
    let packed: Vec<_> = textures
        .par_iter()
        .map(|t| Compressed::new(bytemuck::cast_slice(&t.texels)))
        .collect::<Result<_, _>>()?;
    for (i, texels) in (0..).zip(&packed) {
        writer.add_compressed(SectionId::new(kind::TEXTURE, i), texels)?;
    }
    Ok(())
}

/// Reads them back.
///
/// # Errors
/// When a section is missing or damaged, or a material or texture breaks a rule.
pub fn read_materials(pack: &Pack) -> Result<(Vec<Material>, Vec<Arc<Texture>>), PackError> {
    let table: Materials = header::decode(pack, ID)?;
    let invalid = |problem: String| PackError::invalid(pack.path(), ID, problem);
    let count = table.textures.len();
    let mut materials = Vec::new();
    for (i, m) in table.materials.into_iter().enumerate() {
        if m.texture.is_some_and(|t| t as usize >= count) {
            return Err(invalid(format!("material {i} uses texture {:?} of {count}", m.texture)));
        }
        let relief = m.relief.map(|(texture, scale)| Relief { texture, scale });
        if let Some(r) = relief.filter(|r| !r.is_valid(count)) {
            let (t, scale) = (r.texture, r.scale);
            let problem = format!("material {i} uses normal texture {t} of {count}, times {scale}");
            return Err(invalid(problem));
        }
        if !(0.0..=1.0).contains(&m.translucency) {
            let share = m.translucency;
            return Err(invalid(format!(
                "material {i} has a translucency of {share}; from 0 to 1"
            )));
        }
        let alpha_mode = match m.alpha_mode {
            0 => AlphaMode::Opaque,
            1 => AlphaMode::Mask { cutoff: m.alpha_cutoff },
            2 => AlphaMode::Blend,
            other => {
                return Err(invalid(format!("material {i} has alpha mode {other}; 0–2 exist")));
            }
        };
        materials.push(Material {
            name: m.name,
            base_color: m.base_color,
            texture: m.texture,
            relief,
            alpha_mode,
            double_sided: m.double_sided,
            unlit: m.unlit,
            translucency: m.translucency,
            scattered: false,
        });
    }
    let texels = |t: &TextureHeader| u64::from(t.width) * u64::from(t.height);
    let bytes =
        table.textures.iter().map(|t| texels(t).saturating_mul(4)).fold(0, u64::saturating_add);
    if bytes > MAX_BYTES {
        return Err(invalid(format!("{bytes} bytes of textures; the limit is {MAX_BYTES}")));
    }
    let mut textures = Vec::new();
    for (i, t) in (0..).zip(table.textures) {
        textures.push(Arc::new(read_texture(pack, SectionId::new(kind::TEXTURE, i), t)?));
    }
    Ok((materials, textures))
}

fn read_texture(pack: &Pack, id: SectionId, t: TextureHeader) -> Result<Texture, PackError> {
    let bytes = pack.bytes(id, MAX_TEXTURE_BYTES)?;
    let want = (u64::from(t.width) * u64::from(t.height)).saturating_mul(4);
    if t.width == 0 || t.height == 0 || bytes.len() as u64 != want {
        let problem = format!("{} bytes for {}×{} texels", bytes.len(), t.width, t.height);
        return Err(PackError::invalid(pack.path(), id, problem));
    }
    let mut wrap = [Wrap::Repeat; 2];
    for (wrap, code) in wrap.iter_mut().zip(t.wrap) {
        *wrap = match code {
            0 => Wrap::Repeat,
            1 => Wrap::Mirror,
            2 => Wrap::Clamp,
            other => {
                let problem = format!("has wrap mode {other}; 0–2 exist");
                return Err(PackError::invalid(pack.path(), id, problem));
            }
        };
    }
    let texels = bytemuck::cast_slice(&bytes).to_vec();
    Ok(Texture { name: t.name, width: t.width, height: t.height, texels, wrap })
}

fn material_header(m: &Material) -> MaterialHeader {
    let (alpha_mode, alpha_cutoff) = match m.alpha_mode {
        AlphaMode::Opaque => (0, 0.0),
        AlphaMode::Mask { cutoff } => (1, cutoff),
        AlphaMode::Blend => (2, 0.0),
    };
    MaterialHeader {
        name: m.name.clone(),
        base_color: m.base_color,
        texture: m.texture,
        relief: m.relief.map(|r| (r.texture, r.scale)),
        alpha_mode,
        alpha_cutoff,
        double_sided: m.double_sided,
        unlit: m.unlit,
        translucency: m.translucency,
    }
}

fn texture_header(t: &Texture) -> TextureHeader {
    let wrap = t.wrap.map(|w| match w {
        Wrap::Repeat => 0,
        Wrap::Mirror => 1,
        Wrap::Clamp => 2,
    });
    TextureHeader { name: t.name.clone(), width: t.width, height: t.height, wrap }
}
