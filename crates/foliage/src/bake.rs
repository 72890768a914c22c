//! A tree into the sections of the foliage representation.

use crate::block::{dictionary_material, dictionary_texture, level_soup};
use crate::cover::cover;
use crate::crown::CrownLight;
use crate::dictionary::{Layout, MOST_SIDE, atlas, encode};
use crate::error::FoliageError;
use crate::fit::Brightness;
use crate::hang::Gale;
use crate::header::{DICTIONARY, Draw, FoliageHeader, LevelHeader, VertexRecord};
use crate::leaf::{Leaf, leaves};
use crate::level::{CARD, Level, Placed, Tree};
use crate::options::FoliageOptions;
use crate::parts::{MaterialParts, Part, Parts};
use crate::thick::WoodErrors;
use crate::validate::validate;
use crate::visible::Visible;
use crate::weld::Welded;
use crate::wind::Hung;
use crate::wood::Wood;
use forest_pack::{Codec, PackWriter, SectionId, header, kind};
use forest_points::record::encode_axis;
use forest_points::write_materials;
use forest_raster::Surfaces;
use forest_soup::{Bounds, TriangleSoup, linear_to_srgb8};
use glam::DVec3;
use rayon::prelude::*;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// What a bake did.
#[derive(Clone, Debug)]
pub struct BakeReport {
    /// The header that was written.
    pub header: FoliageHeader,
    /// What was taken for wood and for leaves.
    pub materials: Vec<MaterialParts>,
    /// Separate pieces of wood that were tied to each other.
    pub pieces: usize,
    /// Of each level, the errors of tubes and of the simplified source.
    pub wood: Vec<[WoodErrors; 2]>,
    /// Leaves that hang on branches.
    pub leaves: usize,
    /// Share of the dictionary that its pictures fill.
    pub filled: f64,
    /// What points, views and volumes of the pack show of the light.
    pub light: CrownLight,
    /// Skeleton, visibility, levels, light, dictionary.
    pub times: [Duration; 5],
}

/// A level's arrays as they are written.
struct Arrays {
    header: LevelHeader,
    vertices: Vec<VertexRecord>,
    indices: Vec<[u32; 3]>,
}

/// Bakes `soup` and adds the sections of the foliage representation to `writer`. `progress` is told
/// how many of the levels are done.
///
/// # Errors
/// When an option makes no sense, no leaves are found, or the pack cannot be written.
pub fn bake(
    soup: &TriangleSoup,
    options: &FoliageOptions,
    writer: &mut PackWriter,
    progress: &(dyn Fn(u64) + Sync),
) -> Result<BakeReport, FoliageError> {
    options.validate().map_err(FoliageError::Options)?;
    soup.validate()?;
    let start = Instant::now();
    let parts = Parts::of(soup, &options.parts)?;
    let bounds = soup.bounds();
    let size = bounds.size().max_element();
    if size <= 0.0 {
        return Err(FoliageError::NothingToSee);
    }
    let finest = options.finest(bounds.size().y, size);
    let [wood, leaf] = [Part::Wood, Part::Leaf].map(|p| parts.triangles(p));
    let source = [wood.len() as u64, leaf.len() as u64];
    let wood = Wood::new(Welded::new(soup, wood, size), &bounds);
    let (branches, limit) = (wood.rig.records.len(), usize::from(u16::MAX));
    if branches > limit {
        return Err(FoliageError::TooManyBranches { branches, limit });
    }
    let mut leaves = leaves(&Welded::new(soup, leaf, size), CARD * finest);
    hang(soup, &wood, &mut leaves);
    // Pictures hold the leaves' area: before they are drawn, not after.
    let texels = (leaves.iter().map(|l| l.area).sum::<f64>() / (finest * finest)) as u64;
    let limit = u64::from(MOST_SIDE) * u64::from(MOST_SIDE);
    if texels > limit {
        return Err(FoliageError::AtlasFull { texels, limit });
    }
    let skeleton = start.elapsed();
    let start = Instant::now();
    let visible = Visible::of(soup);
    let looking = start.elapsed();
    let start = Instant::now();
    let surfaces = Surfaces::new(&soup.materials, &soup.textures);
    let gale = Gale::new(&wood.rig.records);
    let (surfaces, leaves) = (&surfaces, &leaves[..]);
    let tree = Tree { soup, surfaces, wood: &wood, leaves, visible: &visible, gale: &gale };
    let levels: Vec<Level> = (0..options.levels)
        .map(|l| {
            let level = tree.level(finest * f64::from(l).exp2());
            progress(u64::from(l) + 1);
            level
        })
        .collect();
    let making = start.elapsed();
    let start = Instant::now();
    let panels: Vec<_> = levels.iter().flat_map(|l| &l.panels).map(|p| p.panel.clone()).collect();
    let layout = Layout::new(&panels)?;
    let crown = crown(soup, leaves);
    let mut places = layout.places.iter().copied();
    let pivot_step = 2.0 * size / f64::from(i16::MAX);
    let mut arrays: Vec<Arrays> = levels
        .iter()
        .map(|level| {
            let at: Vec<[u32; 2]> = places.by_ref().take(level.panels.len()).collect();
            Packing { wood: &wood, crown, atlas: layout.size, pivot_step }.level(level, &at)
        })
        .collect();
    let pictures = atlas(&panels, &layout);
    let lighting = start.elapsed();
    let start = Instant::now();
    let translucency = translucency(soup, leaves);
    let dictionary = (layout.size, &pictures[0][..], translucency);
    let crown_light = brighten(soup, surfaces, &mut arrays, dictionary, pivot_step);
    let lighting = (lighting, start.elapsed());
    let start = Instant::now();
    let mut branches = [0; 4];
    wood.branches.branches.iter().for_each(|b| branches[b.order.min(3) as usize] += 1);
    let header = FoliageHeader {
        origin: soup.origin.to_array(),
        bounds: [bounds.min, bounds.max].map(|p| p.to_array()),
        pivot_step,
        atlas: layout.size,
        blocks: options.blocks,
        source,
        branches,
        wind: wood.rig.records.len() as u32,
        translucency,
        levels: arrays.iter().map(|a| a.header.clone()).collect(),
    };
    // What the reader would refuse is not written.
    let vertices: Vec<&[VertexRecord]> = arrays.iter().map(|a| &a.vertices[..]).collect();
    let indices: Vec<&[[u32; 3]]> = arrays.iter().map(|a| &a.indices[..]).collect();
    validate(&header, &wood.rig.records, &vertices, &indices)
        .map_err(|(_, _, problem)| FoliageError::Options(problem))?;
    for (l, arrays) in (0..).zip(&arrays) {
        let id = |kind| SectionId::new(kind, l);
        let rows: &[u8] = bytemuck::cast_slice(&arrays.vertices);
        writer.add(id(kind::FOLIAGE_VERTICES), Codec::None, rows)?;
        let rows: &[u8] = bytemuck::cast_slice(&arrays.indices);
        writer.add(id(kind::FOLIAGE_INDICES), Codec::None, rows)?;
    }
    for (mip, texels) in (0..).zip(&pictures) {
        let bytes = match options.blocks {
            true => encode(texels, layout.size[0] >> mip),
            false => texels.as_flattened().to_vec(),
        };
        writer.add(SectionId::new(kind::FOLIAGE_ATLAS, mip), Codec::None, &bytes)?;
    }
    let rows: &[u8] = bytemuck::cast_slice(&wood.rig.records);
    writer.add(SectionId::new(kind::WIND_BRANCHES, 0), Codec::None, rows)?;
    write_materials(writer, &soup.materials, &soup.textures)?;
    header::write(writer, SectionId::new(kind::FOLIAGE_HEADER, 0), &header)?;
    crown_light.write(writer)?;
    let texels: u64 = panels.iter().map(|p| u64::from(p.size[0]) * u64::from(p.size[1])).sum();
    let all = u64::from(layout.size[0]) * u64::from(layout.size[1]);
    Ok(BakeReport {
        header,
        materials: parts.materials,
        pieces: wood.pieces,
        wood: levels.iter().map(|l| l.errors).collect(),
        leaves: leaves.len(),
        filled: texels as f64 / all as f64,
        light: crown_light,
        times: [skeleton, looking, making, lighting.1, lighting.0 + start.elapsed()],
    })
}

/// Share of a light's translucency that leaves have in the mean over their area.
fn translucency(soup: &TriangleSoup, leaves: &[Leaf]) -> f32 {
    let of = |leaf: &Leaf| {
        let material = soup.triangle_materials[leaf.triangles[0] as usize];
        f64::from(soup.materials[usize::from(material)].translucency) * leaf.area
    };
    let area: f64 = leaves.iter().map(|l| l.area).sum();
    if area > 0.0 { (leaves.iter().map(of).sum::<f64>() / area).min(1.0) as f32 } else { 1.0 }
}

/// Sizes cards and weighs the light on them, so that each level covers what the source covers and is as bright;
/// the light on what has no shadow map.
fn brighten(
    soup: &TriangleSoup,
    surfaces: &Surfaces,
    arrays: &mut [Arrays],
    (size, texels, translucency): ([u32; 2], &[[u8; 4]], f32),
    pivot_step: f64,
) -> CrownLight {
    let (mut materials, mut textures) = (soup.materials.clone(), soup.textures.clone());
    materials.push(dictionary_material(textures.len() as u32, translucency));
    textures.push(Arc::new(dictionary_texture(size, texels.to_vec())));
    let own = Surfaces::new(&materials, &textures);
    let truth = Brightness::of(soup, surfaces);
    for Arrays { header, vertices, indices } in arrays {
        let mut level = level_soup(header, vertices, indices, &materials, &textures);
        level.origin = soup.origin;
        let first = header.wood_vertices as usize;
        cover(&truth, &mut level, &own, vertices, first, pivot_step);
        let [sun, sky] = truth.weights(&mut level, &own);
        header.sunlit = sun as f32;
        for v in &mut vertices[header.wood_vertices as usize..] {
            v.openness = (f64::from(v.openness) * sky).round().min(255.0) as u8;
        }
    }
    truth.crown()
}

/// Hangs leaves on the branches: each by the corner that is nearest to wood.
fn hang(soup: &TriangleSoup, wood: &Wood, leaves: &mut [Leaf]) {
    leaves.par_iter_mut().for_each(|leaf| {
        let corners = leaf.triangles.iter().flat_map(|&i| soup.corners(i as usize));
        let nearest = corners
            .map(|p| (p.as_dvec3(), wood.nearest(p.as_dvec3())))
            .min_by(|a, b| a.1.1.total_cmp(&b.1.1));
        if let Some((pivot, (on, _))) = nearest {
            leaf.pivot = pivot;
            leaf.on = wood.rig.place(on);
        }
    });
}

/// Middle of the box around all leaves.
fn crown(soup: &TriangleSoup, leaves: &[Leaf]) -> DVec3 {
    let corners = leaves.iter().flat_map(|l| &l.triangles).flat_map(|&i| soup.corners(i as usize));
    corners.fold(Bounds::EMPTY, |b, p| b.with(p.as_dvec3())).center()
}

/// Brings levels to records.
struct Packing<'a> {
    wood: &'a Wood,
    crown: DVec3,
    atlas: [u32; 2],
    pivot_step: f64,
}

impl Packing<'_> {
    fn level(&self, level: &Level, places: &[[u32; 2]]) -> Arrays {
        let mut vertices = Vec::new();
        let mut by_material: Vec<(u16, Vec<[u32; 3]>)> = Vec::new();
        vertices.extend(level.thick.vertices.iter().map(|v| {
            let (record, share) = self.wood.rig.place(v.on);
            VertexRecord {
                position: v.position.as_vec3().to_array(),
                uv: v.uv.as_vec2().to_array(),
                hung: Hung::new(record, share),
                normal: encode_axis(v.normal),
                openness: (v.skylit * 255.0).round() as u8,
                color: color(v.color),
                ..VertexRecord::default()
            }
        }));
        for (t, material) in &level.thick.triangles {
            match by_material.iter_mut().find(|m| m.0 == *material) {
                Some(m) => m.1.push(*t),
                None => by_material.push((*material, vec![*t])),
            }
        }
        by_material.sort_by_key(|m| m.0);
        let mut cards = Vec::new();
        for (number, (placed, at)) in (0u32..).zip(level.panels.iter().zip(places)) {
            self.panel(placed, *at, number, &mut vertices, &mut cards);
        }
        by_material.push((DICTIONARY, cards));
        let header = LevelHeader {
            texel: level.texel,
            vertices: vertices.len() as u32,
            wood_vertices: level.thick.vertices.len() as u32,
            sunlit: 1.0,
            draws: by_material
                .iter()
                .map(|(material, t)| Draw { material: *material, triangles: t.len() as u32 })
                .collect(),
            tubes: level.tubes,
            sheets: level.sheets,
            cards: level.panels.len() as u32 - level.sheets,
            hidden: level.hidden,
            wood: level.way,
        };
        let indices = by_material.into_iter().flat_map(|m| m.1).collect();
        Arrays { header, vertices, indices }
    }

    fn panel(
        &self,
        placed: &Placed,
        at: [u32; 2],
        number: u32,
        vertices: &mut Vec<VertexRecord>,
        triangles: &mut Vec<[u32; 3]>,
    ) {
        let panel = &placed.panel;
        let first = vertices.len() as u32;
        let [m, n] = panel.cells;
        let golden = f64::from(number) * 0.618_033_988_749_895;
        for ((p, at_picture), along) in panel.corners().zip(&placed.along) {
            let uv = [0, 1].map(|k| {
                let texel = f64::from(at[k]) + at_picture[k] * f64::from(panel.size[k]);
                (texel / f64::from(self.atlas[k])) as f32
            });
            let pivot = placed.pivot.map_or(DVec3::ZERO, |pivot| pivot - p) / self.pivot_step;
            let limit = f64::from(i16::MAX);
            vertices.push(VertexRecord {
                position: p.as_vec3().to_array(),
                uv,
                hung: Hung::new(placed.on, *along),
                pivot: pivot.to_array().map(|v| v.round().clamp(-limit, limit) as i16),
                phase: (golden.fract() * 65536.0) as u16,
                normal: encode_axis((p - self.crown).normalize_or(DVec3::Y)),
                openness: (placed.openness * 255.0).round() as u8,
                flutter: if placed.pivot.is_some() { u8::MAX } else { 0 },
                color: [u8::MAX; 4],
            });
        }
        for j in 0..n {
            for i in 0..m {
                let a = first + j * (m + 1) + i;
                let (b, c, d) = (a + 1, a + m + 1, a + m + 2);
                triangles.extend([[a, c, d], [a, d, b]]);
            }
        }
    }
}

fn color([r, g, b, a]: [f32; 4]) -> [u8; 4] {
    let [r, g, b] = [r, g, b].map(linear_to_srgb8);
    [r, g, b, (a.clamp(0.0, 1.0) * 255.0).round() as u8]
}
