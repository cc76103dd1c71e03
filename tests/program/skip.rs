//! How a test says that it is skipped: the only way, which `tests/house/architecture.rs` holds. `.ci/run` lists these lines.

use std::fmt::Display;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Says that the test at work, or a part of it, is skipped, and why. What `println!` and `eprintln!` say in a test that
/// passes is thrown away; what is written to the stream itself is not.
pub fn skip(why: impl Display) {
    let test = std::thread::current();
    let line = format!("skipped: {}: {why}\n", test.name().unwrap_or("a test"));
    std::io::stderr()
        .write_all(line.as_bytes())
        .expect("standard error");
}

/// A file or folder that is no part of the repository; if it is absent, the test is skipped.
pub fn if_present(path: impl AsRef<Path>) -> Option<PathBuf> {
    let path = path.as_ref();
    if !path.exists() {
        skip(format_args!("{} is absent", path.display()));
        return None;
    }
    Some(path.to_path_buf())
}
