//! Levels of foliage beside meshoptimizer's at equal triangles: writes docs/FOLIAGE.md and docs/foliage.png.

mod simplified;

use anyhow::{Context, Result};
use forest_draw::FoliageScene;
use forest_eval::{BACKGROUND, Comparison, Errors};
use forest_foliage::{BakeReport, FoliageBlock, FoliageOptions, Wind, WoodWay};
use forest_raster::{Light, Picture, Sampling, Style, Surfaces, rasterize};
use forest_soup::{Camera, TriangleSoup};
use forest_tests::reports::{load_soup, name_of};
use forest_tests::{bake_foliage, open, report_trees};
use simplified::simplified;
use std::fmt::Write;
use std::path::Path;

const SAMPLES: [&str; 2] = ["broadleaf_young.gltf", "conifer.glb"];
const SHARED: [&str; 3] = ["ez_oak_dense_200k.glb", "sap_birch_200k.glb", "ez_ash_medium.glb"];

/// Height of the pictures in which all levels are judged, besides those in which a level's texels are pixels.
const SMALL: u32 = 128;

/// The tree that is pictured, if there are so many.
const PICTURED: usize = 3;

/// Yaw and pitch of the views: none of these is one of the bake's own cameras.
const VIEWS: [[f64; 2]; 5] =
    [[17.0, 3.0], [95.0, 12.0], [171.0, 25.0], [244.0, 45.0], [318.0, 70.0]];

const NOTES: &str = "# Foliage: levels beside simplified meshes

Written by `make foliage`. Every level of the foliage of a tree, and the source simplified by meshoptimizer to as many triangles
(`simplify` with pruning, material by material, without a limit of error), against the source's own pictures: 64 samples a pixel,
base colours, five views. FLIP and the error of coverage (relative) are means over the views, over the box around the tree.
*Own size*: pictures in which a texel of the level is a pixel, which is where the level is meant for.

";

/// Errors of a level and of the simplified mesh, at the level's own size and at [`SMALL`].
struct Row {
    level: usize,
    triangles: u64,
    simplified: usize,
    height: u32,
    errors: [[Errors; 2]; 2],
}

fn main() -> Result<()> {
    let mut text = String::from(NOTES);
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs");
    let trees = report_trees(&SAMPLES, &SHARED);
    for (i, path) in (1..).zip(&trees) {
        eprintln!("{}", name_of(path));
        let soup = load_soup(path)?;
        let (bytes, report) = bake_foliage(&soup, &FoliageOptions::default())?;
        let pack = open(&bytes)?;
        let block = FoliageBlock::open(&pack)?;
        let scene = FoliageScene::read(&block)?;
        let tree = Tree { surfaces: Surfaces::new(&soup.materials, &soup.textures), soup: &soup };
        let rows: Vec<Row> = (0..block.header.levels.len()).map(|l| tree.row(&scene, l)).collect();
        table(&mut text, &name_of(path), &soup, &report, &rows)?;
        if i == trees.len().min(PICTURED) {
            let picture = tree.gallery(&scene, &rows);
            let file = root.join("foliage.png");
            picture.save(&file).with_context(|| file.display().to_string())?;
            writeln!(
                text,
                "![The source, and its levels; below, simplified to as many triangles](foliage.png)\n"
            )?;
        }
    }
    let path = root.join("FOLIAGE.md");
    std::fs::write(&path, text.trim_end().to_string() + "\n")
        .with_context(|| path.display().to_string())?;
    print!("{text}");
    Ok(())
}

/// A source and its materials.
struct Tree<'a> {
    soup: &'a TriangleSoup,
    surfaces: Surfaces,
}

fn style() -> Style {
    Style { sampling: Sampling::TRUTH, light: Light::Albedo }
}

impl Tree<'_> {
    fn camera(&self, view: [f64; 2], height: u32) -> Camera {
        let b = self.soup.bounds();
        let bounds = [b.min, b.max].map(|p| self.soup.origin + p);
        Camera::around(bounds, view, None, [height; 2])
    }

    fn row(&self, scene: &FoliageScene, level: usize) -> Row {
        let header = &scene.block().header.levels[level];
        let simplified = simplified(self.soup, header.triangles() as usize);
        let errors = |height: u32| {
            let of = |view| {
                let camera = self.camera(view, height);
                let truth = rasterize(self.soup, &self.surfaces, &camera, &style());
                let ours = scene.draw(&camera, level, &Wind::default(), &style());
                let theirs = rasterize(&simplified, &self.surfaces, &camera, &style());
                [ours, theirs].map(|p| Comparison::new(&truth, &p).errors(BACKGROUND, 1.0))
            };
            let all: Vec<[Errors; 2]> = VIEWS.into_iter().map(of).collect();
            [0, 1].map(|k| {
                let own: Vec<Errors> = all.iter().map(|e| e[k]).collect();
                Errors::mean(&own).expect("there are views")
            })
        };
        // The picture is as high as the tree's largest side, with a little room.
        let size = self.soup.bounds().size().max_element();
        let height = (size / header.texel).round().clamp(16.0, 1024.0) as u32;
        Row {
            level,
            triangles: header.triangles(),
            simplified: simplified.triangles.len(),
            height,
            errors: [errors(height), errors(SMALL)],
        }
    }

    /// The source and the levels side by side; below, the simplified meshes.
    fn gallery(&self, scene: &FoliageScene, rows: &[Row]) -> image::RgbImage {
        const SIDE: u32 = 300;
        let camera = self.camera([20.0, 5.0], SIDE);
        let columns = rows.len() as u32 + 1;
        let around = image::Rgb(Picture::empty(1, 1).over(0.6)[0]);
        let mut out = image::RgbImage::from_pixel(columns * SIDE, 2 * SIDE, around);
        let mut put = |picture: &Picture, column: u32, row: u32| {
            for (i, p) in (0..).zip(picture.over(0.6)) {
                out.put_pixel(column * SIDE + i % SIDE, row * SIDE + i / SIDE, image::Rgb(p));
            }
        };
        put(&rasterize(self.soup, &self.surfaces, &camera, &style()), 0, 0);
        for (column, row) in (1..).zip(rows) {
            put(&scene.draw(&camera, row.level, &Wind::default(), &style()), column, 0);
            let simplified = simplified(self.soup, row.triangles as usize);
            put(&rasterize(&simplified, &self.surfaces, &camera, &style()), column, 1);
        }
        out
    }
}

fn table(
    text: &mut String,
    name: &str,
    soup: &TriangleSoup,
    report: &BakeReport,
    rows: &[Row],
) -> Result<()> {
    writeln!(
        text,
        "## {name}\n\n{} triangles; skeleton of {} branches; dictionary {} × {}, {:.0} % filled.\n",
        soup.triangles.len(),
        report.header.branches.iter().sum::<u32>(),
        report.header.atlas[0],
        report.header.atlas[1],
        100.0 * report.filled,
    )?;
    writeln!(
        text,
        "| level | triangles | own size | FLIP | simplified | coverage | simplified | FLIP at {SMALL} px | simplified | thick wood |\n\
         |---:|---:|---:|---:|---:|---:|---:|---:|---:|---|"
    )?;
    for row in rows {
        let [own, small] = &row.errors;
        let coverage = |e: &Errors| 100.0 * e.coverage_ratio.unwrap_or(0.0);
        let wood = match report.header.levels[row.level].wood {
            WoodWay::Tubes => "tubes",
            WoodWay::Simplified => "simplified",
        };
        writeln!(
            text,
            "| {} | {} ({}) | {} px | {:.3} | {:.3} | {:+.1} % | {:+.1} % | {:.3} | {:.3} | {wood} |",
            row.level,
            row.triangles,
            row.simplified,
            row.height,
            own[0].flip,
            own[1].flip,
            coverage(&own[0]),
            coverage(&own[1]),
            small[0].flip,
            small[1].flip,
        )?;
    }
    writeln!(text)?;
    Ok(())
}
