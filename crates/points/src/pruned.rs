//! Packs that hold only what is needed.
//!
//! Points are sorted by their parents' sizes and triangles by their own, so that what no camera of a need
//! ever draws is the end of each cell's arrays: it is cut off. Points keep their numbers for the hash rule,
//! so that what is drawn of a pruned pack is, sample by sample, what is drawn of the whole one.

use crate::block::PointsBlock;
use crate::header::CellRecord;
use crate::record::PointRecord;
use crate::select::{PixelArea, Thresholds};
use crate::size::SizeCode;
use crate::triangle::TriangleRecord;
use forest_pack::{Codec, Pack, PackError, PackWriter, SectionId, header, kind};
use forest_soup::{Camera, Projection};
use serde::{Deserialize, Serialize};

/// Section `points.pruned`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Pruned {
    /// `fine` of selection is nowhere below this; −1 for no limit.
    pub fine: i32,
    /// `coarse` neither.
    pub coarse: i32,
    /// Points of the whole pack: the number of its first triangle.
    pub points: u32,
    /// Of each cell, the numbers of its first point and of its first triangle among triangles.
    pub firsts: Vec<[u32; 2]>,
}

/// What a scene can ever ask of a block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointsNeed {
    /// Area of s_m where the camera is nearest, in square world units of the pack: s_m over the squared
    /// pixels of a unit there. 0 for everything.
    pub finest: f64,
    /// Area of s_M there.
    pub largest: f64,
}

/// What was kept of how many.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct PruneReport {
    /// Points of the pack and of the pruned one.
    pub points: [u64; 2],
    /// Triangles of the pack and of the pruned one.
    pub triangles: [u64; 2],
}

const ID: SectionId = SectionId::new(kind::POINTS_PRUNED, 0);

impl Pruned {
    /// Reads the section, if there is one.
    ///
    /// # Errors
    /// When it is damaged.
    pub fn read(pack: &Pack) -> Result<Option<Self>, PackError> {
        if pack.contains(ID) { header::decode(pack, ID).map(Some) } else { Ok(None) }
    }

    pub(crate) fn validate(&self, block: &PointsBlock) -> Result<(), String> {
        let codes = -1..=i32::from(SizeCode::MAX.bits());
        for code in [self.fine, self.coarse] {
            if !codes.contains(&code) {
                return Err(format!("a limit of {code}, not in {codes:?}"));
            }
        }
        let (cells, firsts) = (block.cells.len(), self.firsts.len());
        if cells != firsts {
            return Err(format!("numbers of {firsts} cells; there are {cells}"));
        }
        if (self.points as usize) < block.points.len() {
            let there = block.points.len();
            return Err(format!("{} points of the whole pack; there are {there}", self.points));
        }
        Ok(())
    }
}

impl PointsBlock<'_> {
    /// What is added to indices of points of a cell for their numbers (SPEC.md, section 5.4).
    pub fn point_offset(&self, cell: u32) -> u32 {
        let first = self.cells[cell as usize].first_point;
        self.pruned.as_ref().map_or(0, |p| p.firsts[cell as usize][0].wrapping_sub(first))
    }

    /// What is added to indices of triangles of a cell for their numbers.
    pub fn triangle_offset(&self, cell: u32) -> u32 {
        let first = self.cells[cell as usize].first_triangle;
        match &self.pruned {
            None => self.points.len() as u32,
            Some(p) => p.points.wrapping_add(p.firsts[cell as usize][1]).wrapping_sub(first),
        }
    }

    /// Whether a camera may ask for finer points than a pruned pack has: what is drawn is then the finest
    /// that is there.
    pub fn is_beyond(&self, camera: &Camera, thresholds: &Thresholds) -> bool {
        let Some(pruned) = &self.pruned else { return false };
        let distance = match camera.projection {
            Projection::Orthographic { .. } => 1.0,
            Projection::Perspective { .. } => {
                (self.middle().distance(camera.eye) - self.half_diagonal()).max(f64::MIN_POSITIVE)
            }
        };
        let pixels = camera.pixels_per_unit(distance) * self.scale();
        let asked = |PixelArea(area)| {
            let code = SizeCode::at_most(area / (pixels * pixels));
            code.map_or(-1, |c| i32::from(c.bits()))
        };
        let largest = PixelArea(thresholds.largest.0.max(thresholds.finest.0));
        asked(thresholds.finest) < pruned.fine || asked(largest) < pruned.coarse
    }

    /// Smallest `fine` and `coarse` that selection may use: −1 for a whole pack.
    pub fn limits(&self) -> [i32; 2] {
        self.pruned.as_ref().map_or([-1, -1], |p| [p.fine, p.coarse])
    }
}

/// Writes the points of `block`, which is `pack`'s, into a new pack, without what `need` never draws.
/// Materials and textures go along while there are triangles.
///
/// # Errors
/// When the disk is full.
pub fn prune(
    pack: &Pack,
    block: &PointsBlock,
    need: &PointsNeed,
    writer: &mut PackWriter,
) -> Result<PruneReport, PackError> {
    let [fine, coarse] = limits(block, need);
    let mut cells = block.cells.to_vec();
    let (mut points, mut triangles, mut colors) = (Vec::new(), Vec::new(), Vec::new());
    let mut firsts = Vec::with_capacity(cells.len());
    let whole = block.pruned.as_ref().map_or(block.points.len() as u32, |p| p.points);
    for (i, cell) in (0u32..).zip(&mut cells) {
        let (from, first) = (cell.first_point as usize, cell.first_triangle as usize);
        firsts.push([
            cell.first_point.wrapping_add(block.point_offset(i)),
            cell.first_triangle.wrapping_add(block.triangle_offset(i)).wrapping_sub(whole),
        ]);
        let [kept, drawn] = kept(block, cell, [fine, coarse]);
        cell.first_point = points.len() as u32;
        cell.points = kept as u32;
        cell.first_triangle = triangles.len() as u32;
        cell.triangles = drawn as u32;
        points.extend_from_slice(&block.points[from..][..kept]);
        cell.surfels =
            points[cell.first_point as usize..].iter().filter(|p| p.is_leaf()).count() as u32;
        triangles.extend_from_slice(&block.triangles[first..][..drawn]);
        if !block.triangle_colors.is_empty() {
            colors.extend_from_slice(&block.triangle_colors[first..][..drawn]);
        }
    }
    let mut head = block.header.clone();
    head.counts.points = points.len() as u64;
    head.counts.surfels = cells.iter().map(|c| u64::from(c.surfels)).sum();
    if triangles.is_empty() {
        head.uv_ranges.clear();
    }
    let id = |kind| SectionId::new(kind, 0);
    header::write(writer, id(kind::POINTS_HEADER), &head)?;
    let mut array = |kind, bytes: &[u8]| writer.add(id(kind), Codec::None, bytes);
    array(kind::POINTS_CELLS, bytemuck::cast_slice(&cells))?;
    array(kind::POINTS, bytemuck::cast_slice(&points))?;
    if !triangles.is_empty() {
        array(kind::POINTS_TRIANGLES, bytemuck::cast_slice(&triangles))?;
        if !colors.is_empty() {
            array(kind::POINTS_TRIANGLE_COLORS, bytemuck::cast_slice(&colors))?;
        }
    }
    if let Some(calibration) = &block.calibration {
        calibration.write(writer)?;
    }
    header::write(writer, ID, &Pruned { fine, coarse, points: whole, firsts })?;
    if !triangles.is_empty() {
        let shared = |kind| kind == kind::MATERIALS || kind == kind::TEXTURE;
        for (id, _) in pack.sections().filter(|(id, _)| shared(id.kind)) {
            writer.copy(pack, id)?;
        }
    }
    Ok(PruneReport {
        points: [block.points.len() as u64, points.len() as u64],
        triangles: [block.triangles.len() as u64, triangles.len() as u64],
    })
}

/// The size codes below which a need asks for no points and no triangles.
fn limits(block: &PointsBlock, need: &PointsNeed) -> [i32; 2] {
    let squared = block.scale() * block.scale();
    // A code less: selection may round.
    let limit = |area: f64| {
        let code = SizeCode::at_most(area / squared).map_or(-1, |c| i32::from(c.bits()));
        (code - 1).max(-1)
    };
    let [old_fine, old_coarse] = block.limits();
    let fine = limit(need.finest).max(old_fine);
    [fine, limit(need.largest).max(fine).max(old_coarse)]
}

/// How many points and triangles of a cell are kept: the first ones.
fn kept(block: &PointsBlock, cell: &CellRecord, [fine, coarse]: [i32; 2]) -> [usize; 2] {
    let all = block.cell_points(cell);
    let kept = match cell.is_top() {
        // Cells hang below its points.
        true => all.len(),
        false => all.partition_point(|p| i32::from(p.parent().bits()) > fine).max(1),
    };
    let drawn = block.cell_triangles(cell);
    [kept, drawn.partition_point(|t| i32::from(t.size) > coarse)]
}

/// Bytes of the records that [`prune`] writes for a need: of points, and of triangles with their colours;
/// without any triangles it writes no materials and textures either.
pub fn pruned_bytes(block: &PointsBlock, need: &PointsNeed) -> [u64; 2] {
    let limits = limits(block, need);
    let [points, triangles] = block
        .cells
        .iter()
        .map(|c| kept(block, c, limits))
        .fold([0; 2], |[p, t], [more, triangles]| [p + more, t + triangles]);
    let colors =
        if block.triangle_colors.is_empty() { 0 } else { size_of_val(&block.triangle_colors[0]) };
    let triangle = size_of::<TriangleRecord>() + colors;
    [(points * size_of::<PointRecord>()) as u64, (triangles * triangle) as u64]
}

#[cfg(test)]
mod tests;
