//! LAS and LAZ output.

use std::{
    fs::File,
    io::{self, BufWriter, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
    sync::{Arc, Mutex, PoisonError},
};

use las::{
    Builder, Header, PointDataBuilder, Transform, Vector, Version, Writer,
    point::Format as RecordFormat,
};

use super::{LasOptions, PointFormat, Sink};
use crate::error::{Error, Result};
use crate::generator::Generator;
use crate::kind::Kind;

/// The header of a file; checks that the coordinates fit.
pub(super) fn header(
    generator: &Generator,
    path: &Path,
    options: LasOptions,
    compressed: bool,
    count: u64,
) -> Result<Header> {
    let cloud = generator.cloud();
    let default_scale = if cloud.kind == Kind::Grid {
        1.0 / 1024.0
    } else {
        0.001
    };
    let scale = options.scale.unwrap_or(default_scale);
    if !(scale > 0.0 && scale.is_finite()) {
        return Err(Error::parameter("scale", scale, "a positive number"));
    }
    if (generator.reach() + 1.0) / scale > f64::from(i32::MAX) {
        let need = format!("at least {:.1e} for this size", generator.reach() / 2e9);
        return Err(Error::parameter("scale", scale, need));
    }
    let (number, version) = match options.point_format {
        PointFormat::Legacy => (0, Version::new(1, 2)),
        PointFormat::Colored => (2, Version::new(1, 2)),
        PointFormat::Extended => (6, Version::new(1, 4)),
        PointFormat::ExtendedColored => (7, Version::new(1, 4)),
    };
    let old = !matches!(number, 6..);
    if old && count > u64::from(u32::MAX) {
        return Err(Error::parameter(
            "points",
            count,
            "below 2^32 for point formats 0 and 2",
        ));
    }
    let mut point_format = RecordFormat::new(number).map_err(|e| Error::las(path, e))?;
    point_format.is_compressed = compressed;
    let [x, y, z] = cloud.offset.map(|c| Transform {
        scale,
        offset: c.floor(),
    });
    let mut builder = Builder::from(version);
    // No date: equal descriptions give equal files.
    builder.date = None;
    builder.system_identifier = String::from("synthetic");
    builder.generating_software = String::from("outcrop-cloudgen");
    builder.point_format = point_format;
    builder.transforms = Vector { x, y, z };
    builder.into_header().map_err(|e| Error::las(path, e))
}

/// The first error of a file.
#[derive(Clone, Default)]
struct Fault(Arc<Mutex<Option<io::Error>>>);

impl Fault {
    fn check(&self) -> las::Result<()> {
        match self.0.lock().unwrap_or_else(PoisonError::into_inner).take() {
            Some(error) => Err(error.into()),
            None => Ok(()),
        }
    }
}

/// A file that keeps its first error and ignores all later calls. The LAS writer panics when it is dropped
/// and cannot complete its header, so errors are hidden from it.
struct Quiet {
    file: BufWriter<File>,
    failed: bool,
    fault: Fault,
}

impl Quiet {
    fn attempt<T>(
        &mut self,
        pretended: T,
        action: impl FnOnce(&mut BufWriter<File>) -> io::Result<T>,
    ) -> T {
        if self.failed {
            return pretended;
        }
        match action(&mut self.file) {
            Ok(value) => value,
            Err(error) => {
                self.failed = true;
                *self.fault.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
                pretended
            }
        }
    }
}

impl Write for Quiet {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        // All or nothing: a partial write could hide an error.
        self.attempt((), |file| file.write_all(bytes));
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.attempt((), BufWriter::flush);
        Ok(())
    }
}

impl Seek for Quiet {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        Ok(self.attempt(0, |file| file.seek(to)))
    }
}

/// Writes records in batches.
pub(super) struct LasSink {
    path: PathBuf,
    writer: Option<Writer<Quiet>>,
    fault: Fault,
    record_format: RecordFormat,
    transforms: Vector<Transform>,
}

impl LasSink {
    pub(super) fn new(file: BufWriter<File>, path: &Path, header: Header) -> Result<Self> {
        let mut record_format = *header.point_format();
        record_format.is_compressed = false;
        let transforms = *header.transforms();
        let fault = Fault::default();
        let quiet = Quiet {
            file,
            failed: false,
            fault: fault.clone(),
        };
        let writer = Writer::new(quiet, header).map_err(|e| Error::las(path, e))?;
        let (path, writer) = (path.to_path_buf(), Some(writer));
        Ok(LasSink {
            path,
            writer,
            fault,
            record_format,
            transforms,
        })
    }

    /// A record with one return and, if the format has them, colours that depend on the position.
    fn encode(&self, point: &[f64; 3], bytes: &mut Vec<u8>) -> las::Result<()> {
        let record = self.record_format.len() as usize;
        let start = bytes.len();
        bytes.resize(start + record, 0);
        let Vector { x, y, z } = &self.transforms;
        for (k, (transform, &c)) in [x, y, z].into_iter().zip(point).enumerate() {
            let at = start + 4 * k;
            bytes[at..at + 4].copy_from_slice(&transform.inverse(c)?.to_le_bytes());
        }
        // Return 1 of 1; the two counts have 3 bits each in old formats and 4 in new ones.
        bytes[start + 14] = if self.record_format.is_extended {
            0x11
        } else {
            0x09
        };
        if self.record_format.has_color {
            let at = start
                + if self.record_format.is_extended {
                    30
                } else {
                    20
                };
            for (k, c) in point.iter().enumerate() {
                // A wave of about a hundred units for each axis.
                let value = (32768.0 + 32767.0 * libm::sin(c * 0.06)) as u16;
                bytes[at + 2 * k..at + 2 * k + 2].copy_from_slice(&value.to_le_bytes());
            }
            let intensity = (point.iter().sum::<f64>() as i64 & 0x7ff) as u16;
            bytes[start + 12..start + 14].copy_from_slice(&intensity.to_le_bytes());
        }
        Ok(())
    }

    fn batch(&mut self, points: &[[f64; 3]]) -> las::Result<()> {
        let record = self.record_format.len() as usize;
        let mut bytes = Vec::with_capacity(points.len() * record);
        for point in points {
            self.encode(point, &mut bytes)?;
        }
        let data = PointDataBuilder::new()
            .with_format(self.record_format)
            .with_transforms(self.transforms)
            .build_from_bytes(bytes)?;
        match &mut self.writer {
            Some(writer) => writer.write_points(&data)?,
            None => return Err(las::Error::ClosedWriter),
        }
        self.fault.check()
    }

    fn close(&mut self) -> las::Result<()> {
        if let Some(writer) = self.writer.take() {
            writer.into_inner()?.flush()?;
        }
        self.fault.check()
    }
}

impl Sink for LasSink {
    fn write(&mut self, points: &[[f64; 3]]) -> Result<()> {
        self.batch(points).map_err(|e| Error::las(&self.path, e))
    }

    fn finish(&mut self) -> Result<()> {
        self.close().map_err(|e| Error::las(&self.path, e))
    }
}
