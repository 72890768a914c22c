//! Wavefront OBJ + MTL.
//!
//! Kd is linear light (as Blender writes it), and a `map_Kd` replaces it, as in the programs that
//! write these files: exporters leave Kd at 0.8 beside a map. Coverage is `d` (or 1 − `Tr`) times
//! `map_d`; without `map_d`, the alpha of `map_Kd`. All faces are seen from both sides.

use crate::ImportError;
mod lines;

use crate::picture;
use crate::source::Source;
use earcut::{Earcut, utils3d};
use forest_soup::{AlphaMode, Instance, Material, Mesh, Model, Placement, Relief, Texture, Wrap};
use glam::{Vec2, Vec3};
use image::DynamicImage;
use std::cell::RefCell;
use std::collections::HashMap;
use std::io::{BufReader, Cursor};
use std::sync::Arc;

/// Reads an `.obj` and its material libraries.
pub(crate) fn load(source: &mut Source) -> Result<Model, ImportError> {
    let bytes = lines::faces_only(&source.bytes()?).map_err(|(line, index)| {
        source.invalid(format!("line {line}"), format!("a face with the index {index:?}"))
    })?;
    let options = tobj::LoadOptions { single_index: true, ..tobj::LoadOptions::default() };
    // The parser asks for material libraries while it reads: note what went wrong with them.
    let failed = RefCell::new(None);
    let shared = RefCell::new(&mut *source);
    let (models, materials) =
        tobj::load_obj_buf(&mut BufReader::new(Cursor::new(&bytes)), &options, |path| match shared
            .borrow_mut()
            .file("mtllib", &path.to_string_lossy())
        {
            Ok(mtl) => {
                let mtl = lines::whole_colors(&mtl);
                tobj::load_mtl_buf(&mut BufReader::new(Cursor::new(mtl)))
            }
            Err(e) => {
                failed.borrow_mut().get_or_insert(e);
                Err(tobj::LoadError::OpenFileFailed)
            }
        })
        .map_err(|e| ImportError::invalid(&shared.borrow().path, "obj", e))?;
    if let Some(error) = failed.into_inner() {
        return Err(error);
    }
    let materials = materials.map_err(|e| source.invalid("mtl", e))?;
    if materials.len() >= usize::from(u16::MAX) {
        let problem = format!("{}; the limit is {}", materials.len(), u16::MAX - 1);
        return Err(source.invalid("materials", problem));
    }
    let mut model = Model::default();
    let mut pictures = Pictures::default();
    let mut looks = Vec::new();
    for m in &materials {
        let (material, look) = pictures.material(source, m, &mut model.textures)?;
        model.materials.push(material);
        looks.push(look);
    }
    let default = model.materials.len();
    if models.iter().any(|m| m.mesh.material_id.is_none()) {
        model.materials.push(Material { double_sided: true, ..Material::default() });
        looks.push(MapOptions::default());
    }
    for m in models {
        let material = m.mesh.material_id.unwrap_or(default);
        let look = looks.get(material).ok_or_else(|| {
            source.invalid(&m.name, format!("material {material} of {}", looks.len()))
        })?;
        let mesh = mesh(source, &m, material as u16, look)?;
        if model.materials[material].texture.is_some() && mesh.uvs.is_empty() {
            source.warn(format!("{}: no texture coordinates for its material's texture", m.name));
        }
        model.meshes.push(mesh);
    }
    model.instances = (0..model.meshes.len() as u32)
        .map(|mesh| Instance { mesh, placement: Placement::IDENTITY })
        .collect();
    Ok(model)
}

fn mesh(
    source: &Source,
    model: &tobj::Model,
    material: u16,
    look: &MapOptions,
) -> Result<Mesh, ImportError> {
    let m = &model.mesh;
    let vectors = |v: &[f32]| v.chunks_exact(3).map(Vec3::from_slice).collect::<Vec<_>>();
    let positions = vectors(&m.positions);
    let normals = vectors(&m.normals);
    let colors: Vec<[f32; 4]> =
        m.vertex_color.chunks_exact(3).map(|c| [c[0], c[1], c[2], 1.0]).collect();
    let uvs: Vec<Vec2> = m.texcoords.chunks_exact(2).map(|t| look.apply(t[0], t[1])).collect();
    let per_vertex = |n: usize| n == 0 || n == positions.len();
    if !per_vertex(normals.len()) || !per_vertex(uvs.len()) || !per_vertex(colors.len()) {
        let problem = format!(
            "{} positions, {} normals, {} texture coordinates, {} colours: some faces have them and some do not",
            positions.len(),
            normals.len(),
            uvs.len(),
            colors.len()
        );
        return Err(source.invalid(&model.name, problem));
    }
    let mut triangles = Vec::with_capacity(m.indices.len() / 3);
    let mut polygons = Polygons::default();
    let mut start = 0;
    let arities = if m.face_arities.is_empty() {
        vec![3; m.indices.len() / 3]
    } else {
        m.face_arities.clone()
    };
    for arity in arities {
        let face = &m.indices[start..start + arity as usize];
        start += arity as usize;
        polygons.triangulate(&positions, face, &mut triangles);
    }
    Ok(Mesh { name: model.name.clone(), positions, normals, uvs, colors, triangles, material })
}

/// Cuts faces of any number of corners, concave ones too.
#[derive(Default)]
struct Polygons {
    earcut: Earcut<f32>,
    corners: Vec<[f32; 3]>,
    flat: Vec<[f32; 2]>,
    indices: Vec<u32>,
}

impl Polygons {
    fn triangulate(&mut self, positions: &[Vec3], face: &[u32], out: &mut Vec<[u32; 3]>) {
        if let &[a, b, c] = face {
            return out.push([a, b, c]);
        }
        self.corners.clear();
        self.corners.extend(face.iter().map(|&v| positions[v as usize].to_array()));
        self.indices.clear();
        if utils3d::project3d_to_2d(&self.corners, face.len(), &mut self.flat) {
            self.earcut.earcut(self.flat.iter().copied(), &[], &mut self.indices);
        }
        if self.indices.len() == 3 * (face.len() - 2) {
            out.extend(
                self.indices.chunks_exact(3).map(|t| [0, 1, 2].map(|k| face[t[k] as usize])),
            );
        } else {
            // A face without a plane, or one that crosses itself: a fan is as good as anything.
            out.extend(face[1..].windows(2).map(|w| [face[0], w[0], w[1]]));
        }
    }
}

/// Options of a texture map: `-s u v`, `-o u v`, `-clamp on`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct MapOptions {
    scale: [f32; 2],
    offset: [f32; 2],
    wrap: Wrap,
    /// What multiplies bumps.
    bumps: f32,
}

impl Default for MapOptions {
    fn default() -> Self {
        Self { scale: [1.0; 2], offset: [0.0; 2], wrap: Wrap::Repeat, bumps: 1.0 }
    }
}

impl MapOptions {
    /// OBJ counts v from the bottom.
    fn apply(&self, u: f32, v: f32) -> Vec2 {
        let at = |t: f32, k: usize| t * self.scale[k] + self.offset[k];
        Vec2::new(at(u, 0), 1.0 - at(v, 1))
    }

    /// Splits `-s 2 2 1 -clamp on leaf card.png` into options and file name.
    fn parse(text: &str) -> (Self, &str) {
        let mut options = Self::default();
        let mut rest = text.trim();
        while let Some(tail) = rest.strip_prefix('-') {
            let Some((name, mut tail)) = tail.split_once(char::is_whitespace) else { break };
            let most = match name {
                "s" | "o" | "t" => 3,
                "mm" => 2,
                "blendu" | "blendv" | "boost" | "bm" | "cc" | "clamp" | "imfchan" | "texres"
                | "type" => 1,
                _ => break,
            };
            let mut words = Vec::new();
            while words.len() < most {
                tail = tail.trim_start();
                let (word, after) = tail.split_once(char::is_whitespace).unwrap_or((tail, ""));
                // Vectors may be shorter than three numbers; the file name ends them.
                if after.is_empty() || (most > 1 && word.parse::<f32>().is_err()) {
                    break;
                }
                words.push(word);
                tail = after;
            }
            let number =
                |k: usize, or: f32| words.get(k).and_then(|w| w.parse().ok()).unwrap_or(or);
            match name {
                "s" => options.scale = [number(0, 1.0), number(1, 1.0)],
                "o" => options.offset = [number(0, 0.0), number(1, 0.0)],
                "bm" => {
                    options.bumps = Some(number(0, 1.0))
                        .filter(|s| s.abs() <= Relief::MOST_SCALE)
                        .unwrap_or(1.0)
                }
                "clamp" if words.first() == Some(&"on") => options.wrap = Wrap::Clamp,
                _ => {}
            }
            rest = tail.trim_start();
        }
        (options, rest)
    }
}

/// The file name in the value of a map.
pub(crate) fn picture_name(text: &str) -> &str {
    MapOptions::parse(text).1
}

/// Whether a picture holds normals, not heights: its mean looks out of the surface, and heights are grey.
fn holds_normals(texture: &Texture) -> bool {
    let count = texture.texels.len() as f64;
    let mean = |k: usize| texture.texels.iter().map(|t| f64::from(t[k])).sum::<f64>() / count;
    let near = |k: usize| (mean(k) - 127.5).abs() < 32.0;
    near(0) && near(1) && mean(2) > 191.0
}

/// Images by name, so that leaves sharing one decode it once.
#[derive(Default)]
struct Pictures {
    images: HashMap<String, DynamicImage>,
    textures: HashMap<(Option<String>, Option<String>, bool), u32>,
    /// Of bump maps, by name and whether they are clamped, whether they hold normals.
    verdicts: HashMap<(String, bool), bool>,
}

impl Pictures {
    fn material(
        &mut self,
        source: &mut Source,
        m: &tobj::Material,
        textures: &mut Vec<Arc<Texture>>,
    ) -> Result<(Material, MapOptions), ImportError> {
        let element = format!("material {}", m.name);
        let color = m.diffuse_texture.as_deref().map(MapOptions::parse);
        let alpha = m.dissolve_texture.as_deref().map(MapOptions::parse);
        let transparency = m.unknown_param.get("Tr").map(|t| {
            t.trim().parse::<f32>().map_err(|_| source.invalid(&element, format!("Tr {t:?}")))
        });
        let dissolve = match (m.dissolve, transparency.transpose()?) {
            (Some(d), _) => d,
            (None, Some(tr)) => 1.0 - tr,
            (None, None) => 1.0,
        };
        let diffuse = if color.is_some() { [1.0; 3] } else { m.diffuse.unwrap_or([0.8; 3]) };
        let options = color.or(alpha).map(|c| c.0);
        let (relief, options) = self.relief(source, &element, m, textures, options);
        let mut translucent = dissolve < 1.0;
        let texture = if color.is_some() || alpha.is_some() {
            let names = (color.map(|c| c.1.to_string()), alpha.map(|a| a.1.to_string()));
            let key = (names.0.clone(), names.1.clone(), options.wrap == Wrap::Clamp);
            let index = match self.textures.get(&key) {
                Some(&index) => index,
                None => {
                    let texture = self.texture(source, &element, names, options.wrap)?;
                    textures.push(Arc::new(texture));
                    let index = textures.len() as u32 - 1;
                    self.textures.insert(key, index);
                    index
                }
            };
            translucent |= textures[index as usize].texels.iter().any(|t| t[3] < 255);
            Some(index)
        } else {
            None
        };
        let [r, g, b] = diffuse;
        let material = Material {
            name: m.name.clone(),
            base_color: [r, g, b, dissolve.clamp(0.0, 1.0)],
            texture,
            relief,
            alpha_mode: if translucent { AlphaMode::Blend } else { AlphaMode::Opaque },
            double_sided: true,
            unlit: m.illumination_model == Some(0),
            translucency: Material::default().translucency,
            scattered: false,
        };
        Ok((material, options))
    }

    /// The normals of `norm`, or of `map_Bump`, where many programs write them; heights are left out, and so is
    /// what cannot be read.
    fn relief(
        &mut self,
        source: &mut Source,
        element: &str,
        m: &tobj::Material,
        textures: &mut Vec<Arc<Texture>>,
        others: Option<MapOptions>,
    ) -> (Option<Relief>, MapOptions) {
        let normals = m.unknown_param.get("norm").map(|n| (n, true));
        let named = normals.or(m.normal_texture.as_ref().map(|n| (n, false)));
        let plain = others.unwrap_or_default();
        let Some((text, sure)) = named else { return (None, plain) };
        let (options, name) = MapOptions::parse(text);
        if others.is_some_and(|o| (o.scale, o.offset) != (options.scale, options.offset)) {
            source.warn(format!("{element}: its bumps are laid on in another way: left out"));
            return (None, plain);
        }
        let key = (Some(name.to_string()), None, options.wrap == Wrap::Clamp);
        let judged = (name.to_string(), key.2);
        if !sure && self.verdicts.get(&judged) == Some(&false) {
            return (None, plain);
        }
        let texture = match self.textures.get(&key) {
            Some(&known) => {
                let texture = &textures[known as usize];
                let verdict = self.verdicts.entry(judged);
                if !sure && !*verdict.or_insert_with(|| holds_normals(texture)) {
                    return (None, plain);
                }
                known
            }
            None => match self.texture(source, element, (key.0.clone(), None), options.wrap) {
                Ok(texture) if sure || self.holds_normals(judged, &texture) => {
                    textures.push(Arc::new(texture));
                    let index = textures.len() as u32 - 1;
                    self.textures.insert(key, index);
                    index
                }
                Ok(_) => return (None, plain),
                Err(e) => {
                    source.warn(format!("{element}: its bumps are left out: {e}"));
                    return (None, plain);
                }
            },
        };
        (Some(Relief { texture, scale: options.bumps }), others.unwrap_or(options))
    }

    /// Looks at a picture, and remembers.
    fn holds_normals(&mut self, judged: (String, bool), texture: &Texture) -> bool {
        *self.verdicts.entry(judged).or_insert_with(|| holds_normals(texture))
    }

    /// Colour of one image, alpha of the other.
    fn texture(
        &mut self,
        source: &mut Source,
        element: &str,
        (color, alpha): (Option<String>, Option<String>),
        wrap: Wrap,
    ) -> Result<Texture, ImportError> {
        for name in [&color, &alpha].into_iter().flatten() {
            if !self.images.contains_key(name) {
                let element = format!("{element} ({name})");
                let bytes = source.file(&element, name)?;
                self.images.insert(name.clone(), picture::decode(source, &element, &bytes)?);
            }
        }
        let image = |name: &Option<String>| name.as_ref().map(|n| &self.images[n]);
        let name = color.clone().or(alpha.clone()).unwrap_or_default();
        let Some(mask) = image(&alpha) else {
            let color = image(&color).ok_or_else(|| source.invalid(element, "no image"))?;
            return Ok(picture::texture(name, color, [wrap; 2]));
        };
        let mut texture = match image(&color) {
            Some(color) => picture::texture(name, color, [wrap; 2]),
            None => {
                let white = picture::texture(name, mask, [wrap; 2]);
                let texels = vec![[255; 4]; white.texels.len()];
                Texture { texels, ..white }
            }
        };
        let (w, h) = (texture.width, texture.height);
        let mask = if (mask.width(), mask.height()) == (w, h) {
            mask.clone()
        } else {
            mask.resize_exact(w, h, image::imageops::FilterType::Triangle)
        };
        // A mask with an alpha channel that says something means it; else its brightness does.
        let rgba = mask.to_rgba8();
        let has_alpha = rgba.pixels().any(|p| p.0[3] < 255);
        let gray = mask.to_luma8();
        for ((texel, p), g) in texture.texels.iter_mut().zip(rgba.pixels()).zip(gray.pixels()) {
            texel[3] = if has_alpha { p.0[3] } else { g.0[0] };
        }
        Ok(texture)
    }
}

#[cfg(test)]
mod tests;
