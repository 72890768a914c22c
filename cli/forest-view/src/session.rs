//! A pack on the device, replaced as a whole when its file changes.

use anyhow::Result;
use forest_gpu::{Gpu, Model, Renderer};
use forest_pack::Pack;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

mod cell {
    use forest_gpu::Model;
    use forest_pack::Pack;

    self_cell::self_cell!(
        /// A pack, and the model that borrows its memory map.
        pub(super) struct PackedModel {
            owner: Pack,
            #[covariant]
            dependent: Model,
        }
    );
}

/// How often the file is looked at.
const WATCH: Duration = Duration::from_millis(500);

/// An open pack.
pub(crate) struct Session {
    path: PathBuf,
    packed: cell::PackedModel,
    stamp: Option<(SystemTime, u64)>,
    looked: Instant,
}

impl Session {
    /// Opens and uploads a pack.
    pub(crate) fn open(gpu: &Gpu, renderer: &Renderer, path: &Path) -> Result<Self> {
        let stamp = stamp(path);
        let pack = Pack::open(path)?;
        let packed = cell::PackedModel::try_new(pack, |pack| Model::load(gpu, renderer, pack))?;
        Ok(Self { path: path.into(), packed, stamp, looked: Instant::now() })
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    pub(crate) fn model(&self) -> &Model<'_> {
        self.packed.borrow_dependent()
    }

    /// Does something that changes what a frame needs of the model.
    pub(crate) fn with_model<R>(&mut self, work: impl for<'p> FnOnce(&mut Model<'p>) -> R) -> R {
        self.packed.with_dependent_mut(|_, model| work(model))
    }

    /// Whether the file has changed since it was opened; looks at most twice a second.
    pub(crate) fn has_changed(&mut self) -> bool {
        if self.looked.elapsed() < WATCH {
            return false;
        }
        self.looked = Instant::now();
        let now = stamp(&self.path);
        let changed = now.is_some() && now != self.stamp;
        if changed {
            self.stamp = now;
        }
        changed
    }
}

/// When a file was written, and its length.
fn stamp(path: &Path) -> Option<(SystemTime, u64)> {
    let metadata = std::fs::metadata(path).ok()?;
    Some((metadata.modified().ok()?, metadata.len()))
}
