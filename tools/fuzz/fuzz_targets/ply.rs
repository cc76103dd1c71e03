//! PLY as a cloud, by its name.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| outcrop_fuzz::cloud::read("ply", bytes));
