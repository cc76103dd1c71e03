//! What became of a mesh that was closed.

use serde::{Deserialize, Serialize};
use std::fmt;

/// What became of a mesh that was closed.
#[cfg(feature = "levels")]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CloseReport {
    /// Vertices of the mesh that was read.
    pub vertices_before: u64,
    /// Triangles of the mesh that was read.
    pub triangles_before: u64,
    /// Vertices of the mesh that was made.
    pub vertices: u64,
    /// Triangles of the mesh that was made.
    pub triangles: u64,
    /// What was asked for.
    pub kind: outcrop_levels::close::Kind,
    /// What was done.
    pub closed: outcrop_levels::close::ClosingStats,
}

/// One noun for one, another for several.
#[cfg(feature = "levels")]
fn counted(count: u64, one: &str, more: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { more })
}

#[cfg(feature = "levels")]
impl fmt::Display for CloseReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let stats = &self.closed;
        let all = stats.all();
        if all.loops == 0 {
            f.write_str("the mesh has no boundary: it stays as it is")?;
        } else {
            let loops = counted(all.loops, "loop", "loops");
            write!(f, "closed {loops} of {} edges", all.edges)?;
        }
        let ways = [
            (stats.smooth, "smoothly"),
            (stats.lids, "by lids"),
            (stats.base, "by walls and a floor"),
        ];
        for (part, how) in ways.iter().filter(|(part, _)| part.loops > 0) {
            write!(
                f,
                "\n  {:<22}{}, {}, area {:.6}",
                how,
                counted(part.loops, "loop", "loops"),
                counted(part.triangles, "triangle", "triangles"),
                part.area
            )?;
        }
        if let Some(z) = stats.floor {
            write!(f, "\nthe floor is at {z}")?;
        }
        if stats.flattened > 0 {
            let loops = counted(stats.flattened, "loop", "loops");
            write!(
                f,
                "\n{loops} got a lid, as the smooth patch crossed the mesh more"
            )?;
        }
        if stats.too_long > 0 {
            let loops = counted(stats.too_long, "loop", "loops");
            write!(f, "\n{loops} got a lid, too long to be closed smoothly")?;
        }
        if stats.crossing > 0 {
            let loops = counted(stats.crossing, "loop", "loops");
            let triangles = counted(stats.crossed_triangles, "triangle", "triangles");
            write!(
                f,
                "\npatches of {loops} cross {triangles} of the mesh or of patches"
            )?;
        }
        if stats.overlaps > 0 {
            let overlaps = counted(stats.overlaps, "triangle", "triangles");
            write!(
                f,
                "\n{overlaps} of the floor overlap others: the rim crosses itself in plan"
            )?;
        }
        if stats.pinched > 0 {
            let vertices = counted(stats.pinched, "vertex", "vertices");
            write!(f, "\nseveral loops meet at {vertices}")?;
        }
        if stats.crowded > 0 {
            let edges = counted(stats.crowded, "edge", "edges");
            write!(
                f,
                "\n{edges} with several triangles the same way: no manifold there"
            )?;
        }
        write!(
            f,
            "\n{} triangles, {} vertices",
            self.triangles, self.vertices
        )
    }
}

/// The closed mesh of a build that makes none.
#[cfg(not(feature = "levels"))]
#[derive(Debug, Clone, Serialize, Deserialize)]
pub enum CloseReport {}

#[cfg(not(feature = "levels"))]
impl fmt::Display for CloseReport {
    fn fmt(&self, _: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {}
    }
}
