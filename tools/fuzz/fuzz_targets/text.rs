//! Text with a point on each line, and any content in a file without a known extension.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| outcrop_fuzz::cloud::read("txt", bytes));
