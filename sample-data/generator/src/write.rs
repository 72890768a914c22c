//! Writers: glb, gltf with files beside it, obj with mtl. Each covers another way in.

use anyhow::{Context, Result};
use forest_soup::{AlphaMode, Mesh, Model, Texture};
use glam::Vec3;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::io::Cursor;
use std::path::Path;

/// glTF component types and buffer targets.
const FLOAT: u32 = 5126;
const U32: u32 = 5125;
const U16: u32 = 5123;

/// Writes one self-contained `.glb`, textures as PNG inside.
///
/// # Errors
/// When the file cannot be written.
pub fn write_glb(model: &Model, path: &Path) -> Result<()> {
    let mut doc = Document::new(model);
    let images: Result<Vec<Value>> = model
        .textures
        .iter()
        .map(|t| {
            let view = doc.push_bytes(&png(t)?);
            Ok(json!({ "bufferView": view, "mimeType": "image/png", "name": t.name }))
        })
        .collect();
    let json = doc.json(images?, None).to_string();
    let mut text = json.into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    doc.bytes.resize(doc.bytes.len().next_multiple_of(4), 0);
    let total = 12 + 8 + text.len() + 8 + doc.bytes.len();
    let mut out = Vec::with_capacity(total);
    let word = |out: &mut Vec<u8>, v: usize| out.extend((v as u32).to_le_bytes());
    out.extend(b"glTF");
    word(&mut out, 2);
    word(&mut out, total);
    word(&mut out, text.len());
    out.extend(b"JSON");
    out.extend(text);
    word(&mut out, doc.bytes.len());
    out.extend(b"BIN\0");
    out.extend(&doc.bytes);
    std::fs::write(path, out).with_context(|| path.display().to_string())
}

/// Writes `.gltf`, `.bin` and PNG files beside each other.
///
/// # Errors
/// When a file cannot be written.
pub fn write_gltf(model: &Model, path: &Path) -> Result<()> {
    let doc = Document::new(model);
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let mut images = Vec::new();
    for t in &model.textures {
        let name = format!("{stem}_{}.png", t.name);
        std::fs::write(path.with_file_name(&name), png(t)?).with_context(|| name.clone())?;
        images.push(json!({ "uri": name }));
    }
    let bin = format!("{stem}.bin");
    std::fs::write(path.with_file_name(&bin), &doc.bytes).with_context(|| bin.clone())?;
    let text = serde_json::to_string_pretty(&doc.json(images, Some(&bin)))?;
    std::fs::write(path, text).with_context(|| path.display().to_string())
}

/// Writes `.obj`, `.mtl` and PNG files beside each other: quads, negative indices for the leaves.
///
/// # Errors
/// When a file cannot be written.
pub fn write_obj(model: &Model, path: &Path) -> Result<()> {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let mut mtl = String::new();
    for m in &model.materials {
        writeln!(mtl, "newmtl {}\nKd 1 1 1", m.name)?;
        if let Some(t) = m.texture {
            let t = &model.textures[t as usize];
            let name = format!("{stem}_{}.png", t.name);
            std::fs::write(path.with_file_name(&name), png(t)?).with_context(|| name.clone())?;
            writeln!(mtl, "map_Kd {name}")?;
            if m.alpha_mode != AlphaMode::Opaque {
                writeln!(mtl, "map_d {name}")?;
            }
        }
    }
    std::fs::write(path.with_extension("mtl"), mtl)?;
    let mut obj = format!("mtllib {stem}.mtl\n");
    for mesh in &model.meshes {
        write_obj_mesh(&mut obj, mesh, &model.materials[mesh.material as usize].name)?;
    }
    std::fs::write(path, obj).with_context(|| path.display().to_string())
}

fn write_obj_mesh(obj: &mut String, mesh: &Mesh, material: &str) -> Result<()> {
    writeln!(obj, "o {}", mesh.name)?;
    for (p, uv) in mesh.positions.iter().zip(&mesh.uvs) {
        writeln!(obj, "v {:.4} {:.4} {:.4}\nvt {:.4} {:.4}", p.x, p.y, p.z, uv.x, 1.0 - uv.y)?;
    }
    writeln!(obj, "usemtl {material}")?;
    let n = mesh.positions.len() as i64;
    for pair in mesh.triangles.chunks(2) {
        // Both triangles of a quad share the diagonal a–c.
        let corners: Vec<i64> = match *pair {
            [[a, b, c], [_, _, d]] => vec![a, b, c, d],
            _ => pair[0].to_vec(),
        }
        .into_iter()
        .map(i64::from)
        .collect();
        obj.push('f');
        for c in corners {
            write!(obj, " {0}/{0}", c - n)?;
        }
        obj.push('\n');
    }
    Ok(())
}

fn png(t: &Texture) -> Result<Vec<u8>> {
    let mut out = Cursor::new(Vec::new());
    let opaque = t.texels.iter().all(|t| t[3] == 255);
    let (w, h) = (t.width, t.height);
    if opaque {
        let rgb: Vec<u8> = t.texels.iter().flat_map(|t| [t[0], t[1], t[2]]).collect();
        let image = image::RgbImage::from_raw(w, h, rgb).context("texture size")?;
        image.write_to(&mut out, image::ImageFormat::Png)?;
    } else {
        let image = image::RgbaImage::from_raw(w, h, t.texels.as_flattened().to_vec());
        image.context("texture size")?.write_to(&mut out, image::ImageFormat::Png)?;
    }
    Ok(out.into_inner())
}

/// A glTF document under construction: one buffer, a view and an accessor for each array.
struct Document<'a> {
    model: &'a Model,
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    meshes: Vec<Value>,
}

impl<'a> Document<'a> {
    fn new(model: &'a Model) -> Self {
        let mut doc =
            Self { model, bytes: vec![], views: vec![], accessors: vec![], meshes: vec![] };
        for mesh in &model.meshes {
            doc.push_mesh(mesh);
        }
        doc
    }

    fn push_mesh(&mut self, mesh: &Mesh) {
        let n = mesh.positions.len();
        let min = mesh.positions.iter().copied().reduce(Vec3::min).unwrap_or_default();
        let max = mesh.positions.iter().copied().reduce(Vec3::max).unwrap_or_default();
        let bounds = json!({ "min": min.to_array(), "max": max.to_array() });
        let position = self.push(bytemuck::cast_slice(&mesh.positions), n, "VEC3", FLOAT, bounds);
        let normal = self.push(bytemuck::cast_slice(&mesh.normals), n, "VEC3", FLOAT, json!({}));
        let uv = self.push(bytemuck::cast_slice(&mesh.uvs), n, "VEC2", FLOAT, json!({}));
        let flat = mesh.triangles.as_flattened();
        let indices = if n <= usize::from(u16::MAX) {
            let short: Vec<u16> = flat.iter().map(|&i| i as u16).collect();
            self.push(bytemuck::cast_slice(&short), flat.len(), "SCALAR", U16, json!({}))
        } else {
            self.push(bytemuck::cast_slice(flat), flat.len(), "SCALAR", U32, json!({}))
        };
        self.meshes.push(json!({
            "name": mesh.name,
            "primitives": [{
                "attributes": { "POSITION": position, "NORMAL": normal, "TEXCOORD_0": uv },
                "indices": indices,
                "material": mesh.material,
            }],
        }));
    }

    fn push(&mut self, bytes: &[u8], n: usize, kind: &str, component: u32, extra: Value) -> usize {
        let view = self.push_bytes(bytes);
        let mut accessor =
            json!({ "bufferView": view, "componentType": component, "count": n, "type": kind });
        if let (Value::Object(a), Value::Object(e)) = (&mut accessor, extra) {
            a.extend(e);
        }
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    fn push_bytes(&mut self, bytes: &[u8]) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let view =
            json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len() });
        self.bytes.extend(bytes);
        self.views.push(view);
        self.views.len() - 1
    }

    fn json(&self, images: Vec<Value>, uri: Option<&str>) -> Value {
        let materials: Vec<Value> = self
            .model
            .materials
            .iter()
            .map(|m| {
                let mut v = json!({
                    "name": m.name,
                    "doubleSided": m.double_sided,
                    "pbrMetallicRoughness": {
                        "metallicFactor": 0.0,
                        "baseColorTexture": { "index": m.texture.unwrap_or(0) },
                    },
                });
                if let AlphaMode::Mask { cutoff } = m.alpha_mode {
                    v["alphaMode"] = json!("MASK");
                    v["alphaCutoff"] = json!(cutoff);
                }
                v
            })
            .collect();
        let textures: Vec<Value> =
            (0..images.len()).map(|i| json!({ "source": i, "sampler": 0 })).collect();
        let nodes: Vec<Value> = (0..self.meshes.len()).map(|i| json!({ "mesh": i })).collect();
        let mut buffer = json!({ "byteLength": self.bytes.len() });
        if let Some(uri) = uri {
            buffer["uri"] = json!(uri);
        }
        json!({
            "asset": { "version": "2.0", "generator": "forest-sample-data" },
            "scene": 0,
            "scenes": [{ "nodes": (0..nodes.len()).collect::<Vec<_>>() }],
            "nodes": nodes,
            "meshes": self.meshes,
            "materials": materials,
            "samplers": [{ "wrapS": 10497, "wrapT": 10497 }],
            "textures": textures,
            "images": images,
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [buffer],
        })
    }
}
