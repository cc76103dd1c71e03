//! The comparison of two shapes, with the readers of clouds.

use outcrop_disk::error::Result;
use outcrop_disk::workspace::Workspace;
use outcrop_formats::ingest_selected;
use outcrop_geom::vector::V3;
use outcrop_inspect::compare;
#[cfg(feature = "pages")]
pub use outcrop_inspect::compare::Illustration;
pub use outcrop_inspect::compare::{Comparison, Distances, Figures, Kind, Measured, Options, Side};
use outcrop_stages::cloud::positions;
use std::path::Path;

/// Reads clouds of any format, for what compares surfaces.
pub(crate) fn clouds(
    path: &Path,
    keep: bool,
    workspace: &Workspace,
    each: &mut dyn FnMut(u64, &[V3]) -> Result<()>,
) -> Result<bool> {
    positions(path, ingest_selected, keep, workspace, each)
}

/// Distances between two shapes, each a mesh (PLY with faces) or a cloud (in any format that is read).
///
/// # Errors
/// See [`outcrop_inspect::compare::compare`].
pub fn compare(a: &Path, b: &Path, options: &Options, workspace: &Workspace) -> Result<Comparison> {
    compare::compare([a, b], options, clouds, workspace)
}

/// As [`compare()`], with pictures and distributions for [`crate::page::comparison`].
///
/// # Errors
/// See [`compare()`].
#[cfg(feature = "pages")]
pub fn illustrated(
    a: &Path,
    b: &Path,
    options: &Options,
    workspace: &Workspace,
) -> Result<(Comparison, Illustration)> {
    compare::illustrated([a, b], options, clouds, workspace)
}

/// Distances of all distinct points of a cloud to a mesh or cloud, in order of their index. Returns their
/// number. If `cloud` is a mesh, its vertices are the points.
///
/// # Errors
/// Errors of `each`; see [`compare()`].
pub fn distances(
    cloud: &Path,
    to: &Path,
    workspace: &Workspace,
    each: impl FnMut(Measured) -> Result<()>,
) -> Result<u64> {
    compare::distances(cloud, to, clouds, workspace, each)
}
