//! The graphics device's pictures against those of `draw`: one sample a pixel, where both choose the
//! same cut and ask the same hash.

mod foliage; // foliage and the wind; fades between levels
mod limits; // hostile packs, and what a device cannot do
mod same; // points, views, volumes: the same pictures

use crate::support::repo;
use forest_foliage::Wind;
use forest_gpu::{Drawn, Frame, Gpu, Layer, Model, Options, Renderer, instance, read_samples};
use forest_import::{Block, Limits};
use forest_points::{PixelArea, Thresholds};
use forest_raster::{Light, Picture, Sun};
use forest_soup::{AlphaMode, Camera, Material, Projection, Relief, Texture, TriangleSoup, Wrap};
use forest_tests::pictures::rmse;
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

/// Gives the wood of a tree bumps that slope by up to a half.
fn with_bumps(soup: &mut TriangleSoup) {
    let texel = |i: u32| {
        let wave = |t: u32, turns: f64| (f64::from(t) * turns * std::f64::consts::TAU / 32.0).sin();
        let n = DVec3::new(0.5 * wave(i % 32, 3.0), 0.5 * wave(i / 32, 2.0), 1.0).normalize();
        let [x, y, z] = (127.5 + n * 127.5).to_array().map(|v| v.round() as u8);
        [x, y, z, 255]
    };
    let texels = (0..32 * 32).map(texel).collect();
    let name = "bumps".into();
    soup.textures
        .push(Texture { name, width: 32, height: 32, texels, wrap: [Wrap::Repeat; 2] }.into());
    let texture = soup.textures.len() as u32 - 1;
    let opaque = |m: &&mut Material| m.alpha_mode == AlphaMode::Opaque;
    let relief = Some(Relief { texture, scale: 0.8 });
    soup.materials.iter_mut().filter(opaque).for_each(|m| m.relief = relief);
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
