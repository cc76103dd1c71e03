//! No target: writes the initial files of all targets into the folder `SEEDS`, and ends. It is built like the
//! targets, since these link with libFuzzer only.
#![no_main]
#![allow(unreachable_code, reason = "the program ends before there is an input")]

libfuzzer_sys::fuzz_target!(
    init: {
        let folder = std::env::var_os("SEEDS").expect("the folder SEEDS");
        outcrop_fuzz::seeds::write(folder.as_ref()).expect("seeds");
        std::process::exit(0);
    },
    |_bytes: &[u8]| {}
);
