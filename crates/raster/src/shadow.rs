//! Shadow maps: what a sun sees.

use crate::canvas::Style;
use crate::light::Light;
use crate::mesh::rasterize;
use crate::sampling::Sampling;
use crate::surface::Surfaces;
use forest_soup::{Camera, Projection, TriangleSoup};
use glam::DVec3;

/// Texels along the side of a shadow map of one tree.
pub const SHADOW_SIDE: u32 = 1024;

/// What lies less far behind a shadow map's surface is lit, in half diagonals of what casts the shadow:
/// leaves of one spray do not shade each other.
pub const SHADOW_BIAS: f64 = 0.005;

/// Room about the box at rest, for what the wind bends out of it.
const ROOM: f64 = 1.1;

/// The parallel camera from which a sun sees all of a box.
pub fn sun_camera([min, max]: [DVec3; 2], to_sun: DVec3) -> Camera {
    let (middle, reach) = (0.5 * (min + max), ROOM * 0.5 * min.distance(max));
    let projection = Projection::Orthographic { height: 2.0 * reach };
    Camera::new(middle + to_sun * (2.0 * reach), -to_sun, projection, [SHADOW_SIDE; 2])
}

/// Depths of the surfaces that a sun sees first, one sample a texel.
#[derive(Clone, Debug, PartialEq)]
pub struct ShadowMap {
    camera: Camera,
    depth: Vec<f32>,
    bias: f64,
}

impl ShadowMap {
    /// What `soup`, in a box of these bounds, hides from a sun.
    ///
    /// # Panics
    /// If the soup breaks its own rules ([`TriangleSoup::validate`]).
    pub fn new(
        soup: &TriangleSoup,
        surfaces: &Surfaces,
        bounds: [DVec3; 2],
        to_sun: DVec3,
    ) -> Self {
        let camera = sun_camera(bounds, to_sun);
        let style = Style { sampling: Sampling::MIDDLE, light: Light::Albedo };
        let depth = rasterize(soup, surfaces, &camera, &style).depth;
        let bias = SHADOW_BIAS * 0.5 * bounds[0].distance(bounds[1]);
        Self { camera, depth, bias }
    }

    /// Whether the sun is seen from a place in the world: 1 or 0.
    pub fn seen(&self, place: DVec3) -> f32 {
        let (x, y, depth) = self.camera.project(place);
        let side = f64::from(SHADOW_SIDE);
        if !(0.0..side).contains(&x) || !(0.0..side).contains(&y) {
            return 1.0;
        }
        let surface = self.depth[y as usize * SHADOW_SIDE as usize + x as usize];
        f32::from(depth - self.bias < f64::from(surface))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use forest_soup::Material;
    use glam::Vec3;

    #[test]
    fn a_roof_shades_what_is_below_it_and_nothing_beside_it() {
        let soup = TriangleSoup {
            positions: [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
                .map(|[x, z]: [f32; 2]| Vec3::new(x, 2.0, z))
                .into(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            triangle_materials: vec![0; 2],
            materials: vec![Material::default()],
            ..TriangleSoup::default()
        };
        let surfaces = Surfaces::new(&soup.materials, &soup.textures);
        let bounds = [DVec3::new(-4.0, 0.0, -4.0), DVec3::new(4.0, 2.0, 4.0)];
        let to_sun = DVec3::new(-1.0, 1.0, 0.0).normalize();
        let map = ShadowMap::new(&soup, &surfaces, bounds, to_sun);
        for (place, want) in [
            // Its shadow lies two units to the east.
            (DVec3::new(2.0, 0.0, 0.0), 1.0 - 1.0),
            (DVec3::new(0.0, 0.0, 0.0), 1.0),
            (DVec3::new(0.0, 2.0, 0.0), 1.0),
            (DVec3::new(0.0, 3.0, 0.0), 1.0),
            (DVec3::new(90.0, 0.0, 0.0), 1.0),
        ] {
            assert_eq!(map.seen(place), want, "{place}");
        }
    }
}
