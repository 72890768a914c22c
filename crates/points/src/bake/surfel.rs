//! Triangles become surfels (Gilet et al. 2005, section 4.1).
//!
//! A surfel is a disc of its triangle's area, at its centroid, with its normal; its colour is the
//! integral of the texture over the triangle, in linear light and weighted by coverage, and its
//! opacity the mean coverage (the paper has no opacity). A triangle that is too large, or whose
//! texture is too uneven, is first cut: into 2^k pieces of equal area by bisecting longest edges or,
//! if it is a long thin piece of wood, into slices along its length. Its surfels all have one size
//! (smaller slices a lower opacity), which is also the size at which the triangle itself takes over.
//! The pieces of textured triangles are cached by texture coordinates: leaves share them.

mod slices;

use self::slices::Slices;
use crate::bake::frame::BlockFrame;
use crate::options::{BakeOptions, SurfelSize};
use crate::validate::SMALLEST_SURFEL;
use forest_soup::{AlphaMode, Material, ShadedTexture, Texture, TriangleSoup};
use glam::{DVec3, Vec2};
use rayon::prelude::*;
use std::f64::consts::PI;
use std::rc::Rc;
use std::sync::Arc;

/// A disc of the base point set, in block space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Surfel {
    pub(crate) position: [f32; 3],
    pub(crate) axis: [f32; 3],
    /// π·radius², the area of its piece of triangle.
    pub(crate) area: f32,
    /// Linear RGB of what is covered.
    pub(crate) rgb: [f32; 3],
    /// Mean coverage, > 0.
    pub(crate) opacity: f32,
}

impl Surfel {
    /// Radius of the disc.
    pub(crate) fn radius(&self) -> f64 {
        (f64::from(self.area) / PI).sqrt()
    }
}

/// No triangle is cut into more than 2^this pieces.
const MAX_DEPTH: u32 = 12;

/// Opaque triangles are cut until their pieces have at most the area of this many surfel sizes
/// squared: their colour varies slowly, only their shape matters.
const OPAQUE_AREA: f64 = 4.0;

/// Translucent pieces are not longer than this many surfel sizes. Bisection to half the length takes
/// a quarter of the area, so that a smaller number would cut thin cards to dust.
const LENGTH: f64 = 16.0;

/// Smaller triangles (in block units²) are dropped as having no area.
const SMALLEST_AREA: f64 = 1.0 / (1u64 << 52) as f64;

/// Samples (as a power of two) of a texture's integral: over an opaque triangle and over a piece of
/// one, over a translucent one (cached), and the least over a piece of that.
const OPAQUE_SAMPLES: u32 = 3;
const OPAQUE_PIECE_SAMPLES: u32 = 1;
const TRANSLUCENT_SAMPLES: u32 = 9;
const TRANSLUCENT_PIECE_SAMPLES: u32 = 4;

/// Samples (as a power of two) of a masked piece under vertex alpha.
const MASK_SAMPLES: u32 = 7;

/// What surfels are made with: shaded textures and limits. Shared by all threads.
pub(crate) struct SurfelShader<'a> {
    materials: &'a [Material],
    frame: BlockFrame,
    shades: Vec<Shade>,
    /// Square root of the area of a translucent piece, in block units.
    size: f64,
    tolerance: f64,
}

/// A material, ready for integration.
struct Shade {
    texture: Option<ShadedTexture>,
    /// Raw alpha, for masks under vertex alpha: the cutoff then varies over the triangle.
    raw: Option<ShadedTexture>,
    color: [f32; 4],
    translucent: bool,
}

impl<'a> SurfelShader<'a> {
    /// `vertex_alpha` says whether vertices may be translucent.
    pub(crate) fn new(
        materials: &'a [Material],
        textures: &[Arc<Texture>],
        vertex_alpha: bool,
        frame: BlockFrame,
        options: &BakeOptions,
    ) -> Self {
        let shades = materials
            .par_iter()
            .map(|m| {
                let texture = m.texture.map(|t| &*textures[t as usize]);
                let shaded = texture.map(|t| ShadedTexture::new(t, m));
                let masked = matches!(m.alpha_mode, AlphaMode::Mask { .. });
                let raw = texture.filter(|_| masked && vertex_alpha).map(|t| {
                    ShadedTexture::new(t, &Material { alpha_mode: AlphaMode::Blend, ..m.clone() })
                });
                let [r, g, b, _] = m.base_color;
                let alpha = m.coverage(1.0, 1.0);
                Shade {
                    translucent: shaded.as_ref().is_some_and(ShadedTexture::is_translucent),
                    texture: shaded,
                    raw,
                    color: [r * alpha, g * alpha, b * alpha, alpha],
                }
            })
            .collect();
        let size = size(&frame, options);
        Self { materials, frame, shades, size, tolerance: options.alpha_tolerance }
    }
}

/// The surfel size, in block units; infinite for one surfel a triangle.
pub(crate) fn size(frame: &BlockFrame, options: &BakeOptions) -> f64 {
    match options.surfel_size {
        SurfelSize::Auto => {
            let b = frame.bounds.size();
            (b.y / 256.0).max(b.length() / 4096.0)
        }
        SurfelSize::Triangle => f64::INFINITY,
        SurfelSize::Units(s) => frame.length(s).max(SMALLEST_SURFEL),
    }
}

/// Surfels of a size that a triangle in block space will make, roughly and from above.
pub(crate) fn estimate([a, b, c]: [DVec3; 3], size: f64) -> f64 {
    let area = 0.5 * (b - a).cross(c - a).length();
    1.0 + (2.0 * area / (size * size)).min(f64::from(1u32 << MAX_DEPTH))
}

/// What became of a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// So many surfels were made.
    Surfels(u32),
    /// It has no area.
    ZeroArea,
    /// Nothing of it is covered.
    Transparent,
}

/// Makes surfels on one thread, with its own cache. What it makes depends on the triangle alone.
pub(crate) struct SurfelMaker<'a> {
    shader: &'a SurfelShader<'a>,
    cache: Vec<Option<(Key, Rc<[Piece]>)>>,
}

/// Slots of the cache; a tree has a handful of leaf shapes.
const CACHE_SLOTS: usize = 1 << 10;

/// Everything that the pieces of a translucent triangle depend on.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Key {
    material: u16,
    uv: [u32; 6],
    /// log₂ of the edge-length ratios, in quarters.
    shape: [i16; 2],
    /// Least and greatest depth of cutting.
    depth: [u8; 2],
}

/// One piece of a triangle: its centroid (weights of corners 1 and 2), its area over that of the
/// largest piece, and what it shows.
#[derive(Clone, Copy)]
struct Piece {
    part: Part,
    at: [f32; 2],
    area: f32,
    /// Premultiplied linear RGBA.
    rgba: [f32; 4],
}

/// A triangle of a cut, as weights of corners 1 and 2.
type Part = [Vec2; 3];
const WHOLE: Part = [Vec2::ZERO, Vec2::X, Vec2::Y];

impl<'a> SurfelMaker<'a> {
    pub(crate) fn new(shader: &'a SurfelShader<'a>) -> Self {
        Self { shader, cache: vec![None; CACHE_SLOTS] }
    }

    /// Appends the surfels of triangle `i` of `soup`, whose corners are finite.
    pub(crate) fn push(&mut self, soup: &TriangleSoup, i: usize, out: &mut Vec<Surfel>) -> Outcome {
        let s = self.shader;
        let corners = soup.corners(i).map(|p| s.frame.map(p));
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a);
        let area = 0.5 * normal.length();
        if area < SMALLEST_AREA {
            return Outcome::ZeroArea;
        }
        let axis = (normal / (2.0 * area)).as_vec3().to_array();
        let material = soup.triangle_materials[i];
        let shade = &s.shades[material as usize];
        let edges = [a.distance_squared(b), b.distance_squared(c), c.distance_squared(a)];
        let uv = triangle_uv(soup, i);
        let pieces = self.pieces(uv, material, shade, edges, area);
        let colors = vertex_colors(soup, i);
        let shares: f32 = pieces.list().iter().map(|p| p.area).sum();
        let largest = (area / f64::from(shares)) as f32;
        let before = out.len();
        for piece in pieces.list() {
            let [u, v] = piece.at.map(f64::from);
            let rgba = colors.map_or(piece.rgba, |k| tint(piece, &k, s, material, uv));
            if rgba[3] > 0.0 {
                let position = (a + (b - a) * u + (c - a) * v).as_vec3().to_array();
                let rgb = std::array::from_fn(|k| rgba[k] / rgba[3]);
                let opacity = rgba[3] * piece.area;
                out.push(Surfel { position, axis, area: largest, rgb, opacity });
            }
        }
        match out.len() - before {
            0 => Outcome::Transparent,
            n => Outcome::Surfels(n as u32),
        }
    }

    fn pieces(
        &mut self,
        uv: [Vec2; 3],
        material: u16,
        shade: &Shade,
        edges: [f64; 3],
        area: f64,
    ) -> Pieces {
        let size = self.shader.size;
        let Some(texture) = shade.texture.as_ref().filter(|_| shade.translucent) else {
            let rgba = |uv, samples| match &shade.texture {
                Some(texture) => texture.integrate(uv, samples),
                None => shade.color,
            };
            let piece = |part| rgba(part_uv(uv, part), OPAQUE_PIECE_SAMPLES);
            if let Some(slices) = Slices::of(edges, area, size) {
                return Pieces::Many(slices.cut(piece));
            }
            return match depth_for_area(area, OPAQUE_AREA * size * size) {
                0 => Pieces::whole(rgba(uv, OPAQUE_SAMPLES)),
                depth => Pieces::Many(cut(edges, depth, piece)),
            };
        };
        let by_length = depth_for_length(edges, LENGTH * size);
        let greatest = by_length.max(depth_for_area(area, size * size));
        let key = Key {
            material,
            uv: bytemuck::cast(uv),
            shape: [shape_step(edges[0], edges[2]), shape_step(edges[1], edges[2])],
            depth: [by_length as u8, greatest as u8],
        };
        let slot = key.slot();
        if let Some((k, list)) = &self.cache[slot]
            && *k == key
        {
            return Pieces::Many(list.clone());
        }
        let made = translucent_pieces(texture, uv, &key, self.shader.tolerance);
        self.cache[slot] = Some((key, made.clone()));
        Pieces::Many(made)
    }
}

/// The pieces of one triangle: 2^k of equal area, all listed (transparent ones too).
enum Pieces {
    One([Piece; 1]),
    Many(Rc<[Piece]>),
}

impl Pieces {
    fn list(&self) -> &[Piece] {
        match self {
            Pieces::One(piece) => piece,
            Pieces::Many(pieces) => pieces,
        }
    }

    fn whole(rgba: [f32; 4]) -> Self {
        Self::One([Piece { part: WHOLE, at: [1.0 / 3.0; 2], area: 1.0, rgba }])
    }
}

/// The pieces at `depth` bisections of a triangle with squared edges `edges`.
fn cut(edges: [f64; 3], depth: u32, rgba: impl Fn(Part) -> [f32; 4]) -> Rc<[Piece]> {
    let mut list = Vec::with_capacity(1 << depth);
    bisect(WHOLE, edges, depth, &mut |part| {
        let at = ((part[0] + part[1] + part[2]) / 3.0).to_array();
        list.push(Piece { part, at, area: 1.0, rgba: rgba(part) });
    });
    list.into()
}

/// Cuts deeper until the footprint error is within the tolerance or the depth is the greatest.
fn translucent_pieces(
    texture: &ShadedTexture,
    uv: [Vec2; 3],
    key: &Key,
    tolerance: f64,
) -> Rc<[Piece]> {
    let edges = [0, 1].map(|k| (f64::from(key.shape[k]) / 4.0).exp2());
    let edges = [edges[0], edges[1], 1.0];
    let [least, greatest] = key.depth.map(u32::from);
    let mut depth = least;
    loop {
        let samples = TRANSLUCENT_SAMPLES.saturating_sub(depth).max(TRANSLUCENT_PIECE_SAMPLES);
        let pieces = cut(edges, depth, |part| texture.integrate(part_uv(uv, part), samples));
        if depth >= greatest || footprint_error(&pieces) <= tolerance {
            return pieces;
        }
        depth += 1;
    }
}

/// Share of the covered area that pieces of mean coverage α get wrong: a piece that is truly
/// covered or bare shows α where there is nothing and lacks 1 − α where there is.
fn footprint_error(pieces: &[Piece]) -> f64 {
    let alpha = |p: &Piece| f64::from(p.rgba[3]);
    let covered: f64 = pieces.iter().map(alpha).sum();
    let wrong: f64 = pieces.iter().map(|p| 2.0 * alpha(p) * (1.0 - alpha(p))).sum();
    if covered > 0.0 { wrong / covered } else { 0.0 }
}

/// Visits the 2^depth parts of `part` got by bisecting longest edges; `edges` are the squared
/// lengths of 0–1, 1–2 and 2–0.
fn bisect(part: Part, edges: [f64; 3], depth: u32, visit: &mut impl FnMut(Part)) {
    if depth == 0 {
        return visit(part);
    }
    let (part, edges) = longest_first(part, edges);
    let [p, q, r] = part;
    let middle = (p + q) * 0.5;
    let [first, second] = halves(edges);
    bisect([p, middle, r], first, depth - 1, visit);
    bisect([middle, q, r], second, depth - 1, visit);
}

/// Turns a triangle so that its longest edge comes first.
fn longest_first(part: Part, edges: [f64; 3]) -> (Part, [f64; 3]) {
    let ([p, q, r], [a, b, c]) = (part, edges);
    if a >= b && a >= c {
        (part, edges)
    } else if b >= c {
        ([q, r, p], [b, c, a])
    } else {
        ([r, p, q], [c, a, b])
    }
}

/// Squared edges of both halves of a triangle p q r whose edge p–q comes first and is halved at m:
/// of p m r and of m q r. The median is Apollonius's: m² = (2b² + 2c² − a²)/4.
fn halves([a, b, c]: [f64; 3]) -> [[f64; 3]; 2] {
    let median = (0.25 * (2.0 * b + 2.0 * c - a)).max(0.0);
    [[0.25 * a, median, c], [0.25 * a, b, median]]
}

/// The least depth at which pieces have at most this area.
fn depth_for_area(area: f64, limit: f64) -> u32 {
    (area / limit).log2().ceil().clamp(0.0, f64::from(MAX_DEPTH)) as u32
}

/// The least depth at which all pieces have edges of at most `length`.
fn depth_for_length(edges: [f64; 3], length: f64) -> u32 {
    let limit = length * length;
    if edges.iter().all(|&e| e <= limit) {
        return 0;
    }
    let mut shapes = vec![edges];
    for depth in 0..MAX_DEPTH {
        shapes.retain(|e| e.iter().any(|&x| x > limit));
        if shapes.is_empty() {
            return depth;
        }
        let cut: Vec<[f64; 3]> =
            shapes.iter().flat_map(|&e| halves(longest_first(WHOLE, e).1)).collect();
        // Bisection makes few shapes; equal ones (to a millionth) need no second look.
        shapes.clear();
        for e in cut {
            let same = |o: &[f64; 3]| o.iter().zip(&e).all(|(a, b)| (a - b).abs() <= 1e-6 * limit);
            if !shapes.iter().any(same) {
                shapes.push(e);
            }
        }
    }
    MAX_DEPTH
}

/// log₂(a/b) in quarters: shapes this alike are cut alike.
fn shape_step(a: f64, b: f64) -> i16 {
    ((a / b).log2() * 4.0).round().clamp(-200.0, 200.0) as i16
}

impl Key {
    fn slot(&self) -> usize {
        let mut hash = u64::from(self.material) ^ 0x9e37_79b9_7f4a_7c15;
        let [a, b] = self.shape.map(|s| u32::from(s as u16));
        let rest = [a << 16 | b, u32::from(self.depth[0]) << 8 | u32::from(self.depth[1])];
        for &word in self.uv.iter().chain(&rest) {
            hash = (hash ^ u64::from(word)).wrapping_mul(0xff51_afd7_ed55_8ccd);
            hash ^= hash >> 32;
        }
        hash as usize & (CACHE_SLOTS - 1)
    }
}

fn triangle_uv(soup: &TriangleSoup, i: usize) -> [Vec2; 3] {
    if soup.uvs.is_empty() {
        return [Vec2::ZERO; 3];
    }
    soup.triangles[i].map(|v| soup.uvs[v as usize])
}

fn part_uv([a, b, c]: [Vec2; 3], part: Part) -> [Vec2; 3] {
    part.map(|w| a + (b - a) * w.x + (c - a) * w.y)
}

fn vertex_colors(soup: &TriangleSoup, i: usize) -> Option<[[f32; 4]; 3]> {
    if soup.colors.is_empty() {
        return None;
    }
    Some(soup.triangles[i].map(|v| soup.colors[v as usize]))
}

/// A piece's colour under vertex colours, which are taken at its centroid. Under a mask, vertex
/// alpha moves the cutoff: the piece's coverage is then counted anew, sample by sample.
fn tint(
    piece: &Piece,
    colors: &[[f32; 4]; 3],
    s: &SurfelShader,
    material: u16,
    uv: [Vec2; 3],
) -> [f32; 4] {
    let color_at = |[u, v]: [f32; 2]| -> [f32; 4] {
        std::array::from_fn(|k| {
            let c = colors[0][k] * (1.0 - u - v) + colors[1][k] * u + colors[2][k] * v;
            c.clamp(0.0, 1.0)
        })
    };
    let color = color_at(piece.at);
    let index = usize::from(material);
    let material = &s.materials[index];
    let opaque = colors.iter().all(|c| c[3] >= 1.0);
    let coverage = match (material.alpha_mode, &s.shades[index].raw) {
        (AlphaMode::Opaque, _) => piece.rgba[3],
        (AlphaMode::Blend, _) => piece.rgba[3] * color[3],
        (AlphaMode::Mask { .. }, _) if opaque => piece.rgba[3],
        // Of a mask without texture all or nothing passes.
        (AlphaMode::Mask { .. }, None) => material.coverage(1.0, color[3]),
        (AlphaMode::Mask { cutoff }, Some(raw)) => {
            let mut inside = 0u32;
            bisect(piece.part, [2.0, 1.0, 1.0], MASK_SAMPLES, &mut |w| {
                let at = (w[0] + w[1] + w[2]) / 3.0;
                let texel = raw.sample(part_uv(uv, [at; 3])[0])[3];
                inside += u32::from(texel * color_at(at.to_array())[3] >= cutoff);
            });
            inside as f32 / (1u32 << MASK_SAMPLES) as f32
        }
    };
    if coverage <= 0.0 || piece.rgba[3] <= 0.0 {
        return [0.0; 4];
    }
    std::array::from_fn(|k| match k {
        3 => coverage,
        k => piece.rgba[k] / piece.rgba[3] * coverage * color[k],
    })
}

/// Direction of the surfel's axis as a vector.
pub(crate) fn axis_of(s: &Surfel) -> DVec3 {
    DVec3::new(f64::from(s.axis[0]), f64::from(s.axis[1]), f64::from(s.axis[2]))
}

#[cfg(test)]
mod tests;
