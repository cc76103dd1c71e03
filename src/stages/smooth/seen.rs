//! What is seen of a point when its plane is known, and of many.

use super::moved;
use super::pass::RUN;
use crate::geom::Point;
use crate::stages::cells::Fit;
use crate::workspace::persist::persist;
use std::ops::Range;

/// A point is rough if it lies farther from its plane than this part of the local spacing.
const ROUGH: f64 = 0.2;

/// What was seen of a range of ids.
pub(super) struct Seen {
    /// Its first run.
    pub first: usize,
    /// Rough points of each run.
    pub rough: Vec<u8>,
    pub moved: u64,
}

persist!(Seen {
    first,
    rough,
    moved
});

impl Seen {
    pub fn of(ids: &Range<usize>) -> Self {
        let first = ids.start / RUN;
        Self {
            first,
            rough: vec![0; ids.end.div_ceil(RUN) - first],
            moved: 0,
        }
    }

    pub fn note(&mut self, id: usize, rough: bool) {
        self.rough[id / RUN - self.first] += u8::from(rough);
    }

    /// Takes over what was seen of each run.
    pub fn put(self, rough: &mut [u8]) {
        rough[self.first..][..self.rough.len()].copy_from_slice(&self.rough);
    }
}

/// Where a point goes, and whether that is far.
pub(super) fn target(point: Point, fit: &Fit, neighbors: usize) -> (Point, bool) {
    let Some(normal) = fit.plane.normal else {
        return (point, false);
    };
    let offset = fit.moments.project(normal);
    let length2 = offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2];
    let limit = ROUGH * ROUGH * spacing2(fit.last2, neighbors);
    (moved(point, offset), length2 > limit)
}

/// The square of the local spacing: on a plane, so many neighbours lie in the disk up to the last one,
/// which is so far away.
pub(super) fn spacing2(last2: u64, neighbors: usize) -> f64 {
    std::f64::consts::PI * last2 as f64 / neighbors as f64
}
