//! Any bytes as one section of a sound pack.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| forest_tests::fuzz::sections(bytes));
