//! The program that takes part in a run: all processes of a run must have the very same.

use outcrop_disk::error::{Error, Result};
use std::io::Read;
use std::path::PathBuf;
use std::sync::OnceLock;

/// The file with this code, if it is not the program that was started.
static PART: OnceLock<PathBuf> = OnceLock::new();

/// Names the file with this code, if it is not the program that was started, as in an extension of another one:
/// all processes that share a run must have the very same. The first call counts.
pub fn part_of(file: PathBuf) {
    let _ = PART.set(file);
}

/// Checksum of this program, with its version.
pub(super) fn program() -> Result<u32> {
    let path = match PART.get() {
        Some(file) => file.clone(),
        None => outcrop_platform::program().map_err(|e| Error::io("outcrop", "find", e))?,
    };
    let io = |e| Error::io(&path, "read", e);
    let mut file = std::fs::File::open(&path).map_err(io)?;
    let mut crc = crc32fast::Hasher::new();
    let mut buffer = vec![0; 1 << 20];
    loop {
        match file.read(&mut buffer).map_err(io)? {
            0 => break,
            n => crc.update(&buffer[..n]),
        }
    }
    crc.update(env!("CARGO_PKG_VERSION").as_bytes());
    Ok(crc.finalize())
}
