//! The boundary of a surface in parts, against counting the triangles of each edge.

use super::border::{self, BorderEdge, Boundary};
use super::source::Part;
use outcrop_disk::spill::Sorter;
use outcrop_disk::workspace::Workspace;
use outcrop_geom::{Point, distance2};
use outcrop_stages::blocks::Blocks;
use outcrop_stages::ids::{Id, Triangle, triangle};
use outcrop_stages::located::Located;
use proptest::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

/// Side of a grid of points.
const SIDE: u32 = 14;

/// The triangles of a grid whose points have shuffled ids, without those that are left out.
fn grid(order: &[u32], out: &BTreeSet<usize>) -> Vec<Triangle> {
    let id = |x: u32, y: u32| order[(y * SIDE + x) as usize];
    let cells = (0..SIDE - 1).flat_map(|y| (0..SIDE - 1).map(move |x| (x, y)));
    let both = cells.flat_map(|(x, y)| {
        let [a, b, c, d] = [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)].map(|(x, y)| id(x, y));
        [[a, b, c], [a, c, d]].map(triangle)
    });
    let left = both.enumerate().filter(|(n, _)| !out.contains(n));
    left.map(|(_, t)| t).collect()
}

/// Edges with one triangle.
fn once(triangles: &[Triangle]) -> BTreeSet<[Id; 2]> {
    let mut counts: BTreeMap<[Id; 2], usize> = BTreeMap::new();
    for [a, b, c] in triangles {
        for (a, b) in [(a, b), (b, c), (c, a)] {
            *counts.entry([*a.min(b), *a.max(b)]).or_default() += 1;
        }
    }
    let once = counts.into_iter().filter(|(_, count)| *count == 1);
    once.map(|(edge, _)| edge).collect()
}

/// Numbers of edges of the connected parts of some edges.
fn connected(edges: &BTreeSet<[Id; 2]>) -> Vec<u64> {
    let mut left = edges.clone();
    let mut sizes = Vec::new();
    while let Some(first) = left.pop_first() {
        let (mut reached, mut size) = (BTreeSet::from(first), 1);
        loop {
            let near = |e: &&[Id; 2]| e.iter().any(|v| reached.contains(v));
            let Some(edge) = left.iter().find(near).copied() else {
                break;
            };
            left.remove(&edge);
            reached.extend(edge);
            size += 1;
        }
        sizes.push(size);
    }
    sizes.sort_unstable();
    sizes
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]
    #[test]
    fn the_boundary_is_that_of_the_whole(
        order in Just((0..SIDE * SIDE).collect::<Vec<u32>>()).prop_shuffle(),
        out in prop::collection::btree_set(0usize..338, 0..30),
        block in 1u32..80,
    ) {
        let triangles = grid(&order, &out);
        let points: Vec<Point> = (0..SIDE * SIDE).map(|v| [v as i32, (v * v) as i32 % 101, 7]).collect();
        let blocks = Blocks::new(points.len(), block);
        let workspace = Workspace::for_tests(2).expect("a scratch folder");
        // A small buffer, so that edges go to disk.
        let sorter: Sorter<BorderEdge> = Sorter::new(&workspace, "draw.edges", 2000);
        for number in 0..blocks.count() {
            let own = |t: &&Triangle| blocks.of(*t.iter().min().unwrap()).index() == number;
            let part = Part {
                ids: blocks.ids(number),
                triangles: triangles.iter().filter(own).copied().collect(),
                runs: Vec::new(),
                at: Located::of(&points),
            };
            sorter.push(&border::of_part(&part)).unwrap();
        }
        let boundary = Boundary::of(sorter.finish(&workspace).unwrap(), &workspace).unwrap();
        let mut found = BTreeSet::new();
        let mut lengths = 0;
        boundary.for_each(|edge| {
            assert_eq!(edge.at, edge.ends.map(|v| points[v.index()]));
            lengths += u64::from(distance2(edge.at[0], edge.at[1]) > 0);
            assert!(found.insert(edge.ends));
        }).unwrap();
        let expected = once(&triangles);
        prop_assert_eq!(&found, &expected);
        prop_assert_eq!(boundary.lengths.total(), lengths);
        let loops = boundary.loops.unwrap();
        let sizes = connected(&expected);
        prop_assert_eq!(loops.total(), sizes.len() as u64);
        let largest = loops.by_octave().unwrap().max;
        prop_assert_eq!(largest, *sizes.last().unwrap() as f64);
    }
}
