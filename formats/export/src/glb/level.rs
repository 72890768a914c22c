//! A level of foliage as a mesh of a glb.

use crate::ExportError;
use crate::glb::buffer::Binary;
use crate::glb::materials::Materials;
use crate::pivots::PivotTable;
use forest_foliage::{DICTIONARY, FoliageBlock};
use forest_soup::{AlphaMode, Material, Texture, TriangleSoup};
use glam::DVec3;
use hashbrown::HashMap;
use serde_json::{Value, json};
use std::collections::HashSet;
use std::sync::Arc;

/// Foliage with its materials on the way into a glb.
pub(crate) struct Levels<'a> {
    pub(crate) block: &'a FoliageBlock<'a>,
    /// Those of the block: the source's, and last the dictionary.
    pub(crate) materials: Vec<Material>,
    pub(crate) textures: Vec<Arc<Texture>>,
    pub(crate) pivots: PivotTable,
    /// Where nodes stand, in the world.
    pub(crate) place: DVec3,
    /// Numbers in the glb of textures, and of the source's materials.
    known: [HashMap<u32, usize>; 2],
}

impl<'a> Levels<'a> {
    pub(crate) fn read(block: &'a FoliageBlock<'a>, place: DVec3) -> Result<Self, ExportError> {
        let (materials, textures) = block.materials()?;
        let pivots = PivotTable::new(block.branches);
        Ok(Self { block, materials, textures, pivots, place, known: Default::default() })
    }

    /// Adds level `level`; the mesh.
    pub(crate) fn mesh(
        &mut self,
        level: usize,
        name: &str,
        binary: &mut Binary,
        out: &mut Materials,
    ) -> Result<Value, ExportError> {
        let soup = self.block.soup(level, None, &self.materials, &self.textures);
        let header = &self.block.header.levels[level];
        let attributes = self.attributes(level, &soup, binary);
        let (mut primitives, mut first) = (Vec::new(), 0);
        for draw in header.draws.iter().filter(|d| d.triangles > 0) {
            let triangles = &soup.triangles[first..first + draw.triangles as usize];
            first += draw.triangles as usize;
            let material = if draw.material == DICTIONARY {
                self.dictionary(&soup, triangles, &format!("{name} cards"), binary, out)?
            } else {
                self.material(draw.material, binary, out)?
            };
            primitives.push(json!({
                "attributes": attributes,
                "indices": binary.indices(triangles),
                "material": material,
            }));
        }
        if primitives.is_empty() {
            return Err(ExportError::Unsuited(format!("{name}: the level shows nothing")));
        }
        Ok(json!({ "name": name, "primitives": primitives }))
    }

    /// What each vertex is told of.
    fn attributes(&self, level: usize, soup: &TriangleSoup, binary: &mut Binary) -> Value {
        let vertices = self.block.vertices[level];
        let from = soup.origin - self.place;
        let step = self.block.header.pivot_step;
        let place = |v: &forest_foliage::VertexRecord| DVec3::from(v.position.map(f64::from));
        let about = |p: DVec3| (from + p).as_vec3().to_array();
        let positions: Vec<_> = vertices.iter().map(|v| about(place(v))).collect();
        let normals: Vec<[f32; 3]> = soup.normals.iter().map(|n| n.to_array()).collect();
        let uvs: Vec<[f32; 2]> = soup.uvs.iter().map(|t| t.to_array()).collect();
        let pivots: Vec<[f32; 2]> =
            vertices.iter().map(|v| self.pivots.texel(v.hung.branch.into())).collect();
        let branch = |v: &forest_foliage::VertexRecord| [f32::from(v.hung.branch), v.hung.share()];
        let branches: Vec<[f32; 2]> = vertices.iter().map(branch).collect();
        let leaf: Vec<[f32; 3]> = vertices
            .iter()
            .map(|v| about(place(v) + DVec3::from(v.pivot.map(f64::from)) * step))
            .collect();
        let flutter: Vec<[f32; 2]> = vertices
            .iter()
            .map(|v| [f32::from(v.flutter) / 255.0, f32::from(v.phase) / 65536.0])
            .collect();
        let sky: Vec<[f32; 1]> = soup.skylit.iter().map(|s| [*s]).collect();
        let mut attributes = json!({
            "POSITION": binary.positions(&positions),
            "NORMAL": binary.floats(&normals),
            "TEXCOORD_0": binary.floats(&uvs),
            "TEXCOORD_1": binary.floats(&pivots),
            "_WIND_BRANCH": binary.floats(&branches),
            "_WIND_PIVOT": binary.floats(&leaf),
            "_WIND_FLUTTER": binary.floats(&flutter),
            "_SKY": binary.floats(&sky),
        });
        if soup.colors.iter().any(|c| *c != [1.0; 4]) {
            attributes["COLOR_0"] = binary.fractions(&soup.colors).into();
        }
        attributes
    }

    fn texture(
        &mut self,
        number: u32,
        opaque: bool,
        binary: &mut Binary,
        out: &mut Materials,
    ) -> Result<usize, ExportError> {
        // Alpha that means nothing is not shipped; a texture used both ways is there twice.
        let key = 2 * number + u32::from(opaque);
        if let Some(&known) = self.known[0].get(&key) {
            return Ok(known);
        }
        let new = out.texture(binary, &self.textures[number as usize], opaque)?;
        self.known[0].insert(key, new);
        Ok(new)
    }

    /// A material of the source.
    fn material(
        &mut self,
        number: u16,
        binary: &mut Binary,
        out: &mut Materials,
    ) -> Result<usize, ExportError> {
        if let Some(&known) = self.known[1].get(&u32::from(number)) {
            return Ok(known);
        }
        let material = self.materials[usize::from(number)].clone();
        let opaque = material.alpha_mode == AlphaMode::Opaque;
        let texture = material.texture.map(|t| self.texture(t, opaque, binary, out)).transpose()?;
        let new = out.material(&material, texture);
        if let Some(relief) = material.relief {
            let texture = self.texture(relief.texture, true, binary, out)?;
            out.relief(new, texture, relief.scale);
        }
        self.known[1].insert(number.into(), new);
        Ok(new)
    }

    /// The dictionary's material with the cutoff that keeps the coverage of these triangles.
    fn dictionary(
        &mut self,
        soup: &TriangleSoup,
        triangles: &[[u32; 3]],
        name: &str,
        binary: &mut Binary,
        out: &mut Materials,
    ) -> Result<usize, ExportError> {
        let number = self.textures.len() as u32 - 1;
        let cutoff = cutoff(soup, triangles, &self.textures[number as usize]);
        let texture = self.texture(number, false, binary, out)?;
        let material = Material {
            name: name.into(),
            alpha_mode: AlphaMode::Mask { cutoff },
            ..self.materials.last().cloned().unwrap_or_default()
        };
        Ok(out.material(&material, Some(texture)))
    }
}

/// The alpha from which as many texels are shown under `triangles` as their mean coverage is. They are
/// halves of upright rectangles in the texture, which lie beside each other: of a pack whose rectangles lie over
/// each other as often as the texture has texels is looked at, and no more.
fn cutoff(soup: &TriangleSoup, triangles: &[[u32; 3]], texture: &Texture) -> f32 {
    let size = [texture.width, texture.height];
    let mut counts = [0u64; 256];
    let mut known = HashSet::new();
    let mut left = u64::from(size[0]) * u64::from(size[1]);
    for t in triangles {
        let corners = t.map(|v| soup.uvs[v as usize].to_array());
        let [columns, rows] = [0, 1].map(|k| {
            let at = corners.map(|c| c[k] * size[k] as f32);
            let [low, high] = [at.into_iter().reduce(f32::min), at.into_iter().reduce(f32::max)];
            let texel = |v: Option<f32>| v.unwrap_or(0.0).round().clamp(0.0, size[k] as f32) as u32;
            [texel(low), texel(high)]
        });
        let area = u64::from(columns[1] - columns[0]) * u64::from(rows[1] - rows[0]);
        if !known.insert((columns, rows)) || area > left {
            continue;
        }
        left -= area;
        for y in rows[0]..rows[1] {
            for x in columns[0]..columns[1] {
                let [.., a] = texture.texels[(y * size[0] + x) as usize];
                counts[usize::from(a)] += 1;
            }
        }
    }
    alpha_of_coverage(&counts)
}

/// The alpha from which as many of these texels are shown as their mean alpha says, between two codes: shaders
/// compare with > as well as ≥.
fn alpha_of_coverage(counts: &[u64; 256]) -> f32 {
    let sum: u64 = counts.iter().zip(0u64..).map(|(n, a)| n * a).sum();
    let shown = |from: usize| counts[from..].iter().sum::<u64>() * 255;
    let off = |from: &usize| shown(*from).abs_diff(sum);
    let best = (1..256).min_by_key(off).unwrap_or(128);
    (best as f32 - 0.5) / 255.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cutoff_shows_as_much_as_the_mean_alpha() {
        let mut counts = [0; 256];
        // Mean alpha ½ (of 255): two of four texels are to be shown.
        for a in [255, 170, 85, 0] {
            counts[a] += 1;
        }
        let cutoff = alpha_of_coverage(&counts) * 255.0;
        assert!(cutoff > 85.0 && cutoff < 170.0, "{cutoff}");
        let mut opaque = [0; 256];
        opaque[255] = 9;
        assert!(alpha_of_coverage(&opaque) < 1.0);
    }
}
