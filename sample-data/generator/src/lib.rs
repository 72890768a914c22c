//! Trees of our own making, by seed and of any size.
//!
//! After J. Weber, J. Penn, "Creation and rendering of realistic trees", SIGGRAPH 1995: a trunk
//! and recursive levels of curved stems whose length, radius, angle and number follow the species'
//! parameters and the crown's shape (section 4). Simplified: no splits, no wind, no pruning
//! envelope, and all wood of one level is curved alike.
//!
//! ```
//! use forest_sample_data::{Species, grow};
//!
//! let model = grow(Species::Conifer, 1, 20_000);
//! let triangles = model.triangle_count();
//! assert!((19_000..=21_000).contains(&triangles), "{triangles}");
//! ```

mod mesh;
mod skeleton;
mod species;
mod texture;
mod write;

pub use species::Species;
pub use write::{write_glb, write_gltf, write_obj};

use forest_soup::{AlphaMode, Instance, Material, Model, Placement};
use std::sync::Arc;

/// Grows a tree of about `triangles` triangles: wood first, then as many leaf cards as are left
/// (each at least one a twig), smaller the more there are, so that the crown stays as dense.
pub fn grow(species: Species, seed: u64, triangles: u64) -> Model {
    let parameters = species.parameters();
    let stems = skeleton::grow(&parameters, seed);
    let wood = mesh::wood(&parameters, &stems);
    let cards = triangles.saturating_sub(wood.triangles.len() as u64) / 2;
    let leaves = mesh::leaves(&parameters, &stems, seed, cards);
    let material = |name: &str, texture, alpha_mode| Material {
        name: name.into(),
        texture: Some(texture),
        alpha_mode,
        double_sided: alpha_mode != AlphaMode::Opaque,
        ..Material::default()
    };
    Model {
        meshes: vec![wood, leaves],
        instances: [0, 1].map(|mesh| Instance { mesh, placement: Placement::IDENTITY }).into(),
        materials: vec![
            material("bark", 0, AlphaMode::Opaque),
            material("leaves", 1, AlphaMode::Mask { cutoff: 0.5 }),
        ],
        textures: vec![
            Arc::new(texture::bark(&parameters, seed)),
            Arc::new(texture::leaves(&parameters, seed)),
        ],
    }
}
