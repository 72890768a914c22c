//! The points representation: select, project, draw.

use crate::lit::Lit;
use forest_foliage::{BentPoints, Gain};
use forest_pack::{Pack, PackError};
use forest_points::record::decode_axis;
use forest_points::spheroid::Footprint;
use forest_points::{
    CellCut, CellRecord, Cut, PointRecord, PointsBlock, Thresholds, TriangleRecord, read_materials,
    select,
};
use forest_raster::{Corner, DisplayList, Ellipse, Picture, Projector, Style, Surfaces, draw};
use forest_soup::{Camera, srgb8_to_linear};
use glam::{DVec2, DVec3, Vec2};
use rayon::prelude::*;

/// The surfaces of a pack, `None` if its block has no triangles to draw them on.
///
/// # Errors
/// When the materials or textures are missing, damaged or break a rule.
pub fn read_surfaces(pack: &Pack, block: &PointsBlock) -> Result<Option<Surfaces>, PackError> {
    if block.triangles.is_empty() {
        return Ok(None);
    }
    let (materials, textures) = read_materials(pack)?;
    Ok(Some(Surfaces::new(&materials, &textures)))
}

/// What a picture took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Drawn {
    /// Points.
    pub points: u64,
    /// Triangles.
    pub triangles: u64,
}

impl Drawn {
    /// Points and triangles.
    pub fn primitives(&self) -> u64 {
        self.points + self.triangles
    }
}

/// Draws the cut for `camera` and `thresholds`. Without `surfaces` (a pack without triangles)
/// points are drawn however large.
pub fn draw_points<'a>(
    block: &PointsBlock,
    surfaces: Option<&Surfaces>,
    camera: &Camera,
    thresholds: &Thresholds,
    lit: impl Into<Lit<'a>>,
) -> (Picture, Drawn) {
    let frame = PointsFrame::new(block, surfaces, camera, thresholds, lit, None);
    (frame.draw(), frame.drawn)
}

/// [`draw_points`], as the wind bends them.
pub fn draw_bent_points<'a>(
    block: &PointsBlock,
    surfaces: Option<&Surfaces>,
    camera: &Camera,
    thresholds: &Thresholds,
    lit: impl Into<Lit<'a>>,
    bent: &BentPoints,
) -> (Picture, Drawn) {
    let frame = PointsFrame::new(block, surfaces, camera, thresholds, lit, Some(bent));
    (frame.draw(), frame.drawn)
}

/// A picture before it is drawn: what was selected and projected.
pub struct PointsFrame<'a> {
    list: DisplayList<'a>,
    camera: &'a Camera,
    style: Style,
    drawn: Drawn,
    bytes: u64,
}

impl<'a> PointsFrame<'a> {
    /// Selects and projects; the arguments are those of [`draw_points`] and [`draw_bent_points`].
    pub fn new<'l>(
        block: &PointsBlock,
        surfaces: Option<&'a Surfaces>,
        camera: &'a Camera,
        thresholds: &Thresholds,
        lit: impl Into<Lit<'l>>,
        bent: Option<&BentPoints>,
    ) -> Self {
        let lit = lit.into();
        let mut thresholds = *thresholds;
        if surfaces.is_none() {
            thresholds.largest.0 = f64::INFINITY;
        }
        let cut = select(block, camera, &thresholds);
        let ellipses = point_ellipses(block, &cut, camera, lit, bent, &|_| true);
        let mut list = DisplayList::of_ellipses(ellipses);
        if let Some(surfaces) = surfaces {
            triangles(block, &cut, camera, surfaces, &lit, bent, &mut list);
        }
        let points = cut.points(block).count() as u64;
        let drawn = Drawn { points, triangles: cut.triangle_count() };
        let looked_at: u64 = cut.cells.iter().map(|c| c.points.len() as u64).sum();
        let bytes = looked_at * size_of::<PointRecord>() as u64
            + drawn.triangles * size_of::<TriangleRecord>() as u64;
        Self { list, camera, style: lit.style, drawn, bytes }
    }

    /// What will be drawn.
    pub fn drawn(&self) -> Drawn {
        self.drawn
    }

    /// Bytes of the records that a renderer looks at: ranges of points, and triangles.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// The points, to be changed: other looks to compare with.
    pub fn ellipses(&mut self) -> &mut [Ellipse] {
        self.list.ellipses_mut()
    }

    /// The picture.
    pub fn draw(&self) -> Picture {
        draw(&self.list, self.camera, &self.style)
    }
}

/// The points of a cut whose index `keep` wants, as `camera` sees them, without those behind the eye.
pub fn point_ellipses<'a>(
    block: &PointsBlock,
    cut: &Cut,
    camera: &Camera,
    lit: impl Into<Lit<'a>>,
    bent: Option<&BentPoints>,
    keep: &(dyn Fn(u32) -> bool + Sync),
) -> Vec<Ellipse> {
    let lit = lit.into();
    let projector = Projector::new(camera, near(block));
    let ellipses = |c: &CellCut| -> Vec<Ellipse> {
        c.drawn_points(block)
            .filter(|(id, _, _)| keep(*id))
            .filter_map(|(id, cell, p)| {
                let number = id.wrapping_add(block.point_offset(c.cell));
                let mut world = block.to_world(block.position(cell, p.position));
                let mut axis = p.axis();
                if let Some(bent) = bent {
                    let hung = bent.point(id);
                    (world, axis) = (bent.place(hung, world), bent.direction(hung, axis));
                }
                ellipse(block, &projector, camera, &lit, number, p, [world, axis])
            })
            .collect()
    };
    cut.cells.par_iter().flat_map_iter(ellipses).collect()
}

/// Nearest distance at which a perspective camera sees: a millionth of the block.
fn near(block: &PointsBlock) -> f64 {
    1e-6 * block.scale()
}

fn ellipse(
    block: &PointsBlock,
    projector: &Projector,
    camera: &Camera,
    lit: &Lit,
    id: u32,
    p: &PointRecord,
    [world, axis]: [DVec3; 2],
) -> Option<Ellipse> {
    let (x, y, depth) = camera.project(world);
    if projector.is_behind(depth) {
        return None;
    }
    let to_eye = camera.to_eye(world);
    let center = DVec2::new(x, y);
    let radius = block.radius(p) * block.scale() * camera.pixels_per_unit(depth);
    // y points down in a picture.
    let plane = [camera.right, -camera.up];
    let f = Footprint::new(center, radius, p.flatness_step(), axis, to_eye, plane);
    // The axis has no sign: it is the side that is seen.
    let normal = if axis.dot(to_eye) < 0.0 { -axis } else { axis }.as_vec3();
    let [sunlit, skylit] = lit.seen(world, block.middle(), block.half_diagonal(), Gain::POINTS);
    let light = lit.style.light.factors(normal, sunlit, skylit);
    let color = p.color();
    Some(Ellipse {
        id,
        center,
        radius,
        minor: f.minor,
        ratio: f.ratio,
        depth,
        opacity: p.opacity,
        rgb: std::array::from_fn(|k| color[k] * light[k]),
        normal,
    })
}

fn triangles<'s>(
    block: &PointsBlock,
    cut: &Cut,
    camera: &Camera,
    surfaces: &'s Surfaces,
    lit: &Lit,
    bent: Option<&BentPoints>,
    list: &mut DisplayList<'s>,
) {
    let projector = Projector::new(camera, near(block));
    for c in &cut.cells {
        let cell = &block.cells[c.cell as usize];
        // Points and triangles have different numbers for the hash rule (SPEC.md, section 5.4).
        let first_id = block.triangle_offset(c.cell);
        for i in c.triangles.clone() {
            let t = &block.triangles[i as usize];
            let corners = corners(block, cell, i, t, lit, bent);
            list.triangle(&projector, surfaces, t.material, first_id.wrapping_add(i), corners);
        }
    }
}

/// Corners of the triangle record number `index`.
fn corners(
    block: &PointsBlock,
    cell: &CellRecord,
    index: u32,
    t: &TriangleRecord,
    lit: &Lit,
    bent: Option<&BentPoints>,
) -> [Corner; 3] {
    let range = block.header.uv_ranges[t.material as usize];
    let colors = block.triangle_colors.get(index as usize);
    std::array::from_fn(|k| {
        let v = t.corners[k];
        let color = colors.map_or([1.0; 4], |c| {
            let [r, g, b, a] = c[k];
            let [r, g, b] = [r, g, b].map(srgb8_to_linear);
            [r, g, b, f32::from(a) / 255.0]
        });
        let mut position = block.to_world(block.position(cell, v.position));
        let mut normal = decode_axis(v.normal);
        if let Some(bent) = bent {
            let hung = bent.corners(index)[k];
            (position, normal) = (bent.place(hung, position), bent.direction(hung, normal));
        }
        let (middle, half_diagonal) = (block.middle(), block.half_diagonal());
        let [sunlit, skylit] = lit.seen(position, middle, half_diagonal, Gain::SOURCE);
        Corner {
            position,
            sunlit,
            skylit,
            normal: normal.as_vec3(),
            uv: Vec2::from_array(range.decode(v.uv)),
            color,
        }
    })
}

#[cfg(test)]
mod tests;
