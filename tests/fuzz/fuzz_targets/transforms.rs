//! Any bytes as the cameras of photographs.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| forest_tests::fuzz::transforms(bytes));
