//! Blocks that do not fit in memory: their triangles are sorted into cells on disk, and mapped some cells at a time.
//!
//! Three passes over the pieces of a model: its box; how many triangles lie in each cell; and the triangles
//! themselves, each to its place. In memory stay four bytes a triangle, and buffers.

use crate::bake::encode::{Laid, UvBounds};
use crate::bake::grid::{Grid, NO_CELL};
use crate::bake::surfel::estimate;
use forest_pack::{PackError, Scratch, ScratchPart};
use forest_soup::{Bounds, Pieces, TriangleSoup};
use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

/// Bytes of triangles that wait to be written.
const WAITING: usize = 256 << 20;

/// Pieces whose triangles are made at once.
const AT_ONCE: usize = 64;

/// Triangles on disk, by cell.
pub(crate) struct Spill {
    scratch: Scratch,
    record: Record,
    /// Cell `c` holds the triangles from `starts[c]` to `starts[c + 1]`.
    starts: Vec<u64>,
}

/// What is known of all triangles before their grid is.
pub(crate) struct Outline {
    pub(crate) bounds: Bounds,
    pub(crate) uv_bounds: UvBounds,
    pub(crate) vertex_alpha: bool,
    pub(crate) colors: bool,
}

impl Outline {
    /// The first pass.
    pub(crate) fn of(pieces: &Pieces, laid: &Laid) -> Self {
        let empty = || Self {
            bounds: Bounds::EMPTY,
            uv_bounds: laid.empty(),
            vertex_alpha: false,
            colors: false,
        };
        let one = |k| {
            let soup = pieces.soup(k);
            Self {
                bounds: soup.bounds(),
                uv_bounds: laid.uv_bounds(&soup),
                vertex_alpha: soup.colors.iter().any(|c| c[3] != 1.0),
                colors: !soup.colors.is_empty(),
            }
        };
        (0..pieces.len()).into_par_iter().map(one).reduce(empty, |a, b| Self {
            bounds: a.bounds.union(b.bounds),
            uv_bounds: a.uv_bounds.union(b.uv_bounds),
            vertex_alpha: a.vertex_alpha | b.vertex_alpha,
            colors: a.colors | b.colors,
        })
    }
}

/// The triangles by cell, before they are written.
pub(crate) struct Sorted {
    /// The cell of each triangle, by piece.
    of: Vec<Vec<u32>>,
    starts: Vec<u64>,
    pub(crate) non_finite: u64,
    /// Longest edge of the box around a cell's triangles, in block units.
    pub(crate) widest: f64,
    /// Surfels that each cell will make, from above.
    pub(crate) estimates: Vec<f64>,
}

/// What a piece adds to a cell.
struct Share {
    triangles: u64,
    bounds: Bounds,
    estimate: f64,
}

impl Sorted {
    /// The second pass; `size` is that of surfels.
    pub(crate) fn of(pieces: &Pieces, grid: &Grid, size: f64) -> Self {
        let cells = grid.len();
        let by_piece: Vec<_> = (0..pieces.len())
            .into_par_iter()
            .map(|k| {
                let soup = pieces.soup(k);
                let of: Vec<u32> =
                    (0..soup.triangles.len()).map(|t| grid.cell_of(soup.corners(t))).collect();
                let mut shares = BTreeMap::new();
                for (t, &cell) in of.iter().enumerate() {
                    let share = shares.entry(cell).or_insert_with(Share::none);
                    share.add(soup.corners(t).map(|p| grid.frame.map(p)), size);
                }
                (of, shares)
            })
            .collect();
        let mut boxes = vec![Bounds::EMPTY; cells];
        let mut sorted = Self {
            of: Vec::with_capacity(by_piece.len()),
            starts: vec![0; cells + 1],
            non_finite: 0,
            widest: 0.0,
            estimates: vec![0.0; cells],
        };
        for (of, shares) in by_piece {
            for (cell, share) in shares {
                let c = cell as usize;
                if cell == NO_CELL {
                    sorted.non_finite += share.triangles;
                    continue;
                }
                sorted.starts[c + 1] += share.triangles;
                boxes[c] = boxes[c].union(share.bounds);
                sorted.estimates[c] += share.estimate;
            }
            sorted.of.push(of);
        }
        (0..cells).for_each(|c| sorted.starts[c + 1] += sorted.starts[c]);
        let edges = boxes.iter().filter(|b| !b.is_empty()).map(|b| b.size().max_element());
        sorted.widest = edges.fold(0.0, f64::max);
        sorted
    }
}

impl Share {
    fn none() -> Self {
        Self { triangles: 0, bounds: Bounds::EMPTY, estimate: 0.0 }
    }

    fn add(&mut self, corners: [DVec3; 3], size: f64) {
        self.triangles += 1;
        self.bounds = corners.into_iter().fold(self.bounds, Bounds::with);
        self.estimate += estimate(corners, size);
    }
}

impl Spill {
    /// The third pass, to a file in the folder of `target`.
    ///
    /// # Errors
    /// When the disk is full.
    pub(crate) fn write(pieces: &Pieces, sorted: Sorted, target: &Path) -> Result<Self, PackError> {
        let Sorted { of, starts, .. } = sorted;
        let first = pieces.soup(0);
        let record = Record {
            normals: !first.normals.is_empty(),
            uvs: !first.uvs.is_empty(),
            colors: !first.colors.is_empty(),
        };
        let mut scratch = Scratch::beside(target)?;
        let mut next = starts.clone();
        let mut waiting = vec![Vec::new(); starts.len() - 1];
        let mut bytes = 0;
        for (at, of) in of.chunks(AT_ONCE).enumerate() {
            let first = at * AT_ONCE;
            let soups: Vec<TriangleSoup> =
                (first..first + of.len()).into_par_iter().map(|k| pieces.soup(k)).collect();
            for (soup, cells) in soups.iter().zip(of) {
                for (t, &cell) in cells.iter().enumerate().filter(|(_, c)| **c != NO_CELL) {
                    record.put(soup, t, &mut waiting[cell as usize]);
                    bytes += record.size();
                }
            }
            if bytes > WAITING || first + of.len() == pieces.len() {
                for (cell, waiting) in waiting.iter_mut().enumerate() {
                    scratch.write(next[cell] * record.size() as u64, waiting)?;
                    next[cell] += (waiting.len() / record.size()) as u64;
                    // Pieces are near each other: other cells will have the next ones.
                    *waiting = Vec::new();
                }
                bytes = 0;
            }
        }
        Ok(Self { scratch, record, starts })
    }

    pub(crate) fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// Triangles in cell `c`.
    pub(crate) fn count(&self, c: usize) -> u64 {
        self.starts[c + 1] - self.starts[c]
    }

    /// Maps the triangles of some cells.
    ///
    /// # Errors
    /// When memory cannot be mapped.
    pub(crate) fn cells(&self, cells: Range<usize>) -> Result<SpilledCells<'_>, PackError> {
        let at = |c: usize| self.starts[c] * self.record.size() as u64;
        let part = self.scratch.map(at(cells.start)..at(cells.end))?;
        Ok(SpilledCells { spill: self, first: self.starts[cells.start], part })
    }
}

/// Cells that are mapped.
pub(crate) struct SpilledCells<'a> {
    spill: &'a Spill,
    /// The first triangle that is mapped.
    first: u64,
    part: ScratchPart<'a>,
}

impl SpilledCells<'_> {
    /// The triangles of cell `c`, one of the mapped; without materials.
    pub(crate) fn soup(&self, c: usize) -> TriangleSoup {
        let size = self.spill.record.size();
        let at = |t: u64| (t - self.first) as usize * size;
        let range = at(self.spill.starts[c])..at(self.spill.starts[c + 1]);
        self.spill.record.soup(&self.part.bytes()[range])
    }
}

/// What is kept of a triangle, corner by corner, as the soup has it: little of it is spent on what is not there.
#[derive(Clone, Copy)]
struct Record {
    normals: bool,
    uvs: bool,
    colors: bool,
}

const CORNERS: usize = 3;

impl Record {
    /// Bytes of a triangle: its material, then for each corner what there is.
    fn size(self) -> usize {
        let corner = size_of::<Vec3>()
            + usize::from(self.normals) * size_of::<Vec3>()
            + usize::from(self.uvs) * size_of::<Vec2>()
            + usize::from(self.colors) * size_of::<[f32; 4]>();
        size_of::<u16>() + CORNERS * corner
    }

    fn put(self, soup: &TriangleSoup, t: usize, out: &mut Vec<u8>) {
        out.extend_from_slice(&soup.triangle_materials[t].to_ne_bytes());
        for v in soup.triangles[t].map(|v| v as usize) {
            out.extend_from_slice(bytemuck::bytes_of(&soup.positions[v].to_array()));
            if self.normals {
                out.extend_from_slice(bytemuck::bytes_of(&soup.normals[v].to_array()));
            }
            if self.uvs {
                out.extend_from_slice(bytemuck::bytes_of(&soup.uvs[v].to_array()));
            }
            if self.colors {
                out.extend_from_slice(bytemuck::bytes_of(&soup.colors[v]));
            }
        }
    }

    fn soup(self, bytes: &[u8]) -> TriangleSoup {
        let count = bytes.len() / self.size();
        let mut soup = TriangleSoup {
            triangles: (0..count as u32).map(|t| [0, 1, 2].map(|k| 3 * t + k)).collect(),
            ..TriangleSoup::default()
        };
        for triangle in bytes.chunks_exact(self.size()) {
            let (material, mut rest) = triangle.split_at(size_of::<u16>());
            soup.triangle_materials.push(bytemuck::pod_read_unaligned(material));
            for _ in 0..CORNERS {
                soup.positions.push(take::<[f32; 3]>(&mut rest).into());
                if self.normals {
                    soup.normals.push(take::<[f32; 3]>(&mut rest).into());
                }
                if self.uvs {
                    soup.uvs.push(take::<[f32; 2]>(&mut rest).into());
                }
                if self.colors {
                    soup.colors.push(take(&mut rest));
                }
            }
        }
        soup
    }
}

/// The next value of some bytes.
fn take<T: bytemuck::AnyBitPattern>(bytes: &mut &[u8]) -> T {
    let (head, rest) = bytes.split_at(size_of::<T>());
    *bytes = rest;
    bytemuck::pod_read_unaligned(head)
}
