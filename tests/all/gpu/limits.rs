//! Hostile packs, and what a device cannot do, end in an error that says what.

use super::{Device, cameras, thresholds};
use crate::support::repo;
use forest_foliage::Wind;
use forest_gpu::{Costs, Frame, Gpu, GpuError, Layer, Model, Options, What, candidates, instance};
use forest_pack::Pack;
use forest_points::Thresholds;
use forest_raster::Light;
use forest_soup::Camera;
use forest_tests::fuzz::forged;
use forest_tests::{golden, open, with_section};
use forest_views::Lookup;
use forest_volume::{Blending, Detail};

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
    corpus("sections").filter_map(|bytes| forged(&bytes)).for_each(|pack| take(&pack));
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
