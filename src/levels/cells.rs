//! Division of the triangles into the cells of an octree: the leaves.
//!
//! A triangle belongs to the cell of its smallest vertex; none is cut. A cell is divided as long as it has more
//! than [`MOST`] triangles, down to [`DEEPEST`]. Triangles are sorted along the Z-order curve, on which each cell
//! is an interval, so that one look ahead decides.

use super::intake::{BLOCK, Intake, Stored};
use super::rows::{CellTriangle, PlacedTriangle};
use outcrop_disk::error::Result;
use outcrop_disk::spill::{Sorter, Table};
use outcrop_disk::workspace::{Unit, Workspace};
use serde::{Deserialize, Serialize};

/// Largest number of triangles of a cell, unless it cannot be divided.
pub(super) const MOST: u32 = 1 << 16;

/// Depth of the smallest cells.
pub(super) const DEEPEST: u32 = 21;

/// A cell with its triangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Cell {
    /// The first key in it.
    pub key: u64,
    /// Its depth in the octree.
    pub depth: u32,
    pub triangles: u32,
}

/// All cells that have triangles, along the curve.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Cells {
    pub cells: Vec<Cell>,
    pub table: Table<CellTriangle>,
}

/// How triangles are divided.
pub(super) struct Division {
    /// Largest number of triangles of a cell, unless it cannot be divided.
    pub most: u32,
    /// Thirds of the cube by which the octree is moved. The planes of all its cells are then at least a third of
    /// a cell from those of the octree that is moved by another number of thirds.
    pub thirds: u64,
    /// The name of the step.
    pub step: String,
    /// Names of the scratch files: triangles along the curve, and by cell.
    pub placed: String,
    pub cells: String,
}

impl Division {
    /// The key of a position on the lattice with so many bits.
    fn place(&self, bits: u32) -> impl Fn([u32; 3]) -> u64 + Sync + use<> {
        let thirds = self.thirds;
        move |point| match thirds {
            0 => key(point, bits),
            _ => {
                let moved = ((1u64 << bits) * thirds / 3) as u32;
                key(point.map(|x| x.saturating_add(moved)), bits + 1)
            }
        }
    }
}

/// The key of a position on the curve: 21 bits of each coordinate, interleaved.
pub(super) fn key(point: [u32; 3], bits: u32) -> u64 {
    point.iter().fold(0, |key, &x| {
        let x = u64::from(x) << DEEPEST >> bits;
        key << 1 | spread(x & ((1 << DEEPEST) - 1))
    })
}

/// Moves bit `n` to bit `3 n`.
fn spread(x: u64) -> u64 {
    let mut x = x;
    for (shift, mask) in [
        (32, 0x1f_0000_0000_ffff),
        (16, 0x1f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ] {
        x = (x | x << shift) & mask;
    }
    x
}

/// Divides the triangles.
pub(super) fn divide<C: Stored + Sync>(
    intake: &Intake<C>,
    manner: &Division,
    workspace: &Workspace,
) -> Result<Cells> {
    let (observer, total) = (&workspace.observer, intake.triangles);
    workspace.once(&manner.step, |unit| {
        observer.begin("divide", "triangles", 2 * total);
        let sorted = sort(intake, manner, workspace)?;
        let mut cutter = Cutter::new(unit, manner);
        sorted.finish(workspace)?.for_each(|row| cutter.push(row))?;
        let cells = cutter.finish()?;
        observer.end();
        Ok(cells)
    })
}

fn sort<C: Stored + Sync>(
    intake: &Intake<C>,
    manner: &Division,
    workspace: &Workspace,
) -> Result<Sorter<PlacedTriangle>> {
    let inbox = intake.sent.open(workspace, intake.blocks())?;
    let rows = |block: usize| inbox.rows(block) as u64;
    let parts: Vec<(u32, u64)> = (0..intake.blocks())
        .map(|block| (block as u32, rows(block)))
        .filter(|part| part.1 > 0)
        .collect();
    let place = manner.place(intake.lattice.bits);
    let each = size_of::<PlacedTriangle>() as u64;
    let wanted = intake.triangles * each;
    let buffer = wanted.min(workspace.memory.available() / 3) + (1 << 20);
    let held = workspace.reserve("levels: sort buffers", buffer + buffer / 2)?;
    let sorter = Sorter::new(workspace, &manner.placed, buffer).reporting(held);
    sorter.take_parts(workspace, &parts, false, |blocks| {
        let bytes = |n: usize| 60 * rows(blocks[n] as usize) + 12 * BLOCK as u64 + (1 << 20);
        workspace.for_each_unit("levels: keys", blocks.len(), bytes, |unit| {
            let block = blocks[unit.number()] as usize;
            let triangles = inbox.get(unit, block)?;
            let mut heads: Vec<u32> = triangles.iter().map(|t| t.corners[0]).collect();
            heads.dedup();
            let mut keys = Vec::with_capacity(heads.len());
            let all = heads.iter().copied();
            intake.vertices(unit, all, |v| keys.push(place(v.point)))?;
            let mut at = 0;
            let mut placed = Vec::with_capacity(triangles.len());
            for triangle in &triangles {
                while heads[at] != triangle.corners[0] {
                    at += 1;
                }
                let (key, corners) = (keys[at], triangle.corners);
                let key = [(key >> 32) as u32, key as u32];
                placed.push(PlacedTriangle { key, corners });
            }
            unit.advance(triangles.len() as u64);
            sorter.push(&placed)
        })
    })?;
    Ok(sorter)
}

/// Cuts the sorted triangles into cells.
struct Cutter<'a> {
    unit: &'a Unit<'a>,
    /// Largest number of triangles of a cell.
    most: usize,
    waiting: Vec<(u64, [u32; 3])>,
    /// The last key of the cell before.
    before: Option<u64>,
    made: Cells,
}

impl<'a> Cutter<'a> {
    fn new(unit: &'a Unit<'a>, manner: &Division) -> Self {
        Self {
            unit,
            most: manner.most as usize,
            waiting: Vec::new(),
            before: None,
            made: Cells {
                cells: Vec::new(),
                table: Table::new(&manner.cells, 0),
            },
        }
    }

    fn push(&mut self, row: PlacedTriangle) -> Result<()> {
        let key = u64::from(row.key[0]) << 32 | u64::from(row.key[1]);
        self.waiting.push((key, row.corners));
        if self.waiting.len() > self.most && (self.waiting.len() - 1).is_multiple_of(self.most) {
            self.unit.check_cancel()?;
            self.cut(false)?;
        }
        Ok(())
    }

    /// Writes cells as long as their ends are known: all of them at the `end`.
    fn cut(&mut self, end: bool) -> Result<()> {
        let mut done = 0;
        while done < self.waiting.len() && (end || self.waiting.len() - done > self.most) {
            let rest = &self.waiting[done..];
            let key = rest[0].0;
            let fitting = (0..=DEEPEST).find_map(|depth| {
                let shift = 3 * (DEEPEST - depth);
                let start = key >> shift << shift;
                let last = start | ((1 << shift) - 1);
                if self.before.is_some_and(|before| before >= start) {
                    return None;
                }
                let count = rest.partition_point(|row| row.0 <= last);
                let known = end || count < rest.len();
                let fits = known && (count <= self.most || depth == DEEPEST);
                fits.then_some((start, depth, count, last))
            });
            let Some((start, depth, count, last)) = fitting else {
                break;
            };
            let rows = rest[..count].iter();
            let mut rows: Vec<_> = rows.map(|row| CellTriangle { corners: row.1 }).collect();
            rows.sort_unstable();
            let number = self.made.cells.len();
            self.made.table.put(self.unit, number, &rows)?;
            self.made.cells.push(Cell {
                key: start,
                depth,
                triangles: count as u32,
            });
            self.before = Some(last);
            self.unit.advance(count as u64);
            done += count;
        }
        self.waiting.drain(..done);
        Ok(())
    }

    fn finish(mut self) -> Result<Cells> {
        self.cut(true)?;
        Ok(self.made)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BITS: u32 = 31;

    #[test]
    fn keys_interleave_coordinates() {
        let top = 1 << 30;
        assert_eq!(key([top, 0, 0], BITS), 1 << 62);
        assert_eq!(key([0, top, 0], BITS), 1 << 61);
        assert_eq!(key([0, 0, top], BITS), 1 << 60);
        assert_eq!(key([u32::MAX >> 1; 3], BITS), u64::MAX >> 1);
        assert_eq!(key([0, 0, 1 << 10], BITS), 1);
    }
}
