//! A mesh in another format than PLY, as `verify` reads it.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| outcrop_fuzz::foreign::read(bytes));
