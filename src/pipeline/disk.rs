//! Estimates of disk space: before a run starts, after reading the points, and after relaxing them.
//!
//! Scratch space has its peak where triples are put together and stitched: one or two stores of positions,
//! and all triples twice. The number of triples depends on noise, which is measured when the points are
//! relaxed: noisy points move, and a second store is written. This store is the only size that headers do not
//! determine: where noise makes more triples it makes fewer triangles, so scratch and mesh together have the
//! same size otherwise. Half a store is assumed, which is wrong by 4 bytes a point either way.
//!
//! A smaller or closed mesh, or levels of detail, are made from the whole mesh and need scratch after it (`after`): a
//! smaller mesh several times the bytes of the whole one.
//!
//! Unneeded files are not counted. They are deleted as soon as the deletion is synced
//! (`workspace/keeper.rs`), within a moment.

mod after;

pub(crate) use after::Files;

use super::Reconstruction;
use crate::params::{Method, Params, Smooth};
use crate::report::DiskEstimate;
use outcrop_disk::error::{Error, Result};
use outcrop_formats::Probe;
use outcrop_geom::aabb::Aabb;
use outcrop_geom::lattice::Lattice;
use outcrop_mesh_files::export::{self, CoordinateType, Mesh};
use outcrop_points::{Attributes, Column, Selection};
use outcrop_stages::order::StoredPoints;
use std::path::{Path, PathBuf};

/// Bytes of a position that is not packed: in sorted runs, and in the spool if its source has integers or
/// `f32`.
const POSITION: f64 = 12.0;

/// Bytes of a position in an ordered store. Measured: 4 to 8 for scans, 8.4 to 9.4 for coordinates of full
/// precision, fewer the more points there are.
const STORED: f64 = 8.5;

/// Bytes of the key of a position, packed, beside values on their way.
const SENT: f64 = 6.0;

/// Scratch bytes per triple at the peak: two copies, packed. Measured: 7.4 where nearly all are triangles,
/// 8.5 where most are candidates.
const TRIPLE: f64 = 8.2;

/// Scratch bytes per point while the mesh is written, beside the stores.
const EXPORT: f64 = 7.3;

/// Scratch bytes per point of the pieces of a cut mesh, beside the stores and the surface; and of their normals.
/// Measured on an outdoor scan of 3 M points, in 64 squares: 14.7 and 12.1.
const PIECES: f64 = 15.0;
const NORMALS: f64 = 12.2;

/// Size of a mesh that is compressed as a whole, as a share of the plain one, with coordinates of single and of
/// double precision. Measured: 0.31 (aerial scan) to 0.49, and 0.42 (generated clouds that fill the precision).
const COMPRESSED: [f64; 2] = [0.55, 0.45];

/// Bytes of the number of a scanner.
pub(crate) const SCANNER: u64 = 4;

/// Bytes of a normal that a point brings.
pub(crate) const NORMAL: u64 = outcrop_points::NORMAL_BYTES as u64;

/// Bytes that tell how far a point moved, and how well a vertex is supported, if the mesh has them.
pub(crate) fn made(attributes: &Attributes) -> u64 {
    let has = [attributes.has_displacement(), attributes.has_confidence()];
    has.map(|has| u64::from(has) * size_of::<f32>() as u64)
        .iter()
        .sum()
}

/// Part of the points in headers that are certainly different: duplicates are not known before they are read.
pub(crate) const DISTINCT: f64 = 0.5;

/// Part of the triangles that are certainly made of points that were counted.
pub(crate) const SURE: f64 = 0.9;

/// Checksums, boxes and other small data: bytes per point, and in all.
const SMALL: (f64, f64) = (0.8, 4096.0);

/// Properties of a cloud that are known at some stage.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Known {
    /// Points in the spool.
    pub read: u64,
    /// Bytes of the spool.
    pub spool: u64,
    /// Bytes of the content of the largest compressed input that is still to be read.
    pub decompressed: u64,
    /// Points that remain.
    pub points: u64,
    /// Bytes of the values that a point keeps.
    pub values: u64,
    /// Bytes of the number of its scanner, if that is carried.
    pub scanner: u64,
    /// Bytes of its normal, if that is carried.
    pub normal: u64,
    /// True if the mesh has coordinates in double precision; none if unknown.
    pub double: Option<bool>,
    /// True if points moved in relaxing; none if unknown.
    pub moved: Option<bool>,
    /// The coordinates in a mesh that is text, once they are known.
    pub text: Option<Text>,
}

/// Coordinates as text.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Text {
    /// Number of decimals.
    pub decimals: usize,
    /// Lowest and highest coordinates.
    pub bounds: [[f64; 3]; 2],
}

impl Text {
    /// The number of decimals for a cloud whose lattice is `own`. Without smoothing the vertices are points of
    /// the cloud, and need no finer lattice than they have.
    pub fn decimals(own: &Lattice, lattice: &Lattice, params: &Params) -> usize {
        let finer = params.smooth != Smooth::Rounds(0) || !own.exact;
        export::decimals(if finer { lattice } else { own })
    }

    /// The coordinates of ordered points, with so many decimals.
    pub fn of(decimals: usize, lattice: &Lattice, points: &StoredPoints) -> Self {
        let Aabb { min, max } = points.bounds();
        Self {
            decimals,
            bounds: [min, max].map(|corner| lattice.position(corner)),
        }
    }
}

/// Decimals assumed as long as they are unknown.
const DECIMALS: usize = 3;

impl Known {
    /// The properties in the headers of the inputs. They may be wrong, but cannot exceed the sizes of the
    /// files.
    ///
    /// # Errors
    /// Those of a header that cannot be read. Points may be readable nevertheless.
    pub fn from_headers(inputs: &[PathBuf], selection: &Selection) -> Result<Self> {
        let mut known = Self::default();
        let mut probes = Vec::new();
        for path in outcrop_formats::expand(inputs)? {
            let probe = outcrop_formats::probe_as(&path, &selection.layout)?;
            let points = probe.points_likely;
            known.read += points;
            let values = probe.value_bytes(&selection.attributes);
            known.values = known.values.max(values);
            let wanted = |bytes: u64, wanted| if wanted { bytes } else { 0 };
            let scanner = wanted(probe.scanner_bytes, selection.scanners);
            let normal = wanted(probe.normal_bytes, selection.normals);
            known.scanner = known.scanner.max(wanted(SCANNER, scanner > 0));
            known.normal = known.normal.max(wanted(NORMAL, normal > 0));
            known.spool += points * (probe.spool_bytes_per_point + values + scanner + normal);
            known.decompressed = known.decompressed.max(probe.decompressed_bytes);
            probes.push(probe);
        }
        known.points = known.read;
        known.values += made(&selection.attributes);
        known.double = double(&probes);
        Ok(known)
    }

    /// As [`Self::from_headers`]; instead of an error the warning for a run that could read the points nevertheless.
    pub fn or_warning(inputs: &[PathBuf], selection: &Selection) -> (Option<Self>, Option<String>) {
        match Self::from_headers(inputs, selection) {
            Ok(known) => (Some(known), None),
            Err(e) => {
                let warning = format!("disk space was not estimated from headers: {e}");
                (None, Some(warning))
            }
        }
    }

    /// Checks that the mesh of the points will not exceed a limit of the format of `output`. Refused is what
    /// exceeds it even if only `certain` of the points were left, as a part of 1; else the error is returned, for a
    /// warning.
    ///
    /// # Errors
    /// [`crate::Error::TooLarge`].
    pub fn fits(&self, params: &Params, output: &Path, certain: f64) -> Result<Option<Error>> {
        let size = |part: f64| {
            let points = (self.points as f64 * part) as u64;
            let known = Self { points, ..*self };
            export::check_size(output, &known.mesh(params, CoordinateType::Float), true)
        };
        let likely = size(1.0);
        if size(certain).is_err() {
            return likely.map(|()| None);
        }
        Ok(likely.err())
    }

    /// Warnings about what the format of the mesh leaves out, of points with these columns, in coordinates from
    /// `origin`.
    pub fn left_out(
        &self,
        job: &Reconstruction,
        columns: &[Column],
        (coordinates, origin): (CoordinateType, [f64; 3]),
    ) -> Result<Vec<String>> {
        let bounds = self.text.map(|text| text.bounds).unwrap_or_default();
        let away = |corner: [f64; 3]| (0..3).map(move |k| (corner[k] - origin[k]).abs());
        let largest = bounds.into_iter().flat_map(away).fold(0.0, f64::max);
        let mut mesh = self.mesh(&job.params, coordinates);
        mesh.columns.extend(columns.iter().map(Into::into));
        export::left_out(&job.mesh, &mesh, largest, &*job.observer)
    }

    /// The mesh that is expected.
    fn mesh(&self, params: &Params, coordinates: CoordinateType) -> Mesh {
        let (_, _, triangles) = self.surface(params);
        Mesh {
            vertices: self.points,
            triangles: (triangles * self.points as f64) as u64,
            coordinates,
            columns: export::normal_columns()
                .filter(|_| params.normals)
                .collect(),
            bounds: self.text.map(|text| text.bounds),
            decimals: self.text.map_or(DECIMALS, |text| text.decimals),
            compress: params.compress_glb,
            ..Mesh::default()
        }
    }

    /// The estimated space of a run with these parameters.
    pub fn estimate(&self, params: &Params, files: Files<'_>) -> DiskEstimate {
        let points = self.points as f64;
        let (moved, triples, _) = self.surface(params);
        let stores = STORED * (1.0 + moved);
        // While points are read and sorted they are on disk twice.
        let early = self.spool as f64 + STORED * points;
        let mut early = early.max((self.spool + self.decompressed) as f64);
        let (read, values) = (self.read as f64, self.values as f64);
        let (scanner, normal) = (self.scanner as f64, self.normal as f64);
        if self.values + self.scanner + self.normal > 0 {
            // The spool stays until the values are in the order of ids.
            let sent = SENT + values + scanner + normal;
            early = early.max(self.spool as f64 + POSITION * read);
            early = early.max(self.spool as f64 + STORED * points + sent * read);
        }
        if params.thin.is_some() {
            early = early.max(self.spool as f64 + 2.0 * POSITION * self.read as f64);
        }
        if params.smooth.rounds() > 0 || params.drop_outliers.is_some() {
            early = early.max(2.0 * STORED * points);
        }
        if params.relax > 1 {
            early = early.max(STORED * (1.0 + 2.0 * moved) * points);
        }
        // Points side by side have the same scanner, mostly.
        let kept = values + normal + scanner / 4.0;
        let cut = params.crop.is_some() || params.split.is_some();
        let pieces = match (cut, params.normals) {
            (false, true) if params.compress_glb => NORMALS,
            (false, _) => 0.0,
            (true, false) => PIECES,
            (true, true) => PIECES + NORMALS,
        };
        let late = (TRIPLE * triples).max(EXPORT + pieces);
        let late = (stores + kept + late) * points;
        let small = |bytes: f64| bytes + SMALL.0 * points + SMALL.1;
        let whole = self.mesh_bytes(params, files.mesh, None);
        let made = self.made(params, &files);
        let after = small((stores + kept) * points) + self.factor(params, &files) * whole;
        let scratch = small(early.max(late)).max(after);
        let export = small((stores + values + EXPORT.max(pieces)) * points) + whole;
        DiskEstimate {
            scratch: scratch as u64,
            output: (whole + made) as u64,
            together: scratch.max(export).max(after + whole + made) as u64,
        }
    }

    /// The size of a mesh of all points, or of one with this number of triangles.
    fn mesh_bytes(&self, params: &Params, output: &Path, triangles: Option<u64>) -> f64 {
        let of = |coordinates| {
            let mut mesh = self.mesh(params, coordinates);
            if let Some(triangles) = triangles.filter(|wanted| *wanted < mesh.triangles) {
                (mesh.vertices, mesh.triangles) = (triangles / 2, triangles);
            }
            let bytes = export::mesh_bytes(output, &mesh);
            let plain = (bytes + self.values * mesh.vertices) as f64;
            match export::is_compressed(output) {
                true if !params.compress_glb => match coordinates {
                    CoordinateType::Float => COMPRESSED[0] * plain,
                    CoordinateType::Double => COMPRESSED[1] * plain,
                },
                _ => plain,
            }
        };
        match self.double {
            Some(false) => of(CoordinateType::Float),
            Some(true) => of(CoordinateType::Double),
            None => (of(CoordinateType::Float) + of(CoordinateType::Double)) / 2.0,
        }
    }

    /// Size of a second store as a share of the first, triples per point and triangles per point. A surface
    /// without noise has two triples and two triangles per point, except at its boundary.
    fn surface(&self, params: &Params) -> (f64, f64, f64) {
        let robust = params.method == Method::Robust;
        match self.moved {
            Some(true) => (1.0, 2.3, 1.97),
            Some(false) if params.relax > 0 => (0.0, 2.05, 1.98),
            None if params.relax > 0 => (0.5, 2.2, 1.97),
            _ if params.smooth.rounds() > 0 => (0.0, 2.3, 1.9),
            _ if robust => (0.0, 2.7, 1.85),
            _ => (0.0, 2.7, 1.75),
        }
    }
}

/// True if the mesh of these files will have double precision; none if the headers do not decide it.
fn double(probes: &[Probe]) -> Option<bool> {
    let single = |p: &Probe| p.scale.is_none() && p.spool_bytes_per_point <= POSITION as u64;
    if probes.iter().all(single) {
        return Some(false);
    }
    let (mut step, mut largest) = (f64::INFINITY, 0f64);
    for probe in probes {
        // For other formats it depends on the coordinates.
        let (scale, bounds) = (probe.scale?, probe.bounds?);
        step = scale.iter().fold(step, |least, s| least.min(s.abs()));
        for c in bounds.into_iter().flatten() {
            if !c.is_finite() {
                return None;
            }
            largest = largest.max(c.abs());
        }
    }
    Some(outcrop_points::enough_for(step, largest) == outcrop_points::CoordinateType::F64)
}

#[cfg(test)]
mod tests;
