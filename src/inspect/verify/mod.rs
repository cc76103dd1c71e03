//! Checks that a mesh file is a clean manifold, in bounded memory, for meshes of any size.
//!
//! The file is read once. Every triangle is sent to the *range* of consecutive vertex ids of each of its
//! corners. Then the ranges are processed from the last to the first, one in memory at a time. All triangles
//! around a vertex of the range are known there, so local properties are decided at once. Other data move
//! down: an edge to a lower range is contracted to the roots of a union–find and sent to the range of its
//! lower end (`contract`), and so is a triangle with corners whose positions are not in memory (`area`). No
//! result depends on the size of the ranges.

mod area;
mod bounds;
mod buckets;
mod collinear;
mod contract;
mod corners;
#[cfg(feature = "pictures")]
mod drawing;
mod homes;
mod intake;
mod near;
mod piece;
mod places;
mod plan;
mod positions;
mod star;
mod sweep;
#[cfg(test)]
mod tests;
mod verdict;
mod volume;

pub use bounds::Bounds;
#[cfg(feature = "pictures")]
pub use drawing::{Illustration, Place};
pub use places::Kind;
pub use verdict::Verdict;

use homes::Division;
use outcrop_codecs::ply_mesh::PlyMesh;
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Workspace;
use places::Places;
use plan::Plan;
use std::path::Path;

/// Options of [`verify_with`].
#[derive(Debug, Clone, Copy, Default)]
pub struct Options {
    /// Accept vertices without a triangle.
    pub allow_unreferenced: bool,
    /// Vertices held in memory at a time, rounded down to a power of two, but at least 1/65536 of the mesh.
    /// Default: as many as the memory budget allows. The verdict does not depend on it.
    pub range: Option<u32>,
}

/// Checks the mesh file `mesh` (PLY) for every defect in [`Verdict`].
///
/// # Errors
/// [`outcrop_disk::error::Error::Input`] if the file is not a readable PLY mesh; [`outcrop_disk::error::Error::Io`],
/// [`outcrop_disk::error::Error::Corrupt`] from the scratch folder; [`outcrop_disk::error::Error::Memory`] if the free part
/// of the budget is too small, or one vertex has more triangles than fit;
/// [`outcrop_disk::error::Error::Cancelled`].
pub fn verify(mesh: &Path, workspace: &Workspace) -> Result<Verdict> {
    verify_with(mesh, &Options::default(), workspace)
}

/// Like [`verify`], with options.
///
/// # Errors
/// See [`verify`].
pub fn verify_with(mesh: &Path, options: &Options, workspace: &Workspace) -> Result<Verdict> {
    examined(mesh, options, workspace).map(|(verdict, _)| verdict)
}

/// Like [`verify_with`], with pictures and the places of defects for `outcrop::page::verdict`.
///
/// # Errors
/// See [`verify`].
#[cfg(feature = "pictures")]
pub fn illustrated(
    mesh: &Path,
    options: &Options,
    workspace: &Workspace,
) -> Result<(Verdict, Illustration)> {
    let (verdict, places) = examined(mesh, options, workspace)?;
    let illustration = drawing::illustrate(mesh, places, &verdict, workspace)?;
    Ok((verdict, illustration))
}

fn examined(mesh: &Path, options: &Options, workspace: &Workspace) -> Result<(Verdict, Places)> {
    let mesh = PlyMesh::open_any(mesh, workspace)?;
    if let Some(found) = by_pieces(&mesh, options, workspace)? {
        return Ok(found);
    }
    let free = workspace.memory.available();
    let plan = Plan::new(mesh.vertices(), mesh.faces(), free, options.range);
    check(mesh, &plan, options, workspace)
}

/// The verdict on a mesh that can be read by pieces.
fn by_pieces(
    mesh: &PlyMesh,
    options: &Options,
    workspace: &Workspace,
) -> Result<Option<(Verdict, Places)>> {
    let free = workspace.memory.available();
    let Some(fixed) = mesh.fixed()? else {
        return Ok(None);
    };
    let division = near::division(mesh, fixed.entries(), workspace.threads, free);
    let plan = Plan::of_rims(mesh.vertices(), mesh.faces(), free / 2, options.range);
    let (Some(division), Some(plan)) = (division, plan) else {
        return Ok(None);
    };
    check_pieces(mesh, division, &plan, options, workspace)
}

fn check_pieces(
    mesh: &PlyMesh,
    division: Division,
    plan: &Plan,
    options: &Options,
    workspace: &Workspace,
) -> Result<Option<(Verdict, Places)>> {
    let Some(fixed) = mesh.fixed()? else {
        return Ok(None);
    };
    let _held = plan.reserve(workspace)?;
    let Some(intake) = near::read(&fixed, division, plan, workspace)? else {
        return Ok(None);
    };
    let swept = workspace.install(|| sweep::run(intake, plan, workspace))?;
    Ok(Some(finished(swept, mesh.origin(), mesh.place(), options)))
}

fn check(
    mesh: PlyMesh,
    plan: &Plan,
    options: &Options,
    workspace: &Workspace,
) -> Result<(Verdict, Places)> {
    let _held = plan.reserve(workspace)?;
    let (origin, place) = (mesh.origin(), mesh.place());
    let intake = intake::read(mesh, plan, workspace)?;
    let swept = workspace.install(|| sweep::run(intake, plan, workspace))?;
    Ok(finished(swept, origin, place, options))
}

fn finished(
    (verdict, places): (Verdict, Places),
    origin: Option<[f64; 3]>,
    place: impl Fn([f64; 3]) -> [f64; 3],
    options: &Options,
) -> (Verdict, Places) {
    // Areas are judged by the coordinates in the file, which are exact.
    let bounds = verdict.bounds.map(|Bounds { min, max }| Bounds {
        min: place(min),
        max: place(max),
    });
    let verdict = Verdict {
        bounds,
        origin,
        ..verdict
    };
    (verdict.judged(options), places)
}
