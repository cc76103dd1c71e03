//! A mesh, as `verify` and `compare` read it.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| outcrop_fuzz::mesh::read(bytes));
