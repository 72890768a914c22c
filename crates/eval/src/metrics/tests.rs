use super::*;
use serde_json::Value;

const BACKGROUND: f32 = 0.5;

/// The made pictures of reference/metrics.py, by the same integers.
fn made(case: i64, which: i64, width: u32, height: u32) -> Picture {
    let mut p = Picture::empty(width, height);
    let (w, h) = (i64::from(width), i64::from(height));
    for i in 0..w * h {
        let (x, y, shift) = (i % w, i / w, which * case);
        let u = (x * 7 + y * 13 + x * y + shift * 11) % 64;
        let inside = (2 * x - w + shift).pow(2) + (2 * y - h).pow(2) <= (w.min(h) - 2).pow(2);
        if !inside {
            continue;
        }
        let alpha = (u % 5 + 4) as f64 / 8.0;
        let r = (u % 16) as f64 / 16.0;
        let g = ((x + 3 * y + shift) % 32) as f64 / 32.0;
        let b = ((x * y) % 8) as f64 / 8.0;
        p.pixels[i as usize] = [r * alpha, g * alpha, b * alpha, alpha].map(|v| v as f32);
        p.depth[i as usize] = 10.0 + (x + y * 2 + shift * 3) as f32 / 4.0;
    }
    p
}

#[test]
fn every_metric_is_that_of_its_reference_implementation() {
    let json: Value = serde_json::from_str(include_str!("../../reference/metrics.json")).unwrap();
    let cases = json["cases"].as_array().unwrap();
    assert_eq!(cases.len(), 5);
    for c in cases {
        let n = |key: &str| c[key].as_f64().unwrap();
        let (w, h) = (n("width") as u32, n("height") as u32);
        let [a, b] = [0, 1].map(|k| made(n("case") as i64, k, w, h));
        let e = Comparison::new(&a, &b).errors(BACKGROUND, 1.0);
        let [c2, d] = [2, 3].map(|k| made(n("case") as i64, k, w, h));
        let popped = popping([&a, &b], [&c2, &d]);
        for (key, got, tolerance) in [
            ("rmse", e.rmse, 1e-9),
            ("psnr", e.psnr.unwrap(), 1e-7),
            ("ssim", e.ssim, 1e-9),
            ("flip", e.flip, 2e-5),
            ("coverage", e.coverage, 1e-9),
            ("coverage_ratio", e.coverage_ratio.unwrap(), 1e-9),
            ("silhouette_iou", e.silhouette_iou, 1e-9),
            ("depth", e.depth.unwrap(), 1e-9),
            ("popping", popped, 1e-7),
        ] {
            assert!((got - n(key)).abs() < tolerance, "{key} of {w}×{h}: {got}, want {}", n(key));
        }
    }
}

#[test]
fn equal_pictures_have_no_error() {
    let a = made(3, 0, 40, 30);
    let e = Comparison::new(&a, &a).errors(BACKGROUND, 1.0);
    assert_eq!((e.rmse, e.psnr, e.flip, e.coverage), (0.0, None, 0.0, 0.0));
    assert!((e.ssim - 1.0).abs() < 1e-12 && e.silhouette_iou == 1.0 && e.depth == Some(0.0));
}

#[test]
fn empty_pictures_are_equal_and_one_pixel_is_enough() {
    let empty = Picture::empty(9, 4);
    let e = Comparison::new(&empty, &empty).errors(BACKGROUND, 1.0);
    let none = Errors {
        rmse: 0.0,
        psnr: None,
        ssim: 1.0,
        flip: 0.0,
        coverage: 0.0,
        coverage_ratio: None,
        silhouette_iou: 1.0,
        depth: None,
    };
    assert_eq!(e, none);
    // One white pixel that the other has not.
    let mut dot = Picture::empty(9, 4);
    dot.pixels[13] = [1.0; 4];
    dot.depth[13] = 3.0;
    let e = Comparison::new(&dot, &empty).errors(BACKGROUND, 1.0);
    assert_eq!((e.rmse, e.psnr, e.coverage, e.coverage_ratio), (1.0, Some(0.0), -1.0, Some(-1.0)));
    assert!(e.silhouette_iou == 0.0 && e.depth.is_none() && e.flip > 0.1 && e.ssim < 0.5);
    let e = Comparison::new(&empty, &dot).errors(BACKGROUND, 1.0);
    assert_eq!((e.coverage, e.coverage_ratio), (1.0, None));
}

#[test]
fn background_does_not_dilute() {
    let (small, large) = (made(6, 0, 64, 48), made(6, 1, 64, 48));
    let padded = |p: &Picture| {
        let mut out = Picture::empty(264, 148);
        for y in 0..48 {
            let (to, from) = ((50 + y) * 264 + 70, y * 64);
            out.pixels[to..to + 64].copy_from_slice(&p.pixels[from..from + 64]);
            out.depth[to..to + 64].copy_from_slice(&p.depth[from..from + 64]);
        }
        out
    };
    let near = Comparison::new(&small, &large).errors(BACKGROUND, 1.0);
    let far = Comparison::new(&padded(&small), &padded(&large)).errors(BACKGROUND, 1.0);
    assert_eq!(near, far);
}

#[test]
fn popping_is_what_the_truth_does_not_do() {
    let flat = |v: f32| {
        let mut p = Picture::empty(10, 10);
        p.pixels.fill([v, v, v, 1.0]);
        p
    };
    let (a, b, c) = (flat(0.2), flat(0.3), flat(0.5));
    // The truth changes by 0.1 in three of four channels, the test by 0.3.
    let want = 0.2 * 0.75f64.sqrt();
    assert!((popping([&a, &b], [&a, &c]) - want).abs() < 1e-6);
    assert!((popping([&a, &c], [&a, &b]) - want).abs() < 1e-6);
    // A constant error is no popping.
    assert!(popping([&a, &b], [&b, &flat(0.4)]) < 1e-6);
    let empty = Picture::empty(10, 10);
    assert_eq!(popping([&empty, &empty], [&empty, &empty]), 0.0);
    // A pop of one pixel is seen although the truth moves far more.
    let mut popped = made(9, 1, 64, 48);
    let (t0, t1) = (made(9, 0, 64, 48), popped.clone());
    popped.pixels[24 * 64 + 30] = [1.0, 0.0, 0.0, 1.0];
    assert_eq!(popping([&t0, &t1], [&t0, &t1]), 0.0);
    assert!(popping([&t0, &t1], [&t0, &popped]) > 0.001);
}

#[test]
fn heat_has_the_size_of_the_box() {
    let (a, b) = (made(6, 0, 64, 48), made(6, 1, 64, 48));
    let c = Comparison::new(&a, &b);
    let (w, h, pixels) = c.flip(BACKGROUND).heat();
    assert_eq!((w, h), (c.pictures().0.width, c.pictures().0.height));
    assert_eq!(pixels.len() as u32, w * h);
    assert!(pixels.iter().any(|p| *p != pixels[0]));
}
