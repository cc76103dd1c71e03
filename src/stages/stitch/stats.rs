//! Counts of the base and of the insertion.

use super::admissibility::Refusal;
use crate::workspace::persist::persist;
use serde::Serialize;

/// Counts of the base.
#[derive(Debug, Clone, Copy, Default, Serialize, PartialEq, Eq)]
pub struct BaseStats {
    /// T3 triangles flagged at non-manifold edges and vertices by excess.
    pub flagged: u64,
    /// T3 triangles left out because their points are on a line in the file, or a side is too long for the
    /// surface.
    pub unfit: u64,
    /// T3 triangles removed so that the rest can be oriented: they close a Möbius band.
    pub mobius: u64,
    /// Triangles of the base.
    pub triangles: u64,
}

/// What became of the candidates.
#[derive(Debug, Clone, Copy, Default, Serialize, PartialEq, Eq)]
pub struct InsertStats {
    /// Inserted.
    pub accepted: u64,
    /// Test I: not properly connected to the mesh.
    pub unconnected: u64,
    /// Test II: an edge with two triangles.
    pub full_edge: u64,
    /// Test III: a vertex by excess.
    pub excess: u64,
    /// Geometric test: normals too different.
    pub angle: u64,
    /// Test IV: would close a Möbius band.
    pub orientation: u64,
    /// Not tried: its points are on a line in the file, or a side is too long for the surface.
    pub unfit: u64,
    /// Of the accepted, those taken out again because blocks joined components differently.
    pub joints_removed: u64,
    /// Triangles of the base that were cut; counted with those of the base.
    #[serde(skip)]
    pub(super) cut: u64,
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
        self.joints_removed += more.joints_removed;
        self.cut += more.cut;
    }
}

persist!(BaseStats {
    flagged,
    unfit,
    mobius,
    triangles
});
persist!(InsertStats {
    accepted,
    unconnected,
    full_edge,
    excess,
    angle,
    orientation,
    unfit,
    joints_removed,
    cut
});
