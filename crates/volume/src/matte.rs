//! The mattes of photographs, summed up so that means over rectangles cost nothing.

use forest_soup::{PhotoCamera, Photograph};
use glam::DVec3;

/// A summed-area table of alpha (F. Crow, "Summed-area tables for texture mapping", 1984).
pub(crate) struct Matte {
    size: [u32; 2],
    /// Sums over what lies above and to the left, in 1/255; one row and column more than pixels.
    sums: Vec<u64>,
}

impl Matte {
    pub(crate) fn new(photo: &Photograph) -> Self {
        let [w, h] = photo.camera.size.map(|n| n as usize);
        let mut sums = vec![0u64; (w + 1) * (h + 1)];
        for y in 0..h {
            let mut row = 0;
            for x in 0..w {
                row += u64::from(photo.pixels[y * w + x][3]);
                sums[(y + 1) * (w + 1) + x + 1] = sums[y * (w + 1) + x + 1] + row;
            }
        }
        Self { size: photo.camera.size, sums }
    }

    /// Sum · 255 over pixels from (x0, y0) to before (x1, y1).
    fn sum(&self, [x0, y0]: [u32; 2], [x1, y1]: [u32; 2]) -> u64 {
        let at = |x: u32, y: u32| self.sums[y as usize * (self.size[0] as usize + 1) + x as usize];
        at(x1, y1) + at(x0, y0) - at(x0, y1) - at(x1, y0)
    }

    /// Mean alpha in `0..=1` over `size` pixels from `from`, which must lie inside.
    pub(crate) fn mean(&self, from: [u32; 2], size: [u32; 2]) -> f64 {
        let sum = self.sum(from, [from[0] + size[0], from[1] + size[1]]);
        sum as f64 / (255.0 * f64::from(size[0] * size[1]))
    }

    /// Whether anything is shown where `camera` sees the cube of half side `half` about `center`;
    /// `None` if the picture does not show all of it, and what it shows is empty.
    pub(crate) fn shows(&self, camera: &PhotoCamera, center: DVec3, half: f64) -> Option<bool> {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for corner in 0..8 {
            let sign = |k: i32| if corner >> k & 1 == 0 { -half } else { half };
            let (x, y, _) = camera.project(center + DVec3::new(sign(0), sign(1), sign(2)))?;
            if !x.is_finite() || !y.is_finite() {
                return None;
            }
            low = [low[0].min(x), low[1].min(y)];
            high = [high[0].max(x), high[1].max(y)];
        }
        // `as` saturates below at 0.
        let from = [0, 1].map(|k| (low[k].floor() as u32).min(self.size[k]));
        let to = [0, 1].map(|k| (high[k].ceil() as u32).clamp(from[k], self.size[k]));
        let whole = (0..2).all(|k| low[k] >= 0.0 && high[k] <= f64::from(self.size[k]));
        match self.sum(from, to) > 0 {
            true => Some(true),
            false => whole.then_some(false),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use forest_soup::{Camera, Projection};

    #[test]
    fn means_and_what_is_shown() {
        let projection = Projection::Orthographic { height: 4.0 };
        let camera = Camera::new(DVec3::Z * 5.0, -DVec3::Z, projection, [8, 4]);
        let mut pixels = vec![[0, 0, 0, 0]; 32];
        pixels[8 + 2] = [9, 9, 9, 255]; // x 2 … 3 in pixels, y 1 … 2: world −2 … −1, 0 … 1
        pixels[31] = [9, 9, 9, 51];
        let camera = PhotoCamera::from(&camera);
        let photo = Photograph { name: "a".into(), camera, pixels };
        let matte = Matte::new(&photo);
        assert!((matte.mean([2, 0], [2, 2]) - 0.25).abs() < 1e-12);
        assert!((matte.mean([0, 0], [8, 4]) - 1.2 / 32.0).abs() < 1e-12);
        let shows = |x: f64, y: f64| matte.shows(&camera, DVec3::new(x, y, 0.0), 0.3);
        assert_eq!(shows(-1.5, 0.5), Some(true));
        assert_eq!(shows(-1.5, -0.5), Some(false));
        assert_eq!(shows(-3.9, 0.5), None);
        // Partly outside, but the corner's pixel is seen.
        assert_eq!(shows(4.1, -1.9), Some(true));
        assert_eq!(shows(9.0, 0.5), None);
    }
}
