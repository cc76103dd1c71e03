//! Compares the second look with a plain one, and with examples.

use super::super::contract::Limit;
use super::*;
use outcrop_paper::method::METHOD;
use proptest::prelude::*;
use std::collections::BTreeSet;

type Pairs = Vec<(u32, u32, i64)>;

/// A graph with this evidence and these pairs; the sky is the last node.
fn graph(up: &[i64], pairs: &Pairs) -> (Graph<u32>, u32) {
    let mut graph = Graph::new(up.len());
    for (node, up) in (0..).zip(up) {
        graph.add_up(node, *up);
    }
    for &(a, b, weight) in pairs {
        graph.add(a, b, weight);
    }
    let sky = graph.push_sky();
    (graph, sky)
}

/// A graph that was contracted and looked at again: for each node, true if it is turned in its cluster.
struct Oriented {
    first: Vec<bool>,
    after: Vec<bool>,
    contractions: Vec<Contraction<u32>>,
}

fn orient(up: &[i64], pairs: &Pairs, gain: i64) -> Oriented {
    let (mut graph, sky) = graph(up, pairs);
    let mut history = History::of(&graph);
    let clusters = graph.contract(Limit::None, |contraction| history.push(contraction));
    let first: Vec<bool> = (0..=sky).map(|node| clusters.look(node).1).collect();
    let contractions = history.contractions.clone();
    let turned = history.look_back(&clusters, sky, gain).into_iter();
    let after = turned
        .zip(&first)
        .map(|(turned, first)| turned ^ first)
        .collect();
    Oriented {
        first,
        after,
        contractions,
    }
}

/// Adds up all weights whenever they are needed.
struct Plain<'a> {
    up: &'a [i64],
    pairs: &'a Pairs,
    turned: Vec<bool>,
}

impl Plain<'_> {
    /// The weight with which the nodes of a part are held.
    fn weight(&self, part: &BTreeSet<u32>) -> i64 {
        let out = |a, b| part.contains(a) != part.contains(b);
        let turned = |v: &u32| self.turned[*v as usize];
        let pairs = self.pairs.iter().filter(|(a, b, _)| out(a, b));
        let outside: i64 = pairs
            .map(|(a, b, sum)| signed(turned(a) ^ turned(b), *sum))
            .sum();
        let up: i64 = part
            .iter()
            .map(|v| signed(turned(v), self.up[*v as usize]))
            .sum();
        outside
            + up.signum() * METHOD.orientation.flattest * (up.abs() as f64).sqrt().floor() as i64
    }

    fn look_back(&mut self, contractions: &[Contraction<u32>], sky: u32, gain: i64) {
        let mut parts: Vec<BTreeSet<u32>> = (0..=sky).map(|node| [node].into()).collect();
        let mut before = Vec::new();
        for c in contractions {
            let both = [c.goes, c.stays].map(|part| parts[part as usize].clone());
            parts[c.stays as usize].extend(&both[0]);
            before.push(both);
        }
        for part in before.iter().rev().flatten() {
            if !part.contains(&sky) && self.weight(part) < -gain {
                part.iter()
                    .for_each(|node| self.turned[*node as usize] ^= true);
            }
        }
    }
}

fn nodes() -> impl Strategy<Value = Vec<i64>> {
    let many = METHOD.orientation.held;
    let up = prop_oneof![Just(0), -9i64..10, -many - 3..many + 3];
    prop::collection::vec(up, 1..12)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(3000))]

    #[test]
    fn looks_back_as_a_plain_one(
        mut up in nodes(),
        pairs in prop::collection::vec((0u32..12, 0u32..12, -20i64..21), 0..40),
        gain in prop_oneof![Just(0), 0i64..40],
    ) {
        let count = up.len() as u32;
        let pairs: Pairs = pairs.into_iter().map(|(a, b, w)| (a % count, b % count, w)).collect();
        let Oriented { first, after, contractions } = orient(&up, &pairs, gain);
        up.push(0);
        let mut plain = Plain { up: &up, pairs: &pairs, turned: first };
        plain.look_back(&contractions, count, gain);
        prop_assert_eq!(after, plain.turned);
    }
}

#[test]
fn a_part_is_turned_by_what_joined_later() {
    // 1 joins 0 by 20. So 2 and 3 follow 1, by 1 more than they would follow 0; together 0 is then cut by 22.
    let pairs = vec![(0, 1, 20), (1, 2, -12), (1, 3, -12), (0, 2, 11), (0, 3, 11)];
    let alike = |turned: &[bool]| [1, 2, 3].map(|node| turned[node] == turned[0]);
    let Oriented { first, after, .. } = orient(&[0; 4], &pairs, 1);
    assert_eq!(alike(&first), [true, false, false]);
    assert_eq!(alike(&after), [false, true, true]);
    let more = orient(&[0; 4], &pairs, 2);
    assert_eq!(alike(&more.after), [true, false, false]);
}

#[test]
fn a_roof_is_turned_back_by_its_walls() {
    // Ground (0) faces up, the roof (1) down: its evidence turns it before its walls (2 to 11) are decided. Each
    // is held by the ground with 120 and by the roof with 118.
    let mut up = vec![0; 12];
    up[..2].copy_from_slice(&[4000, -1024]);
    let walls = (2..12).flat_map(|wall| [(0, wall, 120), (1, wall, 118)]);
    let Oriented { first, after, .. } =
        orient(&up, &walls.collect(), upward(METHOD.orientation.held));
    assert!(first[1]);
    assert!(!after[1]);
}
