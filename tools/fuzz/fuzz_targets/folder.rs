//! A folder of several files of all formats, read as one cloud.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| outcrop_fuzz::folder::read(bytes));
