//! Several files as one cloud.

use crate::{Bench, check_error, cloud};
use outcrop::inspect::info::info;
use outcrop::{Classes, Error, Params, Region};
use outcrop_formats::{expand, ingest_selected, probe};

/// Separator between two files.
pub const BETWEEN: &[u8] = b"\n=====\n";

/// The extensions of files, selected by their first byte.
pub const EXTENSIONS: [&str; 13] = [
    "las", "laz", "ply", "xyz", "txt", "csv", "pts", "asc", "bin", "dat", "e57", "pcd", "ptx",
];

/// Largest number of points for which [`info`] is called.
const FEW: u64 = 2000;

/// Reads the files in `bytes`: the first byte of each selects its extension.
pub fn read(bytes: &[u8]) {
    let bench = Bench::get();
    let folder = bench.path("folder");
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir(&folder).expect("a folder for files");
    for (number, file) in split(bytes).into_iter().take(8).enumerate() {
        let Some((kind, content)) = file.split_first() else {
            continue;
        };
        let extension = EXTENSIONS[usize::from(*kind) % EXTENSIONS.len()];
        bench.write(&format!("folder/{number}.{extension}"), content);
    }
    let classes = match bytes.len() % 3 {
        0 => Classes::Drop([7, 18].into()),
        _ => Classes::All,
    };
    // Regions in the middle of seeds, and of all numbers.
    let crop = match bytes.len() % 4 {
        0 => "0,0,1,1".parse::<Region>().ok(),
        1 => "-1e6,-1e6,-1e3,5,1e6,1e3".parse().ok(),
        2 => "POLYGON((0 0, 9 1, 5 1e6, 3 2))".parse().ok(),
        _ => None,
    };
    let params = Params {
        classes,
        crop,
        ..Params::default()
    };
    match expand(std::slice::from_ref(&folder)) {
        Ok(files) => files.iter().for_each(|file| {
            if let Err(error) = probe(file) {
                check_error(&error, &folder);
            }
        }),
        Err(error) => check_error(&error, &folder),
    }
    let inputs = [folder.clone()];
    match ingest_selected(&inputs, &params.selection(), &bench.workspace) {
        Ok(spool) => {
            cloud::check(&spool);
            let few = (1..FEW).contains(&spool.points());
            spool.release(&bench.workspace).expect("a spool");
            if few {
                info(&inputs, &params, &bench.workspace).expect("a cloud that was read once");
            }
        }
        Err(Error::Outside { .. }) => {}
        Err(error) => check_error(&error, &folder),
    }
    bench.check_memory();
}

/// The parts between separators.
pub(crate) fn split(bytes: &[u8]) -> Vec<&[u8]> {
    let mut files = Vec::new();
    let mut rest = bytes;
    while let Some(at) = rest.windows(BETWEEN.len()).position(|w| w == BETWEEN) {
        files.push(&rest[..at]);
        rest = &rest[at + BETWEEN.len()..];
    }
    files.push(rest);
    files
}
