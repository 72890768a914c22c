//! Points, views and volumes are drawn as the CPU draws them, by every way that a device has.

use super::{Device, assert_same, cameras, self_shadowed, thresholds, tree};
use forest_draw::{CrownStyle, ViewsLevel, VolumeScene, draw_points, read_surfaces};
use forest_foliage::Wind;
use forest_gpu::{
    Frame, Gpu, Layer, Look, Model, Options, Renderer, What, adapters, instance, read_picture,
    read_samples,
};
use forest_pack::Pack;
use forest_points::{BakeOptions, Calibration, Order, PointsBlock, RadiusRule, Thresholds};
use forest_raster::{Light, Picture, Sampling, Style};
use forest_soup::Camera;
use forest_tests::{bake_bytes, bake_views, bake_volume, golden, open};
use forest_views::{Directions, Dome, Layout, Lookup, Quality, ViewsBlock, ViewsOptions};
use forest_volume::{
    Blending, Branching, CodebookOptions, Detail, Stand, VolumeBlock, VolumeOptions,
};
use glam::DVec3;

/// All cameras and lights, for each of `cuts`.
fn points_are_the_same(name: &str, pack: &Pack, cuts: &[Thresholds]) {
    let device = Device::new(Options::default());
    let mut model = Model::load(&device.gpu, &device.renderer, pack).unwrap();
    let block = PointsBlock::open(pack).unwrap();
    let surfaces = read_surfaces(pack, &block).unwrap();
    for (c, camera) in cameras(model.bounds()).iter().enumerate() {
        let to_eye = camera.to_eye(block.middle());
        for (t, thresholds) in cuts.iter().enumerate() {
            for (l, light) in [Light::Albedo, self_shadowed()].into_iter().enumerate() {
                let style = Style { sampling: Sampling::MIDDLE, light };
                let on_crown = CrownStyle::read(pack, &style).unwrap();
                let lit = on_crown.seen_from(to_eye);
                let (cpu, cost) = draw_points(&block, surfaces.as_ref(), camera, thresholds, lit);
                let layers = [Layer::whole(What::Points(*thresholds))];
                let (gpu, drawn) = device.draw_counted(&mut model, camera, light, &layers);
                assert!(drawn.points >= cost.points, "{drawn:?} {cost:?}");
                assert_eq!(drawn.triangles, cost.triangles);
                assert_same(&format!("{name}-{c}-{t}-{l}"), &gpu, &cpu);
            }
        }
    }
}

#[test]
fn points_and_triangles_are_those_of_draw() {
    let soup = tree("broadleaf_young.gltf");
    let pack = open(&bake_bytes(&soup, &BakeOptions::default()).unwrap().0).unwrap();
    let cuts = [
        thresholds(1.0, 16.0, 0.0),
        thresholds(0.1, 0.5, 0.05),
        thresholds(400.0, 1e9, 0.0),
        Thresholds::TRIANGLES,
    ];
    points_are_the_same("broadleaf", &pack, &cuts);
}

#[test]
fn a_block_far_from_the_worlds_zero_loses_nothing() {
    let mut soup = tree("shrub.obj");
    soup.origin += DVec3::new(3e6, -7e5, 1e6);
    let pack = open(&bake_bytes(&soup, &BakeOptions::default()).unwrap().0).unwrap();
    points_are_the_same("far", &pack, &[thresholds(0.5, 8.0, 0.0), Thresholds::TRIANGLES]);
}

#[test]
fn the_papers_order_and_golden_packs_are_those_of_draw() {
    let options = BakeOptions {
        order: Order::Paper,
        radius: RadiusRule::Paper,
        triangles: false,
        ..BakeOptions::default()
    };
    let pack = open(&bake_bytes(&tree("shrub.obj"), &options).unwrap().0).unwrap();
    points_are_the_same("paper", &pack, &[thresholds(1.0, 16.0, 0.0), thresholds(64.0, 1e4, 0.0)]);
    for golden in golden::all() {
        let pack = Pack::open(&golden.path()).unwrap();
        if PointsBlock::is_in(&pack) {
            let name = golden.path().file_stem().unwrap().to_string_lossy().into_owned();
            points_are_the_same(&name, &pack, &[thresholds(1.0, 16.0, 0.0), Thresholds::TRIANGLES]);
        }
    }
}

#[test]
fn calibrated_points_are_those_of_draw() {
    let bytes = bake_bytes(&tree("shrub.obj"), &BakeOptions::default()).unwrap().0;
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("t.fpack");
    let mut writer = forest_pack::PackWriter::create(&path).unwrap();
    let pack = open(&bytes).unwrap();
    pack.sections().for_each(|(id, _)| writer.copy(&pack, id).unwrap());
    let factors = std::array::from_fn(|i| 0.6 + 0.02 * i as f32);
    Calibration::new(factors).write(&mut writer).unwrap();
    writer.finish().unwrap();
    let pack = Pack::open(&path).unwrap();
    points_are_the_same("calibrated", &pack, &[thresholds(1.0, 16.0, 0.0)]);
}

#[test]
fn all_ways_to_draw_points_find_the_same() {
    let pack = open(&bake_bytes(&tree("shrub.obj"), &BakeOptions::default()).unwrap().0).unwrap();
    let devices = [
        Device::new(Options::default()),
        Device::new(Options { narrow_atomics: true, ..Options::default() }),
        // All points as quads; none.
        Device::new(Options { splat_most: 0, ..Options::default() }),
        Device::new(Options { splat_most: u32::MAX, ..Options::default() }),
    ];
    for camera in
        cameras(Model::load(&devices[0].gpu, &devices[0].renderer, &pack).unwrap().bounds())
    {
        let [wide, narrow, quads, splats] = devices.each_ref().map(|d| {
            let mut model = Model::load(&d.gpu, &d.renderer, &pack).unwrap();
            let layers = [Layer::whole(What::Points(thresholds(0.5, 1e9, 0.0)))];
            d.draw(&mut model, &camera, Light::MORNING, &layers)
        });
        assert_eq!(wide.pixels, narrow.pixels);
        assert_eq!(wide.pixels, splats.pixels);
        assert_same("quads", &quads, &wide);
    }
}

fn views_are_the_same(name: &str, options: &ViewsOptions) {
    let pack = open(&bake_views(&tree("broadleaf_young.gltf"), options).unwrap()).unwrap();
    let device = Device::new(Options::default());
    let mut model = Model::load(&device.gpu, &device.renderer, &pack).unwrap();
    let block = ViewsBlock::open(&pack).unwrap();
    let levels = [0, 2].map(|l| ViewsLevel::read(&block, l).unwrap());
    for (c, camera) in cameras(model.bounds()).iter().enumerate() {
        for lookup in Lookup::ALL {
            for (level, light) in [(0, self_shadowed()), (1, Light::Albedo)] {
                let style = Style { sampling: Sampling::MIDDLE, light };
                let (cpu, cost) = levels[level].draw(camera, lookup, style);
                let layers = [Layer::whole(What::Views(2 * level, lookup))];
                let (gpu, drawn) = device.draw_counted(&mut model, camera, light, &layers);
                assert_eq!((drawn.views, drawn.bytes), (cost.views, cost.bytes));
                assert_same(&format!("{name}-{c}-{level}-{}", lookup.name()), &gpu, &cpu);
            }
        }
    }
}

#[test]
fn views_are_those_of_draw() {
    let options = ViewsOptions {
        directions: Directions::octahedral(25, Dome::Upper),
        texels: 64,
        quality: Quality::Lossless,
        ..ViewsOptions::default()
    };
    views_are_the_same("views", &options);
    // Block compression; rings all around; several pages.
    let layout = Layout::Rings { rings: 3, points: 9 };
    views_are_the_same(
        "views-blocks",
        &ViewsOptions {
            directions: Directions { layout, dome: Dome::Full },
            quality: Quality::Block,
            max_page: 128,
            ..options
        },
    );
}

fn volumes_are_the_same(name: &str, options: &VolumeOptions, codebook: Option<&CodebookOptions>) {
    let soup = tree("broadleaf_young.gltf");
    let stand = Stand::Dome { cameras: 7 };
    let pack = open(&bake_volume(&soup, stand, options, codebook).unwrap().0).unwrap();
    let device = Device::new(Options::default());
    let mut model = Model::load(&device.gpu, &device.renderer, &pack).unwrap();
    let block = VolumeBlock::open(&pack).unwrap();
    let scene = VolumeScene::read(&block).unwrap();
    let finest = block.header.levels.len() as u32 - 1;
    let details =
        [Detail::Level(finest), Detail::Level(2), Detail::Planes { texel: 3.0, fade: 0.3 }];
    for (c, camera) in cameras(model.bounds()).iter().enumerate() {
        for (d, detail) in details.into_iter().enumerate() {
            for blending in [Blending::Shares, Blending::Over] {
                let (cpu, cost) =
                    scene.draw(camera, detail, blending, Style::from(Sampling::MIDDLE));
                let layers = [Layer::whole(What::Volume(detail, blending))];
                let (gpu, drawn) = device.draw_counted(&mut model, camera, Light::Albedo, &layers);
                assert_eq!(drawn.cells, cost.cells);
                assert_same(&format!("{name}-{c}-{d}-{blending:?}"), &gpu, &cpu);
            }
        }
    }
}

#[test]
fn volumes_are_those_of_draw() {
    let options = VolumeOptions { levels: 5, ..VolumeOptions::default() };
    volumes_are_the_same("volume-coded", &options, Some(&CodebookOptions::default()));
    volumes_are_the_same(
        "volume-bc3",
        &options,
        Some(&CodebookOptions { block: true, ..CodebookOptions::default() }),
    );
    let trigrid = VolumeOptions {
        levels: 3,
        branching: Branching::TriGrid,
        texels: 8,
        ..VolumeOptions::default()
    };
    volumes_are_the_same("volume-raw", &trigrid, None);
}

/// Seen from the front by a parallel camera, 512 pixels wide, the edges of some cells of this tree lie on
/// the middles of pixels: rounding once let their samples fall between two billboards, a crack from the
/// top of the crown to its bottom.
#[test]
fn samples_on_the_edges_of_cells_do_not_fall_through() {
    let soup = tree("conifer.glb");
    let options = VolumeOptions::default();
    let pack = bake_volume(&soup, Stand::Dome { cameras: 16 }, &options, None).unwrap().0;
    let pack = open(&pack).unwrap();
    let block = VolumeBlock::open(&pack).unwrap();
    let scene = VolumeScene::read(&block).unwrap();
    let device = Device::new(Options::default());
    let mut model = Model::load(&device.gpu, &device.renderer, &pack).unwrap();
    let camera = Camera::around(model.bounds(), [0.0, 0.0], None, [512; 2]);
    // Half a pixel aside no sample is on an edge.
    let off = camera.right * (0.37 / camera.pixels_per_unit(1.0));
    let moved = Camera { eye: camera.eye + off, ..camera };
    let columns = |picture: &Picture| -> Vec<f64> {
        let alpha = |x: usize| (0..512).map(|y| f64::from(picture.pixels[y * 512 + x][3])).sum();
        (0..512).map(alpha).collect()
    };
    let style = Style::from(Sampling::MIDDLE);
    let cpu = |camera| scene.draw(camera, Detail::PIXEL, Blending::Shares, style).0;
    let layers = [Layer::whole(What::Volume(Detail::PIXEL, Blending::Shares))];
    let gpu = device.draw(&mut model, &camera, Light::Albedo, &layers);
    // The crown's columns: none is emptier than both of its neighbours by much more than where samples
    // lie within cells.
    let dent = |c: &[f64], x: usize| c[x - 1].min(c[x + 1]) - c[x];
    let usual = columns(&cpu(&moved));
    let deepest = (1..511).map(|x| dent(&usual, x)).fold(0.0, f64::max);
    for on in [columns(&cpu(&camera)), columns(&gpu)] {
        for x in 1..511 {
            assert!(dent(&on, x) < 2.0 * deepest + 5.0, "column {x}: {:?}", &on[x - 1..=x + 1]);
        }
    }
}

/// Triangles, large points and volumes by OpenGL, whose depths are rounded otherwise: where it is there.
#[test]
fn opengl_draws_the_same() {
    let instance = instance(true, None);
    let all = adapters(&instance);
    let Some(adapter) = all.into_iter().find(|a| a.get_info().backend == wgpu::Backend::Gl) else {
        eprintln!("skipped: no OpenGL adapter");
        return;
    };
    let gpu = Gpu::of(adapter).unwrap();
    let renderer = Renderer::new(&gpu, &Options::default()).unwrap();
    let (gl, vulkan) = (Device { gpu, renderer }, Device::new(Options::default()));
    let soup = tree("shrub.obj");
    let options = VolumeOptions { levels: 4, ..VolumeOptions::default() };
    let volume = bake_volume(&soup, Stand::Dome { cameras: 5 }, &options, None).unwrap().0;
    let points = bake_bytes(&soup, &BakeOptions::default()).unwrap().0;
    let ways = [
        (&points, What::Points(Thresholds::TRIANGLES)),
        (&points, What::Points(thresholds(4000.0, 1e9, 0.0))),
        (&volume, What::Volume(Detail::Level(4), Blending::Shares)),
    ];
    for (w, (bytes, what)) in ways.into_iter().enumerate() {
        let pack = open(bytes).unwrap();
        let mut models = [&gl, &vulkan].map(|d| Model::load(&d.gpu, &d.renderer, &pack).unwrap());
        // Outside of the tree: within it OpenGL has few depths.
        for (c, camera) in cameras(models[0].bounds())[..4].iter().enumerate() {
            let layers = [Layer::whole(what)];
            let [a, b] = &mut models;
            let gl = gl.draw(a, camera, Light::MORNING, &layers);
            let vulkan = vulkan.draw(b, camera, Light::MORNING, &layers);
            assert_same(&format!("opengl-{w}-{c}"), &gl, &vulkan);
        }
    }
}

/// Pictures that are read back are the samples, averaged and encoded as `draw` does.
#[test]
fn pictures_are_the_samples_mean() {
    let device = Device::new(Options::default());
    let pack = Pack::open(&golden::richest().path()).unwrap();
    let mut model = Model::load(&device.gpu, &device.renderer, &pack).unwrap();
    let camera = Camera { width: 60, height: 50, ..cameras(model.bounds())[2] };
    let target = device.renderer.target(&device.gpu, [60, 50], 3).unwrap();
    let layers = [Layer::whole(What::Points(Thresholds::default()))];
    let frame = Frame { camera, light: Light::MORNING, wind: Wind::default(), layers: &layers };
    device.renderer.render(&device.gpu, &mut model, &target, &frame, None).unwrap();
    let samples = read_samples(&device.gpu, &target).unwrap();
    let whole = Picture { pixels: samples, ..Picture::empty(180, 150) }.box_filtered(3);
    let near = |a: &[u8], b: &[u8]| a.iter().zip(b).all(|(a, b)| a.abs_diff(*b) <= 1);
    let opaque = read_picture(&device.gpu, &target, &Look::default(), None).unwrap();
    for (got, want) in opaque.iter().zip(whole.over(0.6)) {
        assert!(near(&got[..3], &want) && got[3] == 255, "{got:?} {want:?}");
    }
    let look = Look { alpha: true, ..Look::default() };
    let straight = read_picture(&device.gpu, &target, &look, None).unwrap();
    assert!(straight.iter().any(|p| p[3] > 0));
    for (got, want) in straight.iter().zip(whole.straight()) {
        assert!(near(got, &want), "{got:?} {want:?}");
    }
    // The other picture on the left, a white line, this one on the right.
    let red = vec![[1.0, 0.0, 0.0, 1.0]; 60 * 50];
    let look = Look { split: 30.0, ..Look::default() };
    let both = read_picture(&device.gpu, &target, &look, Some(([60, 50], &red))).unwrap();
    assert_eq!((both[60 * 7 + 3], both[60 * 7 + 30]), ([255, 0, 0, 255], [255; 4]));
    assert_eq!(both[60 * 7 + 45], opaque[60 * 7 + 45]);
}
