//! The directions of the disks of a tile whose points bring normals.

use crate::ids::Id;
use crate::normals::{Given, InputNormals, Normals};
use outcrop_disk::workspace::memory::bytes_of;
use outcrop_paper::plane::{Moments, Normal};
use serde::{Deserialize, Serialize};

/// The normals that points bring, and what is done with them.
#[derive(Debug, Clone, Copy)]
pub struct InputDirections<'a> {
    /// The normals.
    pub normals: Normals<'a>,
    /// Their use.
    pub wanted: InputNormals,
}

impl InputDirections<'_> {
    /// Bytes of memory for those of `ids` points while they are read, and then used.
    #[must_use]
    pub fn bytes(&self, ids: usize) -> u64 {
        self.normals.bytes(ids) + ids as u64
    }
}

/// Disks by the origin of their direction.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct DiskStats {
    /// With the normal of the point.
    pub used: u64,
    /// With the estimated normal, since that of the point does not suit the points around it.
    pub disagreeing: u64,
}

impl DiskStats {
    /// Adds other counts.
    pub fn add(&mut self, more: Self) {
        self.used += more.used;
        self.disagreeing += more.disagreeing;
    }
}

/// Marks of points.
const USED: u8 = 1;
const DISAGREEING: u8 = 2;

/// The normals of the points of a tile, and marks of those that were looked at.
#[derive(Debug)]
pub(super) struct Directions {
    given: Given,
    always: bool,
    marks: Vec<u8>,
}

impl Directions {
    pub(super) fn new(given: Given, wanted: InputNormals) -> Self {
        Self {
            always: wanted == InputNormals::Use,
            marks: vec![0; given.ids().len()],
            given,
        }
    }

    pub(super) fn bytes(&self) -> u64 {
        self.given.bytes() + bytes_of(&self.marks)
    }

    /// The direction of the disk of a point, from that estimated of its neighbours. They have these moments, and the
    /// last of them has this squared distance.
    pub(super) fn choose(
        &mut self,
        id: Id,
        estimated: Option<Normal>,
        (moments, last2): (&Moments, u64),
    ) -> Option<Normal> {
        // Neighbours in one place are no surface.
        let Some(given) = self.given.of(id).filter(|_| last2 > 0) else {
            return estimated;
        };
        let suits = |estimated| self.always || moments.suits(estimated, given);
        let used = estimated.is_none_or(suits);
        let number = self.given.ids().find(id);
        if let Some(mark) = self.marks.get_mut(number) {
            *mark = if used { USED } else { DISAGREEING };
        }
        if used { Some(given) } else { estimated }
    }

    /// The counts so far.
    pub(super) fn stats(&self) -> DiskStats {
        let count = |mark| self.marks.iter().filter(|m| **m == mark).count() as u64;
        DiskStats {
            used: count(USED),
            disagreeing: count(DISAGREEING),
        }
    }
}
