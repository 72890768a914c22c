//! Where a picture is taken from: shared by the baker's `select`, the renderers and the viewer.

use glam::DVec3;

/// How the world is projected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Parallel rays; the picture is `height` world units tall.
    Orthographic {
        /// Height of the picture in world units, > 0.
        height: f64,
    },
    /// Rays through a point; the picture is `fov_y` radians tall.
    Perspective {
        /// Vertical field of view in radians, in `0..π`.
        fov_y: f64,
    },
}

/// A camera: a place, a right-handed frame and a projection onto `width × height` pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Where the eye is, in world units. An orthographic eye only fixes depth zero.
    pub eye: DVec3,
    /// Unit vector to the right of the picture.
    pub right: DVec3,
    /// Unit vector to the top of the picture.
    pub up: DVec3,
    /// Unit vector into the picture: `up × right`.
    pub forward: DVec3,
    /// The projection.
    pub projection: Projection,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
}

impl Camera {
    /// A camera at `eye` that looks along `forward`; the picture's top is as near to +Y as it can
    /// be (to −Z when looking straight down, +Z straight up).
    pub fn new(eye: DVec3, forward: DVec3, projection: Projection, size: [u32; 2]) -> Self {
        let forward = forward.normalize();
        let pole =
            if forward.y.abs() > 0.999_999 { DVec3::Z * forward.y.signum() } else { DVec3::Y };
        let right = forward.cross(pole).normalize();
        let up = right.cross(forward);
        Self { eye, right, up, forward, projection, width: size[0], height: size[1] }
    }

    /// A camera that shows the box from `min` to `max` as large as it can be. It stands at `angles`, yaw
    /// and pitch in degrees: 0, 0 is before the box (+Z), yaw 90 to its right (+X), pitch 90 above it.
    /// It is parallel, or at `distance` half diagonals of the box from its middle.
    pub fn around(
        [min, max]: [DVec3; 2],
        [yaw, pitch]: [f64; 2],
        distance: Option<f64>,
        size: [u32; 2],
    ) -> Self {
        let (yaw, pitch) = (yaw.to_radians(), pitch.to_radians());
        let from = DVec3::new(yaw.sin() * pitch.cos(), pitch.sin(), yaw.cos() * pitch.cos());
        let (center, radius) = ((min + max) * 0.5, (max - min).length() * 0.5);
        // Down to the shorter side of the picture.
        let aspect = f64::from(size[0]) / f64::from(size[1].max(1));
        let Some(distance) = distance else {
            let unit = Projection::Orthographic { height: 1.0 };
            let [across, down] = Self::new(DVec3::ZERO, -from, unit, size).extent(max - min);
            let height = 1.04 * down.max(across / aspect).max(1e-9 * radius);
            let eye = center + from * (2.0 * radius);
            return Self::new(eye, -from, Projection::Orthographic { height }, size);
        };
        let fov = if distance > 1.05 { 2.0 * (1.0 / distance).asin() } else { 1.2 };
        let fov_y = if aspect < 1.0 { 2.0 * ((0.5 * fov).tan() / aspect).atan() } else { fov };
        let eye = center + from * (distance * radius);
        Self::new(eye, -from, Projection::Perspective { fov_y }, size)
    }

    /// Width and height of a parallel picture of a box of this size.
    fn extent(&self, size: DVec3) -> [f64; 2] {
        [self.right, self.up].map(|axis| axis.abs().dot(size))
    }

    /// Pixels that one world unit covers at distance `distance` from the eye (any distance for an
    /// orthographic camera).
    pub fn pixels_per_unit(&self, distance: f64) -> f64 {
        match self.projection {
            Projection::Orthographic { height } => f64::from(self.height) / height,
            Projection::Perspective { fov_y } => {
                f64::from(self.height) / (2.0 * (fov_y * 0.5).tan() * distance)
            }
        }
    }

    /// Picture coordinates in pixels (x right, y down, the middle of the top left pixel at
    /// 0.5, 0.5) and depth along `forward`. Behind a perspective eye the depth is ≤ 0 and the
    /// coordinates mean nothing.
    pub fn project(&self, world: DVec3) -> (f64, f64, f64) {
        let d = world - self.eye;
        let depth = d.dot(self.forward);
        let s = self.pixels_per_unit(depth);
        (
            f64::from(self.width) * 0.5 + d.dot(self.right) * s,
            f64::from(self.height) * 0.5 - d.dot(self.up) * s,
            depth,
        )
    }

    /// The world position at picture coordinates (x, y) in this depth: the inverse of
    /// [`Camera::project`].
    pub fn unproject(&self, x: f64, y: f64, depth: f64) -> DVec3 {
        let unit = 1.0 / self.pixels_per_unit(depth);
        let right = (x - 0.5 * f64::from(self.width)) * unit;
        let up = (0.5 * f64::from(self.height) - y) * unit;
        self.eye + self.right * right + self.up * up + self.forward * depth
    }

    /// How a box is seen: its longest side in pixels and the eye's elevation in degrees, both at the
    /// box's middle.
    pub fn sees(&self, [min, max]: [DVec3; 2]) -> (f64, f64) {
        let middle = 0.5 * (min + max);
        let distance = (middle - self.eye).dot(self.forward).max(f64::MIN_POSITIVE);
        let height = (max - min).max_element() * self.pixels_per_unit(distance);
        (height, self.to_eye(middle).y.clamp(-1.0, 1.0).asin().to_degrees())
    }

    /// Unit vector from `world` towards the eye (the reverse viewing direction there).
    pub fn to_eye(&self, world: DVec3) -> DVec3 {
        match self.projection {
            Projection::Orthographic { .. } => -self.forward,
            Projection::Perspective { .. } => (self.eye - world).normalize_or(-self.forward),
        }
    }
}

/// Yaw and pitch in degrees of a view by its name (front, right, back, left, top, diagonal) or as
/// "YAW,PITCH"; `None` for any other text.
pub fn named_view(text: &str) -> Option<[f64; 2]> {
    Some(match text {
        "front" => [0.0, 0.0],
        "right" => [90.0, 0.0],
        "back" => [180.0, 0.0],
        "left" => [-90.0, 0.0],
        "top" => [0.0, 90.0],
        "diagonal" => [45.0, 30.0],
        _ => {
            let (yaw, pitch) = text.split_once(',')?;
            let angles = [yaw.trim().parse().ok()?, pitch.trim().parse().ok()?];
            return angles.iter().all(|v: &f64| v.is_finite()).then_some(angles);
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn perspective_projects_by_similar_triangles() {
        let fov_y = std::f64::consts::FRAC_PI_2;
        let c = Camera::new(
            DVec3::new(0.0, 0.0, 10.0),
            -DVec3::Z,
            Projection::Perspective { fov_y },
            [200, 100],
        );
        // At distance 10 a 90° picture is 20 units tall: 5 pixels a unit.
        assert!((c.pixels_per_unit(10.0) - 5.0).abs() < 1e-12);
        let (x, y, z) = c.project(DVec3::new(3.0, 2.0, 0.0));
        assert!((x - 115.0).abs() < 1e-9 && (y - 40.0).abs() < 1e-9 && (z - 10.0).abs() < 1e-12);
        assert!(c.unproject(x, y, z).distance(DVec3::new(3.0, 2.0, 0.0)) < 1e-12);
    }

    #[test]
    fn frame_is_right_handed_at_the_poles_too() {
        for f in [DVec3::Y, -DVec3::Y, DVec3::X, DVec3::new(1.0, -2.0, 0.5)] {
            let c = Camera::new(DVec3::ZERO, f, Projection::Orthographic { height: 1.0 }, [1, 1]);
            assert!((c.up.cross(c.right) - c.forward).length() < 1e-12, "{f}");
        }
    }

    #[test]
    fn cameras_around_a_box_show_all_of_it() {
        let bounds = [DVec3::new(-1.0, 0.0, -2.0), DVec3::new(1.0, 5.0, 2.0)];
        for size in [[100, 100], [300, 100], [100, 300]] {
            for (view, distance) in [("front", None), ("30,20", None), ("top", Some(3.0))] {
                let c = Camera::around(bounds, named_view(view).unwrap(), distance, size);
                let corner = |i: usize| DVec3::from_array([0, 1, 2].map(|k| bounds[i >> k & 1][k]));
                let (mut low, mut high) = ([f64::MAX; 2], [f64::MIN; 2]);
                for (x, y, _) in (0..8).map(|i| c.project(corner(i))) {
                    (low, high) =
                        ([low[0].min(x), low[1].min(y)], [high[0].max(x), high[1].max(y)]);
                }
                let share = [0, 1].map(|k| (high[k] - low[k]) / f64::from(size[k]));
                assert!(share.iter().all(|s| *s < 1.0), "{view} {size:?}: {share:?}");
                // A parallel picture is filled; one in perspective holds the ball around the box.
                let least = if distance.is_none() { 0.95 } else { 0.3 };
                assert!(share[0].max(share[1]) > least, "{view} {size:?}: {share:?}");
            }
        }
        assert_eq!(named_view("1,2,3").or(named_view("1")).or(named_view("nan,0")), None);
    }
}
