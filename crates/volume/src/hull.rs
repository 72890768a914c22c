//! Where the tree of a set of photographs is: the box around its visual hull.

use crate::error::VolumeError;
use crate::matte::Matte;
use forest_soup::{Optics, Photograph};
use glam::{DMat3, DVec3, UVec3};
use rayon::prelude::*;

/// Cells along a side of the search.
const CELLS: u32 = 48;

/// Times that the box is drawn tighter.
const ROUNDS: u32 = 4;

/// The box around all places that every matte that shows them covers (A. Laurentini, "The visual
/// hull concept for silhouette-based image understanding", 1994), and that at least half of the
/// photographs show.
///
/// # Errors
/// When there is no such place, naming photographs that stand against most others.
pub(crate) fn bounds(photos: &[Photograph], mattes: &[Matte]) -> Result<[DVec3; 2], VolumeError> {
    let middle = nearest_to_axes(photos);
    // The widest: a close-up shows a part of the tree only.
    let reach = photos.iter().map(|p| reach(p, middle)).fold(0.0, f64::max);
    let mut cube = [middle - reach, middle + reach];
    for _ in 0..ROUNDS {
        let Some([low, high]) = occupied(photos, mattes, cube) else {
            return Err(VolumeError::Inconsistent(diagnosis(photos, mattes, cube)));
        };
        cube = [low, high];
    }
    Ok(cube)
}

/// Half the side of a cube about `middle` that a photograph may show.
fn reach(photo: &Photograph, middle: DVec3) -> f64 {
    let [w, h] = photo.camera.size.map(f64::from);
    match photo.camera.optics {
        Optics::Parallel { pixel } => 0.5 * w.max(h) * pixel,
        Optics::Pinhole { .. } => {
            let distance = photo.camera.eye.distance(middle);
            let corner = photo.camera.ray(0.0, 0.0).map_or(1.0, |r| r.1.dot(photo.camera.forward));
            distance * (1.0 / (corner * corner) - 1.0).max(0.01).sqrt()
        }
    }
}

/// The place nearest to all optical axes, in the sense of least squares.
fn nearest_to_axes(photos: &[Photograph]) -> DVec3 {
    let (mut a, mut b) = (DMat3::ZERO, DVec3::ZERO);
    for camera in photos.iter().map(|p| &p.camera) {
        let f = camera.forward;
        let aside = DMat3::IDENTITY - DMat3::from_cols(f * f.x, f * f.y, f * f.z);
        a += aside;
        b += aside * camera.eye;
    }
    // A little pull to the middle of the eyes, a step ahead: parallel axes have no nearest place.
    let n = photos.len() as f64;
    let ahead = |p: &Photograph| p.camera.eye + p.camera.forward;
    let mean = photos.iter().map(ahead).sum::<DVec3>() / n;
    (a + DMat3::IDENTITY * (1e-6 * n)).inverse() * (b + mean * (1e-6 * n))
}

fn places() -> impl IndexedParallelIterator<Item = DVec3> {
    let n = CELLS;
    (0..n * n * n)
        .into_par_iter()
        .map(move |i| UVec3::new(i % n, i / n % n, i / (n * n)).as_dvec3() + 0.5)
}

/// The box around the cells of `cube` that may hold something, half a cell larger.
fn occupied(photos: &[Photograph], mattes: &[Matte], cube: [DVec3; 2]) -> Option<[DVec3; 2]> {
    let cell = (cube[1] - cube[0]) / f64::from(CELLS);
    let half = 0.5 * cell.max_element();
    let empty = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    let [low, high] = places()
        .filter_map(|place| {
            let center = cube[0] + place * cell;
            let mut seen = 0;
            for (photo, matte) in photos.iter().zip(mattes) {
                match matte.shows(&photo.camera, center, half) {
                    Some(true) => seen += 1,
                    Some(false) => return None,
                    None => {}
                }
            }
            (2 * seen >= photos.len()).then_some([center, center])
        })
        .reduce(|| empty, |a, b| [a[0].min(b[0]), a[1].max(b[1])]);
    (low.x <= high.x).then(|| [low - cell, high + cell])
}

/// Who stands against whom.
fn diagnosis(photos: &[Photograph], mattes: &[Matte], cube: [DVec3; 2]) -> String {
    let cell = (cube[1] - cube[0]) / f64::from(CELLS);
    let half = 0.5 * cell.max_element();
    // Places that all photographs but one allow, by that one.
    let alone: Vec<u64> = places()
        .fold(
            || vec![0u64; photos.len()],
            |mut alone, place| {
                let center = cube[0] + place * cell;
                let against = (0..photos.len())
                    .filter(|&i| mattes[i].shows(&photos[i].camera, center, half) == Some(false));
                let against: Vec<usize> = against.take(2).collect();
                if let [one] = against[..] {
                    alone[one] += 1;
                }
                alone
            },
        )
        .reduce(|| vec![0; photos.len()], |a, b| a.iter().zip(&b).map(|(a, b)| a + b).collect());
    let mut order: Vec<usize> = (0..photos.len()).filter(|&i| alone[i] > 0).collect();
    order.sort_by_key(|&i| std::cmp::Reverse(alone[i]));
    let what = "no place is covered in all mattes that show it and seen by half of the photographs";
    let names: Vec<String> =
        order.iter().take(3).map(|&i| format!("{} ({} cells)", photos[i].name, alone[i])).collect();
    match names.is_empty() {
        true => format!("{what}; are poses and focal lengths right?"),
        false => format!("{what}; alone against all others: {}", names.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use forest_soup::{Camera, PhotoCamera, Projection};

    /// Mattes of a ball of radius ½ about (1, 2, 3) from eight sides.
    fn ball() -> Vec<Photograph> {
        let middle = DVec3::new(1.0, 2.0, 3.0);
        (0..8)
            .map(|i| {
                let angle = f64::from(i) * std::f64::consts::FRAC_PI_4;
                let from = DVec3::new(angle.sin(), 0.4, angle.cos()).normalize();
                let eye = middle + from * 5.0;
                let projection = Projection::Perspective { fov_y: 0.9 };
                let camera = Camera::new(eye, middle - eye + 0.1, projection, [96, 96]);
                let camera = PhotoCamera::from(&camera);
                let pixels = (0..96 * 96).map(|i| {
                    let (x, y) = (f64::from(i % 96) + 0.5, f64::from(i / 96) + 0.5);
                    let (from, along) = camera.ray(x, y).unwrap();
                    let inside = (middle - from).cross(along).length() < 0.5;
                    [90, 80, 70, if inside { 255 } else { 0 }]
                });
                Photograph { name: format!("{i}.png"), camera, pixels: pixels.collect() }
            })
            .collect()
    }

    #[test]
    fn finds_the_box_of_a_ball() {
        let photos = ball();
        let mattes: Vec<Matte> = photos.iter().map(Matte::new).collect();
        let [low, high] = bounds(&photos, &mattes).unwrap();
        let middle = DVec3::new(1.0, 2.0, 3.0);
        for k in 0..3 {
            assert!(low[k] <= middle[k] - 0.5 && low[k] > middle[k] - 0.75, "{low}");
            assert!(high[k] >= middle[k] + 0.5 && high[k] < middle[k] + 0.75, "{high}");
        }
    }

    #[test]
    fn a_camera_in_a_wrong_place_is_named() {
        let mut photos = ball();
        photos[3].camera.eye += DVec3::new(0.0, 1.5, 0.0);
        let mattes: Vec<Matte> = photos.iter().map(Matte::new).collect();
        let VolumeError::Inconsistent(why) = bounds(&photos, &mattes).unwrap_err() else {
            panic!("another error")
        };
        assert!(why.contains("3.png"), "{why}");
    }
}
