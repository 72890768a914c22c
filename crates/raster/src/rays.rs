//! A soup by rays: the careful way, with shadows.
//!
//! Visibility, depth and texture coordinates come from ray–triangle intersections (T. Möller,
//! B. Trumbore, "Fast, minimum storage ray/triangle intersection", 1997) through a library's
//! bounding volume hierarchy, and share nothing with the scanlines but the sample places, the
//! materials and the hash rule of opacity.

use crate::canvas::Style;
use crate::light::{Light, Sun};
use crate::mesh::extent;
use crate::opacity::{covers, mix};
use crate::picture::{Picture, PixelMean};
use crate::sampling::Pattern;
use crate::surface::Surfaces;
use forest_soup::{Camera, Projection, TriangleSoup};
use glam::{Vec2, Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::ray::{Ray, RayHit};
use obvhs::triangle::Triangle;
use rayon::prelude::*;
use std::time::Duration;

/// A soup, ready to be seen by rays.
pub struct RayScene<'a> {
    soup: &'a TriangleSoup,
    surfaces: &'a Surfaces,
    bvh: CwBvh,
    /// In the order of the hierarchy's leaves.
    triangles: Vec<Triangle>,
    /// Their numbers in the soup.
    ids: Vec<u32>,
    /// World units to units of the hierarchy, a power of two: the library takes anything nearer
    /// than 10⁻⁴ to a ray's start for missed, so the soup is made about [`EXTENT`] wide.
    scale: f32,
}

/// Width of the soup in the units of the hierarchy, within a factor of two.
const EXTENT: f64 = 1024.0;

/// Distance by which secondary rays start off their surface, in those units.
const LIFT: f32 = 1e-5 * EXTENT as f32;

/// Where a ray meets a triangle: distance and barycentric coordinates of corners 1 and 2.
#[derive(Clone, Copy)]
struct Meeting {
    t: f32,
    u: f32,
    v: f32,
}

impl<'a> RayScene<'a> {
    /// Builds the hierarchy. `surfaces` are those of the soup's materials; triangles with corners
    /// that are not finite are left out.
    ///
    /// # Panics
    /// If the soup breaks its own rules ([`TriangleSoup::validate`]).
    pub fn new(soup: &'a TriangleSoup, surfaces: &'a Surfaces) -> Self {
        let scale = match extent(soup) {
            extent if extent > 0.0 => (EXTENT / extent).log2().floor().clamp(-120.0, 120.0).exp2(),
            _ => 1.0,
        } as f32;
        let all: Vec<(u32, Triangle)> = (0..soup.triangles.len())
            .filter(|&i| soup.corners(i).iter().all(|p| p.is_finite()))
            .map(|i| {
                let [v0, v1, v2] = soup.corners(i).map(|p| Vec3A::from(p) * scale);
                (i as u32, Triangle { v0, v1, v2 })
            })
            .collect();
        let triangles: Vec<Triangle> = all.iter().map(|t| t.1).collect();
        let mut unused = Duration::default();
        let bvh = build_cwbvh_from_tris(&triangles, BvhBuildParams::fast_build(), &mut unused);
        let order = bvh.primitive_indices.iter().map(|&i| all[i as usize]);
        let (ids, triangles) = order.unzip();
        Self { soup, surfaces, bvh, triangles, ids, scale }
    }

    /// What `camera` sees, with the shadows that `style`'s sun casts.
    pub fn picture(&self, camera: &Camera, style: &Style) -> Picture {
        let pattern = Pattern::new(style.sampling);
        let mut out = Picture::empty(camera.width, camera.height);
        let share = 1.0 / pattern.count() as f32;
        let rows: Vec<Picture> = (0..camera.height)
            .into_par_iter()
            .map(|y| {
                let mut row = Picture::empty(camera.width, 1);
                for x in 0..camera.width {
                    let (xs, ys) = pattern.pixel(x, y);
                    let mut mean = PixelMean::default();
                    for s in 0..pattern.count() {
                        let at = [f64::from(x) + f64::from(xs[s]), f64::from(y) + f64::from(ys[s])];
                        let grid = pattern.grid(x, y, s);
                        if let Some((rgb, depth, normal)) = self.sample(camera, style, at, grid) {
                            let [r, g, b] = rgb;
                            mean.add([r, g, b, 1.0], depth, normal.to_array(), share);
                        }
                    }
                    mean.store(&mut row, x as usize);
                }
                row
            })
            .collect();
        for (y, row) in rows.into_iter().enumerate() {
            let first = y * camera.width as usize;
            out.pixels[first..][..row.pixels.len()].copy_from_slice(&row.pixels);
            out.depth[first..][..row.depth.len()].copy_from_slice(&row.depth);
            out.normal[first..][..row.normal.len()].copy_from_slice(&row.normal);
        }
        out
    }

    /// Linear RGB, depth and normal at picture coordinates `at`.
    fn sample(
        &self,
        camera: &Camera,
        style: &Style,
        at: [f64; 2],
        grid: (u32, u32),
    ) -> Option<([f32; 3], f32, Vec3)> {
        let (ray, start, slant) = self.primary(camera, at)?;
        let mut hit = RayHit::none();
        self.bvh.ray_traverse(ray, &mut hit, |ray, i| {
            self.meet(ray, i, grid).map_or(f32::INFINITY, |m| m.t)
        });
        let i = hit.primitive_id as usize;
        let m = meet(self.triangles.get(i)?, &ray)?;
        let (uv, tint) = self.attributes(i, m);
        let material = self.soup.triangle_materials[self.ids[i] as usize];
        let surface = self.surfaces.get(material)?;
        let rgb = surface.at(uv, tint).0;
        let (own, normal) = self.normals(i, m, Vec3::from(ray.direction));
        let factors = match &style.light {
            Light::Sun(sun) if !surface.is_unlit() => {
                let place = Vec3::from(ray.origin + ray.direction * m.t) + own * LIFT;
                self.lit(sun, place, own, normal, grid)
            }
            _ => [1.0; 3],
        };
        let depth = ((start + f64::from(m.t) * slant) / f64::from(self.scale)) as f32;
        Some((std::array::from_fn(|k| rgb[k] * factors[k]), depth, normal))
    }

    /// The ray through `at`, the depth at which it starts, and the depth it gains per unit: all in
    /// units of the hierarchy.
    fn primary(&self, camera: &Camera, at: [f64; 2]) -> Option<(Ray, f64, f64)> {
        let right = at[0] - f64::from(camera.width) * 0.5;
        let up = f64::from(camera.height) * 0.5 - at[1];
        let aside = |pixels: f64| (camera.right * right + camera.up * up) / pixels;
        let scale = f64::from(self.scale);
        let eye = (camera.eye - self.soup.origin) * scale;
        // Rays that start just before the scene meet it where single precision is dense.
        let bounds = self.bvh.total_aabb;
        let middle = (bounds.min + bounds.max) * 0.5;
        let radius = f64::from((bounds.max - bounds.min).length()) * 0.5;
        if !radius.is_finite() {
            return None; // nothing there
        }
        let center = Vec3::from(middle).as_dvec3();
        let reach = 1.001 * radius;
        Some(match camera.projection {
            Projection::Orthographic { .. } => {
                let from = eye + aside(camera.pixels_per_unit(1.0)) * scale;
                let start = (center - from).dot(camera.forward) - reach;
                let origin = (from + camera.forward * start).as_vec3a();
                (ray(origin, camera.forward.as_vec3a()), start, 1.0)
            }
            Projection::Perspective { .. } => {
                let direction = camera.forward + aside(camera.pixels_per_unit(1.0));
                let slant = 1.0 / direction.length();
                let direction = direction * slant;
                let ahead = ((center - eye).dot(direction) - reach).max(1e-6 * radius);
                let origin = (eye + direction * ahead).as_vec3a();
                (ray(origin, direction.as_vec3a()), ahead * slant, slant)
            }
        })
    }

    /// Where the ray meets triangle `i`, if the triangle covers there for sample `grid`.
    fn meet(&self, ray: &Ray, i: usize, grid: (u32, u32)) -> Option<Meeting> {
        let m = meet(&self.triangles[i], ray)?;
        let id = self.ids[i];
        let surface = self.surfaces.get(self.soup.triangle_materials[id as usize])?;
        if surface.translucent {
            let (uv, tint) = self.attributes(i, m);
            let opacity = (surface.at(uv, tint).1 * 255.0).round() as u8;
            covers(id, grid.0, grid.1, opacity).then_some(m)
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

    /// The triangle's own normal and the interpolated one, both turned as the own one faces the eye.
    fn normals(&self, i: usize, m: Meeting, direction: Vec3) -> (Vec3, Vec3) {
        let t = &self.triangles[i];
        let own = Vec3::from((t.v1 - t.v0).cross(t.v2 - t.v0)).normalize_or_zero();
        let sign = if own.dot(direction) > 0.0 { -1.0 } else { 1.0 };
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

    /// Factors on the base colour, with a ray to the sun and one to the sky.
    fn lit(&self, sun: &Sun, place: Vec3, own: Vec3, normal: Vec3, grid: (u32, u32)) -> [f32; 3] {
        let to_sun = sun.to_sun.as_vec3();
        let cos = normal.dot(to_sun);
        let sunlit = (cos > 0.0 || sun.translucency > 0.0) && {
            // Light on the far side starts from there.
            let from = if own.dot(to_sun) < 0.0 { place - own * (2.0 * LIFT) } else { place };
            self.is_free(from, to_sun, grid)
        };
        let [a, b] = [0, 1].map(|salt| {
            let hash = mix(mix(mix(grid.0) ^ grid.1.rotate_left(13)) ^ (0x51ed_270b + salt));
            (hash >> 8) as f32 / 16_777_216.0
        });
        let up = cosine_weighted(normal, a, b);
        let skylit = own.dot(up) > 0.0 && self.is_free(place, up, grid);
        sun.factors(normal, f32::from(sunlit), f32::from(skylit))
    }

    /// Whether nothing is hit on the way out.
    fn is_free(&self, from: Vec3, direction: Vec3, grid: (u32, u32)) -> bool {
        self.bvh.ray_traverse_miss(ray(from.into(), direction.into()), |ray, i| {
            self.meet(ray, i, grid).map_or(f32::INFINITY, |m| m.t)
        })
    }
}

/// A ray without negative zeros: the library takes the sign of −0 one way for the direction and the
/// other way for its inverse, and misses everything.
fn ray(origin: Vec3A, direction: Vec3A) -> Ray {
    Ray::new_inf(origin, direction + Vec3A::ZERO)
}

/// A direction about unit vector `n` with density cosine over π, from two uniform numbers.
fn cosine_weighted(n: Vec3, a: f32, b: f32) -> Vec3 {
    let (x, y) = n.any_orthonormal_pair();
    let (sin, cos) = (std::f32::consts::TAU * a).sin_cos();
    let r = b.sqrt();
    x * (r * cos) + y * (r * sin) + n * (1.0 - b).max(0.0).sqrt()
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
