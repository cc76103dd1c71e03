//! What speaks for an orientation: how flat a surface runs from one triangle to the next.
//!
//! Where not everything can be oriented alike, the surface should be cut where it is worst and not
//! where a block happens to end. Inside a block triangles are joined in the order of flatness; parts
//! that reach other blocks are joined in the order of all that was seen between them.

use super::parity::ParitySets;
use super::sides::{NONE, across, parts};
use super::star::{EDGES, Triangle, opposed};
use crate::stages::located::{Located, small_normal};
use crate::workspace::memory::{Holding, bytes_of, hold};
use rustc_hash::FxHashMap;
use std::ops::Range;

/// Where triangles lie, and what may be inserted between them later.
#[derive(Debug, Default)]
pub struct Evidence {
    /// The vertices of the triangles around a block.
    pub places: Located,
    /// Candidates inside the block.
    pub candidates: Vec<Triangle>,
    /// What they hold.
    pub held: Holding,
}

impl Evidence {
    /// The unit normal of a triangle by its ascending ids; zero if it has none.
    #[must_use]
    pub fn normal(&self, t: Triangle) -> [f64; 3] {
        let [a, b, c] = t.map(|v| self.places.at(v));
        let n = small_normal(a, b, c).map(|x| x as f64);
        let length = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
        if length > 0.0 {
            n.map(|x| x / length)
        } else {
            n
        }
    }
}

/// The cosine of the angle between two triangles when they run alike, `flip` if one must be turned
/// for that.
#[must_use]
pub fn cosine(a: [f64; 3], b: [f64; 3], flip: bool) -> f64 {
    let dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    if flip { -dot } else { dot }
}

/// Weight of a connection through an edge: 1 for a fold, 16 where it is flat.
#[must_use]
pub fn weight(cosine: f64) -> i64 {
    1 + (cosine.max(0.0) * 15.0) as i64
}

/// Flatter than this, triangles are joined before all others, in any order.
const FLAT: f64 = 0.9;

/// Steps of flatness below [`FLAT`].
const STEPS: usize = 64;

/// Two triangles at an edge, the earlier one first, and whether one must be turned against the other.
type Pair = (u32, u32, bool);

/// Joins the `triangles` of the block of `ids`, all inside it, across their edges. Of two that would have
/// to run both ways the later one is marked as dead; to begin with, the flattest edges are joined.
pub fn join_inside(
    ids: Range<u32>,
    triangles: &[Triangle],
    evidence: &Evidence,
    sets: &mut ParitySets,
) -> Vec<bool> {
    let across = across(ids, triangles);
    let _held = hold(bytes_of(&across));
    // Without a contradiction the order of the edges makes no difference.
    if pairs(triangles, &across).all(|(n, m, flip)| sets.join(n, m, flip)) {
        return vec![false; triangles.len()];
    }
    *sets = ParitySets::new(triangles.len());
    join_by_flatness(triangles, &across, evidence, sets)
}

/// The triangles at each edge with two of them.
fn pairs<'a>(triangles: &'a [Triangle], across: &'a [[u32; 3]]) -> impl Iterator<Item = Pair> + 'a {
    let all = (0..).zip(triangles.iter().zip(across));
    all.flat_map(move |(n, (t, across))| {
        EDGES.into_iter().filter_map(move |(a, b, opposite, _)| {
            let (m, _) = parts(across[opposite]);
            let both = across[opposite] != NONE && m > n as usize;
            both.then(|| (n, m as u32, opposed(*t, triangles[m], t[a], t[b])))
        })
    })
}

fn join_by_flatness(
    triangles: &[Triangle],
    across: &[[u32; 3]],
    evidence: &Evidence,
    sets: &mut ParitySets,
) -> Vec<bool> {
    let normals: Vec<_> = triangles.iter().map(|t| evidence.normal(*t)).collect();
    let mut steps: Vec<Vec<Pair>> = vec![Vec::new(); STEPS];
    let mut dead = vec![false; triangles.len()];
    // What is dead has no edges any more; what it joined stays joined.
    let mut join = |(n, m, flip): Pair| {
        if !dead[n as usize] && !dead[m as usize] && !sets.join(n, m, flip) {
            dead[m as usize] = true;
        }
    };
    for (n, m, flip) in pairs(triangles, across) {
        let cosine = cosine(normals[n as usize], normals[m as usize], flip);
        if cosine > FLAT {
            join((n, m, flip));
        } else {
            let step = (FLAT - cosine) / (1.0 + FLAT) * (STEPS - 1) as f64;
            steps[(step as usize).min(STEPS - 1)].push((n, m, flip));
        }
    }
    let stepped: u64 = steps.iter().map(bytes_of).sum();
    let _held = hold(bytes_of(&normals) + stepped);
    steps.into_iter().flatten().for_each(join);
    dead
}

/// Votes on how labels run against each other: positive alike, negative turned.
#[derive(Debug, Default)]
pub struct Votes {
    pairs: FxHashMap<(u32, u32), i64>,
}

impl Votes {
    /// Adds a vote on labels `a` and `b`; one on a label against itself says nothing.
    pub fn add(&mut self, a: u32, b: u32, flip: bool, weight: i64) {
        if a != b {
            let pair = self.pairs.entry((a.min(b), a.max(b))).or_default();
            *pair += if flip { -weight } else { weight };
        }
    }

    /// Number of pairs.
    #[must_use]
    pub fn len(&self) -> usize {
        self.pairs.len()
    }

    /// Bytes that they are reckoned to take, in order as well.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.len() as u64 * 72
    }

    /// True if there is no vote.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.pairs.is_empty()
    }

    /// All pairs with what was decided, ascending.
    #[must_use]
    pub fn counted(self) -> Vec<(u32, u32, i64)> {
        let mut all: Vec<_> = self
            .pairs
            .into_iter()
            .map(|((a, b), n)| (a, b, n))
            .collect();
        all.sort_unstable();
        all
    }

    /// Joins labels in the order of how clear the votes are.
    pub fn join(self, sets: &mut ParitySets) {
        let mut all = self.counted();
        all.sort_by_key(|&(_, _, votes)| std::cmp::Reverse(votes.unsigned_abs()));
        for (a, b, votes) in all {
            if votes != 0 {
                sets.join(a, b, votes < 0);
            }
        }
    }
}

#[cfg(test)]
mod tests;
