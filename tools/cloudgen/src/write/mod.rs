//! Streaming a cloud to a file.

mod format;
mod las;
mod ply;
mod reference;
mod seen;
mod xyz;

pub use format::{Encoding, Format, LasOptions, PointFormat, Precision};
pub(crate) use reference::write_reference;
pub(crate) use seen::write_seen;

use std::{
    fs::File,
    io::BufWriter,
    path::{Path, PathBuf},
};

use crate::error::{Error, Result};
use crate::generator::Generator;
use crate::rng::{Purpose, Rng};

/// Points made and written at a time: two LAZ chunks.
const BATCH: usize = 100_000;

/// A file that takes points in batches.
trait Sink {
    fn write(&mut self, points: &[[f64; 3]]) -> Result<()>;
    fn finish(&mut self) -> Result<()>;
}

/// The name of one file of a partition: the number goes before the extension.
pub(crate) fn part_path(path: &Path, part: u32) -> PathBuf {
    let mut name = path.file_stem().unwrap_or_default().to_os_string();
    name.push(format!("-{part}"));
    if let Some(extension) = path.extension() {
        name.push(".");
        name.push(extension);
    }
    path.with_file_name(name)
}

/// Writes the points that fall into `part` of a random partition.
pub(crate) fn write_part(
    generator: &Generator,
    path: &Path,
    format: Format,
    part: u32,
    parts: u32,
) -> Result<()> {
    let seed = generator.cloud().seed;
    let belongs = |index: &u64| {
        parts == 1
            || Rng::at(seed, Purpose::Split, *index).below(u64::from(parts)) == u64::from(part)
    };
    let count = match parts {
        1 => generator.len(),
        // Counted first, since most headers contain the number of points.
        _ => (0..generator.len()).filter(belongs).count() as u64,
    };
    let mut sink = open(generator, path, format, count)?;
    let mut members = (0..generator.len()).filter(belongs);
    let mut indices: Vec<u64> = Vec::with_capacity(BATCH);
    let mut points = Vec::with_capacity(BATCH);
    loop {
        indices.clear();
        indices.extend(members.by_ref().take(BATCH));
        if indices.is_empty() {
            return sink.finish();
        }
        points.resize(indices.len(), [0.0; 3]);
        generator.gather(&indices, &mut points);
        sink.write(&points)?;
    }
}

fn open(generator: &Generator, path: &Path, format: Format, count: u64) -> Result<Box<dyn Sink>> {
    // All checks precede the creation of the file.
    let header = match format {
        Format::Las(options) | Format::Laz(options) => {
            let compressed = matches!(format, Format::Laz(_));
            Some(las::header(generator, path, options, compressed, count)?)
        }
        Format::Ply(..) | Format::Xyz => None,
    };
    let file = File::create(path).map_err(|e| Error::io(path, "create the file", e))?;
    let file = BufWriter::with_capacity(1 << 18, file);
    Ok(match (header, format) {
        (Some(header), _) => Box::new(las::LasSink::new(file, path, header)?),
        (None, Format::Ply(encoding, precision)) => {
            Box::new(ply::PlySink::new(file, path, encoding, precision, count)?)
        }
        (None, _) => Box::new(xyz::XyzSink::new(file, path)),
    })
}
