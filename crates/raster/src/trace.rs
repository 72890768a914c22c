//! What all pictures by rays share: the rays of a camera, where they start, and the light on what
//! they hit.

use crate::canvas::Style;
use crate::light::Light;
use crate::opacity::mix;
use crate::picture::{Picture, PixelMean};
use crate::sampling::Pattern;
use forest_soup::{Camera, Projection};
use glam::{DVec3, Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::bvh2_to_cwbvh::bvh2_to_cwbvh;
use obvhs::ploc::PlocBuilder;
use obvhs::ray::Ray;
use obvhs::{Boundable, BvhBuildParams};
use rayon::prelude::*;

/// Width of what a hierarchy holds in the units of that hierarchy, within a factor of two.
const EXTENT: f64 = 1024.0;

/// Distance by which secondary rays start off their surface, in the units of its hierarchy.
pub(crate) const LIFT: f32 = 1e-5 * EXTENT as f32;

/// World units to units of a hierarchy around something of this extent, a power of two: the library
/// takes anything nearer than 10⁻⁴ to a ray's start for missed, so all is made about [`EXTENT`] wide.
pub(crate) fn units(extent: f64) -> f32 {
    match extent {
        extent if extent > 0.0 => {
            (EXTENT / extent).log2().floor().clamp(-120.0, 120.0).exp2() as f32
        }
        _ => 1.0,
    }
}

/// The hierarchy over `things`, with up to `leaf` (1 to 3) of them in a leaf.
///
/// The library's own steps one by one: its `build_cwbvh` ends, in debug builds, with a check that
/// allows boxes 10⁻⁵ of slack. At 1024 the last bit is 6·10⁻⁵, and grids as of terrains trip it.
pub(crate) fn hierarchy<T: Boundable>(things: &[T], leaf: u32) -> CwBvh {
    let params = BvhBuildParams::fast_build();
    let mut pairs = PlocBuilder::with_capacity(things.len()).build(
        params.ploc_search_distance,
        things,
        (0..things.len() as u32).collect(),
        params.sort_precision,
        params.search_depth_threshold,
    );
    ReinsertionOptimizer::default().run(&mut pairs, params.reinsertion_batch_ratio, None);
    bvh2_to_cwbvh(&pairs, leaf, true, false)
}

/// A ray without negative zeros: the library takes the sign of −0 one way for the direction and the
/// other way for its inverse, and misses everything.
pub(crate) fn ray(origin: Vec3A, direction: Vec3A) -> Ray {
    Ray::new_inf(origin, direction + Vec3A::ZERO)
}

/// The ray of a camera through a place in its picture.
pub(crate) struct View {
    /// Where it starts, from the eye, in world units.
    pub(crate) offset: DVec3,
    /// Unit vector.
    pub(crate) direction: DVec3,
    /// Depth that it gains per unit.
    pub(crate) slant: f64,
    /// Whether it sees what lies behind its start too, as those of parallel cameras do.
    pub(crate) endless: bool,
}

impl View {
    /// The ray through picture coordinates `at`.
    pub(crate) fn new(camera: &Camera, at: [f64; 2]) -> Self {
        let right = at[0] - f64::from(camera.width) * 0.5;
        let up = f64::from(camera.height) * 0.5 - at[1];
        let aside = (camera.right * right + camera.up * up) / camera.pixels_per_unit(1.0);
        match camera.projection {
            Projection::Orthographic { .. } => {
                Self { offset: aside, direction: camera.forward, slant: 1.0, endless: true }
            }
            Projection::Perspective { .. } => {
                let direction = camera.forward + aside;
                let slant = 1.0 / direction.length();
                let direction = direction * slant;
                Self { offset: DVec3::ZERO, direction, slant, endless: false }
            }
        }
    }
}

/// The ball around what a hierarchy holds, in its units.
pub(crate) struct Ball {
    center: DVec3,
    pub(crate) radius: f64,
}

impl Ball {
    /// The ball around a box; `None` around nothing.
    pub(crate) fn around(bounds: &Aabb) -> Option<Self> {
        let middle = (bounds.min + bounds.max) * 0.5;
        let radius = f64::from((bounds.max - bounds.min).length()) * 0.5;
        radius.is_finite().then(|| Self { center: Vec3::from(middle).as_dvec3(), radius })
    }

    /// How far along its direction (a unit vector) a ray should start: just before the ball, so that
    /// it meets what is in there where single precision is dense, but not before `nearest`. `None`
    /// if it misses the ball.
    #[inline]
    pub(crate) fn start(&self, from: DVec3, direction: DVec3, nearest: f64) -> Option<f64> {
        let to = self.center - from;
        let ahead = to.dot(direction);
        let reach = 1.001 * self.radius;
        let meets = (to - direction * ahead).length_squared() <= reach * reach;
        (meets && ahead + reach >= nearest).then(|| (ahead - reach).max(nearest))
    }
}

/// A sample of a picture.
pub(crate) struct Sample {
    /// Linear RGB.
    pub(crate) rgb: [f32; 3],
    /// Along the camera's axis, in world units.
    pub(crate) depth: f32,
    /// Unit normal towards the eye.
    pub(crate) normal: Vec3,
}

/// The window of `size` pixels from pixel `corner` of a picture; `sample` is asked at picture
/// coordinates and at those in the grid of samples.
pub(crate) fn window<F>(style: &Style, corner: [u32; 2], size: [u32; 2], sample: F) -> Picture
where
    F: Fn([f64; 2], (u32, u32)) -> Option<Sample> + Sync,
{
    let pattern = Pattern::new(style.sampling);
    let mut out = Picture::empty(size[0], size[1]);
    let share = 1.0 / pattern.count() as f32;
    let rows: Vec<Picture> = (corner[1]..corner[1] + size[1])
        .into_par_iter()
        .map(|y| {
            let mut row = Picture::empty(size[0], 1);
            for column in 0..size[0] {
                let x = corner[0] + column;
                let (xs, ys) = pattern.pixel(x, y);
                let mut mean = PixelMean::default();
                for s in 0..pattern.count() {
                    let at = [f64::from(x) + f64::from(xs[s]), f64::from(y) + f64::from(ys[s])];
                    if let Some(found) = sample(at, pattern.grid(x, y, s)) {
                        let [r, g, b] = found.rgb;
                        mean.add([r, g, b, 1.0], found.depth, found.normal.to_array(), share);
                    }
                }
                mean.store(&mut row, column as usize);
            }
            row
        })
        .collect();
    for (y, row) in rows.into_iter().enumerate() {
        let first = y * size[0] as usize;
        out.pixels[first..][..row.pixels.len()].copy_from_slice(&row.pixels);
        out.depth[first..][..row.depth.len()].copy_from_slice(&row.depth);
        out.normal[first..][..row.normal.len()].copy_from_slice(&row.normal);
    }
    out
}

/// What a ray sees where it hits.
pub(crate) struct Seen {
    /// Base colour, linear RGB.
    pub(crate) rgb: [f32; 3],
    /// Whether it shines by itself.
    pub(crate) unlit: bool,
    /// Share of the light's translucency.
    pub(crate) translucency: f32,
    /// The triangle's own normal, towards the eye.
    pub(crate) own: Vec3,
    /// The interpolated one, turned over if the triangle's own is.
    pub(crate) normal: Vec3,
}

impl Seen {
    /// Linear RGB under `light`, for sample `grid`. `is_free` casts a secondary ray: from the side
    /// that is turned to the eye (false) or the other (true), into a direction. It says whether
    /// nothing is hit on the way out.
    pub(crate) fn color(
        &self,
        light: &Light,
        grid: (u32, u32),
        is_free: impl Fn(bool, Vec3) -> bool,
    ) -> [f32; 3] {
        let Light::Sun(sun) = light else { return self.rgb };
        if self.unlit {
            return self.rgb;
        }
        let sun = sun.through(self.translucency);
        let to_sun = sun.to_sun.as_vec3();
        let cos = self.normal.dot(to_sun);
        // Light on the far side starts from there.
        let sunlit =
            (cos > 0.0 || sun.translucency > 0.0) && is_free(self.own.dot(to_sun) < 0.0, to_sun);
        let [a, b] = [0, 1].map(|salt| {
            let hash = mix(mix(mix(grid.0) ^ grid.1.rotate_left(13)) ^ (0x51ed_270b + salt));
            (hash >> 8) as f32 / 16_777_216.0
        });
        let up = cosine_weighted(self.normal, a, b);
        let skylit = self.own.dot(up) > 0.0 && is_free(false, up);
        let factors = sun.factors(self.normal, f32::from(sunlit), f32::from(skylit));
        std::array::from_fn(|k| self.rgb[k] * factors[k])
    }
}

/// A direction about unit vector `n` with density cosine over π, from two uniform numbers.
fn cosine_weighted(n: Vec3, a: f32, b: f32) -> Vec3 {
    let (x, y) = n.any_orthonormal_pair();
    let (sin, cos) = (std::f32::consts::TAU * a).sin_cos();
    let r = b.sqrt();
    x * (r * cos) + y * (r * sin) + n * (1.0 - b).max(0.0).sqrt()
}
