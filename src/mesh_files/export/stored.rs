//! Normals by vertex in scratch, for meshes whose parts have vertices of other parts too.

use super::normals::Normals;
use super::parts::{Parts, Whole};
use crate::cut::Normal;
use outcrop_disk::error::Result;
use outcrop_disk::spill::Table;
use outcrop_disk::workspace::memory::bytes_of;
use outcrop_disk::workspace::{Unit, Workspace};

/// The table of the normals of the whole surface: of each block those of its vertices, then of its copies.
pub fn table(blocks: usize) -> Table<Normal> {
    Table::new("export.normals", blocks)
}

/// Computes the normals of all blocks.
///
/// # Errors
/// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`], [`outcrop_disk::error::Error::Memory`], [`outcrop_disk::error::Error::Cancelled`].
pub fn make(parts: &Whole<'_>, workspace: &Workspace) -> Result<()> {
    let memory = |block| {
        let [points, triangles] = parts.sizes(workspace, block);
        Normals::estimate(points, triangles) + 40 * points + (1 << 20)
    };
    let work = |unit: &Unit<'_>| {
        let block = unit.number();
        let ids = parts.vertices(unit, block, false)?;
        let (own, copies) = parts.both_normals(unit, block, &ids)?;
        let rows = own.into_iter().chain(copies);
        let rows: Vec<Normal> = rows.map(|direction| Normal { direction }).collect();
        let _held = unit.hold(bytes_of(&rows));
        parts.normals.put(unit, block, &rows)
    };
    workspace.units("export: normals", parts.count(), memory, work, |_, ()| {
        Ok(())
    })
}

/// The normals of the vertices with these numbers in the mesh; one part is in memory at a time.
///
/// # Errors
/// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`].
pub fn of_vertices<P: Parts>(
    parts: &P,
    unit: &Unit<'_>,
    numbers: impl Iterator<Item = u32>,
) -> Result<Vec<[f32; 3]>> {
    let mut wanted: Vec<(u32, u32)> = numbers.zip(0..).collect();
    wanted.sort_unstable();
    let mut found = vec![[0.0; 3]; wanted.len()];
    let points = parts.stats().points_used;
    let (mut section, mut loaded) = (Vec::new(), usize::MAX);
    for (number, at) in wanted {
        let number = u64::from(number);
        let kind = usize::from(number >= points);
        let part = part_of(parts, number, kind);
        if part != loaded {
            section = parts.stored_normals(unit, part)?;
            loaded = part;
        }
        let first = parts.firsts(part);
        let before = match kind {
            0 => 0,
            _ => part_end(parts, part, 0) - first[0],
        };
        let normal = section.get((before + number - first[kind]) as usize);
        found[at as usize] = normal.map_or([0.0, 0.0, 1.0], |normal| normal.direction);
    }
    Ok(found)
}

/// Number behind the last vertex or copy of a part.
fn part_end<P: Parts>(parts: &P, part: usize, kind: usize) -> u64 {
    if part + 1 < parts.count() {
        return parts.firsts(part + 1)[kind];
    }
    let stats = parts.stats();
    [stats.points_used, stats.vertices][kind]
}

/// The part that has a vertex, or a copy.
fn part_of<P: Parts>(parts: &P, number: u64, kind: usize) -> usize {
    let (mut low, mut high) = (0, parts.count());
    // The first part that begins behind it.
    while low < high {
        let middle = low.midpoint(high);
        if parts.firsts(middle)[kind] <= number {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    low.saturating_sub(1)
}
