//! A short measurement of the scratch disk.

use outcrop_platform::is_local;
use std::io::Write;
use std::path::Path;
use std::time::Instant;

/// Scratch bytes below which nothing is measured: so much stays in the system's cache for a while, and the
/// run does not wait for the disk.
const FEW: u64 = 1 << 30;

/// Bytes written to measure: enough that a disk's own cache and the time of one access matter little.
const SAMPLE: usize = 32 << 20;

/// Rows that one thread compresses in a second, in bytes, at level 1 (160 to 220 MB/s measured). Compression
/// halves them, so it pays where the disk takes less than half of what all threads compress.
const COMPRESSED: f64 = 160e6;

/// True if scratch files of this size in `folder` are written faster when `threads` compress them.
pub(super) fn compression_pays(folder: &Path, bytes: u64, threads: usize) -> bool {
    if !is_local(folder) {
        return true;
    }
    bytes >= FEW && speed(folder).is_ok_and(|disk| disk < COMPRESSED / 2.0 * threads as f64)
}

/// Bytes that the disk takes in a second.
fn speed(folder: &Path) -> std::io::Result<f64> {
    let mut file = tempfile::tempfile_in(folder)?;
    let mut random = oorandom::Rand32::new(0);
    let slab: Vec<u8> = (0..1 << 20).map(|_| random.rand_u32() as u8).collect();
    let start = Instant::now();
    for _ in 0..SAMPLE / slab.len() {
        file.write_all(&slab)?;
    }
    file.sync_data()?;
    Ok(SAMPLE as f64 / start.elapsed().as_secs_f64())
}
