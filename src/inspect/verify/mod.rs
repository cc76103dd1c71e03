//! Is a mesh file a clean manifold? Decided in bounded memory, whatever the size of the mesh.
//!
//! The file is read once. Every triangle goes to the *range* of consecutive vertex ids of each of
//! its corners; then the ranges are visited from the last to the first, one in memory at a time.
//! Inside a range all triangles around a vertex are known, so everything local is decided there.
//! What is not local moves down: an edge that leaves a range by its lower end is contracted to the
//! roots of a union–find and handed to the range of that end (`contract`), and so is a triangle
//! whose corners' positions are not all at hand (`area`). No result depends on the size of the
//! ranges.

mod area;
mod bounds;
mod buckets;
mod collinear;
mod contract;
mod corners;
mod intake;
mod plan;
mod positions;
mod star;
mod sweep;
#[cfg(test)]
mod tests;
mod verdict;

pub use bounds::Bounds;
pub use verdict::Verdict;

use super::ply_mesh::PlyMesh;
use crate::error::Result;
use crate::workspace::Workspace;
use plan::Plan;
use std::path::Path;

/// What [`verify_with`] should let pass, and how it works.
#[derive(Debug, Clone, Copy, Default)]
pub struct Options {
    /// Vertices that no triangle uses are not a defect.
    pub allow_unreferenced: bool,
    /// Vertices held in memory at a time, rounded down to a power of two, but at least one in
    /// 65536 of the mesh; by default as many as the memory budget allows. The verdict does not
    /// depend on it.
    pub range: Option<u32>,
}

/// Checks the mesh file `mesh` (PLY) against every defect that [`Verdict`] counts.
///
/// # Errors
/// [`crate::Error::Input`] if the file is not a readable PLY mesh; [`crate::Error::Io`],
/// [`crate::Error::Corrupt`] from the scratch folder; [`crate::Error::Memory`] if the free part
/// of the budget is too small, or one vertex has more triangles than fit;
/// [`crate::Error::Cancelled`].
pub fn verify(mesh: &Path, workspace: &Workspace) -> Result<Verdict> {
    verify_with(mesh, &Options::default(), workspace)
}

/// Like [`verify`], with options.
///
/// # Errors
/// See [`verify`].
pub fn verify_with(mesh: &Path, options: &Options, workspace: &Workspace) -> Result<Verdict> {
    let mesh = PlyMesh::open(mesh)?;
    let free = workspace.memory.available();
    let plan = Plan::new(mesh.vertices(), mesh.faces(), free, options.range);
    check(mesh, &plan, options, workspace)
}

fn check(mesh: PlyMesh, plan: &Plan, options: &Options, workspace: &Workspace) -> Result<Verdict> {
    let _held = plan.reserve(workspace)?;
    let intake = intake::read(mesh, plan, workspace)?;
    let (counts, bounds) = (intake.counts, intake.bounds);
    let swept = workspace.install(|| sweep::run(intake, plan, workspace))?;
    Ok(Verdict::new(&counts, bounds, &swept, options))
}
