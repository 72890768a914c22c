//! Where a tree is looked at from: view directions that no bake knows, and parallel cameras that
//! show it at a stated height in pixels.

use forest_soup::{Camera, Projection, TriangleSoup};
use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A view direction.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct View {
    /// Unit vector from the tree towards the camera; y is up.
    pub to_camera: [f64; 3],
    /// Angle above the horizon in degrees.
    pub elevation: f64,
    /// The band that it lies in.
    pub band: Band,
}

impl View {
    /// The view after a turn about the vertical axis.
    pub(crate) fn turned(&self, degrees: f64) -> Self {
        let [x, y, z] = self.to_camera;
        let (sin, cos) = degrees.to_radians().sin_cos();
        Self { to_camera: [x * cos + z * sin, y, z * cos - x * sin], ..*self }
    }
}

/// Sine of the elevation at which views start: a little below the horizon.
const LOWEST_SIN: f64 = -0.1;

/// A range of elevations, for tables.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "lowercase")]
pub enum Band {
    /// Below 20°: trees as a walker sees them.
    Level,
    /// 20° to 50°.
    Oblique,
    /// Above 50°: from the air.
    High,
}

impl Band {
    /// Its lowest and highest elevation in degrees.
    pub fn range(self) -> [f32; 2] {
        match self {
            Self::Level => [LOWEST_SIN.asin().to_degrees().floor() as f32, 20.0],
            Self::Oblique => [20.0, 50.0],
            Self::High => [50.0, 90.0],
        }
    }

    /// The band of an elevation in degrees.
    pub fn of(elevation: f64) -> Self {
        match elevation {
            e if e < 20.0 => Self::Level,
            e if e < 50.0 => Self::Oblique,
            _ => Self::High,
        }
    }
}

/// `count` view directions from a little below the horizon to the zenith, spread evenly over that
/// part of the sphere: sin(elevation) in equal steps from −0.1 to 1, azimuths turning by the golden
/// angle from an odd start, so that they meet no ring, grid or axis that a bake might use.
pub fn held_out_views(count: u32) -> Vec<View> {
    views_from(count, 0.5, 1.234_567)
}

/// Such views from another start: `offset` in `0..1` of a step in elevation, `azimuth` in radians.
pub(crate) fn views_from(count: u32, offset: f64, azimuth: f64) -> Vec<View> {
    (0..count)
        .map(|i| {
            let sin = LOWEST_SIN + (1.0 - LOWEST_SIN) * (f64::from(i) + offset) / f64::from(count);
            let azimuth = azimuth + f64::from(i) * 2.399_963_229_728_653;
            let flat = (1.0 - sin * sin).sqrt();
            let elevation = sin.asin().to_degrees();
            View {
                to_camera: [azimuth.sin() * flat, sin, azimuth.cos() * flat],
                elevation,
                band: Band::of(elevation),
            }
        })
        .collect()
}

/// A tree's place and size, and the pictures that show all of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Middle of its box, in the world.
    pub center: DVec3,
    /// Half the diagonal of its box.
    pub radius: f64,
    /// The longest side of its box: what "pixel height" measures.
    pub height: f64,
}

impl Frame {
    /// The frame of what is finite of a soup; `None` if nothing of it has an extent.
    pub fn of(soup: &TriangleSoup) -> Option<Self> {
        let bounds = soup.bounds();
        if bounds.is_empty() {
            return None;
        }
        let size = bounds.size();
        (size.max_element() > 0.0).then(|| Self {
            center: soup.origin + bounds.center(),
            radius: bounds.half_diagonal(),
            height: size.max_element(),
        })
    }

    /// Side of a picture that shows the tree `height` pixels high from everywhere: a multiple of
    /// `multiple`.
    pub fn side(&self, height: f64, multiple: u32) -> u32 {
        let diameter = 2.0 * self.radius / self.height * height;
        ((diameter.ceil() as u32) + 2).next_multiple_of(multiple)
    }

    /// A parallel camera on `view` whose pictures of `side` pixels show the tree `height` pixels
    /// high.
    pub fn camera(&self, view: &View, height: f64, side: u32) -> Camera {
        let from = DVec3::from_array(view.to_camera);
        let span = f64::from(side) / height * self.height;
        let eye = self.center + from * (2.0 * self.radius);
        Camera::new(eye, -from, Projection::Orthographic { height: span }, [side; 2])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use forest_soup::Material;
    use glam::Vec3;

    #[test]
    fn views_fall_into_all_bands_and_are_unit() {
        let views = held_out_views(8);
        for band in [Band::Level, Band::Oblique, Band::High] {
            assert!(views.iter().any(|v| v.band == band), "{band:?}");
        }
        for v in views {
            let d = DVec3::from_array(v.to_camera);
            assert!((d.length() - 1.0).abs() < 1e-12);
            assert!((d.y.asin().to_degrees() - v.elevation).abs() < 1e-9);
        }
    }

    #[test]
    fn cameras_show_all_of_the_tree_at_the_stated_height() {
        let soup = TriangleSoup {
            origin: DVec3::new(1e6, 0.0, 0.0),
            positions: vec![Vec3::ZERO, Vec3::new(2.0, 8.0, 1.0), Vec3::Y, Vec3::NAN],
            triangles: vec![[0, 1, 2], [0, 1, 3]],
            triangle_materials: vec![0; 2],
            materials: vec![Material::default()],
            ..TriangleSoup::default()
        };
        let frame = Frame::of(&soup).unwrap();
        assert_eq!((frame.height, frame.center), (8.0, DVec3::new(1e6 + 1.0, 4.0, 0.5)));
        let side = frame.side(100.0, 16);
        assert!(side.is_multiple_of(16) && side >= 104, "{side}");
        let c = frame.camera(&held_out_views(1)[0], 100.0, side);
        assert!((c.pixels_per_unit(0.0) - 12.5).abs() < 1e-9);
        for p in [DVec3::new(1e6, 0.0, 0.0), DVec3::new(1e6 + 2.0, 8.0, 1.0)] {
            let (x, y, depth) = c.project(p);
            assert!(
                x > 0.0 && y > 0.0 && x < f64::from(side) && y < f64::from(side) && depth > 0.0
            );
        }
    }
}
