//! Billboards: a tree from eight sides, with normals and depth.

use crate::peers::texture::{Coverage, Level, mips};
use bytemuck::{Pod, Zeroable};
use forest_raster::{Picture, Sampling, Style, Surfaces, rasterize};
use forest_scene::Stance;
use forest_soup::{Camera, Projection, TriangleSoup};
use glam::{DVec3, Vec3};

/// Views around a tree.
const VIEWS: u32 = 8;
/// Texels of a view from top to bottom.
const TALL: u32 = 256;
/// The alpha test's.
const CUTOFF: f32 = 0.5;

/// `Board` of billboard.wgsl.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct BoardUniform {
    half_width: f32,
    bottom: f32,
    height: f32,
    deep: f32,
    views: f32,
    zero: [f32; 3],
}

/// The views of a species.
pub(crate) struct Baked {
    pub(crate) uniform: BoardUniform,
    /// Mips of each view.
    pub(crate) colors: Vec<Vec<Level>>,
    pub(crate) normals: Vec<Vec<Level>>,
}

/// Bakes a species in 16 samples a texel.
pub(crate) fn bake(soup: &TriangleSoup, stance: &Stance) -> Baked {
    let surfaces = Surfaces::new(&soup.materials, &soup.textures);
    let bounds = soup.bounds();
    let axis = stance.anchor;
    let corners = soup.triangles.iter().flatten().map(|&v| soup.positions[v as usize]);
    let away = corners.filter(|p| p.is_finite()).map(|p| {
        let off = soup.origin + p.as_dvec3() - axis;
        off.x.hypot(off.z)
    });
    let reach = away.fold(1e-6, f64::max);
    let [bottom, top] = [bounds.min, bounds.max].map(|v| v.y + soup.origin.y);
    let tall = (top - bottom).max(1e-6);
    // Two texels are left free at every border.
    let margin = f64::from(TALL) / f64::from(TALL - 4);
    let height = tall * margin;
    let width = (2.0 * reach * margin / height * f64::from(TALL)).ceil().clamp(4.0, 2048.0) as u32;
    let middle = DVec3::new(axis.x, 0.5 * (bottom + top), axis.z);
    let distance = 2.0 * reach + tall;
    let style = Style { sampling: Sampling { side: 4, seed: 1 }, ..Style::default() };
    let (mut colors, mut normals) = (Vec::new(), Vec::new());
    for k in 0..VIEWS {
        let (sin, cos) = (f64::from(k) * std::f64::consts::TAU / f64::from(VIEWS)).sin_cos();
        let from = DVec3::new(sin, 0.0, cos);
        let projection = Projection::Orthographic { height };
        let camera = Camera::new(middle + from * distance, -from, projection, [width, TALL]);
        let picture = rasterize(soup, &surfaces, &camera, &style);
        let color = mips(color(&picture), Coverage::Mean(CUTOFF));
        normals.push(shapes(&picture, &camera, distance, reach, color.len()));
        colors.push(color);
    }
    let half_width = 0.5 * height * f64::from(width) / f64::from(TALL);
    let metres = |v: f64| (v * stance.unit) as f32;
    let uniform = BoardUniform {
        half_width: metres(half_width),
        bottom: metres(middle.y - 0.5 * height - axis.y),
        height: metres(height),
        deep: metres(reach),
        views: VIEWS as f32,
        zero: [0.0; 3],
    };
    Baked { uniform, colors, normals }
}

/// Straight colours.
fn color(picture: &Picture) -> Level {
    let texel = |p: &[f32; 4]| match p[3] > 0.0 {
        true => [p[0] / p[3], p[1] / p[3], p[2] / p[3], p[3]],
        false => [0.0; 4],
    };
    Level {
        size: [picture.width, picture.height],
        texels: picture.pixels.iter().map(texel).collect(),
    }
}

/// Normals in the camera's frame and depths towards it, from −1 … 1 to 0 … 1, in so many levels.
fn shapes(
    picture: &Picture,
    camera: &Camera,
    distance: f64,
    reach: f64,
    levels: usize,
) -> Vec<Level> {
    let axes = [camera.right, camera.up, -camera.forward].map(|a| a.as_vec3());
    let texels = picture.pixels.iter().zip(&picture.normal).zip(&picture.depth);
    let covered: Vec<([f32; 4], f32)> = texels
        .map(|((p, n), depth)| {
            let n = Vec3::from_array(*n) / p[3].max(1e-6);
            let [x, y, z] = axes.map(|a| a.dot(n) * 0.5 + 0.5);
            let toward = if p[3] > 0.0 { (distance - f64::from(*depth)) / reach } else { 0.0 };
            ([x, y, z, toward as f32 * 0.5 + 0.5], p[3])
        })
        .collect();
    let size = [picture.width, picture.height];
    // Both are averaged by coverage, as colours are; alpha is what carries it there.
    let level = |pick: &dyn Fn(&[f32; 4]) -> [f32; 3]| {
        let texel = |(v, a): &([f32; 4], f32)| {
            let [x, y, z] = pick(v);
            [x, y, z, *a]
        };
        mips(Level { size, texels: covered.iter().map(texel).collect() }, Coverage::Opaque)
    };
    let normals = level(&|v| [v[0], v[1], v[2]]);
    let depths = level(&|v| [v[3]; 3]);
    let join = |(n, d): (Level, Level)| {
        let texel = |(n, d): (&[f32; 4], &[f32; 4])| [n[0], n[1], n[2], d[0]];
        Level { size: n.size, texels: n.texels.iter().zip(&d.texels).map(texel).collect() }
    };
    normals.into_iter().zip(depths).take(levels).map(join).collect()
}
