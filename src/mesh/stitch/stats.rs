//! Counts of the base and of the insertion.

use super::admissibility::Refusal;
use serde::{Deserialize, Serialize};

/// Counts of the base.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize, PartialEq, Eq)]
pub struct BaseStats {
    /// T3 triangles flagged at non-manifold edges and at vertices by excess.
    pub flagged: u64,
    /// Unfit T3 triangles: their points are collinear in the file, or a side is too long for the surface.
    pub unfit: u64,
    /// T3 triangles removed so that the rest can be oriented: they close a Möbius band.
    pub mobius: u64,
    /// Triangles of the base.
    pub triangles: u64,
}

/// Counts of the candidates by outcome.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize, PartialEq, Eq)]
pub struct InsertStats {
    /// Inserted candidates.
    pub accepted: u64,
    /// Failed test I: not properly connected to the mesh.
    pub unconnected: u64,
    /// Failed test II: an edge has two triangles.
    pub full_edge: u64,
    /// Failed test III: a vertex by excess.
    pub excess: u64,
    /// Failed the geometric test: the angle between normals is too large.
    pub angle: u64,
    /// Failed test IV: it would close a Möbius band.
    pub orientation: u64,
    /// Unfit, hence not tried: its points are collinear in the file, or a side is too long for the surface.
    pub unfit: u64,
    /// Inserted candidates that were removed again because the merges of different blocks contradict each
    /// other.
    pub merges_reverted: u64,
}

impl InsertStats {
    /// Counts a candidate that is not inserted.
    pub(super) fn refuse(&mut self, refusal: Refusal) {
        match refusal {
            Refusal::Unconnected => self.unconnected += 1,
            Refusal::FullEdge => self.full_edge += 1,
            Refusal::Excess => self.excess += 1,
            Refusal::Angle => self.angle += 1,
        }
    }

    /// Adds other counts.
    pub(super) fn add(&mut self, more: &InsertStats) {
        self.accepted += more.accepted;
        self.unconnected += more.unconnected;
        self.full_edge += more.full_edge;
        self.excess += more.excess;
        self.angle += more.angle;
        self.orientation += more.orientation;
        self.unfit += more.unfit;
        self.merges_reverted += more.merges_reverted;
    }
}
