//! Components of a mesh, and what is summed for each.
//!
//! Two vertices are in one component if triangles connect them: a union-find over all vertices, four bytes each,
//! which all threads fill. A root is the smallest vertex of its component, so the numbers of components do not
//! depend on the order of the work.
//!
//! A component has a volume of its own if it has no boundary: if each edge is run through as often one way as the
//! other. Every edge has a random number of 128 bits, which its triangles add or subtract: the sum is 0 without a
//! boundary, and otherwise with a chance of 2^-128.

use outcrop_disk::error::Result;
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::memory::Reservation;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};

/// A vertex without a triangle.
const NONE: u32 = u32::MAX;

/// Bytes of a vertex.
const VERTEX: u64 = 4;

/// Connections of vertices by triangles.
pub(crate) struct Connections {
    parents: Vec<AtomicU32>,
    _held: Reservation,
}

impl Connections {
    pub fn new(vertices: u64, workspace: &Workspace) -> Result<Self> {
        let held = workspace.reserve("volume: components", vertices * VERTEX)?;
        let mut parents = Vec::new();
        parents.resize_with(vertices as usize, || AtomicU32::new(NONE));
        Ok(Self {
            parents,
            _held: held,
        })
    }

    fn parent(&self, vertex: u32) -> u32 {
        self.parents[vertex as usize].load(Ordering::Relaxed)
    }

    /// Puts `to` in the place of `from`; false if there is something else by now.
    fn replace(&self, vertex: u32, from: u32, to: u32) -> bool {
        let parent = &self.parents[vertex as usize];
        let replaced = parent.compare_exchange(from, to, Ordering::Relaxed, Ordering::Relaxed);
        replaced.is_ok()
    }

    fn root(&self, mut vertex: u32) -> u32 {
        loop {
            let parent = self.parent(vertex);
            if parent == NONE && self.replace(vertex, NONE, vertex) || parent == vertex {
                return vertex;
            }
            if parent == NONE {
                continue;
            }
            let next = self.parent(parent);
            if next != parent && next != NONE {
                // A shorter way for those who come later.
                self.replace(vertex, parent, next);
            }
            vertex = parent;
        }
    }

    fn connect(&self, a: u32, b: u32) {
        let (mut a, mut b) = (self.root(a), self.root(b));
        while a != b {
            let (low, high) = (a.min(b), a.max(b));
            if self.replace(high, high, low) {
                return;
            }
            (a, b) = (self.root(low), self.root(high));
        }
    }

    /// Connects the corners of triangles.
    pub fn add(&self, triangles: &[[u32; 3]]) {
        for &[a, b, c] in triangles {
            self.connect(a, b);
            self.connect(b, c);
        }
    }

    /// The number of the component of each vertex; all triangles must have been added.
    pub fn finish(self) -> Components {
        let mut count = 0;
        for vertex in 0..self.parents.len() as u32 {
            let parent = self.parent(vertex);
            let number = match parent {
                NONE => NONE,
                // A parent is smaller, so it has its number.
                _ if parent != vertex => self.parent(parent),
                _ => {
                    count += 1;
                    count - 1
                }
            };
            self.parents[vertex as usize].store(number, Ordering::Relaxed);
        }
        Components {
            numbers: self,
            count,
        }
    }
}

/// The components of a mesh, in the order of their smallest vertices.
pub(crate) struct Components {
    numbers: Connections,
    pub count: u32,
}

impl Components {
    /// The component of a vertex with triangles.
    pub fn of(&self, vertex: u32) -> u32 {
        self.numbers.parent(vertex)
    }

    /// The smallest vertices of some components, which are given in ascending order.
    pub fn first_vertices(&self, wanted: &[u32]) -> Vec<u32> {
        let mut left = wanted.iter().peekable();
        let all = 0..self.numbers.parents.len() as u32;
        // Numbers ascend with the smallest vertices.
        let is_first = |vertex: &u32| left.next_if(|next| **next == self.of(*vertex)).is_some();
        all.filter(is_first).collect()
    }
}

/// What is summed for a component.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Parts {
    pub triangles: u64,
    /// Units of the volume.
    pub volume: i128,
    /// Units of the area.
    pub area: i128,
    /// Sum of the numbers of edges.
    pub rim: i128,
}

/// Words of [`Parts`].
const WORDS: usize = 7;

impl Parts {
    pub fn join(&mut self, other: &Self) {
        self.triangles += other.triangles;
        self.volume += other.volume;
        self.area += other.area;
        self.rim = self.rim.wrapping_add(other.rim);
    }
}

/// Sums for a range of components, filled by all threads.
pub(crate) struct Table {
    words: Vec<AtomicU64>,
}

impl Table {
    /// Bytes of a component.
    pub const EACH: u64 = (WORDS * size_of::<u64>()) as u64;

    pub fn new(count: u32) -> Self {
        let mut words = Vec::new();
        words.resize_with(count as usize * WORDS, || AtomicU64::new(0));
        Self { words }
    }

    /// Adds to a component. Additions of 128 bits are two of 64, with a carry that belongs to the lower one alone:
    /// so their order does not matter.
    pub fn add(&self, component: u32, parts: &Parts) {
        let words = &self.words[component as usize * WORDS..][..WORDS];
        words[0].fetch_add(parts.triangles, Ordering::Relaxed);
        let long = [parts.volume, parts.area, parts.rim];
        for (pair, number) in words[1..].chunks_exact(2).zip(long) {
            let low = pair[0].fetch_add(number as u64, Ordering::Relaxed);
            let carry = u64::from(low.overflowing_add(number as u64).1);
            let high = ((number >> 64) as u64).wrapping_add(carry);
            pair[1].fetch_add(high, Ordering::Relaxed);
        }
    }

    /// The sums, by component.
    pub fn all(&self) -> impl Iterator<Item = Parts> + '_ {
        self.words.chunks_exact(WORDS).map(|words| {
            let word = |k: usize| words[k].load(Ordering::Relaxed);
            let long = |k: usize| (u128::from(word(k + 1)) << 64 | u128::from(word(k))) as i128;
            Parts {
                triangles: word(0),
                volume: long(1),
                area: long(3),
                rim: long(5),
            }
        })
    }
}

/// The sum of the numbers of a triangle's edges, each with the sign of its direction.
pub(crate) fn rim(corners: [u32; 3]) -> i128 {
    let [a, b, c] = corners;
    [(a, b), (b, c), (c, a)]
        .into_iter()
        .fold(0i128, |sum, (from, to)| {
            let edge = u64::from(from.min(to)) << 32 | u64::from(from.max(to));
            let number = u128::from(mixed(edge)) << 64 | u128::from(mixed(!edge));
            match from.cmp(&to) {
                std::cmp::Ordering::Less => sum.wrapping_add(number as i128),
                std::cmp::Ordering::Equal => sum,
                std::cmp::Ordering::Greater => sum.wrapping_sub(number as i128),
            }
        })
}

/// A number that looks random: the last steps of SplitMix64 (Steele, Lea & Flood 2014), twice.
fn mixed(number: u64) -> u64 {
    let mut x = number.wrapping_add(0x9e37_79b9_7f4a_7c15);
    for _ in 0..2 {
        x = (x ^ x >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^= x >> 31;
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn components_are_numbered_by_their_smallest_vertices() {
        let workspace = Workspace::for_tests(2).unwrap();
        let connections = Connections::new(9, &workspace).unwrap();
        connections.add(&[[8, 5, 7], [1, 4, 6], [3, 6, 1], [5, 8, 7]]);
        let components = connections.finish();
        assert_eq!(components.count, 2);
        let of = [1, 3, 4, 5, 6, 7, 8].map(|vertex| components.of(vertex));
        assert_eq!(of, [0, 0, 0, 1, 0, 1, 1]);
        assert_eq!(components.first_vertices(&[0, 1]), [1, 5]);
        assert_eq!(components.first_vertices(&[1]), [5]);
    }

    #[test]
    fn a_closed_surface_has_no_rim() {
        let closed = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        let sum = |all: &[[u32; 3]]| all.iter().fold(0i128, |s, t| s.wrapping_add(rim(*t)));
        assert_eq!(sum(&closed), 0);
        assert_ne!(sum(&closed[1..]), 0);
        let mut turned = closed;
        turned[2].swap(0, 1);
        assert_ne!(sum(&turned), 0);
        assert_eq!(rim([4, 4, 7]), 0);
    }

    #[test]
    fn tables_add_long_numbers() {
        let table = Table::new(2);
        let parts = [
            1i128 << 100,
            -5,
            (1 << 64) - 1,
            i128::from(u64::MAX),
            -(1 << 90),
        ];
        for part in parts {
            let (volume, area, rim) = (part, -part, part);
            table.add(
                1,
                &Parts {
                    triangles: 2,
                    volume,
                    area,
                    rim,
                },
            );
        }
        let all: Vec<_> = table.all().collect();
        let sum: i128 = parts.iter().sum();
        assert_eq!(all[0], Parts::default());
        assert_eq!(
            (all[1].volume, all[1].area, all[1].triangles),
            (sum, -sum, 10)
        );
    }
}
