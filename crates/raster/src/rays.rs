//! A soup by rays: the careful way, with shadows.
//!
//! Visibility, depth and texture coordinates come from ray–triangle intersections (T. Möller,
//! B. Trumbore, "Fast, minimum storage ray/triangle intersection", 1997) through a library's
//! bounding volume hierarchy, and share nothing with the scanlines but the sample places, the
//! materials and the hash rule of opacity.

use crate::canvas::Style;
use crate::mesh::extent;
use crate::opacity::covers;
use crate::picture::Picture;
use crate::surface::Surfaces;
use crate::trace::{Ball, LIFT, Sample, Seen, View, hierarchy, ray, units, window};
use forest_soup::{Camera, Tangents, TriangleSoup};
use glam::{Vec2, Vec3, Vec3A};
use obvhs::cwbvh::CwBvh;
use obvhs::ray::{Ray, RayHit};
use obvhs::triangle::Triangle;

/// A soup, ready to be seen by rays.
pub struct RayScene<'a> {
    soup: &'a TriangleSoup,
    surfaces: &'a Surfaces,
    bvh: CwBvh,
    /// Around the hierarchy; `None` if it is empty.
    ball: Option<Ball>,
    /// In the order of the hierarchy's leaves.
    triangles: Vec<Triangle>,
    /// Their numbers in the soup.
    ids: Vec<u32>,
    /// World units to units of the hierarchy ([`units`]).
    scale: f32,
}

/// A triangle that a ray meets, by its place in the hierarchy, and where.
#[derive(Clone, Copy)]
pub(crate) struct Hit {
    i: usize,
    at: Meeting,
}

/// Where a ray meets a triangle: distance and barycentric coordinates of corners 1 and 2.
#[derive(Clone, Copy)]
struct Meeting {
    t: f32,
    u: f32,
    v: f32,
}

impl Hit {
    /// Distance from the ray's start, in units of the hierarchy.
    pub(crate) fn distance(&self) -> f32 {
        self.at.t
    }
}

impl<'a> RayScene<'a> {
    /// Builds the hierarchy. `surfaces` are those of the soup's materials; triangles with corners
    /// that are not finite are left out.
    ///
    /// # Panics
    /// If the soup breaks its own rules ([`TriangleSoup::validate`]).
    pub fn new(soup: &'a TriangleSoup, surfaces: &'a Surfaces) -> Self {
        let scale = units(extent(soup));
        let all: Vec<(u32, Triangle)> = (0..soup.triangles.len())
            .filter(|&i| soup.corners(i).iter().all(|p| p.is_finite()))
            .map(|i| {
                let [v0, v1, v2] = soup.corners(i).map(|p| Vec3A::from(p) * scale);
                (i as u32, Triangle { v0, v1, v2 })
            })
            .collect();
        let triangles: Vec<Triangle> = all.iter().map(|t| t.1).collect();
        let bvh = hierarchy(&triangles, 3);
        let order = bvh.primitive_indices.iter().map(|&i| all[i as usize]);
        let (ids, triangles) = order.unzip();
        let ball = Ball::around(&bvh.total_aabb);
        Self { soup, surfaces, bvh, ball, triangles, ids, scale }
    }

    /// What `camera` sees, with the shadows that `style`'s sun casts.
    pub fn picture(&self, camera: &Camera, style: &Style) -> Picture {
        window(style, [0, 0], [camera.width, camera.height], |at, grid| {
            self.sample(camera, style, at, grid)
        })
    }

    /// World units to units of the hierarchy.
    pub(crate) fn units(&self) -> f32 {
        self.scale
    }

    /// The ball around the hierarchy; `None` if it is empty.
    pub(crate) fn ball(&self) -> Option<&Ball> {
        self.ball.as_ref()
    }

    /// Corners of all triangles about the soup's zero, in units of the hierarchy.
    pub(crate) fn corners(&self) -> impl Iterator<Item = Vec3A> {
        self.triangles.iter().flat_map(|t| [t.v0, t.v1, t.v2])
    }

    /// What the ray through picture coordinates `at` sees.
    fn sample(
        &self,
        camera: &Camera,
        style: &Style,
        at: [f64; 2],
        grid: (u32, u32),
    ) -> Option<Sample> {
        let (first, start, slant) = self.primary(camera, at)?;
        let hit = self.nearest(first, 0, grid)?;
        let seen = self.seen(hit, first.direction.into())?;
        let rgb = seen.color(&style.light, grid, |behind, direction| {
            let before = Vec3::from(first.origin + first.direction * hit.at.t) + seen.own * LIFT;
            let from = if behind { before - seen.own * (2.0 * LIFT) } else { before };
            self.is_free(ray(from.into(), direction.into()), 0, grid)
        });
        let depth = ((start + f64::from(hit.at.t) * slant) / f64::from(self.scale)) as f32;
        Some(Sample { rgb, depth, normal: seen.normal })
    }

    /// The ray through `at`, the depth at which it starts, and the depth it gains per unit: all in
    /// units of the hierarchy.
    fn primary(&self, camera: &Camera, at: [f64; 2]) -> Option<(Ray, f64, f64)> {
        let ball = self.ball.as_ref()?;
        let View { offset, direction, slant, endless } = View::new(camera, at);
        let scale = f64::from(self.scale);
        let from = (camera.eye - self.soup.origin) * scale + offset * scale;
        let nearest = if endless { f64::NEG_INFINITY } else { 1e-6 * ball.radius };
        let ahead = ball.start(from, direction, nearest)?;
        let origin = (from + direction * ahead).as_vec3a();
        Some((ray(origin, direction.as_vec3a()), ahead * slant, slant))
    }

    /// The first that a ray in units of the hierarchy hits. `salt` tells apart scenes whose
    /// partly transparent triangles must not cover the same samples.
    pub(crate) fn nearest(&self, ray: Ray, salt: u32, grid: (u32, u32)) -> Option<Hit> {
        let mut hit = RayHit::none();
        self.bvh.ray_traverse(ray, &mut hit, |ray, i| {
            self.meet(ray, i, salt, grid).map_or(f32::INFINITY, |m| m.t)
        });
        let i = hit.primitive_id as usize;
        let at = meet(self.triangles.get(i)?, &ray)?;
        Some(Hit { i, at })
    }

    /// Whether such a ray hits nothing.
    pub(crate) fn is_free(&self, ray: Ray, salt: u32, grid: (u32, u32)) -> bool {
        self.bvh.ray_traverse_miss(ray, |ray, i| {
            self.meet(ray, i, salt, grid).map_or(f32::INFINITY, |m| m.t)
        })
    }

    /// What a ray of this direction sees where it hits.
    pub(crate) fn seen(&self, hit: Hit, direction: Vec3) -> Option<Seen> {
        let (uv, tint) = self.attributes(hit.i, hit.at);
        let material = self.soup.triangle_materials[self.ids[hit.i] as usize];
        let surface = self.surfaces.get(material)?;
        let rgb = surface.at(uv, tint).0;
        let (own, mut normal) = self.normals(hit.i, hit.at, direction);
        if let Some(map) = surface.relief()
            && let Some(tangents) = self.tangents(hit.i)
        {
            normal = tangents.turn(normal, self.is_front(hit.i, direction), map.sample(uv, 1.0));
        }
        let (unlit, translucency) = (surface.is_unlit(), surface.translucency());
        Some(Seen { rgb, unlit, translucency, own, normal })
    }

    /// Where the ray meets triangle `i`, if the triangle covers there for sample `grid`.
    fn meet(&self, ray: &Ray, i: usize, salt: u32, grid: (u32, u32)) -> Option<Meeting> {
        let m = meet(&self.triangles[i], ray)?;
        let id = self.ids[i];
        let surface = self.surfaces.get(self.soup.triangle_materials[id as usize])?;
        if surface.translucent {
            let (uv, tint) = self.attributes(i, m);
            let opacity = (surface.at(uv, tint).1 * 255.0).round() as u8;
            covers(id ^ salt, grid.0, grid.1, opacity).then_some(m)
        } else {
            Some(m)
        }
    }

    /// Texture coordinates and vertex colour.
    fn attributes(&self, i: usize, m: Meeting) -> (Vec2, [f32; 4]) {
        let [a, b, c] = self.soup.triangles[self.ids[i] as usize].map(|v| v as usize);
        let w = [1.0 - m.u - m.v, m.u, m.v];
        let uv = match &self.soup.uvs[..] {
            [] => Vec2::ZERO,
            uvs => uvs[a] * w[0] + uvs[b] * w[1] + uvs[c] * w[2],
        };
        let tint = match &self.soup.colors[..] {
            [] => [1.0; 4],
            t => std::array::from_fn(|k| t[a][k] * w[0] + t[b][k] * w[1] + t[c][k] * w[2]),
        };
        (uv, tint)
    }

    /// The triangle's own normal: a unit vector, or zero.
    fn own(&self, i: usize) -> Vec3 {
        let t = &self.triangles[i];
        Vec3::from((t.v1 - t.v0).cross(t.v2 - t.v0)).normalize_or_zero()
    }

    /// Whether a ray of this direction sees the front of triangle `i`.
    fn is_front(&self, i: usize, direction: Vec3) -> bool {
        self.own(i).dot(direction) <= 0.0
    }

    /// Which way the texture coordinates of triangle `i` grow.
    fn tangents(&self, i: usize) -> Option<Tangents> {
        let id = self.ids[i] as usize;
        let uv = |v: u32| self.soup.uvs.get(v as usize).copied().unwrap_or(Vec2::ZERO);
        Tangents::new(self.soup.corners(id), self.soup.triangles[id].map(uv))
    }

    /// The triangle's own normal and the interpolated one, both turned as the own one faces the eye.
    fn normals(&self, i: usize, m: Meeting, direction: Vec3) -> (Vec3, Vec3) {
        let own = self.own(i);
        let sign = if self.is_front(i, direction) { 1.0 } else { -1.0 };
        let shading = match &self.soup.normals[..] {
            [] => own,
            n => {
                let [a, b, c] = self.soup.triangles[self.ids[i] as usize]
                    .map(|v| n[v as usize])
                    .map(|n| if n == Vec3::ZERO { own } else { n });
                (a * (1.0 - m.u - m.v) + b * m.u + c * m.v).normalize_or_zero()
            }
        };
        (own * sign, shading * sign)
    }
}

fn meet(t: &Triangle, ray: &Ray) -> Option<Meeting> {
    let (e1, e2) = (t.v1 - t.v0, t.v2 - t.v0);
    let p = ray.direction.cross(e2);
    let det = e1.dot(p);
    if det == 0.0 {
        return None;
    }
    let inverse = 1.0 / det;
    let s = ray.origin - t.v0;
    let u = s.dot(p) * inverse;
    let q = s.cross(e1);
    let v = ray.direction.dot(q) * inverse;
    let at = e2.dot(q) * inverse;
    let inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0;
    (inside && at >= ray.tmin && at <= ray.tmax).then_some(Meeting { t: at, u, v })
}

#[cfg(test)]
mod tests;
