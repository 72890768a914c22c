//! Any bytes as the picture of a material.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| forest_tests::fuzz::images(bytes));
