//! Scans of any format as distinct, finite points in a fixed order.

mod lzf;
mod pcd;

use crate::error::{Error, Result};
use e57::{CartesianCoordinate, E57Reader};
use outcrop::stages::ingest::ingest;
use outcrop::workspace::Workspace;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// All distinct points with finite coordinates, sorted by coordinates.
///
/// LAS, LAZ, PLY and text are read by `outcrop`: LAS positions are those of the file, and floating-point ones
/// are exact too unless they span more than 2^30 of their own steps. All scans of an E57 file are in its
/// common frame.
pub(crate) fn points(path: &Path, workspace: &Workspace) -> Result<Vec<[f64; 3]>> {
    let mut points = match head(path)? {
        Some(head) if head.starts_with(b"ASTM-E57") => e57(path)?,
        Some(head) if pcd::is(&head) => pcd::read(path)?,
        _ => cloud(path, workspace)?,
    };
    points.retain(|p| p.iter().all(|c| c.is_finite()));
    // Zero gets one sign, otherwise equal points would differ.
    points.iter_mut().flatten().for_each(|c| *c += 0.0);
    points.sort_unstable_by(|a, b| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal));
    points.dedup();
    Ok(points)
}

/// The first bytes of a file; none of a folder.
fn head(path: &Path) -> Result<Option<Vec<u8>>> {
    if path.is_dir() {
        return Ok(None);
    }
    let mut head = Vec::new();
    let file = File::open(path).map_err(|e| Error::io(path, "open", e))?;
    let read = file.take(4096).read_to_end(&mut head);
    read.map_err(|e| Error::io(path, "read", e))?;
    Ok(Some(head))
}

fn cloud(path: &Path, workspace: &Workspace) -> Result<Vec<[f64; 3]>> {
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
    Ok(points)
}

fn e57(path: &Path) -> Result<Vec<[f64; 3]>> {
    let bad = |e: e57::Error| Error::input(path, e.to_string());
    let mut reader = E57Reader::from_file(path).map_err(bad)?;
    let mut points = Vec::new();
    for scan in reader.pointclouds() {
        for point in reader.pointcloud_simple(&scan).map_err(bad)? {
            if let CartesianCoordinate::Valid { x, y, z } = point.map_err(bad)?.cartesian {
                points.push([x, y, z]);
            }
        }
    }
    Ok(points)
}
