//! How much of each triangle is seen from all around, measured in pictures of the source.

use forest_raster::{Light, Sampling, Style, Surfaces, rasterize};
use forest_soup::{Camera, Material, Projection, Texture, TriangleSoup};
use glam::DVec3;
use std::f64::consts::PI;
use std::sync::Arc;

/// Directions from which is looked.
const VIEWS: u32 = 24;

/// Pixels across a picture.
const SIDE: u32 = 512;

/// What is seen of a soup from all around.
pub(crate) struct Visible {
    /// Mean area of each triangle that is seen, over directions that fill the sphere evenly, in square
    /// world units of the picture plane.
    pub(crate) areas: Vec<f64>,
    /// Cameras, and depths of what they see first; infinite where there is nothing.
    depths: Vec<(Camera, Vec<f32>)>,
    /// World position of the soup's zero.
    origin: DVec3,
}

impl Visible {
    pub(crate) fn of(soup: &TriangleSoup) -> Self {
        let (painted, surfaces) = painted(soup);
        let bounds = painted.bounds();
        let (middle, reach) = (painted.origin + bounds.center(), bounds.half_diagonal());
        let mut out = Self {
            areas: vec![0.0; soup.triangles.len()],
            depths: Vec::new(),
            origin: soup.origin,
        };
        let pixel = 2.0 * reach / f64::from(SIDE);
        for i in 0..VIEWS {
            // A spiral on the sphere (R. Swinbank, R. J. Purser 2006).
            let y = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(VIEWS);
            let turn = f64::from(i) * PI * (3.0 - 5.0f64.sqrt());
            let flat = (1.0 - y * y).sqrt();
            let from = DVec3::new(flat * turn.cos(), y, flat * turn.sin());
            let projection = Projection::Orthographic { height: 2.0 * reach };
            let camera = Camera::new(middle + from * (2.0 * reach), -from, projection, [SIDE; 2]);
            let style = Style { sampling: Sampling::MIDDLE, light: Light::Albedo };
            let picture = rasterize(&painted, &surfaces, &camera, &style);
            for p in picture.pixels.iter().filter(|p| p[3] > 0.0) {
                let code = [0, 1, 2].map(|k| (p[k] * 255.0).round() as usize);
                if let Some(area) = out.areas.get_mut(code[0] << 16 | code[1] << 8 | code[2]) {
                    *area += pixel * pixel / f64::from(VIEWS);
                }
            }
            out.depths.push((camera, picture.depth));
        }
        out
    }

    /// Share of the sky, cosine-weighted, that a surface of this unit normal sees at `p` (about the soup's
    /// origin); what is less than `bias` before it hides nothing.
    pub(crate) fn skylit(&self, p: DVec3, normal: DVec3, bias: f64) -> f64 {
        let (mut seen, mut all) = (0.0, 0.0);
        for (camera, depths) in &self.depths {
            let cos = -camera.forward.dot(normal);
            if cos > 0.0 {
                all += cos;
                seen += cos * f64::from(u8::from(self.is_seen(camera, depths, p, bias)));
            }
        }
        if all > 0.0 { seen / all } else { 1.0 }
    }

    fn is_seen(&self, camera: &Camera, depths: &[f32], p: DVec3, bias: f64) -> bool {
        let (x, y, depth) = camera.project(self.origin + p);
        let inside = |v: f64| (v.max(0.0) as usize).min(SIDE as usize - 1);
        depth - bias < f64::from(depths[inside(y) * SIDE as usize + inside(x)])
    }

    /// Share of all directions from which places (about the soup's origin) are seen, in the mean; what
    /// is less than `bias` before them hides nothing.
    pub(crate) fn openness(&self, places: &[DVec3], bias: f64) -> f64 {
        let all = self.depths.iter().flat_map(|(c, d)| places.iter().map(move |p| (c, d, *p)));
        let count = (self.depths.len() * places.len()).max(1);
        all.filter(|(c, d, p)| self.is_seen(c, d, *p, bias)).count() as f64 / count as f64
    }
}

/// The soup with each triangle in the colour of its number, with the holes of its textures.
fn painted(soup: &TriangleSoup) -> (TriangleSoup, Surfaces) {
    let white = |t: &Arc<Texture>| {
        let texels = t.texels.iter().map(|[.., a]| [255, 255, 255, *a]).collect();
        Arc::new(Texture { texels, ..(**t).clone() })
    };
    let plain = |m: &Material| Material {
        base_color: [1.0, 1.0, 1.0, m.base_color[3]],
        unlit: true,
        ..m.clone()
    };
    let vertices = || soup.triangles.iter().flatten().map(|&v| v as usize);
    let alpha = |v: usize| soup.colors.get(v).map_or(1.0, |c| c[3]);
    let code = |i: usize, shift: u32| ((i >> shift) & 255) as f32 / 255.0;
    let colors = vertices().enumerate().map(|(k, v)| {
        let i = k / 3;
        [code(i, 16), code(i, 8), code(i, 0), alpha(v)]
    });
    let painted = TriangleSoup {
        origin: soup.origin,
        positions: vertices().map(|v| soup.positions[v]).collect(),
        uvs: if soup.uvs.is_empty() { vec![] } else { vertices().map(|v| soup.uvs[v]).collect() },
        colors: colors.collect(),
        triangles: (0..soup.triangles.len() as u32)
            .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
            .collect(),
        triangle_materials: soup.triangle_materials.clone(),
        materials: soup.materials.iter().map(plain).collect(),
        textures: soup.textures.iter().map(white).collect(),
        ..TriangleSoup::default()
    };
    let surfaces = Surfaces::new(&painted.materials, &painted.textures);
    (painted, surfaces)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn of_two_squares_the_hidden_one_is_seen_less() {
        let square = |z: f32, s: f32| {
            [[-s, -s], [s, -s], [s, s], [-s, s]].map(|[x, y]: [f32; 2]| Vec3::new(x, y, z))
        };
        // A small square between two large ones.
        let soup = TriangleSoup {
            positions: [square(-0.1, 2.0), square(0.0, 0.5), square(0.1, 2.0)].concat(),
            triangles: (0..3)
                .flat_map(|k| [[4 * k, 4 * k + 1, 4 * k + 2], [4 * k, 4 * k + 2, 4 * k + 3]])
                .collect(),
            triangle_materials: vec![0; 6],
            materials: vec![Material::default()],
            ..TriangleSoup::default()
        };
        let visible = Visible::of(&soup);
        let areas = &visible.areas;
        // Each large one shows half of its area in the mean over one side's directions: a quarter over all.
        assert!((areas[0] + areas[1] - 4.0).abs() < 0.5, "{areas:?}");
        assert!(areas[2] + areas[3] < 0.02, "{areas:?}");
        // From its middle little of the sky is seen; from above, all but what they cover.
        let open = |z: f64| visible.openness(&[DVec3::new(0.0, 0.0, z)], 0.02);
        assert!(open(0.0) < 0.15 && (0.9..1.0).contains(&open(5.0)), "{} {}", open(0.0), open(5.0));
    }
}
