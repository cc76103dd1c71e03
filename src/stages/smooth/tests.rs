//! Relaxing on sheets.

use super::*;
use crate::stages::blocks::Blocks;
use crate::stages::order::Orderer;
use crate::workspace::memory::{MINIMUM_BUDGET, MemoryPool};
use crate::workspace::progress::{Cancel, Silent};
use std::sync::Arc;

fn workspace() -> Workspace {
    let memory = MemoryPool::new(MINIMUM_BUDGET).unwrap();
    let folder = std::env::temp_dir();
    Workspace::new(&folder, memory, 2, Arc::new(Silent), Cancel::new()).unwrap()
}

/// A square sheet of `side * side` points, a hundred steps apart, `high` off its plane at `x`.
fn sheet(side: i32, high: impl Fn(i32, i32) -> i32) -> Vec<Point> {
    let at = |n: i32| [100 * (n % side), 100 * (n / side), 500 + high(n % side, n)];
    (0..side * side).map(at).collect()
}

/// As noise: from -100 to 100 in no order.
fn noise(n: i32) -> i32 {
    let n = (n as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    ((n ^ n >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 40) as i32 % 201 - 100
}

/// Positions after relaxing with tiles and pages of these sizes, and what was done.
fn relaxed(points: &[Point], rounds: u32, tile: u32, page: usize) -> (Vec<Point>, RelaxStats) {
    let workspace = &workspace();
    let orderer = Orderer::new(workspace).unwrap();
    orderer.push(workspace, points).unwrap();
    let store = orderer.finish(workspace, page).unwrap().0;
    let tiles = TileRanges::new(Blocks::new(store.len(), 1000), tile);
    let relaxed = relax(&store, tiles, 12, rounds, workspace).unwrap();
    let shape = relaxed.store.as_ref().unwrap_or(&store);
    (shape.slice(0..store.len()).unwrap(), relaxed.stats)
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
        // After two rounds hardly a point is rough any more.
        assert_eq!(stats.rounds, rounds.min(2));
        let now = off_plane(&shape);
        assert!(
            if rounds > 2 {
                now == before
            } else {
                now < before
            },
            "{now} after {before}"
        );
        before = now;
    }
    assert!(before < 0.3 * first, "{before} of {first}");
}

#[test]
fn only_rough_patches_move_and_tiles_do_not_matter() {
    let points = sheet(50, |x, n| if x < 25 { 0 } else { noise(n) });
    let (expected, stats) = relaxed(&points, 3, 1000, 256);
    assert!(stats.moved > 0 && stats.moved < 3 * points.len() as u64);
    for (tile, page) in [(100, 16), (7, 3), (333, 64), (1000, 1)] {
        let (shape, same) = relaxed(&points, 3, tile, page);
        assert_eq!(same, stats, "tiles of {tile}, pages of {page}");
        assert!(shape == expected, "tiles of {tile}, pages of {page}");
    }
}
