//! The ground truth: two ways that must agree, and an independent renderer's pictures.

use crate::support::{repo, shared};
use forest_eval::{Comparison, Frame};
use forest_import::{Block, Limits};
use forest_raster::{Light, Picture, RayScene, Sampling, Style, Surfaces, rasterize};
use forest_soup::{Camera, Projection, TriangleSoup};
use forest_tests::reference::{REFERENCES, VIEWS, against, reference};
use glam::DVec3;
use std::io::Write;
use std::path::Path;

fn soup(path: &Path) -> TriangleSoup {
    let block = Block::parse(&[path.to_string_lossy()]).unwrap();
    block.load(&Limits::default()).unwrap().model.flatten(10_000_000).unwrap()
}

/// A camera that looks at all of a soup along `forward`, and the soup's radius.
fn overview(soup: &TriangleSoup, forward: DVec3, projection: &str, side: u32) -> (Camera, f64) {
    let frame = Frame::of(soup).unwrap();
    let forward = forward.normalize();
    let projection = match projection {
        "parallel" => Projection::Orthographic { height: 2.0 * frame.radius },
        _ => Projection::Perspective { fov_y: 1.0 },
    };
    let eye = frame.center - forward * (2.2 * frame.radius);
    (Camera::new(eye, forward, projection, [side; 2]), frame.radius)
}

fn two_ways(soup: &TriangleSoup, camera: &Camera, sampling: Sampling) -> [Picture; 2] {
    let surfaces = Surfaces::new(&soup.materials, &soup.textures);
    let style = Style { sampling, light: Light::Albedo };
    let rays = RayScene::new(soup, &surfaces).picture(camera, &style);
    [rasterize(soup, &surfaces, camera, &style), rays]
}

#[test]
fn scanlines_and_rays_agree_on_every_tree() {
    let mut trees: Vec<_> = ["conifer.glb", "broadleaf_young.gltf", "shrub.obj"]
        .map(|f| repo("sample-data").join(f))
        .into();
    for name in [
        "sap_pine_20k.glb",
        "sap_pine_20k.obj",
        "ez_ash_medium.glb",
        "ez_oak_dense_200k.glb",
        "ez_oak_wrapped_u16.glb",
        "sap_birch_200k.glb",
        "sap_jmaple_450k.glb",
        "japaneseMaple/japaneseMaple.obj",
        "christmas_tree/christmas_tree.obj",
        "bush/bush.obj",
    ] {
        trees.extend(shared("trees").map(|t| t.join(name)));
    }
    for tree in trees {
        let soup = soup(&tree);
        for (projection, forward) in
            [("parallel", DVec3::new(-0.3, -0.4, -0.8)), ("perspective", DVec3::new(0.9, 0.2, 0.1))]
        {
            let (camera, radius) = overview(&soup, forward, projection, 96);
            let [a, b] = two_ways(&soup, &camera, Sampling { side: 4, seed: 3 });
            // Over the box of the tree: empty background dilutes nothing.
            let rmse = Comparison::new(&a, &b).pixel_errors(1.0).rmse;
            let name = tree.file_name().unwrap().to_string_lossy();
            let _ = writeln!(std::io::stderr(), "{name}, {projection}: RMSE {rmse:.5}");
            assert!(a.mean_coverage() > 0.02, "{name}: nothing to see");
            assert!(rmse <= 0.01, "{name}, {projection}: {rmse}");
            let errors = Comparison::new(&a, &b).pixel_errors(radius);
            let depth = errors.depth.expect("pixels that both cover");
            assert!(depth < 0.02, "{name}, {projection}: depths differ by {depth} radii");
            let turned =
                a.normal.iter().zip(&b.normal).map(|(a, b)| {
                    a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>()
                });
            let turned = (turned.sum::<f64>() / a.normal.len() as f64).sqrt();
            assert!(turned < 0.01, "{name}, {projection}: normals differ by {turned}");
        }
    }
}

#[test]
fn albedo_is_that_of_an_independent_renderer() {
    let (Some(references), Some(trees)) = (shared("reference"), shared("trees")) else { return };
    for (name, file) in REFERENCES {
        let soup = soup(&trees.join(file));
        let surfaces = Surfaces::new(&soup.materials, &soup.textures);
        for view in VIEWS {
            let r = reference(&references.join(name), view, "albedo");
            let ours = rasterize(&soup, &surfaces, &r.camera, &Style::default());
            let [coverage, colour, rmse] = against(&r.pixels, &ours);
            let _ = writeln!(
                std::io::stderr(),
                "{name} {view}: coverage {coverage:+.5}, colour {colour:.5}, RMSE {rmse:.5}"
            );
            assert!(coverage.abs() <= 0.005, "{name} {view}: coverage off by {coverage}");
            assert!(colour <= 0.01, "{name} {view}: mean colour off by {colour}");
            assert!(rmse <= 0.03, "{name} {view}: RMSE {rmse}");
        }
    }
}

/// Their light has bounces and highlights that ours leaves out: ours is 75 to 88 % of theirs, less
/// where the crown is denser. Their maple is darker instead, and by view: as if the twin it was rendered
/// from had kept glTF's metallic default, whose rough metal loses a third to a half of the light.
/// docs/REPORT.md has the figures.
#[test]
fn light_is_that_of_an_independent_renderer_but_for_bounces() {
    let (Some(references), Some(trees)) = (shared("reference"), shared("trees")) else { return };
    for (name, file) in REFERENCES {
        let soup = soup(&trees.join(file));
        let surfaces = Surfaces::new(&soup.materials, &soup.textures);
        let scene = RayScene::new(&soup, &surfaces);
        for view in VIEWS {
            let r = reference(&references.join(name), view, "lit");
            let style = Style { light: Light::Sun(r.sun), sampling: Sampling { side: 4, seed: 1 } };
            let ours = scene.picture(&r.camera, &style);
            let [_, colour, rmse] = against(&r.pixels, &ours);
            let mean =
                |p: &[[f32; 4]]| p.iter().map(|v| f64::from(v[0] + v[1] + v[2])).sum::<f64>();
            let ratio = mean(&ours.pixels) / mean(&r.pixels);
            let _ = writeln!(
                std::io::stderr(),
                "{name} {view}: {ratio:.3} of the light, colour {colour:.5}, RMSE {rmse:.5}"
            );
            let metal = name == "scopia_japaneseMaple";
            let range = if metal { 1.2..2.2 } else { 0.7..1.0 };
            assert!(range.contains(&ratio), "{name} {view}: {ratio} of the light");
            // What is there is where it should be: shadows fall as theirs.
            let most = if metal { 0.04 } else { 0.016 };
            assert!(rmse <= most, "{name} {view}: RMSE {rmse}");
        }
    }
}
