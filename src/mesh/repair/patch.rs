//! The patch of a block: the connections, across edges at vertices of the block, between the triangles that
//! touch it, and the boundary edges among these edges.
//!
//! No edge has more than two triangles and the surface is orientable, so the order of the edges does not
//! matter.

use crate::surface::parity::{ParitySets, Turned, constraint, word};
use crate::surface::sides::{pair_edges, parts};
use crate::surface::star::{EDGES, Triangle};
use outcrop_disk::workspace::memory::bytes_of;
use outcrop_stages::ids::{Id, Ids, Label, Side, TriangleIndex};

/// Labels and boundary of the triangles that touch a block. Triangles with the same label are connected.
#[derive(Debug)]
pub struct Patch {
    /// For each triangle `label << 1 | flip`; `flip` is its orientation relative to its label.
    pub words: Vec<Turned<Label>>,
    /// Number of labels.
    pub labels: u32,
    /// Number of labels with a triangle that is not interior; their numbers come first.
    pub global: u32,
    /// For each triangle, true if it has a boundary edge at a vertex of the block.
    pub open: Vec<bool>,
    /// For each vertex of the block, the number of boundary edges at it, up to 255.
    pub rims: Vec<u8>,
}

/// The word of a triangle without a label.
const NONE: Turned<Label> = Turned::NONE;

/// The labels of triangles during the traversal of edges.
struct Labels {
    /// As in [`Patch`], or [`NONE`].
    words: Vec<Turned<Label>>,
    sets: ParitySets<Label>,
}

impl Labels {
    /// Merges the labels of two triangles; `flip` if one of the two must be turned.
    #[inline]
    fn relate(&mut self, a: usize, b: usize, flip: bool) {
        match (self.words[a], self.words[b]) {
            (NONE, NONE) => {
                self.words[a] = word((self.sets.push(), false));
                self.words[b] = self.words[a].turn(flip);
            }
            (known, NONE) => self.words[b] = known.turn(flip),
            (NONE, known) => self.words[a] = known.turn(flip),
            (known, other) if known.turn(flip) != other => {
                let ((a, x), (b, y)) = (constraint(known), constraint(other));
                let fits = self.sets.join(a, b, flip ^ x ^ y);
                debug_assert!(fits, "a surface that is not orientable");
            }
            _ => {}
        }
    }

    /// Gives every triangle without a label a label of its own.
    fn complete(&mut self) {
        for unknown in self.words.iter_mut().filter(|word| **word == NONE) {
            *unknown = word((self.sets.push(), false));
        }
    }
}

struct Builder<'a> {
    ids: Ids,
    triangles: &'a [Triangle],
    labels: Labels,
    open: Vec<bool>,
    rims: Vec<u8>,
}

impl Patch {
    /// Builds the patch of all `triangles` that touch the vertices `ids`, given in ascending order.
    #[must_use]
    pub fn of(ids: Ids, triangles: &[Triangle]) -> Self {
        let mut builder = Builder {
            labels: Labels {
                words: vec![NONE; triangles.len()],
                sets: ParitySets::new(0),
            },
            open: vec![false; triangles.len()],
            rims: vec![0; ids.len()],
            ids,
            triangles,
        };
        builder.inside();
        builder.across();
        builder.labels.complete();
        builder.number()
    }

    /// Bytes needed to build the patch of a number of triangles and vertices: its own lists, and those with
    /// which pairs of triangles are found.
    #[must_use]
    pub fn estimate(triangles: usize, vertices: usize) -> u64 {
        (9 * triangles + 17 * vertices) as u64
    }

    /// Allocated bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        bytes_of(&self.words) + bytes_of(&self.open) + bytes_of(&self.rims)
    }
}

impl Builder<'_> {
    /// Processes the edges with both ends in the block.
    fn inside(&mut self) {
        let Self {
            labels, open, rims, ..
        } = self;
        // An edge between the first and the last vertex of a triangle runs down, others run up.
        let pair = |a: Side, b: Side| {
            let ((a, corner), (b, opposite)) = (parts(a), parts(b));
            let flip = (corner == 1) == (opposite == 1);
            labels.relate(a, b, flip);
        };
        let lone = |side: Side, ends: [u32; 2]| {
            open[parts(side).0] = true;
            for end in ends {
                let rim = &mut rims[end as usize];
                *rim = rim.saturating_add(1);
            }
        };
        pair_edges(self.ids, self.triangles, pair, lone);
    }

    /// Processes the edges with one end in the block.
    fn across(&mut self) {
        let mut edges: Vec<(Id, Id, TriangleIndex, bool)> = Vec::new();
        for (number, t) in self.triangles.iter().enumerate() {
            if self.ids.contains(&t[0]) && self.ids.contains(&t[2]) {
                continue;
            }
            for (a, b, _, up) in EDGES {
                if self.ids.contains(&t[a]) != self.ids.contains(&t[b]) {
                    edges.push((t[a], t[b], TriangleIndex::at(number), up));
                }
            }
        }
        edges.sort_unstable();
        let mut rest = &edges[..];
        while let Some(&(low, high, number, up)) = rest.first() {
            match rest.get(1) {
                Some(&(l, h, other, other_up)) if (l, h) == (low, high) => {
                    let both = [number, other].map(TriangleIndex::index);
                    self.labels.relate(both[0], both[1], up == other_up);
                    rest = &rest[2..];
                }
                _ => {
                    self.open[number.index()] = true;
                    let own = if self.ids.contains(&low) { low } else { high };
                    let rim = &mut self.rims[self.ids.place(own)];
                    *rim = rim.saturating_add(1);
                    rest = &rest[1..];
                }
            }
        }
    }

    /// Numbers the labels; those with triangles that are not interior come first.
    fn number(self) -> Patch {
        let Labels {
            mut words,
            mut sets,
        } = self.labels;
        sets.flatten();
        let mut numbers = vec![Label::NONE; sets.len()];
        let mut labels = 0;
        let mut number = |before: Turned<Label>| {
            let (label, turned) = constraint(before);
            let (root, flip) = sets.look(label);
            let number = &mut numbers[root.index()];
            if *number == Label::NONE {
                *number = Label::new(labels);
                labels += 1;
            }
            (*number, flip ^ turned)
        };
        let mut global = 0;
        for (word, t) in words.iter().zip(self.triangles) {
            if !(self.ids.contains(&t[0]) && self.ids.contains(&t[2])) {
                global = global.max(number(*word).0.get() + 1);
            }
        }
        for before in &mut words {
            *before = word(number(*before));
        }
        Patch {
            words,
            labels,
            global,
            open: self.open,
            rims: self.rims,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use outcrop_stages::ids::triangle;

    #[test]
    fn a_strip_across_a_border() {
        // 0-1-2, 1-2-3, 2-3-4 and, separate, 5-6-7; the block ends at 6.
        let triangles = [[0, 1, 2], [1, 2, 3], [2, 3, 4], [5, 6, 7]].map(triangle);
        let patch = Patch::of(Ids::of(0..6), &triangles);
        assert_eq!((patch.labels, patch.global), (2, 1));
        let parts = |w: &Turned<Label>| constraint(*w);
        let labels: Vec<u32> = patch.words.iter().map(|w| parts(w).0.get()).collect();
        assert_eq!(labels, [1, 1, 1, 0]);
        // Adjacent triangles of a strip, with ascending ids, run along their common edge in the same
        // direction.
        let flips: Vec<bool> = patch.words[..3].iter().map(|w| parts(w).1).collect();
        assert_eq!(flips, [false, true, false]);
        assert_eq!(patch.open, [true, true, true, true]);
        assert_eq!(patch.rims, [2, 2, 2, 2, 2, 2]);
    }

    #[test]
    fn a_closed_surface_has_no_rim() {
        let tetrahedron = [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]].map(triangle);
        for ids in [0..4, 0..2, 1..3, 3..4].map(Ids::of) {
            let touches = |t: &Triangle| t.iter().any(|v| ids.contains(v));
            let triangles: Vec<Triangle> = tetrahedron.into_iter().filter(touches).collect();
            let patch = Patch::of(ids, &triangles);
            assert_eq!(patch.labels, 1);
            assert_eq!(patch.open, vec![false; triangles.len()]);
            assert_eq!(patch.rims, vec![0; ids.len()]);
        }
    }
}
