//! The window's camera: it goes around a point, and flies.

use forest_soup::{Camera, Projection};
use glam::DVec3;

/// Radians of a pixel that is dragged.
const TURN: f64 = 0.006;
/// Factor on the distance of a notch of the wheel.
const ZOOM: f64 = 0.88;
/// Room around a tree that fills the picture.
const MARGIN: f64 = 1.03;
/// Degrees that the picture is high.
const FOV: f64 = 40.0;

/// A camera that looks at a point.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Orbit {
    target: DVec3,
    /// Degrees: see [`Camera::around`].
    pub(crate) yaw: f64,
    pub(crate) pitch: f64,
    distance: f64,
    bounds: [DVec3; 2],
}

impl Orbit {
    /// Looks at a box from `angles`, `radii` half diagonals away; as near as shows all of it in a
    /// picture of this size without.
    pub(crate) fn new(
        bounds: [DVec3; 2],
        [yaw, pitch]: [f64; 2],
        radii: Option<f64>,
        size: [u32; 2],
    ) -> Self {
        let mut orbit = Self { target: DVec3::ZERO, yaw, pitch, distance: 1.0, bounds };
        orbit.fit(size);
        if let Some(radii) = radii {
            orbit.distance = radii * orbit.radius();
        }
        orbit
    }

    /// Shows all of the box, as large as it can be in a picture of this size.
    pub(crate) fn fit(&mut self, picture: [u32; 2]) {
        self.target = 0.5 * (self.bounds[0] + self.bounds[1]);
        let camera = self.camera([100, 100]);
        let tan = (0.5 * FOV.to_radians()).tan() / MARGIN;
        let aspect = f64::from(picture[0].max(1)) / f64::from(picture[1].max(1));
        // How far away each corner asks the eye to be.
        let asks = |i: usize| {
            let corner = DVec3::from_array([0, 1, 2].map(|k| self.bounds[i >> k & 1][k]));
            let off = corner - self.target;
            let aside = (off.dot(camera.right).abs() / aspect).max(off.dot(camera.up).abs());
            aside / tan - off.dot(camera.forward)
        };
        self.distance = (0..8).map(asks).fold(f64::MIN_POSITIVE, f64::max);
    }

    /// The box of another pack: the camera stays, unless the box is somewhere else.
    pub(crate) fn set_bounds(&mut self, bounds: [DVec3; 2], picture: [u32; 2]) {
        let near = |k: usize| bounds[k].distance(self.bounds[k]) < 0.1 * self.radius();
        let same = near(0) && near(1);
        self.bounds = bounds;
        if !same {
            self.fit(picture);
        }
    }

    pub(crate) fn camera(&self, size: [u32; 2]) -> Camera {
        let (yaw, pitch) = (self.yaw.to_radians(), self.pitch.to_radians());
        let from = DVec3::new(yaw.sin() * pitch.cos(), pitch.sin(), yaw.cos() * pitch.cos());
        let projection = Projection::Perspective { fov_y: FOV.to_radians() };
        Camera::new(self.target + from * self.distance, -from, projection, size)
    }

    pub(crate) fn turn(&mut self, [x, y]: [f64; 2]) {
        self.yaw = (self.yaw - (x * TURN).to_degrees()).rem_euclid(360.0);
        self.pitch = (self.pitch + (y * TURN).to_degrees()).clamp(-89.9, 89.9);
    }

    /// Moves the point that is looked at by pixels.
    pub(crate) fn pan(&mut self, [x, y]: [f64; 2], height: u32) {
        let camera = self.camera([height; 2]);
        let unit = 1.0 / camera.pixels_per_unit(self.distance);
        self.target += (camera.up * y - camera.right * x) * unit;
    }

    pub(crate) fn zoom(&mut self, notches: f64) {
        let limits = 1e-3 * self.radius()..=1e4 * self.radius();
        self.distance = (self.distance * ZOOM.powf(notches)).clamp(*limits.start(), *limits.end());
    }

    /// Flies: to the right, up and forward, in radii of the tree.
    pub(crate) fn fly(&mut self, [x, y, z]: [f64; 3]) {
        let camera = self.camera([100; 2]);
        let step = camera.right * x + camera.up * y + camera.forward * z;
        self.target += step * self.radius();
    }

    /// Half the diagonal of the box.
    fn radius(&self) -> f64 {
        (0.5 * self.bounds[0].distance(self.bounds[1])).max(f64::MIN_POSITIVE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fitting_shows_the_whole_box_from_everywhere() {
        let bounds = [DVec3::new(1e6, 0.0, -2.0), DVec3::new(1e6 + 3.0, 9.0, 2.0)];
        for angles in [[0.0, 0.0], [70.0, 30.0], [200.0, -60.0], [10.0, 89.0]] {
            for size in [[400, 400], [900, 300], [200, 700]] {
                let mut orbit = Orbit::new(bounds, angles, None, size);
                orbit.fly([0.3, 0.1, 2.0]);
                orbit.fit(size);
                let camera = orbit.camera(size);
                for i in 0..8 {
                    let corner = DVec3::from_array([0, 1, 2].map(|k| bounds[i >> k & 1][k]));
                    let (x, y, depth) = camera.project(corner);
                    let [width, height] = size.map(f64::from);
                    assert!((0.0..width).contains(&x) && (0.0..height).contains(&y) && depth > 0.0);
                }
            }
        }
    }

    #[test]
    fn panning_moves_the_point_with_the_pointer() {
        let mut orbit = Orbit::new([DVec3::ZERO, DVec3::ONE], [30.0, 20.0], Some(4.0), [300, 200]);
        let before = orbit.camera([300, 200]);
        let at = orbit.target;
        orbit.pan([10.0, -5.0], 200);
        let (x, y, _) = orbit.camera([300, 200]).project(at);
        assert!((x - 160.0).abs() < 1e-6 && (y - 95.0).abs() < 1e-6, "{x} {y}");
        assert_eq!(before.forward, orbit.camera([300, 200]).forward);
    }
}
