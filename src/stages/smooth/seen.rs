//! Rough points: the test for one point, and their number in runs of points.

use super::{Relaxing, moved};
use crate::geom::Point;
use crate::method::METHOD;
use crate::stages::cells::Fit;
use crate::stages::spacing::{is_far, spacing2};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Rough points in a range of ids.
#[derive(Serialize, Deserialize)]
pub(super) struct Roughness {
    /// Its first run.
    pub first: usize,
    /// Rough points of each run.
    pub rough: Vec<u8>,
    pub moved: u64,
}

impl Roughness {
    pub fn of(ids: &Range<usize>) -> Self {
        let first = ids.start / METHOD.curve.run;
        Self {
            first,
            rough: vec![0; ids.end.div_ceil(METHOD.curve.run) - first],
            moved: 0,
        }
    }

    pub fn note(&mut self, id: usize, rough: bool) {
        self.rough[id / METHOD.curve.run - self.first] += u8::from(rough);
    }

    /// Writes the counts of the runs to `rough`.
    pub fn put(self, rough: &mut [u8]) {
        rough[self.first..][..self.rough.len()].copy_from_slice(&self.rough);
    }
}

impl Relaxing {
    /// The position to which a point moves, and true if the point is rough. `usual2` is the squared usual
    /// reach of its patch; a point off the surface stays.
    pub(super) fn target(&self, point: Point, fit: &Fit, usual2: u64) -> (Point, bool) {
        let off_surface = self.off_surface && is_far(fit.last2, usual2);
        let Some(normal) = fit.plane.normal.filter(|_| !off_surface) else {
            return (point, false);
        };
        let offset = fit.moments.project(normal);
        let length2 = offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2];
        let limit = METHOD.relax.rough * METHOD.relax.rough * spacing2(fit.last2, self.neighbors);
        (moved(point, offset), length2 > limit)
    }
}
