//! Any bytes as glTF.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| forest_tests::fuzz::gltf(bytes));
