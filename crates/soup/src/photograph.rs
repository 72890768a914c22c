//! Photographs with known cameras: the other thing that bakers read, beside soups.

use crate::{Camera, Projection};
use glam::{DMat2, DVec2, DVec3};

/// How a lens bends rays: radial and tangential terms of the usual model (D. C. Brown,
/// "Close-range camera calibration", 1971, as OpenCV and NeRF tools write it).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Distortion {
    /// Radial terms.
    pub k: [f64; 2],
    /// Tangential terms.
    pub p: [f64; 2],
}

impl Distortion {
    /// Where a point at (x, y) on the plane one unit before the eye is seen on that plane, and
    /// the derivative of it.
    fn bend(&self, at: DVec2) -> (DVec2, DMat2) {
        let ([k1, k2], [p1, p2]) = (self.k, self.p);
        let (x, y) = (at.x, at.y);
        let r2 = at.length_squared();
        let radial = 1.0 + r2 * (k1 + r2 * k2);
        let slope = 2.0 * (k1 + 2.0 * k2 * r2);
        let bent = at * radial
            + DVec2::new(
                2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
                p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
            );
        let cross = x * y * slope + 2.0 * (p1 * x + p2 * y);
        let derivative = DMat2::from_cols(
            DVec2::new(radial + x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x, cross),
            DVec2::new(cross, radial + y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x),
        );
        (bent, derivative)
    }

    /// The inverse of the bending, by Newton's method; `None` where the lens folds over.
    fn straighten(&self, bent: DVec2) -> Option<DVec2> {
        if *self == Self::default() {
            return Some(bent);
        }
        let mut at = bent;
        for _ in 0..20 {
            let (now, derivative) = self.bend(at);
            if derivative.determinant() <= 0.0 {
                return None;
            }
            let step = derivative.inverse() * (bent - now);
            at += step;
            if step.length() < 1e-13 {
                break;
            }
        }
        let (now, derivative) = self.bend(at);
        (derivative.determinant() > 0.0 && now.distance(bent) < 1e-9).then_some(at)
    }
}

/// How a photograph's camera projects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Optics {
    /// Parallel rays through the middles of pixels this many world units wide.
    Parallel {
        /// Side of a pixel in world units, > 0.
        pixel: f64,
    },
    /// Rays through a point.
    Pinhole {
        /// Focal lengths in pixels across and down, > 0.
        focal: [f64; 2],
        /// Where the optical axis meets the picture, in pixels from its top left corner.
        center: [f64; 2],
        /// The lens.
        distortion: Distortion,
    },
}

/// A photograph's camera: a place, a right-handed frame and its optics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhotoCamera {
    /// Where the eye is, in world units; of a parallel camera, where depth is zero.
    pub eye: DVec3,
    /// Unit vector to the right of the picture.
    pub right: DVec3,
    /// Unit vector to the top of the picture.
    pub up: DVec3,
    /// Unit vector into the picture: `up × right`.
    pub forward: DVec3,
    /// The optics.
    pub optics: Optics,
    /// Pixels across and down.
    pub size: [u32; 2],
}

impl PhotoCamera {
    /// The ray through picture coordinates (x, y), in pixels from the top left corner: where it
    /// starts, and its unit direction. `None` where a lens shows nothing.
    pub fn ray(&self, x: f64, y: f64) -> Option<(DVec3, DVec3)> {
        match self.optics {
            Optics::Parallel { pixel } => {
                let [w, h] = self.size.map(|n| f64::from(n) * 0.5);
                let aside = self.right * ((x - w) * pixel) + self.up * ((h - y) * pixel);
                Some((self.eye + aside, self.forward))
            }
            Optics::Pinhole { focal, center, distortion } => {
                let bent = DVec2::new((x - center[0]) / focal[0], (y - center[1]) / focal[1]);
                let at = distortion.straighten(bent)?;
                let direction = self.forward + self.right * at.x - self.up * at.y;
                Some((self.eye, direction.normalize()))
            }
        }
    }

    /// Picture coordinates in pixels, and depth along `forward`; `None` behind a pinhole.
    pub fn project(&self, world: DVec3) -> Option<(f64, f64, f64)> {
        let d = world - self.eye;
        let (x, y, depth) = (d.dot(self.right), -d.dot(self.up), d.dot(self.forward));
        match self.optics {
            Optics::Parallel { pixel } => {
                let [w, h] = self.size.map(|n| f64::from(n) * 0.5);
                Some((w + x / pixel, h + y / pixel, depth))
            }
            Optics::Pinhole { focal, center, distortion } if depth > 0.0 => {
                let (at, _) = distortion.bend(DVec2::new(x, y) / depth);
                Some((center[0] + focal[0] * at.x, center[1] + focal[1] * at.y, depth))
            }
            Optics::Pinhole { .. } => None,
        }
    }

    /// Pixels that a square world unit covers at `depth` along the axis.
    pub fn pixels_per_area(&self, depth: f64) -> f64 {
        match self.optics {
            Optics::Parallel { pixel } => 1.0 / (pixel * pixel),
            Optics::Pinhole { focal, .. } => focal[0] * focal[1] / (depth * depth),
        }
    }

    /// The same camera without a lens; `None` if it has one, or pixels that are not square, or an
    /// axis that does not meet the picture's middle (within half a pixel).
    pub fn plain(&self) -> Option<Camera> {
        let [width, height] = self.size;
        let projection = match self.optics {
            Optics::Parallel { pixel } => {
                Projection::Orthographic { height: f64::from(height) * pixel }
            }
            Optics::Pinhole { focal: [fx, fy], center, distortion } => {
                let off = [(center[0], width), (center[1], height)]
                    .map(|(c, n)| (c - 0.5 * f64::from(n)).abs());
                let square = (fx / fy - 1.0).abs() * f64::from(width) <= 1.0;
                if distortion != Distortion::default() || !square || off.iter().any(|o| *o > 0.5) {
                    return None;
                }
                let fov_y = 2.0 * (0.5 * f64::from(height) / fy).atan();
                Projection::Perspective { fov_y }
            }
        };
        let Self { eye, right, up, forward, .. } = *self;
        Some(Camera { eye, right, up, forward, projection, width, height })
    }

    /// Unit vector from `world` towards the camera.
    pub fn direction_from(&self, world: DVec3) -> DVec3 {
        match self.optics {
            Optics::Parallel { .. } => -self.forward,
            Optics::Pinhole { .. } => (self.eye - world).normalize_or(-self.forward),
        }
    }
}

impl From<&Camera> for PhotoCamera {
    fn from(c: &Camera) -> Self {
        let optics = match c.projection {
            Projection::Orthographic { .. } => {
                Optics::Parallel { pixel: 1.0 / c.pixels_per_unit(1.0) }
            }
            Projection::Perspective { .. } => Optics::Pinhole {
                focal: [c.pixels_per_unit(1.0); 2],
                center: [c.width, c.height].map(|n| f64::from(n) * 0.5),
                distortion: Distortion::default(),
            },
        };
        let size = [c.width, c.height];
        Self { eye: c.eye, right: c.right, up: c.up, forward: c.forward, optics, size }
    }
}

/// A photograph of a tree, its background cut away.
#[derive(Clone, Debug, PartialEq)]
pub struct Photograph {
    /// Its name in messages.
    pub name: String,
    /// Its camera.
    pub camera: PhotoCamera,
    /// sRGB and straight alpha (the matte), row 0 on top.
    pub pixels: Vec<[u8; 4]>,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(distortion: Distortion) -> PhotoCamera {
        let projection = Projection::Perspective { fov_y: 0.9 };
        let c = Camera::new(
            DVec3::new(3.0, 2.0, 9.0),
            DVec3::new(-0.3, -0.1, -1.0),
            projection,
            [640, 480],
        );
        let optics = Optics::Pinhole { focal: [500.0, 520.0], center: [310.0, 250.0], distortion };
        PhotoCamera { optics, ..PhotoCamera::from(&c) }
    }

    #[test]
    fn rays_go_through_what_is_projected() {
        let bent = Distortion { k: [-0.12, 0.03], p: [0.001, -0.002] };
        for camera in [camera(Distortion::default()), camera(bent)] {
            for p in [DVec3::ZERO, DVec3::new(1.0, 3.0, -2.0), DVec3::new(-2.0, -1.0, 1.0)] {
                let (x, y, _) = camera.project(p).unwrap();
                let (from, along) = camera.ray(x, y).unwrap();
                let miss = (p - from).cross(along).length();
                assert!(miss < 1e-9, "{p} {miss}");
            }
        }
    }

    #[test]
    fn agrees_with_the_plain_camera() {
        for projection in
            [Projection::Perspective { fov_y: 0.7 }, Projection::Orthographic { height: 4.0 }]
        {
            let c = Camera::new(DVec3::new(0.0, 1.0, 6.0), -DVec3::Z, projection, [100, 80]);
            let p = DVec3::new(0.4, 1.3, 0.2);
            let (a, b) = (c.project(p), PhotoCamera::from(&c).project(p).unwrap());
            assert!((a.0 - b.0).abs() < 1e-9 && (a.1 - b.1).abs() < 1e-9, "{a:?} {b:?}");
            assert!((a.2 - b.2).abs() < 1e-12);
            let plain = PhotoCamera::from(&c).plain().unwrap();
            assert!((plain.project(p).0 - a.0).abs() < 1e-9);
        }
    }

    #[test]
    fn a_lens_that_folds_over_shows_nothing_there() {
        let strong = Distortion { k: [-0.6, 0.0], p: [0.0; 2] };
        // The largest radius that is reached is ⅔·√(1/1.8) ≈ 0.497: 248 pixels from the centre.
        assert!(camera(strong).ray(310.0 + 240.0, 250.0).is_some());
        assert!(camera(strong).ray(310.0 + 260.0, 250.0).is_none());
    }
}
