//! Tests of the cuts inside a block.

use super::super::evidence::Division;
use super::super::parity::ParitySets;
use super::super::patches::tests::{band, evidence, inner_edges, points};
use super::*;
use outcrop_geom::Point;
use outcrop_stages::ids::triangle;
use proptest::prelude::*;

/// Orients triangles in one block, with points at `places`.
fn oriented(
    triangles: &[Triangle],
    places: &[Point],
    division: Division,
) -> (ParitySets<TriangleIndex>, Vec<bool>) {
    let ids = Ids::of(0..places.len() as u32);
    let evidence = &evidence(places, division);
    let mut weigher = Weigher {
        patches: Patches::of(ids, triangles, evidence, division.patch),
        graph: Graph::default(),
        inner: triangles,
        evidence,
        ids,
        most: 0,
    };
    let mut connections = Connections::default();
    weigher.add_patches();
    weigher.add_connections(&[], &mut connections);
    weigher.contract(division.cluster, &mut connections);
    let dead = weigher.cut();
    assert!(weigher.patches.shared.is_empty(), "all is one cluster");
    (weigher.patches.sets, dead)
}

proptest! {
    #[test]
    fn what_is_left_can_be_oriented_and_what_is_removed_could_not(
        (names, places) in points(27),
        twist in any::<bool>(),
        gone in prop::collection::vec(0usize..36, 0..9),
        patch in 1u32..30,
    ) {
        let triangles = band(9, twist, &names, &gone);
        let division = Division { patch, cluster: 1000, gain: 0 };
        let (mut sets, dead) = oriented(&triangles, &places, division);
        let mut contradicted = vec![false; triangles.len()];
        for (n, m, flip) in inner_edges(Ids::of(0..27), &triangles) {
            let fits = sets.relation(TriangleIndex::at(n), TriangleIndex::at(m)) == Some(flip);
            prop_assert!(fits || dead[n] || dead[m], "{} and {} are left and contradict", n, m);
            contradicted[m] |= !fits;
        }
        for (dead, contradicted) in dead.iter().zip(contradicted) {
            prop_assert!(!dead || contradicted);
        }
        let flat = places.iter().all(|p| p[2] < 2);
        prop_assert!(twist || flat || !dead.contains(&true) || patch < 30);
    }
}

/// A twisted band that is flat except for one fold, which is not where its ids wrap around. At each cut edge
/// the later triangle is removed, so that may be a triangle beside the fold.
#[test]
fn the_surface_is_cut_where_it_is_folded() {
    let names: Vec<u32> = (0..36).collect();
    let triangles = band(12, true, &names, &[]);
    let places: Vec<Point> = (0..36)
        .map(|id: i32| {
            let (along, across) = (id / 3, id % 3);
            let across = if along < 5 { 2 - across } else { across };
            [(along + 7) % 12 * 10, across * 10, along % 2]
        })
        .collect();
    for patch in [256, 7] {
        let division = Division {
            patch,
            cluster: 1000,
            gain: 0,
        };
        let (_, dead) = oriented(&triangles, &places, division);
        let removed = (0..triangles.len()).filter(|&n| dead[n]);
        let removed: Vec<Triangle> = removed.map(|n| triangles[n]).collect();
        assert!(!removed.is_empty());
        for t in removed {
            let along = t.map(|v| v.get() / 3);
            assert!(along.contains(&4) || along.contains(&5), "{t:?}");
        }
    }
}

/// A torn twisted band. Two edges contradict the rest, both of one triangle: if it is removed, neither edge
/// is left.
#[test]
fn a_removed_triangle_removes_no_others() {
    let triangles = [
        [0, 1, 2],
        [0, 2, 10],
        [0, 9, 10],
        [1, 2, 4],
        [1, 3, 8],
        [1, 4, 8],
        [2, 6, 10],
        [3, 6, 8],
        [4, 8, 11],
        [6, 8, 10],
        [8, 10, 11],
    ]
    .map(triangle);
    let places = [
        [0, 5, 2],
        [0, 3, 4],
        [1, 3, 0],
        [5, 2, 0],
        [0, 0, 0],
        [2, 0, 4],
        [5, 0, 0],
        [5, 5, 0],
        [2, 1, 4],
        [3, 3, 0],
        [4, 3, 2],
        [4, 1, 1],
    ];
    let (_, dead) = oriented(&triangles, &places, Division::default());
    assert_eq!(dead.iter().filter(|dead| **dead).count(), 1);
}
