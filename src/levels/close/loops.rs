//! Loops of the boundary, and their batches.

use super::rim::Rim;
use super::rows::LoopVertex;
use outcrop_disk::error::Result;
use outcrop_disk::spill::Table;
use outcrop_disk::workspace::Workspace;
use serde::{Deserialize, Serialize};

/// Vertices of a batch of loops, unless one loop has more.
const BATCH: usize = 1 << 12;

/// Bytes of memory for each edge of the boundary: as it was read, sorted, its end, its place, and the loops.
const EACH: u64 = 8 + 8 + 4 + 1 + 2 * 12 + 16;

/// Loops that are closed together.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub(super) struct Batch {
    /// Number of its first loop.
    pub first: u32,
    /// Number of loops.
    pub loops: u32,
    /// Vertices of all of them.
    pub vertices: u64,
    /// Vertices of the longest.
    pub longest: u64,
}

/// The loops, each with its vertices in the order of the triangles that close it: against the triangles of the mesh.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Loops {
    /// The vertices, by batch.
    pub table: Table<LoopVertex>,
    pub batches: Vec<Batch>,
    /// Vertices at which several loops meet.
    pub pinched: u64,
}

/// The boundary in memory.
struct Linked {
    /// Edges, by start.
    edges: Vec<[u32; 2]>,
    /// For each edge, the next one of its start that was not followed.
    taken: Vec<bool>,
}

impl Linked {
    fn of(mut edges: Vec<[u32; 2]>) -> Self {
        edges.sort_unstable();
        Self {
            taken: vec![false; edges.len()],
            edges,
        }
    }

    /// The first edge from a vertex that was not followed.
    fn next(&self, from: u32) -> Option<usize> {
        let first = self.edges.partition_point(|edge| edge[0] < from);
        (first..self.edges.len())
            .take_while(|at| self.edges[*at][0] == from)
            .find(|at| !self.taken[*at])
    }

    /// True if several edges begin at a vertex.
    fn is_pinched(&self, vertex: u32) -> bool {
        let first = self.edges.partition_point(|edge| edge[0] < vertex);
        self.edges.get(first + 1).is_some_and(|e| e[0] == vertex)
    }

    /// Follows edges from this one back to its start, and calls `found` with each loop: no vertex comes twice in one.
    fn follow(&mut self, start: usize, mut found: impl FnMut(Vec<u32>)) {
        // Where vertices are pinched the way may come back to one of its vertices; that part is a loop of its own.
        let mut way: Vec<u32> = Vec::new();
        let mut places: rustc_hash::FxHashMap<u32, usize> = rustc_hash::FxHashMap::default();
        let mut at = Some(start);
        while let Some(edge) = at {
            self.taken[edge] = true;
            let [from, to] = self.edges[edge];
            if self.is_pinched(from) || way.is_empty() {
                places.insert(from, way.len());
            }
            way.push(from);
            if let Some(&back) = places.get(&to) {
                let part = way.split_off(back);
                for v in &part {
                    if places.get(v).is_some_and(|place| *place >= back) {
                        places.remove(v);
                    }
                }
                found(part);
                if way.is_empty() {
                    return;
                }
            }
            at = self.next(to);
        }
    }
}

/// Links the boundary to loops.
pub(super) fn link(rim: &Rim, workspace: &Workspace) -> Result<Loops> {
    let loops = workspace.once("loops", |unit| {
        let _held = workspace.reserve("close: loops", rim.edges * EACH + (1 << 20))?;
        let mut edges = Vec::with_capacity(rim.edges as usize);
        for section in 0..rim.sections {
            let rows = rim.table.get(unit, section)?;
            edges.extend(rows.iter().map(|row| [row.from, row.to]));
        }
        let mut linked = Linked::of(edges);
        let mut writer = Writer {
            loops: Loops {
                table: Table::new("close.loops", 0),
                batches: Vec::new(),
                pinched: 0,
            },
            rows: Vec::new(),
            batch: Batch::default(),
        };
        for start in 0..linked.edges.len() {
            if linked.taken[start] {
                continue;
            }
            let mut found = Vec::new();
            linked.follow(start, |vertices| found.push(vertices));
            for mut vertices in found {
                // Against the triangles of the mesh, from the lowest vertex on.
                vertices.reverse();
                let lowest = (0..vertices.len()).min_by_key(|at| vertices[*at]);
                vertices.rotate_left(lowest.unwrap_or(0));
                let number = writer.batch.first + writer.batch.loops;
                let row = |vertex: &u32| LoopVertex {
                    number,
                    vertex: *vertex,
                    pinched: u32::from(linked.is_pinched(*vertex)),
                };
                writer.rows.extend(vertices.iter().map(row));
                writer.batch.longest = writer.batch.longest.max(vertices.len() as u64);
                writer.batch.loops += 1;
                if writer.rows.len() >= BATCH {
                    writer.end(unit)?;
                }
            }
        }
        writer.end(unit)?;
        let several = |pair: &[[u32; 2]; 2]| pair[0][0] == pair[1][0];
        let pairs = linked.edges.windows(2).filter_map(|w| w.first_chunk::<2>());
        writer.loops.pinched = pairs.filter(|pair| several(pair)).count() as u64;
        Ok(writer.loops)
    })?;
    rim.table.release(workspace)?;
    Ok(loops)
}

struct Writer {
    loops: Loops,
    rows: Vec<LoopVertex>,
    batch: Batch,
}

impl Writer {
    fn end(&mut self, unit: &outcrop_disk::workspace::Unit<'_>) -> Result<()> {
        if self.rows.is_empty() {
            return Ok(());
        }
        self.batch.vertices = self.rows.len() as u64;
        let number = self.loops.batches.len();
        self.loops.table.put(unit, number, &self.rows)?;
        self.loops.batches.push(self.batch);
        self.batch = Batch {
            first: self.batch.first + self.batch.loops,
            ..Batch::default()
        };
        self.rows.clear();
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn loops(edges: &[[u32; 2]]) -> Vec<Vec<u32>> {
        let mut linked = Linked::of(edges.to_vec());
        let mut all = Vec::new();
        for start in 0..edges.len() {
            if !linked.taken[start] {
                linked.follow(start, |found| all.push(found));
            }
        }
        assert!(linked.taken.iter().all(|taken| *taken));
        all
    }

    #[test]
    fn edges_are_linked_to_simple_loops() {
        let two = [[3, 9], [9, 4], [4, 3], [7, 5], [5, 6], [6, 7]];
        assert_eq!(loops(&two), [vec![3, 9, 4], vec![5, 6, 7]]);
        // An eight: both parts meet at 2.
        let eight = [[0, 1], [1, 2], [2, 0], [2, 3], [3, 4], [4, 2]];
        let mut found = loops(&eight);
        assert!(found.iter().all(|part| part.len() == 3), "{found:?}");
        found.sort_by_key(|part| part.iter().min().copied());
        assert!(found[0].contains(&0) && found[1].contains(&3));
        // A chain of four loops, at 10, 20 and 30.
        let mut chain = Vec::new();
        for at in [10, 20, 30] {
            chain.extend([
                [at, at + 1],
                [at + 1, at + 10],
                [at + 10, at + 5],
                [at + 5, at],
            ]);
        }
        let found = loops(&chain);
        assert_eq!(found.len(), 3, "{found:?}");
        assert!(found.iter().all(|part| part.len() == 4));
    }
}
