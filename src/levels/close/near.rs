//! The surroundings of the loops: for each batch, the triangles of the mesh that touch one of its loops.

use super::fair::Ring;
use super::lid::Loop;
use super::loops::{Batch, Loops};
use super::rows::{LoopVertex, NearTriangle};
use crate::source::{READER, Source};
use outcrop_disk::error::Result;
use outcrop_disk::spill::{Inbox, Shuffle};
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_geom::vector::{V3, sub};

/// Bytes of memory of a unit for triangles on their way to batches.
const SENT: u64 = 48 << 20;

/// The surroundings of all loops.
pub(super) struct Near<'a> {
    loops: &'a Loops,
    inbox: Inbox<NearTriangle>,
}

/// A loop with its surroundings.
#[derive(Debug, Default)]
pub(super) struct Placed {
    /// The loop, with positions from `origin`.
    pub around: Loop,
    pub ring: Ring,
    /// Positions of the loop in the coordinates of the file: from a place near by, some are rounded.
    pub exact: Vec<V3>,
    /// A place near by, in these coordinates.
    pub origin: V3,
}

/// Vertices of loops with their batches, by vertex.
struct Touching {
    bits: Vec<u64>,
    batches: Vec<[u32; 2]>,
}

impl Touching {
    fn of(loops: &Loops, vertices: u64, unit: &Unit<'_>) -> Result<Self> {
        let mut touching = Self {
            bits: vec![0; vertices.div_ceil(64) as usize],
            batches: Vec::new(),
        };
        for batch in 0..loops.batches.len() {
            for row in loops.table.get(unit, batch)? {
                touching.bits[row.vertex as usize / 64] |= 1 << (row.vertex % 64);
                touching.batches.push([row.vertex, batch as u32]);
            }
        }
        touching.batches.sort_unstable();
        touching.batches.dedup();
        Ok(touching)
    }

    fn is_set(&self, v: u32) -> bool {
        self.bits[v as usize / 64] >> (v % 64) & 1 == 1
    }

    fn batches(&self, v: u32) -> impl Iterator<Item = u32> {
        let first = self.batches.partition_point(|pair| pair[0] < v);
        let same = self.batches[first..].iter();
        same.take_while(move |pair| pair[0] == v)
            .map(|pair| pair[1])
    }
}

/// Finds the surroundings.
pub(super) fn find<'a>(
    source: &Source,
    loops: &'a Loops,
    workspace: &Workspace,
) -> Result<Near<'a>> {
    let observer = &workspace.observer;
    observer.begin("find surroundings", "triangles", source.triangles);
    let all: u64 = loops.batches.iter().map(|batch| batch.vertices).sum();
    let held = workspace.reserve(
        "close: vertices of loops",
        source.vertices / 8 + 16 * all + (1 << 20),
    )?;
    let touching = Touching::of(loops, source.vertices, &workspace.unit())?;
    let sent = Shuffle::<NearTriangle>::new("close.near");
    workspace.units(
        ("near", "close: surroundings"),
        source.ranges(),
        |_| SENT + READER,
        |unit| {
            let mut rows = Vec::new();
            source.read(unit, |triangles, positions| {
                for t in triangles {
                    if !t.iter().any(|v| touching.is_set(*v)) {
                        continue;
                    }
                    let [a, b, c] = t.map(|v| touching.batches(v));
                    let mut batches: Vec<u32> = a.chain(b).chain(c).collect();
                    batches.sort_unstable();
                    batches.dedup();
                    let placed = positions.corners(*t)?;
                    rows.extend(batches.into_iter().map(|batch| NearTriangle {
                        batch,
                        corners: *t,
                        positions: placed,
                    }));
                }
                Ok(())
            })?;
            sent.send(unit, unit.number(), rows)
        },
        |_, ()| Ok(()),
    )?;
    drop((touching, held));
    observer.end();
    let inbox = sent.open(workspace, loops.batches.len())?;
    Ok(Near { loops, inbox })
}

impl Near<'_> {
    /// Bytes of memory for a batch with its surroundings.
    pub fn bytes(&self, batch: usize) -> u64 {
        let vertices = self.loops.batches[batch].vertices;
        (2 * size_of::<NearTriangle>() + 64) as u64 * self.inbox.rows(batch) as u64
            + 200 * vertices
            + (1 << 20)
    }

    pub fn batch(&self, batch: usize) -> Batch {
        self.loops.batches[batch]
    }

    pub fn batches(&self) -> usize {
        self.loops.batches.len()
    }

    /// The loops of a batch.
    pub fn load(&self, unit: &Unit<'_>, batch: usize) -> Result<Vec<Placed>> {
        let rows = self.loops.table.get(unit, batch)?;
        let near = self.inbox.get(unit, batch)?;
        let loops: Vec<&[LoopVertex]> = rows.chunk_by(|a, b| a.number == b.number).collect();
        let mut places: Vec<(u32, u32, u32)> = Vec::with_capacity(rows.len());
        for (number, vertices) in loops.iter().enumerate() {
            let each = vertices.iter().enumerate();
            places.extend(each.map(|(at, row)| (row.vertex, number as u32, at as u32)));
        }
        places.sort_unstable();
        let mut all: Vec<Placed> = loops.iter().map(|rows| empty(rows)).collect();
        let mut others: Vec<rustc_hash::FxHashMap<u32, u32>> = vec![Default::default(); all.len()];
        let mut known = vec![false; all.len()];
        for triangle in &near {
            let on = triangle.corners.map(|v| {
                let first = places.partition_point(|place| place.0 < v);
                let end = first + places[first..].partition_point(|place| place.0 == v);
                &places[first..end]
            });
            let mut numbers: Vec<u32> = on.iter().flat_map(|p| p.iter().map(|p| p.1)).collect();
            numbers.sort_unstable();
            numbers.dedup();
            for number in numbers {
                let (placed, others) = (&mut all[number as usize], &mut others[number as usize]);
                if !std::mem::replace(&mut known[number as usize], true) {
                    let corner = (0..3).find(|k| on[*k].iter().any(|p| p.1 == number));
                    placed.origin = triangle.positions[corner.unwrap_or(0)];
                }
                let at = on.map(|p| p.iter().find(|p| p.1 == number).map(|p| p.2));
                placed.take(triangle, at, others);
            }
        }
        for placed in &mut all {
            placed.around.forbidden.sort_unstable();
            placed.around.forbidden.dedup();
        }
        Ok(all)
    }
}

fn empty(rows: &[LoopVertex]) -> Placed {
    let n = rows.len();
    Placed {
        around: Loop {
            vertices: rows.iter().map(|row| row.vertex).collect(),
            points: vec![[0.0; 3]; n],
            apexes: vec![[f64::NAN; 3]; n],
            forbidden: Vec::new(),
            pinched: rows.iter().map(|row| row.pinched == 1).collect(),
            is_triangle: false,
        },
        exact: vec![[0.0; 3]; n],
        ..Placed::default()
    }
}

impl Placed {
    /// Takes a triangle of the mesh, of which some corners are these vertices of the loop.
    fn take(
        &mut self,
        triangle: &NearTriangle,
        at: [Option<u32>; 3],
        others: &mut rustc_hash::FxHashMap<u32, u32>,
    ) {
        let n = self.around.len() as u32;
        let points = triangle.positions.map(|p| sub(p, self.origin));
        let corners = [0, 1, 2].map(|k| {
            if let Some(at) = at[k] {
                self.around.points[at as usize] = points[k];
                self.exact[at as usize] = triangle.positions[k];
                return at;
            }
            *others.entry(triangle.corners[k]).or_insert_with(|| {
                self.ring.points.push(points[k]);
                n + self.ring.points.len() as u32 - 1
            })
        });
        self.ring.triangles.push(corners);
        for k in 0..3 {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            if a >= n || b >= n {
                continue;
            }
            self.around.forbidden.push([a.min(b), a.max(b)]);
            // The mesh runs against the loop.
            let apex = &mut self.around.apexes[b as usize];
            if (b + 1) % n == a && apex[0].is_nan() {
                *apex = points[(k + 2) % 3];
            }
        }
        self.around.is_triangle |= n == 3 && corners.iter().all(|v| *v < n);
    }
}
