//! A camera that flies over a landscape.

use forest_scene::{Land, Sight};
use forest_soup::Camera;

/// Where the camera is and where it looks.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Walk {
    sight: Sight,
}

/// Never lower than this above the ground, in metres.
const LEAST_ABOVE: f64 = 1.0;
/// Metres a second on the ground, and more for each metre above it.
const SPEED: f64 = 6.0;
const SPEED_ABOVE: f64 = 0.6;

impl Walk {
    pub(crate) fn new(sight: &Sight) -> Self {
        Self { sight: sight.clone() }
    }

    pub(crate) fn camera(&self, land: &Land, size: [u32; 2]) -> Camera {
        self.sight.camera(land, size)
    }

    /// Turns by pixels that the pointer was dragged: what was under it stays there.
    pub(crate) fn turn(&mut self, [x, y]: [f64; 2], height: u32) {
        let degrees = self.sight.fov / f64::from(height.max(1));
        self.sight.yaw = (self.sight.yaw - x * degrees).rem_euclid(360.0);
        self.sight.pitch = (self.sight.pitch + y * degrees).clamp(-89.0, 89.0);
    }

    /// Narrows the picture by clicks of the wheel.
    pub(crate) fn zoom(&mut self, clicks: f64) {
        self.sight.fov = (self.sight.fov * 0.9f64.powf(clicks)).clamp(2.0, 100.0);
    }

    /// Flies for a time: right, up and forward in seconds; the higher, the faster. Keeps its height over
    /// the sea when it flies level, and stays above the ground.
    pub(crate) fn fly(&mut self, [right, up, forward]: [f64; 3], land: &Land) {
        let speed = SPEED + SPEED_ABOVE * self.sight.above.max(0.0);
        let (sin, cos) = self.sight.yaw.to_radians().sin_cos();
        let [x, z] = self.sight.at;
        let height = land.height(x, z) + self.sight.above;
        let limits = land.size.map(|s| 0.75 * s);
        let east = x + speed * (right * cos + forward * sin);
        let south = z + speed * (right * sin - forward * cos);
        self.sight.at = [east.clamp(-limits[0], limits[0]), south.clamp(-limits[1], limits[1])];
        let ground = land.height(self.sight.at[0], self.sight.at[1]);
        self.sight.above = (height + speed * up - ground).max(LEAST_ABOVE);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_flies_where_it_looks_and_stays_above_the_ground() {
        let land = Land { points: [2, 2], size: [100.0; 2], heights: vec![5.0, 5.0, 15.0, 15.0] };
        let sight = Sight {
            name: "a".into(),
            at: [0.0, 0.0],
            above: 10.0,
            yaw: 90.0,
            pitch: 0.0,
            fov: 45.0,
        };
        let mut walk = Walk::new(&sight);
        walk.fly([0.0, 0.0, 1.0], &land);
        assert!((walk.sight.at[0] - 12.0).abs() < 1e-9 && walk.sight.at[1].abs() < 1e-9);
        // Level flight to the south, where the ground rises by a tenth.
        walk.sight.yaw = 180.0;
        walk.fly([0.0, 0.0, 1.0], &land);
        assert!((walk.sight.above - 8.8).abs() < 1e-9, "{}", walk.sight.above);
        walk.fly([0.0, -9.0, 0.0], &land);
        assert_eq!(walk.sight.above, LEAST_ABOVE);
        walk.turn([0.0, 1e6], 720);
        assert_eq!(walk.sight.pitch, 89.0);
    }
}
