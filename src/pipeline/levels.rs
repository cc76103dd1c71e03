//! Levels of detail as the output of a run. A build without them refuses such an output, so that nothing else is
//! asked of it.

#[cfg(not(feature = "levels"))]
pub use absent::{check_folder, make, outlook, remove_unfinished};
#[cfg(feature = "levels")]
pub use made::make;
#[cfg(feature = "levels")]
pub use outcrop_levels::{check_folder, outlook::of_points as outlook, remove_unfinished};

use crate::features::LEVELS;
use outcrop_disk::error::{Error, Result};
use std::path::{Path, PathBuf};

/// The name of the file that is asked for.
const NAME: &str = "tileset.json";

/// The folder of the tileset, if the output is one.
pub fn folder(output: &Path, split: bool) -> Result<Option<PathBuf>> {
    if output.file_name().is_none_or(|name| name != NAME) {
        return Ok(None);
    }
    LEVELS.require()?;
    let refuse = |found: String, expected: &str| {
        Err(Error::Parameter {
            name: "output",
            found,
            expected: expected.into(),
        })
    };
    let folder = output
        .parent()
        .filter(|folder| folder.file_name().is_some());
    match folder {
        _ if split => refuse("a tileset of a mesh in squares".into(), "one of both"),
        Some(folder) => Ok(Some(folder.to_path_buf())),
        None => refuse(
            output.display().to_string(),
            "DIR/tileset.json, with the name of a folder",
        ),
    }
}

#[cfg(feature = "levels")]
mod made {
    use outcrop_disk::error::Result;
    use outcrop_disk::workspace::Workspace;
    use outcrop_levels::{Options, TilesReport, tileset};
    use std::path::Path;

    /// Makes the tileset `folder` of a mesh, which is called `source` in it.
    pub fn make(
        mesh: &Path,
        source: &str,
        folder: &Path,
        workspace: &Workspace,
    ) -> Result<TilesReport> {
        tileset(mesh, source, folder, &Options::default(), workspace)
    }
}

#[cfg(not(feature = "levels"))]
mod absent {
    use crate::features::LEVELS;
    use crate::report::TilesReport;
    use outcrop_disk::error::Result;
    use outcrop_disk::workspace::Workspace;
    use outcrop_disk::workspace::outlook::Planned;
    use std::path::Path;

    pub fn check_folder(_: &Path) -> Result<()> {
        Err(LEVELS.missing())
    }

    pub fn make(_: &Path, _: &str, _: &Path, _: &Workspace) -> Result<TilesReport> {
        Err(LEVELS.missing())
    }

    pub fn outlook(_: u64, _: usize) -> Vec<Planned> {
        Vec::new()
    }

    pub fn remove_unfinished(_: &Path) {}
}
