"""Metrics of made pictures, computed without this project's code: writes metrics.json beside itself.

SSIM and PSNR are scikit-image's, FLIP is its authors'; the others are written out in numpy.

    pip install scikit-image==0.26.0 flip-evaluator==1.7 numpy
    python3 crates/eval/reference/metrics.py

The pictures are made by the same integer formulas in crates/eval/src/metrics/tests.rs.
"""

import json
import pathlib

import flip_evaluator
import numpy as np
import skimage
from skimage.metrics import peak_signal_noise_ratio, structural_similarity

BACKGROUND = 0.5


def picture(case, which, width, height):
    """Premultiplied linear RGBA in single precision, and depth."""
    y, x = np.mgrid[0:height, 0:width].astype(np.int64)
    shift = which * case
    u = (x * 7 + y * 13 + x * y + shift * 11) % 64
    inside = (2 * x - width + shift) ** 2 + (2 * y - height) ** 2 <= (min(width, height) - 2) ** 2
    alpha = np.where(inside, (u % 5 + 4) / 8.0, 0.0)
    r = (u % 16) / 16.0
    g = ((x + 3 * y + shift) % 32) / 32.0
    b = ((x * y) % 8) / 8.0
    rgba = np.stack([r * alpha, g * alpha, b * alpha, alpha], axis=-1).astype(np.float32)
    depth = np.where(inside, 10.0 + (x + y * 2 + shift * 3) / 4.0, np.inf)
    return rgba, depth


def srgb(linear):
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def over(rgba):
    """8-bit sRGB over the grey."""
    rgba = rgba.astype(np.float64)
    linear = rgba[..., :3] + BACKGROUND * (1.0 - rgba[..., 3:])
    return np.clip(np.floor(srgb(linear) * 255.0 + 0.5), 0, 255).astype(np.uint8)


def framed(rgb, border):
    grey = int(np.floor(srgb(np.float64(BACKGROUND)) * 255.0 + 0.5))
    return np.pad(rgb, ((border, border), (border, border), (0, 0)), constant_values=grey)


def compare(case, width, height):
    (a, da), (b, db) = (picture(case, k, width, height) for k in (0, 1))
    ys, xs = np.nonzero((a[..., 3] > 0) | (b[..., 3] > 0))
    box = np.s_[ys.min() : ys.max() + 1, xs.min() : xs.max() + 1]
    a, b, da, db = a[box], b[box], da[box], db[box]
    a64, b64 = a.astype(np.float64), b.astype(np.float64)
    rmse = float(np.sqrt(np.mean((a64 - b64) ** 2)))
    # The windows are those that lie within the picture: our border of 5 makes them the box's pixels.
    ssim = structural_similarity(
        framed(over(a), 5), framed(over(b), 5), channel_axis=2, gaussian_weights=True, sigma=1.5,
        use_sample_covariance=False, data_range=255,
    )
    pictures = [framed(over(p), 10).astype(np.float32) / 255.0 for p in (a, b)]
    flip, _, _ = flip_evaluator.evaluate(
        *pictures, "LDR", inputsRGB=True, applyMagma=False, computeMeanError=True,
        parameters={"ppd": 67.0},
    )
    four = [picture(case, k, width, height)[0].astype(np.float64) for k in range(4)]
    ys, xs = np.nonzero(np.any([p[..., 3] > 0 for p in four], axis=0))
    whole = np.s_[ys.min() : ys.max() + 1, xs.min() : xs.max() + 1]
    residual = (four[3] - four[2]) - (four[1] - four[0])
    low, high = np.minimum(a64[..., 3], b64[..., 3]), np.maximum(a64[..., 3], b64[..., 3])
    both = low > 0
    depth = np.sqrt(np.average((da[both] - db[both]) ** 2, weights=low[both]))
    return {
        "case": case,
        "width": width,
        "height": height,
        "rmse": rmse,
        "psnr": float(peak_signal_noise_ratio(a64, b64, data_range=1.0)),
        "ssim": float(ssim),
        "flip": float(np.mean(np.squeeze(flip)[10:-10, 10:-10].astype(np.float64))),
        "coverage": float(np.mean(b64[..., 3]) - np.mean(a64[..., 3])),
        "coverage_ratio": float(np.sum(b64[..., 3]) / np.sum(a64[..., 3]) - 1.0),
        "silhouette_iou": float(np.sum(low) / np.sum(high)),
        "depth": float(depth),
        "popping": float(np.sqrt(np.mean(residual[whole] ** 2))),
    }


if __name__ == "__main__":
    cases = [(1, 64, 64), (6, 64, 48), (3, 40, 100), (2, 5, 7), (9, 200, 150)]
    result = {
        "versions": {
            "scikit-image": skimage.__version__,
            "numpy": np.__version__,
            "flip-evaluator": "1.7",
        },
        "cases": [compare(*c) for c in cases],
    }
    path = pathlib.Path(__file__).with_name("metrics.json")
    path.write_text(json.dumps(result, indent=1) + "\n")
