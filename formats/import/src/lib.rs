//! Trees from files: glTF 2.0 and Wavefront OBJ, blocks of several of them, and photographs.
//!
//! [`load`] reads one file into a [`forest_soup::Model`]; [`Block`] places several;
//! [`load_photographs`] reads photographs with calibrated cameras. What a file
//! needs and this crate does not know is [`ImportError::Unsupported`], naming it; a file that
//! breaks its format's rules is [`ImportError::Invalid`], with element, value and limit. Nothing
//! outside a file's own folder is read unless [`Limits::allow_outside`] says so.
//!
//! Sources: the glTF 2.0 specification and the extensions KHR_texture_transform,
//! KHR_materials_unlit, KHR_materials_diffuse_transmission (its factor),
//! KHR_materials_pbrSpecularGlossiness (base colour), KHR_mesh_quantization,
//! EXT_mesh_gpu_instancing, EXT_meshopt_compression, EXT_texture_webp; the Wavefront OBJ and MTL
//! notes of P. Bourke. Normal textures are read where they have the coordinates of the base colour's, of OBJ
//! files from `norm`, or from `map_Bump` if its picture is one of normals.
//!
//! ```
//! let dir = tempfile::tempdir().unwrap();
//! let path = dir.path().join("leaf.obj");
//! std::fs::write(&path, "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n").unwrap();
//! let leaf = forest_import::load(&path, &forest_import::Limits::default()).unwrap();
//! assert_eq!(leaf.model.triangle_count(), 2);
//! ```

mod block;
mod error;
mod files;
mod gltf;
mod obj;
mod photographs;
mod picture;
mod references;
mod source;

pub use block::{Block, LoadedBlock, Part};
pub use error::ImportError;
pub use files::Files;
pub use photographs::{CaptureSet, Up, load_photographs, load_photographs_from, transforms_file};
pub use references::references;
pub use source::Limits;

use forest_soup::Model;
use source::Source;
use std::path::Path;

/// A file and everything it refers to, read.
#[derive(Debug)]
pub struct Imported {
    /// Meshes, instances, materials, textures.
    pub model: Model,
    /// BLAKE3 over the file and all files it refers to, in the order of reading.
    pub hash: [u8; 32],
    /// What was odd but could be read.
    pub warnings: Vec<String>,
}

/// Reads one tree; the format is told by the extension (`.glb`, `.gltf`, `.obj`). The path `-` is standard
/// input, whose format is told by how it begins.
///
/// # Errors
/// When a file cannot be read, breaks its format's rules, or needs what is not supported.
pub fn load(path: &Path, limits: &Limits) -> Result<Imported, ImportError> {
    if path == Path::new(source::STDIN) {
        let given = Files::stdin(limits.file_bytes)?;
        return load_from(&given, path, limits);
    }
    load_from(&Files::Disk, path, limits)
}

/// As [`load`], of files that may be in memory.
///
/// # Errors
/// As [`load`].
pub fn load_from(files: &Files, path: &Path, limits: &Limits) -> Result<Imported, ImportError> {
    let mut source = Source::open(files, path, *limits)?;
    let model = match source.extension()?.as_deref() {
        Some("glb" | "gltf") => gltf::load(&mut source)?,
        Some("obj") => obj::load(&mut source)?,
        other => {
            let what = format!("the format {:?} (known: glb, gltf, obj)", other.unwrap_or(""));
            return Err(ImportError::unsupported(path, what));
        }
    };
    let (hash, warnings) = source.finish();
    Ok(Imported { model, hash, warnings })
}
