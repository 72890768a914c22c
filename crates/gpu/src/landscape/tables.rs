//! What shaders know of the species: one table of each thing for all of them.

use crate::error::GpuError;
use crate::landscape::LandscapeDetail;
use crate::landscape::impostors::ViewTables;
use bytemuck::{Pod, Zeroable};
use forest_foliage::sway::USUAL_LIMBER;
use forest_foliage::{FoliageBlock, Sway};
use forest_points::{CellRecord, Order, PointsBlock, SizeCode};
use forest_scene::{Canopy, IMPOSTOR_FADE, STEPS, Species, Stance};
use forest_soup::Camera;
use forest_views::ViewsBlock;
use glam::DVec3;

/// `Species` of trees.wgsl.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct SpeciesRecord {
    center: [f32; 3],
    radius: f32,
    origin: [f32; 3],
    block_unit: f32,
    least: f32,
    step: f32,
    first_cell: u32,
    cells: u32,
    first_code: u32,
    root_parent: i32,
    has_triangles: u32,
    unit: f32,
    first_triangle: u32,
    least_fine: i32,
    pub(crate) first_run: u32,
    pub(crate) runs: u32,
    clump: f32,
    wide: f32,
    tall: f32,
    least_coarse: i32,
    view_center: [f32; 3],
    view_side: f32,
    view_texels: f32,
    view_most: f32,
    view_levels: u32,
    first_level: u32,
    first_frame: u32,
    first_compass: u32,
    limber: f32,
    zero: u32,
}

impl SpeciesRecord {
    /// Metres from which its trees are drawn by views alone; infinity without views.
    pub(crate) fn drawn_by_views_from(&self, camera: &Camera, detail: &LandscapeDetail) -> f64 {
        let largest = f64::from(self.view_most) * detail.impostors * detail.finest.0.sqrt();
        let most_scale = f64::from(self.least + self.step * (STEPS - 1) as f32);
        let metres = f64::from(self.view_side) * most_scale;
        let pixels = camera.pixels_per_unit(1.0) * metres;
        if pixels > 0.0 { metres.max(pixels / (IMPOSTOR_FADE * largest)) } else { f64::INFINITY }
    }
}

/// `Stock` of trees.wgsl.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct StockRecord {
    origin: [f32; 3],
    step: f32,
    center: [f32; 3],
    radius: f32,
    first_point: u32,
    points: u32,
    number: u32,
    root_parent: i32,
    first_triangle: u32,
    triangles: u32,
    is_top: u32,
    triangle_number: u32,
}

/// The tables of all species. Points are uploaded from their memory maps.
#[derive(Debug, Default)]
pub(crate) struct Tables {
    pub(crate) species: Vec<SpeciesRecord>,
    pub(crate) stocks: Vec<StockRecord>,
    pub(crate) radii: Vec<f32>,
    prefixes: Vec<u32>,
    triangle_sizes: Vec<u32>,
    pub(crate) views: ViewTables,
    points: u32,
}

/// Size codes there are, [`SizeCode::INFINITE`] among them.
const CODES: u32 = 4096;

impl Tables {
    /// Adds a species, whose points come after those of the ones before.
    ///
    /// # Errors
    /// When the pack is in the paper's order, which has no valid cut.
    pub(crate) fn add(
        &mut self,
        species: &Species,
        block: &PointsBlock,
        views: Option<&ViewsBlock<'_>>,
    ) -> Result<(), GpuError> {
        if block.header.order != Order::Exact {
            let pack = species.pack.path().display().to_string();
            return Err(GpuError::Missing { pack, what: "points in the exact order".into() });
        }
        let stance = &species.stance;
        let from_foot = |world: DVec3| (world - stance.anchor) * stance.unit;
        let [min, max] = stance.bounds;
        let first_code = self.radii.len() as u32;
        let first_triangle = self.triangle_sizes.len() as u32;
        let first_cell = self.stocks.len() as u32;
        let unit = stance.unit;
        for (i, cell) in (0..).zip(block.cells) {
            self.stocks.push(stock(block, [i, self.points], cell, stance));
        }
        let [least_fine, least_coarse] = block.limits();
        // The block's own tree is the last cell.
        let top = block.cells.last().map_or(&[][..], |c| block.cell_points(c));
        let radius = |code| (block.radius_of(code) * block.scale()) as f32;
        self.radii.extend((0..CODES as u16).filter_map(SizeCode::from_bits).map(radius));
        self.prefixes.extend(
            (0..CODES)
                .map(|fine| top.partition_point(|p| u32::from(p.parent().bits()) > fine) as u32),
        );
        self.triangle_sizes.extend(block.triangles.iter().map(|t| u32::from(t.size)));
        let canopy = Canopy::new(block, stance, Canopy::MOST);
        let views = views.map_or_else(Default::default, |v| self.views.add(v, stance));
        let limber = match FoliageBlock::is_in(&species.pack) {
            true => Sway::limber(&FoliageBlock::open(&species.pack)?),
            false => USUAL_LIMBER,
        };
        let below = block.cells.iter().filter(|c| !c.is_top());
        self.species.push(SpeciesRecord {
            center: ((min + max) * 0.5).as_vec3().to_array(),
            radius: ((max - min).length() * 0.5) as f32,
            origin: from_foot(block.origin()).as_vec3().to_array(),
            block_unit: (block.scale() * unit) as f32,
            least: stance.scale[0] as f32,
            step: ((stance.scale[1] - stance.scale[0]) / f64::from(STEPS - 1)) as f32,
            first_cell,
            cells: block.cells.len() as u32,
            first_code,
            root_parent: below.map(|c| i32::from(c.root_parent)).max().unwrap_or(-1),
            has_triangles: (!block.triangles.is_empty()).into(),
            unit: unit as f32,
            first_triangle,
            least_fine,
            first_run: 0,
            runs: 0,
            clump: canopy.clump() as f32,
            wide: ((max - min).with_y(0.0).length() * 0.5) as f32,
            tall: ((max.y - min.y) * 0.5) as f32,
            least_coarse,
            view_center: views.center,
            view_side: views.side,
            view_texels: views.texels,
            view_most: views.most,
            view_levels: views.levels,
            first_level: views.first_level,
            first_frame: views.first_frame,
            first_compass: views.first_compass,
            limber,
            zero: 0,
        });
        self.points += block.points.len() as u32;
        Ok(())
    }
}

impl Tables {
    /// Prefixes of all species, then size codes of all their triangles: to be asked for once, last.
    pub(crate) fn codes(&mut self) -> Vec<u32> {
        let before = self.prefixes.len() as u32;
        self.species.iter_mut().for_each(|s| s.first_triangle += before);
        [std::mem::take(&mut self.prefixes), std::mem::take(&mut self.triangle_sizes)].concat()
    }
}

/// Cell number `index` of a block whose first point is number `first` of all.
fn stock(
    block: &PointsBlock,
    [index, first]: [u32; 2],
    cell: &CellRecord,
    stance: &Stance,
) -> StockRecord {
    let from_foot = |world: DVec3| ((world - stance.anchor) * stance.unit).as_vec3().to_array();
    let center = DVec3::from_array(cell.center.map(f64::from));
    let metres = block.scale() * stance.unit;
    StockRecord {
        origin: from_foot(block.to_world(block.position(cell, [0; 3]))),
        step: (block.step(cell) * metres) as f32,
        center: from_foot(block.to_world(center)),
        radius: (f64::from(cell.radius) * metres) as f32,
        first_point: cell.first_point + first,
        points: cell.points,
        // Numbers are those of the block alone, whatever was uploaded before it.
        number: block.point_offset(index).wrapping_sub(first),
        root_parent: cell.root_parent.into(),
        first_triangle: cell.first_triangle,
        triangles: cell.triangles,
        is_top: cell.is_top().into(),
        triangle_number: block.triangle_offset(index),
    }
}
