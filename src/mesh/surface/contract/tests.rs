//! Compares contraction with a plain implementation, and with examples.

use super::*;
use proptest::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

/// Triangles, outside weight and evidence of each node.
type Nodes = Vec<(u64, i64, i64)>;

/// A graph that recomputes all sums whenever they are needed.
struct Plain {
    nodes: Nodes,
    sums: BTreeMap<(u32, u32), i64>,
    sky: Option<u32>,
    /// Nodes that only evidence connects with the sky.
    bare: BTreeSet<u32>,
}

impl Plain {
    fn up(&self, node: u32) -> i64 {
        let up = self.nodes[node as usize].2;
        up.signum() * METHOD.orientation.flattest * (up.abs() as f64).sqrt().floor() as i64
    }

    fn weight(&self, pair: (u32, u32)) -> i64 {
        let more = match self.sky {
            Some(sky) if sky == pair.1 => self.up(pair.0),
            _ => 0,
        };
        self.sums[&pair] + more
    }

    fn pairs(&self, node: u32) -> Vec<(u32, u32)> {
        let all = self.sums.keys().copied();
        all.filter(|(a, b)| *a == node || *b == node).collect()
    }

    fn total(&self, node: u32) -> i64 {
        let sums = self.pairs(node).into_iter().map(|p| self.sums[&p].abs());
        sums.sum::<i64>() + self.nodes[node as usize].1 + self.up(node).abs()
    }

    fn may(&self, (a, b): (u32, u32), most: u64) -> bool {
        let sum = self.weight((a, b));
        let dominates = [a, b].iter().any(|v| 2 * sum.abs() >= self.total(*v));
        let few = self.nodes[a as usize].0 + self.nodes[b as usize].0 <= most;
        let (x, y) = (self.up(a), if sum < 0 { -self.up(b) } else { self.up(b) });
        let against = x * y < 0 && sum.abs() < x.abs().min(y.abs());
        (dominates || few) && !against
    }

    /// For each node, the node that contains it, and true if it is turned there.
    fn contract(&mut self, limit: Limit) -> Vec<(u32, bool)> {
        let mut of: Vec<_> = (0..self.nodes.len() as u32).map(|v| (v, false)).collect();
        let mut due: BTreeSet<(u32, u32)> = self.sums.keys().copied().collect();
        while let Some(pair) = due
            .iter()
            .copied()
            .max_by_key(|p| (self.weight(*p).abs(), Reverse(*p)))
        {
            due.remove(&pair);
            if matches!(limit, Limit::Triangles(most) if !self.may(pair, most)) {
                continue;
            }
            let free = self.nodes[pair.0 as usize].2.abs() < METHOD.orientation.held;
            if self.sky == Some(pair.1) && self.bare.contains(&pair.0) && free {
                continue;
            }
            let turned = self.weight(pair) < 0;
            let more = self.pairs(pair.1).len() > self.pairs(pair.0).len();
            let (stays, goes) = match self.sky {
                Some(sky) if sky == pair.1 => (sky, pair.0),
                _ if more => (pair.1, pair.0),
                _ => pair,
            };
            self.sums.remove(&pair);
            if !self.bare.contains(&goes) {
                self.bare.remove(&stays);
            }
            for (a, b) in self.pairs(goes) {
                let sum = self.sums.remove(&(a, b)).unwrap();
                due.remove(&(a, b));
                let other = if a == goes { b } else { a };
                let new = key(stays, other);
                if self.sky == Some(stays) {
                    self.bare.remove(&other);
                }
                *self.sums.entry(new).or_default() += if turned { -sum } else { sum };
                due.insert(new);
            }
            let (triangles, outside, up) = std::mem::take(&mut self.nodes[goes as usize]);
            let node = &mut self.nodes[stays as usize];
            node.0 += triangles;
            node.1 += outside;
            node.2 += if turned { -up } else { up };
            for (root, flip) in &mut of {
                if *root == goes {
                    (*root, *flip) = (stays, *flip ^ turned);
                }
            }
        }
        of
    }
}

fn graph(nodes: &Nodes, pairs: &[(u32, u32, i64)], sky: bool) -> Graph<u32> {
    let mut graph = Graph::new(nodes.len());
    for (v, &(triangles, outside, up)) in (0..).zip(nodes) {
        graph.add_triangles(v, triangles);
        graph.add_outside(v, outside);
        graph.add_up(v, up);
    }
    for &(a, b, weight) in pairs {
        graph.add(a, b, weight);
    }
    if sky {
        graph.push_sky();
    }
    graph
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn contracts_as_a_plain_one(
        nodes in prop::collection::vec((0u64..6, prop_oneof![Just(0), 0i64..40], prop_oneof![Just(0), -9i64..10, -METHOD.orientation.held - 3..METHOD.orientation.held + 3]), 1..12),
        pairs in prop::collection::vec((0u32..12, 0u32..12, -20i64..21), 0..40),
        most in prop::option::of(0u64..20),
        sky in any::<bool>(),
    ) {
        let count = nodes.len() as u32;
        let pairs: Vec<_> = pairs.into_iter().map(|(a, b, w)| (a % count, b % count, w)).collect();
        let limit = most.map_or(Limit::None, Limit::Triangles);
        let sky = sky && most.is_none();
        let mut graph = graph(&nodes, &pairs, sky);
        let bare = (0..=count).collect();
        let mut plain = Plain { nodes, sums: BTreeMap::new(), sky: None, bare };
        for (a, b, weight) in pairs {
            if a != b {
                *plain.sums.entry(key(a, b)).or_default() += weight;
            }
        }
        if sky {
            plain.sky = Some(count);
            let ups = (0..count).filter(|v| plain.nodes[*v as usize].2 != 0);
            plain.sums.extend(ups.map(|v| ((v, count), 0)));
            plain.nodes.push((0, 0, 0));
        }
        let (clusters, of) = (graph.contract(limit, |_| ()), plain.contract(limit));
        for (v, of) in (0..).zip(of) {
            prop_assert_eq!(clusters.look(v), of);
        }
        let sums: BTreeMap<_, _> = graph.pairs().map(|(a, b, sum)| ((a, b), sum)).collect();
        prop_assert_eq!(&sums, &plain.sums);
        let connected = (0..plain.nodes.len() as u32)
            .filter(|v| plain.nodes[*v as usize].1 > 0 || !plain.pairs(*v).is_empty());
        prop_assert_eq!(graph.connected().collect::<Vec<_>>(), connected.collect::<Vec<_>>());
        let ups = (0..).zip(&plain.nodes).filter(|(_, n)| n.2 != 0).map(|(v, n)| (v, n.2));
        prop_assert_eq!(graph.ups().collect::<Vec<_>>(), ups.collect::<Vec<_>>());
        prop_assert!(most.is_some() || sums.keys().all(|(_, b)| sky && *b == count));
    }
}

/// Nodes of one triangle each.
fn single(count: usize) -> Nodes {
    vec![(1, 0, 0); count]
}

#[test]
fn a_ring_that_cannot_agree_is_cut_at_its_least_connection() {
    for least in 0..4 {
        let weights: Vec<i64> = (0..4).map(|n| if n == least { 3 } else { 5 + n }).collect();
        let ring: Vec<_> = (0..4u32)
            .map(|n| {
                let weight = weights[n as usize];
                (n, (n + 1) % 4, if n == 1 { -weight } else { weight })
            })
            .collect();
        let mut sets = graph(&single(4), &ring, false).contract(Limit::None, |_| ());
        for (n, (a, b, weight)) in (0..).zip(ring) {
            let agrees = sets.relation(a, b) == Some(weight < 0);
            assert_eq!(agrees, n != least, "{n} of a ring that is cut at {least}");
        }
    }
}

/// Two connections of weight 4 to nodes that have been contracted weigh more than one of 7.
#[test]
fn parallel_sums_add_up_before_they_are_compared() {
    let pairs = [(0, 1, 10), (0, 2, 4), (1, 2, 4), (2, 3, 5), (3, 0, -7)];
    let mut sets = graph(&single(4), &pairs, false).contract(Limit::None, |_| ());
    assert_eq!(sets.relation(0, 2), Some(false));
    assert_eq!(sets.relation(0, 3), Some(true));
}

#[test]
fn ties_are_broken_by_numbers_and_sums_of_nothing_run_alike() {
    let equal = [(1, 2, -1), (0, 2, 1), (0, 1, 1)];
    let mut sets = graph(&single(3), &equal, false).contract(Limit::None, |_| ());
    // The first two follow node 0; the last connection has no influence any more.
    assert_eq!(sets.relation(0, 1), Some(false));
    assert_eq!(sets.relation(1, 2), Some(false));
}

#[test]
fn a_part_contracts_what_is_small_or_sure() {
    let most = |triangles| Limit::Triangles(triangles);
    // Turning node 1 could pay because of its connections outside; node 0 has no other connection.
    let nodes = vec![(3, 0, 0), (4, 1000, 0)];
    let mut sure = graph(&nodes, &[(0, 1, 1)], false);
    assert_eq!(sure.contract(most(0), |_| ()).relation(0, 1), Some(false));
    let nodes = vec![(3, 3, 0), (4, 1000, 0)];
    for (triangles, joined) in [(6, None), (7, Some(true))] {
        let mut graph = graph(&nodes, &[(0, 1, -2)], false);
        assert_eq!(
            graph.contract(most(triangles), |_| ()).relation(0, 1),
            joined
        );
    }
}

#[test]
fn what_faces_up_is_not_turned_by_less() {
    // Both face up, but should not be oriented alike; their upward weights are 16 and 32.
    for (sum, joined) in [(-15, None), (-16, Some(true)), (15, Some(false))] {
        let mut graph = graph(&vec![(1, 0, 1), (1, 0, 4)], &[(0, 1, sum)], false);
        let mut sets = graph.contract(Limit::Triangles(100), |_| ());
        assert_eq!(sets.relation(0, 1), joined, "{sum}");
    }
}

#[test]
fn the_sky_turns_what_faces_down_unless_more_speaks_against_it() {
    let nodes = vec![(1, 0, 10_000), (1, 0, -40_000), (1, 0, 0)];
    let sky = 3;
    for (sum, turned) in [
        (500, [false, true]),
        (5000, [true, true]),
        (-5000, [false, true]),
    ] {
        let mut graph = graph(&nodes, &[(0, 1, sum)], true);
        let mut sets = graph.contract(Limit::None, |_| ());
        let found = [0, 1].map(|node| sets.relation(node, sky));
        assert_eq!(found, turned.map(Some), "{sum}");
        // Without evidence and connections it remains a component of its own.
        assert_eq!(sets.relation(2, sky), None);
    }
}

#[test]
fn the_sky_holds_no_small_piece_that_nothing_connects() {
    for (up, held) in [
        (METHOD.orientation.held - 1, None),
        (METHOD.orientation.held, Some(false)),
        (-METHOD.orientation.held, Some(true)),
    ] {
        let mut graph = graph(&vec![(1, 0, up)], &[], true);
        assert_eq!(
            graph.contract(Limit::None, |_| ()).relation(0, 1),
            held,
            "{up}"
        );
    }
    // Connections whose sum is 0 are still connections.
    let nodes = vec![(1, 0, 90_000), (1, 0, 80_000), (1, 0, 4)];
    let mut graph = graph(&nodes, &[(0, 2, 5), (1, 2, -5)], true);
    assert_eq!(
        graph.contract(Limit::None, |_| ()).relation(2, 3),
        Some(false)
    );
}
