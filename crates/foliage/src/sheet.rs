//! Grid meshes: groups of thin branches as textured sheets that are bent along the group
//! (Candussi, Candussi, Höllerer 2005: "grid meshes to approximate groups of smaller branches").

use crate::panel::{Flat, Panel};
use crate::tensor::principal_axes;
use forest_raster::Surfaces;
use forest_soup::TriangleSoup;
use glam::{DMat3, DVec2, DVec3};

/// Texels of a cell of the grid along a side.
const CELL: f64 = 16.0;

/// Most cells along a side.
const MOST_CELLS: u32 = 12;

/// The sheets of wood `triangles` (two, crossed, along the main axis of their corners), with texels of
/// this size.
pub(crate) fn sheets(
    soup: &TriangleSoup,
    surfaces: &Surfaces,
    triangles: &[u32],
    texel: f64,
) -> Vec<Panel> {
    let corners: Vec<DVec3> =
        triangles.iter().flat_map(|&i| soup.corners(i as usize)).map(|p| p.as_dvec3()).collect();
    let center = corners.iter().sum::<DVec3>() / corners.len().max(1) as f64;
    let mut spread = [0.0; 6];
    for p in &corners {
        let d = *p - center;
        let products = [d.x * d.x, d.y * d.y, d.z * d.z, d.x * d.y, d.x * d.z, d.y * d.z];
        spread.iter_mut().zip(products).for_each(|(s, p)| *s += p);
    }
    let (_, axes) = principal_axes(spread);
    let crossed = DMat3::from_cols(axes.x_axis, axes.z_axis, -axes.y_axis);
    let sheet = |axes: DMat3| {
        let to_sheet = axes.transpose();
        let corners = corners.iter().map(|p| to_sheet * (*p - center)).collect();
        let flat = Flat { soup, triangles: triangles.to_vec(), corners };
        let mut panel = Panel::of(&flat, surfaces, center, axes, texel)?;
        bend(&mut panel, &flat, center);
        Some(panel)
    };
    [axes, crossed].into_iter().filter_map(sheet).collect()
}

/// Bends a flat panel to the heights of what it shows.
fn bend(panel: &mut Panel, flat: &Flat, center: DVec3) {
    let cells = |texels: u32| ((f64::from(texels) / CELL).round() as u32).clamp(1, MOST_CELLS);
    let [m, n] = panel.size.map(cells);
    panel.cells = [m, n];
    let half = panel.half();
    let middle = (panel.axes.transpose() * (panel.center - center)).truncate();
    let (columns, rows) = (m as usize + 1, n as usize + 1);
    let mut sums = vec![(0.0, 0.0); columns * rows];
    for p in &flat.corners {
        let at = (p.truncate() - middle) / half;
        let at = DVec2::new(0.5 * (at.x + 1.0) * f64::from(m), 0.5 * (1.0 - at.y) * f64::from(n));
        let cell = at.floor().clamp(DVec2::ZERO, DVec2::new(f64::from(m - 1), f64::from(n - 1)));
        let f = (at - cell).clamp(DVec2::ZERO, DVec2::ONE);
        for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let weight =
                (if dx == 1 { f.x } else { 1.0 - f.x }) * (if dy == 1 { f.y } else { 1.0 - f.y });
            let sum = &mut sums[(cell.y as usize + dy) * columns + cell.x as usize + dx];
            *sum = (sum.0 + weight * p.z, sum.1 + weight);
        }
    }
    panel.heights = filled(sums, columns);
}

/// Weighted means; corners near nothing take those of their neighbours.
fn filled(sums: Vec<(f64, f64)>, columns: usize) -> Vec<f64> {
    let rows = sums.len() / columns;
    let known = |s: &(f64, f64)| s.1 > 1e-9;
    let mut heights: Vec<Option<f64>> = sums.iter().map(|s| known(s).then(|| s.0 / s.1)).collect();
    while heights.iter().any(Option::is_none) {
        let before = heights.clone();
        for i in (0..heights.len()).filter(|i| before[*i].is_none()) {
            let (x, y) = (i % columns, i / columns);
            let beside = [
                (x > 0).then(|| i - 1),
                (x + 1 < columns).then_some(i + 1),
                (y > 0).then(|| i - columns),
                (y + 1 < rows).then_some(i + columns),
            ];
            let near: Vec<f64> = beside.into_iter().flatten().filter_map(|j| before[j]).collect();
            if !near.is_empty() {
                heights[i] = Some(near.iter().sum::<f64>() / near.len() as f64);
            }
        }
        if heights == before {
            break;
        }
    }
    heights.into_iter().map(|h| h.unwrap_or(0.0)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_near_nothing_take_their_neighbours_heights() {
        let sums = vec![(2.0, 1.0), (0.0, 0.0), (0.0, 0.0), (0.0, 0.0), (8.0, 2.0), (0.0, 0.0)];
        assert_eq!(filled(sums, 3), [2.0, 3.0, 3.5, 3.0, 4.0, 4.0]);
        assert_eq!(filled(vec![(0.0, 0.0); 4], 2), [0.0; 4]);
    }
}
