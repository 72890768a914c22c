//! Meshes while they are baked.

use crate::branch::OnBranch;
use forest_soup::{Material, Texture, TriangleSoup};
use glam::{DVec2, DVec3};
use std::sync::Arc;

/// A corner.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vertex {
    /// About the soup's origin.
    pub(crate) position: DVec3,
    /// Unit.
    pub(crate) normal: DVec3,
    pub(crate) uv: DVec2,
    /// Linear RGBA.
    pub(crate) color: [f32; 4],
    /// The branch that moves it.
    pub(crate) on: OnBranch,
    /// Share of the sky that it sees.
    pub(crate) skylit: f64,
}

/// Triangles with materials of the source.
#[derive(Clone, Debug, Default)]
pub(crate) struct Mesh {
    pub(crate) vertices: Vec<Vertex>,
    /// Corners and material.
    pub(crate) triangles: Vec<([u32; 3], u16)>,
}

impl Mesh {
    /// As a soup, to be drawn.
    pub(crate) fn soup(&self, materials: &[Material], textures: &[Arc<Texture>]) -> TriangleSoup {
        TriangleSoup {
            positions: self.vertices.iter().map(|v| v.position.as_vec3()).collect(),
            normals: self.vertices.iter().map(|v| v.normal.as_vec3()).collect(),
            uvs: self.vertices.iter().map(|v| v.uv.as_vec2()).collect(),
            colors: self.vertices.iter().map(|v| v.color).collect(),
            triangles: self.triangles.iter().map(|t| t.0).collect(),
            triangle_materials: self.triangles.iter().map(|t| t.1).collect(),
            materials: materials.to_vec(),
            textures: textures.to_vec(),
            ..TriangleSoup::default()
        }
    }
}
