use crate::support::repo;
use forest_tests::fuzz::TARGETS;
use forest_tests::{golden, use_pack, with_section};

/// Crashes that fuzzing found are part of the corpus.
#[test]
fn the_corpus_ends_in_values_or_errors() {
    for target in &TARGETS {
        let folder = repo("tests/fuzz/corpus").join(target.name);
        let entries =
            std::fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
        let mut files: Vec<_> = entries.map(|e| e.unwrap().path()).collect();
        files.sort();
        assert!(!files.is_empty(), "{} is empty", folder.display());
        for file in files {
            let bytes = std::fs::read(&file).unwrap();
            let ends = std::panic::catch_unwind(|| (target.run)(&bytes));
            assert!(ends.is_ok(), "{}", file.display());
        }
    }
}

/// What fuzzing would find first: every section of a golden pack with each of its 4-byte words
/// replaced by extremes, hashes made good.
#[test]
fn extreme_words_in_any_section_never_panic() {
    // Sections are sampled: fuzzing sees the rest of them.
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
        let step = 4 * original.len().div_ceil(4 * 60).max(1);
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
