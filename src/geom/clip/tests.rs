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

proptest! {
    /// Corners found by clipping are those that no other bisector cuts off, decided exactly.
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
        // A disk so large that every bounded corner is inside.
        let mut cell = Cell::new(0, normal, 1e7);
        for p in &all { cell.clip(p.difference, p.id); }
        let mut expected = Vec::new();
        for (x, &a) in all.iter().enumerate() {
            for &b in &all[x + 1..] {
                if crate::geom::predicate::turn(normal, a.difference, b.difference) == 0 {
                    continue;
                }
                let kept = all.iter().filter(|c| c.id != a.id && c.id != b.id)
                    .all(|&c| !cuts_corner(normal, 0, a, b, c));
                if kept { expected.push((a.id, b.id)); }
            }
        }
        expected.sort_unstable();
        prop_assert_eq!(seen(&cell), expected);
    }
}
