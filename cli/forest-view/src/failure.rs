//! Errors to exit codes.

use forest_gpu::GpuError;
use forest_import::ImportError;
use forest_pack::PackError;
use forest_scene::SceneError;
use forest_soup::FlattenError;
use std::process::ExitCode;

/// A request that makes no sense, in words.
#[derive(Debug)]
pub(crate) struct Usage(pub(crate) String);

impl std::fmt::Display for Usage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Usage {}

/// The documented code of an error: by the first cause that has one.
pub(crate) fn exit_code(error: &anyhow::Error) -> ExitCode {
    let number = |cause: &(dyn std::error::Error + 'static)| {
        if cause.is::<Usage>() {
            return Some(1);
        }
        if cause.is::<std::io::Error>() {
            return Some(2);
        }
        if cause.is::<serde_json::Error>() || cause.is::<FlattenError>() {
            return Some(3);
        }
        if let Some(e) = cause.downcast_ref::<SceneError>() {
            return Some(e.exit_code());
        }
        if let Some(e) = cause.downcast_ref::<GpuError>() {
            return Some(match e {
                GpuError::Pack(e) => e.exit_code(),
                GpuError::Scene(e) => e.exit_code(),
                GpuError::Missing { .. } => 1,
                GpuError::Nothing { .. } => 3,
                _ => 4,
            });
        }
        let pack = cause.downcast_ref::<PackError>().map(PackError::exit_code);
        pack.or_else(|| cause.downcast_ref::<ImportError>().map(ImportError::exit_code))
    };
    ExitCode::from(error.chain().find_map(number).unwrap_or(4))
}
