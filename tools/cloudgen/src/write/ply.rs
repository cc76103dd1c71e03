//! PLY output.

use std::{
    fs::File,
    io::{BufWriter, Write},
    path::{Path, PathBuf},
};

use super::{Encoding, Precision, Sink};
use crate::error::{Error, Result};
use outcrop_ply::{Layout, Scalar};

/// Writes vertices in batches.
pub(super) struct PlySink {
    file: BufWriter<File>,
    path: PathBuf,
    encoding: Encoding,
    precision: Precision,
}

impl PlySink {
    pub(super) fn new(
        file: BufWriter<File>,
        path: &Path,
        encoding: Encoding,
        precision: Precision,
        count: u64,
    ) -> Result<Self> {
        let mut sink = PlySink {
            file,
            path: path.to_path_buf(),
            encoding,
            precision,
        };
        let layout = Layout {
            encoding: match encoding {
                Encoding::LittleEndian => outcrop_ply::Encoding::Little,
                Encoding::BigEndian => outcrop_ply::Encoding::Big,
                Encoding::Ascii => outcrop_ply::Encoding::Ascii,
            },
            comments: &["outcrop-cloudgen"],
            vertices: count,
            coordinates: match precision {
                Precision::Single => Scalar::F32,
                Precision::Double => Scalar::F64,
            },
            columns: &[],
            triangles: None,
        };
        let written = sink.file.write_all(layout.header().as_bytes());
        written.map_err(|e| Error::io(path, "write", e))?;
        Ok(sink)
    }

    fn vertex(&mut self, point: &[f64; 3]) -> std::io::Result<()> {
        let single = point.map(|c| c as f32);
        match (self.encoding, self.precision) {
            (Encoding::Ascii, Precision::Single) => {
                writeln!(self.file, "{} {} {}", single[0], single[1], single[2])
            }
            (Encoding::Ascii, Precision::Double) => {
                writeln!(self.file, "{} {} {}", point[0], point[1], point[2])
            }
            (Encoding::LittleEndian, Precision::Single) => self
                .file
                .write_all(single.map(f32::to_le_bytes).as_flattened()),
            (Encoding::LittleEndian, Precision::Double) => self
                .file
                .write_all(point.map(f64::to_le_bytes).as_flattened()),
            (Encoding::BigEndian, Precision::Single) => self
                .file
                .write_all(single.map(f32::to_be_bytes).as_flattened()),
            (Encoding::BigEndian, Precision::Double) => self
                .file
                .write_all(point.map(f64::to_be_bytes).as_flattened()),
        }
    }
}

impl Sink for PlySink {
    fn write(&mut self, points: &[[f64; 3]]) -> Result<()> {
        points
            .iter()
            .try_for_each(|point| self.vertex(point))
            .map_err(|e| Error::io(&self.path, "write", e))
    }

    fn finish(&mut self) -> Result<()> {
        self.file
            .flush()
            .map_err(|e| Error::io(&self.path, "write", e))
    }
}
