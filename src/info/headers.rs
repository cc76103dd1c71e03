//! Describes a cloud from the headers of its files, without reading points.

use outcrop_disk::error::Result;
use outcrop_disk::workspace::memory::MemoryPool;
use outcrop_disk::workspace::progress::Cancel;
use outcrop_formats::{Probe, Reads, expand, probe_near};
use outcrop_points::{Fetched, Selection};
use serde::Serialize;
use std::fmt;
use std::path::PathBuf;

/// The headers of the files of a cloud. Nothing in them is verified.
#[derive(Debug, Clone, Serialize)]
pub struct Headers {
    /// Each file.
    pub headers: Vec<Probe>,
    /// Bytes of all files.
    pub bytes: u64,
    /// Points that the headers give, limited by the sizes of the files; estimates for text.
    pub points: u64,
    /// Lowest and highest coordinates, each in the unit of its file; none if no header gives any.
    pub bounds: Option<[[f64; 3]; 2]>,
    /// What a run reads of the files.
    pub reads: Reads,
    /// True if that is only what lies in a region.
    pub is_cropped: bool,
    /// Requests to servers and bytes of their answers; none if all files are local.
    pub fetched: Option<Fetched>,
}

/// Reads the headers of all files, and what tells how much a run with this selection reads of them, which takes
/// `memory`.
///
/// # Errors
/// [`outcrop_disk::error::Error::Io`]; [`outcrop_disk::error::Error::Input`] for a file that is no readable point
/// cloud; [`outcrop_disk::error::Error::Memory`], [`outcrop_disk::error::Error::Cancelled`].
pub fn headers(
    inputs: &[PathBuf],
    selection: &Selection,
    memory: &MemoryPool,
    cancel: &Cancel,
) -> Result<Headers> {
    let files = expand(inputs)?;
    let crop = selection.crop.as_ref();
    let headers: Vec<Probe> = files
        .iter()
        .map(|file| probe_near(file, &selection.layout, crop, memory, cancel))
        .collect::<Result<_>>()?;
    let joined = |[a, b]: [[f64; 3]; 2], [c, d]: [[f64; 3]; 2]| {
        let of = |f: fn(f64, f64) -> f64, p: [f64; 3], q: [f64; 3]| {
            [0, 1, 2].map(|axis| f(p[axis], q[axis]))
        };
        [of(f64::min, a, c), of(f64::max, b, d)]
    };
    let fetched = |a: Fetched, b: Fetched| Fetched {
        requests: a.requests + b.requests,
        bytes: a.bytes + b.bytes,
    };
    Ok(Headers {
        bytes: headers.iter().map(|header| header.bytes).sum(),
        points: headers.iter().map(|header| header.points_likely).sum(),
        bounds: headers.iter().filter_map(|h| h.bounds).reduce(joined),
        reads: headers
            .iter()
            .filter_map(|h| h.reads)
            .reduce(Reads::and)
            .unwrap_or_default(),
        is_cropped: crop.is_some(),
        fetched: headers.iter().filter_map(|h| h.fetched).reduce(fetched),
        headers,
    })
}

impl Headers {
    /// What a run reads, in one line.
    fn told(&self) -> String {
        let shown = |bytes: u64| bytesize::ByteSize(bytes).display().si();
        let Reads {
            bytes,
            bytes_of_all,
            points,
            parts,
            is_estimated,
        } = self.reads;
        let about = if is_estimated { "about " } else { "" };
        let all = shown(bytes_of_all);
        if !self.is_cropped {
            return format!("a run reads all: {about}{all}");
        }
        let parts = parts.map_or_else(String::new, |n| format!(" in {n} chunks or tiles"));
        let read = shown(bytes);
        format!("a run with this --crop reads {about}{read} of {all}: {points} points{parts}")
    }
}

impl fmt::Display for Headers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for header in &self.headers {
            write!(f, "{}: {}", header.path.display(), header.format)?;
            if let Some(version) = &header.las_version {
                write!(f, " {version}")?;
            }
            if let Some(format) = header.point_format {
                write!(f, ", point format {format}")?;
            }
            let about = if header.points_claimed.is_none() {
                "about "
            } else {
                ""
            };
            let points = header.points_claimed.unwrap_or(header.points_likely);
            write!(f, ", {about}{points} points, {} bytes", header.bytes)?;
            if let Some([low, high]) = header.bounds {
                write!(
                    f,
                    ", {} {} {} to {} {} {}",
                    low[0], low[1], low[2], high[0], high[1], high[2]
                )?;
            }
            let names: Vec<&str> = header.columns.iter().map(|c| c.name.as_str()).collect();
            if !names.is_empty() {
                write!(f, ", columns {}", names.join(" "))?;
            }
            writeln!(f)?;
        }
        let files = self.headers.len();
        writeln!(
            f,
            "in all {files} files, {} points, {} bytes",
            self.points, self.bytes
        )?;
        writeln!(f, "{}", self.told())?;
        if let Some(Fetched { requests, bytes }) = self.fetched {
            writeln!(f, "read from servers: {bytes} bytes, {requests} requests")?;
        }
        write!(
            f,
            "only headers were read; --all-points reads the points, and estimates a run"
        )
    }
}
