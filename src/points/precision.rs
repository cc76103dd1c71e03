//! The precision in which coordinates are written.

use super::Spool;
use super::native::Native;
use super::source::Source;

/// Precision that suffices for writing the coordinates of the cloud.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum CoordinateType {
    /// Single precision: all inputs have it, or it moves no point by a tenth of a step or more.
    F32,
    /// Double precision.
    F64,
}

impl Spool {
    /// The precision in which coordinates are to be written.
    #[must_use]
    pub fn source_precision(&self) -> CoordinateType {
        let kept = || self.sources.iter().filter(|s| s.stats.any());
        if kept().all(|s| s.native == Native::F32) {
            return CoordinateType::F32;
        }
        let Ok(lattice) = self.choose_lattice(0) else {
            return CoordinateType::F64;
        };
        let bounds = kept().filter_map(Source::whole_bounds);
        let largest = bounds
            .flat_map(|b| b.into_iter().flatten())
            .fold(0.0, |m: f64, c| m.max(c.abs()));
        enough_for(lattice.step, largest)
    }
}

/// The precision needed for writing multiples of `step` up to `largest`.
pub fn enough_for(step: f64, largest: f64) -> CoordinateType {
    // Rounding to single precision moves a coordinate by at most 2^-24 of the largest power of two not above
    // it; for zero this is zero.
    let half_unit = libm::exp2(libm::log2(largest).floor()) * 2f64.powi(-24);
    if half_unit < step / 10.0 {
        CoordinateType::F32
    } else {
        CoordinateType::F64
    }
}
