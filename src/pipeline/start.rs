//! The place of scratch files, and the treatment of an unfinished run.

use super::away::{below, is_store};
use crate::deliver::{SCRATCH, scratch_name, scratch_of};
use outcrop_mesh_files::export;
use std::path::{Path, PathBuf};

/// Treatment of an unfinished run in the scratch folder.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Start {
    /// An unfinished run is an error.
    #[default]
    New,
    /// Resume it; begin a new run if there is none.
    Resume,
    /// Discard it and begin a new run.
    Restart,
}

/// The scratch folder of a run with this output: beside it, or in the folder `parent`.
pub(super) fn scratch_folder(output: &Path, parent: Option<&Path>) -> PathBuf {
    if let Some(folder) = scratch_of(output, parent) {
        return folder;
    }
    let mut name = output.file_name().unwrap_or_default().to_os_string();
    let beside = export::folder_of(output);
    let Some(parent) = parent.filter(|parent| *parent != beside) else {
        name.push(SCRATCH);
        return beside.join(name);
    };
    // Outputs of the same name in several folders may share one folder for scratch.
    let whole = std::path::absolute(output).unwrap_or_else(|_| output.to_path_buf());
    let name = scratch_name(&name, &whole);
    match is_store(parent) {
        true => below(parent, &name),
        false => parent.join(name),
    }
}
