//! Photographs with calibrated cameras: the `transforms.json` that NeRF tools write, and RGBA images.
//!
//! The layout is that of instant-ngp and nerfstudio: intrinsics in pixels (or an angle of view) for
//! all frames or for each, `transform_matrix` from camera to world with the camera looking along
//! −z and y up. The matte is the image's alpha.

use crate::source::{Limits, Source};
use crate::{Files, ImportError, picture};
use forest_soup::{Distortion, Optics, PhotoCamera, Photograph};
use glam::DVec3;
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// Which axis of a capture's world points up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Up {
    /// y: nothing is turned.
    Y,
    /// z, as NeRF tools have it: (x, y, z) becomes (x, z, −y).
    Z,
}

impl Up {
    /// A vector of the capture's world in ours, whose y points up.
    pub fn to_y(self, v: DVec3) -> DVec3 {
        match self {
            Self::Y => v,
            Self::Z => DVec3::new(v.x, v.z, -v.y),
        }
    }
}

/// A set of photographs, read.
#[derive(Debug)]
pub struct CaptureSet {
    /// The photographs, in the file's order.
    pub photographs: Vec<Photograph>,
    /// BLAKE3 over the file and all images, in the order of reading.
    pub hash: [u8; 32],
    /// What was odd but could be read.
    pub warnings: Vec<String>,
}

/// The parameters of a camera that a file gives for all frames or for one.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
struct Intrinsics {
    camera_model: Option<String>,
    is_fisheye: Option<bool>,
    camera_angle_x: Option<f64>,
    camera_angle_y: Option<f64>,
    fl_x: Option<f64>,
    fl_y: Option<f64>,
    cx: Option<f64>,
    cy: Option<f64>,
    w: Option<f64>,
    h: Option<f64>,
    k1: Option<f64>,
    k2: Option<f64>,
    k3: Option<f64>,
    k4: Option<f64>,
    p1: Option<f64>,
    p2: Option<f64>,
}

#[derive(Deserialize)]
struct Transforms {
    #[serde(flatten)]
    camera: Intrinsics,
    frames: Vec<Frame>,
}

#[derive(Deserialize)]
struct Frame {
    file_path: String,
    transform_matrix: Vec<Vec<f64>>,
    #[serde(flatten)]
    camera: Intrinsics,
}

/// The file that describes a capture: `path` itself, or `transforms.json` in the folder `path`.
pub fn transforms_file(path: &Path) -> PathBuf {
    if path.is_dir() { path.join("transforms.json") } else { path.into() }
}

/// Reads the photographs that the `transforms.json` at `path` (or in the folder `path`) names.
///
/// # Errors
/// When a file cannot be read or breaks a rule: no alpha, a matrix that is no pose, intrinsics
/// that are missing or do not fit the image; or a camera model that is not supported.
pub fn load_photographs(path: &Path, limits: &Limits, up: Up) -> Result<CaptureSet, ImportError> {
    load_photographs_from(&Files::Disk, &transforms_file(path), limits, up)
}

/// As [`load_photographs`], of the file `path`, and of files that may be in memory.
///
/// # Errors
/// As [`load_photographs`].
pub fn load_photographs_from(
    files: &Files,
    path: &Path,
    limits: &Limits,
    up: Up,
) -> Result<CaptureSet, ImportError> {
    let mut source = Source::open(files, path, *limits)?;
    let transforms: Transforms = serde_json::from_slice(&source.bytes()?)
        .map_err(|e| source.invalid("file", format!("not a transforms.json: {e}")))?;
    if transforms.frames.is_empty() {
        return Err(source.invalid("frames", "there are none"));
    }
    let frames = transforms.frames.len();
    if frames > MOST_FRAMES {
        return Err(source.invalid("frames", format!("{frames}; at most {MOST_FRAMES}")));
    }
    let (mut photographs, mut pixels) = (Vec::new(), 0);
    for (i, frame) in transforms.frames.iter().enumerate() {
        let photo = photograph(&mut source, i, frame, &transforms.camera, up)?;
        pixels += photo.pixels.len() as u64;
        if pixels > MOST_PIXELS {
            let problem = format!("{pixels} pixels up to here; at most {MOST_PIXELS}");
            return Err(source.invalid(format!("frame {i}"), problem));
        }
        photographs.push(photo);
    }
    let (hash, warnings) = source.finish();
    Ok(CaptureSet { photographs, hash, warnings })
}

fn photograph(
    source: &mut Source,
    i: usize,
    frame: &Frame,
    common: &Intrinsics,
    up: Up,
) -> Result<Photograph, ImportError> {
    let name = frame_file(&frame.file_path);
    let element = format!("frame {i} ({name})");
    let bytes = source.file(&element, &name)?;
    let image = picture::decode(source, &element, &bytes)?;
    if !image.color().has_alpha() {
        let problem = "the image has no alpha channel: its background must be cut away (RGBA)";
        return Err(source.invalid(&element, problem));
    }
    let rgba = image.to_rgba8();
    let size = [rgba.width(), rgba.height()];
    let optics = frame.camera.over(common).optics(source, &element, size)?;
    let [right, up, back, eye] =
        pose(source, &element, &frame.transform_matrix)?.map(|v| up.to_y(v));
    let camera = PhotoCamera { eye, right, up, forward: -back, optics, size };
    let pixels = rgba.pixels().map(|p| p.0).collect();
    Ok(Photograph { name: frame.file_path.clone(), camera, pixels })
}

/// The file that a frame names. As synthetic data sets do, names may lack their extension.
pub(crate) fn frame_file(name: &str) -> String {
    match Path::new(name).extension().is_none_or(|e| e.len() > 4) {
        true => format!("{name}.png"),
        false => name.into(),
    }
}

/// Focal lengths and centres in sides of the image at most.
const MOST_SIDES: f64 = 1e4;

/// Distortion terms at most.
const MOST_DISTORTION: f64 = 1e3;

/// Frames at most, and pixels of all of them: 4 GiB.
const MOST_FRAMES: usize = 4096;
const MOST_PIXELS: u64 = 1 << 30;

/// Largest deviation of a pose's axes from unit length and right angles.
const POSE_TOLERANCE: f64 = 1e-3;

/// Right, up, back and the eye.
fn pose(source: &Source, element: &str, matrix: &[Vec<f64>]) -> Result<[DVec3; 4], ImportError> {
    let invalid =
        |problem: String| Err(source.invalid(element, format!("transform_matrix {problem}")));
    if !(3..=4).contains(&matrix.len()) || matrix.iter().any(|row| row.len() != 4) {
        return invalid("is not a matrix of 3 or 4 rows of 4 numbers".into());
    }
    if let Some(v) = matrix.iter().flatten().find(|v| !v.is_finite()) {
        return invalid(format!("holds {v}"));
    }
    let column = |k: usize| DVec3::new(matrix[0][k], matrix[1][k], matrix[2][k]);
    let axes = [0, 1, 2].map(column);
    let scale = axes[0].length();
    let [right, up, back] = axes.map(|a| a / scale);
    let off =
        [right.dot(up), up.dot(back), back.dot(right), up.length() - 1.0, back.length() - 1.0];
    // `max` drops what is not a number: the axes of a matrix of zeros.
    let worst = off.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    if worst > POSE_TOLERANCE || off.iter().any(|v| v.is_nan()) {
        return invalid(format!("is no rotation: off by {worst:.2e}; at most {POSE_TOLERANCE:e}"));
    }
    if right.cross(up).dot(back) < 0.0 {
        return invalid("mirrors".into());
    }
    // Exactly right-angled.
    let (back, right) = (back.normalize(), up.cross(back).normalize());
    Ok([right, back.cross(right), back, column(3)])
}

impl Intrinsics {
    /// What a frame says, and for the rest what the file says of all.
    fn over(&self, common: &Self) -> Self {
        let or = |a: Option<f64>, b: Option<f64>| a.or(b);
        Self {
            camera_model: self.camera_model.clone().or_else(|| common.camera_model.clone()),
            is_fisheye: self.is_fisheye.or(common.is_fisheye),
            camera_angle_x: or(self.camera_angle_x, common.camera_angle_x),
            camera_angle_y: or(self.camera_angle_y, common.camera_angle_y),
            fl_x: or(self.fl_x, common.fl_x),
            fl_y: or(self.fl_y, common.fl_y),
            cx: or(self.cx, common.cx),
            cy: or(self.cy, common.cy),
            w: or(self.w, common.w),
            h: or(self.h, common.h),
            k1: or(self.k1, common.k1),
            k2: or(self.k2, common.k2),
            k3: or(self.k3, common.k3),
            k4: or(self.k4, common.k4),
            p1: or(self.p1, common.p1),
            p2: or(self.p2, common.p2),
        }
    }

    /// For an image of `size` pixels.
    fn optics(
        &self,
        source: &Source,
        element: &str,
        size: [u32; 2],
    ) -> Result<Optics, ImportError> {
        let invalid = |problem: String| Err(source.invalid(element, problem));
        let model = self.camera_model.as_deref().unwrap_or("OPENCV");
        if !["OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL"].contains(&model) {
            return Err(source.unsupported(format!("{element}: the camera model {model:?}")));
        }
        if self.is_fisheye == Some(true) {
            return Err(source.unsupported(format!("{element}: a fisheye camera (is_fisheye)")));
        }
        if [self.k3, self.k4].iter().flatten().any(|k| *k != 0.0) {
            return Err(
                source.unsupported(format!("{element}: distortion of higher order (k3, k4)"))
            );
        }
        let numbers = [self.camera_angle_x, self.camera_angle_y, self.fl_x, self.fl_y, self.cx]
            .into_iter()
            .chain([self.cy, self.w, self.h, self.k1, self.k2, self.p1, self.p2]);
        if let Some(v) = numbers.flatten().find(|v| !v.is_finite()) {
            return invalid(format!("an intrinsic parameter is {v}"));
        }
        // Intrinsics of a picture that was made smaller since.
        let [w, h] = size.map(f64::from);
        let (was_w, was_h) = (self.w.unwrap_or(w), self.h.unwrap_or(h));
        if !(was_w >= 1.0 && was_h >= 1.0) {
            return invalid(format!("intrinsics for {was_w}×{was_h} pixels"));
        }
        let scale = w / was_w;
        if (h - was_h * scale).abs() > 1.0 {
            return invalid(format!(
                "the image is {w}×{h} pixels, the intrinsics are for {was_w}×{was_h}"
            ));
        }
        let of_angle = |angle: Option<f64>, side: f64| match angle {
            Some(a) if a > 0.0 && a < std::f64::consts::PI => Some(0.5 * side / (0.5 * a).tan()),
            _ => None,
        };
        let fx = self.fl_x.map(|f| f * scale).or_else(|| of_angle(self.camera_angle_x, w));
        let fy = self.fl_y.map(|f| f * scale).or_else(|| of_angle(self.camera_angle_y, h));
        let focal = match (fx, fy) {
            (Some(x), Some(y)) => [x, y],
            (Some(f), None) | (None, Some(f)) => [f, f],
            (None, None) => {
                return invalid("no focal length (fl_x, fl_y or camera_angle_x) in 0 … π".into());
            }
        };
        if focal.iter().any(|f| *f <= 0.0) {
            return invalid(format!("focal lengths {focal:?}; they must be above 0"));
        }
        let zero = |v: Option<f64>| v.unwrap_or(0.0);
        let distortion =
            Distortion { k: [zero(self.k1), zero(self.k2)], p: [zero(self.p1), zero(self.p2)] };
        let center =
            [self.cx.map_or(0.5 * w, |c| c * scale), self.cy.map_or(0.5 * h, |c| c * scale)];
        let side = w.max(h);
        let far = |v: f64| !v.is_finite() || v.abs() > MOST_SIDES * side;
        if let Some(v) = focal.into_iter().chain(center).find(|v| far(*v)) {
            let most = MOST_SIDES * side;
            return invalid(format!("a focal length or centre of {v} pixels; at most {most}"));
        }
        let terms = distortion.k.into_iter().chain(distortion.p);
        if let Some(v) = terms.into_iter().find(|v| v.abs() > MOST_DISTORTION) {
            return invalid(format!("a distortion of {v}; at most {MOST_DISTORTION}"));
        }
        Ok(Optics::Pinhole { focal, center, distortion })
    }
}

#[cfg(test)]
mod tests;
