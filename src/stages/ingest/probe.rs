//! A cheap look at one file.

use super::Opened;
use super::format::Format;
use super::source::Native;
use crate::error::Result;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What the header of a file says; nothing of it is checked against the points.
#[derive(Debug, Clone, Serialize)]
pub struct Probe {
    /// The file.
    pub path: PathBuf,
    /// Its format, found by content.
    pub format: Format,
    /// Its size in bytes.
    pub bytes: u64,
    /// Points the header claims; text has no such claim.
    pub points_claimed: Option<u64>,
    /// The same as far as the file is large enough for them; a guess for text.
    pub points_likely: u64,
    /// Version of LAS and LAZ, e.g. `1.2`.
    pub las_version: Option<String>,
    /// Point format of LAS and LAZ.
    pub point_format: Option<u8>,
    /// Length of a step of each axis of LAS and LAZ, in the file's unit.
    pub scale: Option<[f64; 3]>,
    /// Offset of each axis of LAS and LAZ, in the file's unit.
    pub offset: Option<[f64; 3]>,
    /// Smallest and largest coordinates that the header of LAS and LAZ claims.
    pub bounds: Option<[[f64; 3]; 2]>,
    /// Bytes a point takes in the scratch folder.
    pub spool_bytes_per_point: u64,
}

/// Reads the header of a file.
///
/// # Errors
/// [`crate::Error::Io`]; [`crate::Error::Input`] if it is no point cloud that can be read.
pub fn probe(path: &Path) -> Result<Probe> {
    let Opened { input, claims, .. } = Opened::new(path, Arc::default())?;
    let (scale, offset) = match claims.native {
        Native::Las { scale, offset } => (Some(scale), Some(offset)),
        Native::F32 | Native::F64 => (None, None),
    };
    Ok(Probe {
        format: claims.format,
        bytes: input.bytes,
        points_claimed: claims.points,
        points_likely: claims.likely_points,
        las_version: claims.version,
        point_format: claims.point_format,
        scale,
        offset,
        bounds: claims.bounds,
        spool_bytes_per_point: claims.native.point_bytes() as u64,
        path: input.path,
    })
}
