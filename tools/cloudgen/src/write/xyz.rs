//! Plain text output.

use std::{
    fs::File,
    io::{BufWriter, Write},
    path::{Path, PathBuf},
};

use super::Sink;
use crate::error::{Error, Result};

/// Writes one line per point.
pub(super) struct XyzSink {
    file: BufWriter<File>,
    path: PathBuf,
}

impl XyzSink {
    pub(super) fn new(file: BufWriter<File>, path: &Path) -> Self {
        XyzSink {
            file,
            path: path.to_path_buf(),
        }
    }
}

impl Sink for XyzSink {
    fn write(&mut self, points: &[[f64; 3]]) -> Result<()> {
        points
            .iter()
            .try_for_each(|[x, y, z]| writeln!(self.file, "{x} {y} {z}"))
            .map_err(|e| Error::io(&self.path, "write", e))
    }

    fn finish(&mut self) -> Result<()> {
        self.file
            .flush()
            .map_err(|e| Error::io(&self.path, "write", e))
    }
}
