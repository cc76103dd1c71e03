//! Connected components of a graph on vertices, one range of vertices in memory at a time.
//!
//! Ranges are processed from the last to the first. The higher end of an edge is in the current range; its
//! lower end is there too or in a range below. When a range is closed it is contracted: each of its
//! components keeps its lowest outside neighbour, and this neighbour is joined to the other outside
//! neighbours of the component. A component without outside neighbours is complete and counted.

use super::buckets::Buckets;
use super::plan::Plan;
use super::star;
use outcrop_disk::error::Result;
use outcrop_disk::spill::row;
use outcrop_disk::workspace::Workspace;

/// Marks an unvisited vertex, or a component without outside neighbours.
const NONE: u32 = u32::MAX;

/// Recent edges remembered to avoid sending them down twice.
const RECENT: usize = 1 << 12;

/// Union–find over one range of vertices.
#[derive(Debug, Default)]
pub(super) struct Forest {
    first: u32,
    parent: Vec<u32>,
    lowest: Vec<u32>,
}

impl Forest {
    /// Resets it to the range of `length` vertices from `first`.
    pub(super) fn reset(&mut self, first: u32, length: usize) {
        self.first = first;
        for words in [&mut self.parent, &mut self.lowest] {
            words.clear();
            words.reserve_exact(length);
            words.resize(length, NONE);
        }
    }

    /// Notes that a vertex of the range belongs to the graph.
    pub(super) fn touch(&mut self, vertex: u32) {
        let at = vertex - self.first;
        let parent = &mut self.parent[at as usize];
        if *parent == NONE {
            *parent = at;
        }
    }

    fn root(&mut self, vertex: u32) -> u32 {
        self.touch(vertex);
        star::root(&mut self.parent, vertex - self.first)
    }

    fn join(&mut self, a: u32, b: u32) {
        // Most are joined already, and know it.
        let [up, other] = [a, b].map(|vertex| self.parent[(vertex - self.first) as usize]);
        if up == other && up != NONE {
            return;
        }
        let (a, b) = (self.root(a), self.root(b));
        let (low, high) = (a.min(b), a.max(b));
        self.parent[high as usize] = low;
    }
}

row! {
    /// An edge of the graph.
    struct Edge {
        /// The lower end.
        low: u32,
        /// The higher end.
        high: u32,
    }
    unpacked
}

/// A graph whose components are being counted.
#[derive(Debug)]
pub(super) struct Contraction {
    /// Edges in the bucket of the range of their higher end.
    edges: Buckets<Edge>,
    plan: Plan,
    /// Number of complete components.
    pub(super) complete: u64,
}

impl Contraction {
    pub(super) fn new(workspace: &Workspace, plan: &Plan, name: &str) -> Result<Self> {
        Ok(Self {
            edges: Buckets::new(workspace, name, plan.ranges, plan.blocks[1])?,
            plan: plan.clone(),
            complete: 0,
        })
    }

    /// Adds an edge whose higher end is in the range of `forest`.
    pub(super) fn connect(&mut self, forest: &mut Forest, low: u32, high: u32) -> Result<()> {
        if low >= forest.first {
            forest.join(low, high);
            return Ok(());
        }
        self.edges
            .push(self.plan.range_of(high), Edge { low, high })
    }

    /// Adds an edge before the range of its higher end is entered; its ends may be equal.
    pub(super) fn send(&mut self, low: u32, high: u32) -> Result<()> {
        self.edges
            .push(self.plan.range_of(high), Edge { low, high })
    }

    /// Contracts range `k`, to which nothing more is added.
    pub(super) fn close(&mut self, forest: &mut Forest, k: usize) -> Result<()> {
        let first = forest.first;
        let mut cursor = self.edges.cursor(k);
        while let Some(block) = self.edges.next(&mut cursor)? {
            for &Edge { low, high } in block.iter().filter(|edge| edge.low >= first) {
                forest.join(low, high);
            }
        }
        let mut cursor = self.edges.cursor(k);
        while let Some(block) = self.edges.next(&mut cursor)? {
            for &Edge { low, high } in block.iter().filter(|edge| edge.low < first) {
                let root = forest.root(high) as usize;
                forest.lowest[root] = forest.lowest[root].min(low);
            }
        }
        let none = Edge {
            low: NONE,
            high: NONE,
        };
        let mut recent = vec![none; RECENT];
        let mut cursor = self.edges.cursor(k);
        while let Some(block) = self.edges.next(&mut cursor)? {
            for &Edge { low: other, high } in block.iter().filter(|edge| edge.low < first) {
                let root = forest.root(high) as usize;
                let edge = Edge {
                    low: forest.lowest[root],
                    high: other,
                };
                let slot = &mut recent[(other ^ edge.low.rotate_left(16)) as usize % RECENT];
                if edge.low != other && *slot != edge {
                    *slot = edge;
                    self.edges.push(self.plan.range_of(other), edge)?;
                }
            }
        }
        self.edges.clear(k);
        let roots = forest.parent.iter().zip(&forest.lowest).enumerate();
        let complete = roots.filter(|&(i, (&up, &low))| up == i as u32 && low == NONE);
        self.complete += complete.count() as u64;
        Ok(())
    }
}
