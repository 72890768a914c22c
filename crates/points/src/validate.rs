//! The rules of SPEC.md, section 5: used by the reader, the command line, tests and fuzzing.

use crate::block::PointsBlock;
use crate::header::CellRecord;
use crate::options::{Order, RadiusRule};
use crate::record::PointRecord;
use crate::size::SizeCode;
use forest_pack::kind;
use std::collections::BTreeSet;

/// The section kind and the broken rule.
type Broken = (u16, String);

/// Exponents of real blocks: from far below an atom to far above a galaxy, in metres.
const EXPONENTS: std::ops::RangeInclusive<i32> = -200..=200;

/// Cells of the largest grid.
pub(crate) const MOST_CELLS: u64 = 1 << 20;

/// The smallest surfel size, in block units: the step of a position in a block of one cell.
pub(crate) const SMALLEST_SURFEL: f64 = 1.0 / 65_536.0;

/// Checks every invariant of a points representation that selection and renderers rely on.
///
/// # Errors
/// The kind of the section and the first rule it breaks, with element, value and limit.
pub fn validate(block: &PointsBlock) -> Result<(), (u16, String)> {
    header(block)?;
    cells(block)?;
    if let Some(pruned) = &block.pruned {
        pruned.validate(block).map_err(|problem| (kind::POINTS_PRUNED, problem))?;
    }
    for (i, cell) in block.cells.iter().enumerate() {
        points(block, i, cell)?;
        triangles(block, i, cell)?;
    }
    Ok(())
}

fn header(block: &PointsBlock) -> Result<(), Broken> {
    let h = &block.header;
    let rule = |ok: bool, problem: String| {
        if ok { Ok(()) } else { Err((kind::POINTS_HEADER, problem)) }
    };
    rule(h.origin.iter().all(|v| v.is_finite()), format!("origin {:?}", h.origin))?;
    rule(EXPONENTS.contains(&h.exponent), format!("exponent {} not in {EXPONENTS:?}", h.exponent))?;
    let s = h.step_exponent;
    rule((-30..=0).contains(&s), format!("step exponent {s} not in -30..=0"))?;
    let inside = |v: &f64| (-1.0..=1.0).contains(v);
    rule(
        h.min.iter().chain(&h.max).all(inside) && h.min.iter().zip(&h.max).all(|(a, b)| a <= b),
        format!("box {:?}..{:?} is not in the unit cube", h.min, h.max),
    )?;
    let s = h.surfel_size;
    rule(s >= SMALLEST_SURFEL, format!("surfel size {s} block units, below {SMALLEST_SURFEL}"))?;
    let t = h.alpha_tolerance;
    rule((0.0..=1.0).contains(&t), format!("alpha tolerance {t} not in 0..=1"))?;
    let cells = h.grid.iter().try_fold(1u64, |cells, &n| cells.checked_mul(u64::from(n)));
    rule(
        cells.is_some_and(|n| (1..=MOST_CELLS).contains(&n)),
        format!("a grid of {:?} cells; at least 1 and at most {MOST_CELLS}", h.grid),
    )?;
    let finite = |v: &[f32; 2]| v.iter().all(|x| x.is_finite());
    rule(
        h.uv_ranges.iter().all(|r| finite(&r.min) && finite(&r.step)),
        "a texture coordinate range is not finite".into(),
    )?;
    let c = &h.counts;
    let dropped = [c.non_finite, c.zero_area, c.duplicate, c.transparent];
    let dropped = dropped.iter().try_fold(0u64, |sum, &n| sum.checked_add(n));
    rule(
        dropped.is_some_and(|n| n <= c.source_triangles),
        format!("more triangles dropped than the source's {}", c.source_triangles),
    )?;
    let n = block.points.len();
    rule(c.points == n as u64, format!("{} points; the array has {n}", c.points))
}

fn cells(block: &PointsBlock) -> Result<(), Broken> {
    let broken =
        |i: usize, problem: String| Err((kind::POINTS_CELLS, format!("cell {i}: {problem}")));
    let (mut point, mut triangle, mut surfels) = (0u64, 0u64, 0u64);
    for (i, cell) in block.cells.iter().enumerate() {
        if u64::from(cell.first_point) != point || u64::from(cell.first_triangle) != triangle {
            return broken(
                i,
                format!(
                    "starts at point {} and triangle {}; the cells before end at {point} and {triangle}",
                    cell.first_point, cell.first_triangle
                ),
            );
        }
        point += u64::from(cell.points);
        triangle += u64::from(cell.triangles);
        surfels += u64::from(cell.surfels);
        if cell.center.iter().any(|v| v.is_nan() || v.abs() > 1.5)
            || !(0.0..=2.0).contains(&cell.radius)
        {
            return broken(
                i,
                format!("centre {:?}, radius {}: outside the block", cell.center, cell.radius),
            );
        }
        if cell.step_shift > 16 || cell.origin.iter().any(|v| v.unsigned_abs() > 1 << 30) {
            return broken(
                i,
                format!("origin {:?}, step shift {} (at most 16)", cell.origin, cell.step_shift),
            );
        }
        if cell.top > 1 || cell.is_top() != (i + 1 == block.cells.len()) || cell.reserved != 0 {
            return broken(
                i,
                format!(
                    "top {}, reserved {}; only the last cell is the top",
                    cell.top, cell.reserved
                ),
            );
        }
        if SizeCode::from_bits(cell.root_parent).is_none() {
            return broken(
                i,
                format!("root's parent has size {}; the limit is 4095", cell.root_parent),
            );
        }
    }
    let Some((top, cells)) = block.cells.split_last() else {
        return Err((kind::POINTS_CELLS, "no cell".into()));
    };
    let ends = [
        (kind::POINTS, point, block.points.len()),
        (kind::POINTS_TRIANGLES, triangle, block.triangles.len()),
    ];
    for (kind, cells, array) in ends {
        if cells != array as u64 {
            return Err((kind, format!("{array} records; the cells hold {cells}")));
        }
    }
    top_cell(block, top, cells).map_err(|problem| (kind::POINTS_CELLS, problem))?;
    let (stored, kept) = (block.triangles.len() as u64, block.header.counts.triangles());
    let fits = if block.pruned.is_some() { stored <= kept } else { stored == kept };
    if stored != 0 && !fits {
        let problem = format!("{stored} triangles; the header's counts leave {kept}");
        return Err((kind::POINTS_TRIANGLES, problem));
    }
    let colors = block.triangle_colors.len();
    if colors != 0 && colors != block.triangles.len() {
        let problem = format!("{colors} colours for {} triangles", block.triangles.len());
        return Err((kind::POINTS_TRIANGLE_COLORS, problem));
    }
    if surfels != block.header.counts.surfels {
        let problem = format!("{surfels} surfels; the header says {}", block.header.counts.surfels);
        return Err((kind::POINTS_CELLS, problem));
    }
    Ok(())
}

/// The block's own tree: no triangles, no surfels, and above every cell exactly if it has points.
fn top_cell(block: &PointsBlock, top: &CellRecord, cells: &[CellRecord]) -> Result<(), String> {
    let infinite = SizeCode::INFINITE.bits();
    if top.triangles != 0 || top.surfels != 0 || top.root_parent != infinite {
        return Err(format!(
            "the block's own tree has {} triangles, {} surfels, parent {}; it must have none",
            top.triangles, top.surfels, top.root_parent
        ));
    }
    if block.header.order == Order::Paper && top.points != 0 {
        return Err(format!("the paper's order has no tree above the cells, of {}", top.points));
    }
    // A cell's root hangs under a point of this tree: it has that point's size.
    let sizes: BTreeSet<u16> = block.cell_points(top).iter().map(|p| p.own().bits()).collect();
    for (i, cell) in cells.iter().enumerate() {
        let parent = cell.root_parent;
        let fits = if sizes.is_empty() { parent == infinite } else { sizes.contains(&parent) };
        if !fits {
            return Err(format!("cell {i}: no point of the block's own tree has size {parent}"));
        }
    }
    Ok(())
}

fn points(block: &PointsBlock, i: usize, cell: &CellRecord) -> Result<(), Broken> {
    let points = block.cell_points(cell);
    let broken =
        |k: usize, problem: String| Err((kind::POINTS, format!("cell {i}, point {k}: {problem}")));
    let exact = block.header.order == Order::Exact;
    let key = |p: &PointRecord| if exact { p.parent() } else { p.own() };
    let (mut leaves, mut roots) = (0u32, 0u32);
    for (k, p) in points.iter().enumerate() {
        if k > 0 && key(&points[k - 1]) < key(p) {
            return broken(k, "out of order".into());
        }
        if p.own() > SizeCode::MAX {
            return broken(
                k,
                format!("size {}; the limit is {}", p.own().bits(), SizeCode::MAX.bits()),
            );
        }
        if exact && p.own() > p.parent() {
            let (own, parent) = (p.own().bits(), p.parent().bits());
            return broken(k, format!("size {own} is larger than its parent's {parent}"));
        }
        if p.opacity == 0 || p.axis.contains(&0) {
            return broken(
                k,
                format!("opacity {}, axis {:?}: neither may be 0", p.opacity, p.axis),
            );
        }
        if p.is_leaf() && p.flatness_step() != 0 && block.header.radius != RadiusRule::Paper {
            return broken(k, format!("a surfel of flatness {}", p.flatness_step()));
        }
        leaves += u32::from(p.is_leaf());
        roots += u32::from(p.parent() == SizeCode::INFINITE);
    }
    if leaves != cell.surfels || (roots != 1 && !points.is_empty()) {
        let want = cell.surfels;
        return broken(0, format!("{leaves} surfels (of {want}) and {roots} roots (of 1)"));
    }
    if points.is_empty() && !cell.is_top() {
        return broken(0, "the cell is empty".into());
    }
    let root = points.iter().find(|p| p.parent() == SizeCode::INFINITE);
    if exact && root.is_some_and(|r| r.own().bits() > cell.root_parent) {
        return broken(0, format!("the root is larger than its parent's {}", cell.root_parent));
    }
    Ok(())
}

fn triangles(block: &PointsBlock, i: usize, cell: &CellRecord) -> Result<(), Broken> {
    let materials = block.header.uv_ranges.len();
    let triangles = block.cell_triangles(cell);
    for (k, t) in triangles.iter().enumerate() {
        let problem = if t.size > SizeCode::MAX.bits() {
            format!("size {}; the limit is {}", t.size, SizeCode::MAX.bits())
        } else if k > 0 && triangles[k - 1].size < t.size {
            "out of order".into()
        } else if t.material as usize >= materials {
            format!("material {} of {materials}", t.material)
        } else {
            continue;
        };
        return Err((kind::POINTS_TRIANGLES, format!("cell {i}, triangle {k}: {problem}")));
    }
    Ok(())
}
