//! One view's texels at every resolution.

use crate::header::ViewFrame;
use forest_raster::{Capture, sample_hash};
use forest_soup::linear_to_srgb8;
use glam::{DVec3, Vec3};

/// Channels of a texel while it is filtered: linear RGB, normal in the view's frame, depth and sky,
/// all premultiplied by coverage, and coverage.
const COLOR: usize = 0;
const NORMAL: usize = 3;
const DEPTH: usize = 6;
const SKY: usize = 7;
const ALPHA: usize = 8;
type Texel = [f32; 9];

/// A tile at one level: the part of it that shows something, with a gutter of a texel all around,
/// in whole blocks of 4 × 4.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TileLevel {
    pub(crate) left: i32,
    pub(crate) top: i32,
    pub(crate) width: u32,
    pub(crate) height: u32,
    /// Texels that would pass an alpha test that keeps the view's coverage.
    pub(crate) passing: f64,
    /// Channels as they are stored, in the order of [`crate::codec::Channel::ALL`].
    pub(crate) raw: [Vec<u8>; 4],
}

/// All levels of a view, finest first. `capture` is square, its side a power of two.
pub(crate) fn levels(
    capture: &Capture,
    frame: &ViewFrame,
    eye_distance: f64,
    radius: f64,
    samples_a_side: u32,
) -> Vec<TileLevel> {
    let mut pyramid = vec![texels(capture, frame, eye_distance, radius)];
    let mut side = capture.picture.width as usize;
    while side > 1 {
        let finer = &pyramid[pyramid.len() - 1];
        pyramid.push(halved(finer, side));
        side /= 2;
    }
    let coverage = f64::from(pyramid[pyramid.len() - 1][0][ALPHA]);
    // From the coarsest, which hands its colours to the empty texels of the finer ones.
    let mut out = Vec::with_capacity(pyramid.len());
    let mut coarser: Vec<Texel> = Vec::new();
    for (texels, log) in pyramid.into_iter().rev().zip(0u32..) {
        let side = 1usize << log;
        let straight = dilated(&texels, &coarser, side);
        // Samples of a texel at this level.
        let samples = (samples_a_side as usize * capture.picture.width as usize / side).pow(2);
        let passing = coverage * (side * side) as f64;
        out.push(stored(&straight, side, passing, samples as f32));
        coarser = straight;
    }
    out.reverse();
    out
}

fn texels(capture: &Capture, frame: &ViewFrame, eye_distance: f64, radius: f64) -> Vec<Texel> {
    let [right, up, back] = [frame.right, frame.up, frame.back].map(DVec3::as_vec3);
    let picture = &capture.picture;
    (0..picture.pixels.len())
        .map(|i| {
            let [r, g, b, a] = picture.pixels[i];
            if a <= 0.0 {
                return [0.0; 9];
            }
            let n = Vec3::from_array(picture.normal[i]);
            let depth = (f64::from(picture.depth[i]) - eye_distance) / (2.0 * radius) + 0.5;
            let sky = capture.sky.get(i).copied().unwrap_or(a);
            [r, g, b, n.dot(right), n.dot(up), n.dot(back), depth as f32 * a, sky, a]
        })
        .collect()
}

fn halved(finer: &[Texel], side: usize) -> Vec<Texel> {
    let half = side / 2;
    (0..half * half)
        .map(|i| {
            let first = (i / half) * 2 * side + (i % half) * 2;
            let four = [first, first + 1, first + side, first + side + 1].map(|j| &finer[j]);
            std::array::from_fn(|k| 0.25 * (four[0][k] + four[1][k] + four[2][k] + four[3][k]))
        })
        .collect()
}

/// Straight values; empty texels take those of the coarser level's texel around them.
fn dilated(texels: &[Texel], coarser: &[Texel], side: usize) -> Vec<Texel> {
    let straight = |(i, t): (usize, &Texel)| {
        let a = t[ALPHA];
        if a > 0.0 {
            let mut out = t.map(|v| v / a);
            out[ALPHA] = a;
            return out;
        }
        let parent = (i / side / 2) * (side / 2) + i % side / 2;
        let mut out = coarser.get(parent).copied().unwrap_or_default();
        out[ALPHA] = 0.0;
        out
    };
    texels.iter().enumerate().map(straight).collect()
}

/// Cuts out what is seen and brings it to bytes.
fn stored(texels: &[Texel], side: usize, passing: f64, samples: f32) -> TileLevel {
    let seen = |x: usize, y: usize| texels[y * side + x][ALPHA] > 0.0;
    let (mut min, mut max) = ([side; 2], [0; 2]);
    for y in 0..side {
        for x in (0..side).filter(|&x| seen(x, y)) {
            (min, max) = ([min[0].min(x), min[1].min(y)], [max[0].max(x + 1), max[1].max(y + 1)]);
        }
    }
    if min[0] >= max[0] {
        let raw = [const { Vec::new() }; 4];
        return TileLevel { left: 0, top: 0, width: 0, height: 0, passing, raw };
    }
    let (left, top) = (min[0] as i32 - 1, min[1] as i32 - 1);
    let size = |from: i32, to: usize| ((to as i32 + 1 - from) as u32).next_multiple_of(4);
    let (width, height) = (size(left, max[0]), size(top, max[1]));
    let count = (width * height) as usize;
    let mut raw = [4, 2, 2, 1].map(|bytes| Vec::with_capacity(count * bytes));
    for y in 0..height as i32 {
        for x in 0..width as i32 {
            // Outside of the tile: the nearest texel's colour, covering nothing.
            let inside = |v: i32| v.clamp(0, side as i32 - 1);
            let (tx, ty) = (left + x, top + y);
            let t = &texels[inside(ty) as usize * side + inside(tx) as usize];
            let is_inside = (tx, ty) == (inside(tx), inside(ty));
            let alpha =
                if is_inside { dithered(t[ALPHA], samples, tx as u32, ty as u32) } else { 0 };
            raw[0].extend([0, 1, 2].map(|k| linear_to_srgb8(t[COLOR + k])));
            raw[0].push(alpha);
            // The mean of smooth normals may point away a little: not further than sideways.
            let z = t[NORMAL + 2].max(0.0);
            let normal = Vec3::new(t[NORMAL], t[NORMAL + 1], z).normalize_or(Vec3::Z);
            raw[1].extend([normal.x, normal.y].map(|v| quantised(v * 0.5 + 0.5)));
            let depth = (t[DEPTH].clamp(0.0, 1.0) * 65535.0).round() as u16;
            raw[2].extend(depth.to_le_bytes());
            raw[3].push(quantised(t[SKY]));
        }
    }
    TileLevel { left, top, width, height, passing, raw }
}

/// Coverage in 8 bits. Of few samples many texels have the same one, and no threshold could part
/// them: a number from the hash rule, less than half a sample and zero in the mean, does.
fn dithered(alpha: f32, samples: f32, x: u32, y: u32) -> u8 {
    if alpha <= 0.0 || alpha >= 1.0 {
        return quantised(alpha);
    }
    let part = (sample_hash(DITHER, x, y) - 0.5) / samples;
    quantised(alpha + part).max(1)
}

/// Names the dither among the uses of the hash rule.
const DITHER: u32 = 0x6469_7468;

fn quantised(v: f32) -> u8 {
    (v.clamp(0.0, 1.0) * 255.0).round() as u8
}

/// The threshold of 8-bit alpha that `passing` texels come nearest to passing; at least one does,
/// if it is nearer to one than to none.
pub(crate) fn cutoff(alphas: impl Iterator<Item = u8>, passing: f64) -> u8 {
    let mut counts = [0u32; 256];
    alphas.for_each(|a| counts[usize::from(a)] += 1);
    let (mut above, mut best) = (0u32, (f64::INFINITY, 255u8));
    for threshold in (1..=255u8).rev() {
        above += counts[usize::from(threshold)];
        if above == 0 && passing >= 0.5 {
            continue;
        }
        let off = (f64::from(above) - passing).abs();
        if off < best.0 {
            best = (off, threshold);
        }
    }
    best.1
}
