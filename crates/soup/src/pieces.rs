//! A model's soup in pieces, for what does not fit in memory as a whole.

use crate::model::Layout;
use crate::{FlattenError, Mesh, Model, TriangleSoup};
use glam::DVec3;
use std::ops::Range;

/// Triangles of a piece at most.
const PIECE: usize = 1 << 15;

/// The triangles of [`Model::flatten`] in the same order and with the same numbers, some at a time.
#[derive(Debug)]
pub struct Pieces<'a> {
    model: &'a Model,
    layout: Layout,
    /// Instances, and the triangles of their meshes.
    list: Vec<(usize, Range<usize>)>,
}

impl Model {
    /// Cuts the model into pieces.
    ///
    /// # Errors
    /// As [`Model::flatten`].
    pub fn pieces(&self, max_triangles: u64) -> Result<Pieces<'_>, FlattenError> {
        let layout = Layout::of(self, max_triangles)?;
        let list = self.instances.iter().enumerate().flat_map(|(instance, i)| {
            let count = self.meshes[i.mesh as usize].triangles.len();
            (0..count).step_by(PIECE).map(move |at| (instance, at..(at + PIECE).min(count)))
        });
        Ok(Pieces { model: self, layout, list: list.collect() })
    }
}

impl Pieces<'_> {
    /// The model.
    pub fn model(&self) -> &Model {
        self.model
    }

    /// Pieces.
    pub fn len(&self) -> usize {
        self.list.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// World position of the zero of all pieces.
    pub fn origin(&self) -> DVec3 {
        self.layout.origin()
    }

    /// Piece `k`, `k <` [`Pieces::len`]: its vertices are not shared, and it has no materials.
    pub fn soup(&self, k: usize) -> TriangleSoup {
        let (instance, triangles) = self.list[k].clone();
        let instance = &self.model.instances[instance];
        let mesh = unshared(&self.model.meshes[instance.mesh as usize], triangles);
        let mut soup = self.layout.empty(mesh.positions.len(), mesh.triangles.len());
        self.layout.append(&mut soup, &mesh, &instance.placement);
        soup
    }
}

/// Some triangles of a mesh, with corners of their own.
fn unshared(mesh: &Mesh, range: Range<usize>) -> Mesh {
    fn corners<T: Copy>(of: &[T], triangles: &[[u32; 3]]) -> Vec<T> {
        match of.is_empty() {
            true => Vec::new(),
            false => triangles.as_flattened().iter().map(|&v| of[v as usize]).collect(),
        }
    }
    let triangles = &mesh.triangles[range];
    Mesh {
        positions: corners(&mesh.positions, triangles),
        normals: corners(&mesh.normals, triangles),
        uvs: corners(&mesh.uvs, triangles),
        colors: corners(&mesh.colors, triangles),
        triangles: (0..triangles.len() as u32).map(|t| [0, 1, 2].map(|k| 3 * t + k)).collect(),
        material: mesh.material,
        name: String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Instance, Material, Placement};
    use glam::{DQuat, Vec2, Vec3};

    #[test]
    fn pieces_are_the_soup() {
        let count = PIECE + 5;
        let fan = Mesh {
            positions: (0..count + 2)
                .map(|i| Vec3::new(i as f32, (i * i % 7) as f32, 1.0))
                .collect(),
            normals: vec![Vec3::Z; count + 2],
            triangles: (0..count as u32).map(|i| [0, i + 1, i + 2]).collect(),
            ..Mesh::default()
        };
        let laid = Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            uvs: vec![Vec2::ZERO, Vec2::X, Vec2::Y],
            colors: vec![[0.5; 4]; 3],
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        };
        let place = |x: f64| {
            let turn = DQuat::from_rotation_y(x);
            Placement::from_trs(DVec3::new(1e6 + x, x, 0.0), turn, DVec3::new(-1.0, 1.0, x))
        };
        let instances = [(0, 1.3), (1, 0.7), (0, 2.1)];
        let model = Model {
            meshes: vec![fan, laid],
            instances: instances.map(|(mesh, x)| Instance { mesh, placement: place(x) }).to_vec(),
            materials: vec![Material::default()],
            textures: vec![],
        };
        let pieces = model.pieces(1 << 20).unwrap();
        assert_eq!((pieces.len(), pieces.origin()), (5, place(1.3).translation()));
        let soups: Vec<TriangleSoup> = (0..pieces.len()).map(|k| pieces.soup(k)).collect();
        let whole = model.clone().flatten(1 << 20).unwrap();
        let mut at = 0;
        for soup in &soups {
            for t in 0..soup.triangles.len() {
                assert_eq!(soup.corners(t), whole.corners(at));
                let [a, b] =
                    [soup.triangles[t], whole.triangles[at]].map(|t| t.map(|v| v as usize));
                assert_eq!(a.map(|v| soup.normals[v]), b.map(|v| whole.normals[v]));
                assert_eq!(a.map(|v| soup.uvs[v]), b.map(|v| whole.uvs[v]));
                assert_eq!(a.map(|v| soup.colors[v]), b.map(|v| whole.colors[v]));
                at += 1;
            }
        }
        assert_eq!(at, whole.triangles.len());
        assert!(model.pieces(10).is_err());
    }
}
