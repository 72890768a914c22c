//! The flattened triangle soup.

use crate::{Material, Model, Texture};
use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;
use std::sync::Arc;

/// Triangles with materials: an `f64` origin and `f32` positions about it.
///
/// Attribute arrays (`normals`, `uvs`, `colors`) are empty or as long as `positions`.
#[derive(Clone, Debug, Default)]
pub struct TriangleSoup {
    /// World position of the soup's zero.
    pub origin: DVec3,
    /// Vertex positions about the origin.
    pub positions: Vec<Vec3>,
    /// Vertex normals (unit, or zero where unknown), or empty.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, or empty; v points down.
    pub uvs: Vec<Vec2>,
    /// Linear RGBA vertex colours, or empty.
    pub colors: Vec<[f32; 4]>,
    /// Share of the sun that vertices get of what reaches them, `0..=1`, or empty: all of it.
    pub sunlit: Vec<f32>,
    /// Share of the sky that is seen from vertices, `0..=1`, or empty where nobody asked: all of it.
    pub skylit: Vec<f32>,
    /// Vertex indices, three a triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Material of each triangle; as long as `triangles`.
    pub triangle_materials: Vec<u16>,
    /// The materials.
    pub materials: Vec<Material>,
    /// The textures that materials refer to.
    pub textures: Vec<Arc<Texture>>,
}

/// A soup that breaks one of its own rules; the message says which.
#[derive(Debug, thiserror::Error)]
#[error("invalid soup: {0}")]
pub struct InvalidSoup(String);

impl TriangleSoup {
    /// The corners of triangle `i`.
    #[inline]
    pub fn corners(&self, i: usize) -> [Vec3; 3] {
        self.triangles[i].map(|v| self.positions[v as usize])
    }

    /// The box around all triangles whose corners are finite, in the soup's space; empty if there is
    /// none. Vertices that no triangle uses do not count.
    pub fn bounds(&self) -> Bounds {
        (0..self.triangles.len())
            .into_par_iter()
            .with_min_len(1 << 14)
            .map(|i| self.corners(i))
            .filter(|corners| corners.iter().all(|p| p.is_finite()))
            .fold(
                || Bounds::EMPTY,
                |b, corners| corners.iter().fold(b, |b, p| b.with(p.as_dvec3())),
            )
            .reduce(|| Bounds::EMPTY, Bounds::union)
    }

    /// Checks lengths, indices and material references. Positions may still be non-finite: bakers
    /// drop such triangles and count them.
    ///
    /// # Errors
    /// The first broken rule, with the element and the limit.
    pub fn validate(&self) -> Result<(), InvalidSoup> {
        let n = self.positions.len();
        let fail = |m: String| Err(InvalidSoup(m));
        for (name, len) in [
            ("normals", self.normals.len()),
            ("uvs", self.uvs.len()),
            ("colors", self.colors.len()),
            ("shares of the sun", self.sunlit.len()),
            ("shares of the sky", self.skylit.len()),
        ] {
            if len != 0 && len != n {
                return fail(format!("{len} {name} for {n} positions"));
            }
        }
        if self.triangle_materials.len() != self.triangles.len() {
            let (m, t) = (self.triangle_materials.len(), self.triangles.len());
            return fail(format!("{m} material indices for {t} triangles"));
        }
        if let Some(t) = self.triangles.iter().position(|t| t.iter().any(|&v| v as usize >= n)) {
            return fail(format!("triangle {t} uses vertices {:?} of {n}", self.triangles[t]));
        }
        let m = self.materials.len();
        if let Some(t) = self.triangle_materials.iter().position(|&x| x as usize >= m) {
            return fail(format!(
                "triangle {t} uses material {} of {m}",
                self.triangle_materials[t]
            ));
        }
        check_palette(&self.materials, &self.textures)
    }
}

impl Model {
    /// Checks lengths, indices and references, as [`TriangleSoup::validate`] does.
    ///
    /// # Errors
    /// The first broken rule, with the element and the limit.
    pub fn validate(&self) -> Result<(), InvalidSoup> {
        let fail = |m: String| Err(InvalidSoup(m));
        for (i, mesh) in self.meshes.iter().enumerate() {
            let n = mesh.positions.len();
            for (name, len) in [
                ("normals", mesh.normals.len()),
                ("uvs", mesh.uvs.len()),
                ("colors", mesh.colors.len()),
            ] {
                if len != 0 && len != n {
                    return fail(format!("mesh {i}: {len} {name} for {n} positions"));
                }
            }
            if let Some(t) = mesh.triangles.iter().find(|t| t.iter().any(|&v| v as usize >= n)) {
                return fail(format!("mesh {i}: a triangle uses vertices {t:?} of {n}"));
            }
            let (material, m) = (mesh.material, self.materials.len());
            if usize::from(material) >= m {
                return fail(format!("mesh {i} uses material {material} of {m}"));
            }
        }
        let m = self.meshes.len();
        if let Some(i) = self.instances.iter().position(|i| i.mesh as usize >= m) {
            return fail(format!("instance {i} is of mesh {} of {m}", self.instances[i].mesh));
        }
        check_palette(&self.materials, &self.textures)
    }
}

fn check_palette(materials: &[Material], textures: &[Arc<Texture>]) -> Result<(), InvalidSoup> {
    let fail = |m: String| Err(InvalidSoup(m));
    for (i, material) in materials.iter().enumerate() {
        if material.texture.is_some_and(|t| t as usize >= textures.len()) {
            let t = textures.len();
            return fail(format!("material {i} uses texture {:?} of {t}", material.texture));
        }
        if let Some(r) = material.relief
            && !r.is_valid(textures.len())
        {
            let (t, n, scale) = (r.texture, textures.len(), r.scale);
            return fail(format!("material {i} uses normal texture {t} of {n}, times {scale}"));
        }
    }
    for texture in textures {
        let (w, h, have) = (texture.width, texture.height, texture.texels.len());
        if w == 0 || h == 0 || have as u64 != u64::from(w) * u64::from(h) {
            return fail(format!("texture {:?} is {w}×{h} with {have} texels", texture.name));
        }
    }
    Ok(())
}

/// An axis-aligned box in the soup's space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Smallest corner.
    pub min: DVec3,
    /// Largest corner.
    pub max: DVec3,
}

impl Bounds {
    /// Contains nothing; any union replaces it.
    pub const EMPTY: Self =
        Self { min: DVec3::splat(f64::INFINITY), max: DVec3::splat(f64::NEG_INFINITY) };

    /// The smallest box around both.
    pub fn union(self, o: Self) -> Self {
        Self { min: self.min.min(o.min), max: self.max.max(o.max) }
    }

    /// The smallest box around this one and a point.
    pub fn with(self, p: DVec3) -> Self {
        Self { min: self.min.min(p), max: self.max.max(p) }
    }

    /// Whether nothing was ever put in.
    pub fn is_empty(&self) -> bool {
        self.min.x > self.max.x
    }

    /// The middle.
    pub fn center(&self) -> DVec3 {
        (self.min + self.max) * 0.5
    }

    /// Edge lengths.
    pub fn size(&self) -> DVec3 {
        self.max - self.min
    }

    /// Half the diagonal: the radius of the sphere around the box.
    pub fn half_diagonal(&self) -> f64 {
        self.size().length() * 0.5
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_leave_out_what_is_not_drawn() {
        let soup = TriangleSoup {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::splat(9.0), Vec3::NAN],
            triangles: vec![[0, 1, 2], [3, 4, 0]],
            ..TriangleSoup::default()
        };
        assert_eq!(soup.bounds(), Bounds { min: DVec3::ZERO, max: DVec3::new(1.0, 1.0, 0.0) });
        assert!(TriangleSoup::default().bounds().is_empty());
    }

    #[test]
    fn validate_names_the_element_and_the_limit() {
        let good = TriangleSoup {
            positions: vec![Vec3::ZERO; 3],
            triangles: vec![[0, 1, 2]],
            triangle_materials: vec![0],
            materials: vec![Material::default()],
            ..TriangleSoup::default()
        };
        good.validate().unwrap();
        let broken = |change: fn(&mut TriangleSoup), want: &str| {
            let mut s = good.clone();
            change(&mut s);
            let e = s.validate().unwrap_err().to_string();
            assert!(e.contains(want), "{e}");
        };
        broken(|s| s.triangles.push([0, 1, 3]), "1 material indices for 2 triangles");
        broken(|s| s.triangles[0][1] = 7, "triangle 0 uses vertices [0, 7, 2] of 3");
        broken(|s| s.triangle_materials[0] = 2, "triangle 0 uses material 2 of 1");
        broken(|s| s.uvs.push(Vec2::ZERO), "1 uvs for 3 positions");
        broken(|s| s.materials[0].texture = Some(4), "material 0 uses texture Some(4) of 0");
    }
}
