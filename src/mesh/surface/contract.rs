//! Greedy additive contraction of a signed graph: it decides the relative orientations of the nodes.
//!
//! A pair of nodes has a sum of weights: positive if the two should be oriented alike as they are, negative
//! if one should be turned. The pair with the largest absolute sum is contracted to one node, which turns one
//! of the two if the sum is negative; the sums of pairs that become parallel are added. So the pairs decided
//! last, possibly against earlier decisions, are those with the weakest connection (Keuper et al., *Efficient
//! decomposition of image and mesh graphs by lifted multicuts*, ICCV 2015, for signed instead of cut edges).

use super::parity::{ParitySets, signed};
use outcrop_disk::workspace::memory::{bytes_of, table_bytes};
use outcrop_paper::method::METHOD;
use outcrop_stages::ids::Number;
use rustc_hash::FxHashMap;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Condition for contracting two nodes of a part of a graph.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Limit {
    /// Always.
    None,
    /// If the pair dominates one of the two nodes (its weight is at least half of the total of that node, so
    /// that turning the node against it would gain nothing), or if both together have at most this number of
    /// triangles.
    Triangles(u64),
}

/// Two nodes that became one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Contraction<N> {
    /// The node whose number the contracted node keeps.
    pub stays: N,
    /// The other one.
    pub goes: N,
    /// The sum of their connections as they are oriented then, without upward weights.
    pub sum: i64,
}

/// A graph with signed sums between nodes, under contraction.
#[derive(Debug, Default)]
pub struct Graph<N> {
    /// The sum of each pair, given as two nodes, the smaller one first.
    sums: FxHashMap<(N, N), i64>,
    /// For each node, the nodes with which it has, or had, a pair.
    neighbors: Vec<Vec<N>>,
    /// For each node the number of its pairs.
    degrees: Vec<u32>,
    /// For each node, the number of its triangles.
    triangles: Vec<u64>,
    /// For each node, the weight of its connections outside the graph.
    outside: Vec<i64>,
    /// For each node, the evidence that it faces up as it is oriented; negative if it faces down.
    up: Vec<i64>,
    /// The sky: an additional node that faces up, paired with every node that has evidence.
    sky: Option<N>,
    /// For each node, true if nothing but evidence connects it with the nodes contracted into the sky.
    bare: Vec<bool>,
}

/// A pair in the order of contraction: the largest weight first, then the smallest nodes.
type Due<N> = (u64, Reverse<(N, N)>);

/// The upward weight of evidence: evidence grows with the area, connections with the circumference, hence a
/// square root.
#[must_use]
pub fn upward(evidence: i64) -> i64 {
    evidence.signum() * METHOD.orientation.flattest * evidence.unsigned_abs().isqrt() as i64
}

fn key<N: Ord>(a: N, b: N) -> (N, N) {
    if a <= b { (a, b) } else { (b, a) }
}

fn due<N: Ord>(a: N, b: N, sum: i64) -> Due<N> {
    (sum.unsigned_abs(), Reverse(key(a, b)))
}

impl<N: Number> Graph<N> {
    /// `count` nodes without triangles or pairs.
    #[must_use]
    pub fn new(count: usize) -> Self {
        let mut graph = Self::default();
        (0..count).for_each(|_| _ = graph.push());
        graph
    }

    /// Adds a node and returns its number.
    pub fn push(&mut self) -> N {
        self.neighbors.push(Vec::new());
        self.degrees.push(0);
        self.triangles.push(0);
        self.outside.push(0);
        self.up.push(0);
        self.bare.push(true);
        N::at(self.degrees.len() - 1)
    }

    /// Adds triangles to a node.
    pub fn add_triangles(&mut self, node: N, triangles: u64) {
        self.triangles[node.index()] += triangles;
    }

    /// Adds to the weight of a node's connections outside the graph.
    pub fn add_outside(&mut self, node: N, weight: i64) {
        self.outside[node.index()] += weight;
    }

    /// Adds to the evidence that a node faces up.
    pub fn add_up(&mut self, node: N, evidence: i64) {
        self.up[node.index()] += evidence;
    }

    /// Adds the node `sky`, with a pair for each node that has evidence, and returns it.
    pub fn push_sky(&mut self) -> N {
        let sky = self.push();
        self.sky = Some(sky);
        for node in (0..sky.index()).map(N::at) {
            if self.up[node.index()] != 0 {
                self.add(node, sky, 0);
            }
        }
        sky
    }

    /// The upward weight of a node.
    fn upward(&self, node: N) -> i64 {
        upward(self.up[node.index()])
    }

    /// The weight of a pair with this sum.
    fn weight(&self, a: N, b: N, sum: i64) -> i64 {
        match self.sky {
            Some(sky) if a == sky => sum + self.upward(b),
            Some(sky) if b == sky => sum + self.upward(a),
            _ => sum,
        }
    }

    /// True if one of the two is the sky, and the other is connected with it only by evidence that is too
    /// little.
    fn is_free(&self, a: N, b: N) -> bool {
        let other = match self.sky {
            Some(sky) if a == sky => b,
            Some(sky) if b == sky => a,
            _ => return false,
        };
        self.bare[other.index()] && self.up[other.index()].abs() < METHOD.orientation.held
    }

    /// Adds to the sum of a pair; does nothing if the nodes are the same.
    pub fn add(&mut self, a: N, b: N, weight: i64) {
        if a != b {
            self.add_to_pair(a, b, weight);
        }
    }

    /// Adds to the sum of a pair; returns its previous sum, if the pair existed.
    fn add_to_pair(&mut self, a: N, b: N, weight: i64) -> Option<i64> {
        let sum = self.sums.entry(key(a, b));
        if let std::collections::hash_map::Entry::Occupied(mut sum) = sum {
            let before = *sum.get();
            *sum.get_mut() += weight;
            return Some(before);
        }
        self.sums.insert(key(a, b), weight);
        for (v, w) in [(a, b), (b, a)] {
            self.neighbors[v.index()].push(w);
            self.degrees[v.index()] += 1;
        }
        None
    }

    /// Number of nodes, including contracted ones.
    #[must_use]
    pub fn len(&self) -> usize {
        self.degrees.len()
    }

    /// All pairs with their sums, unordered.
    pub fn pairs(&self) -> impl Iterator<Item = (N, N, i64)> + '_ {
        self.sums.iter().map(|(&(a, b), &sum)| (a, b, sum))
    }

    /// The nodes with at least one connection, ascending; contracted ones are left out.
    pub fn connected(&self) -> impl Iterator<Item = N> + '_ {
        let all = (0..).zip(self.degrees.iter().zip(&self.outside));
        all.filter(|(_, (degree, outside))| **degree > 0 || **outside > 0)
            .map(|(node, _)| N::at(node))
    }

    /// The nodes with evidence that is not zero, and this evidence.
    pub fn ups(&self) -> impl Iterator<Item = (N, i64)> + '_ {
        let all = (0..).zip(&self.up).filter(|(_, up)| **up != 0);
        all.map(|(node, up)| (N::at(node), *up))
    }

    /// Bytes that the graph takes, with the queue of a contraction.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let pairs = self.sums.len() as u64;
        table_bytes(&self.sums) + bytes_of(&self.neighbors) + pairs * PAIR
    }

    /// Contracts pairs until none is due. A pair is due at first, and again when a contraction renames it or
    /// adds to it. A contracted node keeps the number of the node with more pairs, or the smaller number if
    /// they have equally many. `note` is called with each contraction.
    pub fn contract(
        &mut self,
        limit: Limit,
        mut note: impl FnMut(Contraction<N>),
    ) -> ParitySets<N> {
        let mut sets = ParitySets::new(self.len());
        let mut totals = self.outside.clone();
        for (&(a, b), sum) in &self.sums {
            totals[a.index()] += sum.abs();
            totals[b.index()] += sum.abs();
        }
        let pairs = self.pairs();
        let pairs = pairs.map(|(a, b, sum)| due(a, b, self.weight(a, b, sum)));
        let mut queue: BinaryHeap<Due<N>> = pairs.collect();
        while let Some((size, Reverse((a, b)))) = queue.pop() {
            let Some(&sum) = self.sums.get(&(a, b)) else {
                continue;
            };
            if self.is_free(a, b) {
                continue;
            }
            let connections = sum;
            let sum = self.weight(a, b, sum);
            if sum.unsigned_abs() != size {
                continue;
            }
            if let Limit::Triangles(most) = limit {
                let (up_a, up_b) = (self.upward(a), self.upward(b));
                let total_a = totals[a.index()] + up_a.abs();
                let total_b = totals[b.index()] + up_b.abs();
                let dominates = 2 * sum.abs() >= total_a.min(total_b);
                let against = (up_a < 0) ^ (up_b < 0) ^ (sum < 0);
                if against && sum.abs() < up_a.abs().min(up_b.abs()) {
                    continue;
                }
                let both = self.triangles[a.index()] + self.triangles[b.index()];
                if !dominates && both > most {
                    continue;
                }
            }
            let degree = |v: N| (self.sky == Some(v), self.degrees[v.index()]);
            let swap = degree(b) > degree(a);
            let (a, b) = if swap { (b, a) } else { (a, b) };
            sets.join(a, b, sum < 0);
            note(Contraction {
                stays: a,
                goes: b,
                sum: signed(sum < 0, connections),
            });
            self.merge(a, b, sum, &mut totals, &mut queue);
        }
        sets
    }

    /// Contracts `b` into `a`.
    fn merge(&mut self, a: N, b: N, sum: i64, totals: &mut [i64], queue: &mut BinaryHeap<Due<N>>) {
        self.sums.remove(&key(a, b));
        self.degrees[a.index()] -= 1;
        self.triangles[a.index()] += self.triangles[b.index()];
        self.degrees[b.index()] = 0;
        self.outside[a.index()] += std::mem::take(&mut self.outside[b.index()]);
        let up = std::mem::take(&mut self.up[b.index()]);
        self.up[a.index()] += signed(sum < 0, up);
        totals[a.index()] += totals[b.index()] - 2 * sum.abs();
        self.bare[a.index()] &= self.bare[b.index()];
        for x in std::mem::take(&mut self.neighbors[b.index()]) {
            let Some(moved) = self.sums.remove(&key(b, x)) else {
                continue;
            };
            self.degrees[x.index()] -= 1;
            self.bare[x.index()] &= self.sky != Some(a);
            let moved = signed(sum < 0, moved);
            let before = self.add_to_pair(a, x, moved).unwrap_or(0);
            let now = before + moved;
            let lost = now.abs() - before.abs() - moved.abs();
            totals[a.index()] += lost;
            totals[x.index()] += lost;
            queue.push(due(a, x, self.weight(a, x, now)));
        }
    }
}

/// Estimated bytes of a pair besides its sum: two entries in lists of neighbours, with their free room, and
/// its entries in the queue.
const PAIR: u64 = 16 + 48;

#[cfg(test)]
mod tests;
