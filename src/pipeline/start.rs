//! Where a run keeps its scratch files, and what to do about a run that is there already.

use crate::stages::export;
use std::path::{Path, PathBuf};

/// What to do about an unfinished run in the scratch folder.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Start {
    /// Refuse to begin another one.
    #[default]
    New,
    /// Go on with it; begin if there is none.
    Resume,
    /// Throw it away and begin.
    Restart,
}

/// The scratch folder of a run with this output: beside it, or in another folder.
pub(super) fn scratch_folder(output: &Path, parent: Option<&Path>) -> PathBuf {
    let mut name = output.file_name().unwrap_or_default().to_os_string();
    let beside = export::folder_of(output);
    let Some(parent) = parent.filter(|parent| *parent != beside) else {
        name.push(".outcrop-scratch");
        return beside.join(name);
    };
    // Runs with outputs of one name in several folders may share a folder for scratch.
    let whole = std::path::absolute(output).unwrap_or_else(|_| output.to_path_buf());
    let bytes = std::os::unix::ffi::OsStrExt::as_bytes(whole.as_os_str());
    name.push(format!("-{:08x}.outcrop-scratch", crc32fast::hash(bytes)));
    parent.join(name)
}
