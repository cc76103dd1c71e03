//! Text with a point a line, and whatever content makes of a file without a telling name.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| outcrop_fuzz::cloud::read("txt", bytes));
