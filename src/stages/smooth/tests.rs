//! Tests of relaxing and smoothing on planes, edges and spheres.

use super::*;
use crate::blocks::Blocks;
use crate::order::Orderer;

/// A square sheet of `side * side` points, a hundred steps apart, with height `high`.
fn sheet(side: i32, high: impl Fn(i32, i32) -> i32) -> Vec<Point> {
    let at = |n: i32| [100 * (n % side), 100 * (n / side), 500 + high(n % side, n)];
    (0..side * side).map(at).collect()
}

/// Deterministic noise from -100 to 100.
fn noise(n: i32) -> i32 {
    let n = (n as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    ((n ^ n >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 40) as i32 % 201 - 100
}

fn ordered(
    points: &[Point],
    tile: u32,
    page: usize,
    workspace: &Workspace,
) -> (PointStore, TileRanges) {
    let orderer = Orderer::new(workspace).unwrap();
    orderer.push(workspace, points).unwrap();
    let (stored, _) = orderer.finish(workspace, page).unwrap();
    let store = stored.open(workspace).unwrap();
    let tiles = TileRanges::new(Blocks::new(store.len(), 1000), tile);
    (store, tiles)
}

/// Positions after smoothing of the noisy points with tiles and pages of these sizes, and the counts.
fn relaxed(points: &[Point], rounds: u32, tile: u32, page: usize) -> (Vec<Point>, RelaxStats) {
    let relaxing = Relaxing {
        neighbors: 18,
        rounds,
        step: 1.0,
    };
    relaxed_as(points, relaxing, tile, page)
}

fn relaxed_as(
    points: &[Point],
    relaxing: Relaxing,
    tile: u32,
    page: usize,
) -> (Vec<Point>, RelaxStats) {
    let workspace = &Workspace::for_tests(2).expect("a scratch folder");
    let (store, tiles) = ordered(points, tile, page, workspace);
    let relaxed = relax(&store, tiles, relaxing, workspace).unwrap();
    let shape = relaxed.store.map(|shape| shape.open(workspace).unwrap());
    let shape = shape.unwrap_or(store);
    (shape.slice(0..shape.len()).unwrap(), relaxed.stats)
}

/// Positions after three rounds of smoothing at most, and the counts, in one tile; the same with tiles and pages of
/// other sizes.
fn relaxed_by_tiles(points: &[Point], sizes: &[(u32, usize)]) -> (Vec<Point>, RelaxStats) {
    let (expected, stats) = relaxed(points, 3, 5000, 256);
    for &(tile, page) in sizes {
        let (shape, same) = relaxed(points, 3, tile, page);
        assert_eq!(same, stats, "tiles of {tile}, pages of {page}");
        assert!(shape == expected, "tiles of {tile}, pages of {page}");
    }
    (expected, stats)
}

fn off_plane(points: &[Point]) -> f64 {
    let squares = points.iter().map(|p| f64::from(p[2] - 500).powi(2));
    (squares.sum::<f64>() / points.len() as f64).sqrt()
}

#[test]
fn a_clean_plane_does_not_move() {
    let points = sheet(40, |_, _| 0);
    let (shape, stats) = relaxed(&points, 3, 1000, 256);
    assert_eq!(stats, RelaxStats::default());
    assert_eq!(off_plane(&shape), 0.0);
    let slightly = sheet(40, |_, n| noise(n) / 25);
    assert_eq!(relaxed(&slightly, 3, 1000, 256).1, RelaxStats::default());
}

#[test]
fn a_noisy_plane_gets_flatter_with_every_round() {
    let points = sheet(40, |_, n| noise(n));
    let first = off_plane(&points);
    let mut before = first;
    for rounds in 1..=3 {
        let (shape, stats) = relaxed(&points, rounds, 1000, 256);
        assert_eq!(stats.rounds, rounds);
        let now = off_plane(&shape);
        assert!(now < before, "{now} after {before}");
        before = now;
    }
    assert!(before < 0.3 * first, "{before} of {first}");
}

#[test]
fn edges_stay() {
    // Roofs of slope 45 degrees, eight points from the gutter to the ridge.
    let roof = |x: i32| 100 * (x % 16 - 8).abs();
    let points = sheet(64, |x, _| roof(x));
    let (same, stats) = relaxed(&points, 3, 1000, 256);
    assert_eq!(stats, RelaxStats::default());
    // With noise on them they move, however the points are divided.
    let noisy = sheet(64, |x, n| roof(x) + noise(n));
    let (expected, stats) = relaxed(&noisy, 3, 1000, 256);
    assert!(stats.moved > points.len() as u64 * 9 / 10 && expected != same);
    for (tile, page) in [(100, 16), (333, 64)] {
        assert!(relaxed(&noisy, 3, tile, page) == (expected.clone(), stats));
    }
}

#[test]
fn details_stay_unless_there_is_noise() {
    // Pillars of six by six points of different heights, with sloping tops.
    let pillars = |off: &dyn Fn(i32) -> i32| -> Vec<Point> {
        let pillar = |x: i32, n: i32| 6 * noise(x / 6 + 100 * (n / 96 / 6)) + off(n);
        let slope = |(n, [x, y, z]): (usize, Point)| {
            let n = n as i32;
            let [x, y] = [x + noise(2 * n) / 6, y + noise(3 * n) / 6];
            [x + 100, y + 100, z + (3 * x + 5 * y) / 10]
        };
        let points = sheet(96, pillar).into_iter().enumerate();
        points.map(slope).collect()
    };
    let relaxing = Relaxing {
        neighbors: 30,
        rounds: 1,
        step: 1.0,
    };
    let moved = |points: &[Point]| relaxed_as(points, relaxing, 1000, 256).1.moved as usize;
    assert_eq!(moved(&pillars(&|_| 0)), 0);
    let noisy = pillars(&|n| noise(n) / 4);
    assert!(moved(&noisy) > noisy.len() * 9 / 10);
}

#[test]
fn only_noisy_points_move_and_tiles_do_not_matter() {
    let points = sheet(50, |x, n| if x < 25 { 0 } else { noise(n) });
    let sizes = [(100, 16), (7, 3), (333, 64), (1000, 1)];
    let (expected, stats) = relaxed_by_tiles(&points, &sizes);
    let half = points.len() as u64 / 2;
    assert!(stats.moved > half * 3 / 4 && stats.moved <= half);
    assert!(expected.iter().all(|p| p[0] >= 2500 || p[2] == 500));
}

/// Some points have no noise, but noisy neighbours; they are a tile of their own, or not. Points that others may follow
/// come late where the tile does not know their neighbours.
#[test]
fn points_without_noise_among_noisy_ones_stay_whatever_the_tiles() {
    // Reaches differ, so that some neighbours are not in the tile.
    let mut points = sheet(40, |_, n| noise(n));
    points.extend((0..30).map(|n| [4000 + 170 * n * n, 150 * n, 500 + noise(n)]));
    points.push([1010, 1020, 90_000]);
    let sizes = [(16, 1), (16, 2), (48, 3), (7, 5), (100, 16), (333, 64)];
    let (_, stats) = relaxed_by_tiles(&points, &sizes);
    assert!(stats.rounds == 3 && stats.moved > 1000);
}

#[test]
fn regions_are_divided_anyhow() {
    let in_order = |points: &[Point]| {
        let workspace = &Workspace::for_tests(2).expect("a scratch folder");
        let (store, _) = ordered(points, 1, 256, workspace);
        store.slice(0..store.len()).unwrap()
    };
    // Two regions and a part of a third; the second has no noise.
    let span = METHOD.curve.block as usize;
    let mut points = in_order(&sheet(390, |_, _| 0));
    for (id, point) in points.iter_mut().enumerate() {
        if id / span != 1 {
            point[2] += noise(id as i32);
        }
    }
    let before = in_order(&points);
    let (shape, stats) = relaxed(&points, 2, 1000, 256);
    let moved = before.iter().zip(&shape).filter(|(a, b)| a != b).count();
    assert!(moved > 50_000 && moved <= stats.moved as usize);
    // Pages of 100 do not divide regions.
    let (same, same_stats) = relaxed(&points, 2, 1000, 100);
    assert_eq!(stats, same_stats);
    assert!(shape == same);
}

/// A bird over a plane, and one over a noisy plane, stay where they are.
#[test]
fn outliers_stay() {
    for amplitude in [0, 1] {
        let mut points = sheet(40, |_, n| amplitude * noise(n));
        let bird = [2010, 2020, 3500];
        points.push(bird);
        let (shape, stats) = relaxed(&points, 3, 1000, 256);
        assert!(shape.contains(&bird));
        assert_eq!(stats.moved > 0, amplitude > 0);
    }
}

/// Positions before and after a round of smoothing with 18 neighbours.
fn smoothed(
    points: &[Point],
    smoothing: Smoothing,
    tile: u32,
    page: usize,
) -> (Vec<Point>, Vec<Point>) {
    let workspace = &Workspace::for_tests(2).expect("a scratch folder");
    let (store, tiles) = ordered(points, tile, page, workspace);
    let after = smooth(&store, tiles, 18, smoothing, 1, workspace).unwrap();
    let after = after.open(workspace).unwrap();
    let all = |store: &PointStore| store.slice(0..store.len()).unwrap();
    (all(&store), all(&after))
}

const BOTH: [Smoothing; 2] = [Smoothing::Plain, Smoothing::Edges];

#[test]
fn planes_stay_where_they_are() {
    // A plane, in the xy plane and spanned by (2, 1, 2) and (-2, 2, 1).
    let level = sheet(40, |_, _| 0);
    let tilted = |n: i32| {
        let (a, b) = (1000 * (n % 40), 1000 * (n / 40) + 17 * (n % 7));
        [2 * a - 2 * b + 200_000, a + 2 * b, 2 * a + b]
    };
    let tilted: Vec<Point> = (0..1600).map(tilted).collect();
    for points in [level, tilted] {
        for smoothing in BOTH {
            let (before, after) = smoothed(&points, smoothing, 1000, 256);
            assert!(before == after, "{smoothing:?}");
        }
    }
}

/// Root mean square of `off` over the points that are `near`.
fn off(
    points: &[(Point, Point)],
    near: impl Fn(&Point) -> bool,
    off: impl Fn(&Point) -> f64,
) -> f64 {
    let squares = points.iter().filter(|(before, _)| near(before));
    let squares: Vec<f64> = squares.map(|(_, after)| off(after).powi(2)).collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

#[test]
fn a_noisy_edge_of_a_cube_stays_sharper() {
    // Two faces of 40 by 20 spacings of 1000 steps, meeting at right angles along z; noise of a tenth of a
    // spacing.
    let face = |n: i32| {
        let (z, far, up) = (1000 * (n % 40), 1000 * (n / 40) + 250, 5000 + noise(n));
        [[5000 + far, up, z], [up, 5000 + far, z]][n as usize % 2]
    };
    let points: Vec<Point> = (0..800).map(face).collect();
    let faces = |p: &Point| f64::from((p[0] - 5000).min(p[1] - 5000));
    let [plain, edges] = BOTH.map(|smoothing| {
        let (before, after) = smoothed(&points, smoothing, 1000, 256);
        let pairs: Vec<_> = before.into_iter().zip(after).collect();
        let at_edge = |p: &Point| p[0].max(p[1]) < 7000;
        (
            off(&pairs, at_edge, faces),
            off(&pairs, |p| !at_edge(p), faces),
        )
    });
    assert!(edges.0 < 0.6 * plain.0, "at the edge {edges:?} {plain:?}");
    // Before smoothing it is 58.
    assert!(edges.1 < 40.0, "on the faces {edges:?} {plain:?}");
}

#[test]
fn a_noisy_sphere_shrinks_less() {
    // Along a spiral with even spacing.
    let (count, radius) = (2000, 100_000.0);
    let at = |n: i32| {
        let z = 1.0 - (2.0 * f64::from(n) + 1.0) / f64::from(count);
        let (angle, r) = (
            2.399_963 * f64::from(n),
            radius + 20.0 * f64::from(noise(n)),
        );
        let flat = (1.0 - z * z).sqrt();
        [flat * angle.cos(), flat * angle.sin(), z].map(|c| (200_000.0 + r * c) as i32)
    };
    let points: Vec<Point> = (0..count).map(at).collect();
    let mean = |points: &[Point]| {
        let length = |p: &Point| {
            let squares = p.map(|c| f64::from(c - 200_000).powi(2));
            squares.iter().sum::<f64>().sqrt()
        };
        points.iter().map(length).sum::<f64>() / points.len() as f64
    };
    let [plain, edges] = BOTH.map(|smoothing| {
        let (before, after) = smoothed(&points, smoothing, 1000, 256);
        mean(&before) - mean(&after)
    });
    assert!(plain > 0.0 && edges.abs() < 0.25 * plain, "{edges} {plain}");
}

#[test]
fn smoothing_does_not_depend_on_tiles() {
    let points = sheet(50, |x, n| if x < 25 { 0 } else { noise(n) });
    for smoothing in BOTH {
        let expected = smoothed(&points, smoothing, 1000, 256).1;
        for (tile, page) in [(100, 16), (7, 3), (333, 64), (1000, 1)] {
            let found = smoothed(&points, smoothing, tile, page).1;
            assert!(found == expected, "tiles of {tile}, pages of {page}");
        }
    }
}
