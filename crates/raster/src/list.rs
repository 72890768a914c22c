//! What a canvas draws: triangles, ellipses and sprites, projected.

use crate::plane::{Edges, Plane};
use crate::shadow::ShadowMap;
use crate::sprite::Sprite;
use crate::surface::{Surface, Surfaces};
use forest_soup::{Camera, Projection, Tangents};
use glam::{DVec2, DVec3, IVec2, Vec2, Vec3};
use std::sync::Arc;

/// A corner of a triangle in the world.
#[derive(Clone, Copy, Debug)]
pub struct Corner {
    /// World position.
    pub position: DVec3,
    /// Unit normal, or zero to use the triangle's own.
    pub normal: Vec3,
    /// Texture coordinates, v down.
    pub uv: Vec2,
    /// Linear RGBA that multiplies the material.
    pub color: [f32; 4],
    /// Share of the sun that is estimated to be seen ([`crate::Sun::seen`]); 1 for all.
    pub sunlit: f32,
    /// Share of the sky that is seen; 1 for all.
    pub skylit: f32,
}

/// An ellipse in the picture plane, all at one depth: a point of a LOD, or a particle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipse {
    /// Stable number for the hash rule of opacity.
    pub id: u32,
    /// Middle, in pixels.
    pub center: DVec2,
    /// Larger semi-axis in pixels.
    pub radius: f64,
    /// Unit direction of the smaller semi-axis.
    pub minor: DVec2,
    /// Smaller over larger semi-axis, in `0..=1`, not 0.
    pub ratio: f64,
    /// Distance along the camera's forward axis, in world units.
    pub depth: f64,
    /// Opacity · 255.
    pub opacity: u8,
    /// Linear RGB, lit.
    pub rgb: [f32; 3],
    /// Unit normal towards the eye.
    pub normal: Vec3,
}

impl Ellipse {
    /// First and last pixel of the box around it.
    pub(crate) fn pixels(&self) -> (IVec2, IVec2) {
        let flat = 1.0 - self.ratio * self.ratio;
        let extent = |m: f64| self.radius * (1.0 - m * m * flat).max(0.0).sqrt();
        let half = DVec2::new(extent(self.minor.x), extent(self.minor.y));
        // `as` saturates: what is not finite lies outside of every picture, or covers it.
        let pixel = |v: DVec2| v.floor().as_ivec2();
        (pixel(self.center - half), pixel(self.center + half))
    }
}

/// A triangle as a canvas draws it.
#[derive(Clone, Debug)]
pub(crate) struct Triangle<'a> {
    pub(crate) id: u32,
    /// First and last pixel of the box around it.
    pub(crate) min: IVec2,
    pub(crate) max: IVec2,
    pub(crate) edges: Edges,
    /// Grows with depth, linear in the picture: depth itself, or −1/depth in perspective.
    pub(crate) key: Plane,
    pub(crate) key_range: [f32; 2],
    /// 1 for parallel projection, else 1/depth: attributes over depth are linear in the picture.
    inverse_w: [f32; 3],
    uvs: [Vec2; 3],
    colors: Option<Box<[[f32; 4]; 3]>>,
    /// Towards the eye.
    normals: [Vec3; 3],
    relief: Option<Box<Bumps>>,
    sunlit: [f32; 3],
    skylit: [f32; 3],
    pub(crate) surface: &'a Surface,
}

/// What turns a triangle's normals.
#[derive(Clone, Copy, Debug)]
struct Bumps {
    tangents: Tangents,
    /// Its front is seen.
    front: bool,
}

/// Projects into one camera's picture.
#[derive(Clone, Copy, Debug)]
pub struct Projector<'a> {
    camera: &'a Camera,
    /// Nearest distance at which a perspective camera sees.
    near: f64,
}

impl<'a> Projector<'a> {
    /// A projector for `camera`; a perspective one sees nothing nearer than `near` world units.
    pub fn new(camera: &'a Camera, near: f64) -> Self {
        Self { camera, near }
    }

    /// Whether something at `depth` is behind the eye.
    pub fn is_behind(&self, depth: f64) -> bool {
        matches!(self.camera.projection, Projection::Perspective { .. }) && depth <= self.near
    }

    /// The part of a triangle before a perspective eye (Sutherland, Hodgman 1974): three or four
    /// corners, or none.
    fn clipped(&self, corners: [Corner; 3]) -> ([Corner; 4], usize) {
        let depth = |c: &Corner| (c.position - self.camera.eye).dot(self.camera.forward);
        let [a, b, c] = corners;
        let mut out = [a, b, c, c];
        if corners.iter().all(|c| !self.is_behind(depth(c))) {
            return (out, 3);
        }
        let mut n = 0;
        for k in 0..3 {
            let (a, b) = (&corners[k], &corners[(k + 1) % 3]);
            let (da, db) = (depth(a), depth(b));
            let (a_seen, b_seen) = (da > self.near, db > self.near);
            if a_seen {
                out[n] = *a;
                n += 1;
            }
            if a_seen != b_seen {
                // From the seen to the unseen end, whichever way the edge is walked: both of its
                // triangles get the same corner.
                let (seen, hidden, ds, dh) = if a_seen { (a, b, da, db) } else { (b, a, db, da) };
                out[n] = seen.lerp(hidden, (self.near - ds) / (dh - ds));
                n += 1;
            }
        }
        (out, n)
    }
}

impl Corner {
    fn lerp(&self, other: &Self, t: f64) -> Self {
        let f = t as f32;
        Self {
            position: self.position.lerp(other.position, t),
            normal: self.normal.lerp(other.normal, f),
            uv: self.uv.lerp(other.uv, f),
            color: std::array::from_fn(|k| self.color[k] + (other.color[k] - self.color[k]) * f),
            sunlit: self.sunlit + (other.sunlit - self.sunlit) * f,
            skylit: self.skylit + (other.skylit - self.skylit) * f,
        }
    }
}

/// What a canvas draws. The order does not matter but for things of one and the same depth, where
/// the earlier wins, triangles go first and sprites last.
#[derive(Clone, Debug, Default)]
pub struct DisplayList<'a> {
    pub(crate) triangles: Vec<Triangle<'a>>,
    pub(crate) ellipses: Vec<Ellipse>,
    pub(crate) sprites: Vec<Arc<dyn Sprite + 'a>>,
    pub(crate) shadow: Option<Arc<ShadowMap>>,
}

impl<'a> DisplayList<'a> {
    /// A list of ellipses.
    pub fn of_ellipses(ellipses: Vec<Ellipse>) -> Self {
        Self { ellipses, ..Self::default() }
    }

    /// Adds a sprite.
    pub fn sprite(&mut self, sprite: Arc<dyn Sprite + 'a>) {
        self.sprites.push(sprite);
    }

    /// The ellipses, to be changed.
    pub fn ellipses_mut(&mut self) -> &mut [Ellipse] {
        &mut self.ellipses
    }

    /// Adds what is before the eye of a triangle of material `material`; nothing for a material
    /// that is not in `surfaces`, and nothing for corners that are not finite. `id` is its stable
    /// number for the hash rule of opacity.
    pub fn triangle(
        &mut self,
        projector: &Projector,
        surfaces: &'a Surfaces,
        material: u16,
        id: u32,
        corners: [Corner; 3],
    ) {
        let Some(surface) = surfaces.get(material) else { return };
        if !corners.iter().all(|c| c.position.is_finite()) {
            return;
        }
        let (corners, n) = projector.clipped(corners);
        for k in 1..n.max(2) - 1 {
            let part = [corners[0], corners[k], corners[k + 1]];
            self.triangles.extend(Triangle::new(projector.camera, surface, id, part));
        }
    }

    /// Shades the triangles by a map.
    pub fn shade(&mut self, map: Arc<ShadowMap>) {
        self.shadow = Some(map);
    }

    /// Adds another list after this one.
    pub fn append(&mut self, mut other: Self) {
        self.triangles.append(&mut other.triangles);
        self.ellipses.append(&mut other.ellipses);
        self.sprites.append(&mut other.sprites);
    }
}

/// What covers a sample.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fragment {
    pub(crate) rgb: [f32; 3],
    /// Towards the eye.
    pub(crate) normal: Vec3,
    pub(crate) unlit: bool,
    /// Share of it that faces all ways.
    pub(crate) scattered: f32,
    /// Share of the light's translucency.
    pub(crate) translucency: f32,
    /// Shadow maps shade it.
    pub(crate) shadowed: bool,
    /// Share of the sun that is seen from there.
    pub(crate) sunlit: f32,
    /// Share of the sky that is seen from there.
    pub(crate) sky: f32,
}

impl Fragment {
    /// A colour as it is.
    pub(crate) fn unlit(rgb: [f32; 3]) -> Self {
        let (unlit, scattered, shadowed) = (true, 0.0, false);
        let [translucency, sunlit, sky] = [1.0; 3];
        Self { rgb, normal: Vec3::ZERO, unlit, scattered, translucency, shadowed, sunlit, sky }
    }
}

impl<'a> Triangle<'a> {
    /// `None` where nothing of it can be seen.
    fn new(
        camera: &Camera,
        surface: &'a Surface,
        id: u32,
        corners: [Corner; 3],
    ) -> Option<Triangle<'a>> {
        let projected = corners.map(|c| camera.project(c.position));
        let at = projected.map(|(x, y, _)| DVec2::new(x, y));
        let min = at[0].min(at[1]).min(at[2]);
        let max = at[0].max(at[1]).max(at[2]);
        let size = DVec2::new(f64::from(camera.width), f64::from(camera.height));
        if max.x < 0.0 || max.y < 0.0 || min.x >= size.x || min.y >= size.y {
            return None;
        }
        let edges = Edges::new(at)?;
        let parallel = matches!(camera.projection, Projection::Orthographic { .. });
        let keys = projected.map(|(_, _, d)| if parallel { d } else { -1.0 / d });
        let [a, b, c] = corners.map(|c| c.position);
        let own = (b - a).cross(c - a).normalize_or_zero();
        let away = own.dot(camera.to_eye(a)) < 0.0;
        let normals = corners.map(|c| {
            let n = if c.normal == Vec3::ZERO { own.as_vec3() } else { c.normal };
            if away { -n } else { n }
        });
        let relief = surface.relief().and_then(|_| {
            let places = [DVec3::ZERO, b - a, c - a].map(|p| p.as_vec3());
            let tangents = Tangents::new(places, corners.map(|c| c.uv))?;
            Some(Box::new(Bumps { tangents, front: !away }))
        });
        let plain = corners.iter().all(|c| c.color == [1.0; 4]);
        Some(Self {
            id,
            min: min.floor().as_ivec2(),
            max: max.floor().as_ivec2(),
            key: edges.interpolate(keys),
            key_range: [
                keys.iter().copied().fold(f64::INFINITY, f64::min) as f32,
                keys.iter().copied().fold(f64::NEG_INFINITY, f64::max) as f32,
            ],
            edges,
            inverse_w: projected.map(|p| if parallel { 1.0 } else { (1.0 / p.2) as f32 }),
            uvs: corners.map(|c| c.uv),
            colors: (!plain).then(|| Box::new(corners.map(|c| c.color))),
            normals,
            relief,
            sunlit: corners.map(|c| c.sunlit),
            skylit: corners.map(|c| c.skylit),
            surface,
        })
    }

    /// Weights of the corners' attributes, from the edge functions or multiples of them.
    #[inline]
    fn weights(&self, edges: [f32; 3]) -> [f32; 3] {
        let w: [f32; 3] = std::array::from_fn(|k| edges[k] * self.inverse_w[k]);
        let scale = 1.0 / (w[0] + w[1] + w[2]);
        w.map(|v| v * scale)
    }

    #[inline]
    fn uv(&self, w: [f32; 3]) -> Vec2 {
        self.uvs[0] * w[0] + self.uvs[1] * w[1] + self.uvs[2] * w[2]
    }

    #[inline]
    fn tint(&self, w: [f32; 3]) -> [f32; 4] {
        self.colors.as_ref().map_or([1.0; 4], |colors| {
            std::array::from_fn(|k| colors[0][k] * w[0] + colors[1][k] * w[1] + colors[2][k] * w[2])
        })
    }

    /// Coverage in `0..=1` where the edge functions have these values.
    #[inline]
    pub(crate) fn coverage(&self, edges: [f32; 3]) -> f32 {
        let w = self.weights(edges);
        self.surface.coverage(self.uv(w), self.tint(w)[3])
    }

    /// What is seen at picture coordinates (x, y).
    pub(crate) fn shade(&self, x: f64, y: f64) -> Fragment {
        let w = self.weights(self.edges.weights(x, y).map(|w| w as f32));
        let [a, b, c] = self.normals;
        let uv = self.uv(w);
        let normal = (a * w[0] + b * w[1] + c * w[2]).normalize_or_zero();
        Fragment {
            rgb: self.surface.at(uv, self.tint(w)).0,
            normal: match (&self.relief, self.surface.relief()) {
                (Some(bumps), Some(map)) => {
                    bumps.tangents.turn(normal, bumps.front, map.sample(uv, 1.0))
                }
                _ => normal,
            },
            unlit: self.surface.is_unlit(),
            scattered: f32::from(self.surface.is_scattered()),
            translucency: self.surface.translucency(),
            shadowed: true,
            sunlit: self.sunlit[0] * w[0] + self.sunlit[1] * w[1] + self.sunlit[2] * w[2],
            sky: self.skylit[0] * w[0] + self.skylit[1] * w[1] + self.skylit[2] * w[2],
        }
    }
}
