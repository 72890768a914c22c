//! Volumes beside photographs that their bake did not know.

use crate::error::EvalError;
use forest_draw::VolumeScene;
use forest_raster::{Picture, Sampling, Style};
use forest_soup::{Camera, Photograph, srgb8_to_linear};
use forest_volume::{Blending, Detail, VolumeBlock};
use serde::Serialize;

/// Differences of drawn pictures from photographs: means over the photographs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct MatteErrors {
    /// Photographs that were compared.
    pub photographs: usize,
    /// Root mean square difference of alpha over the pixels that either shows.
    pub matte_rmse: f64,
    /// Pixels that both show at an alpha above ½, over those that one of them does.
    pub iou: f64,
    /// Root mean square difference of premultiplied linear RGBA over the pixels that either shows.
    pub rmse: f64,
    /// Mean alpha over the photographs', minus one.
    pub coverage: f64,
}

/// Takes `n` photographs out, evenly through the list: what is left, and what was taken.
pub fn hold_out(photos: Vec<Photograph>, n: usize) -> (Vec<Photograph>, Vec<Photograph>) {
    let count = photos.len();
    // The middle of each of n equal parts.
    let taken: Vec<usize> = (0..n).map(|i| (2 * i + 1) * count / (2 * n)).collect();
    let numbered = photos.into_iter().enumerate();
    let (out, kept): (Vec<_>, Vec<_>) = numbered.partition(|(i, _)| taken.contains(i));
    let strip = |v: Vec<(usize, Photograph)>| v.into_iter().map(|(_, p)| p).collect();
    (strip(kept), strip(out))
}

/// Whether a volume can be drawn as a photograph shows it, and the photograph shows something.
///
/// # Errors
/// When its lens, pixels or centre are not a plain camera's, or its matte is empty.
pub fn can_judge(photo: &Photograph) -> Result<(), EvalError> {
    if photo.camera.plain().is_none() || photo.pixels.iter().all(|p| p[3] == 0) {
        return Err(EvalError::Lens(photo.name.clone()));
    }
    Ok(())
}

/// Draws the volume, finer than pixels, from each photograph's camera.
///
/// # Errors
/// When the pack is damaged, or a photograph's lens or centre is not a plain camera's.
pub fn matte_errors(block: &VolumeBlock, photos: &[Photograph]) -> Result<MatteErrors, EvalError> {
    let scene = VolumeScene::read(block)?;
    let mut sum = MatteErrors { photographs: photos.len(), ..MatteErrors::default() };
    let share = 1.0 / photos.len().max(1) as f64;
    for photo in photos {
        let camera = photo.camera.plain().ok_or_else(|| EvalError::Lens(photo.name.clone()))?;
        let drawn = drawn(&scene, &camera);
        let e = compare(photo, &drawn);
        sum.matte_rmse += share * e.matte_rmse;
        sum.iou += share * e.iou;
        sum.rmse += share * e.rmse;
        sum.coverage += share * e.coverage;
    }
    Ok(sum)
}

/// The volume as a photograph's camera sees it.
pub fn drawn(scene: &VolumeScene, camera: &Camera) -> Picture {
    let sampling = Sampling { side: 4, seed: 1 };
    scene.draw(camera, Detail::PIXEL, Blending::Shares, Style::from(sampling)).0
}

fn compare(photo: &Photograph, drawn: &Picture) -> MatteErrors {
    let (mut matte, mut color, mut count) = (0.0, 0.0, 0.0);
    let (mut both, mut either, mut sums) = (0.0, 0.0, [0.0; 2]);
    for (&[r, g, b, a], pixel) in photo.pixels.iter().zip(&drawn.pixels) {
        let alpha = f32::from(a) / 255.0;
        let [r, g, b] = [r, g, b].map(|c| srgb8_to_linear(c) * alpha);
        sums = [sums[0] + f64::from(alpha), sums[1] + f64::from(pixel[3])];
        if a == 0 && pixel[3] == 0.0 {
            continue;
        }
        let square = |(p, q): (&f32, f32)| f64::from(p - q).powi(2);
        color += pixel.iter().zip([r, g, b, alpha]).map(square).sum::<f64>() / 4.0;
        matte += square((&pixel[3], alpha));
        count += 1.0;
        let shown = [alpha > 0.5, pixel[3] > 0.5];
        both += f64::from(u8::from(shown == [true; 2]));
        either += f64::from(u8::from(shown != [false; 2]));
    }
    MatteErrors {
        photographs: 1,
        matte_rmse: (matte / f64::max(count, 1.0)).sqrt(),
        iou: if either > 0.0 { both / either } else { 1.0 },
        rmse: (color / f64::max(count, 1.0)).sqrt(),
        coverage: sums[1] / f64::max(sums[0], 1e-9) - 1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use forest_soup::Projection;
    use glam::DVec3;

    fn photo(name: &str, pixels: Vec<[u8; 4]>) -> Photograph {
        let projection = Projection::Perspective { fov_y: 1.0 };
        let camera = Camera::new(DVec3::ZERO, -DVec3::Z, projection, [2, 2]);
        Photograph { name: name.into(), camera: (&camera).into(), pixels }
    }

    #[test]
    fn photographs_are_held_out_evenly() {
        let photos = (0..10).map(|i| photo(&i.to_string(), vec![])).collect();
        let (kept, out) = hold_out(photos, 3);
        let names = |v: &[Photograph]| v.iter().map(|p| p.name.clone()).collect::<String>();
        assert_eq!((names(&kept), names(&out)), ("0234679".into(), "158".into()));
    }

    #[test]
    fn errors_by_hand() {
        let white = [255, 255, 255, 255];
        let photo = photo("a", vec![white, white, [0; 4], [0; 4]]);
        let mut picture = Picture::empty(2, 2);
        picture.pixels[0] = [1.0; 4];
        picture.pixels[2] = [0.0, 0.0, 0.0, 0.6];
        let e = compare(&photo, &picture);
        // Of three pixels one is right, one lacks 1, one has 0.6 too much.
        assert!((e.matte_rmse - (1.36f64 / 3.0).sqrt()).abs() < 1e-6);
        assert!((e.rmse - ((1.0 + 0.09) / 3.0f64).sqrt()).abs() < 1e-6);
        assert!((e.iou - 1.0 / 3.0).abs() < 1e-12);
        assert!((e.coverage + 0.2).abs() < 1e-6);
    }
}
