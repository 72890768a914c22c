//! Factors of the light on the leaves of a tree, pixel by pixel, and the truth.

use crate::density::Density;
use anyhow::{Context, Result};
use forest_foliage::{CrownLight, CrownShade, FoliageBlock, FoliageOptions, Part, Parts};
use forest_import::{Block, Limits};
use forest_points::record::decode_axis;
use forest_raster::{
    Light, Picture, RayScene, Sampling, ShadowMap, Style, Sun, Surfaces, rasterize, scattered,
};
use forest_soup::{Camera, Material, Texture, TriangleSoup, luminance};
use forest_tests::{bake_foliage, open};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

/// Names of the factors; [`Samples::rows`] has them in this order.
pub(crate) const FACTORS: [&str; 6] =
    ["vertex", "density", "shadow", "occlusion", "through", "hotspot"];

/// A pixel under a sun: factors, then the truth.
pub(crate) type Row = [f64; FACTORS.len() + 1];

/// The pixels of a tree.
pub(crate) struct Samples {
    /// By sun.
    pub(crate) rows: Vec<Vec<Row>>,
    /// Weight of the sun that the bake fitted to the finest level.
    pub(crate) sunlit: f32,
}

/// Pixels that a tree is high.
const SIDE: u32 = 128;

/// Pixels of a shadow map.
const MAP: u32 = 256;

/// Leaves cover at least this share of a pixel that counts.
const COVERED: f32 = 0.9;

/// Pixels along the side of a block: what is compared are means over blocks, of which so many pixels
/// count. Single pixels show how a leaf or two happen to face.
const BLOCK: usize = 8;
const FILLED: f64 = 16.0;

/// What is less far behind an occluder is not occluded, in half diagonals of the tree's box.
const BIAS: f64 = 0.02;

/// How fast light fades behind an occluder, in half diagonals.
const FADE: f64 = 0.2;

/// Suns at two elevations, all around.
fn suns() -> Vec<DVec3> {
    let at = |i: u32| {
        let (yaw, pitch) =
            (f64::from(i) * 22.5f64.to_radians(), if i % 4 < 2 { 30.0f64 } else { 60.0 });
        let pitch = pitch.to_radians();
        DVec3::new(yaw.sin() * pitch.cos(), pitch.sin(), yaw.cos() * pitch.cos())
    };
    (0..16).map(at).collect()
}

impl Samples {
    pub(crate) fn of(path: &Path) -> Result<Self> {
        let block = Block::parse(&[path.display().to_string()])?;
        let soup = block.load(&Limits::default())?.model.flatten(1 << 24)?;
        let pack = open(&bake_foliage(&soup, &FoliageOptions::default())?.0)?;
        let foliage = FoliageBlock::open(&pack)?;
        let tree = Tree::new(&soup, &foliage)?;
        let crown = CrownLight::read(&pack)?.context("the light on its crown")?;
        let rows = suns().into_iter().map(|sun| tree.rows(sun, &crown.shade(sun))).collect();
        Ok(Self { rows, sunlit: foliage.header.levels[0].sunlit })
    }
}

/// A tree, its foliage, and what does not change with the sun.
struct Tree<'a> {
    soup: &'a TriangleSoup,
    surfaces: Surfaces,
    foliage: TriangleSoup,
    white: Surfaces,
    bounds: [DVec3; 2],
    /// Cameras with the truth's base colour, the share of leaves, and foliage's radial normals and
    /// openness.
    views: Vec<View>,
}

struct View {
    camera: Camera,
    albedo: Picture,
    leaves: Picture,
    /// Normals · ½ + ½, premultiplied.
    normals: Picture,
    openness: Picture,
    /// With one sample a pixel, [`FINE`] times as many along a side.
    fine: Camera,
    fine_depth: Vec<f32>,
}

/// Places along the side of a pixel that are looked up in the shadow map.
const FINE: u32 = 4;

impl View {
    /// The shadow test, the occlusion factor and what comes through the crown to a pixel: means over places
    /// in it.
    fn shadow(
        &self,
        shadows: &ShadowMap,
        map: &Picture,
        from_sun: &Camera,
        shade: &CrownShade,
        i: usize,
        reach: f64,
    ) -> [f64; 3] {
        let (x, y) = (i as u32 % SIDE * FINE, i as u32 / SIDE * FINE);
        let mut sum = [0.0; 4];
        for (dx, dy) in (0..FINE * FINE).map(|k| (k % FINE, k / FINE)) {
            let at = (y + dy) * SIDE * FINE + x + dx;
            let depth = f64::from(self.fine_depth[at as usize]);
            if depth.is_finite() {
                let place = place_of(&self.fine, at, depth);
                let behind = behind(map, from_sun, place) / reach;
                sum[0] += f64::from(shadows.seen(place));
                sum[1] += (-(behind - BIAS).max(0.0) / FADE).exp();
                sum[2] += f64::from(shade.at(place)[0]);
                sum[3] += 1.0;
            }
        }
        [sum[0], sum[1], sum[2]].map(|s| s / f64::max(sum[3], 1.0))
    }
}

fn style(light: Light) -> Style {
    Style { sampling: Sampling { side: 4, seed: 1 }, light }
}

impl<'a> Tree<'a> {
    fn new(soup: &'a TriangleSoup, block: &FoliageBlock) -> Result<Self> {
        let surfaces = Surfaces::new(&soup.materials, &soup.textures);
        let (materials, textures) = block.materials()?;
        let textures: Vec<Arc<Texture>> = textures.iter().map(white_texture).collect();
        let materials: Vec<Material> = materials.iter().map(white_material).collect();
        let white = Surfaces::new(&materials, &textures);
        let foliage = block.soup(0, None, &materials, &textures);
        let records = block.vertices[0];
        let bounds = block.bounds();
        let parts = Parts::of(soup, &Default::default())?;
        let leaf = painted(soup, |i| f32::from(parts.of[i] == Some(Part::Leaf)));
        let leaf_surfaces = Surfaces::new(&leaf.materials, &leaf.textures);
        let with = |color: &dyn Fn(usize) -> [f32; 4]| TriangleSoup {
            colors: (0..records.len()).map(color).collect(),
            ..foliage.clone()
        };
        let normals = with(&|v| {
            let n = decode_axis(records[v].normal).as_vec3() * 0.5 + 0.5;
            [n.x, n.y, n.z, 1.0]
        });
        let density = Density::new(soup, &parts.of);
        let open: Vec<f32> = records
            .par_iter()
            .map(|v| density.openness(block.origin() + Vec3::from(v.position).as_dvec3()) as f32)
            .collect();
        let openness = with(&|v| [open[v], open[v], open[v], 1.0]);
        let views = [[20.0, 5.0], [140.0, 20.0], [250.0, 50.0]].map(|angles| {
            let camera = Camera::around(bounds, angles, None, [SIDE; 2]);
            let flat = style(Light::Albedo);
            let fine = Camera { width: FINE * SIDE, height: FINE * SIDE, ..camera };
            let single = Style { sampling: Sampling::MIDDLE, light: Light::Albedo };
            View {
                camera,
                fine,
                fine_depth: rasterize(&foliage, &white, &fine, &single).depth,
                albedo: rasterize(soup, &surfaces, &camera, &flat),
                leaves: rasterize(&leaf, &leaf_surfaces, &camera, &flat),
                normals: rasterize(&normals, &white, &camera, &flat),
                openness: rasterize(&openness, &white, &camera, &flat),
            }
        });
        Ok(Self { soup, surfaces, foliage, white, bounds, views: views.into() })
    }

    /// All leafy pixels of all views under a sun.
    fn rows(&self, to_sun: DVec3, shade: &CrownShade) -> Vec<Row> {
        let sun = Sun { to_sun, sun: [1.0; 3], sky: [0.0; 3], translucency: 1.0, darkest: 1.0 };
        let truth = RayScene::new(self.soup, &self.surfaces);
        let [min, max] = self.bounds;
        let reach = 0.5 * min.distance(max);
        let middle = 0.5 * (min + max);
        let projection = forest_soup::Projection::Orthographic { height: 2.0 * reach };
        let from_sun = Camera::new(middle + to_sun * (2.0 * reach), -to_sun, projection, [MAP; 2]);
        let middle_style = Style { sampling: Sampling::MIDDLE, light: Light::Albedo };
        let map = rasterize(&self.foliage, &self.white, &from_sun, &middle_style);
        let shadows = ShadowMap::new(&self.foliage, &self.white, self.bounds, to_sun);
        let mut rows = Vec::new();
        for v in &self.views {
            let lit = truth.picture(&v.camera, &style(Light::Sun(sun)));
            let toward = v.camera.to_eye(middle);
            let hotspot = scattered(toward.dot(to_sun), 1.0);
            let mut blocks: HashMap<usize, (Row, f64)> = HashMap::new();
            for i in 0..(SIDE * SIDE) as usize {
                let covers = v.normals.pixels[i][3];
                let base = luminance(rgb(&v.albedo, i));
                if v.leaves.pixels[i][0] < COVERED || covers < COVERED || base <= 0.0 {
                    continue;
                }
                let normal = DVec3::from_array(
                    rgb(&v.normals, i).map(|c| f64::from(c / covers) * 2.0 - 1.0),
                );
                let [shadow, occlusion, through] =
                    v.shadow(&shadows, &map, &from_sun, shade, i, reach);
                let row: Row = [
                    normal.normalize_or_zero().dot(to_sun),
                    f64::from(v.openness.pixels[i][0] / v.openness.pixels[i][3]),
                    shadow,
                    occlusion,
                    through,
                    hotspot,
                    f64::from(luminance(rgb(&lit, i)) / base),
                ];
                let (x, y) = (i % SIDE as usize, i / SIDE as usize);
                let block = blocks.entry(y / BLOCK * SIDE as usize + x / BLOCK).or_default();
                block.1 += 1.0;
                block.0.iter_mut().zip(row).for_each(|(sum, v)| *sum += v);
            }
            let mut blocks: Vec<(usize, (Row, f64))> = blocks.into_iter().collect();
            blocks.sort_by_key(|b| b.0);
            rows.extend(
                blocks.iter().filter(|b| b.1.1 >= FILLED).map(|(_, (sum, n))| sum.map(|v| v / n)),
            );
        }
        rows
    }
}

fn rgb(p: &Picture, i: usize) -> [f32; 3] {
    [0, 1, 2].map(|k| p.pixels[i][k])
}

fn place_of(camera: &Camera, i: u32, depth: f64) -> DVec3 {
    let unit = 1.0 / camera.pixels_per_unit(1.0);
    let half = 0.5 * f64::from(camera.width);
    let x = (f64::from(i % camera.width) + 0.5 - half) * unit;
    let y = (half - f64::from(i / camera.width) - 0.5) * unit;
    camera.eye + camera.right * x + camera.up * y + camera.forward * depth
}

/// How far a place lies behind what the sun sees there.
fn behind(map: &Picture, from_sun: &Camera, place: DVec3) -> f64 {
    let (x, y, depth) = from_sun.project(place);
    let (x, y) =
        (x.clamp(0.0, f64::from(MAP - 1)) as usize, y.clamp(0.0, f64::from(MAP - 1)) as usize);
    let surface = f64::from(map.depth[y * MAP as usize + x]);
    if surface.is_finite() { (depth - surface).max(0.0) } else { 0.0 }
}

fn white_texture(t: &Arc<Texture>) -> Arc<Texture> {
    let texels = t.texels.iter().map(|[.., a]| [255, 255, 255, *a]).collect();
    Arc::new(Texture { texels, ..(**t).clone() })
}

fn white_material(m: &Material) -> Material {
    Material { base_color: [1.0, 1.0, 1.0, m.base_color[3]], unlit: true, ..m.clone() }
}

/// The soup in greys, one a triangle.
fn painted(soup: &TriangleSoup, grey: impl Fn(usize) -> f32) -> TriangleSoup {
    let vertices = || soup.triangles.iter().flatten().map(|&v| v as usize);
    let alpha = |v: usize| soup.colors.get(v).map_or(1.0, |c| c[3]);
    let color = |(k, v): (usize, usize)| {
        let g = grey(k / 3);
        [g, g, g, alpha(v)]
    };
    TriangleSoup {
        origin: soup.origin,
        positions: vertices().map(|v| soup.positions[v]).collect(),
        uvs: if soup.uvs.is_empty() { vec![] } else { vertices().map(|v| soup.uvs[v]).collect() },
        colors: vertices().enumerate().map(color).collect(),
        triangles: (0..soup.triangles.len() as u32)
            .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
            .collect(),
        triangle_materials: soup.triangle_materials.clone(),
        materials: soup.materials.iter().map(white_material).collect(),
        textures: soup.textures.iter().map(white_texture).collect(),
        ..TriangleSoup::default()
    }
}
