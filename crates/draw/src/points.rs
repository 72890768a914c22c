//! The points representation: select, project, draw.

use crate::canvas::Canvas;
use crate::picture::Picture;
use crate::primitive::{Primitive, Splat, Surface, Triangle};
use crate::style::Style;
use forest_pack::{Pack, PackError};
use forest_points::record::decode_axis;
use forest_points::spheroid::Footprint;
use forest_points::{
    CellRecord, Cut, PointRecord, PointsBlock, Thresholds, TriangleRecord, VertexRecord,
    read_materials, select,
};
use forest_soup::{Camera, Material, Projection, Texture, srgb8_to_linear};
use glam::{DVec2, DVec3, Vec2};
use std::sync::Arc;

/// The materials of a pack, ready to be sampled.
#[derive(Clone, Debug, Default)]
pub struct Surfaces(Vec<Surface>);

impl Surfaces {
    /// The surfaces of a pack, `None` if its block has no triangles to draw them on.
    ///
    /// # Errors
    /// When the materials or textures are missing, damaged or break a rule.
    pub fn read(pack: &Pack, block: &PointsBlock) -> Result<Option<Self>, PackError> {
        if block.triangles.is_empty() {
            return Ok(None);
        }
        let (materials, textures) = read_materials(pack)?;
        Ok(Some(Self::new(&materials, &textures)))
    }

    /// Prepares the materials of [`forest_points::read_materials`].
    pub fn new(materials: &[Material], textures: &[Arc<Texture>]) -> Self {
        Self(materials.iter().map(|m| Surface::new(m, textures)).collect())
    }
}

/// What a picture took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Drawn {
    /// Points.
    pub points: u64,
    /// Triangles.
    pub triangles: u64,
}

/// Draws the cut for `camera` and `thresholds`. Without `surfaces` (a pack without triangles)
/// points are drawn however large.
pub fn draw_points(
    block: &PointsBlock,
    surfaces: Option<&Surfaces>,
    camera: &Camera,
    thresholds: &Thresholds,
    style: &Style,
) -> (Picture, Drawn) {
    let mut thresholds = *thresholds;
    if surfaces.is_none() {
        thresholds.largest.0 = f64::INFINITY;
    }
    let cut = select(block, camera, &thresholds);
    let canvas = Canvas::new(camera, style);
    let projector = Projector { block, camera, style, scale: canvas.scale() };
    let mut primitives: Vec<Primitive> = cut
        .points(block)
        .filter_map(|(id, cell, p)| projector.point(id, cell, p).map(Primitive::Splat))
        .collect();
    if let Some(surfaces) = surfaces {
        projector.triangles(&cut, surfaces, &mut primitives);
    }
    let drawn = Drawn { points: cut.points(block).count() as u64, triangles: cut.triangle_count() };
    (canvas.render(&primitives), drawn)
}

struct Projector<'a> {
    block: &'a PointsBlock<'a>,
    camera: &'a Camera,
    style: &'a Style,
    scale: f64,
}

impl Projector<'_> {
    fn point(&self, id: u32, cell: &CellRecord, p: &PointRecord) -> Option<Splat> {
        let world = self.block.to_world(self.block.position(cell, p.position));
        let (x, y, depth) = self.camera.project(world);
        if self.is_behind(depth) {
            return None;
        }
        let pixels = self.camera.pixels_per_unit(depth);
        let (axis, camera) = (p.axis(), self.camera);
        let center = DVec2::new(x, y) * self.scale;
        let radius = p.own().radius() * self.block.scale() * pixels * self.scale;
        // y points down in a picture.
        let plane = [camera.right, -camera.up];
        let to_eye = camera.to_eye(world);
        let light = self.style.light.factor(axis);
        Some(Splat {
            id,
            footprint: Footprint::new(center, radius, p.flatness_step(), axis, to_eye, plane),
            depth,
            opacity: p.opacity,
            rgb: p.color().map(|v| v * light),
        })
    }

    fn is_behind(&self, depth: f64) -> bool {
        matches!(self.camera.projection, Projection::Perspective { .. }) && depth <= self.near()
    }

    /// Nearest distance at which a perspective camera sees: a millionth of the block.
    fn near(&self) -> f64 {
        1e-6 * self.block.scale()
    }

    fn triangles<'s>(&self, cut: &Cut, surfaces: &'s Surfaces, out: &mut Vec<Primitive<'s>>) {
        let first_id = self.block.points.len() as u32;
        for c in &cut.cells {
            let cell = &self.block.cells[c.cell as usize];
            for i in c.triangles.clone() {
                let t = &self.block.triangles[i as usize];
                if let Some(surface) = surfaces.0.get(t.material as usize) {
                    self.triangle(first_id.wrapping_add(i), cell, i as usize, t, surface, out);
                }
            }
        }
    }

    fn triangle<'s>(
        &self,
        id: u32,
        cell: &CellRecord,
        index: usize,
        t: &TriangleRecord,
        surface: &'s Surface,
        out: &mut Vec<Primitive<'s>>,
    ) {
        let range = self.block.header.uv_ranges[t.material as usize];
        let colors = self.block.triangle_colors.get(index);
        let corner = |k: usize| {
            let v: VertexRecord = t.corners[k];
            let color = colors.map_or([1.0; 4], |c| {
                let [r, g, b, a] = c[k];
                let [r, g, b] = [r, g, b].map(srgb8_to_linear);
                [r, g, b, f32::from(a) / 255.0]
            });
            Corner {
                world: self.block.to_world(self.block.position(cell, v.position)),
                normal: decode_axis(v.normal),
                uv: Vec2::from_array(range.decode(v.uv)),
                color,
            }
        };
        let corners = [corner(0), corner(1), corner(2)];
        let normal =
            (corners[0].normal + corners[1].normal + corners[2].normal).normalize_or(DVec3::Y);
        let light = if surface.is_unlit() { 1.0 } else { self.style.light.factor(normal) };
        let visible = self.clipped(&corners);
        for k in 1..visible.len().saturating_sub(1) {
            let part = [&visible[0], &visible[k], &visible[k + 1]];
            let projected = part.map(|c| self.camera.project(c.world));
            let parallel = matches!(self.camera.projection, Projection::Orthographic { .. });
            out.push(Primitive::Triangle(Box::new(Triangle {
                id,
                corners: projected.map(|(x, y, _)| DVec2::new(x, y) * self.scale),
                depths: projected.map(|p| p.2),
                inverse_w: projected.map(|p| if parallel { 1.0 } else { 1.0 / p.2 }),
                uvs: part.map(|c| c.uv),
                colors: part.map(|c| c.color),
                light,
                surface,
            })));
        }
    }

    /// The part of a triangle before a perspective eye (Sutherland, Hodgman 1974).
    fn clipped(&self, corners: &[Corner; 3]) -> Vec<Corner> {
        let depth = |c: &Corner| (c.world - self.camera.eye).dot(self.camera.forward);
        let near = self.near();
        if corners.iter().all(|c| !self.is_behind(depth(c))) {
            return corners.to_vec();
        }
        let mut out = Vec::with_capacity(4);
        for k in 0..3 {
            let (a, b) = (&corners[k], &corners[(k + 1) % 3]);
            let (da, db) = (depth(a), depth(b));
            if da > near {
                out.push(*a);
            }
            if (da > near) != (db > near) {
                out.push(a.lerp(b, (near - da) / (db - da)));
            }
        }
        out
    }
}

/// A corner of a triangle in the world.
#[derive(Clone, Copy)]
struct Corner {
    world: DVec3,
    normal: DVec3,
    uv: Vec2,
    color: [f32; 4],
}

impl Corner {
    fn lerp(&self, other: &Self, t: f64) -> Self {
        let f = t as f32;
        Self {
            world: self.world.lerp(other.world, t),
            normal: self.normal,
            uv: self.uv.lerp(other.uv, f),
            color: std::array::from_fn(|k| self.color[k] + (other.color[k] - self.color[k]) * f),
        }
    }
}

#[cfg(test)]
mod tests;
