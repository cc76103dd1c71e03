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

/// Lists for the vertices of a block, one behind the other in memory. The room is counted first, so
/// filling them allocates nothing. For whoever starts from a vertex: see [`Star`] and [`EdgesUp`]; the
/// insertion of candidates keeps there what it reads of the triangles around a vertex.
#[derive(Debug)]
pub struct ByVertex<T> {
    ids: Range<u32>,
    /// Where the room of each vertex begins.
    start: Vec<u32>,
    /// Where the entries of each vertex end.
    end: Vec<u32>,
    list: Vec<T>,
    _held: Holding,
}

impl<T: Copy + Default> ByVertex<T> {
    /// Empty lists for the vertices `ids`, with room for one entry each time that one of them is
    /// among `vertices`.
    pub fn with_room(ids: Range<u32>, vertices: impl Iterator<Item = u32>) -> Self {
        let mut start = vec![0u32; ids.len() + 1];
        let behind = &mut start[1..];
        vertices.for_each(|v| {
            if let Some(room) = behind.get_mut(v.wrapping_sub(ids.start) as usize) {
                *room += 1;
            }
        });
        for v in 0..ids.len() {
            start[v + 1] += start[v];
        }
        let end = start[..ids.len()].to_vec();
        let list = vec![T::default(); start[ids.len()] as usize];
        Self {
            _held: hold(bytes_of(&start) + bytes_of(&end) + bytes_of(&list)),
            ids,
            start,
            end,
            list,
        }
    }

    /// Puts an entry into the list of `v`; nothing if `v` is not in the block or has no room left.
    #[inline]
    pub fn push(&mut self, v: u32, entry: T) {
        let v = v.wrapping_sub(self.ids.start) as usize;
        if let Some(end) = self.end.get_mut(v)
            && *end < self.start[v + 1]
        {
            self.list[*end as usize] = entry;
            *end += 1;
        }
    }

    /// The entries of a vertex of the block, in the order in which they came.
    #[must_use]
    #[inline]
    pub fn at(&self, v: u32) -> &[T] {
        let v = (v - self.ids.start) as usize;
        &self.list[self.start[v] as usize..self.end[v] as usize]
    }
}

/// For each vertex of a block its star: the numbers of the triangles that contain it.
pub type Star = ByVertex<u32>;

impl Star {
    /// The stars in all `triangles`, numbered in their order.
    #[must_use]
    pub fn of(ids: Range<u32>, triangles: &[Triangle]) -> Self {
        let mut star = Self::with_room(ids, triangles.iter().flatten().copied());
        for (number, t) in (0..).zip(triangles) {
            t.iter().for_each(|v| star.push(*v, number));
        }
        star
    }
}

/// For each vertex of a block the edges to higher vertices: the higher vertex and the number of a
/// triangle there. For triangles that look for others at their edges.
pub type EdgesUp = ByVertex<(u32, u32)>;

impl EdgesUp {
    /// No edges, with room for those of `triangles`.
    #[must_use]
    pub fn with_room_for<'a>(
        ids: Range<u32>,
        triangles: impl Iterator<Item = &'a Triangle>,
    ) -> Self {
        // Two edges begin at the lowest vertex, one at the middle one.
        Self::with_room(ids, triangles.flat_map(|t| [t[0], t[0], t[1]]))
    }

    /// Puts in triangle `t` as `number`.
    pub fn add(&mut self, t: Triangle, number: u32) {
        for (a, b, ..) in EDGES {
            self.push(t[a], (t[b], number));
        }
    }

    /// Numbers of the triangles at the edge `low < high`, in order of insertion; none if `low` is
    /// not in the block.
    pub fn at_edge(&self, low: u32, high: u32) -> impl Iterator<Item = u32> + '_ {
        let edges = if self.ids.contains(&low) {
            self.at(low)
        } else {
            &[]
        };
        edges
            .iter()
            .filter(move |(other, _)| *other == high)
            .map(|(_, number)| *number)
    }
}

/// The components of the link of one vertex, which are its fans: triangles that hang together through
/// edges at the vertex. For links whose nodes have at most two edges. It is made anew for each vertex
/// in the same memory.
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
