//! How well each vertex is supported: a column of the mesh.

use crate::repair::{FilledTriangle, Repaired, Surface};
use crate::surface::star::sorted;
use crate::triples::{Triples, VisitingTriple};
use outcrop_disk::error::Result;
use outcrop_disk::spill::{Inbox, Table};
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_points::{Carried, Column};
use outcrop_stages::attributes::StoredColumns;
use outcrop_stages::blocks::Blocks;
use outcrop_stages::cells::CountedTriple;
use outcrop_stages::ids::{Id, Triangle};

/// The cells that agree on a triangle at most: those of its corners.
const CELLS: u32 = 3;

/// The column with the confidence of each point, and the least and the largest of vertices: of the cells that could
/// agree on the triangles around the vertex, three for each, the share that does. A triangle that fills a hole has
/// none. Points that are no vertices have 0.
///
/// # Errors
/// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`],
/// [`outcrop_disk::error::Error::Memory`], [`outcrop_disk::error::Error::Cancelled`].
pub fn confidence(
    triples: &Triples,
    repaired: &Repaired,
    blocks: Blocks,
    workspace: &Workspace,
) -> Result<(StoredColumns, [f64; 2])> {
    let column = Column::confidence();
    let table = Table::new("confidence", blocks.count());
    let around = Around {
        triples,
        visiting: triples.visiting.open(workspace, blocks.count())?,
        surface: repaired.surface.open(workspace)?,
        filled: repaired.filled.open(workspace, blocks.count())?,
        blocks,
    };
    let work = |unit: &Unit<'_>| {
        let sums = around.sums(unit)?;
        let mut range = [1.0f64, 0.0];
        let words: Vec<u32> = sums
            .iter()
            .map(|sum| {
                let share = f64::from(sum.agree) / f64::from(CELLS * sum.triangles.max(1));
                if sum.triangles > 0 {
                    range = [range[0].min(share), range[1].max(share)];
                }
                Carried::word(&column, share)
            })
            .collect();
        table.put(unit, unit.number(), bytemuck::cast_slice(&words))?;
        unit.advance(words.len() as u64);
        Ok(range)
    };
    let bytes = |block| around.bytes(block, workspace);
    let mut range = [1.0f64, 0.0];
    let each = |_, [least, most]: [f64; 2]| {
        range = [range[0].min(least), range[1].max(most)];
        Ok(())
    };
    workspace.units("confidence", blocks.count(), bytes, work, each)?;
    let columns = StoredColumns::of(column.clone(), table, blocks);
    Ok((columns, range))
}

/// The triangles around the vertices of a block, and the triples.
struct Around<'a> {
    triples: &'a Triples,
    visiting: Inbox<VisitingTriple>,
    surface: Surface<'a>,
    filled: Inbox<FilledTriangle>,
    blocks: Blocks,
}

/// What the triangles around a vertex add up to.
#[derive(Debug, Clone, Copy, Default)]
struct Sum {
    triangles: u32,
    /// Cells that agree on them.
    agree: u32,
}

impl Around<'_> {
    /// Bytes of memory for a block.
    fn bytes(&self, block: usize, workspace: &Workspace) -> u64 {
        let own = self.triples.own.expected_rows(workspace, block);
        let triples = own * size_of::<CountedTriple>()
            + self.visiting.rows(block) * size_of::<VisitingTriple>();
        let triangles = self.surface.records(workspace, block) * size_of::<Triangle>()
            + self.filled.rows(block) * size_of::<FilledTriangle>();
        let points = self.blocks.ids(block).len() * (size_of::<Sum>() + 4);
        // Lists while they grow.
        (2 * (triples + triangles) + points) as u64
    }

    fn sums(&self, unit: &Unit<'_>) -> Result<Vec<Sum>> {
        let block = unit.number();
        let ids = self.blocks.ids(block);
        let own = self.triples.own.get(unit, block)?;
        let visiting = self.visiting.get(unit, block)?;
        let count = |triangle: Triangle| {
            let found = own.binary_search_by_key(&triangle, |row| row.triple);
            let found = found.map(|at| own[at].count).or_else(|_| {
                let at = visiting.binary_search_by_key(&triangle, |row| row.triple)?;
                Ok::<u32, usize>(visiting[at].count)
            });
            found.unwrap_or(0)
        };
        let mut sums = vec![Sum::default(); ids.len()];
        let mut add = |triangle: Triangle, agree: u32| {
            let inside = triangle.into_iter().filter(|id| ids.contains(id));
            inside.for_each(|id: Id| {
                let sum = &mut sums[ids.find(id)];
                sum.triangles += 1;
                sum.agree += agree;
            });
        };
        let (triangles, _) = self.surface.load(unit, block)?;
        for triangle in triangles {
            add(triangle, count(sorted(triangle)).min(CELLS));
        }
        for row in self.filled.get(unit, block)? {
            add(row.triangle, 0);
        }
        Ok(sums)
    }
}
