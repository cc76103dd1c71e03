//! A graph of patches or labels, contracted pair by pair (section 6.3, step 4).

use super::Weighing;
use super::homes::{Homes, Side};
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

/// Evidence that suffices to turn a component alone.
const SURE: i64 = 1024;

/// A node.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Node {
    pub triangles: usize,
    pub outside: i64,
    /// Evidence that it faces up with its present orientation.
    pub up: i64,
}

/// Two nodes, the smaller number first.
pub type Pair = [usize; 2];

/// The graph. Nodes have numbers; a node that was contracted into another keeps its number, but has no pairs.
#[derive(Debug, Clone, Default)]
pub struct Graph {
    pub nodes: Vec<Node>,
    pub sums: BTreeMap<Pair, i64>,
    /// The node of the sky, which faces up.
    pub sky: Option<usize>,
    /// Nodes connected with a node that is a part of the sky.
    touching: BTreeSet<usize>,
}

/// The upward weight of evidence.
fn upward(evidence: i64) -> i64 {
    let size = evidence.abs();
    let root = (0..).find(|x| (x + 1) * (x + 1) > size).expect("a root");
    16 * root * evidence.signum()
}

fn pair(a: usize, b: usize) -> Pair {
    [a.min(b), a.max(b)]
}

impl Graph {
    /// Adds a node; returns its number.
    pub fn push(&mut self) -> usize {
        self.nodes.push(Node::default());
        self.nodes.len() - 1
    }

    /// Adds the weight of a relation: both sides are one orientation. Nothing if they have the same node.
    pub fn add(&mut self, a: Side, b: Side, weight: i64) {
        if a.home != b.home {
            let sign = if a.turned == b.turned { 1 } else { -1 };
            *self.sums.entry(pair(a.home, b.home)).or_default() += sign * weight;
        }
    }

    /// Adds the sky, and its pair with each node that has evidence.
    pub fn push_sky(&mut self) {
        let sky = self.push();
        self.sky = Some(sky);
        for node in 0..sky {
            if self.nodes[node].up != 0 {
                self.sums.insert([node, sky], 0);
            }
        }
    }

    /// The size of a node's upward weight.
    fn upward(&self, node: usize) -> i64 {
        upward(self.nodes[node].up).abs()
    }

    /// The sum of a pair; for a pair with the sky it includes the upward weight of the other node.
    fn sum(&self, pair: Pair) -> i64 {
        let sum = self.sums[&pair];
        match self.sky {
            Some(sky) if pair[1] == sky => {
                sum + self.nodes[pair[0]].up.signum() * self.upward(pair[0])
            }
            _ => sum,
        }
    }

    fn pairs_of(&self, node: usize) -> Vec<Pair> {
        let all = self.sums.keys().copied();
        all.filter(|pair| pair.contains(&node)).collect()
    }

    /// True if the node has a pair or an outside.
    pub fn connected(&self, node: usize) -> bool {
        self.nodes[node].outside > 0 || !self.pairs_of(node).is_empty()
    }

    /// The sum of a node's connections.
    fn total(&self, node: usize) -> i64 {
        let pairs = self.pairs_of(node).into_iter();
        let sums: i64 = pairs.map(|pair| self.sum(pair).abs()).sum();
        sums + self.nodes[node].outside + self.upward(node)
    }

    /// True if a pair may be contracted to a cluster with up to `most` triangles, or to a larger one because
    /// it dominates.
    fn may(&self, pair: Pair, most: usize, met: &mut Weighing) -> bool {
        let sum = self.sum(pair);
        let dominates = pair.iter().any(|&node| 2 * sum.abs() >= self.total(node));
        let both: usize = pair.iter().map(|&node| self.nodes[node].triangles).sum();
        if !dominates && both > most {
            met.capped += 1;
            return false;
        }
        let [a, b] = pair.map(|node| self.nodes[node].up);
        let differ = (a < 0) != ((if sum < 0 { -b } else { b }) < 0);
        if differ && sum.abs() < self.upward(pair[0]).min(self.upward(pair[1])) {
            met.against += 1;
            return false;
        }
        met.dominated += usize::from(both > most);
        true
    }

    /// True for a pair with the sky that is not contracted: its only weight is a little evidence.
    fn is_free(&self, pair: Pair) -> bool {
        let evidence = self.nodes[pair[0]].up.abs();
        self.sky == Some(pair[1]) && !self.touching.contains(&pair[0]) && evidence < SURE
    }

    /// The node that gives a cluster its number and orientation, and the other one.
    fn named([a, b]: Pair, graph: &Self) -> (usize, usize) {
        let [of_a, of_b] = [a, b].map(|node| graph.pairs_of(node).len());
        if graph.sky == Some(b) || graph.sky != Some(a) && of_b > of_a {
            (b, a)
        } else {
            (a, b)
        }
    }

    /// Contracts one node into another; returns the pairs that changed.
    fn merge(&mut self, stays: usize, goes: usize, turned: bool) -> Vec<Pair> {
        self.sums.remove(&pair(stays, goes));
        let part = std::mem::take(&mut self.nodes[goes]);
        let node = &mut self.nodes[stays];
        node.triangles += part.triangles;
        node.outside += part.outside;
        node.up += if turned { -part.up } else { part.up };
        if self.touching.contains(&goes) {
            self.touching.insert(stays);
        }
        let mut changed = Vec::new();
        for old in self.pairs_of(goes) {
            let sum = self.sums.remove(&old).expect("a pair");
            let other = if old[0] == goes { old[1] } else { old[0] };
            let new = pair(stays, other);
            if self.sky == Some(stays) {
                self.touching.insert(other);
            }
            *self.sums.entry(new).or_default() += if turned { -sum } else { sum };
            changed.push(new);
        }
        changed
    }

    /// Contracts pairs, then looks at the contractions again (section 6.3, step 6).
    pub fn settle(&mut self, gain: i64, met: &mut Weighing) -> Homes {
        let before = self.clone();
        let mut contractions = Vec::new();
        let clusters =
            self.contract_noting(None, met, |goes, stays| contractions.push([goes, stays]));
        let alone = |home| Side {
            home,
            turned: false,
        };
        let mut turned: Vec<bool> = (0..before.nodes.len())
            .map(|node| clusters.seen_from_label(alone(node)).turned)
            .collect();
        let mut members: Vec<BTreeSet<usize>> =
            (0..turned.len()).map(|node| [node].into()).collect();
        let mut parts = Vec::new();
        for both in contractions {
            let both_parts = both.map(|node| members[node].clone());
            members[both[1]].extend(&both_parts[0]);
            parts.push(both_parts);
        }
        for part in parts.iter().rev().flatten() {
            if !part.contains(&before.sky.expect("a sky")) && before.holds(part, &turned) < -gain {
                met.looked_back += 1;
                part.iter().for_each(|&node| turned[node] = !turned[node]);
            }
        }
        let mut settled = Homes::apart(turned.len());
        for node in 0..turned.len() {
            let label = clusters.label(node);
            let [a, b] = [label, node].map(|home| Side {
                home,
                turned: turned[home],
            });
            settled.join(a, b);
        }
        settled
    }

    /// The weight that holds a part as its nodes are turned: of its connections, and upwards.
    fn holds(&self, part: &BTreeSet<usize>, turned: &[bool]) -> i64 {
        let sign = |turned: bool| if turned { -1 } else { 1 };
        let leaves = |pair: &Pair| part.contains(&pair[0]) != part.contains(&pair[1]);
        let sums = self.sums.iter().filter(|(pair, _)| leaves(pair));
        let outside: i64 = sums
            .map(|([a, b], sum)| sign(turned[*a] != turned[*b]) * sum)
            .sum();
        let up: i64 = part
            .iter()
            .map(|&v| sign(turned[v]) * self.nodes[v].up)
            .sum();
        outside + upward(up)
    }

    /// Contracts pairs: without `most` all but those with the sky that stay free, otherwise those that may be
    /// contracted. Returns the cluster of each node, as the number of the node that names it, and whether the
    /// node is turned in it.
    pub fn contract(&mut self, most: Option<usize>, met: &mut Weighing) -> Homes {
        self.contract_noting(most, met, |_, _| ())
    }

    /// As `contract`; `note` is called with the node that goes and the one that stays.
    fn contract_noting(
        &mut self,
        most: Option<usize>,
        met: &mut Weighing,
        mut note: impl FnMut(usize, usize),
    ) -> Homes {
        let mut clusters = Homes::apart(self.nodes.len());
        let mut due: BTreeSet<Pair> = self.sums.keys().copied().collect();
        loop {
            let first = |pair: &Pair| (self.sum(*pair).abs(), Reverse(*pair));
            let Some(pair) = due.iter().copied().max_by_key(first) else {
                return clusters;
            };
            due.remove(&pair);
            if let Some(most) = most
                && !self.may(pair, most, met)
            {
                continue;
            }
            if self.is_free(pair) {
                met.left_free += 1;
                continue;
            }
            let sum = self.sum(pair);
            let (stays, goes) = Self::named(pair, self);
            met.contracted(sum, stays > goes, self.sky == Some(stays));
            let [a, b] =
                [(stays, false), (goes, sum < 0)].map(|(home, turned)| Side { home, turned });
            clusters.join(a, b);
            note(goes, stays);
            let changed = self.merge(stays, goes, sum < 0);
            due.retain(|pair| !pair.contains(&goes));
            due.extend(changed);
        }
    }
}
