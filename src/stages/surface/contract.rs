//! Greedy additive contraction of a signed graph: which nodes run alike and which against each other.
//!
//! A pair of nodes has a sum of weights: positive if they should run alike, negative if one should be
//! turned. The pair with the largest sum is contracted to one node, which turns one of the two if the sum
//! is negative; sums of pairs that become parallel are added up. So what is decided last, and against
//! what was decided before, are the pairs whose whole connection weighs least (Keuper et al., *Efficient
//! decomposition of image and mesh graphs by lifted multicuts*, ICCV 2015, for signed instead of cut
//! edges).

use super::parity::ParitySets;
use crate::method::METHOD;
use crate::workspace::memory::{bytes_of, table_bytes};
use rustc_hash::FxHashMap;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// When two nodes of a part of a graph may be contracted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Limit {
    /// Always.
    None,
    /// If the pair dominates one of the two (it weighs at least half of all that the node is connected
    /// by, so that turning the node against it would gain nothing), or both together have at most this
    /// number of triangles.
    Triangles(u64),
}

/// Signed sums between nodes.
#[derive(Debug, Default)]
pub struct Graph {
    /// By the two nodes, the smaller one first.
    sums: FxHashMap<(u32, u32), i64>,
    /// For each node those that it has a pair with, or had.
    neighbors: Vec<Vec<u32>>,
    /// For each node the number of its pairs.
    degrees: Vec<u32>,
    /// For each node the triangles that it stands for.
    triangles: Vec<u64>,
    /// For each node what it is connected by outside the graph.
    outside: Vec<i64>,
    /// For each node the evidence that it faces up as it runs; negative if it faces down.
    up: Vec<i64>,
    /// The node that faces up.
    sky: Option<u32>,
    /// For each node whether nothing connects it with what is a part of the sky.
    bare: Vec<bool>,
}

/// A pair in the order of contraction: the largest sum first, then the smallest nodes.
type Due = (u64, Reverse<(u32, u32)>);

fn key(a: u32, b: u32) -> (u32, u32) {
    (a.min(b), a.max(b))
}

fn due(a: u32, b: u32, sum: i64) -> Due {
    (sum.unsigned_abs(), Reverse(key(a, b)))
}

impl Graph {
    /// `count` nodes without triangles and pairs.
    #[must_use]
    pub fn new(count: usize) -> Self {
        let mut graph = Self::default();
        (0..count).for_each(|_| _ = graph.push());
        graph
    }

    /// Adds a node; its number.
    pub fn push(&mut self) -> u32 {
        self.neighbors.push(Vec::new());
        self.degrees.push(0);
        self.triangles.push(0);
        self.outside.push(0);
        self.up.push(0);
        self.bare.push(true);
        self.degrees.len() as u32 - 1
    }

    /// Adds triangles to a node.
    pub fn add_triangles(&mut self, node: u32, triangles: u64) {
        self.triangles[node as usize] += triangles;
    }

    /// Adds to what a node is connected by outside the graph.
    pub fn add_outside(&mut self, node: u32, weight: i64) {
        self.outside[node as usize] += weight;
    }

    /// Adds to the evidence that a node faces up.
    pub fn add_up(&mut self, node: u32, evidence: i64) {
        self.up[node as usize] += evidence;
    }

    /// Adds a node that faces up, and a pair with it for each node that there is evidence of.
    pub fn push_sky(&mut self) {
        let sky = self.push();
        self.sky = Some(sky);
        for node in (0..sky)
            .filter(|&v| self.up[v as usize] != 0)
            .collect::<Vec<_>>()
        {
            self.add(node, sky, 0);
        }
    }

    /// How the evidence of facing up weighs against connections: it grows with the area, they with the
    /// circumference.
    fn upward(&self, node: u32) -> i64 {
        let up = self.up[node as usize];
        up.signum() * METHOD.orientation.upward * up.unsigned_abs().isqrt() as i64
    }

    /// The weight of a pair with this sum.
    fn weight(&self, a: u32, b: u32, sum: i64) -> i64 {
        match self.sky {
            Some(sky) if a == sky => sum + self.upward(b),
            Some(sky) if b == sky => sum + self.upward(a),
            _ => sum,
        }
    }

    /// True if one of the two is the sky, and the other one is not held: nothing connects them but little
    /// evidence that it faces up.
    fn is_free(&self, a: u32, b: u32) -> bool {
        let other = match self.sky {
            Some(sky) if a == sky => b,
            Some(sky) if b == sky => a,
            _ => return false,
        };
        self.bare[other as usize] && self.up[other as usize].abs() < METHOD.orientation.held
    }

    /// Adds to the sum of two nodes; nothing if they are the same.
    pub fn add(&mut self, a: u32, b: u32, weight: i64) {
        if a != b {
            self.add_to_pair(a, b, weight);
        }
    }

    /// Adds to the sum of a pair; what it was before, if there was one.
    fn add_to_pair(&mut self, a: u32, b: u32, weight: i64) -> Option<i64> {
        let sum = self.sums.entry(key(a, b));
        if let std::collections::hash_map::Entry::Occupied(mut sum) = sum {
            let before = *sum.get();
            *sum.get_mut() += weight;
            return Some(before);
        }
        self.sums.insert(key(a, b), weight);
        for (v, w) in [(a, b), (b, a)] {
            self.neighbors[v as usize].push(w);
            self.degrees[v as usize] += 1;
        }
        None
    }

    /// Number of nodes, contracted ones too.
    #[must_use]
    pub fn len(&self) -> usize {
        self.degrees.len()
    }

    /// All pairs with their sums, in no order.
    pub fn pairs(&self) -> impl Iterator<Item = (u32, u32, i64)> + '_ {
        self.sums.iter().map(|(&(a, b), &sum)| (a, b, sum))
    }

    /// The nodes that are connected with anything, ascending; no contracted ones.
    pub fn connected(&self) -> impl Iterator<Item = u32> + '_ {
        let all = (0..).zip(self.degrees.iter().zip(&self.outside));
        all.filter(|(_, (degree, outside))| **degree > 0 || **outside > 0)
            .map(|(node, _)| node)
    }

    /// The evidence that nodes face up, where there is any.
    pub fn ups(&self) -> impl Iterator<Item = (u32, i64)> + '_ {
        let all = (0..).zip(&self.up).filter(|(_, up)| **up != 0);
        all.map(|(node, up)| (node, *up))
    }

    /// Bytes that it takes, with the queue of a contraction.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let pairs = self.sums.len() as u64;
        table_bytes(&self.sums) + bytes_of(&self.neighbors) + pairs * PAIR
    }

    /// Contracts pairs until no more are due. A pair is due at first, and again when a contraction
    /// renamed it or added to it. The contracted node has the name of the one with more pairs, or the
    /// smaller name if they have as many.
    pub fn contract(&mut self, limit: Limit) -> ParitySets {
        let mut sets = ParitySets::new(self.len());
        let mut totals = self.outside.clone();
        for (&(a, b), sum) in &self.sums {
            totals[a as usize] += sum.abs();
            totals[b as usize] += sum.abs();
        }
        let pairs = self
            .sums
            .iter()
            .map(|(&(a, b), &sum)| due(a, b, self.weight(a, b, sum)));
        let mut queue: BinaryHeap<Due> = pairs.collect();
        while let Some((size, Reverse((a, b)))) = queue.pop() {
            let Some(&sum) = self.sums.get(&(a, b)) else {
                continue;
            };
            if self.is_free(a, b) {
                continue;
            }
            let sum = self.weight(a, b, sum);
            if sum.unsigned_abs() != size {
                continue;
            }
            if let Limit::Triangles(most) = limit {
                let (up_a, up_b) = (self.upward(a), self.upward(b));
                let total_a = totals[a as usize] + up_a.abs();
                let total_b = totals[b as usize] + up_b.abs();
                let dominates = 2 * sum.abs() >= total_a.min(total_b);
                let against = (up_a < 0) ^ (up_b < 0) ^ (sum < 0);
                if against && sum.abs() < up_a.abs().min(up_b.abs()) {
                    continue;
                }
                let both = self.triangles[a as usize] + self.triangles[b as usize];
                if !dominates && both > most {
                    continue;
                }
            }
            let degree = |v: u32| (self.sky == Some(v), self.degrees[v as usize]);
            let (a, b) = if degree(b) > degree(a) {
                (b, a)
            } else {
                (a, b)
            };
            sets.join(a, b, sum < 0);
            self.merge(a, b, sum, &mut totals, &mut queue);
        }
        sets
    }

    /// Makes `b` a part of `a`.
    fn merge(&mut self, a: u32, b: u32, sum: i64, totals: &mut [i64], queue: &mut BinaryHeap<Due>) {
        self.sums.remove(&key(a, b));
        self.degrees[a as usize] -= 1;
        self.triangles[a as usize] += self.triangles[b as usize];
        self.degrees[b as usize] = 0;
        self.outside[a as usize] += std::mem::take(&mut self.outside[b as usize]);
        let up = std::mem::take(&mut self.up[b as usize]);
        self.up[a as usize] += if sum < 0 { -up } else { up };
        totals[a as usize] += totals[b as usize] - 2 * sum.abs();
        self.bare[a as usize] &= self.bare[b as usize];
        for x in std::mem::take(&mut self.neighbors[b as usize]) {
            let Some(moved) = self.sums.remove(&key(b, x)) else {
                continue;
            };
            self.degrees[x as usize] -= 1;
            self.bare[x as usize] &= self.sky != Some(a);
            let moved = if sum < 0 { -moved } else { moved };
            let before = self.add_to_pair(a, x, moved).unwrap_or(0);
            let now = before + moved;
            let lost = now.abs() - before.abs() - moved.abs();
            totals[a as usize] += lost;
            totals[x as usize] += lost;
            queue.push(due(a, x, self.weight(a, x, now)));
        }
    }
}

/// Bytes that a pair is reckoned to take beside its sum: two names in lists of neighbours, with what these
/// leave free, and its places in the queue.
const PAIR: u64 = 16 + 48;

#[cfg(test)]
mod tests;
