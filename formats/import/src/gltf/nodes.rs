//! The node tree: where meshes stand, in `f64`.

use super::accessor::Reader;
use super::buffers::Buffers;
use super::missing;
use crate::ImportError;
use crate::source::Source;
use forest_soup::{Instance, Placement};
use glam::{DMat4, DQuat, DVec3};
use gltf::json::accessor::{Accessor, Type};
use gltf::json::{Index, Root};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::ops::Range;

/// Deepest chain of nodes, and most placed meshes, that a file may have.
const MAX_DEPTH: usize = 1024;
const MAX_INSTANCES: usize = 1 << 26;

/// The transforms as the JSON writes them: the crate's own are rounded to `f32`.
#[derive(Deserialize)]
struct Document {
    #[serde(default)]
    nodes: Vec<NodeTransform>,
}

#[derive(Deserialize)]
struct NodeTransform {
    matrix: Option<[f64; 16]>,
    translation: Option<[f64; 3]>,
    rotation: Option<[f64; 4]>,
    scale: Option<[f64; 3]>,
}

impl NodeTransform {
    fn placement(&self) -> Placement {
        if let Some(m) = self.matrix {
            return Placement::from_mat4(DMat4::from_cols_array(&m));
        }
        let rotation = self.rotation.map_or(DQuat::IDENTITY, DQuat::from_array);
        Placement::from_trs(
            self.translation.map_or(DVec3::ZERO, DVec3::from_array),
            if rotation.length_squared() > 0.0 { rotation.normalize() } else { DQuat::IDENTITY },
            self.scale.map_or(DVec3::ONE, DVec3::from_array),
        )
    }
}

/// All placed meshes of the default scene (of the first if there is no default, of all root nodes
/// if there is no scene). `of_mesh` tells the model's meshes of each glTF mesh.
pub(crate) fn instances(
    source: &mut Source,
    json: &[u8],
    root: &Root,
    buffers: &Buffers,
    of_mesh: &[Range<u32>],
) -> Result<Vec<Instance>, ImportError> {
    let document: Document =
        serde_json::from_slice(json).map_err(|e| source.invalid("nodes", e))?;
    let mut skinned = 0;
    let mut walk = Walk {
        source,
        root,
        buffers,
        of_mesh,
        document,
        out: Vec::new(),
        skinned: &mut skinned,
        visited: vec![false; root.nodes.len()],
    };
    for node in walk.roots()? {
        walk.visit(node, Placement::IDENTITY, 0)?;
    }
    let out = walk.out;
    if skinned > 0 {
        source.warn(format!("{skinned} skinned meshes are taken in their bind pose"));
    }
    Ok(out)
}

struct Walk<'a> {
    source: &'a Source<'a>,
    root: &'a Root,
    buffers: &'a Buffers,
    of_mesh: &'a [Range<u32>],
    document: Document,
    out: Vec<Instance>,
    skinned: &'a mut u32,
    /// A glTF node has one parent: meeting one again is a fault, and would be a cycle or a tree of
    /// exponential size.
    visited: Vec<bool>,
}

impl Walk<'_> {
    fn roots(&self) -> Result<Vec<usize>, ImportError> {
        let root = self.root;
        let scene = root.scene.map_or(0, |s| s.value());
        match root.scenes.get(scene) {
            Some(scene) => Ok(scene.nodes.iter().map(|n| n.value()).collect()),
            None if root.scene.is_some() => {
                Err(missing(self.source, "file", "scene", scene, root.scenes.len()))
            }
            None => {
                let mut is_child = vec![false; root.nodes.len()];
                for child in root.nodes.iter().flat_map(|n| n.children.iter().flatten()) {
                    if let Some(flag) = is_child.get_mut(child.value()) {
                        *flag = true;
                    }
                }
                Ok((0..root.nodes.len()).filter(|&i| !is_child[i]).collect())
            }
        }
    }

    fn visit(&mut self, index: usize, parent: Placement, depth: usize) -> Result<(), ImportError> {
        let element = format!("node {index}");
        let count = self.root.nodes.len();
        let (Some(node), Some(transform)) =
            (self.root.nodes.get(index), self.document.nodes.get(index))
        else {
            return Err(missing(self.source, "node tree", "node", index, count));
        };
        if std::mem::replace(&mut self.visited[index], true) {
            return Err(self.source.invalid(element, "it has two parents, or is its own ancestor"));
        }
        if depth > MAX_DEPTH {
            let problem = format!("more than {MAX_DEPTH} levels deep");
            return Err(self.source.invalid(element, problem));
        }
        let placement = parent * transform.placement();
        if !placement.is_finite() {
            return Err(self.source.invalid(element, "its transform is not finite"));
        }
        if let Some(mesh) = node.mesh {
            let mesh = mesh.value();
            let meshes = self
                .of_mesh
                .get(mesh)
                .ok_or_else(|| missing(self.source, &element, "mesh", mesh, self.of_mesh.len()))?;
            *self.skinned += u32::from(node.skin.is_some());
            let others = node.extensions.as_ref().map(|e| &e.others);
            let placements = match others.and_then(|o| o.get("EXT_mesh_gpu_instancing")) {
                Some(value) => self.gpu_instances(&element, value)?,
                None => vec![Placement::IDENTITY],
            };
            if self.out.len() + placements.len() * meshes.len() > MAX_INSTANCES {
                let problem = format!("more than {MAX_INSTANCES} placed meshes");
                return Err(self.source.invalid(element, problem));
            }
            for p in placements {
                let placement = placement * p;
                self.out.extend(meshes.clone().map(|mesh| Instance { mesh, placement }));
            }
        }
        for child in node.children.iter().flatten() {
            self.visit(child.value(), placement, depth + 1)?;
        }
        Ok(())
    }

    /// EXT_mesh_gpu_instancing: TRANSLATION, ROTATION (xyzw) and SCALE, of equal counts.
    fn gpu_instances(
        &self,
        element: &str,
        value: &serde_json::Value,
    ) -> Result<Vec<Placement>, ImportError> {
        #[derive(Deserialize)]
        struct Extension {
            attributes: BTreeMap<String, u32>,
        }
        let element = format!("{element} EXT_mesh_gpu_instancing");
        let extension: Extension =
            serde_json::from_value(value.clone()).map_err(|e| self.source.invalid(&element, e))?;
        let reader = Reader { source: self.source, root: self.root, buffers: self.buffers };
        let accessor =
            |name: &str| extension.attributes.get(name).map(|&i| Index::<Accessor>::new(i));
        let vectors = |name: &str| {
            accessor(name)
                .map(|a| reader.numbers(&element, a, &[Type::Vec3], [0.0; 3], |v| v))
                .transpose()
        };
        let (translation, scale) = (vectors("TRANSLATION")?, vectors("SCALE")?);
        let rotation = accessor("ROTATION")
            .map(|a| reader.numbers(&element, a, &[Type::Vec4], [0.0; 4], |v| v))
            .transpose()?;
        let counts: Vec<usize> = [
            translation.as_ref().map(Vec::len),
            rotation.as_ref().map(Vec::len),
            scale.as_ref().map(Vec::len),
        ]
        .into_iter()
        .flatten()
        .collect();
        let count = counts.first().copied().unwrap_or(0);
        if counts.is_empty() || counts.iter().any(|&n| n != count) {
            return Err(self.source.invalid(element, format!("attribute counts {counts:?}")));
        }
        let placement = |i: usize| NodeTransform {
            matrix: None,
            translation: translation.as_ref().map(|t| t[i]),
            rotation: rotation.as_ref().map(|r| r[i]),
            scale: scale.as_ref().map(|s| s[i]),
        };
        Ok((0..count).map(|i| placement(i).placement()).collect())
    }
}
