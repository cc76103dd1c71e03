//! The patch of a block: how the triangles that touch it hang together across the edges at its
//! vertices, and which of these edges are boundary.
//!
//! No edge has more than two triangles and the surface is orientable; so it does not matter in
//! which order edges are looked at.

use crate::stages::surface::by_end::ByLowerEnd;
use crate::stages::surface::parity::ParitySets;
use crate::stages::surface::star::{EDGES, Triangle};
use crate::workspace::memory::{Holding, bytes_of, hold};
use std::ops::Range;

/// What is known of a block's triangles.
#[derive(Debug)]
pub struct Patch {
    /// For each triangle `label << 1 | flip`, its orientation relative to its label.
    pub words: Vec<u32>,
    /// Number of labels.
    pub labels: u32,
    /// Number of labels with a triangle that is not interior; they come first.
    pub global: u32,
    /// For each triangle, whether it has a boundary edge at a vertex of the block.
    pub open: Vec<bool>,
    /// For each vertex of the block, the number of boundary edges at it, up to 255.
    pub rims: Vec<u8>,
    _held: Holding,
}

/// A triangle without a label.
const NONE: u32 = u32::MAX;
/// An edge that has its two triangles.
const PAIRED: u32 = u32::MAX;

struct Builder<'a> {
    ids: Range<u32>,
    triangles: &'a [Triangle],
    words: Vec<u32>,
    sets: ParitySets,
    open: Vec<bool>,
    rims: Vec<u8>,
    /// For each vertex `y`, the last vertex `v < y` whose edge to it was seen (plus one, in the
    /// upper half), and the triangle there: number and whether it runs from `v` to `y`.
    seen: Vec<u64>,
}

impl Patch {
    /// Looks at all `triangles` that touch the vertices `ids`, in ascending order.
    #[must_use]
    pub fn of(ids: Range<u32>, triangles: &[Triangle]) -> Self {
        let mut builder = Builder {
            words: vec![NONE; triangles.len()],
            sets: ParitySets::new(0),
            open: vec![false; triangles.len()],
            rims: vec![0; ids.len()],
            seen: vec![0; ids.len()],
            ids,
            triangles,
        };
        let lists = bytes_of(&builder.words) + bytes_of(&builder.open) + bytes_of(&builder.rims);
        let held = hold(lists);
        builder.inside();
        builder.seen = Vec::new();
        builder.across();
        builder.number(held)
    }
}

impl Builder<'_> {
    /// The edges with both ends in the block, by their lower ends.
    fn inside(&mut self) {
        let size = self.ids.len() as u32;
        let edges = ByLowerEnd::of(self.ids.clone(), self.triangles);
        let mut next = edges.first();
        let lists = edges.bytes();
        let mut held = hold(lists + bytes_of(&self.seen));
        for v in 0..size {
            let upper = edges.upper(v);
            let first = next;
            let mut single = 0;
            for &number in upper {
                let y = self.triangles[number as usize][2] - self.ids.start;
                single += self.visit(v, y, number, true);
                self.named(number);
            }
            while let Some(&t) = self
                .triangles
                .get(next)
                .filter(|t| t[0] == self.ids.start + v)
            {
                for (y, up) in [(t[1], true), (t[2], false)] {
                    let y = y - self.ids.start;
                    if y < size {
                        single += self.visit(v, y, next as u32, up);
                    }
                }
                self.named(next as u32);
                next += 1;
            }
            if single > 0 {
                self.note_single(v, upper, first..next);
            }
        }
        let labels = 4 * self.sets.len() as u64;
        held.set(lists + bytes_of(&self.seen) + labels);
    }

    /// Sees triangle `number` at the edge from `v` to `y`; 1 for the edge's first, -1 for its second.
    #[inline]
    fn visit(&mut self, v: u32, y: u32, number: u32, up: bool) -> i32 {
        let tag = u64::from(v + 1) << 32;
        let seen = self.seen[y as usize];
        if seen >> 32 != tag >> 32 {
            self.seen[y as usize] = tag | u64::from(number << 1 | u32::from(up));
            return 1;
        }
        let other = seen as u32;
        debug_assert_ne!(other, PAIRED, "an edge with three triangles");
        self.seen[y as usize] = tag | u64::from(PAIRED);
        self.relate(other >> 1, number, (other & 1 == 1) == up);
        -1
    }

    /// Puts `b` into the set of `a`, which has a label; `flip` if one must be turned.
    #[inline]
    fn relate(&mut self, a: u32, b: u32, flip: bool) {
        let (known, new) = (
            self.words[a as usize] ^ u32::from(flip),
            self.words[b as usize],
        );
        if new == NONE {
            self.words[b as usize] = known;
        } else if known != new {
            let turned = (known ^ new) & 1 == 1;
            let fits = self.sets.join(known >> 1, new >> 1, turned);
            debug_assert!(fits, "a surface that is not orientable");
        }
    }

    /// Gives triangle `number` a label of its own if it has none.
    #[inline]
    fn named(&mut self, number: u32) {
        if self.words[number as usize] == NONE {
            self.words[number as usize] = self.sets.push() << 1;
        }
    }

    /// Notes the edges up from `v` that were seen once.
    fn note_single(&mut self, v: u32, upper: &[u32], own: Range<usize>) {
        let own = own.flat_map(|n| [(n, 1), (n, 2)]);
        for (number, corner) in upper.iter().map(|&n| (n as usize, 2)).chain(own) {
            let y = (self.triangles[number][corner] - self.ids.start) as usize;
            if let Some(&seen) = self.seen.get(y)
                && seen >> 32 == u64::from(v + 1)
                && seen as u32 != PAIRED
            {
                self.open[number] = true;
                for end in [v as usize, y] {
                    self.rims[end] = self.rims[end].saturating_add(1);
                }
            }
        }
    }

    /// The edges with one end in the block.
    fn across(&mut self) {
        let mut edges: Vec<(u32, u32, u32, bool)> = Vec::new();
        for (number, t) in self.triangles.iter().enumerate() {
            if self.ids.contains(&t[0]) && self.ids.contains(&t[2]) {
                continue;
            }
            self.mixed_edges(number as u32, *t, &mut edges);
        }
        edges.sort_unstable();
        let mut rest = &edges[..];
        while let Some(&(low, high, number, up)) = rest.first() {
            self.named(number);
            match rest.get(1) {
                Some(&(l, h, other, other_up)) if (l, h) == (low, high) => {
                    self.relate(number, other, up == other_up);
                    rest = &rest[2..];
                }
                _ => {
                    self.open[number as usize] = true;
                    let own = if self.ids.contains(&low) { low } else { high };
                    let rim = &mut self.rims[(own - self.ids.start) as usize];
                    *rim = rim.saturating_add(1);
                    rest = &rest[1..];
                }
            }
        }
    }

    fn mixed_edges(&self, number: u32, t: Triangle, edges: &mut Vec<(u32, u32, u32, bool)>) {
        for (a, b, _, up) in EDGES {
            if self.ids.contains(&t[a]) != self.ids.contains(&t[b]) {
                edges.push((t[a], t[b], number, up));
            }
        }
    }

    /// Numbers the labels, those of triangles that are not interior first.
    fn number(mut self, held: Holding) -> Patch {
        self.sets.flatten();
        let mut numbers = vec![NONE; self.sets.len()];
        let _numbers = hold(2 * bytes_of(&numbers));
        let mut labels = 0;
        let mut number = |label: u32| {
            let (root, flip) = self.sets.look(label);
            let number = &mut numbers[root as usize];
            if *number == NONE {
                *number = labels;
                labels += 1;
            }
            *number << 1 | u32::from(flip)
        };
        let mut global = 0;
        for (word, t) in self.words.iter().zip(self.triangles) {
            if !(self.ids.contains(&t[0]) && self.ids.contains(&t[2])) {
                global = global.max((number(word >> 1) >> 1) + 1);
            }
        }
        for word in &mut self.words {
            *word = number(*word >> 1) ^ (*word & 1);
        }
        Patch {
            words: self.words,
            labels,
            global,
            open: self.open,
            rims: self.rims,
            _held: held,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_strip_across_a_border() {
        // 0-1-2, 1-2-3, 2-3-4 and, apart, 5-6-7; the block ends at 6.
        let triangles = [[0, 1, 2], [1, 2, 3], [2, 3, 4], [5, 6, 7]];
        let patch = Patch::of(0..6, &triangles);
        assert_eq!((patch.labels, patch.global), (2, 1));
        let labels: Vec<u32> = patch.words.iter().map(|w| w >> 1).collect();
        assert_eq!(labels, [1, 1, 1, 0]);
        // Neighbours in a strip run through their edge the same way by ids.
        let flips: Vec<u32> = patch.words[..3].iter().map(|w| w & 1).collect();
        assert_eq!(flips, [0, 1, 0]);
        assert_eq!(patch.open, [true, true, true, true]);
        assert_eq!(patch.rims, [2, 2, 2, 2, 2, 2]);
    }

    #[test]
    fn a_closed_surface_has_no_rim() {
        let tetrahedron = [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]];
        for ids in [0..4, 0..2, 1..3, 3..4] {
            let touches = |t: &Triangle| t.iter().any(|v| ids.contains(v));
            let triangles: Vec<Triangle> = tetrahedron.into_iter().filter(touches).collect();
            let patch = Patch::of(ids.clone(), &triangles);
            assert_eq!(patch.labels, 1);
            assert_eq!(patch.open, vec![false; triangles.len()]);
            assert_eq!(patch.rims, vec![0; ids.len()]);
        }
    }
}
