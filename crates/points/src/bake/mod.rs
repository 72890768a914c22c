//! The bake: soup → sections of a pack, cell by cell.

pub(crate) mod audit;
mod cell;
mod cells;
mod cluster;
mod encode;
mod frame;
mod grid;
mod lattice;
mod node;
mod principal;
mod spill;
mod surfel;
pub(crate) mod timing;
mod union;

use crate::bake::cell::{BakedCell, CellBaker};
use crate::bake::cells::Cells;
use crate::bake::cluster::Leaves;
use crate::bake::encode::{Laid, TriangleEncoder};
use crate::bake::frame::BlockFrame;
use crate::bake::grid::{CellLists, Grid};
use crate::bake::lattice::Lattice;
use crate::bake::node::Node;
use crate::bake::spill::{Outline, Sorted, Spill};
use crate::bake::surfel::{SurfelMaker, SurfelShader};
use crate::bake::timing::StageTimes;
use crate::header::{BakeCounts, CellRecord, PointsHeader};
use crate::materials::write_materials;
use crate::options::{BakeOptions, Order};
use crate::size::SizeCode;
use crate::validate::MOST_CELLS;
use forest_pack::{Codec, PackError, PackWriter, SectionId, Spool, header, kind};
use forest_soup::{Bounds, FlattenError, InvalidSoup, Material, Model, Texture, TriangleSoup};
use glam::DVec3;
use rayon::prelude::*;
use std::io::Write;
use std::path::Path;
use std::sync::Arc;

/// Surfels (as estimated) whose cells are baked before they are written: bounds a bake's memory.
const BATCH: f64 = (1u64 << 22) as f64;

/// Surfels that a bake may be estimated to make: their points still have 32-bit indices.
const MOST_SURFELS: f64 = (1u64 << 31) as f64;

/// Why a soup could not be baked.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BakeError {
    /// The soup breaks its own rules.
    #[error(transparent)]
    Soup(#[from] InvalidSoup),
    /// The model cannot be laid out.
    #[error(transparent)]
    Model(#[from] FlattenError),
    /// No triangle is left.
    #[error("no visible triangle: {0}")]
    NothingVisible(BakeCounts),
    /// More points than a 32-bit index can name.
    #[error("the bake makes {0} points; the limit is {max} (use a larger --surfel-size)", max = u32::MAX)]
    TooManyPoints(u64),
    /// An option that makes no sense.
    #[error("{option} is {value}; it must be {rule}")]
    Option {
        /// Its name on the command line.
        option: &'static str,
        /// What it was set to.
        value: String,
        /// What it may be.
        rule: &'static str,
    },
    /// The pack could not be written.
    #[error(transparent)]
    Pack(#[from] PackError),
}

/// What a bake did.
#[derive(Clone, Debug)]
pub struct BakeReport {
    /// The header that was written.
    pub header: PointsHeader,
    /// Cells with points in them.
    pub cells: usize,
    /// Where the time went.
    pub times: StageTimes,
}

/// Bakes `soup` and adds the sections of the points representation to `writer`. `progress` is told
/// how many of the source's triangles are done.
///
/// The same soup and options give the same bytes, whatever the number of threads.
///
/// # Errors
/// When the soup is invalid or nothing of it is visible, or the pack cannot be written.
pub fn bake(
    soup: &TriangleSoup,
    options: &BakeOptions,
    writer: &mut PackWriter,
    progress: &dyn Fn(u64),
) -> Result<BakeReport, BakeError> {
    run(Preparation::of_soup(soup, options)?, writer, progress)
}

/// As [`bake()`] of the flattened model, byte by byte, but in little memory: the model's triangles (at most
/// `max_triangles`) go to a file in the folder of the pack, cell by cell, and come back some cells at a time.
///
/// # Errors
/// As [`bake()`], and when the model has too many triangles or the file cannot be written.
pub fn bake_model(
    model: Model,
    max_triangles: u64,
    options: &BakeOptions,
    writer: &mut PackWriter,
    progress: &dyn Fn(u64),
) -> Result<BakeReport, BakeError> {
    let ready = Preparation::of_model(model, max_triangles, options, writer.path())?;
    run(ready, writer, progress)
}

fn run(
    ready: Preparation,
    writer: &mut PackWriter,
    progress: &dyn Fn(u64),
) -> Result<BakeReport, BakeError> {
    let mut times = ready.times;
    let shader = times.shade.time(|| ready.shader());
    let Preparation { grid, cells, baker, estimates, .. } = &ready;
    let mut counts = ready.counts;
    let uv_ranges = baker.encoder.as_ref().map_or(vec![], |e| e.uv_ranges.clone());

    let mut sections = Sections::beside(writer.path());
    let mut done = 0u64;
    let estimate: f64 = estimates.iter().sum();
    if estimate > MOST_SURFELS {
        return Err(BakeError::TooManyPoints(estimate as u64));
    }
    for batch in batches(estimates) {
        let near = cells.batch(batch.clone())?;
        let baked: Vec<_> = batch
            .clone()
            .into_par_iter()
            .map_init(
                || SurfelMaker::new(&shader),
                |maker, c| {
                    let mut counts = BakeCounts::default();
                    let mut times = StageTimes::default();
                    let cell = baker.bake(&near.cell(c), maker, &mut counts, &mut times);
                    (cell, counts, times)
                },
            )
            .collect();
        for (c, (cell, cell_counts, cell_times)) in batch.zip(baked) {
            counts.add(&cell_counts);
            times.add(&cell_times);
            if let Some(cell) = cell {
                times.write.time(|| sections.push(c as u32, cell))?;
            }
            done += cells.count(c);
            progress(done);
        }
    }
    if sections.cells.is_empty() {
        return Err(BakeError::NothingVisible(counts));
    }
    counts.points += sections.push_top(baker)?;
    let (frame, options) = (grid.frame, baker.options);
    let header = PointsHeader {
        origin: (ready.origin + frame.center).to_array(),
        exponent: frame.exponent,
        step_exponent: baker.lattice.exponent,
        min: frame.bounds.min.to_array(),
        max: frame.bounds.max.to_array(),
        grid: grid.dims,
        order: options.order,
        radius: options.radius,
        surfel_size: surfel::size(&frame, options),
        alpha_tolerance: options.alpha_tolerance,
        counts,
        uv_ranges,
    };
    let cells = sections.roots.len();
    times.write.time(|| {
        sections.write(&header, writer)?;
        if options.triangles {
            write_materials(writer, &ready.materials, &ready.textures)?;
        }
        Ok::<_, BakeError>(())
    })?;
    Ok(BakeReport { header, cells, times })
}

/// What comes before the first cell.
pub(crate) struct Preparation<'a> {
    origin: DVec3,
    materials: Vec<Material>,
    textures: Vec<Arc<Texture>>,
    vertex_alpha: bool,
    grid: Grid,
    pub(crate) cells: Cells<'a>,
    pub(crate) baker: CellBaker<'a>,
    pub(crate) counts: BakeCounts,
    /// Surfels of each cell, from above.
    estimates: Vec<f64>,
    times: StageTimes,
}

impl<'a> Preparation<'a> {
    pub(crate) fn of_soup(
        soup: &'a TriangleSoup,
        options: &'a BakeOptions,
    ) -> Result<Self, BakeError> {
        check(options)?;
        soup.validate()?;
        let mut times = StageTimes::default();
        let mut counts =
            BakeCounts { source_triangles: soup.triangles.len() as u64, ..Default::default() };
        let Some((grid, lists)) = times.grid.time(|| {
            let grid = Grid::new(BlockFrame::of(soup.bounds())?, options.grid);
            let lists = CellLists::new(soup, &grid);
            Some((grid, lists))
        }) else {
            return Err(BakeError::NothingVisible(count_unusable(soup, counts)));
        };
        counts.non_finite = lists.non_finite;
        let encoder = times.triangles.time(|| {
            options.triangles.then(|| {
                let laid = Laid::new(&soup.materials, &soup.textures);
                let bounds = laid.uv_bounds(soup);
                TriangleEncoder::new(grid.frame, laid, bounds, !soup.colors.is_empty())
            })
        });
        let size = surfel::size(&grid.frame, options);
        let in_block = |t: u32| soup.corners(t as usize).map(|p| grid.frame.map(p));
        let (widest, estimates) = times.grid.time(|| {
            let of_cell = |c: usize| {
                let cell = lists.of(c);
                let corners = cell.iter().flat_map(|&t| in_block(t));
                let bounds = corners.fold(Bounds::EMPTY, Bounds::with);
                let widest = if cell.is_empty() { 0.0 } else { bounds.size().max_element() };
                (widest, cell.iter().map(|&t| surfel::estimate(in_block(t), size)).sum::<f64>())
            };
            let of_cells: Vec<_> = (0..lists.len()).into_par_iter().map(of_cell).collect();
            let widest = of_cells.iter().fold(0.0, |most: f64, (widest, _)| most.max(*widest));
            (widest, of_cells.into_iter().map(|(_, estimate)| estimate).collect())
        });
        let lattice = Lattice::for_extent(widest);
        Ok(Self {
            origin: soup.origin,
            materials: soup.materials.clone(),
            textures: soup.textures.clone(),
            vertex_alpha: soup.colors.par_iter().any(|c| c[3] != 1.0),
            baker: CellBaker { frame: grid.frame, lattice, options, encoder },
            grid,
            cells: Cells::Memory { soup, lists },
            counts,
            estimates,
            times,
        })
    }

    /// The triangles of `model` go to a file in the folder of `target`.
    fn of_model(
        model: Model,
        max_triangles: u64,
        options: &'a BakeOptions,
        target: &Path,
    ) -> Result<Self, BakeError> {
        check(options)?;
        model.validate()?;
        let pieces = model.pieces(max_triangles)?;
        let mut times = StageTimes::default();
        let mut counts =
            BakeCounts { source_triangles: model.triangle_count(), ..Default::default() };
        let laid = Laid::new(&model.materials, &model.textures);
        let outline = times.grid.time(|| Outline::of(&pieces, &laid));
        let Some(frame) = BlockFrame::of(outline.bounds) else {
            for k in 0..pieces.len() {
                let soup = pieces.soup(k);
                let piece = BakeCounts {
                    source_triangles: soup.triangles.len() as u64,
                    ..BakeCounts::default()
                };
                let unusable = count_unusable(&soup, piece);
                counts.non_finite += unusable.non_finite;
                counts.zero_area += unusable.zero_area;
            }
            return Err(BakeError::NothingVisible(counts));
        };
        let grid = Grid::new(frame, options.grid);
        let size = surfel::size(&frame, options);
        let mut sorted = times.grid.time(|| Sorted::of(&pieces, &grid, size));
        counts.non_finite = sorted.non_finite;
        let (estimates, widest) = (std::mem::take(&mut sorted.estimates), sorted.widest);
        let spill = times.write.time(|| Spill::write(&pieces, sorted, target))?;
        let encoder = options
            .triangles
            .then(|| TriangleEncoder::new(frame, laid, outline.uv_bounds, outline.colors));
        let lattice = Lattice::for_extent(widest);
        Ok(Self {
            origin: pieces.origin(),
            vertex_alpha: outline.vertex_alpha,
            baker: CellBaker { frame, lattice, options, encoder },
            grid,
            cells: Cells::Disk(spill),
            counts,
            estimates,
            times,
            // The meshes are not needed any more.
            materials: model.materials,
            textures: model.textures,
        })
    }

    pub(crate) fn shader(&self) -> SurfelShader<'_> {
        let Self { materials, textures, grid, baker, .. } = self;
        SurfelShader::new(materials, textures, self.vertex_alpha, grid.frame, baker.options)
    }
}

fn check(options: &BakeOptions) -> Result<(), BakeError> {
    let fail = |option, value: String, rule| Err(BakeError::Option { option, value, rule });
    if let crate::SurfelSize::Units(s) = options.surfel_size
        && !(s.is_finite() && s > 0.0)
    {
        return fail("--surfel-size", s.to_string(), "a positive length");
    }
    let t = options.alpha_tolerance;
    if !(0.0..=1.0).contains(&t) {
        return fail("--alpha-tolerance", t.to_string(), "between 0 and 1");
    }
    if let crate::GridChoice::Fixed(n) = options.grid
        && (n.contains(&0) || cells_of(n).is_none_or(|cells| cells > MOST_CELLS))
    {
        return fail(
            "--grid",
            format!("{n:?}"),
            "at least 1 along each axis and 2^20 cells in all",
        );
    }
    Ok(())
}

fn cells_of(grid: [u32; 3]) -> Option<u64> {
    grid.iter().try_fold(1u64, |cells, &n| cells.checked_mul(u64::from(n)))
}

/// Counts of a soup that has no extent at all.
fn count_unusable(soup: &TriangleSoup, mut counts: BakeCounts) -> BakeCounts {
    let finite = |i: usize| soup.corners(i).iter().all(|p| p.is_finite());
    counts.non_finite = (0..soup.triangles.len()).filter(|&i| !finite(i)).count() as u64;
    counts.zero_area = counts.source_triangles - counts.non_finite;
    counts
}

/// Ranges of cells with at most [`BATCH`] surfels each (or one cell).
fn batches(estimates: &[f64]) -> Vec<std::ops::Range<usize>> {
    let mut ranges = Vec::new();
    let (mut start, mut size) = (0, 0.0);
    for (c, estimate) in estimates.iter().enumerate() {
        size += estimate;
        if size > BATCH && c > start {
            ranges.push(start..c);
            (start, size) = (c, *estimate);
        }
    }
    ranges.push(start..estimates.len());
    ranges
}

/// The sections as they grow.
struct Sections {
    cells: Vec<CellRecord>,
    roots: Vec<Node>,
    bounds: Vec<Bounds>,
    points: Spool,
    triangles: Spool,
    colors: Spool,
    point_count: u64,
    triangle_count: u64,
}

impl Sections {
    fn beside(target: &Path) -> Self {
        let [points, triangles, colors] = [(); 3].map(|()| Spool::beside(target));
        let (cells, roots, bounds) = (Vec::new(), Vec::new(), Vec::new());
        Self { cells, roots, bounds, points, triangles, colors, point_count: 0, triangle_count: 0 }
    }

    fn push(&mut self, grid_index: u32, cell: BakedCell) -> Result<(), BakeError> {
        let center = cell.bounds.center();
        let record = CellRecord {
            origin: cell.quantiser.origin,
            first_point: self.point_count as u32,
            points: cell.points.len() as u32,
            first_triangle: self.triangle_count as u32,
            triangles: cell.triangles.len() as u32,
            center: center.as_vec3().to_array(),
            radius: cell.bounds.half_diagonal() as f32,
            root_parent: SizeCode::INFINITE.bits(),
            top: 0,
            grid_index,
            surfels: cell.surfels,
            step_shift: cell.quantiser.shift,
            reserved: 0,
        };
        self.point_count += cell.points.len() as u64;
        self.triangle_count += cell.triangles.len() as u64;
        if self.point_count > u64::from(u32::MAX) {
            return Err(BakeError::TooManyPoints(self.point_count));
        }
        self.cells.push(record);
        self.roots.push(cell.root);
        self.bounds.push(cell.bounds);
        put(&mut self.points, bytemuck::cast_slice(&cell.points))?;
        put(&mut self.triangles, bytemuck::cast_slice(&cell.triangles))?;
        put(&mut self.colors, bytemuck::cast_slice(&cell.colors))
    }

    /// Builds the block's tree over the cells' roots; returns its number of points. The paper's
    /// order has no such tree: its last row is empty.
    fn push_top(&mut self, baker: &CellBaker) -> Result<u64, BakeError> {
        let bounds = self.bounds.iter().fold(Bounds::EMPTY, |all, &b| all.union(b));
        let quantiser = baker.lattice.quantiser(bounds);
        let mut points = Vec::new();
        if baker.options.order == Order::Exact {
            let rules = baker.rules(Leaves::Roots(&self.roots), quantiser);
            let parents = cluster::build_top(&self.roots, &rules, &mut points);
            for (cell, parent) in self.cells.iter_mut().zip(parents) {
                cell.root_parent = parent.bits();
            }
            points = cell::sort(&points, baker.options.order);
        }
        self.cells.push(CellRecord {
            origin: quantiser.origin,
            first_point: self.point_count as u32,
            points: points.len() as u32,
            first_triangle: self.triangle_count as u32,
            triangles: 0,
            center: bounds.center().as_vec3().to_array(),
            radius: bounds.half_diagonal() as f32,
            root_parent: SizeCode::INFINITE.bits(),
            top: 1,
            grid_index: u32::MAX,
            surfels: 0,
            step_shift: quantiser.shift,
            reserved: 0,
        });
        self.point_count += points.len() as u64;
        put(&mut self.points, bytemuck::cast_slice(&points))?;
        Ok(points.len() as u64)
    }

    fn write(self, header: &PointsHeader, writer: &mut PackWriter) -> Result<(), PackError> {
        let id = |kind| SectionId::new(kind, 0);
        header::write(writer, id(kind::POINTS_HEADER), header)?;
        let cells: &[u8] = bytemuck::cast_slice(&self.cells);
        writer.add(id(kind::POINTS_CELLS), Codec::None, cells)?;
        writer.add_spool(id(kind::POINTS), self.points)?;
        if !self.triangles.is_empty() {
            writer.add_spool(id(kind::POINTS_TRIANGLES), self.triangles)?;
        }
        if !self.colors.is_empty() {
            writer.add_spool(id(kind::POINTS_TRIANGLE_COLORS), self.colors)?;
        }
        Ok(())
    }
}

fn put(spool: &mut Spool, bytes: &[u8]) -> Result<(), BakeError> {
    spool.write_all(bytes).map_err(|source| {
        BakeError::Pack(PackError::Io {
            file: Path::new("temporary file of the bake").into(),
            action: "cannot write",
            source,
        })
    })
}
