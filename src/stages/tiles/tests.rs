//! Compares the search in a tile with all distances, for every level of the kernels.

use super::near::{Around, Nearer, Search};
use super::neighbors::Neighbors;
use super::walk::{PageCache, Walk};
use super::wanted::Wanted;
use super::*;
use crate::order::Orderer;
use outcrop_disk::workspace::Workspace;
use outcrop_geom::{Point, distance2};
use outcrop_paper::kernels::Level;
use outcrop_paper::plane::Moments;
use proptest::prelude::*;

/// The store of a cloud in pages of `page` points, its workspace, and its points by id.
fn ordered(cloud: &[Point], page: usize) -> (Workspace, PointStore, Vec<Point>) {
    let workspace = Workspace::for_tests(1).expect("a scratch folder");
    let orderer = Orderer::new(&workspace).unwrap();
    orderer.push(&workspace, cloud).unwrap();
    let (stored, _) = orderer.finish(&workspace, page).unwrap();
    let store = stored.open(&workspace).unwrap();
    let points = store.slice(0..store.len()).unwrap();
    (workspace, store, points)
}

/// All other points as (squared distance, id), ascending.
fn all_near(points: &[Point], id: usize) -> Vec<(u64, Id)> {
    let others = (0..points.len()).filter(|&j| j != id);
    let mut all: Vec<_> = others
        .map(|j| (distance2(points[id], points[j]), Id::at(j)))
        .collect();
    all.sort_unstable();
    all
}

/// Clouds that are flat, thin, gridded, clustered, or extend to the ends of the lattice.
fn clouds() -> impl Strategy<Value = Vec<Point>> {
    let cube =
        |side: i32, count: usize| prop::collection::vec(prop::array::uniform3(0..side), 1..count);
    let far = |mut points: Vec<Point>| {
        points.extend([[0; 3], [(1 << 30) - 1; 3], [0, (1 << 30) - 1, 7]]);
        points
    };
    prop_oneof![
        cube(1 << 30, 400),
        cube(9, 500),
        cube(40, 600).prop_map(|c| c
            .into_iter()
            .map(|p| [p[0] * 1000, p[1] * 1000, p[2] % 2])
            .collect()),
        cube(300, 300).prop_map(|c| c.into_iter().map(|p| [p[0] << 20, 5, 5]).collect()),
        cube(2000, 400).prop_map(far),
    ]
}

fn picked(p: &Point) -> bool {
    (p[0] ^ p[1] ^ p[2]) % 3 == 0
}

/// Wants boxes in a half-space, and every third of their points.
struct Half {
    from: Point,
}

impl Wanted for Half {
    fn may_be_in(&self, bounds: &Aabb) -> bool {
        bounds.max[0] >= self.from[0]
    }

    fn pick(&self, [x, y, z]: [&[i32]; 3], places: &mut Vec<u32>) {
        let is_picked = |place: &u32| {
            let place = *place as usize;
            picked(&[x[place], y[place], z[place]])
        };
        places.extend((0..x.len() as u32).filter(is_picked));
    }
}

/// Tests all functions of a query; it must not claim more than it knows.
fn check(points: &[Point], tile: &Tile, k: usize, search: &mut Search) {
    let mut next = tile.ids().start;
    tile.for_each_query(
        k,
        search,
        |_| (),
        |id, point, query| {
            assert_eq!(id.index(), next);
            next += 1;
            assert_eq!(point, points[id.index()]);
            let Some(mut query) = query else { return };
            let expected = all_near(points, id.index());
            let agrees = |query: &near::Query<'_>| {
                let complete = expected.partition_point(|(d2, _)| *d2 <= query.complete2());
                let got = query.near().iter().map(|n| (n.distance2, n.id));
                assert!(got.eq(expected[..complete].iter().copied()));
            };
            agrees(&query);
            assert!(query.near().len() >= k);
            for count in [k, 2 * k, 4 * k] {
                let nearest = expected.get(..count);
                if let Some(sums) = query.sums(count) {
                    assert_eq!(
                        Some(sums),
                        nearest.map(|near| sums_over(points, point, near))
                    );
                }
                agrees(&query);
            }
            for near in query.near().iter() {
                let there = points[near.id.index()];
                assert_eq!(near.difference, outcrop_geom::sub(there, point));
            }
            if query.extend_to(2 * k) {
                assert!(query.near().len() >= 2 * k);
            }
            agrees(&query);
            // Of the farther points, all wanted ones in the half-space must be listed, and no unwanted ones.
            let known = query.complete2();
            let farther = known.saturating_mul(2).saturating_add(1);
            let half = |p: &Point| p[0] >= point[0];
            if query.extend_where(farther, &Half { from: point }) {
                assert!(query.complete2() >= farther);
                let got: Vec<_> = query.near().iter().map(|n| (n.distance2, n.id)).collect();
                assert!(got.is_sorted());
                let beyond = expected
                    .iter()
                    .filter(|(d2, _)| known < *d2 && *d2 <= farther);
                let beyond = beyond
                    .filter(|(_, id)| picked(&points[id.index()]))
                    .copied();
                let beyond: Vec<_> = beyond.collect();
                assert!(got.iter().all(|near| beyond.contains(near)));
                let wanted = beyond.iter().filter(|(_, id)| half(&points[id.index()]));
                assert!(wanted.into_iter().all(|near| got.contains(near)));
            }
        },
    );
    assert_eq!(next, tile.ids().end);
}

fn sums_over(points: &[Point], point: Point, nearest: &[(u64, Id)]) -> near::Sums {
    let mut moments = Moments::default();
    for (_, near) in nearest {
        moments.add(outcrop_geom::sub(points[near.index()], point));
    }
    near::Sums {
        moments,
        last2: nearest.last().map_or(0, |last| last.0),
    }
}

/// Compares sums over the nearest with those over a sorted list, for all or only some of the points.
fn check_sums(points: &[Point], tile: &Tile, k: usize, search: &mut Search) {
    let wanted = |id: usize| !id.is_multiple_of(3);
    let mut next: Vec<usize> = tile.ids().filter(|id| wanted(*id)).rev().collect();
    tile.for_some_sums(
        k,
        search,
        wanted,
        |_| (),
        |id, point, sums| {
            assert_eq!(Some(id.index()), next.pop());
            assert_eq!(point, points[id.index()]);
            let Some(sums) = sums else { return };
            let nearest = &all_near(points, id.index())[..k];
            assert_eq!(*sums, sums_over(points, point, nearest));
        },
    );
    assert!(next.is_empty());
}

/// Compares the sets of neighbours of groups with those of a sorted list. Returns how many are known.
fn check_groups(points: &[Point], tile: &Tile, k: usize, search: &mut Search) -> usize {
    let (mut next, mut known) = (tile.ids().start, 0);
    let each = |group: &mut near::Group<'_>| {
        for (number, member) in group.members().iter().enumerate() {
            assert_eq!(member.id.index(), next);
            next += 1;
            assert_eq!(member.point, points[member.id.index()]);
            let expected = all_near(points, member.id.index());
            let far2 = expected.get(expected.len() / 2).map_or(0, |near| near.0);
            if let Some(columns) = group.within(far2) {
                let listed =
                    |at: &Point| (0..columns[0].len()).any(|n| columns.map(|c| c[n]) == *at);
                let near = expected.iter().take_while(|(d2, _)| *d2 <= far2);
                assert!(near.into_iter().all(|(_, id)| listed(&points[id.index()])));
            }
            if let Some(sums) = member.sums {
                known += 1;
                assert_eq!(sums, sums_over(points, member.point, &expected[..k]));
                let ids = &member.ids()[..k];
                assert!(ids.is_sorted());
                assert!(expected[..k].iter().all(|(_, id)| ids.contains(&id.get())));
                let [x, y, z] = member.differences();
                for (place, id) in ids.iter().enumerate() {
                    let difference = [x[place], y[place], z[place]].map(i64::from);
                    let at = points[*id as usize];
                    assert_eq!(difference, outcrop_geom::sub(at, member.point));
                }
                assert!(
                    [x, y, z]
                        .iter()
                        .all(|column| column[k..].iter().all(|c| *c == 0))
                );
                assert!(expected[k..].iter().all(|(d2, _)| *d2 > member.complete2));
            }
            if let Some(query) = group.query(number) {
                let got = query.near().iter().take(k).map(|n| (n.distance2, n.id));
                assert!(got.eq(expected[..k].iter().copied()));
            }
        }
    };
    tile.for_each_group(k, search, |_| (), each);
    assert_eq!(next, tile.ids().end);
    known
}

/// Compares the neighbours around all or only some of the points, and the nearer half of them, with those of a
/// sorted list.
fn check_around(points: &[Point], tile: &Tile, k: usize, level: Level) {
    let mut nearer = Nearer::at(level);
    let each = |id: Id, point: Point, around: Option<&mut Around>| {
        let Some(around) = around else { return };
        let all = all_near(points, id.index());
        for count in [k, k / 2] {
            around.keep_nearest(count, &mut nearer);
            let mut ids: Vec<Id> = all[..count].iter().map(|near| near.1).chain([id]).collect();
            ids.sort_unstable();
            let columns = around.columns();
            assert_eq!(around.count(), ids.len());
            for (place, id) in ids.iter().enumerate() {
                let difference = columns.map(|column| i64::from(column[place]));
                assert_eq!(difference, outcrop_geom::sub(points[id.index()], point));
            }
            let rest = columns.iter().flat_map(|column| &column[ids.len()..]);
            assert!(rest.into_iter().all(|c| *c == 0));
            let last2 = count.checked_sub(1).map_or(0, |last| all[last].0);
            assert_eq!(around.last2(), last2);
        }
    };
    let wanted = |id: usize| !id.is_multiple_of(3);
    tile.for_some_around((k, |_| k), &mut Search::at(level), wanted, |_| (), each);
}

/// Compares different numbers of neighbours around all points, where only some can be neighbours, with those of a
/// sorted list.
fn check_chosen(points: &[Point], mut tile: Tile, k: usize, level: Level) {
    let chosen = |id: usize| !(id / 2).is_multiple_of(3) || id.is_multiple_of(5);
    tile.choose(chosen);
    let count = |id: usize| {
        if id.is_multiple_of(7) {
            k.div_ceil(2)
        } else {
            k
        }
    };
    let each = |id: Id, point: Point, around: Option<&mut Around>| {
        let Some(around) = around else { return };
        let near = all_near(points, id.index()).into_iter();
        let mut all: Vec<_> = near.filter(|near| chosen(near.1.index())).collect();
        if chosen(id.index()) {
            all.insert(0, (0, id));
        }
        let k = count(id.index());
        all.truncate(k + 1);
        assert_eq!(around.last2(), all[k].0);
        all.sort_unstable_by_key(|near| near.1);
        let columns = around.columns();
        assert_eq!(around.count(), all.len());
        for (place, (_, id)) in all.iter().enumerate() {
            let difference = columns.map(|column| i64::from(column[place]));
            assert_eq!(difference, outcrop_geom::sub(points[id.index()], point));
        }
    };
    tile.for_some_around((k, count), &mut Search::at(level), |_| true, |_| (), each);
}

/// Without ties, nearly all neighbourhoods are known, also where the density changes.
#[test]
fn groups_know_most_neighbors() {
    let at = |n: i32| {
        let side = 1000 + n / 2 * (n / 500);
        [
            n.wrapping_mul(7919).rem_euclid(side * 97),
            n.wrapping_mul(104_729).rem_euclid(side * 89),
            n % 7,
        ]
    };
    let cloud: Vec<Point> = (0..3000).map(at).collect();
    let (_workspace, store, points) = ordered(&cloud, 256);
    let tile = Tile::load(&store, 0..store.len()).unwrap();
    for level in Level::all() {
        let known = check_groups(&points, &tile, 30, &mut Search::at(level));
        assert!(
            known * 100 > points.len() * 95,
            "{known} of {}",
            points.len()
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]
    #[test]
    fn neighbors_are_those_of_all_distances(
        cloud in clouds(),
        k in 1usize..40,
        page in prop::sample::select(vec![1usize, 5, 16, 64, 256]),
        cut in 0.0f64..1.0,
    ) {
        let (_workspace, store, points) = ordered(&cloud, page);
        let cut = (store.len() as f64 * cut) as usize;
        for ids in [0..cut, cut..store.len()] {
            if ids.is_empty() {
                continue;
            }
            let tile = Tile::load(&store, ids).unwrap();
            for level in Level::all() {
                check(&points, &tile, k, &mut Search::at(level));
                check_sums(&points, &tile, k, &mut Search::at(level));
                check_groups(&points, &tile, k, &mut Search::at(level));
                check_around(&points, &tile, k, level);
            }
            check_chosen(&points, tile, k, Level::best());
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn a_walk_leaves_out_what_is_not_wanted_and_nothing_else(
        cloud in clouds(),
        known in 0usize..80,
        page in prop::sample::select(vec![1usize, 5, 16, 64, 256]),
        within in 0.0f64..1.2,
    ) {
        let (_workspace, store, points) = ordered(&cloud, page);
        let mut cache = PageCache::default();
        let mut near = Neighbors::default();
        for id in (0..points.len()).step_by(37) {
            let point = points[id];
            let all = all_near(&points, id);
            let mut walk = Walk::new(&store, &mut cache, Id::at(id), point);
            for expected in all.iter().take(known) {
                let next = walk.advance().unwrap().unwrap();
                prop_assert_eq!((next.distance2, next.id), *expected);
            }
            let rest = &all[known.min(all.len())..];
            let place = (rest.len() as f64 * within) as usize;
            let within2 = rest.get(place).map_or(u64::MAX, |near| near.0);
            let mut got = Vec::new();
            loop {
                walk.list_where(within2, &Half { from: point }, &mut near).unwrap();
                if near.is_empty() {
                    break;
                }
                got.extend(near.iter().map(|n| (n.distance2, n.id)));
            }
            prop_assert!(got.is_sorted());
            prop_assert!(got.iter().all(|near| rest.contains(near)));
            let wanted = |(d2, id): &&(u64, Id)| {
                let at = &points[id.index()];
                *d2 <= within2 && picked(at) && at[0] >= point[0]
            };
            prop_assert!(rest.iter().filter(wanted).all(|near| got.contains(near)));
            // Points that were ready from an earlier step are returned whether wanted or not.
            let asked = got.iter().all(|(_, id)| picked(&points[id.index()]));
            prop_assert!(asked || known > 0);
        }
    }

    #[test]
    fn pages_near_a_page_are_those_whose_box_is(
        cloud in clouds(),
        page in prop::sample::select(vec![1usize, 3, 16]),
        far in 0u32..33,
        most in 0usize..200,
    ) {
        let (_workspace, store, _) = ordered(&cloud, page);
        let mut found = Vec::new();
        for target in (0..store.pages()).step_by(11).map(|page| store.page_box(page)) {
            let reach = (1u64 << far) / 3;
            let near = |page: &PageNumber| {
                store.page_box(page.index()).distance2_box(target) <= reach * reach
            };
            let pages = (0..store.pages()).map(PageNumber::at);
            let expected: Vec<_> = pages.filter(near).collect();
            let all = store.pages_near(target, reach, most, &mut found);
            prop_assert_eq!(all, expected.len() <= most);
            if all {
                prop_assert_eq!(&found, &expected);
            }
        }
    }
}
