//! Errors to exit codes.

use forest_batch::BatchError;
use forest_eval::EvalError;
use forest_export::ExportError;
use forest_foliage::FoliageError;
use forest_import::ImportError;
use forest_pack::PackError;
use forest_points::BakeError;
use forest_scene::SceneError;
use forest_soup::FlattenError;
use forest_views::ViewsError;
use forest_volume::VolumeError;
use std::process::ExitCode;

/// Wrong usage.
pub(crate) const USAGE: ExitCode = ExitCode::FAILURE; // 1

/// A request that makes no sense, in words.
#[derive(Debug)]
pub(crate) struct Usage(pub(crate) String);

impl std::fmt::Display for Usage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Usage {}

/// An error in words: its causes, but for those that it names itself.
pub(crate) fn told(error: &anyhow::Error) -> String {
    let mut text = String::new();
    for cause in error.chain() {
        let own = cause.to_string();
        if own.starts_with(&text) {
            text = own;
        } else if !text.contains(&own) {
            text = format!("{text}: {own}");
        }
    }
    text
}

/// The documented code of an error: by the first cause that has one.
pub(crate) fn exit_code(error: &anyhow::Error) -> u8 {
    error.chain().find_map(number).unwrap_or(4)
}

fn number(cause: &(dyn std::error::Error + 'static)) -> Option<u8> {
    if cause.is::<Usage>() {
        return Some(1);
    }
    if cause.is::<std::io::Error>() {
        return Some(2);
    }
    if let Some(e) = cause.downcast_ref::<ImportError>() {
        return Some(e.exit_code());
    }
    if let Some(e) = cause.downcast_ref::<BatchError>() {
        return Some(e.exit_code());
    }
    if let Some(e) = cause.downcast_ref::<PackError>() {
        return Some(e.exit_code());
    }
    if let Some(e) = cause.downcast_ref::<SceneError>() {
        return Some(e.exit_code());
    }
    if let Some(e) = cause.downcast_ref::<BakeError>() {
        return Some(bake(e));
    }
    if let Some(e) = cause.downcast_ref::<ViewsError>() {
        return Some(match e {
            ViewsError::Options(_) => 1,
            ViewsError::Pack(e) => e.exit_code(),
            ViewsError::Soup(_) | ViewsError::NothingToSee => 3,
            _ => 4,
        });
    }
    if let Some(e) = cause.downcast_ref::<VolumeError>() {
        return Some(match e {
            VolumeError::Options(_) => 1,
            VolumeError::Pack(e) => e.exit_code(),
            VolumeError::Soup(_) | VolumeError::NothingToSee(_) | VolumeError::Inconsistent(_) => 3,
            _ => 4,
        });
    }
    if let Some(e) = cause.downcast_ref::<FoliageError>() {
        return Some(match e {
            FoliageError::Options(_) | FoliageError::NoSuchMaterial { .. } => 1,
            FoliageError::Pack(e) => e.exit_code(),
            FoliageError::Soup(_) | FoliageError::NothingToSee | FoliageError::NoLeaves { .. } => 3,
            _ => 4,
        });
    }
    if let Some(e) = cause.downcast_ref::<ExportError>() {
        return Some(match e {
            ExportError::Pack(e) => e.exit_code(),
            ExportError::Unsuited(_) => 5,
            _ => 4,
        });
    }
    if let Some(e) = cause.downcast_ref::<EvalError>() {
        return Some(match e {
            EvalError::Plan { .. } => 1,
            EvalError::Temporary(_) => 2,
            EvalError::Lens(_) => 5,
            EvalError::Pack(e) => e.exit_code(),
            EvalError::Bake(e) => bake(e),
            EvalError::Soup(_) | EvalError::NothingToSee | EvalError::Unseen { .. } => 3,
            _ => 4,
        });
    }
    cause.is::<FlattenError>().then_some(3)
}

fn bake(e: &BakeError) -> u8 {
    match e {
        BakeError::Option { .. } => 1,
        BakeError::Pack(e) => e.exit_code(),
        BakeError::TooManyPoints(_) => 4,
        _ => 3,
    }
}
