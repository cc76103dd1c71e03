//! Entwine Point Tiles: the description, a file of the hierarchy, and the file of a node.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| outcrop_fuzz::ept::read(bytes));
