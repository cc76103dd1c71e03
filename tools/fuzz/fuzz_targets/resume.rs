//! A run that goes on with scratch files that were damaged.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| outcrop_fuzz::resume::go_on(bytes));
