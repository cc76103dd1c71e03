//! What became of a mesh that was simplified.

#[cfg(feature = "levels")]
use super::CloseReport;
#[cfg(feature = "levels")]
use outcrop_levels::{crossed::Crossed, single::Goal};
use serde::{Deserialize, Serialize};

/// Triangles that cross others of the same mesh, before and after.
#[cfg(feature = "levels")]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Crossings {
    /// Those of the mesh that was read.
    pub before: Crossed,
    /// Those of the mesh that was made.
    pub after: Crossed,
}

/// What became of a mesh that was simplified.
#[cfg(feature = "levels")]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SimplifyReport {
    /// Vertices of the mesh that was read.
    pub vertices_before: u64,
    /// Triangles of the mesh that was read.
    pub triangles_before: u64,
    /// Vertices of the mesh that was made.
    pub vertices: u64,
    /// Triangles of the mesh that was made.
    pub triangles: u64,
    /// Triangles of the mesh that was read with two equal corners, which were left out.
    pub degenerate: u64,
    /// What was asked for.
    pub goal: Goal,
    /// The largest mean distance of a vertex from the planes of the triangles that it stands for.
    pub error: f64,
    /// How often all triangles were looked at.
    pub passes: u32,
    /// Triangles that cross others, in both meshes.
    pub crossings: Option<Crossings>,
    /// Distances between both meshes, as `compare` measures them: the first is the mesh that was read.
    pub measured: Option<outcrop_inspect::compare::Comparison>,
    /// The closing of what was left, if it was closed; the counts above are without it.
    pub closed: Option<CloseReport>,
}

#[cfg(feature = "levels")]
impl std::fmt::Display for SimplifyReport {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let part = 100.0 * self.triangles as f64 / self.triangles_before.max(1) as f64;
        write!(
            f,
            "{} of {} triangles ({part:.2} %), {} vertices",
            self.triangles, self.triangles_before, self.vertices
        )?;
        let wanted = match self.goal {
            Goal::Triangles(wanted) => wanted,
            Goal::Ratio(ratio) => (ratio * self.triangles_before as f64) as u64,
            Goal::Error(_) => u64::MAX,
        };
        if self.triangles > wanted.saturating_add(wanted / 50) {
            write!(
                f,
                "\nnot {wanted}: components and holes stay, and take triangles"
            )?;
        }
        if self.triangles == self.triangles_before {
            f.write_str("\nall of them: no fewer were asked for")?;
        }
        if self.degenerate > 0 {
            write!(
                f,
                "\nleft out: {} triangles with two equal corners",
                self.degenerate
            )?;
        }
        if let Some(Crossings { before, after }) = &self.crossings {
            let [before, after] = [before, after].map(|crossed| 100.0 * crossed.share());
            write!(
                f,
                "\ntriangles that cross others: {after:.4} %, before {before:.4} %"
            )?;
        }
        if let Some(measured) = &self.measured {
            let figures = &measured.symmetric.figures;
            write!(
                f,
                "\ndistance between both meshes: mean {:.6}, 99.9 % at most {:.6}, largest {:.6}",
                figures.mean, figures.p99_9, figures.max
            )?;
        }
        if let Some(closed) = &self.closed {
            write!(f, "\n{closed}")?;
        }
        Ok(())
    }
}

/// The simplified mesh of a build that makes none.
#[cfg(not(feature = "levels"))]
#[derive(Debug, Clone, Serialize, Deserialize)]
pub enum SimplifyReport {}

#[cfg(not(feature = "levels"))]
impl std::fmt::Display for SimplifyReport {
    fn fmt(&self, _: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match *self {}
    }
}
