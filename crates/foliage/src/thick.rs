//! Thick branches of a level: tubes, or the source simplified, whichever is nearer to the source at
//! equal triangles.

use crate::branch::OnBranch;
use crate::header::WoodWay;
use crate::mesh::{Mesh, Vertex};
use crate::tube::{TOLERANCE, tube};
use crate::wood::Wood;
use forest_raster::{Light, Picture, Sampling, Style, Surfaces, rasterize};
use forest_soup::{Camera, TriangleSoup};
use glam::{DVec2, DVec3, Vec3};
use hashbrown::HashMap;
use rstar::RTree;

/// How near a mesh is to the source.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WoodErrors {
    /// Triangles.
    pub triangles: usize,
    /// Root mean square distance between the surfaces, both ways, in world units.
    pub distance: f64,
    /// Root mean square difference of premultiplied colour and coverage in pictures whose pixels are
    /// as large as the level's texels, over the pixels that either covers.
    pub image: f64,
}

/// The thick branches `which` at texels of this size, the way they were made, and the errors of tubes
/// and of the simplified source.
pub(crate) fn thick(
    soup: &TriangleSoup,
    surfaces: &Surfaces,
    wood: &Wood,
    which: &[u32],
    texel: f64,
) -> (Mesh, WoodWay, [WoodErrors; 2]) {
    let mut tubes = Mesh::default();
    for &b in which {
        let (branch, source) = (&wood.branches.branches[b as usize], &wood.triangles[b as usize]);
        tube(&mut tubes, branch, b, soup, source, texel);
    }
    let source = whole(soup, wood, which);
    if source.triangles.is_empty() {
        return (tubes, WoodWay::Tubes, [WoodErrors::default(); 2]);
    }
    // As few as the tolerance of tubes lets it be, and not more than they are.
    let most = tubes.triangles.len();
    let tolerance = (TOLERANCE * texel) as f32;
    let within = simplified(&source, 0, tolerance);
    let simplified =
        if within.triangles.len() <= most { within } else { simplified(&source, most, f32::MAX) };
    let truth = Truth::new(soup, &source, texel);
    let errors = [&tubes, &simplified].map(|mesh| truth.errors(soup, surfaces, mesh));
    if errors[1].image < errors[0].image {
        return (simplified, WoodWay::Simplified, errors);
    }
    (tubes, WoodWay::Tubes, errors)
}

/// The source's triangles of these branches.
fn whole(soup: &TriangleSoup, wood: &Wood, which: &[u32]) -> Mesh {
    let mut numbers: HashMap<u32, u32> = HashMap::new();
    let mut out = Mesh::default();
    for &b in which {
        for &i in &wood.triangles[b as usize] {
            let corners = wood.corners(i);
            let own = soup.triangles[i as usize];
            let t = [0, 1, 2].map(|k| {
                *numbers.entry(own[k]).or_insert_with(|| {
                    out.vertices.push(vertex(soup, own[k] as usize, corners[k]));
                    out.vertices.len() as u32 - 1
                })
            });
            out.triangles.push((t, soup.triangle_materials[i as usize]));
        }
    }
    smooth(&mut out);
    out
}

fn vertex(soup: &TriangleSoup, v: usize, on: OnBranch) -> Vertex {
    Vertex {
        position: soup.positions[v].as_dvec3(),
        normal: soup.normals.get(v).copied().unwrap_or(Vec3::ZERO).as_dvec3(),
        uv: soup.uvs.get(v).map_or(DVec2::ZERO, |uv| uv.as_dvec2()),
        color: soup.colors.get(v).copied().unwrap_or([1.0; 4]),
        on,
        skylit: 1.0,
    }
}

/// Gives vertices without a normal the mean of their triangles'.
fn smooth(mesh: &mut Mesh) {
    let mut sums = vec![DVec3::ZERO; mesh.vertices.len()];
    for (t, _) in &mesh.triangles {
        let [a, b, c] = t.map(|v| mesh.vertices[v as usize].position);
        t.iter().for_each(|&v| sums[v as usize] += (b - a).cross(c - a));
    }
    for (v, sum) in mesh.vertices.iter_mut().zip(sums) {
        if v.normal == DVec3::ZERO {
            v.normal = sum.normalize_or(DVec3::Y);
        }
    }
}

/// As few triangles of `source` as `tolerance` (world units) lets there be, but not fewer than
/// `target`: by meshoptimizer, material by material. A picture that slips by a length counts as a surface that
/// moves by it: else straight trunks, whose shape needs few triangles, show stretched bark.
fn simplified(source: &Mesh, target: usize, tolerance: f32) -> Mesh {
    let positions: Vec<Vec3> = source.vertices.iter().map(|v| v.position.as_vec3()).collect();
    let bytes: &[u8] = bytemuck::cast_slice(&positions);
    let vertices = meshopt::VertexDataAdapter::new(bytes, 12, 0).expect("12 bytes a position");
    let uvs: Vec<[f32; 2]> = source.vertices.iter().map(|v| v.uv.as_vec2().to_array()).collect();
    let locks = vec![false; source.vertices.len()];
    let share = target as f64 / source.triangles.len() as f64;
    let mut materials: Vec<u16> = source.triangles.iter().map(|t| t.1).collect();
    materials.sort_unstable();
    materials.dedup();
    let mut out = Mesh::default();
    let mut numbers: HashMap<u32, u32> = HashMap::new();
    for material in materials {
        let own = source.triangles.iter().filter(|t| t.1 == material);
        let indices: Vec<u32> = own.flat_map(|t| t.0).collect();
        let weights = uv_weights(source, &indices);
        let most = (indices.len() as f64 / 3.0 * share).floor() as usize * 3;
        let options = meshopt::SimplifyOptions::Prune | meshopt::SimplifyOptions::ErrorAbsolute;
        let kept = meshopt::simplify_with_attributes_and_locks(
            &indices,
            &vertices,
            uvs.as_flattened(),
            &weights,
            size_of::<[f32; 2]>(),
            &locks,
            most,
            tolerance,
            options,
            None,
        );
        for t in kept.as_chunks::<3>().0 {
            let t = t.map(|v| {
                *numbers.entry(v).or_insert_with(|| {
                    out.vertices.push(source.vertices[v as usize]);
                    out.vertices.len() as u32 - 1
                })
            });
            out.triangles.push((t, material));
        }
    }
    out
}

/// What the library is to multiply u and v by. Its error is that of a weighted step times the length of the edges
/// over which it is made; that a picture slips by a length is to be an error of that length: what a step of u or
/// v is in space, over the size of triangles (both means over the area of triangles, corners in threes).
fn uv_weights(source: &Mesh, indices: &[u32]) -> [f32; 2] {
    let (mut steps, mut sizes) = (DVec2::ZERO, 0.0);
    for t in indices.as_chunks::<3>().0 {
        let [a, b, c] = t.map(|v| &source.vertices[v as usize]);
        let [p, q] = [b, c].map(|v| v.position - a.position);
        let [s, t] = [b, c].map(|v| v.uv - a.uv);
        let (area, of_picture) = (p.cross(q).length(), s.perp_dot(t));
        if area > 0.0 && of_picture != 0.0 {
            let [u, v] = [p * t.y - q * s.y, q * s.x - p * t.x].map(|d| d / of_picture);
            steps += DVec2::new(u.length(), v.length()) * area;
            sizes += area.sqrt() * area;
        }
    }
    (steps / sizes).to_array().map(|w| if w.is_finite() { w as f32 } else { 0.0 })
}

/// What meshes are compared with.
struct Truth {
    cameras: Vec<Camera>,
    pictures: Vec<Picture>,
    points: Vec<DVec3>,
    near: RTree<[f64; 3]>,
}

/// Points on a surface by which distances are measured.
const POINTS: usize = 20_000;

/// Pixels of a picture's longer side at most.
const MOST_PIXELS: f64 = 512.0;

impl Truth {
    fn new(soup: &TriangleSoup, source: &Mesh, texel: f64) -> Self {
        let whole = source.soup(&soup.materials, &soup.textures);
        let surfaces = Surfaces::new(&whole.materials, &whole.textures);
        let bounds = whole.bounds();
        let reach = 2.0 * bounds.half_diagonal();
        let side = (reach / texel).ceil().clamp(8.0, MOST_PIXELS) as u32;
        let angles = [[0.0, 0.0], [90.0, 10.0], [200.0, 40.0], [310.0, -20.0]];
        let cameras: Vec<Camera> =
            angles.map(|a| Camera::around([bounds.min, bounds.max], a, None, [side; 2])).into();
        let style = style();
        let pictures = cameras.iter().map(|c| rasterize(&whole, &surfaces, c, &style)).collect();
        let points = points(source);
        let near = tree(&points);
        Self { cameras, pictures, points, near }
    }

    fn errors(&self, soup: &TriangleSoup, surfaces: &Surfaces, mesh: &Mesh) -> WoodErrors {
        if mesh.triangles.is_empty() {
            return WoodErrors { triangles: 0, distance: f64::INFINITY, image: f64::INFINITY };
        }
        let own = points(mesh);
        let off = |from: &[DVec3], to: &RTree<[f64; 3]>| -> f64 {
            let square = |p: &DVec3| {
                to.nearest_neighbor(p.to_array()).map_or(0.0, |q| p.distance_squared((*q).into()))
            };
            from.iter().map(square).sum::<f64>() / from.len().max(1) as f64
        };
        let distance = (0.5 * (off(&own, &self.near) + off(&self.points, &tree(&own)))).sqrt();
        let drawn = mesh.soup(&soup.materials, &soup.textures);
        let (mut sum, mut count) = (0.0, 0.0);
        for (camera, truth) in self.cameras.iter().zip(&self.pictures) {
            let picture = rasterize(&drawn, surfaces, camera, &style());
            let pairs = picture.pixels.iter().zip(&truth.pixels);
            for (a, b) in pairs.filter(|(a, b)| a[3] > 0.0 || b[3] > 0.0) {
                sum += (0..4).map(|k| f64::from(a[k] - b[k]).powi(2)).sum::<f64>() / 4.0;
                count += 1.0;
            }
        }
        let image = (sum / f64::max(count, 1.0)).sqrt();
        WoodErrors { triangles: mesh.triangles.len(), distance, image }
    }
}

fn style() -> Style {
    Style { sampling: Sampling { side: 4, seed: 1 }, light: Light::Albedo }
}

fn tree(points: &[DVec3]) -> RTree<[f64; 3]> {
    RTree::bulk_load(points.iter().map(|p| p.to_array()).collect())
}

/// Points spread evenly over a surface: as many on each triangle as its area asks for.
fn points(mesh: &Mesh) -> Vec<DVec3> {
    let corners = |t: [u32; 3]| t.map(|v| mesh.vertices[v as usize].position);
    let area = |[a, b, c]: [DVec3; 3]| 0.5 * (b - a).cross(c - a).length();
    let total: f64 = mesh.triangles.iter().map(|t| area(corners(t.0))).sum();
    let (mut out, mut owed) = (Vec::new(), 0.0);
    for (t, _) in &mesh.triangles {
        let [a, b, c] = corners(*t);
        owed += area([a, b, c]) / total.max(f64::MIN_POSITIVE) * POINTS as f64;
        while owed >= 1.0 {
            owed -= 1.0;
            // The plastic number's sequence (M. Roberts 2018) fills squares evenly.
            let n = out.len() as f64;
            let (u, v) = ((n * 0.754_877_666_246_693).fract(), (n * 0.569_840_290_998_053).fract());
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            out.push(a + (b - a) * u + (c - a) * v);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A straight trunk of `rings` rings whose picture lies between two of them, upright and turned over in turns.
    fn trunk(rings: u32) -> Mesh {
        let sides = 16;
        let mut mesh = Mesh::default();
        for ring in 0..=rings {
            for side in 0..=sides {
                let turn = std::f64::consts::TAU * f64::from(side % sides) / f64::from(sides);
                let out = DVec3::new(turn.cos(), 0.0, turn.sin());
                mesh.vertices.push(Vertex {
                    position: out + DVec3::Y * f64::from(ring),
                    normal: out,
                    uv: DVec2::new(f64::from(side) / f64::from(sides), f64::from(ring % 2)),
                    color: [1.0; 4],
                    on: OnBranch { branch: 0, at: f64::from(ring) },
                    skylit: 1.0,
                });
            }
        }
        for ring in 0..rings {
            for side in 0..sides {
                let a = ring * (sides + 1) + side;
                let [b, c, d] = [a + 1, a + sides + 1, a + sides + 2];
                mesh.triangles.extend([([a, c, d], 0), ([a, d, b], 0)]);
            }
        }
        mesh
    }

    #[test]
    fn simplified_trunks_do_not_stretch_their_bark() {
        let whole = trunk(20);
        let corners: Vec<u32> = whole.triangles.iter().flat_map(|t| t.0).collect();
        let [u, v] = uv_weights(&whole, &corners);
        let around = 32.0 * (std::f32::consts::PI / 16.0).sin();
        assert!((u / v / around - 1.0).abs() < 1e-5, "a picture is as wide as the trunk is around");
        let less = simplified(&whole, 0, 0.2);
        assert!(less.triangles.len() < whole.triangles.len() * 7 / 10, "{}", less.triangles.len());
        for (t, _) in &less.triangles {
            let [a, b, c] = t.map(|v| &less.vertices[v as usize]);
            let rise = |p: &Vertex, q: &Vertex| {
                ((p.position.y - q.position.y).abs(), (p.uv.y - q.uv.y).abs())
            };
            for (high, picture) in [rise(a, b), rise(b, c), rise(c, a)] {
                assert!(high < 1.5 && (high - picture).abs() < 0.5, "{picture} pictures on {high}");
            }
        }
    }
}
