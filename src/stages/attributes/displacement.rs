//! How far each point moved from where it was measured: a column of the mesh.

use super::StoredColumns;
use crate::blocks::Blocks;
use crate::order::PointStore;
use outcrop_disk::error::Result;
use outcrop_disk::spill::Table;
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_geom::distance2;
use outcrop_points::{Carried, Column};

/// The column with the distance of each point `after` smoothing from its place `before`, and the largest of them.
/// A step of the lattice has the length `step`, in the cloud's unit.
///
/// # Errors
/// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`], [`outcrop_disk::error::Error::Memory`], [`outcrop_disk::error::Error::Cancelled`].
pub fn displacement(
    [before, after]: [&PointStore; 2],
    step: f64,
    blocks: Blocks,
    workspace: &Workspace,
) -> Result<(StoredColumns, f64)> {
    let column = Column::displacement();
    let table = Table::new("displacement", blocks.count());
    let work = |unit: &Unit<'_>| {
        let ids = blocks.ids(unit.number()).indices();
        let (before, after) = (before.slice(ids.clone())?, after.slice(ids)?);
        let mut largest2 = 0;
        let words: Vec<u32> = before
            .iter()
            .zip(&after)
            .map(|(from, to)| {
                let moved2 = distance2(*from, *to);
                largest2 = largest2.max(moved2);
                Carried::word(&column, (moved2 as f64).sqrt() * step)
            })
            .collect();
        table.put(unit, unit.number(), bytemuck::cast_slice(&words))?;
        unit.advance(words.len() as u64);
        Ok(largest2)
    };
    // Two lists of positions with the rest of their pages, and the words.
    let size = |block| blocks.ids(block).len() + 2 * before.page_size();
    let bytes = |block| size(block) as u64 * (12 + 12 + 4);
    let mut largest2 = 0;
    let each = |_, found: u64| {
        largest2 = largest2.max(found);
        Ok(())
    };
    workspace.units("displacement", blocks.count(), bytes, work, each)?;
    let columns = StoredColumns::of(column.clone(), table, blocks);
    Ok((columns, (largest2 as f64).sqrt() * step))
}
