//! How the billboards of one camera lie.

use forest_soup::PhotoCamera;
use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

/// The plane of a camera's billboards, the same for all cells: it faces the camera as seen from
/// the middle of the volume.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CameraFrame {
    /// Unit vector to the right of a billboard.
    pub right: [f64; 3],
    /// Unit vector to its top.
    pub up: [f64; 3],
    /// Unit vector towards the camera: `right × up`.
    pub back: [f64; 3],
}

impl CameraFrame {
    /// The frame of `camera` about a volume's `middle`. A camera within `radius` of it looks out of
    /// the volume: its billboards face the other way of its axis.
    pub(crate) fn of(camera: &PhotoCamera, middle: DVec3, radius: f64) -> Self {
        let inside = camera.eye.distance(middle) < radius;
        let back = if inside { -camera.forward } else { camera.direction_from(middle) };
        // Turned as little as may be: the top of the photograph stays on top.
        let turn = DQuat::from_rotation_arc(-camera.forward, back);
        let axis = |v: DVec3| (turn * v).normalize().to_array();
        Self { right: axis(camera.right), up: axis(camera.up), back: back.to_array() }
    }

    /// Right, up and back.
    pub fn axes(&self) -> [DVec3; 3] {
        [self.right, self.up, self.back].map(DVec3::from_array)
    }

    /// Half the width and height of the billboards of cells of this side: they cover the cell's
    /// picture.
    pub fn half_size(&self, cell_side: f64) -> [f64; 2] {
        let [right, up, _] = self.axes();
        [right, up].map(|v| 0.5 * cell_side * v.abs().element_sum())
    }

    /// Of each texel of a billboard with `texels` along a side, row 0 on top, the share that the
    /// cell's picture covers.
    pub(crate) fn silhouette(&self, texels: u32) -> Vec<f64> {
        const FINE: u32 = 16;
        let [right, up, back] = self.axes();
        let [w, h] = self.half_size(1.0);
        let inside = |x: f64, y: f64| {
            // A ray through the unit cube about zero.
            let origin = right * (x * w) + up * (y * h);
            let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
            for k in 0..3 {
                if back[k].abs() < 1e-12 {
                    if origin[k].abs() > 0.5 {
                        return false;
                    }
                    continue;
                }
                let (a, b) = ((-0.5 - origin[k]) / back[k], (0.5 - origin[k]) / back[k]);
                enter = enter.max(a.min(b));
                leave = leave.min(a.max(b));
            }
            enter < leave
        };
        let n = texels * FINE;
        let mut shares = vec![0.0; (texels * texels) as usize];
        for (row, column) in (0..n).flat_map(|r| (0..n).map(move |c| (r, c))) {
            let at = |i: u32| (f64::from(i) + 0.5) * 2.0 / f64::from(n) - 1.0;
            if inside(at(column), -at(row)) {
                let texel = (row / FINE) * texels + column / FINE;
                shares[texel as usize] += 1.0 / f64::from(FINE * FINE);
            }
        }
        shares
    }

    /// Checks that the axes are unit, upright to each other and right-handed.
    ///
    /// # Errors
    /// The rule that is broken.
    pub(crate) fn validate(&self) -> Result<(), String> {
        let [right, up, back] = self.axes();
        let off = (right.cross(up) - back).length().max(right.dot(up).abs());
        let lengths = [right, up, back].map(|v| (v.length() - 1.0).abs());
        // Not `>`: what is not a number is refused too.
        if !(off < 1e-6 && lengths.iter().all(|l| *l < 1e-6)) {
            return Err(format!("{self:?} is not a right-handed frame"));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use forest_soup::{Camera, Projection};

    fn camera(eye: DVec3, forward: DVec3) -> PhotoCamera {
        let projection = Projection::Perspective { fov_y: 1.0 };
        PhotoCamera::from(&Camera::new(eye, forward, projection, [64, 64]))
    }

    #[test]
    fn faces_the_camera_or_away_from_what_it_looks_at() {
        // Looks past the middle; turned by 45°.
        let aside = camera(DVec3::new(0.0, 0.0, 10.0), DVec3::new(1.0, 0.0, -1.0));
        let frame = CameraFrame::of(&aside, DVec3::ZERO, 2.0);
        frame.validate().unwrap();
        assert!((frame.axes()[2] - DVec3::Z).length() < 1e-12);
        assert!((frame.axes()[0] - DVec3::X).length() < 1e-12);
        let inside = camera(DVec3::new(0.0, 0.0, 1.0), DVec3::X);
        assert_eq!(CameraFrame::of(&inside, DVec3::ZERO, 2.0).axes()[2], -DVec3::X);
    }

    #[test]
    fn silhouettes_have_the_area_of_a_cubes_picture() {
        for back in [DVec3::Z, DVec3::new(1.0, 1.0, 1.0), DVec3::new(0.3, 0.9, -0.5)] {
            let back = back.normalize();
            let camera = camera(back * 50.0, -back);
            let frame = CameraFrame::of(&camera, DVec3::ZERO, 2.0);
            let [w, h] = frame.half_size(1.0);
            let mean = frame.silhouette(4).iter().sum::<f64>() / 16.0;
            // The picture of a unit cube has the area |x| + |y| + |z| of the direction.
            let want = back.abs().element_sum();
            assert!((mean * 4.0 * w * h - want).abs() < 0.02 * want, "{back} {mean}");
        }
    }
}
