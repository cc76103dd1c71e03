//! Triangles around the vertices of a block, and what a vertex or an edge sees of them.

use crate::workspace::memory::{Holding, bytes_of, hold};
use std::ops::Range;

/// A triangle by ascending ids.
pub type Triangle = [u32; 3];

/// The three edges of a triangle as positions of its vertices: first, second, opposite vertex, and
/// whether the edge runs from low to high in the orientation `0 → 1 → 2`.
pub const EDGES: [(usize, usize, usize, bool); 3] =
    [(0, 1, 2, true), (0, 2, 1, false), (1, 2, 0, true)];

/// Whether two triangles with ascending ids that share the edge `low < high` need opposite flags to
/// run through it in opposite directions.
#[must_use]
pub fn opposed(t: Triangle, u: Triangle, low: u32, high: u32) -> bool {
    runs_up(t, low, high) == runs_up(u, low, high)
}

fn runs_up(t: Triangle, low: u32, high: u32) -> bool {
    !(t[0] == low && t[2] == high)
}

/// The ids, ascending, of a triangle that begins with its smallest and runs either way.
#[must_use]
pub fn sorted([i, a, b]: [u32; 3]) -> Triangle {
    if a < b { [i, a, b] } else { [i, b, a] }
}

/// The other two vertices of a triangle at `v`, in ascending order.
#[must_use]
#[inline]
pub fn others([a, b, c]: Triangle, v: u32) -> [u32; 2] {
    [if a == v { b } else { a }, if c == v { b } else { c }]
}

/// True if `v` is a vertex of `t`.
#[must_use]
pub fn has(t: Triangle, v: u32) -> bool {
    t[0] == v || t[1] == v || t[2] == v
}

/// For each vertex of a block, the triangles that contain it; room for more can be left.
#[derive(Debug)]
pub struct Star {
    ids: Range<u32>,
    start: Vec<u32>,
    len: Vec<u32>,
    list: Vec<u32>,
    _held: Holding,
}

impl Star {
    /// An empty star with room for all of `triangles` at the vertices `ids`.
    pub fn with_room(ids: Range<u32>, triangles: impl Iterator<Item = Triangle>) -> Self {
        let mut start = vec![0u32; ids.len() + 1];
        for t in triangles {
            for v in t {
                if ids.contains(&v) {
                    start[(v - ids.start) as usize + 1] += 1;
                }
            }
        }
        for v in 0..ids.len() {
            start[v + 1] += start[v];
        }
        let list = vec![0; start[ids.len()] as usize];
        Self {
            _held: hold(2 * bytes_of(&start) + bytes_of(&list)),
            len: vec![0; ids.len()],
            ids,
            start,
            list,
        }
    }

    /// The star of all `triangles`, numbered in their order.
    #[must_use]
    pub fn of(ids: Range<u32>, triangles: &[Triangle]) -> Self {
        let mut star = Self::with_room(ids, triangles.iter().copied());
        for (number, &t) in triangles.iter().enumerate() {
            star.add(t, number as u32);
        }
        star
    }

    /// Puts in triangle `t` as `number`; room must have been left.
    pub fn add(&mut self, t: Triangle, number: u32) {
        for v in t {
            if self.ids.contains(&v) {
                let v = (v - self.ids.start) as usize;
                self.list[(self.start[v] + self.len[v]) as usize] = number;
                self.len[v] += 1;
            }
        }
    }

    /// Numbers of the triangles at a vertex of the block, in order of insertion.
    #[must_use]
    pub fn at(&self, v: u32) -> &[u32] {
        let v = (v - self.ids.start) as usize;
        let start = self.start[v] as usize;
        &self.list[start..start + self.len[v] as usize]
    }

    /// The vertices of the block.
    #[must_use]
    pub fn ids(&self) -> Range<u32> {
        self.ids.clone()
    }
}

/// For each vertex of a block, the edges to higher vertices with the triangles at them.
#[derive(Debug)]
pub struct Edges {
    ids: Range<u32>,
    start: Vec<u32>,
    len: Vec<u32>,
    /// Higher vertex and triangle.
    list: Vec<(u32, u32)>,
    _held: Holding,
}

impl Edges {
    /// No edges, with room for those of `triangles` whose lower vertex is in `ids`.
    #[must_use]
    pub fn with_room(ids: Range<u32>, triangles: &[Triangle]) -> Self {
        let mut start = vec![0u32; ids.len() + 1];
        for t in triangles {
            // Two edges begin at the lowest vertex, one at the middle one.
            for (v, edges) in [(t[0], 2), (t[1], 1)] {
                if ids.contains(&v) {
                    start[(v - ids.start) as usize + 1] += edges;
                }
            }
        }
        for v in 0..ids.len() {
            start[v + 1] += start[v];
        }
        let list = vec![(0, 0); start[ids.len()] as usize];
        Self {
            _held: hold(2 * bytes_of(&start) + bytes_of(&list)),
            list,
            len: vec![0; ids.len()],
            ids,
            start,
        }
    }

    /// Puts in triangle `t` as `number`; room must have been left.
    pub fn add(&mut self, t: Triangle, number: u32) {
        for (a, b, ..) in EDGES {
            if self.ids.contains(&t[a]) {
                let v = (t[a] - self.ids.start) as usize;
                self.list[(self.start[v] + self.len[v]) as usize] = (t[b], number);
                self.len[v] += 1;
            }
        }
    }

    /// Numbers of the triangles at the edge `low < high`, in order of insertion; none if `low` is
    /// not in the block.
    pub fn at(&self, low: u32, high: u32) -> impl Iterator<Item = u32> + '_ {
        let edges = if self.ids.contains(&low) {
            let v = (low - self.ids.start) as usize;
            let start = self.start[v] as usize;
            &self.list[start..start + self.len[v] as usize]
        } else {
            &[]
        };
        edges
            .iter()
            .filter(move |(other, _)| *other == high)
            .map(|(_, number)| *number)
    }
}

/// The components of the link of a vertex: groups of triangles that hang together through edges at
/// the vertex. Works for links whose nodes have at most two edges.
#[derive(Debug, Default)]
pub struct Link {
    edges: Vec<(u32, u32)>,
    group: Vec<usize>,
    /// Per group: is it a closed cycle?
    closed: Vec<bool>,
}

impl Link {
    /// Takes in the triangles around `v`.
    pub fn set(&mut self, v: u32, triangles: impl Iterator<Item = Triangle>) {
        self.edges.clear();
        self.edges
            .extend(triangles.map(|t| others(t, v)).map(|[a, b]| (a, b)));
        self.group.clear();
        self.group.resize(self.edges.len(), usize::MAX);
        self.closed.clear();
        for seed in 0..self.edges.len() {
            if self.group[seed] == usize::MAX {
                let number = self.closed.len();
                self.group[seed] = number;
                let (a, b) = self.edges[seed];
                let closed = self.follow(a, b, number);
                if !closed {
                    self.follow(b, a, number);
                }
                self.closed.push(closed);
            }
        }
    }

    /// Walks from node `from` through edges without a group; true if it ends at `goal`.
    fn follow(&mut self, from: u32, goal: u32, number: usize) -> bool {
        let mut node = from;
        loop {
            if node == goal {
                return true;
            }
            let next = (0..self.edges.len()).find(|&e| {
                self.group[e] == usize::MAX && (self.edges[e].0 == node || self.edges[e].1 == node)
            });
            let Some(edge) = next else { return false };
            self.group[edge] = number;
            let (a, b) = self.edges[edge];
            node = if a == node { b } else { a };
        }
    }

    /// Number of components.
    #[must_use]
    pub fn groups(&self) -> usize {
        self.closed.len()
    }

    /// The component of the triangle given as number `index`.
    #[must_use]
    pub fn group(&self, index: usize) -> usize {
        self.group[index]
    }

    /// True if a component is a closed cycle.
    #[must_use]
    pub fn is_closed(&self, group: usize) -> bool {
        self.closed[group]
    }
}
