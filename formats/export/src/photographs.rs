//! Photographs as NeRF tools read them: a `transforms.json` and RGBA images.

use crate::ExportError;
use crate::picture::{ExportFile, png};
use forest_soup::{Optics, Photograph};
use glam::DVec3;
use image::RgbaImage;
use serde_json::{Value, json};

/// One PNG a photograph, named after it, and the `transforms.json` that describes them: z up, each
/// frame with its own intrinsics. The images lie beside the file.
///
/// # Errors
/// When a photograph is parallel, which the layout does not know, or its name is no file's.
pub fn photographs(photos: &[Photograph]) -> Result<Vec<ExportFile>, ExportError> {
    let mut files = Vec::new();
    let mut frames = Vec::new();
    for photo in photos {
        if photo.name.contains(['/', '\\']) {
            return Err(ExportError::Unsuited(format!("{:?} is no file name", photo.name)));
        }
        let name = format!("{}.png", photo.name);
        frames.push(frame(photo, &name)?);
        let [w, h] = photo.camera.size;
        let image = RgbaImage::from_raw(w, h, photo.pixels.as_flattened().to_vec());
        let image = image.expect("a photograph has a pixel for each place");
        files.push(ExportFile { name, bytes: png(image)? });
    }
    let transforms = json!({ "camera_model": "OPENCV", "frames": frames });
    let bytes = format!("{transforms:#}\n").into_bytes();
    files.push(ExportFile { name: "transforms.json".into(), bytes });
    Ok(files)
}

fn frame(photo: &Photograph, name: &str) -> Result<Value, ExportError> {
    let camera = &photo.camera;
    let Optics::Pinhole { focal, center, distortion } = camera.optics else {
        let problem = format!("{}: transforms.json has no parallel cameras", photo.name);
        return Err(ExportError::Unsuited(problem));
    };
    // z up.
    let turned = |v: DVec3| [v.x, -v.z, v.y];
    let columns = [camera.right, camera.up, -camera.forward, camera.eye].map(turned);
    let row = |k: usize| columns.map(|c| c[k]);
    Ok(json!({
        "file_path": name,
        "w": camera.size[0], "h": camera.size[1],
        "fl_x": focal[0], "fl_y": focal[1], "cx": center[0], "cy": center[1],
        "k1": distortion.k[0], "k2": distortion.k[1],
        "p1": distortion.p[0], "p2": distortion.p[1],
        "transform_matrix": [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]],
    }))
}
