//! A mesh that is made of the whole one, with fewer triangles or closed, as the output of a run. A build that makes
//! none refuses it, so that nothing else is asked of it.

#[cfg(not(feature = "levels"))]
pub use absent::{close, simplify};
#[cfg(feature = "levels")]
pub use present::{close, simplify};

use crate::features::LEVELS;
use crate::params::Params;
use outcrop_disk::error::{Error, Result};
use outcrop_mesh_files::export::{format_of, is_compressed};
use std::path::{Path, PathBuf};

/// The name of the option that asks for such a mesh, if one does.
pub const fn asked(params: &Params) -> Option<&'static str> {
    match (params.triangles, params.close) {
        (Some(_), _) => Some("triangles"),
        (None, Some(_)) => Some("close"),
        (None, None) => None,
    }
}

/// The output, if it is such a mesh. What cannot be one is refused.
pub fn output(output: &Path, params: &Params, tiles: bool) -> Result<Option<PathBuf>> {
    let Some(name) = asked(params) else {
        return Ok(None);
    };
    LEVELS.require()?;
    let refuse = |found: &str, expected: &str| {
        Err(Error::Parameter {
            name,
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
    if is_compressed(output) {
        return refuse(
            "a name that ends with .zst",
            "a mesh that is not compressed",
        );
    }
    format_of(output)?;
    Ok(Some(output.to_path_buf()))
}

#[cfg(feature = "levels")]
mod present {
    use super::super::close::closed;
    use crate::params::Close;
    use crate::pipeline::Simplification;
    use crate::report::{CloseReport, SimplifyReport};
    use outcrop_disk::error::Result;
    use outcrop_disk::workspace::Workspace;
    use outcrop_levels::single::Goal;
    use std::path::Path;

    /// Closes a mesh and writes it to `output`.
    pub fn close(
        mesh: &Path,
        output: &Path,
        kind: Close,
        workspace: &Workspace,
    ) -> Result<CloseReport> {
        closed(mesh, output, kind.into(), workspace)
    }

    /// Writes a mesh with this number of triangles to `output`, closed if that says how.
    pub fn simplify(
        mesh: &Path,
        output: &Path,
        (triangles, close): (u64, Option<Close>),
        workspace: &Workspace,
    ) -> Result<SimplifyReport> {
        let goal = Goal::Triangles(triangles);
        Simplification::new(mesh, output, goal)
            .close(close)
            .make(workspace)
    }
}

#[cfg(not(feature = "levels"))]
mod absent {
    use crate::features::LEVELS;
    use crate::params::Close;
    use crate::report::{CloseReport, SimplifyReport};
    use outcrop_disk::error::Result;
    use outcrop_disk::workspace::Workspace;
    use std::path::Path;

    pub fn close(_: &Path, _: &Path, _: Close, _: &Workspace) -> Result<CloseReport> {
        Err(LEVELS.missing())
    }

    pub fn simplify(
        _: &Path,
        _: &Path,
        _: (u64, Option<Close>),
        _: &Workspace,
    ) -> Result<SimplifyReport> {
        Err(LEVELS.missing())
    }
}
