//! The lengths of the edges of all cells, by which a lossy tileset is rounded.

use super::cells::Cells;
use super::intake::Intake;
use super::rounding::{bits, median2};
use super::shared::{bytes, local};
use outcrop_disk::error::Result;
use outcrop_disk::workspace::{Unit, Workspace};

/// By cell: the low bits of positions that it rounds away.
pub(super) fn rounding(intake: &Intake, cells: &Cells, workspace: &Workspace) -> Result<Vec<u8>> {
    let list = &cells.cells;
    let work = |unit: &Unit<'_>| {
        let rows = cells.table.get(unit, unit.number())?;
        let (ids, triangles) = local(&rows);
        let mut points = Vec::with_capacity(ids.len());
        intake.vertices(unit, ids.into_iter(), |v| points.push(v.point))?;
        unit.advance(triangles.len() as u64);
        Ok(bits(median2(&points, &triangles)))
    };
    let mut all = vec![0; list.len()];
    let bytes_of = |n: usize| bytes(intake, list[n].triangles);
    let name = ("lengths of edges", "levels: cells");
    workspace.units(name, list.len(), bytes_of, work, |cell, found| {
        all[cell] = found;
        Ok(())
    })?;
    Ok(all)
}
