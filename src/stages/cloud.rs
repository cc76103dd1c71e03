//! The distinct points of a cloud in curve order, for what compares surfaces.

use crate::order::order;
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::Workspace;
use outcrop_geom::vector::V3;
use outcrop_points::{Ingest, Selection};
use std::path::Path;

/// Points per page of the store.
const PAGE: usize = 1 << 12;

/// Bytes of a point at hand: on the lattice, and its position.
const POINT: u64 = 12 + 24;

/// Reads a cloud by `ingest`; duplicates become one point. `each` is given the number of all points, and the positions
/// of some, in the order of the curve. Scratch files stay if `keep` is true, for an attempt that needs them again.
/// False if positions had to be rounded.
///
/// # Errors
/// [`Error::Input`] for a file that cannot be read or has no point; [`Error::Memory`], [`Error::Io`], [`Error::Disk`],
/// [`Error::Corrupt`], [`Error::Cancelled`]; those of `each`.
pub fn positions(
    path: &Path,
    ingest: Ingest,
    keep: bool,
    workspace: &Workspace,
    each: &mut dyn FnMut(u64, &[V3]) -> Result<()>,
) -> Result<bool> {
    let observer = &workspace.observer;
    observer.begin("read cloud", "points", 0);
    let spool = ingest(&[path.to_path_buf()], &Selection::default(), workspace)?;
    observer.end();
    let stats = spool.stats();
    stats.warnings.iter().for_each(|w| observer.warn(w));
    let kept = stats.kept;
    if kept == 0 {
        let found = match stats.read {
            0 => "none".to_owned(),
            n => format!("none of {n} usable"),
        };
        return Err(Error::input(path, "points", found, "one or more"));
    }
    let lattice = spool.choose_lattice(0).map_err(|error| match error {
        Error::Degenerate { found } => Error::input(path, "points", found, "smaller ones"),
        other => other,
    })?;
    observer.begin("order", "points", kept);
    let (stored, ..) = order(spool, &lattice, PAGE, workspace)?;
    observer.end();
    let store = stored.open(workspace)?;
    let _held = workspace.reserve("compare: points at hand", PAGE as u64 * POINT)?;
    let (mut points, mut positions) = (Vec::new(), Vec::with_capacity(PAGE));
    for page in 0..store.pages() {
        workspace.check_cancel()?;
        points.clear();
        store.read_pages(page..page + 1, &mut points)?;
        positions.clear();
        positions.extend(points.iter().map(|point| lattice.position(*point)));
        each(store.len() as u64, &positions)?;
    }
    if !keep {
        stored.release(workspace)?;
    }
    Ok(lattice.exact)
}
