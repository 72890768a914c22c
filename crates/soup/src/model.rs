//! What a file holds: meshes, the places they stand in, materials and textures.

use crate::{Material, Placement, Texture, TriangleSoup};
use glam::{DMat3, DVec3, Vec2, Vec3};
use std::sync::Arc;

/// Triangles of one material over shared vertices. Attribute arrays are empty or as long as
/// `positions`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Name in the source file; for messages.
    pub name: String,
    /// Vertex positions, in the mesh's own space.
    pub positions: Vec<Vec3>,
    /// Unit vertex normals, or empty.
    pub normals: Vec<Vec3>,
    /// Texture coordinates of the material's texture, transforms already applied; v points down.
    pub uvs: Vec<Vec2>,
    /// Linear RGBA vertex colours, or empty.
    pub colors: Vec<[f32; 4]>,
    /// Vertex indices, three a triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Index into the materials of the model.
    pub material: u16,
}

/// One mesh standing in one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instance {
    /// Index into the meshes of the model.
    pub mesh: u32,
    /// From the mesh's space to the world.
    pub placement: Placement,
}

/// A block before it is flattened: many instances of one mesh cost one mesh.
#[derive(Clone, Debug, Default)]
pub struct Model {
    /// The meshes.
    pub meshes: Vec<Mesh>,
    /// Where they stand.
    pub instances: Vec<Instance>,
    /// The materials that meshes refer to.
    pub materials: Vec<Material>,
    /// The textures that materials refer to.
    pub textures: Vec<Arc<Texture>>,
}

/// Why a model could not be flattened.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FlattenError {
    /// Flattening would make more triangles than allowed.
    #[error(
        "the model has {triangles} triangles once its {instances} instances are flattened; the limit is {limit} (raise it with --max-triangles)"
    )]
    TooManyTriangles {
        /// Triangles after flattening.
        triangles: u64,
        /// Instances in the model.
        instances: usize,
        /// The limit given.
        limit: u64,
    },
    /// More vertices than a 32-bit index can name, or than three for each triangle allowed.
    #[error("the model has {vertices} vertices once flattened; the limit is {limit}")]
    TooManyVertices {
        /// Vertices after flattening.
        vertices: u64,
        /// The limit.
        limit: u64,
    },
    /// There is nothing to bake.
    #[error("the model has no triangle ({meshes} meshes, {instances} instances)")]
    Empty {
        /// Meshes in the model.
        meshes: usize,
        /// Instances in the model.
        instances: usize,
    },
}

impl Model {
    /// Triangles after flattening.
    pub fn triangle_count(&self) -> u64 {
        self.instances.iter().map(|i| self.meshes[i.mesh as usize].triangles.len() as u64).sum()
    }

    /// One soup of all instances. Its origin is the first instance's translation; positions are
    /// rounded to `f32` only after that translation is taken out. Mirrored placements flip the
    /// winding, so that normals keep pointing the same way.
    ///
    /// # Errors
    /// When there is no triangle, or more than `max_triangles`.
    pub fn flatten(self, max_triangles: u64) -> Result<TriangleSoup, FlattenError> {
        let layout = Layout::of(&self, max_triangles)?;
        let mesh_of = |i: &Instance| &self.meshes[i.mesh as usize];
        let vertices: u64 = self.instances.iter().map(|i| mesh_of(i).positions.len() as u64).sum();
        // Vertices that no triangle uses would be memory for nothing.
        let limit = u64::from(u32::MAX).min(max_triangles.saturating_mul(3).max(1 << 20));
        if vertices > limit {
            return Err(FlattenError::TooManyVertices { vertices, limit });
        }
        let mut soup = layout.empty(vertices as usize, layout.triangles as usize);
        self.instances.iter().for_each(|i| layout.append(&mut soup, mesh_of(i), &i.placement));
        soup.materials = self.materials;
        soup.textures = self.textures;
        Ok(soup)
    }
}

/// What all instances of a model have in common in its soup.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layout {
    /// Where the soup's origin is.
    first: Placement,
    /// Triangles of all instances.
    triangles: u64,
    normals: bool,
    uvs: bool,
    colors: bool,
}

impl Layout {
    pub(crate) fn of(model: &Model, max_triangles: u64) -> Result<Self, FlattenError> {
        let triangles = model.triangle_count();
        let instances = model.instances.len();
        if triangles > max_triangles {
            let limit = max_triangles;
            return Err(FlattenError::TooManyTriangles { triangles, instances, limit });
        }
        let Some(first) = model.instances.first().filter(|_| triangles > 0) else {
            return Err(FlattenError::Empty { meshes: model.meshes.len(), instances });
        };
        let any = |has: fn(&Mesh) -> bool| {
            model.instances.iter().any(|i| has(&model.meshes[i.mesh as usize]))
        };
        Ok(Self {
            first: first.placement,
            triangles,
            normals: any(|m| !m.normals.is_empty()),
            uvs: any(|m| !m.uvs.is_empty()),
            colors: any(|m| !m.colors.is_empty()),
        })
    }

    /// World position of the soup's zero.
    pub(crate) fn origin(&self) -> DVec3 {
        self.first.translation()
    }

    /// A soup with room, without materials.
    pub(crate) fn empty(&self, vertices: usize, triangles: usize) -> TriangleSoup {
        TriangleSoup {
            origin: self.origin(),
            positions: Vec::with_capacity(vertices),
            normals: Vec::with_capacity(if self.normals { vertices } else { 0 }),
            uvs: Vec::with_capacity(if self.uvs { vertices } else { 0 }),
            colors: Vec::with_capacity(if self.colors { vertices } else { 0 }),
            triangles: Vec::with_capacity(triangles),
            triangle_materials: Vec::with_capacity(triangles),
            ..TriangleSoup::default()
        }
    }

    /// Adds a mesh that stands at `placement`.
    pub(crate) fn append(&self, soup: &mut TriangleSoup, mesh: &Mesh, placement: &Placement) {
        let base = soup.positions.len() as u32;
        let offset = placement.translation_from(&self.first);
        push_positions(&mut soup.positions, mesh, placement.linear, offset);
        if self.normals {
            push_normals(&mut soup.normals, mesh, placement.linear);
        }
        if self.uvs {
            push_or_fill(&mut soup.uvs, &mesh.uvs, mesh.positions.len(), Vec2::ZERO);
        }
        if self.colors {
            push_or_fill(&mut soup.colors, &mesh.colors, mesh.positions.len(), [1.0; 4]);
        }
        let flip = placement.is_mirrored();
        soup.triangles.extend(mesh.triangles.iter().map(|&[a, b, c]| {
            let [b, c] = if flip { [c, b] } else { [b, c] };
            [a + base, b + base, c + base]
        }));
        soup.triangle_materials.extend(std::iter::repeat_n(mesh.material, mesh.triangles.len()));
    }
}

fn push_positions(out: &mut Vec<Vec3>, mesh: &Mesh, linear: DMat3, offset: DVec3) {
    if linear == DMat3::IDENTITY && offset == DVec3::ZERO {
        out.extend_from_slice(&mesh.positions);
    } else {
        out.extend(mesh.positions.iter().map(|p| (linear * p.as_dvec3() + offset).as_vec3()));
    }
}

/// Normals go with the inverse transpose; of a singular placement, with the placement itself.
fn push_normals(out: &mut Vec<Vec3>, mesh: &Mesh, linear: DMat3) {
    if mesh.normals.is_empty() {
        out.extend(std::iter::repeat_n(Vec3::ZERO, mesh.positions.len()));
        return;
    }
    let m = if linear.determinant() == 0.0 { linear } else { linear.inverse().transpose() };
    out.extend(mesh.normals.iter().map(|n| (m * n.as_dvec3()).normalize_or_zero().as_vec3()));
}

fn push_or_fill<T: Copy>(out: &mut Vec<T>, from: &[T], len: usize, fill: T) {
    if from.is_empty() {
        out.extend(std::iter::repeat_n(fill, len));
    } else {
        out.extend_from_slice(from);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    fn triangle() -> Mesh {
        Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            normals: vec![Vec3::Z; 3],
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        }
    }

    fn model(placements: &[Placement]) -> Model {
        Model {
            meshes: vec![triangle()],
            instances: placements
                .iter()
                .map(|&placement| Instance { mesh: 0, placement })
                .collect(),
            materials: vec![Material::default()],
            textures: vec![],
        }
    }

    #[test]
    fn mirrored_instances_keep_their_outward_side() {
        let mirror = Placement::from_trs(DVec3::ZERO, DQuat::IDENTITY, DVec3::new(-1.0, 1.0, 1.0));
        let soup = model(&[mirror]).flatten(10).unwrap();
        let [a, b, c] = soup.triangles[0].map(|i| soup.positions[i as usize]);
        let geometric = (b - a).cross(c - a).normalize();
        assert_eq!(geometric, soup.normals[0]);
    }

    #[test]
    fn flattening_says_how_many_triangles_there_are_and_may_be() {
        let e = model(&[Placement::IDENTITY; 5]).flatten(4).unwrap_err().to_string();
        assert!(e.contains("5 triangles") && e.contains("limit is 4"), "{e}");
        let e = model(&[]).flatten(4).unwrap_err().to_string();
        assert!(e.contains("no triangle"), "{e}");
    }

    #[test]
    fn a_far_block_has_the_positions_of_a_near_one() {
        let at = |o: DVec3| {
            let local = |x: f64| {
                Placement::from_translation(o)
                    * Placement::from_trs(
                        DVec3::new(x, 0.37, -x),
                        DQuat::from_rotation_y(x),
                        DVec3::splat(1.3),
                    )
            };
            model(&[local(0.1), local(0.7), local(1.9)]).flatten(10).unwrap()
        };
        let (near, far) = (at(DVec3::ZERO), at(DVec3::new(1e6, -1e6, 1e6)));
        assert_eq!(near.positions, far.positions);
        assert_eq!(far.origin - near.origin, DVec3::new(1e6, -1e6, 1e6));
    }
}
