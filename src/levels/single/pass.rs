//! A pass: the mesh is divided into cells, and each is simplified.

use super::collapse::{Curve, End, contract};
use super::kept::Kept;
use super::{Intake, Options};
use crate::cells::{self, Cells, Division};
use crate::intake::{BLOCK, Stored};
use crate::patch::{Patch, Vertices};
use crate::quadric::{NUMBERS, Quadric};
use crate::rows::{CellTriangle, CellVertex, KeptValue, KeptVertex, SharedVertex};
use crate::shared::{local, share_vertices};
use outcrop_disk::error::Result;
use outcrop_disk::spill::{Inbox, Shuffle, Table};
use outcrop_disk::workspace::{Unit, Workspace};

/// A pass, with the cells of its mesh.
pub(super) struct Pass<'a> {
    number: u32,
    intake: &'a Intake,
    options: &'a Options,
    pub cells: Cells,
    /// The vertices that several cells have, by cell, with the first of the cells.
    shared: Inbox<SharedVertex>,
}

/// What is left of a cell.
#[derive(Debug, Clone, Copy, Default, serde::Serialize, serde::Deserialize)]
struct Left {
    triangles: u64,
    /// Without those that belong to an earlier cell.
    vertices: u64,
    /// The largest mean squared distance of a vertex from the planes of the triangles that it stands for.
    distance2: f64,
}

impl<'a> Pass<'a> {
    /// Divides the mesh.
    pub fn new(
        number: u32,
        intake: &'a Intake,
        options: &'a Options,
        workspace: &Workspace,
    ) -> Result<Self> {
        let division = Division {
            most: options.most_triangles,
            thirds: u64::from(number % 3),
            step: format!("cells {number}"),
            placed: format!("single.placed {number}"),
            cells: format!("single.cells {number}"),
        };
        let cells = cells::divide(intake, &division, workspace)?;
        intake.sent.release(workspace)?;
        workspace.trim();
        let observer = &workspace.observer;
        observer.begin("share", "triangles", intake.triangles);
        let names = ["cell", "shared"].map(|name| format!("single.{name} vertices {number}"));
        let names = [&*names[0], &names[1]];
        let first = |same: &[CellVertex]| same[0].cell;
        let ending = format!(" {number}");
        share_vertices(intake, &cells, (names, &ending), first, workspace)?;
        observer.end();
        Ok(Self {
            number,
            intake,
            options,
            shared: Shuffle::new(names[1]).open(workspace, cells.cells.len())?,
            cells,
        })
    }

    fn bytes(&self, cell: usize) -> u64 {
        let width = self.intake.columns.values();
        let each = Patch::bytes_each(width) + 100 + 12 * width as u64;
        let triangles = u64::from(self.cells.cells[cell].triangles);
        triangles * each + 2 * self.intake.part_bytes() + (1 << 20)
    }

    /// The triangles of a cell, the numbers of its vertices, and which of these belong to an earlier cell.
    fn load(&self, unit: &Unit<'_>, cell: usize) -> Result<(Patch, Vec<u32>, Vec<bool>)> {
        let rows = self.cells.table.get(unit, cell)?;
        let (ids, triangles) = local(&rows);
        drop(rows);
        let columns = &self.intake.columns;
        let mut vertices = Vertices {
            points: Vec::with_capacity(ids.len()),
            quadrics: Vec::new(),
            values: Vec::new(),
            blended: columns.blended.clone(),
            locked: vec![false; ids.len()],
        };
        let width = columns.wanted.len();
        self.intake.vertices(unit, ids.iter().copied(), |vertex| {
            vertices.points.push(vertex.position);
            let (pairs, _) = vertex.stored.as_chunks::<2>();
            let numbers = pairs
                .iter()
                .map(|[low, high]| f64::from_bits(u64::from(*low) | u64::from(*high) << 32));
            let mut quadric = [0.0; NUMBERS];
            for (number, at) in numbers.zip(0..) {
                match at < width {
                    true => vertices.values.push(number),
                    false => quadric[at - width] = number,
                }
            }
            if columns.with_quadrics {
                vertices.quadrics.push(Quadric::of_numbers(&quadric));
            }
        })?;
        let mut foreign = vec![false; ids.len()];
        let mut at = 0;
        for row in self.shared.get(unit, cell)? {
            at += ids[at..].partition_point(|id| *id < row.vertex);
            vertices.locked[at] = true;
            foreign[at] = row.depth as usize != cell;
            // The first cell alone has the quadric of the passes before, so that it is counted once.
            if foreign[at] && columns.with_quadrics {
                vertices.quadrics[at] = Quadric::default();
            }
        }
        let patch = Patch::new(vertices, triangles, self.options.keep_boundary);
        Ok((patch, ids, foreign))
    }

    /// What each cost removes, in every cell whose number is a multiple of `step`; and how many triangles of these
    /// cells have a corner that stays.
    pub fn curve(&self, step: usize, end: End, workspace: &Workspace) -> Result<(Curve, u64)> {
        let count = self.cells.cells.len().div_ceil(step);
        let triangles = |n: usize| u64::from(self.cells.cells[n * step].triangles);
        let observer = &workspace.observer;
        let total = (0..count).map(triangles).sum();
        observer.begin("measure", "triangles", total);
        let (mut all, mut held) = (Curve::new(), 0);
        let work = |unit: &Unit<'_>| {
            let cell = unit.number() * step;
            let (mut patch, ..) = self.load(unit, cell)?;
            let held = patch.held() as u64;
            let (curve, _) = contract(&mut patch, end);
            unit.advance(triangles(unit.number()));
            Ok((curve, held))
        };
        let name = (format!("measure {}", self.number), "simplify: cells");
        workspace.units(
            name,
            count,
            |n| self.bytes(n * step),
            work,
            |_, (curve, own): (Curve, u64)| {
                all.extend(curve);
                held += own;
                Ok(())
            },
        )?;
        observer.end();
        all.sort_unstable();
        Ok((all, held))
    }

    /// Simplifies all cells.
    pub fn simplify(self, end: End, workspace: &Workspace) -> Result<(Kept, f64)> {
        let number = self.number;
        let observer = &workspace.observer;
        observer.begin("simplify", "triangles", self.intake.triangles);
        let table = Table::new(&format!("single.kept triangles {number}"), 0);
        let sent = Shuffle::new(&format!("single.kept vertices {number}"));
        let values = Shuffle::new(&format!("single.kept values {number}"));
        let mut all = Left::default();
        let work = |unit: &Unit<'_>| {
            let cell = unit.number();
            let (mut patch, ids, foreign) = self.load(unit, cell)?;
            let (_, distance2) = contract(&mut patch, end);
            let mut rows: Vec<CellTriangle> = patch
                .left()
                .map(|corners| CellTriangle {
                    corners: least_first(corners.map(|v| ids[v as usize])),
                })
                .collect();
            rows.sort_unstable();
            table.put(unit, cell, &rows)?;
            let used = used(&patch);
            sent.send(unit, cell, vertices(&patch, &ids, &used, cell as u32))?;
            if patch.width() > 0 {
                values.send(unit, cell, values_of(&patch, &ids, &used, cell as u32))?;
            }
            unit.advance(self.cells.cells[cell].triangles.into());
            let own = used.iter().filter(|v| !foreign[**v as usize]);
            Ok(Left {
                triangles: rows.len() as u64,
                vertices: own.count() as u64,
                distance2,
            })
        };
        let name = (format!("simplify {number}"), "simplify: cells");
        let cells = self.cells.cells.len();
        workspace.units(
            name,
            cells,
            |n| self.bytes(n),
            work,
            |_, left| {
                all.triangles += left.triangles;
                all.vertices += left.vertices;
                all.distance2 = all.distance2.max(left.distance2);
                Ok(())
            },
        )?;
        observer.end();
        let kept = Kept {
            vertices: all.vertices,
            triangles: all.triangles,
            cells,
            before: self.intake.vertices,
            width: self.intake.columns.wanted.len(),
            table,
            sent,
            values,
        };
        self.release(workspace)?;
        Ok((kept, all.distance2))
    }

    fn release(self, workspace: &Workspace) -> Result<()> {
        drop(self.shared);
        workspace
            .files
            .release(&format!("single.shared vertices {}", self.number))?;
        self.cells.table.release(workspace)?;
        self.intake.release(workspace)?;
        workspace.trim();
        Ok(())
    }
}

fn least_first([a, b, c]: [u32; 3]) -> [u32; 3] {
    match a.min(b).min(c) {
        least if least == a => [a, b, c],
        least if least == b => [b, c, a],
        _ => [c, a, b],
    }
}

/// The vertices that triangles have.
fn used(patch: &Patch) -> Vec<u32> {
    let mut is_used = vec![false; patch.points.len()];
    patch
        .left()
        .flatten()
        .for_each(|v| is_used[*v as usize] = true);
    let all = is_used.iter().zip(0u32..);
    all.filter(|(used, _)| **used).map(|(_, v)| v).collect()
}

fn vertices(patch: &Patch, ids: &[u32], used: &[u32], cell: u32) -> Vec<KeptVertex> {
    let row = |v: &u32| {
        let (id, v) = (ids[*v as usize], *v as usize);
        KeptVertex {
            block: id / BLOCK as u32,
            vertex: id,
            cell,
            unused: 0,
            position: patch.points[v],
            quadric: patch.quadrics[v].numbers(),
        }
    };
    used.iter().map(row).collect()
}

fn values_of(patch: &Patch, ids: &[u32], used: &[u32], cell: u32) -> Vec<KeptValue> {
    let columns = |v: &u32| {
        let (id, v) = (ids[*v as usize], *v as usize);
        let own = &patch.values[v * patch.width()..][..patch.width()];
        own.iter()
            .zip(0u32..)
            .map(move |(value, column)| KeptValue {
                block: id / BLOCK as u32,
                vertex: id,
                cell,
                column,
                value: *value,
            })
    };
    used.iter().flat_map(columns).collect()
}
