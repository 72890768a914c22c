//! Byte layout of the file header and of the section table (SPEC.md, sections 1 and 2).

use bytemuck::{Pod, Zeroable};

/// First bytes of every pack. The line ends and the control-Z catch text-mode transfers.
pub(crate) const MAGIC: [u8; 8] = *b"FPACK\r\n\x1a";

/// Container version written by this crate, and the only one it reads.
pub const VERSION: u32 = 1;

/// Sections start at multiples of this: what GPU uploads and memory maps want.
pub const ALIGNMENT: u64 = 256;

/// More sections than any pack needs; bounds what a hostile header can claim.
pub(crate) const MAX_SECTIONS: u32 = 65_536;

/// Bytes of a BLAKE3 hash kept in a table entry.
pub(crate) const ENTRY_HASH: usize = 24;

/// The file header, 64 bytes.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct FileHeader {
    pub(crate) magic: [u8; 8],
    pub(crate) version: u32,
    pub(crate) sections: u32,
    pub(crate) file_length: u64,
    pub(crate) table_offset: u64,
    /// BLAKE3 of bytes 0..32 of this header followed by the table.
    pub(crate) hash: [u8; 32],
}

/// One row of the section table, 64 bytes.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct TableEntry {
    pub(crate) kind: u16,
    pub(crate) codec: u16,
    pub(crate) index: u32,
    pub(crate) offset: u64,
    pub(crate) stored_length: u64,
    pub(crate) length: u64,
    pub(crate) reserved: [u8; 8],
    /// First 24 bytes of the BLAKE3 of the stored bytes.
    pub(crate) hash: [u8; ENTRY_HASH],
}

const _: () = assert!(size_of::<FileHeader>() == 64 && size_of::<TableEntry>() == 64);

/// How a section's bytes are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Codec {
    /// As they are: may be mapped and uploaded.
    None,
    /// One zstd frame.
    Zstd,
}

impl Codec {
    pub(crate) fn code(self) -> u16 {
        match self {
            Codec::None => 0,
            Codec::Zstd => 1,
        }
    }

    pub(crate) fn from_code(code: u16) -> Option<Self> {
        match code {
            0 => Some(Codec::None),
            1 => Some(Codec::Zstd),
            _ => None,
        }
    }
}

/// Hash of the header's first 32 bytes and the table.
pub(crate) fn table_hash(header: &FileHeader, table: &[u8]) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    hasher.update(&bytemuck::bytes_of(header)[..32]);
    hasher.update(table);
    *hasher.finalize().as_bytes()
}

/// Hash of a section's stored bytes.
pub(crate) fn section_hash(stored: &[u8]) -> [u8; ENTRY_HASH] {
    short(blake3::hash(stored))
}

pub(crate) fn short(hash: blake3::Hash) -> [u8; ENTRY_HASH] {
    std::array::from_fn(|i| hash.as_bytes()[i])
}
