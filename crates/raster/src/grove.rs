//! Many instances of a few soups by rays: the truth of landscapes.
//!
//! Two levels: a hierarchy over the boxes of all instances, and each kind's own [`RayScene`], into
//! whose units every ray that may meet an instance is taken. Places and directions are turned in
//! double precision and rounded just before the instance, so that it does not matter how far from
//! the origin or from the eye it stands. Hits are shaded as [`RayScene`] shades them.

use crate::canvas::Style;
use crate::opacity::mix;
use crate::picture::Picture;
use crate::rays::{Hit, RayScene};
use crate::surface::Surfaces;
use crate::trace::{Ball, LIFT, Sample, Seen, View, hierarchy, ray, units, window};
use forest_soup::{Bounds, Camera, TriangleSoup};
use glam::{DVec3, Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::cwbvh::CwBvh;
use obvhs::ray::{Ray, RayHit};
use rayon::prelude::*;

/// One instance: kind `kind`, turned by `yaw` about +Y, scaled by `scale`, with its kind's anchor
/// at `position`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Planted {
    /// Number of the kind.
    pub kind: u32,
    /// Where the anchor is put, in world units.
    pub position: DVec3,
    /// Radians, counter-clockwise seen from above: x' = x·cos + z·sin, z' = −x·sin + z·cos.
    pub yaw: f64,
    /// World units to one of the soup's, > 0.
    pub scale: f64,
}

/// A kind of thing that is planted.
#[derive(Clone, Copy)]
pub struct Kind<'a> {
    /// What it looks like.
    pub soup: &'a TriangleSoup,
    /// Those of the soup's materials.
    pub surfaces: &'a Surfaces,
    /// The point that is put at an instance's position, in the world of the soup (with its origin).
    pub anchor: DVec3,
}

/// Instances of a few soups, ready to be seen by rays.
pub struct Grove<'a> {
    kinds: Vec<Species<'a>>,
    /// In the order of the hierarchy's leaves.
    instances: Vec<Instance>,
    /// Over their boxes, about `middle`.
    bvh: CwBvh,
    /// Around the hierarchy; `None` if it is empty.
    ball: Option<Ball>,
    /// World position of the hierarchy's zero.
    middle: DVec3,
    /// World units to units of the hierarchy.
    units: f64,
}

/// No box reaches farther than this, in world units: their sizes stay within single precision.
const FARTHEST: f64 = 1e30;

/// What is added to boxes of instances, in units of the hierarchy: more than rays and boxes in single
/// precision are off (about 5·10⁻⁴ of 1024), and than the library needs in front of a ray's start.
///
/// It varies, by up to half, with the `number` of the side of a box: the library pairs what is nearest
/// to each other, and over 10⁵ equal boxes, all equally near, takes minutes and overflows its stack.
fn margin(number: u32) -> Vec3A {
    let share = |k: u32| (mix(number ^ k << 30) >> 8) as f32 / 16_777_216.0;
    (Vec3A::new(share(0), share(1), share(2)) + 2.0) * 1e-3
}

/// A kind, ready.
struct Species<'a> {
    scene: RayScene<'a>,
    /// The anchor about the soup's zero, in units of the scene.
    foot: DVec3,
    /// The box of the triangles about the foot, in units of the scene.
    bounds: Bounds,
    /// Distance of the farthest corner from the upright axis through the foot: a turned box is
    /// wider than what a round thing in it needs.
    radius: f64,
}

/// An instance, ready.
#[derive(Clone, Copy)]
struct Instance {
    position: DVec3,
    cos: f64,
    sin: f64,
    /// World units to units of its kind's scene.
    units: f64,
    kind: u32,
    /// Number in the list of what was planted.
    number: u32,
}

/// A ray in the world.
#[derive(Clone, Copy)]
struct Line {
    from: DVec3,
    /// Unit vector.
    direction: DVec3,
    /// What is nearer is not seen; in world units, may be −∞.
    nearest: f64,
}

/// What a ray of the grove hits.
struct Found {
    /// In world units from the ray's start.
    distance: f64,
    /// Place of the instance in the hierarchy.
    instance: usize,
    /// On its kind.
    hit: Hit,
    /// Of the ray, as the kind sees it.
    direction: Vec3,
}

impl<'a> Grove<'a> {
    /// Builds the hierarchies. What is planted of a kind that is not there, with a scale that is not
    /// above zero, or at a place that is not finite or beyond 10³⁰, is left out, and so are
    /// triangles with corners that are not finite.
    ///
    /// # Panics
    /// If a soup breaks its own rules ([`TriangleSoup::validate`]).
    pub fn new(kinds: &[Kind<'a>], planted: &[Planted]) -> Self {
        let kinds: Vec<Species> = kinds.par_iter().map(Species::new).collect();
        let all: Vec<Instance> = planted
            .par_iter()
            .zip(0..planted.len() as u32)
            .filter_map(|(p, number)| Instance::new(&kinds, p, number))
            .collect();
        let bounds = |i: &Instance| i.bounds(&kinds[i.kind as usize]);
        let around = all.par_iter().map(bounds).reduce(|| Bounds::EMPTY, Bounds::union);
        let (middle, extent) = match around.is_empty() {
            true => (DVec3::ZERO, 0.0),
            false => (around.center(), around.size().max_element()),
        };
        let units = f64::from(units(extent));
        let boxes: Vec<Aabb> = all
            .par_iter()
            .map(|i| {
                let Bounds { min, max } = bounds(i);
                let [min, max] = [min, max].map(|p| ((p - middle) * units).as_vec3a());
                let [below, above] = [0, 1].map(|side| margin(2 * i.number + side));
                Aabb::new(min - below, max + above)
            })
            .collect();
        // Instances cost far more than nodes: one in a leaf.
        let mut bvh = hierarchy(&boxes, 1);
        let order = std::mem::take(&mut bvh.primitive_indices);
        let instances = order.into_iter().map(|i| all[i as usize]).collect();
        let ball = Ball::around(&bvh.total_aabb);
        Self { kinds, instances, bvh, ball, middle, units }
    }

    /// What `camera` sees in the window of `size` pixels from pixel `corner` of its picture, with the
    /// shadows that `style`'s sun casts: just what the whole picture shows there.
    pub fn picture(
        &self,
        camera: &Camera,
        style: &Style,
        corner: [u32; 2],
        size: [u32; 2],
    ) -> Picture {
        window(style, corner, size, |at, grid| self.sample(camera, style, at, grid))
    }

    /// What the ray through picture coordinates `at` sees.
    fn sample(
        &self,
        camera: &Camera,
        style: &Style,
        at: [f64; 2],
        grid: (u32, u32),
    ) -> Option<Sample> {
        let View { offset, direction, slant, endless } = View::new(camera, at);
        let nearest = if endless { f64::NEG_INFINITY } else { 0.0 };
        let line = Line { from: camera.eye + offset, direction, nearest };
        let found = self.nearest(&line, grid)?;
        let instance = &self.instances[found.instance];
        let seen = self.kinds[instance.kind as usize].scene.seen(found.hit, found.direction)?;
        let (own, normal) = (instance.turned(seen.own), instance.turned(seen.normal));
        let seen = Seen { own, normal, ..seen };
        let place = line.from + line.direction * found.distance;
        let lift = own.as_dvec3() * (f64::from(LIFT) / instance.units);
        let rgb = seen.color(&style.light, grid, |behind, direction| {
            let line = Line { from: place, direction: direction.as_dvec3(), nearest: 0.0 };
            let lift = if behind { -lift } else { lift };
            self.is_free(&line, (found.instance, lift), grid)
        });
        Some(Sample { rgb, depth: (found.distance * slant) as f32, normal })
    }

    /// The first that is hit.
    fn nearest(&self, line: &Line, grid: (u32, u32)) -> Option<Found> {
        let (ray, start) = self.ray(line)?;
        let mut first: Option<Found> = None;
        self.bvh.ray_traverse(ray, &mut RayHit::none(), |_, i| {
            let within = first.as_ref().map_or(f64::INFINITY, |f| f.distance);
            let Some(found) = self.meet(i, line, within, grid) else { return f32::INFINITY };
            let t = (found.distance - start) * self.units;
            first = Some(found);
            t as f32
        });
        first
    }

    /// Whether nothing is hit on the way out from a surface of instance `own.0`. For that one alone
    /// the ray starts `own.1` off: a wide terrain needs more of that than what stands on it is high.
    fn is_free(&self, line: &Line, own: (usize, DVec3), grid: (u32, u32)) -> bool {
        let Some((ray, _)) = self.ray(line) else { return true };
        let lifted = Line { from: line.from + own.1, ..*line };
        self.bvh.ray_traverse_miss(ray, |_, i| {
            let instance = &self.instances[i];
            let kind = &self.kinds[instance.kind as usize];
            let line = if i == own.0 { &lifted } else { line };
            let free = kind
                .ray(instance, line)
                .is_none_or(|(ray, _)| kind.scene.is_free(ray, instance.salt(), grid));
            if free { f32::INFINITY } else { 0.0 }
        })
    }

    /// The ray in units of the hierarchy, and how far along the line it starts in world units.
    fn ray(&self, line: &Line) -> Option<(Ray, f64)> {
        let from = (line.from - self.middle) * self.units;
        start(self.ball.as_ref()?, from, line.direction, line.nearest, self.units)
    }

    /// What the line hits of instance `i`, nearer than `within`.
    fn meet(&self, i: usize, line: &Line, within: f64, grid: (u32, u32)) -> Option<Found> {
        let instance = &self.instances[i];
        let kind = &self.kinds[instance.kind as usize];
        let (mut ray, start) = kind.ray(instance, line)?;
        ray.tmax = ((within - start) * instance.units) as f32;
        if ray.tmax <= 0.0 {
            return None;
        }
        let hit = kind.scene.nearest(ray, instance.salt(), grid)?;
        let distance = start + f64::from(hit.distance()) / instance.units;
        let direction = ray.direction.into();
        (distance < within).then_some(Found { distance, instance: i, hit, direction })
    }
}

impl<'a> Species<'a> {
    fn new(kind: &Kind<'a>) -> Self {
        let scene = RayScene::new(kind.soup, kind.surfaces);
        let foot = (kind.anchor - kind.soup.origin) * f64::from(scene.units());
        let (mut bounds, mut square) = (Bounds::EMPTY, 0.0f64);
        for corner in scene.corners() {
            let p = Vec3::from(corner).as_dvec3() - foot;
            bounds = bounds.with(p);
            square = square.max(p.x * p.x + p.z * p.z);
        }
        Self { scene, foot, bounds, radius: square.sqrt() }
    }

    /// The ray in units of the scene, and how far along the line it starts in world units.
    #[inline]
    fn ray(&self, instance: &Instance, line: &Line) -> Option<(Ray, f64)> {
        let from = instance.back(line.from - instance.position) * instance.units + self.foot;
        let direction = instance.back(line.direction);
        start(self.scene.ball()?, from, direction, line.nearest, instance.units)
    }
}

/// The ray of a hierarchy along a line, whose `nearest` is in world units, and how far along it
/// starts, in world units too.
#[inline]
fn start(
    ball: &Ball,
    from: DVec3,
    direction: DVec3,
    nearest: f64,
    units: f64,
) -> Option<(Ray, f64)> {
    let ahead = ball.start(from, direction, nearest * units)?;
    let origin = (from + direction * ahead).as_vec3a();
    Some((ray(origin, direction.as_vec3a()), ahead / units))
}

impl Instance {
    /// `None` for what is left out.
    fn new(kinds: &[Species], planted: &Planted, number: u32) -> Option<Self> {
        let &Planted { kind, position, yaw, scale } = planted;
        let species = kinds.get(kind as usize)?;
        species.scene.ball()?;
        let (sin, cos) = yaw.sin_cos();
        let units = f64::from(species.scene.units()) / scale;
        let instance = Self { position, cos, sin, units, kind, number };
        let Bounds { min, max } = instance.bounds(species);
        let finite = |p: DVec3| p.abs().cmplt(DVec3::splat(FARTHEST)).all();
        let good = scale > 0.0 && units > 0.0 && finite(min) && finite(max);
        good.then_some(instance)
    }

    /// The box around it in the world.
    fn bounds(&self, species: &Species) -> Bounds {
        let (Bounds { min, max }, round) = (species.bounds, species.radius);
        // Ends of the interval of a·x + b·z.
        let turned = |a: f64, b: f64| {
            let (x, z) = ([a * min.x, a * max.x], [b * min.z, b * max.z]);
            let low = x[0].min(x[1]) + z[0].min(z[1]);
            let high = x[0].max(x[1]) + z[0].max(z[1]);
            [low.max(-round), high.min(round)]
        };
        let (x, z) = (turned(self.cos, self.sin), turned(-self.sin, self.cos));
        let place = |p: DVec3| self.position + p / self.units;
        Bounds {
            min: place(DVec3::new(x[0], min.y, z[0])),
            max: place(DVec3::new(x[1], max.y, z[1])),
        }
    }

    /// What triangles' numbers are mixed with, so that no two instances cover the same samples.
    fn salt(&self) -> u32 {
        mix(self.number)
    }

    /// A direction in the world as the kind sees it.
    #[inline]
    fn back(&self, v: DVec3) -> DVec3 {
        let Self { cos, sin, .. } = *self;
        DVec3::new(v.x * cos - v.z * sin, v.y, v.x * sin + v.z * cos)
    }

    /// A direction of the kind in the world.
    fn turned(&self, v: Vec3) -> Vec3 {
        let Self { cos, sin, .. } = *self;
        if cos == 1.0 {
            return v; // with the signs of its zeros, which draws of the sky depend on
        }
        let v = v.as_dvec3();
        DVec3::new(v.x * cos + v.z * sin, v.y, v.z * cos - v.x * sin).as_vec3()
    }
}

#[cfg(test)]
mod tests;
