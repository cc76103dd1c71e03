//! What a run would read of an input, as its header and the hierarchy of its nodes tell it.

use super::input::Input;
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::memory::{MemoryPool, Reservation};
use outcrop_disk::workspace::progress::Cancel;
use serde::Serialize;

/// What a run reads of a file. Nothing of it is verified.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Reads {
    /// Bytes of the points that are read.
    pub bytes: u64,
    /// Bytes of all points: the size of the file, or of all tiles.
    pub bytes_of_all: u64,
    /// Number of these points.
    pub points: u64,
    /// Number of the parts in which they are: chunks of COPC, or tiles. None if the file is read as a whole.
    pub parts: Option<u64>,
    /// True if the bytes are estimated from the number of points.
    pub is_estimated: bool,
}

impl Reads {
    /// All of a file with so many points.
    pub(super) fn whole(input: &Input, points: u64) -> Self {
        Self {
            bytes: input.size,
            bytes_of_all: input.size,
            points,
            ..Self::default()
        }
    }

    /// The same of several files.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        let parts = |of: Self| of.parts.unwrap_or(0);
        Self {
            bytes: self.bytes.saturating_add(other.bytes),
            bytes_of_all: self.bytes_of_all.saturating_add(other.bytes_of_all),
            points: self.points.saturating_add(other.points),
            parts: self
                .parts
                .or(other.parts)
                .map(|_| parts(self) + parts(other)),
            is_estimated: self.is_estimated || other.is_estimated,
        }
    }
}

/// What bounds the reading of a hierarchy: it needs no scratch folder.
#[derive(Clone, Copy)]
pub(super) struct Means<'a> {
    pub(super) memory: &'a MemoryPool,
    pub(super) cancel: &'a Cancel,
}

impl<'a> Means<'a> {
    pub(super) fn of(workspace: &'a Workspace) -> Self {
        Self {
            memory: &workspace.memory,
            cancel: &workspace.cancel,
        }
    }

    pub(super) fn reserve(self, name: &'static str, bytes: u64) -> Result<Reservation> {
        self.memory.reserve(name, bytes)
    }
}
