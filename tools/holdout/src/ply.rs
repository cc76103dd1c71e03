//! Writes clouds: binary PLY in double precision.

use crate::error::{Error, Result};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

/// Writes points.
pub(crate) fn write(path: &Path, points: &[[f64; 3]]) -> Result<()> {
    let work = || -> std::io::Result<()> {
        let mut file = BufWriter::with_capacity(1 << 20, File::create(path)?);
        write!(
            file,
            "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\n\
             property double y\nproperty double z\nend_header\n",
            points.len()
        )?;
        for c in points.iter().flatten() {
            file.write_all(&c.to_le_bytes())?;
        }
        file.into_inner()
            .map_err(std::io::IntoInnerError::into_error)?
            .sync_all()
    };
    work().map_err(|e| Error::io(path, "write", e))
}
