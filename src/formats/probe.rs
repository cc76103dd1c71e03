//! Reads the header of a file only.

use super::Opened;
use super::formats::{LONG_HEAD, is_cloud};
use super::input::Input;
use super::reads::{Means, Reads};
use super::remote::Fetched;
use outcrop_disk::error::Result;
use outcrop_disk::workspace::memory::MemoryPool;
use outcrop_disk::workspace::progress::Cancel;
use outcrop_points::Format;
use outcrop_points::Layout;
use outcrop_points::columns::{Attributes, Column, normal_columns};
use outcrop_points::crop::{Crop, Nearby};
use outcrop_points::native::Native;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Values given in a file's header; none is verified.
#[derive(Debug, Clone, Serialize)]
pub struct Probe {
    /// The file.
    pub path: PathBuf,
    /// Its format, detected by content.
    pub format: Format,
    /// Its size in bytes.
    pub bytes: u64,
    /// What was asked of the server, if it is on one.
    pub fetched: Option<Fetched>,
    /// What a run reads of it; none if nobody asked.
    pub reads: Option<Reads>,
    /// Estimated bytes of its content if it is compressed, else 0.
    pub decompressed_bytes: u64,
    /// Number of points given in the header; `None` for text.
    pub points_claimed: Option<u64>,
    /// The number of points, limited by the file size; an estimate for text.
    pub points_likely: u64,
    /// Version of LAS and LAZ, e.g. `1.2`.
    pub las_version: Option<String>,
    /// Point format of LAS and LAZ.
    pub point_format: Option<u8>,
    /// Step of each axis of LAS and LAZ, in the file's unit.
    pub scale: Option<[f64; 3]>,
    /// Offset of each axis of LAS and LAZ, in the file's unit.
    pub offset: Option<[f64; 3]>,
    /// Smallest and largest coordinates given in the header of LAS and LAZ.
    pub bounds: Option<[[f64; 3]; 2]>,
    /// False if its columns are not known: they are described behind the points of a compressed file.
    pub is_described: bool,
    /// Columns of its points beside the coordinates.
    pub columns: Vec<Column>,
    /// Bytes of the number of the scanner that saw a point, if the file gives positions of scanners.
    pub scanner_bytes: u64,
    /// Bytes of the columns of its normal.
    pub normal_bytes: u64,
    /// Bytes of a point in the scratch folder.
    pub spool_bytes_per_point: u64,
}

impl Probe {
    /// Bytes of the wanted columns of a point.
    #[must_use]
    pub fn value_bytes(&self, attributes: &Attributes) -> u64 {
        let wanted = attributes.of(&self.columns);
        let bytes = wanted.iter().map(|n| self.columns[*n].scalar.bytes());
        bytes.sum::<usize>() as u64
    }
}

/// Reads the header of a file.
///
/// # Errors
/// [`outcrop_disk::error::Error::Io`]; [`outcrop_disk::error::Error::Input`] if it is not a readable point cloud.
pub fn probe(path: &Path) -> Result<Probe> {
    probe_as(path, &Layout::default())
}

/// As [`probe`]; text is read as `layout` says.
///
/// # Errors
/// See [`probe`].
pub fn probe_as(path: &Path, layout: &Layout) -> Result<Probe> {
    let opened = Opened::new(Input::open_head(path, &is_cloud, LONG_HEAD)?, layout)?;
    Ok(probed(opened, None))
}

/// As [`probe_as`]; also tells what a run reads of the file, all of it or what lies in a region. A hierarchy of nodes is
/// read for that, with a reservation of memory.
///
/// # Errors
/// See [`probe`]; [`outcrop_disk::error::Error::Memory`], [`outcrop_disk::error::Error::Cancelled`].
pub fn probe_near(
    path: &Path,
    layout: &Layout,
    crop: Option<&Crop>,
    memory: &MemoryPool,
    cancel: &Cancel,
) -> Result<Probe> {
    let means = Means { memory, cancel };
    let opened = Opened::new(Input::open_head(path, &is_cloud, LONG_HEAD)?, layout)?;
    let nearby = crop.map(|crop| Nearby::of(crop, memory)).transpose()?;
    let reads = opened.file.reads(&opened.input, nearby.as_ref(), means)?;
    Ok(probed(opened, Some(reads)))
}

fn probed(opened: Opened, reads: Option<Reads>) -> Probe {
    let has_scanners = opened.has_scanners();
    let Opened {
        input,
        claims,
        file,
    } = opened;
    let (scale, offset) = match claims.native {
        Native::Las { scale, offset } => (Some(scale), Some(offset)),
        Native::F32 | Native::F64 => (None, None),
    };
    let columns = file.columns();
    let normal = normal_columns(&columns);
    let bytes = normal
        .into_iter()
        .flatten()
        .map(|n| columns[n].scalar.bytes());
    let normal_bytes = bytes.sum::<usize>() as u64;
    Probe {
        format: claims.format,
        bytes: input.size,
        fetched: input.fetched(),
        reads,
        decompressed_bytes: if input.is_compressed() {
            input.bytes
        } else {
            0
        },
        points_claimed: claims.points,
        points_likely: claims.likely_points,
        las_version: claims.version,
        point_format: claims.point_format,
        scale,
        offset,
        bounds: claims.bounds,
        scanner_bytes: match has_scanners {
            true => size_of::<u16>() as u64,
            false => 0,
        },
        is_described: file.is_described(),
        columns,
        normal_bytes,
        spool_bytes_per_point: claims.native.point_bytes() as u64,
        path: input.path,
    }
}
