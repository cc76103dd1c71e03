//! How much disk a run will take: before it starts, when the points are read, and when they are relaxed.
//!
//! At its peak, which is where triples are put together, scratch holds one or two stores of positions and
//! all triples twice. How many triples there are depends on noise, which shows when the points are
//! relaxed: noisy ones move, and then there is a second store. Where noise makes more triples it makes
//! fewer triangles, so scratch and mesh together can be told before.

use crate::params::{Method, Params};
use crate::stages::ingest::{self, Format};
use serde::Serialize;
use std::path::PathBuf;

/// Bytes of a position, in the ordered store and in the spool if it was integers or `f32`.
const POSITION: f64 = 12.0;

/// Scratch bytes a triple at the peak: two copies, packed.
const TRIPLE: f64 = 8.2;

/// Bytes of a triangle in the mesh.
const TRIANGLE: f64 = 13.0;

/// Bytes a point while triangles are in scratch and the mesh is written, beside the stores.
const EXPORT: f64 = 7.3;

/// Checksums, boxes and whatever else is small: bytes a point, and in all.
const SMALL: (f64, f64) = (0.8, 4096.0);

/// Bytes of a line of text, about.
const LINE: u64 = 30;

/// Disk space that a run will take, about.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct DiskEstimate {
    /// Peak of the scratch files.
    pub scratch: u64,
    /// The mesh.
    pub output: u64,
    /// Peak of both together.
    pub together: u64,
}

/// What is known of a cloud so far.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Known {
    /// Points in the spool.
    pub read: u64,
    /// Bytes of the spool.
    pub spool: u64,
    /// Points left.
    pub points: u64,
    /// Whether the mesh has coordinates in double precision.
    pub double: Option<bool>,
    /// Whether points moved when they were relaxed.
    pub moved: Option<bool>,
}

impl Known {
    /// What the headers of the inputs say. They may be wrong, but cannot claim more than the files hold.
    pub fn from_headers(inputs: &[PathBuf]) -> Option<Self> {
        let mut known = Self {
            read: 0,
            spool: 0,
            points: 0,
            double: Some(false),
            moved: None,
        };
        for path in ingest::expand(inputs).ok()? {
            let probe = ingest::probe(&path).ok()?;
            let (least, usual) = match probe.format {
                Format::Laz => (1, 8),
                Format::Las => (20, 20),
                Format::Text | Format::PlyAscii => (6, LINE),
                _ => (POSITION as u64, POSITION as u64),
            };
            let claimed = probe.points_claimed.unwrap_or(probe.bytes / usual);
            let points = claimed.min(probe.bytes / least);
            known.read += points;
            known.spool += points * probe.spool_bytes_per_point;
            if probe.spool_bytes_per_point > POSITION as u64 || probe.scale.is_some() {
                // Single precision may do, or not.
                known.double = None;
            }
        }
        known.points = known.read;
        Some(known)
    }

    /// The space that a run with these parameters will take.
    pub fn estimate(&self, params: &Params) -> DiskEstimate {
        let points = self.points as f64;
        let (moved, triples, triangles) = self.surface(params);
        let stores = POSITION * (1.0 + moved);
        // What is read, sorted and written anew is there twice for a while.
        let mut early = self.spool as f64 + POSITION * points;
        if params.thin.is_some() {
            early = early.max(self.spool as f64 + 2.0 * POSITION * self.read as f64);
        }
        if params.smooth > 0 || params.drop_outliers.is_some() {
            early = early.max(2.0 * POSITION * points);
        }
        if params.relax > 1 {
            early = early.max(POSITION * (1.0 + 2.0 * moved) * points);
        }
        let late = (stores + TRIPLE * triples) * points;
        let small = |bytes: f64| bytes + SMALL.0 * points + SMALL.1;
        let vertex = match self.double {
            Some(false) => POSITION,
            Some(true) => 2.0 * POSITION,
            None => 1.5 * POSITION,
        };
        let output = (vertex + TRIANGLE * triangles) * points + 200.0;
        let scratch = small(early.max(late));
        let export = small((stores + EXPORT) * points) + output;
        DiskEstimate {
            scratch: scratch as u64,
            output: output as u64,
            together: scratch.max(export) as u64,
        }
    }

    /// How much of a second store there is, triples and triangles a point. A surface without noise has two
    /// of each, but for its borders.
    fn surface(&self, params: &Params) -> (f64, f64, f64) {
        let robust = params.method == Method::Robust;
        match self.moved {
            Some(true) => (1.0, 2.3, 1.97),
            Some(false) if params.relax > 0 => (0.0, 2.05, 1.98),
            None if params.relax > 0 => (0.5, 2.2, 1.97),
            _ if params.smooth > 0 => (0.0, 2.3, 1.9),
            _ if robust => (0.0, 2.7, 1.85),
            _ => (0.0, 2.7, 1.75),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MILLION: Known = Known {
        read: 1_000_000,
        spool: 12_000_000,
        points: 1_000_000,
        double: Some(false),
        moved: None,
    };

    #[test]
    fn more_is_known_later() {
        let params = Params::default();
        let first = MILLION.estimate(&params);
        let moved = |moved| {
            Known {
                moved: Some(moved),
                ..MILLION
            }
            .estimate(&params)
        };
        assert!(moved(false).scratch < first.scratch && first.scratch < moved(true).scratch);
        assert!(first.together >= first.scratch.max(first.output));
        let double = Known {
            double: Some(true),
            ..MILLION
        }
        .estimate(&params);
        assert_eq!(double.output - first.output, 12_000_000);
    }

    #[test]
    fn a_header_cannot_claim_more_than_its_file_holds() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cloud.ply");
        let header = "ply\nformat binary_little_endian 1.0\nelement vertex 1000000000000\n\
            property float x\nproperty float y\nproperty float z\nend_header\n";
        std::fs::write(&path, [header.as_bytes(), &[0; 1200]].concat()).unwrap();
        let known = Known::from_headers(&[path]);
        assert!(known.is_none_or(|known| known.points < 200), "{known:?}");
        assert!(Known::from_headers(&[folder.path().join("nothing")]).is_none());
    }
}
