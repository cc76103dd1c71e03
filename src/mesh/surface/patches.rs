//! Patches: small flat parts of a block, the units whose relative orientation is decided.

use super::evidence::{Evidence, LongNormal};
use super::parity::ParitySets;
use super::sides::{across, parts};
use super::star::{EDGES, Triangle};
use outcrop_disk::workspace::memory::bytes_of;
use outcrop_stages::ids::{Ids, PatchNumber, Side, TriangleIndex};
use std::ops::Range;

/// An edge between two triangles inside a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SharedEdge {
    /// The earlier triangle.
    pub a: TriangleIndex,
    /// The later one.
    pub b: TriangleIndex,
    /// True if one of the two must be turned to orient them alike.
    pub flip: bool,
    /// Weight of the edge, see [`weight`].
    pub weight: u8,
}

/// The patches of a block.
#[derive(Debug)]
pub struct Patches {
    /// The joined triangles, with their relative orientations.
    pub sets: ParitySets<TriangleIndex>,
    /// The patch of each triangle.
    pub of: Vec<PatchNumber>,
    /// For each patch, its smallest triangle, which defines its orientation, and its number of triangles.
    pub roots: Vec<(TriangleIndex, u32)>,
    /// Edges between patches, and edges inside a patch whose triangles are not oriented alike, by ascending
    /// triangles.
    pub shared: Vec<SharedEdge>,
}

impl Patches {
    /// Joins the interior `triangles` of the block of `ids`, ascending, across their flat edges, if their
    /// smallest ids are in the same run of `patch` ids.
    #[must_use]
    pub fn of(ids: Ids, triangles: &[Triangle], evidence: &Evidence, patch: u32) -> Self {
        let across = across(ids, triangles);
        let mut sets = ParitySets::new(triangles.len());
        let mut runs = Runs {
            triangles,
            across: &across,
            evidence,
            normals: Vec::new(),
            edges: Vec::new(),
            shared: Vec::new(),
        };
        let mut first = 0;
        while let Some(t) = triangles.get(first) {
            let end = (t[0].index() / patch as usize + 1) * patch as usize;
            let count = triangles[first..].partition_point(|t| t[0].index() < end);
            runs.join(first..first + count, &mut sets);
            first += count;
        }
        let mut shared = runs.shared;
        drop(across);
        let (of, roots) = number(&mut sets);
        let apart = |j: &SharedEdge| of[j.a.index()] != of[j.b.index()];
        shared.retain(|j| apart(j) || sets.relation(j.a, j.b) != Some(j.flip));
        for j in &mut shared {
            let [a, b] = [j.a, j.b].map(|n| evidence.long_normal(triangles[n.index()]));
            j.weight = a.weight(b, j.flip) as u8;
        }
        Self {
            sets,
            of,
            roots,
            shared,
        }
    }

    /// Allocated bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let sets = 4 * self.sets.len() as u64;
        bytes_of(&self.shared) + bytes_of(&self.of) + bytes_of(&self.roots) + sets
    }
}

/// Joins triangles run by run.
struct Runs<'a> {
    triangles: &'a [Triangle],
    across: &'a [[Side; 3]],
    evidence: &'a Evidence,
    /// Normals of the triangles of the run.
    normals: Vec<LongNormal>,
    /// Buffer for the edges between triangles of the run, as in a [`SharedEdge`].
    edges: Vec<(TriangleIndex, TriangleIndex, bool)>,
    /// The edges that were not joined, without their weights.
    shared: Vec<SharedEdge>,
}

impl Runs<'_> {
    /// Joins the triangles of a run across their flat edges.
    fn join(&mut self, run: Range<usize>, sets: &mut ParitySets<TriangleIndex>) {
        let Runs { normals, edges, .. } = self;
        normals.clear();
        let triangles = &self.triangles[run.clone()];
        normals.extend(triangles.iter().map(|t| self.evidence.long_normal(*t)));
        if edges.len() < 3 * run.len() {
            edges.resize(3 * run.len(), Default::default());
        }
        let mut count = 0;
        for (n, sides) in (run.start..).zip(&self.across[run.clone()]) {
            // Branches here would be unpredictable, so every edge is written and only some are counted.
            for (_, _, opposite, _) in EDGES {
                let side = sides[opposite];
                let (m, corner) = parts(side);
                // Edges between the first and the last vertex of a triangle run down, others run up.
                let ends = [n, m].map(TriangleIndex::at);
                edges[count] = (ends[0], ends[1], (opposite == 1) == (corner == 1));
                count += usize::from(side != Side::NONE && m > n);
            }
        }
        for &(a, b, flip) in &edges[..count] {
            let (n, m) = (a.index(), b.index());
            let flat = || normals[n - run.start].is_flat(normals[m - run.start], flip);
            if !(m < run.end && flat() && sets.join_to_smaller(a, b, flip)) {
                let weight = 0;
                self.shared.push(SharedEdge { a, b, flip, weight });
            }
        }
    }
}

/// Numbers the sets in the order of their first triangles.
fn number(sets: &mut ParitySets<TriangleIndex>) -> (Vec<PatchNumber>, Vec<(TriangleIndex, u32)>) {
    let mut number = vec![PatchNumber::NONE; sets.len()];
    let mut of = Vec::with_capacity(sets.len());
    let mut roots: Vec<(TriangleIndex, u32)> = Vec::new();
    for triangle in (0..sets.len()).map(TriangleIndex::at) {
        let (root, _) = sets.find(triangle);
        let number = &mut number[root.index()];
        if *number == PatchNumber::NONE {
            *number = PatchNumber::at(roots.len());
            roots.push((root, 0));
        }
        roots[number.index()].1 += 1;
        of.push(*number);
    }
    (of, roots)
}

#[cfg(test)]
pub(super) mod tests;
