//! PLY output.

use std::{
    fs::File,
    io::{BufWriter, Write},
    path::{Path, PathBuf},
};

use super::{Encoding, Precision, Sink};
use crate::error::{Error, Result};

/// Writes vertices as they come.
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
        let format = match encoding {
            Encoding::LittleEndian => "binary_little_endian",
            Encoding::BigEndian => "binary_big_endian",
            Encoding::Ascii => "ascii",
        };
        let float = match precision {
            Precision::Single => "float",
            Precision::Double => "double",
        };
        write!(
            sink.file,
            "ply\nformat {format} 1.0\ncomment outcrop-cloudgen\nelement vertex {count}\n\
             property {float} x\nproperty {float} y\nproperty {float} z\nend_header\n"
        )
        .map_err(|e| Error::io(path, "write", e))?;
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
