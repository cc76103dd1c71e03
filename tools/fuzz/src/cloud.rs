//! Input files of all formats.

use crate::{Bench, check_error};
use outcrop::Error;
use outcrop_formats::{ingest, probe};
use outcrop_points::Spool;

/// Reads a file of this extension, and streams its points on their lattice.
pub fn read(extension: &str, bytes: &[u8]) {
    let bench = Bench::get();
    let path = bench.write(&format!("cloud.{extension}"), bytes);
    let folder = path.parent().expect("the folder of a file").to_path_buf();
    if let Err(error) = probe(&path) {
        check_error(&error, &folder);
    }
    match ingest(&[path], &bench.workspace) {
        Ok(spool) => {
            check(&spool);
            spool.release(&bench.workspace).expect("a spool");
        }
        Err(error) => check_error(&error, &folder),
    }
    bench.check_memory();
}

/// Reads an E57 file after its length and its checksums were corrected, which damage rarely leaves right.
pub fn read_e57(bytes: &[u8]) {
    let mut bytes = bytes.to_vec();
    let length = (bytes.len() as u64).to_le_bytes();
    if let Some(stored) = bytes.get_mut(16..24) {
        stored.copy_from_slice(&length);
    }
    for page in bytes.chunks_exact_mut(1024) {
        let sum = crc32c::crc32c(&page[..1020]).to_be_bytes();
        page[1020..].copy_from_slice(&sum);
    }
    read("e57", &bytes);
}

/// Checks properties of every cloud.
pub fn check(spool: &Spool) {
    let workspace = &Bench::get().workspace;
    let stats = spool.stats();
    let left_out = stats.dropped_non_finite
        + stats.withheld
        + stats.invalid
        + stats.dropped_by_class
        + stats.dropped_by_crop;
    assert_eq!(stats.read, stats.kept + left_out);
    for warning in &stats.warnings {
        assert!(!warning.contains('\n'), "{warning:?} is more than one line");
    }
    let _ = spool.source_precision();
    for refine in [0, 10] {
        let lattice = match spool.choose_lattice(refine) {
            Ok(lattice) => lattice,
            Err(Error::Degenerate { .. }) => {
                assert_eq!(spool.points(), 0);
                return;
            }
            Err(other) => panic!("no lattice: {other:?}"),
        };
        assert!(
            lattice.step > 0.0 && lattice.step.is_finite(),
            "{lattice:?}"
        );
        let mut count = 0;
        let mut low = [i32::MAX; 3];
        let streamed = spool.for_each(workspace, &lattice, |points| {
            count += points.len() as u64;
            for point in points {
                low = std::array::from_fn(|axis| low[axis].min(point[axis]));
            }
            Ok(())
        });
        streamed.expect("points that were just written");
        assert_eq!(count, spool.points(), "{lattice:?}");
        // The lattice of a part is that of the whole, which may begin lower.
        let whole = stats.dropped_by_crop + stats.skipped_by_crop == 0;
        assert!(low == [0; 3] || !whole && low.iter().all(|c| *c >= 0));
    }
}
