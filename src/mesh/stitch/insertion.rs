//! The insertion of T12 candidates (paper, section 3.5, second part): rounds in rank order, with the tests of
//! [`super::admissibility`] and test IV. The same code serves insertion inside blocks and across them,
//! through the trait [`Mesh`].

use super::admissibility::{Neighborhood, Refusal, examine};
use super::stats::InsertStats;
use crate::surface::parity::{OrientationConstraint, ParitySets};
use crate::surface::star::Triangle;
use outcrop_disk::spill::row;
use outcrop_geom::{Point, distance2};
use outcrop_stages::ids::{Id, Number, TriangleIndex};

/// The mesh around candidates, which grows as they are inserted.
pub trait Mesh: Neighborhood {
    /// The type of a component's number.
    type Part: Number;
    /// Time of the last insertion of a triangle at a vertex of a candidate; 0 if there was none.
    fn changed(&self, v: Id) -> u32;
    /// The component of a triangle of the mesh, and true if the triangle is turned against it.
    fn component(&mut self, number: TriangleIndex) -> OrientationConstraint<Self::Part>;
    /// The merged components, for test IV.
    fn components(&mut self) -> &mut ParitySets<Self::Part>;
    /// Adds a triangle at the time `now`. There is at least one constraint, and the components of
    /// `constraints` have been merged.
    fn insert(&mut self, t: Triangle, constraints: &[OrientationConstraint<Self::Part>], now: u32);
}

/// Tries the candidates, ascending, in rounds until a round inserts none. The candidates left in the list
/// failed test I only.
pub fn insert_candidates(
    mesh: &mut impl Mesh,
    candidates: &mut Vec<Candidate>,
    cos_max_angle: f64,
    counts: &mut InsertStats,
) {
    let (mut link, mut constraints) = (Vec::new(), Vec::new());
    // The number of insertions so far, plus one.
    let mut now = 1;
    loop {
        let before = now;
        candidates.retain_mut(|candidate| {
            let t = candidate.ids;
            // A candidate that failed test I can only pass after a triangle was added at another of its
            // edges.
            let changed = t.map(|v| u8::from(mesh.changed(v) > candidate.tried));
            if candidate.tried > 0 && changed.iter().sum::<u8>() < 2 {
                return true;
            }
            candidate.tried = now;
            match examine(t, mesh, cos_max_angle, &mut link) {
                Err(Refusal::Unconnected) => return true,
                Err(refusal) => counts.refuse(refusal),
                // Test IV.
                Ok(adjacent) => {
                    constraints.clear();
                    for (number, turned) in adjacent.into_iter().flatten() {
                        let (component, flip) = mesh.component(number);
                        constraints.push((component, flip ^ turned));
                    }
                    if mesh.components().merge(&constraints) {
                        now += 1;
                        mesh.insert(t, &constraints, now);
                        counts.accepted += 1;
                    } else {
                        counts.orientation += 1;
                    }
                }
            }
            false
        });
        if now == before {
            return;
        }
    }
}

/// A candidate; the order is that in which candidates are tried.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Candidate {
    /// The class and, below 2^62, the square of the longest edge.
    rank: u64,
    /// Vertices.
    pub ids: Triangle,
    /// Time of the last test; 0 if there was none.
    tried: u32,
}

row! {
    /// A [`Candidate`], in the same order.
    pub struct CandidateRow {
        /// The rank, upper word first.
        rank: [u32; 2],
        /// Ids, ascending.
        triangle: Triangle,
    }
    packed Above Above Above Rising Rising
}

impl Candidate {
    /// The candidate seen by `count` cells (3: it was flagged).
    #[must_use]
    pub fn new(ids: Triangle, count: u32, [a, b, c]: [Point; 3]) -> Self {
        let length = distance2(a, b).max(distance2(b, c)).max(distance2(a, c));
        Self {
            rank: u64::from(3 - count.min(3)) << 62 | length,
            ids,
            tried: 0,
        }
    }

    /// Converts to a row, with the same order.
    #[must_use]
    pub fn row(&self) -> CandidateRow {
        CandidateRow {
            rank: [(self.rank >> 32) as u32, self.rank as u32],
            triangle: self.ids,
        }
    }

    /// Converts from a row.
    #[must_use]
    pub fn of(row: CandidateRow) -> Self {
        let [high, low] = row.rank.map(u64::from);
        Self {
            rank: high << 32 | low,
            ids: row.triangle,
            tried: 0,
        }
    }
}
