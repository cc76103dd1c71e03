use super::*;
use outcrop_geom::lattice::Lattice;
use proptest::prelude::*;
use std::collections::BTreeMap;

fn lattice(step: f64, base: [i64; 3]) -> Lattice {
    Lattice {
        step,
        offset: [0.25, -3.0, 1e4],
        base,
        exact: true,
    }
}

/// The points kept, from points in the given order, with a sort buffer of `buffer` bytes.
fn thinned(grid: &Grid, points: &[Point], buffer: u64) -> (Vec<Point>, LeftOut) {
    let workspace = Workspace::for_tests(2).expect("a scratch folder");
    let sorter = Sorter::new(&workspace, "thin", buffer);
    for &point in points {
        sorter.push(&[grid.in_cell(point)]).unwrap();
    }
    let thinned = Thinned {
        sorted: sorter.finish_on_disk(&workspace).unwrap(),
        grid: grid.clone(),
    };
    let mut kept = Vec::new();
    let stats = thinned
        .for_each(&workspace, None, LeftOut::default(), &mut |points, _, _| {
            kept.extend_from_slice(points);
            Ok(())
        })
        .unwrap();
    (kept, stats)
}

/// The same, computed with a hash table of cells.
fn naive(grid: &Grid, points: &[Point]) -> Vec<Point> {
    let mut cells: BTreeMap<[i64; 3], (f64, Point)> = BTreeMap::new();
    for &point in points {
        let along = grid.lattice.position(point);
        let cell = along.map(|c| (c / grid.side).floor() as i64);
        let square = |k: usize| (along[k] - (cell[k] as f64 + 0.5) * grid.side).powi(2);
        let entry = (square(0) + square(1) + square(2), point);
        let best = cells.entry(cell).or_insert(entry);
        if entry < *best {
            *best = entry;
        }
    }
    let mut kept: Vec<Point> = cells.into_values().map(|(_, point)| point).collect();
    kept.sort_unstable();
    kept
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]
    #[test]
    fn one_point_a_cell_whatever_the_order(
        points in prop::collection::vec(prop::array::uniform3(0i32..200), 1..800),
        side in 0.26f64..30.0,
        base in prop::array::uniform3(-500i64..500),
    ) {
        let grid = Grid::new(&lattice(0.25, base), side).unwrap();
        let (mut kept, stats) = thinned(&grid, &points, 1 << 20);
        let mut backwards = points.clone();
        backwards.reverse();
        let on_disk = thinned(&grid, &backwards, 24 * 64);
        prop_assert_eq!(&on_disk.0, &kept);
        prop_assert_eq!(on_disk.1, stats);
        prop_assert_eq!(points.len() as u64, kept.len() as u64 + stats.thin.dropped + stats.duplicates);
        kept.sort_unstable();
        prop_assert_eq!(kept, naive(&grid, &points));
    }
}

#[test]
fn a_cell_of_a_step_holds_one_position() {
    assert!(Grid::new(&lattice(0.25, [0; 3]), 0.25).is_none());
    assert!(Grid::new(&lattice(0.25, [0; 3]), 0.2500001).is_some());
}

#[test]
fn extreme_sides_and_positions() {
    let far = (1 << 30) - 1;
    let points = [[0, 0, 0], [far, far, far], [5, 5, 5], [far, 0, 0]];
    for base in [[0; 3], [-(1 << 29); 3], [1 << 40; 3]] {
        for side in [0.250_000_1, 1.0, 1e8, 1e300, f64::MAX] {
            let grid = Grid::new(&lattice(0.25, base), side).unwrap();
            let (mut kept, _) = thinned(&grid, &points, 1 << 20);
            kept.sort_unstable();
            assert_eq!(kept, naive(&grid, &points), "{base:?} {side}");
        }
    }
}
