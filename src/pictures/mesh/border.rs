//! Edges with one triangle: found by part, cancelled where two parts meet, and joined to loops.

use super::source::Part;
use outcrop_disk::error::Result;
use outcrop_disk::spill::{LocalTable, Sorted, row};
use outcrop_disk::workspace::Workspace;
use outcrop_draw::histogram::Tally;
use outcrop_geom::Point;
use outcrop_stages::ids::Id;

row! {
    /// An edge that has one triangle in a part.
    pub struct BorderEdge {
        /// Ids of its ends, ascending.
        ends: [Id; 2],
        /// Their positions.
        at: [[i32; 3]; 2],
    }
    unpacked
}

/// Most boundary edges of which loops are counted. It bounds the memory.
const MOST: u64 = 1 << 20;

/// Bytes of memory for a boundary edge while loops are counted.
const OF_EDGE: u64 = 40;

/// Edges written at a time.
pub(super) const BATCH: usize = 4096;

/// Mixes the bits of an id, so that sums over different sets of ids differ.
#[inline]
fn mix(id: Id) -> u64 {
    let mut x = (u64::from(id.get()) + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x ^ (x >> 27)
}

/// The edges of a part with one triangle in it. In a closed fan every neighbour follows one triangle and precedes
/// another, so the difference of both sums is zero; edges between two such vertices need not be looked at.
pub(super) fn of_part(part: &Part) -> Vec<BorderEdge> {
    let own = |v: Id| part.ids.find(v);
    let mut sums = vec![0u64; part.ids.len()];
    for t in &part.triangles {
        let mixed = t.map(mix);
        for k in 0..3 {
            if let Some(sum) = sums.get_mut(own(t[k])) {
                let (next, last) = (mixed[(k + 1) % 3], mixed[(k + 2) % 3]);
                *sum = sum.wrapping_add(next).wrapping_sub(last);
            }
        }
    }
    let is_open = |v: Id| sums.get(own(v)).is_none_or(|sum| *sum != 0);
    let mut found: Vec<[Id; 2]> = Vec::new();
    for t in &part.triangles {
        let open = t.map(is_open);
        for k in 0..3 {
            let next = (k + 1) % 3;
            if open[k] && open[next] {
                found.push([t[k].min(t[next]), t[k].max(t[next])]);
            }
        }
    }
    found.sort_unstable();
    let once = found.chunk_by(|a, b| a == b).filter(|same| same.len() == 1);
    let edge = |ends: [Id; 2]| BorderEdge {
        ends,
        at: ends.map(|v| part.at.at(v)),
    };
    once.map(|same| edge(same[0])).collect()
}

/// The boundary of the whole surface.
pub(super) struct Boundary {
    /// Its edges, ascending, in sections.
    pub edges: LocalTable<BorderEdge>,
    /// Edges of each loop; none if there are too many edges.
    pub loops: Option<Tally>,
    /// Their lengths.
    pub lengths: Tally,
}

impl Boundary {
    /// Takes the edges with one triangle in one part only.
    pub fn of(sorted: Sorted<BorderEdge>, workspace: &Workspace) -> Result<Self> {
        let _held = workspace.reserve("draw: edges", 32 * BATCH as u64 * 2)?;
        let edges: LocalTable<BorderEdge> = LocalTable::create(workspace, "draw.boundary")?;
        let mut lengths = Tally::default();
        let (mut last, mut times, mut batch): (Option<BorderEdge>, _, _) = (None, 0, Vec::new());
        let mut end = |edge: BorderEdge| {
            let [a, b]: [Point; 2] = edge.at;
            lengths.add(outcrop_geom::distance2(a, b));
            batch.push(edge);
            if batch.len() == BATCH {
                edges.append(&batch)?;
                batch.clear();
            }
            workspace.check_cancel()
        };
        sorted.for_each(|edge| {
            match last {
                Some(same) if same.ends == edge.ends => times += 1,
                other => {
                    if let Some(edge) = other.filter(|_| times == 1) {
                        end(edge)?;
                    }
                    (last, times) = (Some(edge), 1);
                }
            }
            Ok(())
        })?;
        if let Some(edge) = last.filter(|_| times == 1) {
            end(edge)?;
        }
        edges.append(&batch)?;
        let loops = (edges.total() <= MOST)
            .then(|| loops(&edges, workspace))
            .transpose()?;
        Ok(Self {
            edges,
            loops,
            lengths,
        })
    }

    /// Passes on all edges.
    pub fn for_each(&self, mut each: impl FnMut(&BorderEdge)) -> Result<()> {
        let mut rows = Vec::new();
        for section in 0..self.edges.count() {
            self.edges.get_into(section, &mut rows)?;
            rows.iter().for_each(&mut each);
        }
        Ok(())
    }
}

/// The number of edges of each loop. Loops that meet at a vertex count as one.
fn loops(edges: &LocalTable<BorderEdge>, workspace: &Workspace) -> Result<Tally> {
    let _held = workspace.reserve("draw: loops", edges.total() * OF_EDGE)?;
    let mut all: Vec<[Id; 2]> = Vec::with_capacity(edges.total() as usize);
    let mut rows = Vec::new();
    for section in 0..edges.count() {
        edges.get_into(section, &mut rows)?;
        all.extend(rows.iter().map(|row| row.ends));
    }
    let mut ids: Vec<Id> = all.iter().flatten().copied().collect();
    ids.sort_unstable();
    ids.dedup();
    let place = |v: Id| ids.partition_point(|id| *id < v);
    let mut parents: Vec<u32> = (0..ids.len() as u32).collect();
    let root = |parents: &mut Vec<u32>, mut v: usize| {
        while parents[v] as usize != v {
            parents[v] = parents[parents[v] as usize];
            v = parents[v] as usize;
        }
        v
    };
    for [a, b] in &all {
        let (a, b) = (root(&mut parents, place(*a)), root(&mut parents, place(*b)));
        // The lower is the root, so that it does not depend on the order.
        parents[a.max(b)] = a.min(b) as u32;
    }
    let mut sizes = vec![0u64; ids.len()];
    for [a, _] in &all {
        sizes[root(&mut parents, place(*a))] += 1;
    }
    let mut tally = Tally::default();
    sizes
        .iter()
        .filter(|size| **size > 0)
        .for_each(|size| tally.add(*size));
    Ok(tally)
}
