use super::*;
use image::{DynamicImage, RgbImage, RgbaImage};

/// A folder with a capture of one or more frames of 8 × 6 pixels.
struct Folder(tempfile::TempDir);

impl Folder {
    fn new(json: &str) -> Self {
        let folder = Self(tempfile::tempdir().unwrap());
        std::fs::write(folder.0.path().join("transforms.json"), json).unwrap();
        let rgba = RgbaImage::from_fn(8, 6, |x, _| image::Rgba([10, 20, 30, (x * 30) as u8]));
        folder.image("a.png", &rgba.into());
        folder
    }

    fn image(&self, name: &str, image: &DynamicImage) {
        image.save(self.0.path().join(name)).unwrap();
    }

    fn load(&self, up: Up) -> Result<CaptureSet, ImportError> {
        load_photographs(self.0.path(), &Limits::default(), up)
    }

    fn error(&self) -> String {
        self.load(Up::Z).unwrap_err().to_string()
    }
}

/// A camera at (0, −5, 1) that looks along +y, z up.
const POSE: &str = "[[1,0,0,0],[0,0,-1,-5],[0,1,0,1],[0,0,0,1]]";

fn json(camera: &str, frame: &str) -> String {
    format!(
        r#"{{{camera}, "frames": [{{"file_path": "./a", "transform_matrix": {POSE}{frame}}}]}}"#
    )
}

#[test]
fn poses_and_intrinsics_are_read() {
    let folder = Folder::new(&json(r#""fl_x": 20, "cx": 6, "w": 16, "h": 12, "k1": 0.1"#, ""));
    let set = folder.load(Up::Z).unwrap();
    let c = &set.photographs[0].camera;
    // y-up: the eye is at (0, 1, 5) and looks along −z.
    assert!((c.eye - DVec3::new(0.0, 1.0, 5.0)).length() < 1e-12);
    assert!((c.forward + DVec3::Z).length() < 1e-12 && (c.up - DVec3::Y).length() < 1e-12);
    let Optics::Pinhole { focal, center, distortion } = c.optics else { panic!("a pinhole") };
    // The image has half the size that the intrinsics are for.
    assert_eq!((focal, center, distortion.k), ([10.0, 10.0], [3.0, 3.0], [0.1, 0.0]));
    assert_eq!(set.photographs[0].pixels[3], [10, 20, 30, 90]);
    assert_eq!(c.size, [8, 6]);
    let same = folder.load(Up::Y).unwrap().photographs[0].camera;
    assert!((same.forward - DVec3::Y).length() < 1e-12);
}

#[test]
fn frames_may_have_their_own_cameras_and_angles() {
    let own = r#", "fl_x": 12.5, "fl_y": 13"#;
    let folder = Folder::new(&json(r#""camera_angle_x": 1.5707963267948966"#, own));
    let set = folder.load(Up::Z).unwrap();
    assert!(matches!(
        set.photographs[0].camera.optics,
        Optics::Pinhole { focal: [12.5, 13.0], .. }
    ));
    let folder = Folder::new(&json(r#""camera_angle_x": 1.5707963267948966"#, ""));
    let Optics::Pinhole { focal, center, .. } =
        folder.load(Up::Z).unwrap().photographs[0].camera.optics
    else {
        panic!("a pinhole")
    };
    assert!((focal[0] - 4.0).abs() < 1e-12 && center == [4.0, 3.0]);
}

#[test]
fn what_is_wrong_is_named() {
    let says = |json: &str, parts: &[&str]| {
        let error = Folder::new(json).error();
        for part in parts {
            assert!(error.contains(part), "{error:?} lacks {part:?}");
        }
    };
    let angle = r#""camera_angle_x": 0.7"#;
    says("{}", &["transforms.json", "frames"]);
    says(r#"{"frames": []}"#, &["frames", "none"]);
    says(&json(angle, "").replace("./a", "b/missing"), &["frame 0", "missing.png"]);
    says(&json(angle, "").replace("./a", "../a"), &["frame 0", "outside"]);
    says(&json(r#""w": 8"#, ""), &["frame 0 (./a.png)", "focal"]);
    says(&json(r#""fl_x": -3"#, ""), &["-3", "above 0"]);
    says(&json(r#""fl_x": 9, "w": 16, "h": 16"#, ""), &["8×6", "16×16"]);
    says(&json(r#""fl_x": 9, "camera_model": "OPENCV_FISHEYE""#, ""), &["OPENCV_FISHEYE"]);
    says(&json(r#""fl_x": 9, "k3": 0.5"#, ""), &["k3"]);
    says(&json(r#""fl_x": 9, "is_fisheye": true"#, ""), &["fisheye"]);
    says(&json(r#""fl_x": 1e308, "w": 1, "h": 0.75"#, ""), &["1", "pixels"]);
    says(&json(r#""fl_x": 1e308, "w": 2, "h": 1.5"#, ""), &["inf", "80000"]);
    says(&json(r#""fl_x": 9, "cx": -1e9"#, ""), &["-1000000000", "80000"]);
    says(&json(r#""fl_x": 9, "p2": 1e308"#, ""), &["distortion", "1000"]);
    says(&json(angle, "").replace("[0,0,-1,-5]", "[0,0,-1]"), &["frame 0", "rows of 4"]);
    says(&json(angle, "").replace("[1,0,0,0]", "[1,0.2,0,0]"), &["rotation", "1e-3"]);
    says(&json(angle, "").replace("[1,0,0,0]", "[-1,0,0,0]"), &["mirrors"]);
    says(&json(angle, "").replace("[1,0,0,0]", "[0,0,0,0]"), &["rotation"]);
    let folder = Folder::new(&json(angle, ""));
    folder.image("a.png", &RgbImage::new(8, 6).into());
    let error = folder.error();
    assert!(error.contains("no alpha channel"), "{error}");
}
