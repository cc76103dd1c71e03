//! Levels of detail as the output of a run. A build without them refuses such an output, so that nothing else is
//! asked of it.

#[cfg(not(feature = "levels"))]
pub use absent::{check_folder, make, outlook, remove_unfinished};
#[cfg(feature = "levels")]
pub use made::make;
#[cfg(feature = "levels")]
pub use outcrop_levels::{check_folder, outlook, remove_unfinished};

use crate::deliver::TREE;
use crate::features::LEVELS;
use crate::params::Params;
use outcrop_disk::error::{Error, Result};
use std::path::{Path, PathBuf};

/// The folder of the tileset, if the output is one.
pub fn folder(output: &Path, params: &Params) -> Result<Option<PathBuf>> {
    let refuse = |name, found: String, expected: &str| {
        Err(Error::Parameter {
            name,
            found,
            expected: expected.into(),
        })
    };
    match output.file_name().is_some_and(|name| name == TREE) {
        true => LEVELS.require()?,
        false if params.lossy => {
            let expected = "DIR/tileset.json, for only tilesets are rounded";
            return refuse("lossy", output.display().to_string(), expected);
        }
        false => return Ok(None),
    }
    let folder = output
        .parent()
        .filter(|folder| folder.file_name().is_some());
    match folder {
        _ if params.split.is_some() => refuse(
            "output",
            "a tileset of a mesh in squares".into(),
            "one of both",
        ),
        Some(folder) => Ok(Some(folder.to_path_buf())),
        None => refuse(
            "output",
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

    /// Makes the tileset `folder` of a mesh, which is called `source` in it; rounded if it is `lossy`.
    pub fn make(
        mesh: &Path,
        source: &str,
        folder: &Path,
        lossy: bool,
        workspace: &Workspace,
    ) -> Result<TilesReport> {
        let options = Options {
            lossy,
            ..Options::default()
        };
        tileset(mesh, source, folder, &options, workspace)
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

    pub fn make(_: &Path, _: &str, _: &Path, _: bool, _: &Workspace) -> Result<TilesReport> {
        Err(LEVELS.missing())
    }

    pub mod outlook {
        use super::Planned;

        pub fn of_points(_: u64, _: usize) -> Vec<Planned> {
            Vec::new()
        }

        pub fn of_simplified(_: u64, _: usize) -> Vec<Planned> {
            Vec::new()
        }

        pub fn of_closed(_: u64, _: usize) -> Vec<Planned> {
            Vec::new()
        }
    }

    pub fn remove_unfinished(_: &Path) {}
}
