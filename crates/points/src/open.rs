//! Opening the points of a pack: read, then validated.

use crate::block::PointsBlock;
use crate::calibration::Calibration;
use crate::pruned::Pruned;
use crate::validate::validate;
use forest_pack::{Pack, PackError, SectionId, header, kind};

impl<'a> PointsBlock<'a> {
    /// Reads and validates ([`crate::validate()`]) the representation.
    ///
    /// # Errors
    /// When a section is missing or damaged, or breaks a rule of SPEC.md.
    pub fn open(pack: &'a Pack) -> Result<Self, PackError> {
        let id = |kind| SectionId::new(kind, 0);
        let (triangles, colors) = (id(kind::POINTS_TRIANGLES), id(kind::POINTS_TRIANGLE_COLORS));
        let block = Self {
            header: header::decode(pack, id(kind::POINTS_HEADER))?,
            cells: pack.records(id(kind::POINTS_CELLS))?,
            points: pack.records(id(kind::POINTS))?,
            triangles: if pack.contains(triangles) { pack.records(triangles)? } else { &[] },
            triangle_colors: if pack.contains(colors) { pack.records(colors)? } else { &[] },
            calibration: Calibration::read(pack)?,
            pruned: Pruned::read(pack)?,
        };
        validate(&block).map_err(|(kind, problem)| {
            PackError::invalid(pack.path(), SectionId::new(kind, 0), problem)
        })?;
        Ok(block)
    }

    /// Whether a pack holds this representation.
    pub fn is_in(pack: &Pack) -> bool {
        pack.contains(SectionId::new(kind::POINTS_HEADER, 0))
    }
}
