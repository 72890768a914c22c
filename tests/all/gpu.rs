//! The graphics device's pictures against those of `draw`: one sample a pixel, where both choose the
//! same cut and ask the same hash.

use crate::support::repo;
use forest_draw::{FoliageScene, ViewsLevel, VolumeScene, draw_points, read_surfaces};
use forest_foliage::{FoliageBlock, FoliageOptions, Wind};
use forest_gpu::{
    Costs, Drawn, Frame, Gpu, GpuError, Layer, Look, Model, Options, Renderer, What, adapters,
    candidates, instance, read_picture, read_samples,
};
use forest_import::{Block, Limits};
use forest_pack::Pack;
use forest_points::{
    BakeOptions, Calibration, Order, PixelArea, PointsBlock, RadiusRule, Thresholds,
};
use forest_raster::{Light, Picture, Sampling, Style, Sun};
use forest_soup::{Camera, Projection, TriangleSoup};
use forest_tests::pictures::rmse;
use forest_tests::{bake_bytes, bake_foliage, bake_views, bake_volume, golden, open, with_section};
use forest_views::{Directions, Dome, Layout, Lookup, Quality, ViewsBlock, ViewsOptions};
use forest_volume::{
    Blending, Branching, CodebookOptions, Detail, Stand, VolumeBlock, VolumeOptions,
};
use glam::DVec3;

/// Of premultiplied linear RGBA, over the box around what either picture shows.
const MOST_RMSE: f64 = 0.01;

/// Side of the pictures.
const SIDE: u32 = 200;

struct Device {
    gpu: Gpu,
    renderer: Renderer,
}

impl Device {
    fn new(options: Options) -> Self {
        let gpu =
            Gpu::open(&instance(false, None), None, None).expect("an adapter: see the Makefile");
        let renderer = Renderer::new(&gpu, &options).unwrap();
        Self { gpu, renderer }
    }

    fn draw(&self, model: &mut Model, camera: &Camera, light: Light, layers: &[Layer]) -> Picture {
        self.draw_counted(model, camera, light, layers).0
    }

    fn draw_counted(
        &self,
        model: &mut Model,
        camera: &Camera,
        light: Light,
        layers: &[Layer],
    ) -> (Picture, Drawn) {
        self.draw_frame(model, &Frame { camera: *camera, light, wind: Wind::default(), layers })
    }

    fn draw_frame(&self, model: &mut Model, frame: &Frame) -> (Picture, Drawn) {
        let [width, height] = [frame.camera.width, frame.camera.height];
        let target = self.renderer.target(&self.gpu, [width, height], 1).unwrap();
        let drawn = self.renderer.render(&self.gpu, model, &target, frame, None).unwrap();
        let pixels = read_samples(&self.gpu, &target).unwrap();
        (Picture { pixels, ..Picture::empty(width, height) }, drawn)
    }
}

fn tree(name: &str) -> TriangleSoup {
    let path = repo("sample-data").join(name).display().to_string();
    let block = Block::parse(&[path]).unwrap();
    block.load(&Limits::default()).unwrap().model.flatten(1 << 24).unwrap()
}

/// From afar and level, from the side and near, from above, and from within the crown.
fn cameras(bounds: [DVec3; 2]) -> Vec<Camera> {
    let size = [SIDE; 2];
    let near = |angles, distance| Camera::around(bounds, angles, Some(distance), size);
    let mut narrow = Camera::around(bounds, [50.0, 10.0], None, [SIDE, SIDE / 2]);
    narrow.projection = Projection::Orthographic { height: 0.3 * (bounds[1] - bounds[0]).length() };
    vec![
        Camera::around(bounds, [0.0, 0.0], None, size),
        narrow,
        near([33.0, 20.0], 2.0),
        near([200.0, 80.0], 6.0),
        near([90.0, 5.0], 0.5),
    ]
}

fn self_shadowed() -> Light {
    let Light::Sun(sun) = Light::MORNING else { panic!("morning has a sun") };
    Light::Sun(Sun { darkest: 0.3, ..sun })
}

/// Insists that both pictures are the same; else writes both and their difference to out/parity.
fn assert_same(name: &str, gpu: &Picture, cpu: &Picture) {
    let error = rmse(gpu, cpu);
    if error <= MOST_RMSE {
        return;
    }
    let folder = repo("out/parity");
    std::fs::create_dir_all(&folder).unwrap();
    let difference: Vec<[u8; 3]> = gpu
        .pixels
        .iter()
        .zip(&cpu.pixels)
        .map(|(a, b)| [0, 1, 2].map(|k| (255.0 * (a[k] - b[k]).abs().min(1.0)) as u8))
        .collect();
    for (what, pixels) in
        [("gpu", gpu.over(0.6)), ("cpu", cpu.over(0.6)), ("difference", difference)]
    {
        let bytes = pixels.as_flattened().to_vec();
        let picture = image::RgbImage::from_raw(gpu.width, gpu.height, bytes).unwrap();
        picture.save(folder.join(format!("{name}-{what}.png"))).unwrap();
    }
    panic!("{name}: RMSE {error:.4}, not {MOST_RMSE}; see {}", folder.display());
}

fn thresholds(finest: f64, largest: f64, bias: f64) -> Thresholds {
    let [finest, largest, depth_bias] = [finest, largest, bias].map(PixelArea);
    Thresholds { finest, largest, depth_bias }
}

/// All cameras and lights, for each of `cuts`.
fn points_are_the_same(name: &str, pack: &Pack, cuts: &[Thresholds]) {
    let device = Device::new(Options::default());
    let mut model = Model::load(&device.gpu, &device.renderer, pack).unwrap();
    let block = PointsBlock::open(pack).unwrap();
    let surfaces = read_surfaces(pack, &block).unwrap();
    for (c, camera) in cameras(model.bounds()).iter().enumerate() {
        for (t, thresholds) in cuts.iter().enumerate() {
            for (l, light) in [Light::Albedo, self_shadowed()].into_iter().enumerate() {
                let style = Style { sampling: Sampling::MIDDLE, light };
                let (cpu, cost) =
                    draw_points(&block, surfaces.as_ref(), camera, thresholds, &style);
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
                let (cpu, cost) = levels[level].draw(camera, lookup, &style);
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
                let (cpu, cost) = scene.draw(camera, detail, blending, Sampling::MIDDLE);
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
    let cpu = |camera| scene.draw(camera, Detail::PIXEL, Blending::Shares, Sampling::MIDDLE).0;
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

/// Foliage, at rest and bent by the wind.
#[test]
fn foliage_is_drawn_as_the_cpu_draws_it() {
    let device = Device::new(Options::default());
    let soup = tree("broadleaf_young.gltf");
    for blocks in [true, false] {
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

/// In the wind, a change of representation moves the tree as little as at rest.
#[test]
fn representations_lean_alike_in_the_wind() {
    let device = Device::new(Options::default());
    let soup = tree("broadleaf_young.gltf");
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("t.fpack");
    let mut writer = forest_pack::PackWriter::create(&path).unwrap();
    let views = ViewsOptions {
        directions: Directions::octahedral(64, Dome::Upper),
        texels: 128,
        ..ViewsOptions::default()
    };
    let volume = VolumeOptions { levels: 6, ..VolumeOptions::default() };
    let mut there = std::collections::BTreeSet::new();
    for pack in [
        bake_foliage(&soup, &FoliageOptions::default()).unwrap().0,
        bake_bytes(&soup, &BakeOptions { triangles: false, ..Default::default() }).unwrap().0,
        bake_views(&soup, &views).unwrap(),
        bake_volume(&soup, Stand::Dome { cameras: 9 }, &volume, None).unwrap().0,
    ] {
        let pack = open(&pack).unwrap();
        for (id, _) in pack.sections() {
            if there.insert(id) {
                writer.copy(&pack, id).unwrap();
            }
        }
    }
    writer.finish().unwrap();
    let pack = Pack::open(&path).unwrap();
    let mut model = Model::load(&device.gpu, &device.renderer, &pack).unwrap();
    let camera = Camera::around(model.bounds(), [20.0, 8.0], None, [SIDE; 2]);
    // Mean place across of what covers the upper half of the picture, in pixels.
    let mut middle = |what: What, wind: Wind| {
        let layers = [Layer::whole(what)];
        let frame = Frame { camera, light: Light::Albedo, wind, layers: &layers };
        let picture = device.draw_frame(&mut model, &frame).0;
        let upper = picture.pixels.iter().enumerate().take((SIDE * SIDE / 2) as usize);
        let (sum, weight) = upper.fold((0.0, 0.0), |(sum, weight), (i, p)| {
            let a = f64::from(p[3]);
            (sum + a * f64::from(i as u32 % SIDE), weight + a)
        });
        sum / weight
    };
    let gale = Wind { strength: 1.0, time: 2.2, ..Wind::default() };
    let mut shift = |what| middle(what, gale) - middle(what, Wind::default());
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
        // Less than half a per cent of the tree's height: below a pixel where levels change.
        assert!((own - foliage).abs() < 0.8, "{what:?}: {own} px, not {foliage}");
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

/// Everything hostile that the pack's own tests know goes through the loader: an error, or a model
/// that can be drawn; never a panic, a lost device or a refused call.
#[test]
fn hostile_packs_end_in_an_error_or_a_picture() {
    let device = Device::new(Options::default());
    let (mut drawn, mut refused) = (0, 0);
    let mut take = |bytes: &[u8]| match open(bytes).map_err(GpuError::from).and_then(|pack| {
        let mut model = Model::load(&device.gpu, &device.renderer, &pack)?;
        draw_everything(&device, &mut model)
    }) {
        Ok(()) => drawn += 1,
        Err(GpuError::Device(text)) => panic!("{text}"),
        Err(_) => refused += 1,
    };
    let corpus = |target: &str| {
        let folder = repo("tests/fuzz/corpus").join(target);
        let entries = std::fs::read_dir(folder).unwrap();
        entries.map(|e| std::fs::read(e.unwrap().path()).unwrap())
    };
    corpus("container").for_each(|bytes| take(&bytes));
    let richest = std::fs::read(golden::richest().path()).unwrap();
    for bytes in corpus("sections") {
        if let Some(pack) = bytes.split_first().and_then(|(w, d)| with_section(&richest, *w, d)) {
            take(&pack);
        }
    }
    for golden in golden::all() {
        let bytes = std::fs::read(golden.path()).unwrap();
        take(&bytes);
        // Truncated, and with extreme words in every section.
        (0..8).for_each(|k| take(&bytes[..bytes.len() * k / 8]));
        let sections: Vec<Vec<u8>> = {
            let pack = open(&bytes).unwrap();
            pack.sections().map(|(id, _)| pack.bytes(id, 1 << 20).unwrap().into_owned()).collect()
        };
        for (which, section) in sections.iter().enumerate() {
            let step = 4 * section.len().div_ceil(4 * 6).max(1);
            for at in (0..section.len().saturating_sub(3)).step_by(step) {
                for word in [0u32, 0x7fff_ffff, 0xffff_ffff, 0x7f80_0000] {
                    let mut data = section.clone();
                    data[at..at + 4].copy_from_slice(&word.to_le_bytes());
                    take(&with_section(&bytes, which as u8, &data).unwrap());
                }
            }
        }
    }
    assert!(drawn > 50 && refused > 200, "{drawn} {refused}");
}

fn draw_everything(device: &Device, model: &mut Model) -> Result<(), GpuError> {
    let target = device.renderer.target(&device.gpu, [48, 48], 1)?;
    let mut all = Vec::new();
    if model.points().is_some() {
        all.push(What::Points(thresholds(1.0, 16.0, 0.0)));
        all.push(What::Points(Thresholds::TRIANGLES));
    }
    if model.views().is_some() {
        all.push(What::Views(0, Lookup::Depth));
    }
    if model.foliage().is_some() {
        all.extend([What::Foliage(0), What::Foliage(1)]);
    }
    if model.volume().is_some() {
        all.push(What::Volume(Detail::PIXEL, Blending::Shares));
    }
    for camera in [0, 4].map(|i| cameras(model.bounds())[i]) {
        let camera = Camera { width: 48, height: 48, ..camera };
        for what in &all {
            let layers = [Layer::whole(*what)];
            let wind = Wind { strength: 1.0, time: 2.0, ..Wind::default() };
            let frame = Frame { camera, light: Light::MORNING, wind, layers: &layers };
            device.renderer.render(&device.gpu, model, &target, &frame, None)?;
            device.gpu.finish()?;
        }
    }
    // Two layers, and levels by the table.
    let camera = Camera { width: 48, height: 48, ..cameras(model.bounds())[2] };
    let layers: Vec<Layer> = all.iter().map(|w| Layer { what: *w, fade: [0.2, 0.7] }).collect();
    let frame = Frame { camera, light: Light::Albedo, wind: Wind::default(), layers: &layers };
    device.renderer.render(&device.gpu, model, &target, &frame, None)?;
    device.gpu.finish()?;
    for candidate in candidates(model, &camera, &Costs::default()) {
        let layers = [Layer::whole(candidate.what)];
        let frame = Frame { layers: &layers, ..frame };
        device.renderer.render(&device.gpu, model, &target, &frame, None)?;
        device.gpu.finish()?;
    }
    Ok(())
}

#[test]
fn what_a_device_cannot_do_is_told() {
    let device = Device::new(Options::default());
    let none =
        Gpu::open(&instance(false, None), Some("no such card"), None).unwrap_err().to_string();
    assert!(none.contains("no graphics adapter named \"no such card\": install"), "{none}");
    assert!(none.contains("mesa-vulkan-drivers") && none.contains("There is: "), "{none}");
    let large = device.renderer.target(&device.gpu, [40_000, 10], 1).unwrap_err().to_string();
    assert!(large.starts_with("samples of a picture: 40000 a side; the limit of "), "{large}");
    let pack = Pack::open(&golden::richest().path()).unwrap();
    let model = Model::load(&device.gpu, &device.renderer, &pack).unwrap();
    let missing = model.check(&What::Views(0, Lookup::Nearest)).unwrap_err().to_string();
    assert!(missing.ends_with(".fpack: has no views"), "{missing}");
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
