//! Scratch files with valid checksums and invalid content.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| outcrop_fuzz::scratch::read(bytes));
