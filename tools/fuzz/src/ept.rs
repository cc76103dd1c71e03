//! A set of Entwine Point Tiles.

use crate::folder::{BETWEEN, split};
use crate::{Bench, check_error, cloud};
use outcrop::{Error, Params};
use outcrop_formats::{ingest_selected, probe};

/// The extensions of the file of a node.
pub const DATA: [&str; 3] = ["laz", "bin", "zst"];

/// Reads a set: its description, the root of its hierarchy, and the root's points, which are there in each type.
pub fn read(bytes: &[u8]) {
    let bench = Bench::get();
    let folder = bench.path("ept");
    let _ = std::fs::remove_dir_all(&folder);
    for part in ["ept-data", "ept-hierarchy"] {
        std::fs::create_dir_all(folder.join(part)).expect("a folder for files");
    }
    let parts = split(bytes);
    let part = |number: usize| parts.get(number).copied().unwrap_or_default();
    bench.write("ept/ept.json", part(0));
    bench.write("ept/ept-hierarchy/0-0-0-0.json", part(1));
    for kind in DATA {
        bench.write(&format!("ept/ept-data/0-0-0-0.{kind}"), part(2));
    }
    let ept = folder.join("ept.json");
    let checked = |error: &Error| match error {
        // A node whose file is not there.
        Error::Io { source, .. } if source.kind() == std::io::ErrorKind::NotFound => {}
        Error::Io { source, .. } if source.kind() == std::io::ErrorKind::InvalidData => {}
        // The file at fault may be any of the set.
        error => check_error(error, &folder),
    };
    if let Err(error) = probe(&ept) {
        checked(&error);
    }
    let crop = match bytes.len() % 2 {
        0 => "0,0,1,1".parse().ok(),
        _ => None,
    };
    let params = Params {
        crop,
        ..Params::default()
    };
    match ingest_selected(
        std::slice::from_ref(&ept),
        &params.selection(),
        &bench.workspace,
    ) {
        Ok(spool) => {
            cloud::check(&spool);
            spool.release(&bench.workspace).expect("a spool");
        }
        Err(Error::Outside { .. }) => {}
        Err(error) => checked(&error),
    }
    bench.check_memory();
}

/// A set as one input of the target.
#[must_use]
pub fn joined(parts: [&[u8]; 3]) -> Vec<u8> {
    parts.join(BETWEEN)
}
