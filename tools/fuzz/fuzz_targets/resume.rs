//! A run that is resumed from damaged scratch files.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| outcrop_fuzz::resume::go_on(bytes));
