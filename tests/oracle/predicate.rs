//! The exact corner test of `paper::predicate` against power diagrams with real, tiny weights, and the clipped
//! cells of `paper::clip` against all corners that no neighbour cuts off.

use crate::reference::big::{Big, Big3, determinant, dot, vector};
use crate::reference::clouds::{self, Random};
use outcrop_geom::{Point, sub};
use outcrop_paper::clip::Cell;
use outcrop_paper::predicate::{Neighbor, cuts_corner, turn};

/// The numbers below need 2100 bits.
type Wide = Big<40>;

/// Weights are multiples of `2^-SCALE`.
const SCALE: usize = 1000;
/// The weights of successive ids differ by a factor of 2 to this power. Without weights, integers of less
/// than 180 bits are compared.
const GAP: usize = 240;

/// `2^SCALE` times the weight of `id`, if only these four ids occur.
fn weight(id: u32, ids: [u32; 4]) -> Wide {
    let rank = ids.iter().filter(|other| **other < id).count();
    Wide::power_of_two(SCALE - GAP * (rank + 1))
}

/// True if `c` cuts off the corner of `a` and `b`, by the definition: the corner is the point of the plane
/// with equal power to the cell's point, `a` and `b`, found by Cramer's rule; it is cut off if its power with
/// respect to `c` is less. `None` if there is no corner.
fn oracle(n: [i32; 3], own: u32, a: Neighbor, b: Neighbor, c: Neighbor) -> Option<bool> {
    let ids = [own, a.id, b.id, c.id];
    let scale = Wide::power_of_two(SCALE);
    let two = Wide::from(2i64);
    // n·q = 0, 2 a·q = |a|² + w_own − w_a, 2 b·q = |b|² + w_own − w_b.
    let row = |p: Neighbor| vector::<40, i64>(p.difference).map(|x| two * x);
    let right = |p: Neighbor| {
        let p2 = vector::<40, i64>(p.difference);
        scale * dot(p2, p2) + weight(own, ids) - weight(p.id, ids)
    };
    let rows = [vector::<40, i64>(n.map(i64::from)), row(a), row(b)];
    let rights = [Wide::ZERO, right(a), right(b)];
    let d = determinant(rows);
    if d.sign() == 0 {
        return None;
    }
    let corner: Big3<40> = std::array::from_fn(|column| {
        let mut replaced = rows;
        for k in 0..3 {
            replaced[k][column] = rights[k];
        }
        determinant(replaced)
    });
    // The corner is `corner / (d scale)`; powers are multiplied by `(d scale)²`.
    let unit = d * scale;
    let power = |p: [i64; 3], id: u32| {
        let p: Big3<40> = vector(p);
        let away: Big3<40> = std::array::from_fn(|k| corner[k] - unit * p[k]);
        dot(away, away) - scale * d * d * weight(id, ids)
    };
    Some(power(c.difference, c.id) < power([0; 3], own))
}

/// Tries all choices of four of the points as a cell, two lines of a corner, and a third line.
fn compare(points: &[Point], ids: &[u32], n: [i32; 3]) -> (usize, usize) {
    let (mut compared, mut cut) = (0, 0);
    for own in 0..points.len() {
        let neighbor = |k: usize| Neighbor {
            difference: sub(points[k], points[own]),
            id: ids[k],
        };
        for a in 0..points.len() {
            for b in 0..points.len() {
                for c in 0..points.len() {
                    let different = own != a && own != b && own != c && a != b && b != c && a != c;
                    if !different {
                        continue;
                    }
                    let (a, b, c) = (neighbor(a), neighbor(b), neighbor(c));
                    let expected = oracle(n, ids[own], a, b, c);
                    let exists = turn(n, a.difference, b.difference) != 0;
                    assert_eq!(exists, expected.is_some());
                    if let Some(expected) = expected {
                        let got = cuts_corner(n, ids[own], a, b, c);
                        assert_eq!(got, expected, "{n:?} {} {a:?} {b:?} {c:?}", ids[own]);
                        compared += 1;
                        cut += usize::from(got);
                    }
                }
            }
        }
    }
    (compared, cut)
}

/// Distinct ids in random order.
fn ids(random: &mut Random, count: usize) -> Vec<u32> {
    let mut ids: Vec<u32> = (0..count as u32).map(|k| 7 * k).collect();
    for k in (1..count).rev() {
        ids.swap(k, random.integer(0, k as i64 + 1) as usize);
    }
    ids
}

fn different(mut points: Vec<Point>) -> Vec<Point> {
    points.sort_unstable();
    points.dedup();
    points
}

const NORMALS: [[i32; 3]; 6] = [
    [0, 0, 1 << 24],
    [1 << 24, 0, 0],
    [1, -2, 2],
    [11_184_811, -11_184_811, 5_592_405],
    [16_000_000, 3, -5_046_171],
    [-9_686_330, 9_686_330, 9_686_330],
];

#[test]
fn corners_of_nasty_clouds_agree_with_tiny_weights() {
    let mut random = Random::new(11);
    let (mut compared, mut cut) = (0, 0);
    for kind in 0..clouds::KINDS.len() {
        for (round, n) in NORMALS.into_iter().enumerate() {
            let points = different(clouds::cloud(kind, 5, round as u64));
            let points = &points[..points.len().min(5)];
            let ids = ids(&mut random, points.len());
            let (more, more_cut) = compare(points, &ids, n);
            (compared, cut) = (compared + more, cut + more_cut);
        }
    }
    assert!(
        cut > compared / 10 && cut < compared * 9 / 10 && compared > 5000,
        "{cut}/{compared}"
    );
}

#[test]
fn corners_in_a_tiny_box_agree_with_tiny_weights() {
    let mut random = Random::new(5);
    for round in 0..150 {
        let side = [
            random.integer(2, 4),
            random.integer(2, 4),
            random.integer(1, 4),
        ];
        let point = |r: &mut Random| side.map(|s| r.integer(0, s) as i32);
        let mut points = different((0..8).map(|_| point(&mut random)).collect());
        points.truncate(4);
        let n = match round % 2 {
            0 => NORMALS[round / 2 % NORMALS.len()],
            _ => std::array::from_fn(|_| random.integer(-2, 3) as i32),
        };
        let ids = ids(&mut random, points.len());
        compare(&points, &ids, n);
    }
}

/// Squared distance, within rounding, of the corner of `a` and `b` from the cell's point.
fn reach2(n: [i32; 3], a: Neighbor, b: Neighbor) -> f64 {
    let two = Wide::from(2i64);
    let row = |p: Neighbor| vector::<40, i64>(p.difference);
    let rows = [vector::<40, i64>(n.map(i64::from)), row(a), row(b)];
    let right = |p: Neighbor| dot(row(p), row(p));
    let d = (two * determinant(rows)).approximate();
    let at: [f64; 3] = std::array::from_fn(|column| {
        let mut replaced = rows;
        let rights = [Wide::ZERO, right(a), right(b)];
        for k in 0..3 {
            replaced[k][column] = rights[k];
        }
        determinant(replaced).approximate() / d
    });
    at.iter().map(|x| x * x).sum()
}

/// Corners well inside the disk must be in the cell exactly if no neighbour cuts them off, corners beyond its
/// rim never.
#[test]
fn cells_have_the_corners_that_nobody_cuts_off() {
    let mut corners = 0;
    for kind in 0..clouds::KINDS.len() {
        for (round, n) in NORMALS.into_iter().enumerate() {
            let points = different(clouds::cloud(kind, 16, 100 + round as u64));
            let own = round % points.len();
            let mut others: Vec<Neighbor> = (0..points.len())
                .filter(|&k| k != own)
                .map(|k| Neighbor {
                    difference: sub(points[k], points[own]),
                    id: k as u32,
                })
                .collect();
            let length2 = |p: &Neighbor| p.difference.iter().map(|x| x * x).sum::<i64>();
            others.sort_by_key(|p| (length2(p), p.id));
            let radius = (length2(&others[others.len() / 2]) as f64).sqrt();
            let mut cell = Cell::new(own as u32, n, radius);
            others.iter().for_each(|p| cell.clip(p.difference, p.id));
            let mut seen = Vec::new();
            cell.triples(|a, b| seen.push([a.min(b), a.max(b)]));
            seen.sort_unstable();
            assert!(seen.is_sorted_by(|a, b| a < b), "a corner twice");
            for (k, &a) in others.iter().enumerate() {
                for &b in &others[k + 1..] {
                    let has = seen.contains(&[a.id.min(b.id), a.id.max(b.id)]);
                    let expected = turn(n, a.difference, b.difference) != 0
                        && others
                            .iter()
                            .filter(|c| c.id != a.id && c.id != b.id)
                            .all(|&c| oracle(n, own as u32, a, b, c) == Some(false));
                    let reach = if expected {
                        reach2(n, a, b).sqrt() / radius
                    } else {
                        0.0
                    };
                    // A decagon lies between circles of 0.951 and 1 times its radius.
                    if reach < 0.95 {
                        assert_eq!(
                            has,
                            expected,
                            "{} {n:?} {own} {a:?} {b:?}",
                            clouds::KINDS[kind].0
                        );
                        corners += usize::from(has);
                    } else if reach > 1.000_001 {
                        assert!(!has, "{} beyond the rim", clouds::KINDS[kind].0);
                    }
                }
            }
        }
    }
    assert!(corners > 300, "{corners}");
}
