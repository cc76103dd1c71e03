//! Properties of one vertex, decided by the triangles around it.

use super::places::{Kind, Places};

/// Counts over some vertices. An edge counts at its higher vertex, a triangle at its highest.
#[derive(Debug, Clone, Copy, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(super) struct Tally {
    pub(super) referenced: u64,
    pub(super) edges: u64,
    pub(super) boundary_edges: u64,
    pub(super) non_manifold_edges: u64,
    pub(super) inconsistent_edges: u64,
    pub(super) pinched_vertices: u64,
    pub(super) repeated_triangles: u64,
}

impl std::ops::Add for Tally {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        let (a, b): ([u64; 7], [u64; 7]) = (bytemuck::cast(self), bytemuck::cast(other));
        bytemuck::cast(std::array::from_fn::<_, 7, _>(|i| a[i] + b[i]))
    }
}

/// Follows the last neighbour in a star, see [`Inspector::inspect`].
pub(super) const NO_MORE: u32 = u32::MAX;

/// Examines stars one after another.
#[derive(Debug, Default)]
pub(super) struct Inspector {
    pub(super) tally: Tally,
    /// Where defects are.
    pub(super) places: Places,
    /// (neighbour, slot): slot `2i` runs from the vertex to the neighbour in triangle `i`,
    /// slot `2i + 1` from the neighbour to the vertex.
    ends: Vec<u64>,
    /// The neighbour of each slot, by number.
    neighbour: Vec<u32>,
    /// Union–find over the neighbours.
    parent: Vec<u32>,
}

/// Bytes of an [`Inspector`] for stars of up to `triangles` triangles.
pub(super) fn scratch_bytes(triangles: usize) -> u64 {
    // Two slots for a triangle; the capacity of a vector may be twice its length.
    2 * 2 * triangles as u64 * (8 + 4 + 4)
}

impl Inspector {
    /// Examines the star of `vertex`, given as the pair (a, b) of each triangle (vertex, a, b).
    ///
    /// Afterwards `star`, as words, has the neighbours at the ends of boundary edges, then [`NO_MORE`] if
    /// there is room.
    pub(super) fn inspect(&mut self, vertex: u32, star: &mut [[u32; 2]]) {
        if star.is_empty() {
            return;
        }
        let Some(fan) = Fan::of(star) else {
            return self.inspect_any(vertex, star);
        };
        self.tally.referenced += 1;
        self.tally.edges += fan.edges_below(vertex, star);
        self.tally.boundary_edges += fan.ends_below(vertex);
        fan.put_ends(star);
    }

    /// As [`Inspector::inspect`], for any star.
    fn inspect_any(&mut self, vertex: u32, star: &mut [[u32; 2]]) {
        if star.is_empty() {
            return;
        }
        self.tally.referenced += 1;
        self.count_repeated(vertex, star);
        self.ends.clear();
        for (i, &[a, b]) in star.iter().enumerate() {
            self.ends.push((u64::from(a) << 32) | (2 * i as u64));
            self.ends.push((u64::from(b) << 32) | (2 * i as u64 + 1));
        }
        self.ends.sort_unstable();
        self.neighbour.clear();
        self.neighbour.resize(2 * star.len(), 0);
        self.parent.clear();
        let boundary: &mut [u32] = bytemuck::cast_slice_mut(star);
        let (mut open, mut manifold) = (0, true);
        for group in self.ends.chunk_by(|x, y| x >> 32 == y >> 32) {
            let other = (group[0] >> 32) as u32;
            let number = self.parent.len() as u32;
            self.parent.push(number);
            let mut leaving = 0;
            for end in group {
                let slot = (end & u64::from(u32::MAX)) as usize;
                self.neighbour[slot] = number;
                leaving += 1 - slot % 2;
            }
            manifold &= group.len() <= 2;
            if group.len() == 1 {
                boundary[open] = other;
                open += 1;
            }
            if other < vertex {
                self.tally.edges += 1;
                self.tally.boundary_edges += u64::from(group.len() == 1);
                self.tally.non_manifold_edges += u64::from(group.len() > 2);
                self.tally.inconsistent_edges += u64::from(group.len() == 2 && leaving != 1);
                match group.len() {
                    2 if leaving != 1 => self.places.note(Kind::Inconsistent, vertex),
                    3.. => self.places.note(Kind::NonManifold, vertex),
                    _ => {}
                }
            }
        }
        if let Some(end) = boundary.get_mut(open) {
            *end = NO_MORE;
        }
        if manifold && self.pieces() > 1 {
            self.tally.pinched_vertices += 1;
            self.places.note(Kind::Pinched, vertex);
        }
    }

    /// Triangles with the same corners as another one, counted at their highest corner.
    fn count_repeated(&mut self, vertex: u32, star: &[[u32; 2]]) {
        let highest = star.iter().filter(|[a, b]| *a < vertex && *b < vertex);
        self.ends.clear();
        let key = |&[a, b]: &[u32; 2]| (u64::from(a.min(b)) << 32) | u64::from(a.max(b));
        self.ends.extend(highest.map(key));
        self.ends.sort_unstable();
        let again = self.ends.windows(2).filter(|pair| pair[0] == pair[1]);
        let again = again.count() as u64;
        self.tally.repeated_triangles += again;
        if again > 0 {
            self.places.note(Kind::Repeated, vertex);
        }
    }

    /// Number of connected components of the triangles around the vertex.
    fn pieces(&mut self) -> usize {
        let mut pieces = self.parent.len();
        for pair in self.neighbour.chunks_exact(2) {
            let [a, b] = [pair[0], pair[1]].map(|end| root(&mut self.parent, end));
            if a != b {
                self.parent[a.max(b) as usize] = a.min(b);
                pieces -= 1;
            }
        }
        pieces
    }
}

/// A star without defects: its triangles (vertex, a, b) follow one another around the vertex, each beginning
/// at the end of the one before, and no two begin or end at the same neighbour.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Fan {
    /// The neighbours at the begin and at the end of the row; none if it is closed.
    ends: Option<[u32; 2]>,
}

impl Fan {
    /// The fan that a star of a few triangles is; `None` if it is none, or too large to tell.
    fn of(star: &[[u32; 2]]) -> Option<Self> {
        match star.len() {
            0..=8 => Self::among::<8>(star),
            9..=16 => Self::among::<16>(star),
            _ => None,
        }
    }

    /// As [`Fan::of`], for up to `N` triangles. Without branches that depend on the order of the triangles.
    fn among<const N: usize>(star: &[[u32; 2]]) -> Option<Self> {
        let mut begins = [NO_MORE; N];
        begins
            .iter_mut()
            .zip(star)
            .for_each(|(to, [a, _])| *to = *a);
        // For each triangle the triangles that begin at its end, as bits; and all that do.
        let (mut next, mut follow) = ([0u32; N], 0);
        for (next, [_, end]) in next.iter_mut().zip(star) {
            let bits = begins.iter().enumerate();
            *next = bits.fold(0, |sum, (k, a)| sum | u32::from(a == end) << k);
            follow |= *next;
        }
        let all = (1u32 << star.len()) - 1;
        let first = all & !follow;
        let open = first != 0;
        let begin = if open { first.trailing_zeros() } else { 0 } as usize;
        let (mut at, mut seen, mut single) = (begin, 1u32 << begin, true);
        for _ in 1..star.len() {
            single &= next[at].is_power_of_two();
            at = next[at].trailing_zeros() as usize % N;
            seen |= 1 << at;
        }
        // All triangles in one row or ring. Two that begin at one neighbour are never both seen; two that
        // end at one neighbour are followed by the same, or by none.
        if !single || seen != all {
            return None;
        }
        let ends = open.then_some([star[begin][0], star[at][1]]);
        // Two triangles in a ring have the same corners.
        let closed = next[at] == 1 << begin && star.len() > 2;
        (if open { next[at] == 0 } else { closed }).then_some(Self { ends })
    }

    /// Number of edges to neighbours below `vertex`.
    fn edges_below(self, vertex: u32, star: &[[u32; 2]]) -> u64 {
        let begins = star.iter().filter(|[a, _]| *a < vertex).count() as u64;
        begins + self.ends.map_or(0, |[_, end]| u64::from(end < vertex))
    }

    /// Number of boundary edges to neighbours below `vertex`.
    fn ends_below(self, vertex: u32) -> u64 {
        let ends = self.ends.into_iter().flatten();
        ends.map(|end| u64::from(end < vertex)).sum()
    }

    /// Replaces a star by the neighbours at the ends, ascending, then [`NO_MORE`] if there is room.
    fn put_ends(self, star: &mut [[u32; 2]]) {
        let words: &mut [u32] = bytemuck::cast_slice_mut(star);
        let ends = self.ends.map(|[a, b]| [a.min(b), a.max(b)]);
        let all = ends.into_iter().flatten().chain([NO_MORE]);
        words.iter_mut().zip(all).for_each(|(to, end)| *to = end);
    }
}

/// The root of `at` in a union–find; shortens the way to it.
pub(super) fn root(parent: &mut [u32], mut at: u32) -> u32 {
    while parent[at as usize] != at {
        let up = parent[parent[at as usize] as usize];
        parent[at as usize] = up;
        at = up;
    }
    at
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Fans are counted as other stars are.
        #[test]
        fn fans_are_as_they_are_without_being_fans(
            steps in prop::collection::vec((0u32..7, 0u32..7), 1..7),
            ring in any::<bool>(),
            row in any::<bool>(),
            turn in 0usize..7,
            vertex in 0u32..8,
        ) {
            let mut star: Vec<[u32; 2]> = if row {
                // A row of neighbours, or a ring.
                let len = steps.len() as u32;
                let next = |k: u32| if ring { (k + 1) % len } else { k + 1 };
                (0..len).map(|k| [k, next(k)]).collect()
            } else {
                steps.iter().map(|(a, b)| [*a, *b]).collect()
            };
            // Numbers from which that of the vertex is left out; corners differ.
            let other = |k: u32| k + u32::from(k >= vertex);
            star.iter_mut().for_each(|t| *t = t.map(other));
            star.retain(|[a, b]| a != b);
            let turn = turn % star.len().max(1);
            star.rotate_left(turn);
            let is_fan = !star.is_empty() && Fan::of(&star).is_some();
            prop_assert!(!row || star.len() < 3 || is_fan);
            let (mut small, mut large) = (Inspector::default(), Inspector::default());
            let mut copy = star.clone();
            small.inspect(vertex, &mut copy);
            let mut same = star.clone();
            large.inspect_any(vertex, &mut same);
            prop_assert_eq!(bytemuck::bytes_of(&small.tally), bytemuck::bytes_of(&large.tally));
            let ends = |star: &[[u32; 2]]| -> Vec<u32> {
                let words = star.as_flattened().iter().copied();
                words.take_while(|w| *w != NO_MORE).collect()
            };
            if is_fan {
                prop_assert_eq!(ends(&copy), ends(&same));
                prop_assert_eq!(large.tally.repeated_triangles, 0);
            }
        }
    }
}
