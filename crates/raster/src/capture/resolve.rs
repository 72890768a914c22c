//! Samples to pixels.

use super::blocks::BLOCK;
use super::fill::{Planes, Vertex};
use super::prepare::Prepared;
use super::{Buffers, Capture, CaptureScene, Grid};
use crate::picture::Picture;
use forest_soup::Tangents;
use glam::Vec3;

/// What a sample adds to its pixel.
pub(super) struct Shaded {
    pub(super) rgb: [f32; 3],
    /// Towards the eye.
    normal: Vec3,
    sky: f32,
}

impl CaptureScene<'_> {
    /// Shades samples and filters them to pixels.
    pub(super) fn resolve(&self, grid: &Grid, buffers: &Buffers, size: [u32; 2]) -> Capture {
        let [width, height] = size;
        let mut picture = Picture::empty(width, height);
        let mut sky = vec![0.0; if self.skylight.is_some() { picture.pixels.len() } else { 0 }];
        let side = grid.samples;
        let share = 1.0 / (side * side) as f32;
        // A triangle that is smaller than a pixel from any side has one colour.
        let small = (grid.step * f64::from(side)).powi(2) as f32;
        let samples = &buffers.samples;
        let [columns, rows] = samples
            .touched
            .map(|[from, to]| (from.min(to) * BLOCK / side)..(to * BLOCK).div_ceil(side));
        let mut parts: Vec<Part> = Vec::new();
        for y in rows.start..rows.end.min(height) {
            for x in columns.start..columns.end.min(width) {
                parts.clear();
                for row in y * side..(y + 1) * side {
                    for column in x * side..(x + 1) * side {
                        if let Some((depth, i)) = samples.get(column, row) {
                            Part::add(&mut parts, i, grid.places.of(column, row), depth);
                        }
                    }
                }
                if parts.is_empty() {
                    continue;
                }
                let mut sum = Sum::default();
                for part in &parts {
                    let t = &self.triangles[part.triangle as usize];
                    let shaded = if t.area <= small {
                        self.mean(part.triangle, t, grid.back)
                    } else {
                        self.shade(part, t, &buffers.vertices, grid.back)
                    };
                    sum.add(&shaded, part);
                }
                let p = (y * width + x) as usize;
                picture.pixels[p] =
                    [sum.rgb[0] * share, sum.rgb[1] * share, sum.rgb[2] * share, sum.count * share];
                picture.depth[p] = (grid.depth + f64::from(sum.depth / sum.count)) as f32;
                picture.normal[p] = (sum.normal * share).to_array();
                if let Some(sky) = sky.get_mut(p) {
                    *sky = sum.sky * share;
                }
            }
        }
        Capture { picture, sky }
    }

    /// What one sample shows, at `depth` from the scene's front.
    pub(super) fn sample(
        &self,
        grid: &Grid,
        vertices: &[Vertex],
        [x, y]: [u32; 2],
        triangle: u32,
        depth: f32,
    ) -> Shaded {
        let t = &self.triangles[triangle as usize];
        if f64::from(t.area) <= grid.step * grid.step {
            return self.mean(triangle, t, grid.back);
        }
        let place = grid.places.of(x, y).map(i64::from);
        let part = Part { triangle, count: 1, place, depth };
        self.shade(&part, t, vertices, grid.back)
    }

    /// What a triangle shows that is smaller than a pixel.
    #[inline]
    fn mean(&self, i: u32, t: &Prepared, back: Vec3) -> Shaded {
        let front = t.own.dot(back) >= 0.0;
        let sky = self.skylight.as_ref().map_or(1.0, |s| s.mean(i, front));
        Shaded { rgb: t.rgb, normal: if front { t.normal } else { -t.normal }, sky }
    }

    /// What a part of a larger triangle shows: at the middle of its samples.
    fn shade(&self, part: &Part, t: &Prepared, vertices: &[Vertex], back: Vec3) -> Shaded {
        let i = part.triangle;
        let corners = self.corners[i as usize];
        let Some(planes) = Planes::new(corners.map(|v| vertices[v as usize])) else {
            return self.mean(i, t, back);
        };
        let w = planes.weights(part.middle());
        let front = t.own.dot(back) >= 0.0;
        let surface = self.surfaces.get(t.material).expect("as when it was prepared");
        let normal = match &self.soup.normals[..] {
            [] => t.own,
            normals => {
                let [a, b, c] = self.soup.triangles[t.id as usize]
                    .map(|v| normals[v as usize])
                    .map(|n| if n == Vec3::ZERO { t.own } else { n });
                (a * w[0] + b * w[1] + c * w[2]).normalize_or_zero()
            }
        };
        let [a, b, c] = corners.map(|v| self.uvs[v as usize]);
        let texels = t.texels / planes.samples() * part.count as f32;
        let uv = a * w[0] + b * w[1] + c * w[2];
        let mut normal = if front { normal } else { -normal };
        if let Some(map) = surface.relief()
            && let Some(tangents) = Tangents::new(
                self.soup.corners(t.id as usize),
                corners.map(|v| self.uvs[v as usize]),
            )
        {
            let own = texels * map.texels() / surface.texels();
            normal = tangents.turn(normal, front, map.sample(uv, own));
        }
        Shaded {
            rgb: surface.color(uv, texels, self.tint(t, w)),
            normal,
            sky: self.skylight.as_ref().map_or(1.0, |s| s.at(i, front, w)),
        }
    }
}

/// The samples of a pixel that show one triangle.
struct Part {
    triangle: u32,
    count: u32,
    /// Sums of their places, in fixed point, and of their depths.
    place: [i64; 2],
    depth: f32,
}

impl Part {
    fn add(parts: &mut Vec<Self>, triangle: u32, [x, y]: [i32; 2], depth: f32) {
        let place = [i64::from(x), i64::from(y)];
        match parts.iter_mut().rev().find(|p| p.triangle == triangle) {
            Some(part) => {
                part.count += 1;
                part.place = [part.place[0] + place[0], part.place[1] + place[1]];
                part.depth += depth;
            }
            None => parts.push(Self { triangle, count: 1, place, depth }),
        }
    }

    fn middle(&self) -> [i32; 2] {
        self.place.map(|v| (v / i64::from(self.count)) as i32)
    }
}

/// A pixel as it is summed up over its samples.
#[derive(Default)]
struct Sum {
    rgb: [f32; 3],
    normal: Vec3,
    sky: f32,
    depth: f32,
    count: f32,
}

impl Sum {
    #[inline]
    fn add(&mut self, s: &Shaded, part: &Part) {
        let count = part.count as f32;
        self.rgb = std::array::from_fn(|k| self.rgb[k] + s.rgb[k] * count);
        self.normal += s.normal * count;
        self.sky += s.sky * count;
        self.depth += part.depth;
        self.count += count;
    }
}
