//! Meshes that are only a step on the way to the output: hidden files beside it.

use std::path::{Path, PathBuf};

/// The mesh from which a tileset, a smaller mesh or a closed one is made.
pub(super) fn mesh_of(target: &Path) -> PathBuf {
    hidden(target, "mesh")
}

/// The smaller mesh that is not closed yet.
pub(super) fn open_of(target: &Path) -> PathBuf {
    hidden(target, "open")
}

/// A hidden mesh beside a file or folder.
fn hidden(target: &Path, what: &str) -> PathBuf {
    let mut name = std::ffi::OsString::from(".");
    name.push(target.file_name().unwrap_or_default());
    name.push(format!(".outcrop-{what}.ply"));
    target.with_file_name(name)
}
