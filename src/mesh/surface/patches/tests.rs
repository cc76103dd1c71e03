//! Tests of patches on bands with folds.

use super::super::evidence::{Division, cosine, weight};
use super::super::star::opposed;
use super::*;
use outcrop_geom::Point;
use outcrop_paper::method::METHOD;
use outcrop_stages::ids::{Id, triangle};
use outcrop_stages::located::Located;
use proptest::prelude::*;

/// The triangles of a closed band, `wide` points long and three points high, with a twist or without, in the
/// order of their ids; `names` are the ids of its points, and the triangles `gone` are left out.
pub(in super::super) fn band(
    wide: usize,
    twist: bool,
    names: &[u32],
    gone: &[usize],
) -> Vec<Triangle> {
    let at = |x: usize, y: usize| {
        let y = if x >= wide && twist { 2 - y } else { y };
        names[x % wide * 3 + y]
    };
    let squares = (0..wide).flat_map(|x| [(x, 0), (x, 1)]);
    let halves = squares.flat_map(|(x, y)| {
        let [a, b, c, d] = [at(x, y), at(x, y + 1), at(x + 1, y), at(x + 1, y + 1)];
        [triangle([a, b, c]), triangle([b, c, d])]
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

/// The edges between two triangles: the earlier and the later one, and true if one must be turned.
pub(in super::super) fn inner_edges(ids: Ids, triangles: &[Triangle]) -> Vec<(usize, usize, bool)> {
    let mut edges = Vec::new();
    for (n, sides) in across(ids, triangles).into_iter().enumerate() {
        for (a, b, opposite, _) in EDGES {
            let (m, _) = parts(sides[opposite]);
            if sides[opposite] != Side::NONE && n <= m {
                let t = triangles[n];
                edges.push((n, m, opposed(t, triangles[m], t[a], t[b])));
            }
        }
    }
    edges
}

/// Evidence with positions only.
pub(in super::super) fn evidence(places: &[Point], division: Division) -> Evidence {
    Evidence {
        places: Located::of(places),
        division,
        ..Evidence::default()
    }
}

/// Ids in a random order, and positions.
pub(in super::super) fn points(count: usize) -> impl Strategy<Value = (Vec<u32>, Vec<Point>)> {
    let names: Vec<u32> = (0..count as u32).collect();
    let places = prop::collection::vec(prop::array::uniform3(0..50), count);
    // Flat, or with random heights.
    let places = (places, any::<bool>()).prop_map(|(mut places, flat)| {
        let flatten = |p: &mut Point| p[2] = if flat { p[2] / 25 } else { p[2] };
        places.iter_mut().for_each(flatten);
        places
    });
    (Just(names).prop_shuffle(), places)
}

proptest! {
    #[test]
    fn patches_are_flat_parts_of_runs_and_nothing_is_lost(
        (names, places) in points(27),
        twist in any::<bool>(),
        gone in prop::collection::vec(0usize..36, 0..9),
        patch in 1u32..30,
    ) {
        let triangles = band(9, twist, &names, &gone);
        let evidence = evidence(&places, Division { patch, cluster: 0, gain: 0 });
        let ids = Ids::of(0..places.len() as u32);
        let mut patches = Patches::of(ids, &triangles, &evidence, patch);
        let mut shared = patches.shared.clone();
        for (n, m, flip) in inner_edges(ids, &triangles) {
            let (t, other) = (triangles[n], triangles[m]);
            let cosine = cosine(evidence.normal(t), evidence.normal(other), flip);
            let weight = weight(cosine) as u8;
            let one = patches.of[n] == patches.of[m];
            let near = t[0].get() / patch == other[0].get() / patch;
            prop_assert!(one || !near || cosine <= METHOD.orientation.flat, "{:?} {:?}", t, other);
            prop_assert!(!one || near);
            if !one || patches.sets.relation(TriangleIndex::at(n), TriangleIndex::at(m)) != Some(flip) {
                let [a, b] = [n, m].map(TriangleIndex::at);
                let edge = SharedEdge { a, b, flip, weight };
                prop_assert_eq!(shared.remove(0), edge);
            }
        }
        prop_assert_eq!(shared, []);
        let mut first: Vec<TriangleIndex> = Vec::new();
        for (n, of) in (0..).map(TriangleIndex::at).zip(&patches.of) {
            prop_assert!(of.index() <= first.len());
            if of.index() == first.len() {
                first.push(n);
            }
            prop_assert_eq!(patches.sets.find(n).0, first[of.index()]);
        }
        let roots: Vec<TriangleIndex> = patches.roots.iter().map(|(root, _)| *root).collect();
        prop_assert_eq!(roots, first);
        let count: u32 = patches.roots.iter().map(|(_, count)| count).sum();
        prop_assert_eq!(count as usize, triangles.len());
    }
}

/// A flat band that is folded once.
#[test]
fn a_patch_ends_at_a_fold_and_where_its_run_ends() {
    let names: Vec<u32> = (0..30).collect();
    // The last strip closes the band.
    let triangles: Vec<Triangle> = band(10, false, &names, &[36, 37, 38, 39]);
    let places: Vec<Point> = (0..30)
        .map(|id: i32| {
            [
                id / 3 * 10,
                id % 3 * 10,
                if id < 15 { 0 } else { 20 * (id / 3 - 4) },
            ]
        })
        .collect();
    for (patch, firsts) in [(30, vec![0, 12]), (18, vec![0, 12, 18])] {
        let evidence = evidence(
            &places,
            Division {
                patch,
                cluster: 0,
                gain: 0,
            },
        );
        let patches = Patches::of(Ids::of(0..30), &triangles, &evidence, patch);
        let found: Vec<Id> = patches
            .roots
            .iter()
            .map(|(root, _)| triangles[root.index()][0])
            .collect();
        assert_eq!(found, firsts.into_iter().map(Id::new).collect::<Vec<_>>());
    }
}
