//! `forest-bake needs`.

use crate::failure::Usage;
use crate::output;
use anyhow::{Context, Result, bail};
use bytesize::ByteSize;
use forest_foliage::FoliageBlock;
use forest_pack::{Pack, PackWriter, kind};
use forest_points::{PixelArea, PointsBlock, PointsNeed, PruneReport, Thresholds, prune};
use forest_scene::{
    Fineness, Scene, SpeciesNeed, needs, solve, within_bytes, within_error, write_file,
};
use forest_soup::{Camera, Projection};
use forest_views::{Channels, Lookup, ViewsBlock};
use glam::DVec3;
use serde::Serialize;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Work out what a scene's cameras, or any from a nearest distance, can ever draw of packs, and write
/// packs without the rest. From there their pictures are those of the whole packs, sample by sample.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// One scene file (.toml), or packs with --nearest.
    #[arg(required = true, value_name = "SCENE|PACK")]
    inputs: Vec<PathBuf>,
    /// Folder to write packs to, and the scene file that names them; it is made if need be.
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,
    /// Packs: distance of the eye from the tree's box at least, in world units of the pack, or as 3m, 4km.
    #[arg(long, value_name = "DISTANCE", value_parser = distance)]
    nearest: Option<f64>,
    /// Height of pictures in pixels.
    #[arg(long, default_value_t = 1080, value_name = "PX")]
    height: u32,
    /// Packs: height of pictures in degrees, at least. (Cameras of scenes have their own.)
    #[arg(long, default_value_t = 45.0, value_name = "DEGREES")]
    fov: f64,
    /// s_m, smallest projected area of a point that is asked for, in square pixels.
    #[arg(long, default_value_t = 1.0, value_name = "PX2")]
    finest: f64,
    /// s_M that is asked for; default: 16 times s_m.
    #[arg(long, value_name = "PX2")]
    largest: Option<f64>,
    /// Scenes: how many times as large as they are as fine as points views may be drawn, as for forest-view;
    /// 0 for points alone, which leaves the views out.
    #[arg(long, default_value_t = 1.0, value_name = "TIMES")]
    impostors: f64,
    /// Scenes: most bytes of all packs together: what is needed most is kept, by what trees fill of the
    /// pictures and the packs' measured tables (eval --embed).
    #[arg(long, value_name = "BYTES", conflicts_with = "max_error")]
    max_bytes: Option<ByteSize>,
    /// Scenes: the smallest packs whose pictures are expected to be off by no more: mean FLIP, trees alone.
    #[arg(long, value_name = "ERROR")]
    max_error: Option<f64>,
    /// Packs: largest size of a view's texel in pixels that is asked for.
    #[arg(long, default_value_t = 1.0, value_name = "PX")]
    texel: f64,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    /// Replace packs in the folder.
    #[arg(long)]
    force: bool,
}

/// What landscapes draw of views.
const LANDSCAPE_CHANNELS: Channels = Channels { depth: true, ..Channels::COLOR };

/// What became of all packs.
#[derive(Serialize)]
struct Report {
    packs: Vec<Row>,
    #[serde(skip_serializing_if = "Option::is_none")]
    budget: Option<Budget>,
}

/// What became of a pack.
#[derive(Serialize)]
struct Row {
    pack: String,
    bytes: [u64; 2],
    #[serde(flatten)]
    kept: PruneReport,
    /// Levels of views of the pack and of the pruned one.
    view_levels: [usize; 2],
}

pub(crate) fn run(args: &Args) -> Result<()> {
    let thresholds = thresholds(args)?;
    std::fs::create_dir_all(&args.output).with_context(|| args.output.display().to_string())?;
    let report = match &args.inputs[..] {
        [scene] if scene.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) => {
            of_scene(args, scene, thresholds)?
        }
        packs => of_packs(args, packs, thresholds)?,
    };
    let text = match args.json {
        true => format!("{}\n", serde_json::to_string_pretty(&report)?),
        false => table(&report)?,
    };
    Ok(output::print(&text)?)
}

fn thresholds(args: &Args) -> Result<[f64; 2]> {
    let largest = args.largest.unwrap_or(args.finest * Thresholds::LARGEST_RATIO);
    let sound = |v: f64| v.is_finite() && v >= 0.0;
    if !(sound(args.finest) && sound(largest) && largest >= args.finest) {
        let text = format!("--finest {} --largest {largest}: not areas", args.finest);
        return Err(Usage(format!("{text}, the first the smaller")).into());
    }
    if !(0.1..=170.0).contains(&args.fov) || args.height == 0 {
        return Err(Usage("--fov must be within 0.1 and 170, --height above 0".into()).into());
    }
    Ok([args.finest, largest])
}

/// Prunes all packs of a scene, and writes the scene anew. Landscapes are drawn of points, triangles and
/// views: volumes are left out.
fn of_scene(args: &Args, path: &Path, thresholds: [f64; 2]) -> Result<Report> {
    let scene = Scene::open(path)?;
    let [finest, largest] = thresholds.map(PixelArea);
    let drawn = Fineness { height: args.height, finest, largest, impostors: args.impostors };
    let (needs, budget) = match (args.max_bytes.map(|b| b.0), args.max_error) {
        (None, None) => (needs(&scene, &drawn)?, None),
        limits => {
            let (needs, budget) = within(&scene, &drawn, limits)?;
            (needs, Some(budget))
        }
    };
    let folder = path.parent().unwrap_or(Path::new("."));
    let whole = |p: &PathBuf| std::path::absolute(folder.join(p)).unwrap_or_else(|_| p.clone());
    let mut file = scene.file.clone();
    file.land.heightmap.iter_mut().for_each(|m| m.file = whole(&m.file));
    file.forest.density = file.forest.density.as_ref().map(whole);
    file.forest.instances = file.forest.instances.as_ref().map(whole);
    let mut rows = Vec::new();
    for (i, (species, need)) in scene.species.iter().zip(&needs).enumerate() {
        let stem = species.pack.path().file_name().context("a pack without a name")?;
        let name = format!("{i}-{}", stem.to_string_lossy());
        rows.push(write(args, &species.pack, &name, need, LANDSCAPE_CHANNELS)?);
        file.species[i].pack = PathBuf::from(name);
        // As the whole pack has it: its box stays, but be sure.
        file.species[i].anchor = Some(species.stance.anchor.to_array());
    }
    let name = path.file_name().context("a scene without a name")?;
    write_file(&args.output.join(name), &file)?;
    let bytes = rows.iter().map(|r| r.bytes[1]).sum::<u64>();
    match args.max_bytes {
        Some(most) if bytes > most.0 => {
            bail!("{}: {bytes} bytes; asked for {most}", name.display())
        }
        _ => Ok(Report { packs: rows, budget }),
    }
}

/// What was chosen for a budget.
#[derive(Serialize)]
struct Budget {
    /// Expected mean FLIP of the pictures, what trees fill of them.
    error: f64,
    /// Bytes and expected errors of the best choices, the smallest first.
    front: Vec<(u64, f64)>,
}

/// The needs of the best packs within a number of bytes, or an error.
fn within(
    scene: &Scene,
    drawn: &Fineness,
    limits: (Option<u64>, Option<f64>),
) -> Result<(Vec<SpeciesNeed>, Budget)> {
    let solved = solve(scene, drawn)?;
    let (first, last) = (&solved.front[0], &solved.front[solved.front.len() - 1]);
    let chosen = match limits {
        (Some(bytes), _) => within_bytes(&solved.front, bytes).ok_or_else(|| {
            Usage(format!("--max-bytes {bytes}: the smallest packs have {} bytes", first.bytes))
        })?,
        (_, most) => {
            let most = most.unwrap_or_default();
            within_error(&solved.front, most).ok_or_else(|| {
                Usage(format!("--max-error {most}: the finest packs have {:.5}", last.error))
            })?
        }
    };
    let front = solved.front.iter().map(|c| (c.bytes, c.error)).collect();
    Ok((solved.needs(chosen), Budget { error: chosen.error, front }))
}

fn of_packs(args: &Args, packs: &[PathBuf], [finest, largest]: [f64; 2]) -> Result<Report> {
    if args.max_bytes.is_some() || args.max_error.is_some() {
        return Err(Usage("--max-bytes and --max-error are for scenes".into()).into());
    }
    let nearest = args.nearest.ok_or_else(|| Usage("packs need --nearest".into()))?;
    let tall = 2.0 * (args.fov.to_radians() * 0.5).tan() * nearest;
    let pixels = f64::from(args.height) / tall;
    let area = |px: f64| px / (pixels * pixels);
    let points = PointsNeed { finest: area(finest), largest: area(largest) };
    let one = |path: &PathBuf| {
        let pack = Pack::open(path)?;
        let name = path.file_name().context("a pack without a name")?.to_string_lossy();
        let views = match ViewsBlock::is_in(&pack) {
            true => Some(levels(&ViewsBlock::open(&pack)?, nearest, args)),
            false => None,
        };
        write(args, &pack, &name, &SpeciesNeed { points, views }, Channels::ALL)
    };
    let packs = packs.iter().map(one).collect::<Result<_>>()?;
    Ok(Report { packs, budget: None })
}

/// Writes packs without what is not drawn from `--nearest` on; tells nothing.
pub(crate) fn keep(args: &Args) -> Result<()> {
    of_packs(args, &args.inputs, thresholds(args)?)?;
    Ok(())
}

/// The levels of views that a camera draws whose eye is so far from the tree's box, or farther.
fn levels(views: &ViewsBlock, nearest: f64, args: &Args) -> std::ops::Range<usize> {
    let projection = Projection::Perspective { fov_y: args.fov.to_radians() };
    let eye = views.center() + DVec3::Z * nearest;
    let camera = Camera::new(eye, -DVec3::Z, projection, [args.height; 2]);
    let finest = forest_views::select(views, &camera, Lookup::Nearest, args.texel).level;
    finest..views.header.levels.len()
}

/// Writes a pruned pack: of its views, these channels. Volumes stay where they may be drawn: in packs
/// that no scene names.
fn write(
    args: &Args,
    pack: &Pack,
    name: &str,
    need: &SpeciesNeed,
    channels: Channels,
) -> Result<Row> {
    let target = args.output.join(name);
    if target.exists() && !args.force {
        let text = format!("{}: is there already; --force", target.display());
        return Err(Usage(text).into());
    }
    let block = PointsBlock::open(pack)?;
    let mut writer = PackWriter::create(&target)?;
    let kept = prune(pack, &block, &need.points, &mut writer)?;
    let mut view_levels = [0; 2];
    if ViewsBlock::is_in(pack) {
        let views = ViewsBlock::open(pack)?;
        view_levels[0] = views.header.levels.len();
        if let Some(levels) = &need.views {
            view_levels[1] = levels.len();
            forest_views::prune(&views, levels.clone(), channels, &mut writer)?;
        }
    }
    let of_scene = args.nearest.is_none();
    let keeps_foliage = !of_scene && FoliageBlock::is_in(pack);
    let rest = |kind: u16| match kind {
        // Foliage is drawn with them, even where no triangle of the points is left.
        kind::MATERIALS | kind::TEXTURE => keeps_foliage && kept.triangles[1] == 0,
        kind::POINTS_HEADER..kind::VOLUME_HEADER | kind::WIND_POINTS | kind::WIND_TRIANGLES => {
            false
        }
        // What points and views show of the light.
        kind::LIGHT_CROWN => true,
        kind::VOLUME_HEADER.. => !of_scene,
        _ => true,
    };
    for (id, _) in pack.sections().filter(|(id, _)| rest(id.kind)) {
        writer.copy(pack, id)?;
    }
    writer.finish()?;
    crate::target::tie(&target)?;
    let bytes = [pack.file_length(), std::fs::metadata(&target)?.len()];
    Ok(Row { pack: target.display().to_string(), bytes, kept, view_levels })
}

fn table(report: &Report) -> Result<String, std::fmt::Error> {
    let mut text = String::new();
    for r in &report.packs {
        let part =
            |[all, kept]: [u64; 2]| format!("{} of {}", output::count(kept), output::count(all));
        let [before, after] = r.bytes;
        let views = match r.view_levels {
            [0, _] => String::new(),
            [all, kept] => format!(", levels of views {kept} of {all}"),
        };
        writeln!(
            text,
            "{}: {} of {}; points {}, triangles {}{views}",
            r.pack,
            output::bytes(after),
            output::bytes(before),
            part(r.kept.points),
            part(r.kept.triangles)
        )?;
    }
    if let Some(budget) = &report.budget {
        writeln!(
            text,
            "expected error {:.5} (mean FLIP of the pictures; trees alone)",
            budget.error
        )?;
        writeln!(text, "      bytes   error")?;
        let last = budget.front.len() - 1;
        let rows = last.min(SHOWN - 1);
        for k in 0..=rows {
            let (bytes, error) = budget.front[k * last / rows.max(1)];
            writeln!(text, "{:>11}  {error:.5}", output::bytes(bytes))?;
        }
    }
    Ok(text)
}

/// Rows of the table of errors by bytes.
const SHOWN: usize = 12;

/// "3", "3m", "4km".
fn distance(text: &str) -> Result<f64, String> {
    let (number, unit) = match (text.strip_suffix("km"), text.strip_suffix('m')) {
        (Some(n), _) => (n, 1000.0),
        (None, Some(n)) => (n, 1.0),
        (None, None) => (text, 1.0),
    };
    match number.trim().parse::<f64>() {
        Ok(v) if v > 0.0 && v.is_finite() => Ok(v * unit),
        _ => Err("a distance above 0, as 3, 3m or 4km".into()),
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn distances_have_units() {
        let of = super::distance;
        assert_eq!((of("3"), of("2.5m"), of("4km")), (Ok(3.0), Ok(2.5), Ok(4000.0)));
        assert!(of("-1m").is_err() && of("far").is_err());
    }
}
