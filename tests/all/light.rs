//! Light on trees: as bright as rays with shadows say, by every representation.

use crate::support::repo;
use forest_draw::{CrownStyle, FoliageScene, ViewsLevel, VolumeScene, draw_points};
use forest_foliage::{FoliageBlock, FoliageOptions, Wind};
use forest_import::{Block, Limits};
use forest_pack::Pack;
use forest_points::{BakeOptions, PixelArea, PointsBlock, Thresholds};
use forest_raster::{Light, Picture, RayScene, Sampling, Style, Sun, Surfaces};
use forest_soup::{Camera, TriangleSoup};
use forest_tests::{bake_bytes, bake_foliage, bake_views, bake_volume, merged, open};
use forest_views::{Channels, Directions, Dome, Lookup, ViewsBlock, ViewsOptions};
use forest_volume::{Blending, Detail, Stand, VolumeBlock, VolumeOptions};
use glam::DVec3;

/// Light of a picture: the sum of its pixels' luminance.
fn luminance(picture: &Picture) -> f64 {
    let of = |p: &[f32; 4]| f64::from(forest_soup::luminance([p[0], p[1], p[2]]));
    picture.pixels.iter().map(of).sum()
}

/// Points of a quarter of a pixel.
const FINE: Thresholds = Thresholds {
    finest: PixelArea(0.25),
    largest: PixelArea(f64::INFINITY),
    depth_bias: PixelArea(0.0),
};

fn soup(name: &str) -> TriangleSoup {
    let block = Block::parse(&[repo("sample-data").join(name).display().to_string()]).unwrap();
    block.load(&Limits::default()).unwrap().model.flatten(1 << 24).unwrap()
}

/// A pack of all representations of a tree.
fn pack_of(soup: &TriangleSoup) -> Pack {
    let views = ViewsOptions {
        directions: Directions::octahedral(100, Dome::Upper),
        texels: 128,
        channels: Channels { normal: true, depth: true, sky: false },
        ..ViewsOptions::default()
    };
    let volume = VolumeOptions { levels: 7, ..VolumeOptions::default() };
    open(&merged(&[
        bake_foliage(soup, &FoliageOptions::default()).unwrap().0,
        bake_bytes(soup, &BakeOptions { triangles: false, ..Default::default() }).unwrap().0,
        bake_views(soup, &views).unwrap(),
        bake_volume(soup, Stand::Dome { cameras: 24 }, &volume, None).unwrap().0,
    ]))
    .unwrap()
}

/// Against rays with shadows, under 16 suns: sun and sky together, and each alone.
#[test]
fn every_representation_is_as_bright_as_the_truth_under_all_suns() {
    for name in ["broadleaf_young.gltf", "conifer.glb"] {
        let soup = soup(name);
        let pack = pack_of(&soup);
        let foliage = FoliageBlock::open(&pack).unwrap();
        let foliage_scene = FoliageScene::read(&foliage).unwrap();
        let points = PointsBlock::open(&pack).unwrap();
        let views_block = ViewsBlock::open(&pack).unwrap();
        let views = ViewsLevel::read(&views_block, 0).unwrap();
        let volume_block = VolumeBlock::open(&pack).unwrap();
        let volume = VolumeScene::read(&volume_block).unwrap();
        let surfaces = Surfaces::new(&soup.materials, &soup.textures);
        let truth = RayScene::new(&soup, &surfaces);
        let draw = |what: &str, camera: &Camera, on_crown: &CrownStyle| {
            let lit = on_crown.seen_from(camera.to_eye(points.middle()));
            let style = &lit.style;
            match what {
                "foliage" => foliage_scene.draw(camera, 0, &Wind::default(), style),
                "points" => draw_points(&points, None, camera, &FINE, lit).0,
                "views" => views.draw(camera, Lookup::Depth, lit).0,
                _ => volume.draw(camera, Detail::PIXEL, Blending::Shares, lit).0,
            }
        };
        let all = ["foliage", "points", "views", "volume"];
        // Of each sun the luminance of the truth and of all four, by the sun alone and by the sky alone.
        let mut seen = [[[0.0; 5]; 2]; 16];
        for (i, seen) in (0..16u32).zip(&mut seen) {
            let pitch = if i % 4 < 2 { 30.0f64 } else { 60.0 }.to_radians();
            let yaw = (f64::from(i) * 22.5).to_radians();
            let flat = pitch.cos();
            let to_sun = DVec3::new(yaw.sin() * flat, pitch.sin(), yaw.cos() * flat);
            let angles = [f64::from(i) * 67.0, 10.0];
            let camera = Camera::around(foliage.bounds(), angles, None, [96; 2]);
            let sampling = Sampling { side: 2, seed: 1 };
            // The coverage of points is what calibration mends (`points --measure`).
            let plain = sampling.into();
            let on_plain = CrownStyle::read(&pack, &plain).unwrap();
            let own = draw("points", &camera, &on_plain).mean_coverage();
            let thinned = truth.picture(&camera, &plain).mean_coverage() / own;
            for (seen, (sun, sky)) in seen.iter_mut().zip([(0.55, 0.0), (0.0, 0.45)]) {
                let (sun, sky) = ([sun; 3], [sky; 3]);
                let light = Light::Sun(Sun { to_sun, sun, sky, translucency: 1.0, darkest: 1.0 });
                let style = Style { sampling, light };
                let on_crown = CrownStyle::read(&pack, &style).unwrap();
                seen[0] = luminance(&truth.picture(&camera, &style));
                for (seen, what) in seen[1..].iter_mut().zip(all) {
                    *seen = luminance(&draw(what, &camera, &on_crown));
                }
                seen[2] *= thinned;
            }
        }
        // Largest error of the mean over all suns; of one sun's picture of views, whose normals are means over
        // many leaves; and of one of the others. Light adds up: both together are the sum.
        for (told, share, mean_within, views_within, each_within) in [
            ("sun and sky", [1.0, 1.0], 0.02, 0.09, 0.08),
            ("sun", [1.0, 0.0], 0.02, 0.16, 0.10),
            ("sky", [0.0, 1.0], 0.03, 0.06, 0.08),
        ] {
            for (k, what) in (1..).zip(all) {
                let of = |s: &[[f64; 5]; 2], k: usize| share[0] * s[0][k] + share[1] * s[1][k];
                let ratios = seen.map(|s| of(&s, k) / of(&s, 0));
                let mean = ratios.iter().sum::<f64>() / 16.0;
                let told = format!("{name}, {what}, {told}: {mean:.3} {ratios:.2?}");
                eprintln!("{told}");
                assert!((mean - 1.0).abs() < mean_within, "{told}");
                let within = if what == "views" { views_within } else { each_within };
                assert!(ratios.iter().all(|r| (r - 1.0).abs() < within), "{told}");
            }
        }
    }
}
