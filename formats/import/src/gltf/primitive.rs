//! Primitives become meshes of triangles.

use super::accessor::Reader;
use super::buffers::Buffers;
use super::material::Look;
use crate::ImportError;
use crate::source::Source;
use forest_soup::Mesh;
use glam::{DVec3, Vec2, Vec3};
use gltf::json::accessor::Type;
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{Index, Root, accessor::Accessor};

/// The triangles of a primitive; `None` if it is points or lines.
pub(crate) fn mesh(
    source: &Source,
    root: &Root,
    buffers: &Buffers,
    element: &str,
    primitive: &Primitive,
    look: Option<&Option<Look>>,
) -> Result<Option<Mesh>, ImportError> {
    let others = primitive.extensions.as_ref().map(|e| &e.others);
    let reader = Reader { source, root, buffers };
    let attribute = |s: Semantic| primitive.attributes.get(&Checked::Valid(s)).copied();
    let Some(position) = attribute(Semantic::Positions) else {
        // An empty shell around compressed geometry would be a silently missing tree.
        return Err(source.invalid(element, "no POSITION"));
    };
    let draco = others.is_some_and(|o| o.contains_key("KHR_draco_mesh_compression"));
    if draco && root.get(position).is_some_and(|a| a.buffer_view.is_none()) {
        return Err(source.unsupported(format!("{element}: KHR_draco_mesh_compression")));
    }
    let Checked::Valid(mode) = primitive.mode.as_ref() else {
        return Err(source.invalid(element, "unknown primitive mode"));
    };
    if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
        return Ok(None);
    }
    let mut mesh = Mesh { name: element.into(), ..Mesh::default() };
    let single = |p| DVec3::from_array(p).as_vec3();
    mesh.positions = reader.numbers(element, position, &[Type::Vec3], [0.0; 3], single)?;
    let count = mesh.positions.len();
    let same_length = |name: &str, n: usize| {
        if n == count {
            Ok(())
        } else {
            Err(source.invalid(element, format!("{n} {name} for {count} positions")))
        }
    };
    if let Some(accessor) = attribute(Semantic::Normals) {
        mesh.normals = reader.numbers(element, accessor, &[Type::Vec3], [0.0; 3], unit)?;
        same_length("NORMAL", mesh.normals.len())?;
    }
    if let Some(Some(look)) = look {
        let Some(accessor) = attribute(Semantic::TexCoords(look.uv_set)) else {
            let problem = format!("its material's texture needs TEXCOORD_{}", look.uv_set);
            return Err(source.invalid(element, problem));
        };
        let laid = |uv| look.apply(uv);
        mesh.uvs = reader.numbers(element, accessor, &[Type::Vec2], [0.0; 2], laid)?;
        same_length("TEXCOORD", mesh.uvs.len())?;
    }
    if let Some(accessor) = attribute(Semantic::Colors(0)) {
        let kinds = [Type::Vec3, Type::Vec4];
        let tint = |c: [f64; 4]| c.map(unit_range);
        mesh.colors = reader.numbers(element, accessor, &kinds, [1.0; 4], tint)?;
        same_length("COLOR_0", mesh.colors.len())?;
    }
    mesh.triangles = triangles(&reader, element, primitive.indices, *mode, count)?;
    Ok(Some(mesh))
}

/// Colours are within 0..1; what is no number counts as 1.
fn unit_range(v: f64) -> f32 {
    if v.is_nan() { 1.0 } else { v.clamp(0.0, 1.0) as f32 }
}

fn unit(n: [f64; 3]) -> Vec3 {
    DVec3::from_array(n).normalize_or_zero().as_vec3()
}

impl Look {
    fn apply(&self, [u, v]: [f64; 2]) -> Vec2 {
        let [x, y] = self.transform.map(|r| r[0] * u + r[1] * v + r[2]);
        Vec2::new(x as f32, y as f32)
    }
}

/// Triangle corners from a list, a strip (every second triangle turned) or a fan.
fn triangles(
    reader: &Reader,
    element: &str,
    indices: Option<Index<Accessor>>,
    mode: Mode,
    vertices: usize,
) -> Result<Vec<[u32; 3]>, ImportError> {
    let invalid = |problem: String| reader.source.invalid(element, problem);
    let order: Vec<u32> = match indices {
        Some(accessor) => reader.indices(element, accessor)?,
        None => (0..vertices as u32).collect(),
    };
    if let Some(at) = order.iter().position(|&v| v as usize >= vertices) {
        return Err(invalid(format!("index {at} is {}, of {vertices} vertices", order[at])));
    }
    Ok(match mode {
        Mode::TriangleStrip => {
            let turned = |(i, w): (usize, &[u32])| {
                if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[1], w[0], w[2]] }
            };
            order.windows(3).enumerate().map(turned).collect()
        }
        Mode::TriangleFan => {
            order.get(1..).unwrap_or(&[]).windows(2).map(|w| [w[0], w[1], order[0]]).collect()
        }
        _ if !order.len().is_multiple_of(3) => {
            return Err(invalid(format!("{} indices are not whole triangles", order.len())));
        }
        _ => order.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
    })
}
