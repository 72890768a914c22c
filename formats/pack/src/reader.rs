//! Reading: every claim of the file is checked before it is believed.

use crate::layout::{
    ALIGNMENT, Codec, FileHeader, MAGIC, MAX_SECTIONS, TableEntry, VERSION, section_hash,
    table_hash,
};
use crate::{PackError, SectionId};
use bytemuck::Pod;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

/// The most that [`Pack::verify`] lets a compressed section decode to.
const MAX_DECODED: u64 = 4 << 30;

/// An open pack. Opening checks the header, the table and the padding; a section's hash is checked
/// whenever its bytes are asked for.
#[derive(Debug)]
pub struct Pack {
    path: PathBuf,
    data: Data,
    sections: BTreeMap<SectionId, Section>,
    unknown: Vec<SectionId>,
}

/// Where a section lies and how it is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Section {
    /// How it is stored.
    pub codec: Codec,
    /// First byte in the file, a multiple of [`ALIGNMENT`].
    pub offset: u64,
    /// Bytes in the file.
    pub stored_length: u64,
    /// Bytes once decoded.
    pub length: u64,
    hash: [u8; crate::layout::ENTRY_HASH],
}

#[derive(Debug)]
enum Data {
    Mapped(memmap2::Mmap),
    /// Kept in 8-byte words, so that records may be read in place.
    Owned(Vec<u64>, usize),
}

impl Data {
    fn bytes(&self) -> &[u8] {
        match self {
            Data::Mapped(map) => map,
            Data::Owned(words, length) => &bytemuck::cast_slice(words)[..*length],
        }
    }
}

impl Pack {
    /// Maps and checks a pack. Packs are replaced by renaming, never rewritten in place, so a
    /// mapped one does not change underfoot.
    ///
    /// # Errors
    /// When the file cannot be read, breaks a rule of SPEC.md or is of another version.
    pub fn open(path: &Path) -> Result<Self, PackError> {
        let file = File::open(path).map_err(PackError::io(path, "cannot open"))?;
        let length = file.metadata().map_err(PackError::io(path, "cannot read its size"))?.len();
        if length == 0 {
            return Err(PackError::invalid(path, "header", "the file is empty"));
        }
        // SAFETY: the map is read-only; writers of this crate replace packs by renaming.
        #[expect(unsafe_code, reason = "memory maps have no safe constructor")]
        let map = unsafe { memmap2::Mmap::map(&file) }
            .map_err(PackError::io(path, "cannot map into memory"))?;
        Self::check(path.into(), Data::Mapped(map))
    }

    /// Checks a pack that is already in memory; `name` stands for the file in messages.
    ///
    /// # Errors
    /// As [`Pack::open`].
    pub fn from_bytes(name: &Path, bytes: &[u8]) -> Result<Self, PackError> {
        let mut words = vec![0u64; bytes.len().div_ceil(8)];
        bytemuck::cast_slice_mut(&mut words)[..bytes.len()].copy_from_slice(bytes);
        Self::check(name.into(), Data::Owned(words, bytes.len()))
    }

    /// The file, as it was named.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Bytes of the whole file.
    pub fn file_length(&self) -> u64 {
        self.data.bytes().len() as u64
    }

    /// All sections of known codec, in order of kind and index.
    pub fn sections(&self) -> impl Iterator<Item = (SectionId, Section)> + '_ {
        self.sections.iter().map(|(&id, &section)| (id, section))
    }

    /// Sections in a codec this build does not know: skipped, unless asked for.
    pub fn unknown_sections(&self) -> &[SectionId] {
        &self.unknown
    }

    /// Whether the pack holds section `id`.
    pub fn contains(&self, id: SectionId) -> bool {
        self.sections.contains_key(&id)
    }

    /// The decoded bytes of a section; its hash is checked. Uncompressed sections are borrowed
    /// from the map.
    ///
    /// # Errors
    /// When the section is missing, damaged, or decodes to more than `limit` bytes.
    pub fn bytes(&self, id: SectionId, limit: u64) -> Result<Cow<'_, [u8]>, PackError> {
        let (section, stored) = self.stored(id)?;
        let invalid = |problem: String| PackError::invalid(&self.path, id, problem);
        if section.length > limit {
            return Err(invalid(format!(
                "decodes to {} bytes; the limit is {limit}",
                section.length
            )));
        }
        match section.codec {
            Codec::None => Ok(Cow::Borrowed(stored)),
            Codec::Zstd => {
                // The vector grows with what is really there, whatever the table claims.
                let mut decoded = Vec::new();
                zstd::stream::read::Decoder::new(stored)
                    .and_then(|d| d.take(section.length + 1).read_to_end(&mut decoded))
                    .map_err(|e| invalid(format!("zstd: {e}")))?;
                if decoded.len() as u64 != section.length {
                    let (got, want) = (decoded.len(), section.length);
                    return Err(invalid(format!("decodes to {got} bytes; the table says {want}")));
                }
                Ok(Cow::Owned(decoded))
            }
        }
    }

    /// An uncompressed section as an array of records, in place.
    ///
    /// # Errors
    /// When the section is missing, damaged, compressed, or not a whole number of records.
    pub fn records<T: Pod>(&self, id: SectionId) -> Result<&[T], PackError> {
        let (section, stored) = self.stored(id)?;
        if section.codec != Codec::None {
            return Err(PackError::invalid(&self.path, id, "records must be stored uncompressed"));
        }
        bytemuck::try_cast_slice(stored).map_err(|_| {
            let (n, size) = (stored.len(), size_of::<T>());
            let problem = format!("{n} bytes are not a whole number of {size}-byte records");
            PackError::invalid(&self.path, id, problem)
        })
    }

    /// Checks the hash of every section, that none decodes to more than 4 GiB if compressed, and that it decodes to the length the table gives.
    ///
    /// # Errors
    /// The first damaged section. A section of unknown codec can only be checked by its hash.
    pub fn verify(&self) -> Result<(), PackError> {
        self.sections.iter().try_for_each(|(&id, section)| match section.codec {
            Codec::None => self.stored(id).map(drop),
            Codec::Zstd => self.bytes(id, MAX_DECODED).map(drop),
        })
    }

    /// A section as it is stored, hash checked.
    pub(crate) fn stored(&self, id: SectionId) -> Result<(Section, &[u8]), PackError> {
        let section = *self
            .sections
            .get(&id)
            .ok_or_else(|| PackError::invalid(&self.path, id, "the pack has no such section"))?;
        let stored =
            &self.data.bytes()[section.offset as usize..][..section.stored_length as usize];
        if section_hash(stored) != section.hash {
            return Err(PackError::invalid(&self.path, id, "its hash does not match: damaged"));
        }
        Ok((section, stored))
    }

    fn check(path: PathBuf, data: Data) -> Result<Self, PackError> {
        let bytes = data.bytes();
        let header = check_header(&path, bytes)?;
        let table = check_table(&path, bytes, &header)?;
        let mut sections = BTreeMap::new();
        let mut unknown = Vec::new();
        let mut end = size_of::<FileHeader>() as u64;
        for (row, entry) in table.iter().enumerate() {
            let id = SectionId::new(entry.kind, entry.index);
            let invalid = |problem: String| {
                PackError::invalid(&path, format!("table row {row} ({id})"), problem)
            };
            let stored_end = entry.offset.checked_add(entry.stored_length);
            if entry.offset != end.next_multiple_of(ALIGNMENT)
                || stored_end.is_none_or(|e| e > header.table_offset)
            {
                return Err(invalid(format!(
                    "offset {} with {} bytes; it must start at {} and end by {}",
                    entry.offset,
                    entry.stored_length,
                    end.next_multiple_of(ALIGNMENT),
                    header.table_offset
                )));
            }
            check_padding(&path, bytes, end, entry.offset)?;
            end = entry.offset + entry.stored_length;
            if entry.reserved != [0; 8] {
                return Err(invalid(format!("reserved bytes are {:?}, not 0", entry.reserved)));
            }
            let Some(codec) = Codec::from_code(entry.codec) else {
                let stored = &bytes[entry.offset as usize..end as usize];
                if section_hash(stored) != entry.hash {
                    return Err(invalid("its hash does not match: damaged".into()));
                }
                unknown.push(id);
                continue;
            };
            if codec == Codec::None && entry.length != entry.stored_length {
                let (l, s) = (entry.length, entry.stored_length);
                return Err(invalid(format!("{l} bytes stored uncompressed in {s}")));
            }
            let section = Section {
                codec,
                offset: entry.offset,
                stored_length: entry.stored_length,
                length: entry.length,
                hash: entry.hash,
            };
            if sections.insert(id, section).is_some() {
                return Err(invalid("the section stands twice in the table".into()));
            }
        }
        if header.table_offset != end.next_multiple_of(ALIGNMENT) {
            let (t, want) = (header.table_offset, end.next_multiple_of(ALIGNMENT));
            return Err(PackError::invalid(
                &path,
                "header",
                format!("table at {t}, not at {want}"),
            ));
        }
        check_padding(&path, bytes, end, header.table_offset)?;
        Ok(Self { path, data, sections, unknown })
    }
}

fn check_header(path: &Path, bytes: &[u8]) -> Result<FileHeader, PackError> {
    let invalid = |problem: String| PackError::invalid(path, "header", problem);
    let size = size_of::<FileHeader>();
    let magic = &bytes[..bytes.len().min(MAGIC.len())];
    if !MAGIC.starts_with(magic) {
        return Err(invalid(format!("starts with {magic:02x?}: not an fpack")));
    }
    if bytes.len() < size {
        return Err(invalid(format!("{} bytes; a pack has at least {size}", bytes.len())));
    }
    let header: FileHeader = bytemuck::pod_read_unaligned(&bytes[..size]);
    if header.version != VERSION {
        let problem = format!("version {}; this build reads version {VERSION}", header.version);
        return Err(PackError::unsupported(path, "header", problem));
    }
    if header.file_length != bytes.len() as u64 {
        let problem = format!("says {} bytes, the file has {}", header.file_length, bytes.len());
        return Err(invalid(problem));
    }
    if header.sections > MAX_SECTIONS {
        return Err(invalid(format!("{} sections; the limit is {MAX_SECTIONS}", header.sections)));
    }
    Ok(header)
}

fn check_table(
    path: &Path,
    bytes: &[u8],
    header: &FileHeader,
) -> Result<Vec<TableEntry>, PackError> {
    let invalid = |problem: String| PackError::invalid(path, "table", problem);
    let size = u64::from(header.sections) * size_of::<TableEntry>() as u64;
    if header.table_offset < size_of::<FileHeader>() as u64
        || header.table_offset.checked_add(size) != Some(header.file_length)
    {
        let problem = format!(
            "at offset {} with {size} bytes; it must end the file of {} bytes",
            header.table_offset, header.file_length
        );
        return Err(invalid(problem));
    }
    let table = &bytes[header.table_offset as usize..];
    if table_hash(header, table) != header.hash {
        return Err(invalid("its hash does not match: damaged".into()));
    }
    Ok(bytemuck::allocation::pod_collect_to_vec(table))
}

fn check_padding(path: &Path, bytes: &[u8], from: u64, to: u64) -> Result<(), PackError> {
    match bytes[from as usize..to as usize].iter().position(|&b| b != 0) {
        None => Ok(()),
        Some(i) => {
            let problem = format!("byte {} between sections is not 0", from + i as u64);
            Err(PackError::invalid(path, "padding", problem))
        }
    }
}

#[cfg(test)]
mod tests;
