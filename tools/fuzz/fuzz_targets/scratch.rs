//! Scratch files whose checksums are right and whose content is not.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| outcrop_fuzz::scratch::read(bytes));
