//! Regions as text: numbers, WKT, GeoJSON.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| outcrop_fuzz::region::read(bytes));
