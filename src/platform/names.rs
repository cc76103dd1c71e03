//! Paths as bytes and for a shell, and the paths of programs.

use crate::system;
use std::ffi::OsString;
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A path as bytes, whatever characters it has.
#[must_use]
pub fn path_bytes(path: &Path) -> Vec<u8> {
    system::path_bytes(path)
}

/// The path of which [`path_bytes`] made these bytes.
#[must_use]
pub fn path_of_bytes(bytes: Vec<u8>) -> PathBuf {
    system::path_of_bytes(bytes)
}

/// The path of something that exists, whole and without links: for comparing, and fit to be shown.
///
/// # Errors
/// Errors of the system.
pub fn canonical(path: &Path) -> io::Result<PathBuf> {
    system::canonical(path)
}

/// Why no file can have a name here; none if one can.
#[must_use]
pub fn no_name(name: &str) -> Option<&'static str> {
    system::no_name(name)
}

/// The arguments of the program, with names of files in place of wildcards.
#[must_use]
pub fn arguments() -> Vec<OsString> {
    system::arguments()
}

/// A path from which the program that runs can be read.
///
/// # Errors
/// Errors of the system.
pub fn program() -> io::Result<PathBuf> {
    system::program()
}

/// A path as the user's shell takes it, in quotes if it needs them.
#[must_use]
pub fn quoted(path: &Path) -> String {
    system::quoted(&path.display().to_string())
}

/// The command that opens an address in the user's browser; none where no browser could be seen.
#[must_use]
pub fn browser(url: &str) -> Option<Command> {
    system::browser(url)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_what_their_bytes_say() {
        for path in ["", "a/b c/d", "ä/Ω/漢字/🦀"] {
            let bytes = path_bytes(Path::new(path));
            assert_eq!(path_of_bytes(bytes), Path::new(path));
        }
    }

    #[test]
    fn the_program_can_be_read() {
        let path = program().unwrap();
        assert!(std::fs::metadata(path).unwrap().len() > 1000);
    }
}
