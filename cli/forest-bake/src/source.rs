//! Reading the block that a command works on.

use crate::log::Log;
use anyhow::{Context, Result};
use forest_import::{Block, Limits};
use forest_pack::header::{Meta, Source};
use forest_soup::{Model, TriangleSoup};
use std::time::Instant;

/// Which files, and what they may hold.
#[derive(clap::Args)]
pub(crate) struct SourceArgs {
    /// Trees: FILE, or FILE@x,y,z:yaw=DEGREES,scale=FACTOR for several placed together; or one
    /// block file (.toml). The file - is standard input.
    #[arg(required = true, value_name = "TREE")]
    trees: Vec<String>,
    #[command(flatten)]
    import: ImportArgs,
}

/// What source files may hold.
#[derive(clap::Args)]
pub(crate) struct ImportArgs {
    /// Refuse blocks of more triangles.
    #[arg(long, default_value_t = 50_000_000, value_name = "N")]
    max_triangles: u64,
    /// Read files outside the folder of the file that names them.
    #[arg(long)]
    allow_outside: bool,
}

/// A block, as its files hold it.
pub(crate) struct ReadSource {
    pub(crate) model: Model,
    pub(crate) meta: Meta,
    /// Trees in the block.
    pub(crate) trees: usize,
    /// Triangles that it may have.
    pub(crate) max_triangles: u64,
    /// The files, as they were named.
    pub(crate) name: String,
    start: Instant,
    /// Time of reading.
    pub(crate) seconds: f64,
}

/// A block, flattened.
pub(crate) struct LoadedSource {
    pub(crate) soup: TriangleSoup,
    pub(crate) meta: Meta,
    /// Trees in the block.
    pub(crate) trees: usize,
    /// Time of reading and flattening.
    pub(crate) seconds: f64,
}

impl SourceArgs {
    /// Reads and flattens; warnings go to stderr.
    pub(crate) fn load(&self, log: Log) -> Result<LoadedSource> {
        self.import.load(&self.trees, log)
    }

    /// Reads; warnings go to stderr.
    pub(crate) fn read(&self, log: Log) -> Result<ReadSource> {
        self.import.read(&self.trees, log)
    }
}

impl ImportArgs {
    /// What files may claim.
    pub(crate) fn limits(&self) -> Limits {
        Limits { allow_outside: self.allow_outside, ..Limits::default() }
    }

    /// Reads and flattens `trees`; warnings go to stderr.
    pub(crate) fn load(&self, trees: &[String], log: Log) -> Result<LoadedSource> {
        self.read(trees, log)?.flatten()
    }

    fn read(&self, trees: &[String], log: Log) -> Result<ReadSource> {
        let start = Instant::now();
        let block = Block::parse(trees)?;
        let loaded = block.load(&self.limits())?;
        loaded.warnings.iter().for_each(|w| log.warn(w));
        let sources: Vec<Source> = block
            .parts
            .iter()
            .zip(&loaded.hashes)
            .map(|(part, &hash)| Source {
                name: part.file.file_name().unwrap_or_default().to_string_lossy().into_owned(),
                hash,
                placement: part.placement_text(),
            })
            .collect();
        Ok(ReadSource {
            model: loaded.model,
            meta: meta(sources),
            trees: block.parts.len(),
            max_triangles: self.max_triangles,
            name: trees.join(" "),
            start,
            seconds: start.elapsed().as_secs_f64(),
        })
    }
}

impl ReadSource {
    /// All trees as one soup.
    pub(crate) fn flatten(self) -> Result<LoadedSource> {
        let Self { model, meta, trees, name, .. } = self;
        let soup = model.flatten(self.max_triangles).context(name)?;
        Ok(LoadedSource { soup, meta, trees, seconds: self.start.elapsed().as_secs_f64() })
    }
}

/// What a pack says of where it comes from.
pub(crate) fn meta(sources: Vec<Source>) -> Meta {
    let mut hasher = blake3::Hasher::new();
    for s in &sources {
        hasher.update(&s.hash);
        hasher.update(&(s.placement.len() as u64).to_le_bytes());
        hasher.update(s.placement.as_bytes());
    }
    Meta {
        generator: concat!("forest-bake ", env!("CARGO_PKG_VERSION")).into(),
        source_hash: *hasher.finalize().as_bytes(),
        sources,
        options: Vec::new(),
    }
}

/// The options of a points bake that describe the representation.
#[derive(clap::Args)]
pub(crate) struct PointsOptions {
    /// Cells along x, up and z, as 4x4x4; "auto" takes 64 near-cubes for one tree, 1024 for several.
    #[arg(long, default_value = "auto", value_name = "XxYxZ")]
    grid: String,
    /// Largest extent of the finest points in world units; "auto" is 1/256 of the height;
    /// "triangle" makes one point of each triangle.
    #[arg(long, default_value = "auto", value_name = "LENGTH", allow_hyphen_values = true)]
    surfel_size: String,
    /// Cut textured cards until this share of their alpha footprint at most is wrong.
    #[arg(long, default_value_t = 0.1, value_name = "SHARE", allow_hyphen_values = true)]
    alpha_tolerance: f64,
}

impl PointsOptions {
    pub(crate) fn bake_options(&self, trees: usize) -> Result<forest_points::BakeOptions> {
        use crate::failure::Usage;
        use forest_points::{GridChoice, SurfelSize};
        let surfel_size = match self.surfel_size.as_str() {
            "auto" => SurfelSize::Auto,
            "triangle" => SurfelSize::Triangle,
            text => SurfelSize::Units(text.parse().map_err(|_| {
                Usage(format!("--surfel-size {text:?}: a length, \"auto\" or \"triangle\""))
            })?),
        };
        let grid = match self.grid.as_str() {
            "auto" if trees == 1 => GridChoice::TREE,
            "auto" => GridChoice::GROUP,
            text => {
                let cells: Option<Vec<u32>> = text.split('x').map(|n| n.parse().ok()).collect();
                let cells = cells.and_then(|c| <[u32; 3]>::try_from(c).ok());
                let wrong =
                    || Usage(format!("--grid {text:?}: three numbers like 4x4x4, or \"auto\""));
                GridChoice::Fixed(cells.ok_or_else(wrong)?)
            }
        };
        let alpha_tolerance = self.alpha_tolerance;
        Ok(forest_points::BakeOptions { grid, surfel_size, alpha_tolerance, ..Default::default() })
    }
}
