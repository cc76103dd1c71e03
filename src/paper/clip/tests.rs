use super::*;
use proptest::prelude::*;

const UP: Normal = [0, 0, 1 << 24];

fn seen(cell: &Cell) -> Vec<(u32, u32)> {
    let mut all = Vec::new();
    cell.triples(|a, b| all.push((a.min(b), a.max(b))));
    all.sort_unstable();
    all
}

#[test]
fn a_square_grid_gives_one_cell_of_four_sides() {
    let mut cell = Cell::new(0, UP, 50.0);
    for (id, d) in [
        (1, [10, 0, 0]),
        (2, [0, 10, 0]),
        (3, [-10, 0, 0]),
        (4, [0, -10, 0]),
    ] {
        cell.clip(d, id);
    }
    assert_eq!(seen(&cell), [(1, 2), (1, 4), (2, 3), (3, 4)]);
    assert!((200..=202).contains(&cell.reach2()), "{}", cell.reach2());
}

#[test]
fn a_point_straight_above_changes_nothing() {
    let mut cell = Cell::new(0, UP, 50.0);
    let before = cell.reach2();
    cell.clip([0, 0, 3], 1);
    assert_eq!(cell.reach2(), before);
}

#[test]
fn of_two_points_in_one_place_the_lower_id_has_the_cell() {
    let mut cell = Cell::new(5, UP, 50.0);
    cell.clip([0, 0, 0], 7);
    assert!(!cell.hidden);
    cell.clip([0, 0, 0], 2);
    assert!(cell.hidden);
}

/// Points around a circle of `radius`, slightly inside a regular polygon of `count` corners.
fn around(count: u32, radius: f64, first: u32) -> Vec<([i64; 3], u32)> {
    let at = |k: u32| {
        let angle = f64::from(k) / f64::from(count) * std::f64::consts::TAU;
        let along = [angle.cos(), angle.sin()].map(|x| (x * radius) as i64);
        ([along[0], along[1], 0], first + k)
    };
    (0..count).map(at).collect()
}

#[test]
fn a_polygon_of_hundreds_of_corners_and_a_cut_through_most_of_them() {
    let outer = around(300, 1e6, 1);
    let inner = around(5, 0.7e6, 1001);
    for level in Level::all() {
        let mut cell = Cell::new(0, UP, 1e7);
        cell.level = level;
        for &(difference, id) in &outer {
            cell.clip(difference, id);
        }
        let ring: Vec<_> = (1..300).map(|k| (k, k + 1)).collect();
        let all = seen(&cell);
        assert_eq!(all.len(), 300);
        assert!(ring.iter().all(|pair| all.contains(pair)) && all.contains(&(1, 300)));
        // Clipping by a pentagon inside leaves only the five corners between its own sides.
        for &(difference, id) in &inner {
            cell.clip(difference, id);
        }
        assert_eq!(
            seen(&cell),
            [
                (1001, 1002),
                (1001, 1005),
                (1002, 1003),
                (1003, 1004),
                (1004, 1005)
            ]
        );
    }
}

proptest! {
    /// The corners found by clipping are exactly those that no other bisector cuts off.
    #[test]
    fn corners_are_those_nobody_cuts_off(
        points in prop::collection::hash_set(prop::array::uniform3(-6i64..=6), 3..14),
        n in prop::array::uniform3(-3i32..=3),
    ) {
        prop_assume!(n != [0; 3]);
        let normal = n.map(|x| x << 20);
        let mut points: Vec<_> = points.into_iter().filter(|p| *p != [0; 3]).collect();
        points.sort_by_key(|p| (p.iter().map(|x| x * x).sum::<i64>(), *p));
        let all: Vec<_> = points.iter().enumerate()
            .map(|(i, &difference)| Neighbor { difference, id: i as u32 + 1 }).collect();
        let mut expected = Vec::new();
        for (x, &a) in all.iter().enumerate() {
            for &b in &all[x + 1..] {
                if crate::predicate::turn(normal, a.difference, b.difference) == 0 {
                    continue;
                }
                let kept = all.iter().filter(|c| c.id != a.id && c.id != b.id)
                    .all(|&c| !cuts_corner(normal, 0, a, b, c));
                if kept { expected.push((a.id, b.id)); }
            }
        }
        expected.sort_unstable();
        for level in Level::all() {
            // A disk so large that it contains every bounded corner.
            let mut cell = Cell::new(0, normal, 1e7);
            cell.level = level;
            all.iter().for_each(|p| cell.clip(p.difference, p.id));
            prop_assert_eq!(seen(&cell), &expected[..]);
        }
    }
}
