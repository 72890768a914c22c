//! The ground: heights on a regular grid.

use glam::DVec3;

/// Most points along a side of a land.
pub const MOST_POINTS: u32 = 8193;

/// A height field about the scene's zero: x to the east, z to the south, y up, in metres.
///
/// Each cell is two triangles that share the diagonal from its (−x, −z) to its (+x, +z) corner;
/// coarser levels of detail ([`crate::Ground`]) split their larger cells the same way.
#[derive(Clone, Debug, PartialEq)]
pub struct Land {
    /// Points along x and z, each at least 2.
    pub points: [u32; 2],
    /// Metres along x and z.
    pub size: [f64; 2],
    /// Heights in metres, rows of x from −z to +z.
    pub heights: Vec<f32>,
}

impl Land {
    /// Metres of a cell along x and z.
    pub fn cell(&self) -> [f64; 2] {
        std::array::from_fn(|k| self.size[k] / f64::from(self.points[k] - 1))
    }

    /// Height of point (i, j); beyond the last one, that of the last.
    pub fn at(&self, i: u32, j: u32) -> f32 {
        let [nx, nz] = self.points;
        self.heights[j.min(nz - 1) as usize * nx as usize + i.min(nx - 1) as usize]
    }

    /// Place of point (i, j) in the scene.
    pub fn place(&self, i: u32, j: u32) -> DVec3 {
        let [cx, cz] = self.cell();
        let (i, j) = (i.min(self.points[0] - 1), j.min(self.points[1] - 1));
        let x = f64::from(i) * cx - 0.5 * self.size[0];
        let z = f64::from(j) * cz - 0.5 * self.size[1];
        DVec3::new(x, f64::from(self.at(i, j)), z)
    }

    /// Height of the ground at (x, z), on its triangles; beyond the border that of the border.
    pub fn height(&self, x: f64, z: f64) -> f64 {
        self.height_by(1, x, z)
    }

    /// [`Land::height`] of the surface that takes every `stride`-th point only.
    pub fn height_by(&self, stride: u32, x: f64, z: f64) -> f64 {
        let [cx, cz] = self.cell();
        let (i, u) = split((x + 0.5 * self.size[0]) / cx, self.points[0], stride);
        let (j, v) = split((z + 0.5 * self.size[1]) / cz, self.points[1], stride);
        let h = |di, dj| f64::from(self.at(i + di * stride, j + dj * stride));
        let (h00, h11) = (h(0, 0), h(1, 1));
        if u >= v {
            let h10 = h(1, 0);
            h00 + u * (h10 - h00) + v * (h11 - h10)
        } else {
            let h01 = h(0, 1);
            h00 + v * (h01 - h00) + u * (h11 - h01)
        }
    }

    /// Unit normal at point (i, j), by central differences.
    pub fn normal(&self, i: u32, j: u32) -> DVec3 {
        let [west, east] = [i.saturating_sub(1), (i + 1).min(self.points[0] - 1)];
        let [north, south] = [j.saturating_sub(1), (j + 1).min(self.points[1] - 1)];
        let along_x = self.place(east, j) - self.place(west, j);
        let along_z = self.place(i, south) - self.place(i, north);
        along_z.cross(along_x).normalize_or(DVec3::Y)
    }

    /// Lowest and highest height.
    pub fn range(&self) -> [f32; 2] {
        let (a, b) = (f32::INFINITY, f32::NEG_INFINITY);
        self.heights.iter().fold([a, b], |[a, b], h| [a.min(*h), b.max(*h)])
    }

    /// Checks the rules above.
    ///
    /// # Errors
    /// The first broken rule, with the value and the limit.
    pub fn validate(&self) -> Result<(), String> {
        if let Some(n) = self.points.iter().find(|n| !(2..=MOST_POINTS).contains(*n)) {
            return Err(format!("{n} points along a side; there must be 2 to {MOST_POINTS}"));
        }
        if let Some(s) = self.size.iter().find(|s| !(1e-3..=1e6).contains(*s)) {
            return Err(format!("{s} m along a side; it must be within 0.001 and 1000000"));
        }
        let count = self.points[0] as usize * self.points[1] as usize;
        if self.heights.len() != count {
            return Err(format!("{} heights for {count} points", self.heights.len()));
        }
        match self.heights.iter().position(|h| !(-1e5..=1e5).contains(h)) {
            Some(i) => {
                Err(format!("height {i} is {}; it must be within ±100000 m", self.heights[i]))
            }
            None => Ok(()),
        }
    }
}

/// The first point of the cell of `stride` that position `at` (in points) lies in, and how far in it
/// is (0 … 1). Cells at the far border may be cut short.
fn split(at: f64, points: u32, stride: u32) -> (u32, f64) {
    let last = f64::from(points - 1);
    let at = at.clamp(0.0, last);
    let cells = (points - 1).div_ceil(stride);
    let cell = ((at / f64::from(stride)) as u32).min(cells - 1) * stride;
    let width = f64::from((points - 1 - cell).min(stride));
    (cell, (at - f64::from(cell)) / width)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn land() -> Land {
        let heights = vec![0.0, 2.0, 4.0, 1.0, 5.0, 3.0, 2.0, 2.0, 8.0];
        Land { points: [3, 3], size: [20.0, 20.0], heights }
    }

    #[test]
    fn heights_are_those_of_the_triangles() {
        let land = land();
        assert_eq!(land.height(-10.0, -10.0), 0.0);
        assert_eq!(land.height(0.0, 0.0), 5.0);
        // On the shared diagonal, and on both sides of it.
        assert_eq!(land.height(-5.0, -5.0), 2.5);
        assert_eq!(land.height(-2.5, -7.5), 0.0 + 0.75 * 2.0 + 0.25 * (5.0 - 2.0));
        assert_eq!(land.height(-7.5, -2.5), 0.0 + 0.75 * 1.0 + 0.25 * (5.0 - 1.0));
        // Beyond the border, and the coarse surface.
        assert_eq!(land.height(99.0, 99.0), 8.0);
        assert_eq!(land.height_by(2, 0.0, 0.0), 4.0);
    }

    #[test]
    fn normals_point_up_the_slope() {
        let slope = Land { points: [2, 2], size: [1.0, 1.0], heights: vec![0.0, 1.0, 0.0, 1.0] };
        let n = slope.normal(0, 0);
        assert!((n - DVec3::new(-1.0, 1.0, 0.0).normalize()).length() < 1e-12, "{n}");
    }

    #[test]
    fn rules_are_checked() {
        assert_eq!(land().validate(), Ok(()));
        let nan = Land { heights: vec![f32::NAN; 9], ..land() };
        assert!(nan.validate().unwrap_err().contains("height 0 is NaN"));
        assert!(Land { points: [1, 9], ..land() }.validate().unwrap_err().contains("1 points"));
    }
}
