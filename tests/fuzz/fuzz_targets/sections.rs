//! Any bytes as one section of a sound pack: the first byte says which.
#![no_main]

use std::sync::LazyLock;

static GOLDEN: LazyLock<Vec<u8>> = LazyLock::new(|| {
    std::fs::read(forest_tests::golden::richest().path()).expect("a golden pack")
});

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    if let Some((&which, data)) = bytes.split_first()
        && let Some(pack) = forest_tests::with_section(&GOLDEN, which, data)
    {
        let _ = forest_tests::use_pack(&pack);
    }
});
