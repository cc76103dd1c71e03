//! Orientation by flatness inside a block, and by votes.

use super::*;
use crate::geom::Point;
use proptest::prelude::*;

/// The triangles of a sheet `wide` long and three points high that closes on itself, with a twist or
/// without, in the order of their ids; `names` are the ids of its points, and `gone` are missing.
fn band(wide: usize, twist: bool, names: &[u32], gone: &[usize]) -> Vec<Triangle> {
    let at = |x: usize, y: usize| {
        let y = if x >= wide && twist { 2 - y } else { y };
        names[x % wide * 3 + y]
    };
    let squares = (0..wide).flat_map(|x| [(x, 0), (x, 1)]);
    let halves = squares.flat_map(|(x, y)| {
        let [a, b, c, d] = [at(x, y), at(x, y + 1), at(x + 1, y), at(x + 1, y + 1)];
        [[a, b, c], [b, c, d]]
    });
    let mut all: Vec<Triangle> = halves.collect();
    all.iter_mut().for_each(|t| t.sort_unstable());
    let mut number = 0;
    all.retain(|_| {
        number += 1;
        !gone.contains(&(number - 1))
    });
    all.sort_unstable();
    all
}

/// Joins them, in one block, with their points where `places` says.
fn joined(triangles: &[Triangle], places: &[Point]) -> (ParitySets, Vec<bool>) {
    let ids = 0..places.len() as u32;
    let evidence = Evidence {
        held: Default::default(),
        places: Located::of(places),
        candidates: Vec::new(),
    };
    let mut sets = ParitySets::new(triangles.len());
    let dead = join_inside(ids, triangles, &evidence, &mut sets);
    (sets, dead)
}

/// Ids in some order, and places.
fn points(count: usize) -> impl Strategy<Value = (Vec<u32>, Vec<Point>)> {
    let names: Vec<u32> = (0..count as u32).collect();
    let places = prop::collection::vec(prop::array::uniform3(0..50), count);
    (Just(names).prop_shuffle(), places)
}

proptest! {
    #[test]
    fn what_is_left_can_be_oriented_and_what_is_removed_could_not(
        (names, places) in points(27),
        twist in any::<bool>(),
        gone in prop::collection::vec(0usize..36, 0..9),
    ) {
        let triangles = band(9, twist, &names, &gone);
        let (mut sets, dead) = joined(&triangles, &places);
        let across = across(0..places.len() as u32, &triangles);
        let mut contradicted = vec![false; triangles.len()];
        for (n, m, flip) in pairs(&triangles, &across) {
            let fits = sets.relation(n, m) == Some(flip);
            let alive = !dead[n as usize] && !dead[m as usize];
            assert!(fits || !alive, "{n} and {m} are left and contradict");
            contradicted[m as usize] |= !fits;
        }
        for (dead, contradicted) in dead.iter().zip(contradicted) {
            prop_assert!(!dead || contradicted);
        }
        prop_assert!(twist || !dead.contains(&true), "a band without a twist");
    }
}

/// A band with a twist lies flat but for one place, and that is not where its ids end.
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
    let (_, dead) = joined(&triangles, &places);
    let removed = (0..triangles.len()).filter(|&n| dead[n]);
    let removed: Vec<Triangle> = removed.map(|n| triangles[n]).collect();
    assert!(!removed.is_empty());
    for t in removed {
        let along = t.map(|v| v / 3);
        assert!(along.contains(&4) && along.contains(&5), "{t:?}");
    }
}

#[test]
fn clear_votes_come_first_and_ties_by_labels() {
    let mut votes = Votes::default();
    // Three labels in a ring that cannot all be joined: the weakest gives way.
    votes.add(0, 1, false, 5);
    votes.add(2, 1, true, 3);
    votes.add(1, 2, true, 4);
    votes.add(0, 2, false, 6);
    votes.add(3, 3, true, 100);
    // As many for as against.
    votes.add(4, 5, true, 2);
    votes.add(5, 4, false, 2);
    assert_eq!(votes.len(), 4);
    let mut sets = ParitySets::new(6);
    votes.join(&mut sets);
    assert_eq!(sets.relation(1, 2), Some(true));
    assert_eq!(sets.relation(0, 2), Some(false));
    assert_eq!(sets.relation(0, 1), Some(true));
    assert_eq!(sets.relation(4, 5), None);

    let mut equal = Votes::default();
    for (a, b, flip) in [(1, 2, true), (2, 0, false), (0, 1, false)] {
        equal.add(a, b, flip, 1);
    }
    let mut sets = ParitySets::new(3);
    equal.join(&mut sets);
    assert_eq!(
        (sets.relation(0, 1), sets.relation(1, 2)),
        (Some(false), Some(false))
    );
}

#[test]
fn weights_grow_with_flatness() {
    assert_eq!([-1.0, 0.0, 0.5, 1.0].map(weight), [1, 1, 8, 16]);
}

/// A torn band with a twist. Two edges contradict, both of one triangle: once that is gone, the other
/// edge is, too.
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
    ];
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
    let (_, dead) = joined(&triangles, &places);
    assert_eq!(dead.iter().filter(|dead| **dead).count(), 1);
}
