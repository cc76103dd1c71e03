//! Names of meshes: in the journal, beside each other, and while they are written.

use std::path::{Path, PathBuf};

/// The name of a file without the extension of its compression.
#[must_use]
pub fn plain_name(path: &Path) -> PathBuf {
    let extension = path.extension().unwrap_or_default();
    match ["gz", "zst", "zip"]
        .iter()
        .any(|e| extension.eq_ignore_ascii_case(e))
    {
        true => path.with_extension(""),
        false => path.to_path_buf(),
    }
}

/// The name of the mesh file in the journal; it is not in the scratch folder.
pub const OUTPUT: &str = "output";

/// The name in the journal of the mesh of a square, of several that a run writes; `square` is part of the name of
/// its file too.
#[must_use]
pub fn output_of(square: &str) -> String {
    format!("{OUTPUT}:{square}")
}

/// The path of the mesh of a square, beside `output`: its name is added before the extension.
#[must_use]
pub fn square_path(output: &Path, square: &str) -> PathBuf {
    let plain = plain_name(output);
    let mut name = plain.file_stem().unwrap_or_default().to_os_string();
    name.push(format!("_{square}"));
    let compressed = output.extension().filter(|_| plain != output);
    for extension in plain.extension().into_iter().chain(compressed) {
        name.push(".");
        name.push(extension);
    }
    output.with_file_name(name)
}

/// The temporary name of a mesh, in the same folder as the final one.
#[must_use]
pub fn temporary(output: &Path) -> PathBuf {
    let mut name = std::ffi::OsString::from(".");
    name.push(output.file_name().unwrap_or_default());
    name.push(".outcrop-part");
    output.with_file_name(name)
}
