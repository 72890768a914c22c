//! The `.fpack` container: the only reader and writer.
//!
//! A pack is a 64-byte header, sections, and a table of typed sections with offset, length, codec
//! and hash. Bulk sections are little-endian arrays, aligned to [`ALIGNMENT`] bytes, to be mapped
//! and uploaded as they lie; small headers are [`header`]-encoded. `SPEC.md` beside this crate is
//! normative. The container knows nothing of trees: what a section means is its owner's business.
//!
//! ```
//! use forest_pack::{Codec, Pack, PackWriter, SectionId, kind};
//!
//! let dir = tempfile::tempdir().unwrap();
//! let path = dir.path().join("tree.fpack");
//! let id = SectionId::new(kind::POINTS, 0);
//!
//! let mut writer = PackWriter::create(&path).unwrap();
//! writer.add(id, Codec::None, &[1, 2, 3, 4]).unwrap();
//! writer.finish().unwrap(); // the file appears whole or not at all
//!
//! let pack = Pack::open(&path).unwrap();
//! assert_eq!(&*pack.bytes(id, 1 << 20).unwrap(), &[1, 2, 3, 4]);
//! ```

mod error;
pub mod header;
pub mod kind;
mod layout;
pub mod measures;
mod reader;
mod scratch;
mod spool;
mod whole;
mod writer;

pub use error::PackError;
pub use kind::SectionId;
pub use layout::{ALIGNMENT, Codec, VERSION};
pub use reader::{Pack, Section};
pub use scratch::{Scratch, ScratchPart};
pub use spool::Spool;
pub use whole::{copy_whole, write_whole};
pub use writer::{Compressed, PackWriter};
