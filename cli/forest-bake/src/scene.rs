//! `forest-bake scene`.

use crate::failure::Usage;
use crate::log::Log;
use crate::output;
use anyhow::Result;
use forest_scene::{
    ForestSpec, FractalSpec, HeightmapSpec, Instance, Land, LandSpec, PathSpec, Scene, SceneFile,
    Sight, Sky, SpeciesSpec, SunSpec, instances, open_land, plant, read_file, write_file,
};
use std::path::{Path, PathBuf};

/// Make a landscape of packs, or plant the trees of a scene file anew.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Packs: FILE or FILE:weight=SHARE,scale=LEAST-MOST,height=METRES; or one scene file (.toml),
    /// whose trees are planted as it says.
    #[arg(required = true, value_name = "PACK")]
    packs: Vec<String>,
    /// Scene file to write (.toml); the table of trees is written beside it (.trees).
    #[arg(short, long, value_name = "TOML", required_unless_present = "plant")]
    output: Option<PathBuf>,
    /// Only plant the trees of a scene file, into the table that it names.
    #[arg(long, conflicts_with = "output")]
    plant: bool,
    /// Expected number of trees.
    #[arg(long, default_value_t = 10_000.0, value_name = "N")]
    trees: f64,
    /// Metres along a side of the land; default: 80 m² a tree.
    #[arg(long, value_name = "METRES")]
    size: Option<f64>,
    /// Seed of the terrain and of the trees.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Side of a square of the scatter in metres.
    #[arg(long, default_value_t = 16.0, value_name = "METRES")]
    square: f64,
    /// Share of the largest perturbation in a square, 0 to 1.
    #[arg(long, default_value_t = 1.0, value_name = "SHARE")]
    jitter: f64,
    /// Picture over the land: trees are as rare as it is dark.
    #[arg(long, value_name = "IMAGE")]
    density: Option<PathBuf>,
    /// Diamond-square terrain: cells along a side, a power of two; default: of about 8 m.
    #[arg(long, value_name = "N")]
    cells: Option<u32>,
    /// Its x: the first offsets lie within this many metres; default: a 40th of the land.
    #[arg(long, value_name = "METRES", allow_hyphen_values = true)]
    range: Option<f64>,
    /// Its y: offsets shrink by 2^-y a step; smooth from about 0.8.
    #[arg(long, default_value_t = 1.0, value_name = "Y", allow_hyphen_values = true)]
    smoothness: f64,
    /// Heights from a picture (16-bit PNG, EXR) instead.
    #[arg(long, value_name = "IMAGE", conflicts_with_all = ["cells", "range", "smoothness"])]
    heightmap: Option<PathBuf>,
    /// Heights where the picture is 0 and 1, in metres.
    #[arg(long, value_names = ["LOWEST", "HIGHEST"], num_args = 2, allow_hyphen_values = true)]
    #[arg(requires = "heightmap")]
    heights: Option<Vec<f64>>,
    /// Replace the scene file and the table of trees.
    #[arg(long)]
    force: bool,
}

pub(crate) fn run(args: &Args, log: Log) -> Result<()> {
    let path = match (&args.output, &args.packs[..]) {
        (None, [scene]) => PathBuf::from(scene),
        (None, _) => return Err(Usage("--plant takes one scene file".into()).into()),
        (Some(output), packs) => {
            make(args, output, packs)?;
            output.clone()
        }
    };
    let folder = path.parent().unwrap_or(Path::new("."));
    let file = read_file(&path)?;
    let land = open_land(&path, folder, &file)?;
    let trees = plant(&path, &file, &land)?;
    let table = file.forest.instances.as_ref();
    let table = table.ok_or_else(|| Usage(format!("{}: names no instances", path.display())))?;
    instances::write(&folder.join(table), &trees)?;
    // Whatever the packs have to say.
    let scene = Scene::open(&path)?;
    if log.says() {
        eprintln!("{}", describe(&path, &scene.land, &scene.trees));
    }
    Ok(())
}

/// Writes the scene file.
fn make(args: &Args, output: &Path, packs: &[String]) -> Result<()> {
    output::check_target(output, "toml")?;
    let table = output.with_extension("trees");
    for path in [output, &table] {
        if path.exists() && !args.force {
            return Err(Usage(format!("{}: is there already; --force", path.display())).into());
        }
    }
    let size = args.size.unwrap_or_else(|| (args.trees * 80.0).sqrt().max(50.0));
    let beside = |p: &Path| relative(p, output);
    let heights = args.heights.as_deref().unwrap_or(&[0.0, 100.0]);
    let file = SceneFile {
        seed: args.seed,
        land: LandSpec {
            size,
            fractal: args.heightmap.is_none().then(|| FractalSpec {
                cells: args.cells.unwrap_or_else(|| usual_cells(size)),
                range: args.range.unwrap_or(size / 40.0),
                smoothness: args.smoothness,
            }),
            heightmap: args.heightmap.as_ref().map(|f| HeightmapSpec {
                file: beside(f),
                lowest: heights[0],
                highest: heights[1],
            }),
            ..LandSpec::default()
        },
        forest: ForestSpec {
            trees: args.trees,
            square: args.square,
            jitter: args.jitter,
            density: args.density.as_deref().map(beside),
            instances: table.file_name().map(PathBuf::from),
        },
        sun: SunSpec::default(),
        sky: Sky::default(),
        species: packs.iter().map(|p| species(p, output)).collect::<Result<_>>()?,
        cameras: cameras(size),
        paths: vec![PathSpec {
            name: "flight".into(),
            cameras: ["aerial", "overview", "within"].map(String::from).into(),
            frames: 60,
        }],
    };
    file.validate().map_err(|(key, problem)| Usage(format!("{key}: {problem}")))?;
    Ok(write_file(output, &file)?)
}

/// Cells of about 8 m.
fn usual_cells(size: f64) -> u32 {
    let cells = (size / 8.0).clamp(2.0, 4096.0) as u32;
    cells.next_power_of_two()
}

/// Views that any land has: from above its southern border, from over the trees, from among them.
fn cameras(size: f64) -> Vec<Sight> {
    let sight = |name: &str, z: f64, above: f64, pitch: f64| Sight {
        name: name.into(),
        at: [0.0, z * size],
        above,
        yaw: 0.0,
        pitch,
        fov: 45.0,
    };
    let high = (0.06 * size).clamp(40.0, 300.0);
    vec![
        sight("overview", 0.45, 0.2 * high + 20.0, -4.0),
        sight("aerial", 0.48, high, -14.0),
        sight("within", 0.3, 2.0, 4.0),
    ]
}

/// "FILE:weight=2,scale=0.8-1.2,height=18".
fn species(text: &str, output: &Path) -> Result<SpeciesSpec> {
    let (file, options) = match text.rsplit_once(':') {
        Some((file, options)) if options.contains('=') => (file, options),
        _ => (text, ""),
    };
    let wrong = |what: &str| Usage(format!("{text}: {what}"));
    let number = |v: &str| v.parse::<f64>().map_err(|_| wrong(&format!("{v:?} is not a number")));
    let mut spec = SpeciesSpec { pack: relative(Path::new(file), output), ..Default::default() };
    for option in options.split(',').filter(|o| !o.is_empty()) {
        match option.split_once('=') {
            Some(("weight", v)) => spec.weight = number(v)?,
            Some(("height", v)) => spec.height = Some(number(v)?),
            Some(("scale", v)) => {
                let (least, most) = v.split_once('-').unwrap_or((v, v));
                spec.scale = [number(least)?, number(most)?];
            }
            _ => return Err(wrong(&format!("{option:?}: weight=, scale= or height=")).into()),
        }
    }
    Ok(spec)
}

/// How a file that `output` lies beside names `path`.
fn relative(path: &Path, output: &Path) -> PathBuf {
    let folder = output.parent().unwrap_or(Path::new(""));
    match path.strip_prefix(folder) {
        Ok(inside) => inside.into(),
        Err(_) => std::path::absolute(path).unwrap_or_else(|_| path.into()),
    }
}

fn describe(path: &Path, land: &Land, trees: &[Instance]) -> String {
    let [low, high] = land.range();
    let [x, z] = land.size;
    let count = output::count(trees.len() as u64);
    let name = path.display();
    format!("{name}: {count} trees on {x:.0} m by {z:.0} m, {low:.0} to {high:.0} m high")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn species_are_read_from_words() {
        let s = species("a/oak.fpack:weight=2,scale=0.5-1.5,height=18", Path::new("a/x.toml"));
        let s = s.unwrap();
        assert_eq!((s.pack, s.weight), (PathBuf::from("oak.fpack"), 2.0));
        assert_eq!((s.scale, s.height), ([0.5, 1.5], Some(18.0)));
        assert!(species("oak.fpack:width=3", Path::new("x.toml")).is_err());
        assert_eq!(species("oak.fpack", Path::new("x.toml")).unwrap().scale, [0.8, 1.2]);
    }
}
