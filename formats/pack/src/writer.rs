//! Writing: beside the target, then renamed over it.

use crate::layout::{
    ALIGNMENT, Codec, ENTRY_HASH, FileHeader, MAGIC, MAX_SECTIONS, TableEntry, VERSION,
    section_hash, table_hash,
};
use crate::{Pack, PackError, SectionId, Spool, whole};
use bytemuck::Zeroable;
use std::io::{BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// zstd level: higher ones gain almost nothing on texels and cost ten times the time.
const ZSTD_LEVEL: i32 = 1;

/// A section's bytes as one zstd frame.
pub struct Compressed {
    stored: Vec<u8>,
    length: u64,
    hash: [u8; ENTRY_HASH],
}

impl Compressed {
    /// Compresses `data`.
    ///
    /// # Errors
    /// When zstd runs out of memory.
    pub fn new(data: &[u8]) -> Result<Self, PackError> {
        let failed = PackError::io(Path::new("section"), "zstd failed");
        let stored = zstd::bulk::compress(data, ZSTD_LEVEL).map_err(failed)?;
        let hash = section_hash(&stored);
        Ok(Self { stored, length: data.len() as u64, hash })
    }
}

/// Writes a pack to a temporary file beside its target; [`PackWriter::finish`] renames it. Dropped
/// before that, it leaves nothing.
pub struct PackWriter {
    target: PathBuf,
    out: BufWriter<NamedTempFile>,
    position: u64,
    table: Vec<TableEntry>,
}

impl PackWriter {
    /// Starts a pack that will replace `target`.
    ///
    /// # Errors
    /// When the folder cannot be written.
    pub fn create(target: &Path) -> Result<Self, PackError> {
        let file = whole::beside(target)
            .map_err(PackError::io(target, "cannot create a file beside it"))?;
        let mut writer = Self {
            target: target.into(),
            out: BufWriter::with_capacity(1 << 20, file),
            position: 0,
            table: Vec::new(),
        };
        writer.put(&[0; size_of::<FileHeader>()])?;
        Ok(writer)
    }

    /// The file that will be written.
    pub fn path(&self) -> &Path {
        &self.target
    }

    /// Adds a section. Ids must be new to the pack.
    ///
    /// # Errors
    /// When the id is taken or the disk is full.
    pub fn add(&mut self, id: SectionId, codec: Codec, data: &[u8]) -> Result<(), PackError> {
        if codec == Codec::Zstd {
            return self.add_compressed(id, &Compressed::new(data)?);
        }
        let length = data.len() as u64;
        self.begin(id, Codec::None, length, length, section_hash(data))?;
        self.put(data)
    }

    /// Adds a section that was compressed before: on other threads, say.
    ///
    /// # Errors
    /// When the id is taken or the disk is full.
    pub fn add_compressed(&mut self, id: SectionId, data: &Compressed) -> Result<(), PackError> {
        let Compressed { stored, length, hash } = data;
        self.begin(id, Codec::Zstd, stored.len() as u64, *length, *hash)?;
        self.put(stored)
    }

    /// Adds a section that was written piece by piece.
    ///
    /// # Errors
    /// When the id is taken or the disk is full.
    pub fn add_spool(&mut self, id: SectionId, mut spool: Spool) -> Result<(), PackError> {
        self.begin(id, Codec::None, spool.len(), spool.len(), spool.hash())?;
        spool.copy_to(&mut self.out).map_err(PackError::io(&self.target, "cannot write"))?;
        self.position += spool.len();
        Ok(())
    }

    /// Copies a section of another pack as it is stored there.
    ///
    /// # Errors
    /// When the source section is damaged, the id is taken or the disk is full.
    pub fn copy(&mut self, from: &Pack, id: SectionId) -> Result<(), PackError> {
        let (section, stored) = from.stored(id)?;
        let length = section.length;
        self.begin(id, section.codec, stored.len() as u64, length, section_hash(stored))?;
        self.put(stored)
    }

    /// Writes the table and the header, and renames the file over its target.
    ///
    /// # Errors
    /// When the disk is full or the rename fails; the target is then as it was.
    pub fn finish(mut self) -> Result<(), PackError> {
        self.align()?;
        let table_offset = self.position;
        let table = std::mem::take(&mut self.table);
        let table_bytes: &[u8] = bytemuck::cast_slice(&table);
        self.put(table_bytes)?;
        let mut header = FileHeader {
            magic: MAGIC,
            version: VERSION,
            sections: table.len() as u32,
            file_length: self.position,
            table_offset,
            hash: [0; 32],
        };
        header.hash = table_hash(&header, table_bytes);
        let failed = |e| PackError::io(&self.target, "cannot write")(e);
        self.out.seek(SeekFrom::Start(0)).map_err(failed)?;
        self.out.write_all(bytemuck::bytes_of(&header)).map_err(failed)?;
        let file = self.out.into_inner().map_err(|e| failed(e.into_error()))?;
        file.persist(&self.target)
            .map_err(|e| PackError::io(&self.target, "cannot rename the finished file")(e.error))?;
        Ok(())
    }

    fn begin(
        &mut self,
        id: SectionId,
        codec: Codec,
        stored_length: u64,
        length: u64,
        hash: [u8; ENTRY_HASH],
    ) -> Result<(), PackError> {
        if self.table.iter().any(|e| (e.kind, e.index) == (id.kind, id.index)) {
            return Err(PackError::invalid(&self.target, id, "the section was already written"));
        }
        if self.table.len() >= MAX_SECTIONS as usize {
            let problem = format!("more than {MAX_SECTIONS} sections");
            return Err(PackError::invalid(&self.target, id, problem));
        }
        self.align()?;
        self.table.push(TableEntry {
            kind: id.kind,
            codec: codec.code(),
            index: id.index,
            offset: self.position,
            stored_length,
            length,
            hash,
            ..TableEntry::zeroed()
        });
        Ok(())
    }

    fn align(&mut self) -> Result<(), PackError> {
        let padding = self.position.next_multiple_of(ALIGNMENT) - self.position;
        self.put(&[0; ALIGNMENT as usize][..padding as usize])
    }

    fn put(&mut self, bytes: &[u8]) -> Result<(), PackError> {
        self.position += bytes.len() as u64;
        self.out.write_all(bytes).map_err(PackError::io(&self.target, "cannot write"))
    }
}
