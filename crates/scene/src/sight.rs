//! Where scenes are looked at from, and their sky.

use crate::land::Land;
use forest_soup::{Camera, Projection};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// A place to look from, above the ground.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sight {
    /// Its name, for programs' arguments.
    pub name: String,
    /// East and south of the scene's zero, in metres.
    pub at: [f64; 2],
    /// Metres above the ground there.
    pub above: f64,
    /// Degrees clockwise from north (−z) that it looks to.
    #[serde(default)]
    pub yaw: f64,
    /// Degrees above the horizon that it looks to.
    #[serde(default)]
    pub pitch: f64,
    /// Height of the picture in degrees.
    #[serde(default = "usual_fov")]
    pub fov: f64,
}

fn usual_fov() -> f64 {
    45.0
}

impl Sight {
    /// The camera on this land.
    pub fn camera(&self, land: &Land, size: [u32; 2]) -> Camera {
        let [x, z] = self.at;
        let eye = DVec3::new(x, land.height(x, z) + self.above, z);
        let (yaw, pitch) = (self.yaw.to_radians(), self.pitch.to_radians());
        let forward = DVec3::new(yaw.sin() * pitch.cos(), pitch.sin(), -yaw.cos() * pitch.cos());
        let projection = Projection::Perspective { fov_y: self.fov.to_radians() };
        Camera::new(eye, forward, projection, size)
    }

    /// The sight at `t` of 0 … 1 on the way to `other`; turns the shorter way.
    pub fn toward(&self, other: &Self, t: f64) -> Self {
        let mix = |a: f64, b: f64| a + (b - a) * t;
        let turn = (other.yaw - self.yaw + 180.0).rem_euclid(360.0) - 180.0;
        Self {
            name: self.name.clone(),
            at: std::array::from_fn(|k| mix(self.at[k], other.at[k])),
            above: mix(self.above, other.above),
            yaw: self.yaw + turn * t,
            pitch: mix(self.pitch, other.pitch),
            fov: mix(self.fov, other.fov),
        }
    }

    pub(crate) fn validate(&self) -> Result<(), String> {
        let within = |what: &str, v: f64, low: f64, high: f64| {
            if (low..=high).contains(&v) {
                return Ok(());
            }
            Err(format!("{what} is {v}; it must be within {low} and {high}"))
        };
        within("at", self.at[0], -1e6, 1e6)?;
        within("at", self.at[1], -1e6, 1e6)?;
        within("above", self.above, -1e5, 1e6)?;
        within("yaw", self.yaw, -3600.0, 3600.0)?;
        within("pitch", self.pitch, -90.0, 90.0)?;
        within("fov", self.fov, 0.1, 170.0)
    }
}

/// The sky behind everything, linear RGB: no light comes from it, see [`forest_raster::Sun::sky`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Sky {
    /// At the horizon and below.
    pub horizon: [f32; 3],
    /// Overhead.
    pub zenith: [f32; 3],
}

impl Default for Sky {
    /// A clear day.
    fn default() -> Self {
        Self { horizon: [0.62, 0.74, 0.86], zenith: [0.13, 0.28, 0.58] }
    }
}

impl Sky {
    /// What is seen along unit vector `direction`: from the horizon to the zenith by the square root
    /// of the sine of its elevation.
    pub fn color(&self, direction: DVec3) -> [f32; 3] {
        let t = (direction.y.max(0.0) as f32).sqrt();
        std::array::from_fn(|k| self.horizon[k] + (self.zenith[k] - self.horizon[k]) * t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sight() -> Sight {
        let name = "a".into();
        Sight { name, at: [1.0, 2.0], above: 3.0, yaw: 90.0, pitch: 0.0, fov: 45.0 }
    }

    #[test]
    fn yaw_is_a_compass() {
        let land = Land { points: [2, 2], size: [10.0, 10.0], heights: vec![7.0; 4] };
        let camera = sight().camera(&land, [4, 3]);
        assert_eq!(camera.eye, DVec3::new(1.0, 10.0, 2.0));
        assert!((camera.forward - DVec3::X).length() < 1e-12, "{}", camera.forward);
        let north = Sight { yaw: 0.0, ..sight() }.camera(&land, [4, 3]);
        assert!((north.forward + DVec3::Z).length() < 1e-12);
    }

    #[test]
    fn ways_turn_the_shorter_way() {
        let other = Sight { yaw: 350.0, at: [3.0, 2.0], ..sight() };
        let half = Sight { yaw: 10.0, ..sight() }.toward(&other, 0.5);
        assert_eq!((half.yaw, half.at), (0.0, [2.0, 2.0]));
    }
}
