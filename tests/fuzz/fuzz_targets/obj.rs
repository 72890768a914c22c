//! Any bytes as OBJ and MTL.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| forest_tests::fuzz::obj(bytes));
