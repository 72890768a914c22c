//! Foliage is drawn as the CPU draws it, and bends in the wind; all representations lean alike; fades
//! share the samples.

use super::{Device, SIDE, assert_same, cameras, thresholds, tree, with_bumps};
use forest_draw::{
    CrownStyle, FoliageScene, ViewsLevel, VolumeScene, draw_bent_points, draw_points, read_surfaces,
};
use forest_foliage::{BentPoints, FoliageBlock, FoliageOptions, PointsWind, Pose, Wind};
use forest_gpu::{Frame, Layer, Model, Options, What};
use forest_points::{BakeOptions, PointsBlock, Thresholds};
use forest_raster::{Light, Sampling, Style};
use forest_soup::Camera;
use forest_tests::pictures::rmse;
use forest_tests::{bake_bytes, bake_foliage, bake_views, bake_volume, merged, open};
use forest_views::{Channels, Directions, Dome, Lookup, ViewsBlock, ViewsOptions};
use forest_volume::{Blending, Detail, Stand, VolumeBlock, VolumeOptions};

/// Foliage, at rest and bent by the wind.
#[test]
fn foliage_is_drawn_as_the_cpu_draws_it() {
    let device = Device::new(Options::default());
    let mut soup = tree("broadleaf_young.gltf");
    for blocks in [true, false] {
        // And leaves and wood that let less light through than the light says, and wood with bumps.
        let share = if blocks { 1.0 } else { 0.3 };
        if !blocks {
            with_bumps(&mut soup);
        }
        soup.materials.iter_mut().for_each(|m| m.translucency = share);
        let options = FoliageOptions { blocks, ..FoliageOptions::default() };
        let pack = open(&bake_foliage(&soup, &options).unwrap().0).unwrap();
        let mut model = Model::load(&device.gpu, &device.renderer, &pack).unwrap();
        let block = FoliageBlock::open(&pack).unwrap();
        let scene = FoliageScene::read(&block).unwrap();
        let gale = Wind { strength: 1.0, time: 2.2, ..Wind::default() };
        for (c, camera) in cameras(model.bounds()).iter().enumerate() {
            let level = c % 3;
            for (w, wind) in [Wind::default(), gale].into_iter().enumerate() {
                let style = Style { sampling: Sampling::MIDDLE, light: Light::MORNING };
                let cpu = scene.draw(camera, level, &wind, &style);
                let layers = [Layer::whole(What::Foliage(level))];
                let frame = Frame { camera: *camera, light: Light::MORNING, wind, layers: &layers };
                let gpu = device.draw_frame(&mut model, &frame).0;
                assert_same(&format!("foliage-{blocks}-{c}-{w}"), &gpu, &cpu);
            }
        }
    }
}

/// Points and triangles, bent by the wind branch by branch.
#[test]
fn bent_points_are_those_of_draw() {
    let device = Device::new(Options::default());
    let mut soup = tree("broadleaf_young.gltf");
    soup.materials.iter_mut().for_each(|m| m.translucency = 0.3);
    with_bumps(&mut soup);
    let pack = open(&merged(&[
        bake_foliage(&soup, &FoliageOptions::default()).unwrap().0,
        bake_bytes(&soup, &BakeOptions::default()).unwrap().0,
    ]));
    let pack = pack.unwrap();
    let mut model = Model::load(&device.gpu, &device.renderer, &pack).unwrap();
    let block = PointsBlock::open(&pack).unwrap();
    let surfaces = read_surfaces(&pack, &block).unwrap();
    let foliage = FoliageBlock::open(&pack).unwrap();
    let wind = PointsWind::read(&pack, &block, foliage.branches.len()).unwrap().unwrap();
    let gale = Wind { strength: 1.0, time: 2.2, ..Wind::default() };
    let pose = Pose::new(foliage.branches, &gale, 0.0);
    let bent = BentPoints::new(&foliage, &wind, &pose);
    let style = Style { sampling: Sampling::MIDDLE, light: Light::MORNING };
    let on_crown = CrownStyle::read(&pack, &style).unwrap();
    let cuts = [thresholds(1.0, 16.0, 0.0), Thresholds::TRIANGLES, thresholds(900.0, 1e9, 0.0)];
    for (c, camera) in cameras(model.bounds()).iter().enumerate() {
        let cut = &cuts[c % 3];
        let lit = on_crown.seen_from(camera.to_eye(block.middle()));
        let surfaces = surfaces.as_ref();
        let (cpu, _) = draw_bent_points(&block, surfaces, camera, cut, lit, &bent);
        let (still, _) = draw_points(&block, surfaces, camera, cut, lit);
        assert!(rmse(&cpu, &still) > 0.05, "it moves");
        let layers = [Layer::whole(What::Points(*cut))];
        let frame = Frame { camera: *camera, light: Light::MORNING, wind: gale, layers: &layers };
        let gpu = device.draw_frame(&mut model, &frame).0;
        assert_same(&format!("bent-points-{c}"), &gpu, &cpu);
    }
}

/// Points, views with their own sky and without it, and volumes under what their crown shows of the light.
#[test]
fn the_light_on_a_crown_is_that_of_draw() {
    let device = Device::new(Options::default());
    let soup = tree("broadleaf_young.gltf");
    let light = Light::MORNING;
    for sky in [false, true] {
        let views = ViewsOptions {
            directions: Directions::octahedral(25, Dome::Upper),
            texels: 64,
            channels: Channels { normal: true, depth: true, sky },
            ..ViewsOptions::default()
        };
        let volume = VolumeOptions { levels: 5, ..VolumeOptions::default() };
        let bytes = merged(&[
            bake_foliage(&soup, &FoliageOptions { levels: 1, ..Default::default() }).unwrap().0,
            bake_bytes(&soup, &BakeOptions::default()).unwrap().0,
            bake_views(&soup, &views).unwrap(),
            bake_volume(&soup, Stand::Dome { cameras: 5 }, &volume, None).unwrap().0,
        ]);
        let pack = open(&bytes).unwrap();
        let mut model = Model::load(&device.gpu, &device.renderer, &pack).unwrap();
        let points = PointsBlock::open(&pack).unwrap();
        let surfaces = read_surfaces(&pack, &points).unwrap();
        let views_block = ViewsBlock::open(&pack).unwrap();
        let views = ViewsLevel::read(&views_block, 0).unwrap();
        let volume_block = VolumeBlock::open(&pack).unwrap();
        let volume = VolumeScene::read(&volume_block).unwrap();
        let style = Style { sampling: Sampling::MIDDLE, light };
        let on_crown = CrownStyle::read(&pack, &style).unwrap();
        for (c, camera) in cameras(model.bounds())[..4].iter().enumerate() {
            let lit = on_crown.seen_from(camera.to_eye(points.middle()));
            let cut = thresholds(1.0, 16.0, 0.0);
            let (detail, blending) = (Detail::Level(4), Blending::Shares);
            for (what, cpu) in [
                (What::Points(cut), draw_points(&points, surfaces.as_ref(), camera, &cut, lit).0),
                (What::Views(0, Lookup::Nearest), views.draw(camera, Lookup::Nearest, lit).0),
                (What::Volume(detail, blending), volume.draw(camera, detail, blending, lit).0),
            ] {
                let gpu = device.draw(&mut model, camera, light, &[Layer::whole(what)]);
                assert_same(&format!("crown-{sky}-{c}-{}", name(&what)), &gpu, &cpu);
            }
        }
    }
}

fn name(what: &What) -> &'static str {
    match what {
        What::Points(_) => "points",
        What::Views(..) => "views",
        What::Volume(..) => "volume",
        What::Foliage(_) => "foliage",
    }
}

/// Pixels along the side of one that is judged.
const FINER: u32 = 4;

/// In the wind, a change of representation moves the tree as little as at rest.
#[test]
fn representations_lean_alike_in_the_wind() {
    let device = Device::new(Options::default());
    let soup = tree("broadleaf_young.gltf");
    let views = ViewsOptions {
        directions: Directions::octahedral(64, Dome::Upper),
        texels: 128,
        ..ViewsOptions::default()
    };
    let volume = VolumeOptions { levels: 6, ..VolumeOptions::default() };
    let pack = open(&merged(&[
        bake_foliage(&soup, &FoliageOptions::default()).unwrap().0,
        bake_bytes(&soup, &BakeOptions { triangles: false, ..Default::default() }).unwrap().0,
        bake_views(&soup, &views).unwrap(),
        bake_volume(&soup, Stand::Dome { cameras: 9 }, &volume, None).unwrap().0,
    ]));
    let pack = pack.unwrap();
    let mut model = Model::load(&device.gpu, &device.renderer, &pack).unwrap();
    // Single samples of so few pixels would be off by a fifth of a pixel.
    let side = FINER * SIDE;
    let camera = Camera::around(model.bounds(), [20.0, 8.0], None, [side; 2]);
    // Mean place across of what covers the upper half of the picture, in pixels.
    let mut middle = |what: What, wind: Wind| {
        let layers = [Layer::whole(what)];
        let frame = Frame { camera, light: Light::Albedo, wind, layers: &layers };
        let picture = device.draw_frame(&mut model, &frame).0;
        let upper = picture.pixels.iter().enumerate().take((side * side / 2) as usize);
        let (sum, weight) = upper.fold((0.0, 0.0), |(sum, weight), (i, p)| {
            let a = f64::from(p[3]);
            (sum + a * f64::from(i as u32 % side), weight + a)
        });
        sum / weight / f64::from(FINER)
    };
    // Leaves turn to and fro besides: over some moments.
    let mut shift = |what| {
        let still = middle(what, Wind::default());
        let at = |time| Wind { strength: 1.0, time, ..Wind::default() };
        let moved = [1.1, 2.2, 3.7, 5.3, 7.2].map(|time| middle(what, at(time)) - still);
        moved.iter().sum::<f64>() / moved.len() as f64
    };
    let foliage = shift(What::Foliage(0));
    assert!(foliage.abs() > 1.0, "{foliage} px");
    for what in [
        What::Foliage(2),
        What::Points(thresholds(1.0, 1e9, 0.0)),
        What::Views(0, Lookup::Nearest),
        What::Views(0, Lookup::Depth),
        What::Volume(Detail::Level(5), Blending::Shares),
    ] {
        let own = shift(what);
        // Points hang as the finest level; views and volumes lean as a whole, by what that moves in the mean. A
        // card of a coarse level is one piece where many twigs bend, and its rim moves a little less: by a
        // sixth of a per cent of the tree's height.
        let most = if matches!(what, What::Points(_)) { 0.1 } else { 0.3 };
        assert!((own - foliage).abs() < most, "{what:?}: {own} px, not {foliage}");
    }
}

/// Two layers on complementary samples: of one level they are that level; of two, each sample is of
/// one of them, so that no fade is denser or thinner than both its ends.
#[test]
fn fading_levels_share_the_samples() {
    let soup = tree("shrub.obj");
    let points = bake_bytes(&soup, &BakeOptions::default()).unwrap().0;
    let foliage = bake_foliage(&soup, &FoliageOptions::default()).unwrap().0;
    let levels = [1.0, 64.0].map(|s| What::Points(thresholds(s, 16.0 * s, 0.0)));
    levels_share_the_samples(&points, levels);
    levels_share_the_samples(&foliage, [0, 2].map(What::Foliage));
}

fn levels_share_the_samples(bytes: &[u8], [fine, coarse]: [What; 2]) {
    let pack = open(bytes).unwrap();
    let device = Device::new(Options::default());
    let mut model = Model::load(&device.gpu, &device.renderer, &pack).unwrap();
    let camera = cameras(model.bounds())[2];
    let mut draw = |layers: &[Layer]| device.draw(&mut model, &camera, Light::MORNING, layers);
    let halves =
        |a, b, t: f32| [Layer { what: a, fade: [0.0, t] }, Layer { what: b, fade: [t, 1.0] }];
    let (all_fine, all_coarse) = (draw(&[Layer::whole(fine)]), draw(&[Layer::whole(coarse)]));
    assert_eq!(draw(&halves(fine, fine, 0.4)).pixels, all_fine.pixels);
    let mut last = 0;
    for t in [0.1, 0.35, 0.7, 0.95] {
        let faded = draw(&halves(coarse, fine, t));
        let mut coarse_only = 0;
        for ((f, a), b) in faded.pixels.iter().zip(&all_fine.pixels).zip(&all_coarse.pixels) {
            assert!(f == a || f == b, "{f:?} is neither {a:?} nor {b:?}");
            coarse_only += usize::from(f == b && f != a);
        }
        assert!(coarse_only > last, "{t}");
        last = coarse_only;
    }
}
