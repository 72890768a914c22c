use super::*;
use crate::{PackWriter, kind};
use proptest::prelude::*;

const A: SectionId = SectionId::new(kind::META, 0);
const B: SectionId = SectionId::new(kind::POINTS, 3);

fn small() -> Vec<u8> {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("p.fpack");
    let mut w = PackWriter::create(&path).unwrap();
    w.add(A, Codec::Zstd, &[7; 300]).unwrap();
    w.add(B, Codec::None, &[1, 2, 3, 4, 5, 6, 7, 8]).unwrap();
    w.finish().unwrap();
    std::fs::read(path).unwrap()
}

fn open(bytes: &[u8]) -> Result<Pack, PackError> {
    let pack = Pack::from_bytes(Path::new("p.fpack"), bytes)?;
    pack.verify()?;
    Ok(pack)
}

#[test]
fn sections_come_back_as_they_went_in() {
    let pack = open(&small()).unwrap();
    assert_eq!(&*pack.bytes(A, 1000).unwrap(), &[7; 300]);
    assert_eq!(pack.records::<u32>(B).unwrap(), &[0x0403_0201, 0x0807_0605]);
    let e = pack.bytes(A, 299).unwrap_err().to_string();
    assert!(e.contains("meta[0]") && e.contains("300 bytes") && e.contains("limit is 299"), "{e}");
    assert!(pack.records::<[u8; 3]>(B).unwrap_err().to_string().contains("8 bytes"));
    assert!(pack.bytes(SectionId::new(9, 9), 9).unwrap_err().to_string().contains("kind-9[9]"));
}

#[test]
fn every_prefix_and_every_trailing_byte_is_refused() {
    let bytes = small();
    for n in 0..bytes.len() {
        assert!(open(&bytes[..n]).is_err(), "prefix of {n} bytes");
    }
    let longer: Vec<u8> = bytes.iter().copied().chain([0]).collect();
    assert!(open(&longer).is_err());
}

#[test]
fn every_flipped_bit_is_refused() {
    let mut bytes = small();
    for i in 0..bytes.len() {
        for bit in 0..8 {
            bytes[i] ^= 1 << bit;
            assert!(open(&bytes).is_err(), "bit {bit} of byte {i}");
            bytes[i] ^= 1 << bit;
        }
    }
}

/// Rewrites header and table as a forger would: with a valid hash.
fn forge(change: impl FnOnce(&mut FileHeader, &mut [TableEntry])) -> Vec<u8> {
    let mut bytes = small();
    let mut header: FileHeader = bytemuck::pod_read_unaligned(&bytes[..64]);
    let at = header.table_offset as usize;
    let mut table: Vec<TableEntry> = bytemuck::allocation::pod_collect_to_vec(&bytes[at..]);
    change(&mut header, &mut table);
    let table: &[u8] = bytemuck::cast_slice(&table);
    header.hash = table_hash(&header, table);
    bytes[at..].copy_from_slice(table);
    bytes[..64].copy_from_slice(bytemuck::bytes_of(&header));
    bytes
}

#[test]
fn forged_tables_are_refused_with_the_rule_they_break() {
    let refused = |change: fn(&mut FileHeader, &mut [TableEntry]), want: &str| {
        let e = open(&forge(change)).unwrap_err().to_string();
        assert!(e.contains(want), "{e}");
    };
    refused(|h, _| h.version = 2, "version 2; this build reads version 1");
    refused(|h, _| h.sections = u32::MAX, "4294967295 sections");
    refused(|h, _| h.table_offset = u64::MAX - 8, "must end the file");
    refused(|_, t| t[1].offset = 64, "offset 64");
    refused(|_, t| t[1].offset = u64::MAX, "offset 18446744073709551615");
    refused(|_, t| t[1].stored_length = u64::MAX, "18446744073709551615 bytes");
    refused(|_, t| t[1].length = 9, "9 bytes stored uncompressed in 8");
    refused(|_, t| (t[1].kind, t[1].index) = (t[0].kind, t[0].index), "stands twice");
    refused(|_, t| t[0].length = 1 << 40, "limit is 4294967296");
    refused(|_, t| t[0].length = 299, "decodes to 300 bytes; the table says 299");
    refused(|_, t| (t[1].codec, t[1].length) = (1, 8), "zstd");
    refused(|_, t| t[0].length = 301, "decodes to 300 bytes");
}

#[test]
fn sections_of_unknown_kind_or_codec_are_skipped() {
    let pack = open(&forge(|_, t| t[1].kind = 999)).unwrap();
    assert!(pack.contains(SectionId::new(999, 3)));
    let pack = open(&forge(|_, t| t[1].codec = 77)).unwrap();
    assert_eq!(pack.unknown_sections(), &[B]);
    assert!(!pack.contains(B));
}

#[test]
fn a_writer_that_is_dropped_leaves_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("p.fpack");
    let mut w = PackWriter::create(&path).unwrap();
    w.add(A, Codec::None, &[1]).unwrap();
    assert!(w.add(A, Codec::None, &[2]).unwrap_err().to_string().contains("already written"));
    drop(w);
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0);
}

proptest! {
    #[test]
    fn random_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        prop_assert!(open(&bytes).is_err());
    }

    #[test]
    fn forged_rows_never_panic(
        offset: u64, stored_length: u64, length: u64, codec in 0u16..4, row in 0usize..2,
    ) {
        let _ = open(&forge(|_, t| {
            t[row] = TableEntry { offset, stored_length, length, codec, ..t[row] };
        }));
    }
}
