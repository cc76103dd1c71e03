//! Text of every separator, quote, header, count and name, against a plain reading of it.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| outcrop_fuzz::dialect::read(bytes));
