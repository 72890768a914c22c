use crate::support::repo;
use forest_tests::{golden, use_pack, with_section};

fn corpus(target: &str) -> Vec<(String, Vec<u8>)> {
    let folder = repo("tests/fuzz/corpus").join(target);
    let mut files: Vec<_> = std::fs::read_dir(&folder)
        .unwrap_or_else(|e| panic!("{}: {e}", folder.display()))
        .map(|e| e.unwrap().path())
        .collect();
    files.sort();
    assert!(!files.is_empty(), "{} is empty", folder.display());
    files.into_iter().map(|p| (p.display().to_string(), std::fs::read(&p).unwrap())).collect()
}

#[test]
fn container_corpus_ends_in_a_value_or_an_error() {
    for (_, bytes) in corpus("container") {
        let _ = use_pack(&bytes);
    }
}

#[test]
fn sections_corpus_ends_in_a_value_or_an_error() {
    let golden = std::fs::read(golden::richest().path()).unwrap();
    for (name, bytes) in corpus("sections") {
        let Some((&which, data)) = bytes.split_first() else { panic!("{name} is empty") };
        if let Some(pack) = with_section(&golden, which, data) {
            let _ = use_pack(&pack);
        }
    }
}

/// What fuzzing would find first: every section of a golden pack with each of its 4-byte words
/// replaced by extremes, hashes made good.
#[test]
fn extreme_words_in_any_section_never_panic() {
    // The points, many and alike, are sampled.
    for golden in golden::all() {
        extreme_words(&std::fs::read(golden.path()).unwrap());
    }
}

fn extreme_words(golden: &[u8]) {
    let pack = forest_tests::open(golden).unwrap();
    let sections: Vec<Vec<u8>> =
        pack.sections().map(|(id, _)| pack.bytes(id, 1 << 20).unwrap().into_owned()).collect();
    let mut refused = 0;
    for (which, original) in sections.iter().enumerate() {
        let step = 4 * original.len().div_ceil(4 * 150).max(1);
        for at in (0..original.len().saturating_sub(3)).step_by(step) {
            for word in [0u32, 1, 0x7fff_ffff, 0x8000_0000, 0xffff_ffff, 0x7f80_0000] {
                let mut data = original.clone();
                data[at..at + 4].copy_from_slice(&word.to_le_bytes());
                let forged = with_section(golden, which as u8, &data).unwrap();
                refused += usize::from(use_pack(&forged).is_err());
            }
        }
    }
    assert!(refused > 100, "{refused}");
}
