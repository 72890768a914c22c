//! Any bytes as a scene, or as the trees of one.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| forest_tests::fuzz::scenes(bytes));
