//! The boundary of the mesh: edges along which triangles run more often one way than the other.
//!
//! Each way along an edge cancels the other. What is left is a boundary in the sense of chains, so as many edges end
//! at a vertex as begin there, whatever the mesh: it consists of loops. In a range of triangles nearly all edges
//! cancel at once; what is left of all ranges is sorted by edge.

use super::rows::{NetEdge, RimEdge};
use crate::source::{RANGE, READER, Source};
use outcrop_disk::error::Result;
use outcrop_disk::spill::{Sorter, Table};
use outcrop_disk::workspace::Workspace;
use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};

/// Edges of a section of the boundary.
const SECTION: usize = 1 << 16;

/// Bytes of memory for each triangle of a range: three edges in a table of which up to a half is free.
const EACH: u64 = 3 * 2 * 20;

/// The boundary.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Rim {
    /// The edges, by the lower end.
    pub table: Table<RimEdge>,
    /// Number of sections.
    pub sections: usize,
    /// Number of edges.
    pub edges: u64,
    /// Edges with several triangles that run along them more often one way.
    pub crowded: u64,
}

/// Finds the boundary.
pub(super) fn find(source: &Source, workspace: &Workspace) -> Result<Rim> {
    let ranges = source.ranges();
    let table = Table::<NetEdge>::new("close.edges", ranges);
    let observer = &workspace.observer;
    observer.begin("find edges", "triangles", source.triangles);
    let mut all = 0u64;
    workspace.units(
        ("edges", "close: edges"),
        ranges,
        |_| RANGE * EACH + READER,
        |unit| {
            let mut open: FxHashMap<[u32; 2], i32> = FxHashMap::default();
            source.read(unit, |triangles, _| {
                for [a, b, c] in triangles {
                    for (from, to) in [(*a, *b), (*b, *c), (*c, *a)] {
                        let (key, way) = match from < to {
                            true => ([from, to], 1),
                            false => ([to, from], -1),
                        };
                        if from == to {
                            continue;
                        }
                        let net = open.entry(key).or_insert(0);
                        *net += way;
                        if *net == 0 {
                            open.remove(&key);
                        }
                    }
                }
                Ok(())
            })?;
            let row = |(ends, net): (&[u32; 2], &i32)| NetEdge {
                ends: *ends,
                net: *net as u32,
            };
            let mut rows: Vec<NetEdge> = open.iter().map(row).collect();
            rows.sort_unstable();
            table.put(unit, unit.number(), &rows)?;
            Ok(rows.len() as u64)
        },
        |_, rows| {
            all += rows;
            Ok(())
        },
    )?;
    observer.end();
    let rim = workspace.once("rim", |unit| {
        let wanted = (all + 1) * size_of::<NetEdge>() as u64;
        let buffer = wanted.clamp(1 << 20, (workspace.memory.available() / 4).max(1 << 20));
        let held = workspace.promise("close: edges", buffer)?;
        let sorter = Sorter::new(workspace, "close.sorted edges", buffer).reporting(held);
        for range in 0..ranges {
            sorter.push(&table.get(unit, range)?)?;
        }
        let mut rim = Rim {
            table: Table::new("close.rim", 0),
            sections: 0,
            edges: 0,
            crowded: 0,
        };
        let _held = workspace.reserve("close: rim", (3 * SECTION * 8) as u64)?;
        let mut rows: Vec<RimEdge> = Vec::new();
        let mut last: Option<NetEdge> = None;
        let mut end = |edge: Option<NetEdge>, is_last: bool| -> Result<()> {
            if let Some(NetEdge { ends, net }) = edge {
                let net = net as i32;
                let [from, to] = if net > 0 { ends } else { [ends[1], ends[0]] };
                let times = net.unsigned_abs() as usize;
                rows.extend((0..times).map(|_| RimEdge { from, to }));
                rim.edges += times as u64;
                rim.crowded += u64::from(times > 1);
            }
            if rows.len() >= SECTION || is_last {
                rim.table.put(unit, rim.sections, &rows)?;
                rim.sections += 1;
                rows.clear();
            }
            Ok(())
        };
        sorter.finish(workspace)?.for_each(|row| {
            match &mut last {
                Some(same) if same.ends == row.ends => same.net = same.net.wrapping_add(row.net),
                _ => {
                    end(last.replace(row), false)?;
                }
            }
            Ok(())
        })?;
        end(last, true)?;
        Ok(rim)
    })?;
    table.release(workspace)?;
    Ok(rim)
}
