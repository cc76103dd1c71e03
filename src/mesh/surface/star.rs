//! The triangles around the vertices and edges of a block.

use bytemuck::{Zeroable, zeroed_vec};
use outcrop_disk::workspace::memory::bytes_of;
pub use outcrop_stages::ids::Triangle;
use outcrop_stages::ids::{Id, Ids, TriangleIndex};

/// The three edges of a triangle as positions of its vertices: first, second, opposite vertex, and true if
/// the edge runs from low to high in the orientation `0 → 1 → 2`.
pub const EDGES: [(usize, usize, usize, bool); 3] =
    [(0, 1, 2, true), (0, 2, 1, false), (1, 2, 0, true)];

/// True if two triangles with ascending ids that share the edge `low < high` need opposite flips to be
/// oriented alike.
#[must_use]
pub fn opposed(t: Triangle, u: Triangle, low: Id, high: Id) -> bool {
    runs_up(t, low, high) == runs_up(u, low, high)
}

fn runs_up(t: Triangle, low: Id, high: Id) -> bool {
    !(t[0] == low && t[2] == high)
}

/// The ascending ids of an oriented triangle that starts with its smallest vertex.
#[must_use]
pub fn sorted([i, a, b]: Triangle) -> Triangle {
    if a < b { [i, a, b] } else { [i, b, a] }
}

/// The other two vertices of a triangle at `v`, in ascending order.
#[must_use]
#[inline]
pub fn others([a, b, c]: Triangle, v: Id) -> [Id; 2] {
    [if a == v { b } else { a }, if c == v { b } else { c }]
}

/// True if `v` is a vertex of `t`.
#[must_use]
pub fn has(t: Triangle, v: Id) -> bool {
    t[0] == v || t[1] == v || t[2] == v
}

/// Lists for the vertices of a block, contiguous in memory. The room is counted first, so filling them
/// allocates nothing. Used for [`Star`] and [`EdgesUp`], and by the insertion of candidates for the triangles
/// around a vertex.
#[derive(Debug, Default)]
pub struct ByVertex<T> {
    ids: Ids,
    /// Index of the first entry of each vertex.
    start: Vec<u32>,
    /// Index after the last entry of each vertex.
    end: Vec<u32>,
    list: Vec<T>,
}

impl<T: Copy + Zeroable> ByVertex<T> {
    /// Empty lists for the vertices `ids`, each with room for as many entries as it occurs in `vertices`.
    pub fn with_room(ids: Ids, vertices: impl Iterator<Item = Id>) -> Self {
        let mut start = vec![0u32; ids.len() + 1];
        let behind = &mut start[1..];
        vertices.for_each(|v| {
            if let Some(room) = behind.get_mut(ids.find(v)) {
                *room += 1;
            }
        });
        for v in 0..ids.len() {
            start[v + 1] += start[v];
        }
        let end = start[..ids.len()].to_vec();
        let list = zeroed_vec(start[ids.len()] as usize);
        Self {
            ids,
            start,
            end,
            list,
        }
    }

    /// Allocated bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        bytes_of(&self.start) + bytes_of(&self.end) + bytes_of(&self.list)
    }

    /// Appends an entry to the list of `v`; ignored if `v` is not in the block or its list is full.
    #[inline]
    pub fn push(&mut self, v: Id, entry: T) {
        let v = self.ids.find(v);
        if let Some(end) = self.end.get_mut(v)
            && *end < self.start[v + 1]
        {
            self.list[*end as usize] = entry;
            *end += 1;
        }
    }

    /// The entries of a vertex of the block, in the order of insertion.
    #[must_use]
    #[inline]
    pub fn at(&self, v: Id) -> &[T] {
        let v = self.ids.place(v);
        &self.list[self.start[v] as usize..self.end[v] as usize]
    }
}

/// For each vertex of a block, its star: the numbers of the triangles that contain it.
pub type Star = ByVertex<TriangleIndex>;

impl Star {
    /// The stars of the vertices `ids`, with all `triangles` numbered in their order.
    #[must_use]
    pub fn of(ids: Ids, triangles: &[Triangle]) -> Self {
        let mut star = Self::with_room(ids, triangles.iter().flatten().copied());
        for (number, t) in (0..).map(TriangleIndex::new).zip(triangles) {
            t.iter().for_each(|v| star.push(*v, number));
        }
        star
    }
}

/// For each vertex of a block, the edges to higher vertices: the higher vertex and the number of a triangle
/// there. Used to find the neighbours of a triangle.
pub type EdgesUp = ByVertex<(Id, TriangleIndex)>;

impl EdgesUp {
    /// No edges, with room for those of `triangles`.
    #[must_use]
    pub fn with_room_for<'a>(ids: Ids, triangles: impl Iterator<Item = &'a Triangle>) -> Self {
        // Two edges start at the lowest vertex, one at the middle one.
        Self::with_room(ids, triangles.flat_map(|t| [t[0], t[0], t[1]]))
    }

    /// Adds triangle `t` as `number`.
    pub fn add(&mut self, t: Triangle, number: TriangleIndex) {
        for (a, b, ..) in EDGES {
            self.push(t[a], (t[b], number));
        }
    }

    /// Numbers of the triangles at the edge `low < high`, in order of insertion; none if `low` is
    /// not in the block.
    pub fn at_edge(&self, low: Id, high: Id) -> impl Iterator<Item = TriangleIndex> + '_ {
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

/// The components of the link of one vertex, which are its fans: triangles connected through edges at the
/// vertex. Only for links whose nodes have at most two edges. The memory is reused for each vertex.
#[derive(Debug, Default)]
pub struct Link {
    edges: Vec<[Id; 2]>,
    group: Vec<usize>,
    /// For each component, true if it is a closed cycle.
    closed: Vec<bool>,
}

impl Link {
    /// Reads the triangles around `v`.
    pub fn set(&mut self, v: Id, triangles: impl Iterator<Item = Triangle>) {
        self.edges.clear();
        self.edges.extend(triangles.map(|t| others(t, v)));
        self.group.clear();
        self.group.resize(self.edges.len(), usize::MAX);
        self.closed.clear();
        for seed in 0..self.edges.len() {
            if self.group[seed] == usize::MAX {
                let number = self.closed.len();
                self.group[seed] = number;
                let [a, b] = self.edges[seed];
                let closed = self.follow(a, b, number);
                if !closed {
                    self.follow(b, a, number);
                }
                self.closed.push(closed);
            }
        }
    }

    /// Walks from node `from` along edges without a component; true if it ends at `goal`.
    fn follow(&mut self, from: Id, goal: Id, number: usize) -> bool {
        let mut node = from;
        while node != goal {
            let is_next =
                |e: &usize| self.group[*e] == usize::MAX && self.edges[*e].contains(&node);
            let Some(edge) = (0..self.edges.len()).find(is_next) else {
                return false;
            };
            self.group[edge] = number;
            node = node.other(self.edges[edge]);
        }
        true
    }

    /// Number of components.
    #[must_use]
    pub fn groups(&self) -> usize {
        self.closed.len()
    }

    /// The component of the triangle with index `index` in the order given.
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
