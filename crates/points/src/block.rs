//! Reading the points of a pack.

use crate::calibration::Calibration;
use crate::header::{CellRecord, PointsHeader};
use crate::pruned::Pruned;
use crate::record::PointRecord;
use crate::size::SizeCode;
use crate::triangle::TriangleRecord;
use forest_pack::kind;
use forest_pack::measures::{ErrorKind, Light, Need};
use forest_soup::Camera;
use glam::DVec3;

/// The points representation of a pack, its arrays in place in the memory map.
#[derive(Clone, Debug)]
pub struct PointsBlock<'a> {
    /// The header.
    pub header: PointsHeader,
    /// The cells; the last one is the block's own tree.
    pub cells: &'a [CellRecord],
    /// All points, cell by cell.
    pub points: &'a [PointRecord],
    /// All triangles, cell by cell; empty if the pack has none.
    pub triangles: &'a [TriangleRecord],
    /// Vertex colours of the triangles (sRGB and alpha), or empty.
    pub triangle_colors: &'a [[[u8; 4]; 3]],
    /// Measured factors on areas, if the pack has them.
    pub calibration: Option<Calibration>,
    /// What is left out, if the pack is pruned.
    pub pruned: Option<Pruned>,
}

impl<'a> PointsBlock<'a> {
    /// World units in a block unit.
    pub fn scale(&self) -> f64 {
        f64::from(self.header.exponent).exp2()
    }

    /// World position of the block's centre.
    pub fn origin(&self) -> DVec3 {
        DVec3::from_array(self.header.origin)
    }

    /// World position of a point in block space.
    pub fn to_world(&self, block: DVec3) -> DVec3 {
        self.origin() + block * self.scale()
    }

    /// World position of the middle of the source's box.
    pub fn middle(&self) -> DVec3 {
        let [min, max] = [self.header.min, self.header.max].map(DVec3::from_array);
        self.to_world((min + max) * 0.5)
    }

    /// Half the diagonal of the source's box, in world units: the paper's block size R.
    pub fn half_diagonal(&self) -> f64 {
        let size = DVec3::from_array(self.header.max) - DVec3::from_array(self.header.min);
        size.length() * 0.5 * self.scale()
    }

    /// What a pack's measured table is to be asked for this block before `camera`: its height in
    /// pixels and the camera's elevation, both at the block's middle, under base colours.
    pub fn need(&self, camera: &Camera, error: ErrorKind) -> Need {
        let bounds = [self.header.min, self.header.max].map(|p| self.to_world(p.into()));
        let (height, elevation) = camera.sees(bounds);
        Need {
            representation: kind::POINTS_HEADER,
            pixel_height: height as f32,
            elevation: Some(elevation as f32),
            light: Light::Albedo,
            error,
        }
    }

    /// Position in block space of quantised steps in a cell.
    pub fn position(&self, cell: &CellRecord, steps: [u16; 3]) -> DVec3 {
        let step = f64::from(self.header.step_exponent).exp2();
        let shifted = f64::from(1u32 << cell.step_shift);
        DVec3::from_array(std::array::from_fn(|k| {
            (f64::from(cell.origin[k]) + f64::from(steps[k]) * shifted) * step
        }))
    }

    /// Block units of a position step of a cell.
    pub fn step(&self, cell: &CellRecord) -> f64 {
        f64::from(self.header.step_exponent + cell.step_shift as i32).exp2()
    }

    /// Radius of a point as it is drawn, in block units.
    #[inline]
    pub fn radius(&self, point: &PointRecord) -> f64 {
        self.radius_of(point.own())
    }

    /// Radius of points of size `code` as they are drawn, in block units.
    #[inline]
    pub fn radius_of(&self, code: SizeCode) -> f64 {
        self.calibration.as_ref().map_or(1.0, |c| c.radius_factor(code)) * code.radius()
    }

    /// The points of a cell.
    pub fn cell_points(&self, cell: &CellRecord) -> &'a [PointRecord] {
        &self.points[cell.first_point as usize..][..cell.points as usize]
    }

    /// The triangles of a cell.
    pub fn cell_triangles(&self, cell: &CellRecord) -> &'a [TriangleRecord] {
        &self.triangles[cell.first_triangle as usize..][..cell.triangles as usize]
    }
}
