//! Writes clouds as binary PLY in double precision.

use crate::error::{Error, Result};
use outcrop_ply::{Encoding, Layout, Scalar};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

/// Writes points.
pub(crate) fn write(path: &Path, points: &[[f64; 3]]) -> Result<()> {
    let work = || -> std::io::Result<()> {
        let mut file = BufWriter::with_capacity(1 << 20, File::create(path)?);
        let layout = Layout {
            encoding: Encoding::Little,
            comments: &[],
            vertices: points.len() as u64,
            coordinates: Scalar::F64,
            columns: &[],
            triangles: None,
        };
        file.write_all(layout.header().as_bytes())?;
        for c in points.iter().flatten() {
            file.write_all(&c.to_le_bytes())?;
        }
        file.into_inner()
            .map_err(std::io::IntoInnerError::into_error)?
            .sync_all()
    };
    work().map_err(|e| Error::io(path, "write", e))
}
