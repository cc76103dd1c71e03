//! A closed mesh as the output of a run. A build that makes none refuses it, so that nothing else is asked of it.

#[cfg(not(feature = "levels"))]
pub use absent::make;
#[cfg(feature = "levels")]
pub use made::make;

use crate::features::LEVELS;
use outcrop_disk::error::{Error, Result};
use outcrop_mesh_files::export::is_compressed;
use std::path::Path;

/// Refuses what cannot be closed.
pub fn check(closed: Option<&Path>, tiles: bool) -> Result<()> {
    let Some(output) = closed else {
        return Ok(());
    };
    LEVELS.require()?;
    let refuse = |found: &str, expected: &str| {
        Err(Error::Parameter {
            name: "close",
            found: found.into(),
            expected: expected.into(),
        })
    };
    if tiles {
        return refuse(
            "a tileset",
            "a mesh; `outcrop tiles` makes levels of detail of it afterwards",
        );
    }
    match is_compressed(output) {
        true => refuse(
            "a name that ends with .zst",
            "a mesh that is not compressed",
        ),
        false => Ok(()),
    }
}

#[cfg(feature = "levels")]
mod made {
    use super::super::close::closed;
    use crate::params::Close;
    use crate::report::CloseReport;
    use outcrop_disk::error::Result;
    use outcrop_disk::workspace::Workspace;
    use std::path::Path;

    /// Closes a mesh and writes it to `output`.
    pub fn make(
        mesh: &Path,
        output: &Path,
        kind: Close,
        workspace: &Workspace,
    ) -> Result<CloseReport> {
        closed(mesh, output, kind.into(), workspace)
    }
}

#[cfg(not(feature = "levels"))]
mod absent {
    use crate::features::LEVELS;
    use crate::params::Close;
    use crate::report::CloseReport;
    use outcrop_disk::error::Result;
    use outcrop_disk::workspace::Workspace;
    use std::path::Path;

    pub fn make(_: &Path, _: &Path, _: Close, _: &Workspace) -> Result<CloseReport> {
        Err(LEVELS.missing())
    }
}
