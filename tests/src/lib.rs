//! What tests, the golden packs and the fuzz targets share.

pub mod figures;
pub mod fuzz;
pub mod golden;
pub mod landscapes;
pub mod pictures;
pub mod reference;
pub mod reports;
pub mod screen;
pub mod soups;

use forest_draw::{
    FoliageScene, ViewsLevel, VolumeScene, draw_bent_points, draw_points, read_surfaces,
};
use forest_foliage::{
    BentPoints, CrownLight, FoliageBlock, FoliageError, FoliageOptions, PointsWind, Pose, Wind,
};
use forest_pack::header::{self, Meta};
use forest_pack::measures::{ErrorKind, Light, Measures, Need};
use forest_pack::{Codec, Pack, PackError, PackWriter, SectionId, kind};
use forest_points::{
    BakeError, BakeOptions, BakeReport, PixelArea, PointsBlock, Thresholds, bake, select,
};
use forest_raster::{CaptureScene, Sampling, Style, Surfaces};
use forest_soup::{Camera, Model, Projection, TriangleSoup};
use forest_views::{Frame, Lookup, ViewsBlock, ViewsError, ViewsOptions};
use forest_volume::{
    Blending, CodebookOptions, Detail, Stand, Volume, VolumeBlock, VolumeError, VolumeOptions,
};
use glam::DVec3;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// The bytes of a pack with a fixed `meta` section and what `make` writes, and what that said.
fn written<T, E: From<PackError>>(
    make: impl FnOnce(&mut PackWriter) -> Result<T, E>,
) -> Result<(Vec<u8>, T), E> {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let path = dir.path().join("t.fpack");
    let mut writer = PackWriter::create(&path)?;
    let meta =
        Meta { generator: "test".into(), source_hash: [7; 32], sources: vec![], options: vec![] };
    header::write(&mut writer, SectionId::new(kind::META, 0), &meta)?;
    let made = make(&mut writer)?;
    writer.finish()?;
    Ok((std::fs::read(&path).expect("the pack that was just written"), made))
}

/// Bakes into memory; the pack has a fixed `meta` section.
///
/// # Errors
/// As [`bake`].
pub fn bake_bytes(
    soup: &TriangleSoup,
    options: &BakeOptions,
) -> Result<(Vec<u8>, BakeReport), BakeError> {
    written(|writer| bake(soup, options, writer, &|_| {}))
}

/// [`bake_bytes`] of a model that is not flattened.
///
/// # Errors
/// As [`forest_points::bake_model`].
pub fn bake_model_bytes(
    model: Model,
    options: &BakeOptions,
) -> Result<(Vec<u8>, BakeReport), BakeError> {
    written(|writer| forest_points::bake_model(model, 1 << 24, options, writer, &|_| {}))
}

/// Bakes views into memory; the pack has a fixed `meta` section.
///
/// # Errors
/// As [`forest_views::bake()`].
pub fn bake_views(soup: &TriangleSoup, options: &ViewsOptions) -> Result<Vec<u8>, ViewsError> {
    let frame =
        Frame::of(soup, &options.directions, options.fit).ok_or(ViewsError::NothingToSee)?;
    let surfaces = Surfaces::new(&soup.materials, &soup.textures);
    let mut scene = CaptureScene::new(soup, &surfaces);
    if options.channels.sky {
        scene = scene.with_skylight();
    }
    Ok(written(|writer| forest_views::bake(&scene, &frame, options, writer, &|_| {}))?.0)
}

/// The bytes of a pack of nothing but the volume of a soup, and what its bake said.
///
/// # Errors
/// As the bake.
pub fn bake_volume(
    soup: &TriangleSoup,
    stand: Stand,
    options: &VolumeOptions,
    codebook: Option<&CodebookOptions>,
) -> Result<(Vec<u8>, Volume), VolumeError> {
    let surfaces = Surfaces::new(&soup.materials, &soup.textures);
    let volume = Volume::from_mesh(soup, &surfaces, stand, options, &|_| {})?;
    Ok((write_volume(&volume, codebook)?.0, volume))
}

/// The bytes of a pack of nothing but a volume, and the bake's report.
///
/// # Errors
/// As the bake.
pub fn write_volume(
    volume: &Volume,
    codebook: Option<&CodebookOptions>,
) -> Result<(Vec<u8>, forest_volume::BakeReport), VolumeError> {
    written(|writer| forest_volume::bake(volume, codebook, writer))
}

/// Bakes foliage into memory; the pack has a fixed `meta` section.
///
/// # Errors
/// As [`forest_foliage::bake`].
pub fn bake_foliage(
    soup: &TriangleSoup,
    options: &FoliageOptions,
) -> Result<(Vec<u8>, forest_foliage::BakeReport), FoliageError> {
    written(|writer| forest_foliage::bake(soup, options, writer, &|_| {}))
}

/// One pack of the sections of several; of two alike the first's. Points hang on foliage, if both are there.
///
/// # Panics
/// If a pack is damaged.
pub fn merged(packs: &[Vec<u8>]) -> Vec<u8> {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let path = dir.path().join("t.fpack");
    let mut writer = PackWriter::create(&path).expect("a pack");
    let mut there = BTreeSet::new();
    for pack in packs.iter().map(|bytes| open(bytes).expect("a pack")) {
        for (id, _) in pack.sections().filter(|(id, _)| there.insert(*id)) {
            writer.copy(&pack, id).expect("a section");
        }
    }
    writer.finish().expect("a pack");
    let bytes = std::fs::read(&path).expect("the pack");
    let pack = open(&bytes).expect("a pack");
    if !FoliageBlock::is_in(&pack) || !PointsBlock::is_in(&pack) || there.contains(&TIED) {
        return bytes;
    }
    let (foliage, points) = (FoliageBlock::open(&pack), PointsBlock::open(&pack));
    let wind = PointsWind::new(&foliage.expect("foliage"), &points.expect("points"));
    let mut writer = PackWriter::create(&path).expect("a pack");
    pack.sections().for_each(|(id, _)| writer.copy(&pack, id).expect("a section"));
    wind.write(&mut writer).expect("the wind");
    writer.finish().expect("a pack");
    std::fs::read(&path).expect("the pack")
}

/// Says that points hang on foliage.
const TIED: SectionId = SectionId::new(kind::WIND_POINTS, 0);

/// The trees that a report is about: these of sample-data, and these of ../shared/trees where they
/// are; the others are named on stderr.
pub fn report_trees(samples: &[&str], shared: &[&str]) -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut trees: Vec<PathBuf> =
        samples.iter().map(|t| root.join("sample-data").join(t)).collect();
    for tree in shared {
        let path = root.join("../shared/trees").join(tree);
        if path.exists() {
            trees.push(path);
        } else {
            eprintln!("skipped: {} is not there", path.display());
        }
    }
    trees
}

/// Opens a pack in memory.
///
/// # Errors
/// As [`Pack::open`].
pub fn open(bytes: &[u8]) -> Result<Pack, PackError> {
    Pack::from_bytes(Path::new("test.fpack"), bytes)
}

/// Everything that a viewer would do with an untrusted pack: open, verify, validate, read materials,
/// draw from afar and from inside. Any bytes must end in a value or an error.
///
/// # Errors
/// When the pack breaks a rule.
pub fn use_pack(bytes: &[u8]) -> Result<usize, PackError> {
    let pack = open(bytes)?;
    pack.verify()?;
    header::decode::<Meta>(&pack, SectionId::new(kind::META, 0))?;
    if let Some(table) = Measures::read(&pack)? {
        let need = Need {
            representation: kind::POINTS_HEADER,
            pixel_height: 50.0,
            elevation: Some(9.0),
            light: Light::Albedo,
            error: ErrorKind::Flip,
        };
        table.cheapest(&need, 0.1).or(table.best_within(&need, 1e3));
    }
    if let Some(crown) = CrownLight::read(&pack)? {
        let seen = crown.shade(DVec3::Y).at(DVec3::ONE)[0] * crown.sunlit(DVec3::Y, DVec3::X);
        assert!((0.0..=2.0).contains(&seen));
    }
    let mut drawn = if ViewsBlock::is_in(&pack) { use_views(&pack)? } else { 0 };
    drawn += if VolumeBlock::is_in(&pack) { use_volume(&pack)? } else { 0 };
    drawn += if FoliageBlock::is_in(&pack) { use_foliage(&pack)? } else { 0 };
    if drawn > 0 && !PointsBlock::is_in(&pack) {
        return Ok(drawn);
    }
    let block = PointsBlock::open(&pack)?;
    let surfaces = read_surfaces(&pack, &block)?;
    let foliage = FoliageBlock::is_in(&pack).then(|| FoliageBlock::open(&pack)).transpose()?;
    let gale = Wind { strength: 1.0, time: 2.0, ..Wind::default() };
    let pose = foliage.as_ref().map_or_else(Pose::default, |f| Pose::new(f.branches, &gale, 0.0));
    let wind = match &foliage {
        Some(foliage) => PointsWind::read(&pack, &block, foliage.branches.len())?,
        None => None,
    };
    let bent = foliage.as_ref().zip(wind.as_ref()).map(|(f, w)| BentPoints::new(f, w, &pose));
    let projection = Projection::Perspective { fov_y: 1.0 };
    for distance in [0.0, 1.0, 1e4] {
        let eye = block.origin() + DVec3::Z * (distance * block.scale());
        let camera = Camera::new(eye, -DVec3::Z, projection, [640, 480]);
        let thresholds = Thresholds { depth_bias: PixelArea(3.0), ..Thresholds::default() };
        let cut = select(&block, &camera, &thresholds);
        drawn += cut.points(&block).count() + cut.triangle_count() as usize;
        let small = Camera { width: 16, height: 16, ..camera };
        let style = Style { sampling: Sampling::MIDDLE, ..Style::default() };
        draw_points(&block, surfaces.as_ref(), &small, &thresholds, style);
        if let Some(bent) = &bent {
            draw_bent_points(&block, surfaces.as_ref(), &small, &thresholds, style, bent);
        }
    }
    Ok(drawn)
}

/// Decodes every level of the views and draws it, from afar and from within.
fn use_views(pack: &Pack) -> Result<usize, PackError> {
    let block = ViewsBlock::open(pack)?;
    let style = Style { sampling: Sampling::MIDDLE, ..Style::default() };
    let mut drawn = 0;
    for level in 0..block.header.levels.len() {
        let views = ViewsLevel::read(&block, level)?;
        for (projection, distance) in [
            (Projection::Perspective { fov_y: 1.0 }, 0.0),
            (Projection::Orthographic { height: 2.0 * block.header.half }, 4.0),
        ] {
            let from = DVec3::new(0.3, 0.2, 1.0).normalize();
            let eye = block.center() + from * (distance * block.header.radius);
            let camera = Camera::new(eye, -from, projection, [8, 8]);
            for lookup in Lookup::ALL {
                drawn += views.draw(&camera, lookup, style).1.views as usize;
            }
        }
    }
    Ok(drawn)
}

/// Decodes the volume and draws it, from afar and from within, whole and by planes.
fn use_volume(pack: &Pack) -> Result<usize, PackError> {
    let block = VolumeBlock::open(pack)?;
    let scene = VolumeScene::read(&block)?;
    let (middle, side) = (block.lattice().middle(), block.header.side);
    let mut drawn = 0;
    for (projection, distance) in [
        (Projection::Perspective { fov_y: 1.0 }, 0.1),
        (Projection::Perspective { fov_y: 1.0 }, 3.0),
        (Projection::Orthographic { height: side }, 4.0),
    ] {
        let from = DVec3::new(0.3, 0.2, 1.0).normalize();
        let camera = Camera::new(middle + from * (distance * side), -from, projection, [8, 8]);
        for detail in [Detail::Level(2), Detail::PIXEL] {
            for blending in [Blending::Shares, Blending::Over] {
                let (_, cost) =
                    scene.draw(&camera, detail, blending, Style::from(Sampling::MIDDLE));
                drawn += cost.billboards as usize;
            }
        }
    }
    Ok(drawn)
}

/// Decodes the foliage and draws every level, at rest and in a gale.
fn use_foliage(pack: &Pack) -> Result<usize, PackError> {
    let block = FoliageBlock::open(pack)?;
    let scene = FoliageScene::read(&block)?;
    let style = Style { sampling: Sampling::MIDDLE, ..Style::default() };
    let gale = Wind { strength: 2.0, time: 3.0, ..Wind::default() };
    let mut drawn = 0;
    for distance in [None, Some(0.5), Some(3.0)] {
        let camera = Camera::around(block.bounds(), [20.0, 10.0], distance, [8, 8]);
        block.select(&camera, 1.0);
        for level in 0..block.header.levels.len() {
            for wind in [Wind::default(), gale] {
                scene.draw(&camera, level, &wind, &style);
            }
            drawn += block.header.levels[level].triangles() as usize;
        }
    }
    Ok(drawn)
}

/// A golden pack whose section number `which` is `data` instead:
/// with sound hashes, so that what is tested is the rules, not the hash. `None` for a number that
/// does not exist.
pub fn with_section(golden: &[u8], which: u8, data: &[u8]) -> Option<Vec<u8>> {
    let pack = open(golden).ok()?;
    let ids: Vec<(SectionId, Codec)> = pack.sections().map(|(id, s)| (id, s.codec)).collect();
    let &(replaced, codec) = ids.get(usize::from(which))?;
    let dir = tempfile::tempdir().ok()?;
    let path = dir.path().join("t.fpack");
    let mut writer = PackWriter::create(&path).ok()?;
    for &(id, _) in ids.iter().filter(|(id, _)| *id != replaced) {
        writer.copy(&pack, id).ok()?;
    }
    writer.add(replaced, codec, data).ok()?;
    writer.finish().ok()?;
    std::fs::read(&path).ok()
}
