//! A cheap look at one file.

use super::source::Native;
use super::{Format, Opened};
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
    let opened = Opened::new(path, Arc::default())?;
    let native = opened.native();
    let (scale, offset) = match native {
        Native::Las { scale, offset } => (Some(scale), Some(offset)),
        Native::F32 | Native::F64 => (None, None),
    };
    let las = opened.las();
    Ok(Probe {
        path: opened.input.path.clone(),
        format: opened.format(),
        bytes: opened.input.bytes,
        points_claimed: opened.claimed(),
        las_version: las.map(|h| format!("{}.{}", h.version[0], h.version[1])),
        point_format: las.map(|h| h.point_format),
        scale,
        offset,
        bounds: las.map(|h| h.bounds),
        spool_bytes_per_point: native.point_bytes() as u64,
    })
}
