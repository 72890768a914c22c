//! The triangles of a bake, cell by cell: of a soup in memory, or of a spill on disk.

use crate::bake::frame::BlockFrame;
use crate::bake::grid::CellLists;
use crate::bake::spill::{Spill, SpilledCells};
use forest_pack::PackError;
use forest_soup::{Bounds, TriangleSoup};
use std::borrow::Cow;
use std::ops::Range;

/// All cells of a grid.
pub(crate) enum Cells<'a> {
    Memory { soup: &'a TriangleSoup, lists: CellLists },
    Disk(Spill),
}

/// Some of them, in reach.
pub(crate) enum CellBatch<'a> {
    Memory { soup: &'a TriangleSoup, lists: &'a CellLists },
    Disk(SpilledCells<'a>),
}

/// The triangles of one cell, in the order of the source.
pub(crate) struct CellSoup<'a> {
    /// A soup whose materials do not count.
    pub(crate) soup: Cow<'a, TriangleSoup>,
    /// Which of its triangles lie in the cell.
    pub(crate) list: Cow<'a, [u32]>,
}

impl Cells<'_> {
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Memory { lists, .. } => lists.len(),
            Self::Disk(spill) => spill.len(),
        }
    }

    /// Triangles in cell `c`.
    pub(crate) fn count(&self, c: usize) -> u64 {
        match self {
            Self::Memory { lists, .. } => lists.of(c).len() as u64,
            Self::Disk(spill) => spill.count(c),
        }
    }

    /// Brings cells in reach.
    pub(crate) fn batch(&self, cells: Range<usize>) -> Result<CellBatch<'_>, PackError> {
        Ok(match self {
            Self::Memory { soup, lists } => CellBatch::Memory { soup, lists },
            Self::Disk(spill) => CellBatch::Disk(spill.cells(cells)?),
        })
    }
}

impl CellBatch<'_> {
    /// Cell `c`, one of the batch.
    pub(crate) fn cell(&self, c: usize) -> CellSoup<'_> {
        match self {
            Self::Memory { soup, lists } => {
                CellSoup { soup: Cow::Borrowed(soup), list: lists.of(c).into() }
            }
            Self::Disk(cells) => {
                let soup = cells.soup(c);
                let list = (0..soup.triangles.len() as u32).collect();
                CellSoup { soup: Cow::Owned(soup), list: Cow::Owned(list) }
            }
        }
    }
}

impl CellSoup<'_> {
    /// The box around the cell's triangles, in block space.
    pub(crate) fn bounds(&self, frame: &BlockFrame) -> Bounds {
        let corners = self.list.iter().flat_map(|&t| self.soup.corners(t as usize));
        corners.fold(Bounds::EMPTY, |b, p| b.with(frame.map(p)))
    }
}
