//! Tests: a cell of many corners equals the cell found by testing all corners.

use super::*;
use crate::plane::Normal;
use proptest::prelude::*;
use std::f64::consts::TAU;

type Difference = [i64; 3];

fn seen(cell: &Cell) -> Vec<(u32, u32)> {
    let mut all = Vec::new();
    cell.triples(|a, b| all.push((a.min(b), a.max(b))));
    all.sort_unstable();
    all
}

/// Points on part of a circle, at about the same distance.
fn ring(count: usize, radius: f64, part: f64, noise: f64) -> Vec<Difference> {
    let at = |k: usize| {
        let (sin, cos) = (TAU * part * k as f64 / count as f64).sin_cos();
        // Deterministic noise.
        let radius = radius + noise * ((k * k + 7 * k) as f64).sin();
        [(cos * radius) as i64, (sin * radius) as i64, 0]
    };
    (0..count).map(at).collect()
}

fn small(most: i64) -> impl Strategy<Value = Difference> {
    prop::array::uniform3(-most..=most)
}

/// Circles and arcs (with ties or with noise), grids and arbitrary points, on a plane or near it.
fn clouds() -> impl Strategy<Value = Vec<Difference>> {
    let rings = (3usize..150, 1.0f64..1e6, 0.1f64..1.0, 0.0f64..3.0)
        .prop_map(|(count, radius, part, noise)| ring(count, radius, part, noise));
    let mixed = (rings, prop::collection::vec(small(40), 0..60))
        .prop_map(|(ring, others)| [ring, others].concat());
    prop_oneof![
        4 => mixed,
        1 => prop::collection::vec(small(6), 3..150),
        1 => prop::collection::vec(small(1 << 29), 3..150),
        1 => prop::collection::vec((-20i64..20, -20i64..20).prop_map(|(x, y)| [x, y, 0]), 3..150),
    ]
}

fn normals() -> impl Strategy<Value = Normal> {
    let any = prop::array::uniform3(-3i32..=3).prop_filter("some direction", |n| *n != [0; 3]);
    prop_oneof![
        3 => Just([0, 0, 1 << 24]),
        1 => any.prop_map(|n| n.map(|x| x << 22)),
        1 => (-9i32..9, -9i32..9).prop_map(|(x, y)| [x, y, 1 << 24]),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]
    #[test]
    fn many_corners_are_those_of_a_look_at_all(
        points in clouds(),
        normal in normals(),
        // A disk smaller than the point set, of about its size, or far larger.
        radius in prop_oneof![1.0f64..100.0, 1e3f64..1e6, Just(1e10)],
        shuffled in any::<bool>(),
        most in 4usize..40,
        boxes in prop::collection::vec((small(1 << 20), 0i64..1 << 20), 8),
        shift in 0u32..20,
    ) {
        let mut points: Vec<_> = points.into_iter().zip(1..).collect();
        if shuffled {
            points.sort_by_key(|(_, id): &(_, u32)| id.wrapping_mul(0x9e37_79b1));
        } else {
            points.sort_by_key(|(p, id)| (p.iter().map(|x| x * x).sum::<i64>(), *id));
        }
        let mut plain = Cell::new(50, normal, radius);
        plain.most = usize::MAX;
        let mut many = Cell::new(50, normal, radius);
        many.most = most;
        for &(point, id) in &points {
            plain.clip(point, id);
            many.clip(point, id);
            prop_assert_eq!(plain.count, many.count);
            prop_assert_eq!(plain.reach2.to_bits(), many.reach2.to_bits());
            prop_assert_eq!(plain.hidden, many.hidden);
        }
        prop_assert_eq!(seen(&plain), seen(&many));
        for (low, side) in boxes {
            let low = low.map(|c| (c >> shift) as f64);
            let high = low.map(|c| c + (side >> shift) as f64);
            prop_assert!(many.may_touch(low, high) || !plain.may_touch(low, high));
            prop_assert_eq!(plain.spheres().meet(low, high), plain.may_touch(low, high));
        }
        // Memory is reused for the next cell.
        many.start(50, normal, radius);
        plain.start(50, normal, radius);
        for &(point, id) in points.iter().take(20) {
            plain.clip(point, id);
            many.clip(point, id);
        }
        prop_assert_eq!(seen(&plain), seen(&many));
    }
}

/// Mean number of corners tested for a bisector, while a cell reaches as many corners as there are points.
fn looks(points: &[Difference], radius: f64, corners: std::ops::RangeInclusive<usize>) -> f64 {
    let mut cell = Cell::new(0, [0, 0, 1 << 24], radius);
    for (point, id) in points.iter().zip(1..) {
        cell.clip(*point, id);
    }
    assert!(corners.contains(&cell.count), "{} corners", cell.count);
    assert!(!cell.unsure);
    cell.looks as f64 / points.len() as f64
}

/// Quadratic time would be thousands of tests for a bisector.
#[test]
fn the_centre_of_a_circle_looks_at_few_corners() {
    const COUNT: usize = 30_000;
    for part in [1.0, 0.3] {
        let turned = ring(COUNT, 5e8, part, 0.0);
        let shuffled: Vec<_> = (0..COUNT).map(|k| turned[k * 7919 % COUNT]).collect();
        for points in [&turned, &shuffled] {
            let looks = looks(points, 1e9, COUNT / 2..=COUNT + 10);
            assert!(looks < 20.0, "{looks}");
        }
    }
    // Most of many sides are cut off again.
    let outer = ring(COUNT, 5e8, 1.0, 0.0);
    let inner = ring(COUNT, 4.9e8, 1.0, 0.0);
    let looks = looks(&[outer, inner].concat(), 1e9, COUNT..=COUNT);
    assert!(looks < 20.0, "{looks}");
}

#[test]
fn few_boxes_are_compared_with_all_spheres() {
    let mut cell = Cell::new(0, [0, 0, 1 << 24], 1e9);
    for (point, id) in ring(10_000, 5e8, 1.0, 0.0).iter().zip(1..) {
        cell.clip(*point, id);
    }
    let many = cell.many.as_ref().expect("many corners");
    let balls = Balls::of(&cell);
    assert!(balls.levels[0].len() <= 1 + 10_000 / FAN);
    assert_eq!(balls.levels.last().map(Vec::len), Some(1));
    assert!(!many.may_touch(&cell, [6e8; 3], [7e8; 3]));
    assert!(many.may_touch(&cell, [3e8, 0.0, -1.0], [4e8, 1e8, 1.0]));
}
