//! A second look at the contractions of a graph, when all its connections are known.
//!
//! A contraction decides by the sums that have formed by then; those that form later can weigh against it. So
//! the parts of the clusters are looked at again, from the last contraction to the first: a part is turned as
//! a whole if this lowers the weight that is cut by more than a little.

use super::contract::{Contraction, Graph, upward};
use super::parity::{ParitySets, signed};
use outcrop_stages::ids::Number;
use std::ops::Range;

/// A graph before it is contracted, and its contractions.
#[derive(Debug)]
pub struct History<N> {
    /// The pairs whose sum is not 0, with their sums.
    pairs: Vec<(N, N, i64)>,
    /// For each node, the evidence that it faces up as it is oriented.
    up: Vec<i64>,
    /// The contractions in their order.
    contractions: Vec<Contraction<N>>,
}

impl<N: Number> History<N> {
    /// The history of a graph without contractions.
    #[must_use]
    pub fn of(graph: &Graph<N>) -> Self {
        let mut up = vec![0; graph.len()];
        graph.ups().for_each(|(node, of)| up[node.index()] = of);
        let mut pairs = Vec::with_capacity(graph.pairs().count());
        pairs.extend(graph.pairs().filter(|(.., sum)| *sum != 0));
        Self {
            pairs,
            up,
            contractions: Vec::with_capacity(graph.len()),
        }
    }

    /// Adds a contraction.
    pub fn push(&mut self, contraction: Contraction<N>) {
        self.contractions.push(contraction);
    }

    /// Most bytes that a graph and its history take, while it is contracted and looked at again.
    #[must_use]
    pub fn most(graph: &Graph<N>) -> u64 {
        let (pairs, nodes) = (graph.pairs().count(), graph.len());
        let evidence = size_of::<i64>() + size_of::<Contraction<N>>();
        let history = (pairs * size_of::<(N, N, i64)>() + nodes * evidence) as u64;
        let again = pairs as u64 * OF_PAIR + nodes as u64 * OF_NODE;
        history + again.max(graph.bytes())
    }

    /// For each node, true if the second look turns it in its cluster. A part is turned if this lowers the
    /// weight that is cut by more than `gain`; the part that contains `sky` stays.
    #[must_use]
    pub fn look_back(mut self, clusters: &ParitySets<N>, sky: N, gain: i64) -> Vec<bool> {
        let contractions = std::mem::take(&mut self.contractions);
        let mut parts = Parts::of(self, clusters, &contractions);
        for contraction in contractions.iter().rev() {
            parts.undo(contraction);
            for part in [contraction.goes, contraction.stays] {
                if part != sky && parts.weight(part) < -gain {
                    parts.turn(part);
                }
            }
        }
        parts.turned
    }
}

/// Bytes for each pair in [`Connections`], and for each node in [`Parts`].
const OF_PAIR: u64 = 32;
const OF_NODE: u64 = 48;

/// The parts of clusters, while contractions are undone. A part has the name of one of its nodes. All weights
/// are those of the orientations that the contractions gave.
struct Parts<N> {
    connections: Connections<N>,
    /// For each node, true if it was turned since.
    turned: Vec<bool>,
    /// All nodes, those of each part one after the other, its name first; and the place of each node.
    order: Vec<N>,
    place: Vec<N>,
    /// By place, the sum of a node's weights, as it and the other nodes are turned.
    sums: RangeSums,
    /// For each name, the number of nodes of the part, the weight inside it, and its evidence.
    len: Vec<u32>,
    inside: Vec<i64>,
    up: Vec<i64>,
}

impl<N: Number> Parts<N> {
    /// The clusters after all contractions.
    fn of(graph: History<N>, clusters: &ParitySets<N>, contractions: &[Contraction<N>]) -> Self {
        let History {
            mut pairs, mut up, ..
        } = graph;
        let count = up.len();
        let (mut len, mut inside) = (vec![1; count], vec![0; count]);
        let given: Vec<bool> = (0..count).map(|v| clusters.look(N::at(v)).1).collect();
        for (up, given) in up.iter_mut().zip(&given) {
            *up = signed(*given, *up);
        }
        for (a, b, sum) in &mut pairs {
            *sum = signed(given[a.index()] ^ given[b.index()], *sum);
        }
        for c in contractions {
            let (a, b) = (c.stays.index(), c.goes.index());
            len[a] += len[b];
            inside[a] += inside[b] + c.sum;
            up[a] += up[b];
        }
        let order = order(count, contractions);
        let mut place = vec![N::default(); count];
        (0..)
            .zip(&order)
            .for_each(|(at, v)| place[v.index()] = N::at(at));
        let mut sums = vec![0; count];
        for (a, b, sum) in &pairs {
            sums[place[a.index()].index()] += sum;
            sums[place[b.index()].index()] += sum;
        }
        Self {
            connections: Connections::of(count, &pairs),
            turned: vec![false; count],
            order,
            place,
            sums: RangeSums::of(sums),
            len,
            inside,
            up,
        }
    }

    /// Parts two nodes that were contracted.
    fn undo(&mut self, c: &Contraction<N>) {
        let (a, b) = (c.stays.index(), c.goes.index());
        self.len[a] -= self.len[b];
        self.inside[a] -= self.inside[b] + c.sum;
        self.up[a] -= self.up[b];
    }

    /// The places of the nodes of a part.
    fn places(&self, part: N) -> Range<usize> {
        let first = self.place[part.index()].index();
        first..first + self.len[part.index()] as usize
    }

    /// The weight with which a part is held as it is oriented: its connections with all others, and its upward
    /// weight.
    fn weight(&self, part: N) -> i64 {
        let (inside, up) = (self.inside[part.index()], self.up[part.index()]);
        let outside = self.sums.range(self.places(part)) - 2 * inside;
        outside + upward(signed(self.turned[part.index()], up))
    }

    /// Turns all nodes of a part.
    fn turn(&mut self, part: N) {
        let places = self.places(part);
        for at in places.clone() {
            let node = self.order[at];
            for &(other, weight) in self.connections.of_node(node) {
                let beside = self.place[other.index()].index();
                if !places.contains(&beside) {
                    let turned = self.turned[node.index()] ^ self.turned[other.index()];
                    let lost = 2 * signed(turned, weight);
                    self.sums.add(at, -lost);
                    self.sums.add(beside, -lost);
                }
            }
        }
        for node in &self.order[places] {
            self.turned[node.index()] ^= true;
        }
    }
}

/// All nodes of a graph, such that those of every cluster that there ever was stand one after the other, its
/// name first.
fn order<N: Number>(count: usize, contractions: &[Contraction<N>]) -> Vec<N> {
    // For each node the one behind it in its cluster, itself if it is the last one.
    let mut next: Vec<N> = (0..count).map(N::at).collect();
    let mut last = next.clone();
    let mut inner = vec![false; count];
    for c in contractions {
        let (a, b) = (c.stays.index(), c.goes.index());
        next[last[a].index()] = c.goes;
        last[a] = last[b];
        inner[b] = true;
    }
    let mut order = Vec::with_capacity(count);
    for first in (0..count).filter(|v| !inner[*v]).map(N::at) {
        let mut node = first;
        order.push(node);
        while next[node.index()] != node {
            node = next[node.index()];
            order.push(node);
        }
    }
    order
}

/// The nodes beside each node, and the sums of their pairs.
struct Connections<N> {
    /// For each node the place of its first row, and the number of rows.
    first: Vec<usize>,
    rows: Vec<(N, i64)>,
}

impl<N: Number> Connections<N> {
    fn of(count: usize, pairs: &[(N, N, i64)]) -> Self {
        let mut first = vec![0; count + 1];
        for node in pairs.iter().flat_map(|(a, b, _)| [a, b]) {
            first[node.index()] += 1;
        }
        let mut total = 0;
        for of in &mut first {
            total += *of;
            *of = total;
        }
        let mut rows = vec![(N::default(), 0); total];
        for &(a, b, sum) in pairs {
            for (of, other) in [(a, b), (b, a)] {
                first[of.index()] -= 1;
                rows[first[of.index()]] = (other, sum);
            }
        }
        Self { first, rows }
    }

    fn of_node(&self, node: N) -> &[(N, i64)] {
        &self.rows[self.first[node.index()]..self.first[node.index() + 1]]
    }
}

/// Numbers of which one can be changed and a range be added up, in logarithmic time (a Fenwick tree).
struct RangeSums {
    /// At `i`, the sum of the numbers from `i & (i + 1)` to `i`.
    sums: Vec<i64>,
}

impl RangeSums {
    fn of(mut sums: Vec<i64>) -> Self {
        for i in 0..sums.len() {
            let above = i | (i + 1);
            if above < sums.len() {
                sums[above] += sums[i];
            }
        }
        Self { sums }
    }

    fn add(&mut self, mut at: usize, change: i64) {
        while at < self.sums.len() {
            self.sums[at] += change;
            at |= at + 1;
        }
    }

    /// The sum of the numbers before `end`.
    fn before(&self, mut end: usize) -> i64 {
        let mut sum = 0;
        while end > 0 {
            sum += self.sums[end - 1];
            end &= end - 1;
        }
        sum
    }

    fn range(&self, range: Range<usize>) -> i64 {
        self.before(range.end) - self.before(range.start)
    }
}

#[cfg(test)]
mod tests;
