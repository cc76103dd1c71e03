//! Scans of any format as distinct, finite points in a fixed order.

use crate::error::Result;
use outcrop_disk::workspace::Workspace;
use outcrop_formats::ingest;
use std::path::Path;

/// All distinct points with finite coordinates, sorted by coordinates.
///
/// They are read by `outcrop`: positions on a grid, as in LAS, are those of the file, and floating-point ones
/// are exact too unless they span more than 2^30 of their own steps.
pub(crate) fn points(path: &Path, workspace: &Workspace) -> Result<Vec<[f64; 3]>> {
    let spool = ingest(&[path.to_path_buf()], workspace)?;
    let mut points = Vec::with_capacity(usize::try_from(spool.points()).unwrap_or(0));
    if spool.points() > 0 {
        let lattice = spool.choose_lattice(0)?;
        spool.for_each(workspace, &lattice, |part| {
            points.extend(part.iter().map(|p| lattice.position(*p)));
            Ok(())
        })?;
    }
    spool.release(workspace)?;
    // Zero gets one sign, otherwise equal points would differ.
    points.iter_mut().flatten().for_each(|c| *c += 0.0);
    points.sort_unstable_by(|a, b| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal));
    points.dedup();
    Ok(points)
}
