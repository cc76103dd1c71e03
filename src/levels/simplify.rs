//! Simplification of tiles. The result has vertices of the given ones only, and is the same on every machine.

use super::contract::Mesh;
use super::quadric::{Quadric, V3, minus, of_triangles};
use rustc_hash::FxHashSet;

/// A mesh to simplify.
#[derive(Debug, Clone, Copy)]
pub(super) struct Surface<'a> {
    /// Positions of the vertices.
    pub points: &'a [V3],
    /// Corners of the triangles.
    pub triangles: &'a [[u32; 3]],
    /// For each vertex whether it must stay.
    pub locked: &'a [bool],
}

/// A way to simplify to about this number of triangles, or as few as can be.
pub(super) type Manner = fn(Surface<'_>, usize) -> Vec<[u32; 3]>;

/// Contracts edges: the surface stays connected as it is, but small components may go.
pub(super) fn careful(surface: Surface<'_>, target: usize) -> Vec<[u32; 3]> {
    let mut mesh = Mesh::new(surface);
    mesh.contract(target);
    mesh.triangles
}

/// Most cells of a grid along a side.
const CELLS: u32 = 1 << 20;

/// The cells of a grid: one for each locked vertex, and cubes for all others, `count` of them along the longest side.
fn cells(surface: Surface<'_>, count: u32) -> Vec<u64> {
    let fold = |start: f64, least: fn(f64, f64) -> f64| {
        let points = surface.points.iter();
        points.fold([start; 3], |ends, p| {
            [0, 1, 2].map(|k| least(ends[k], p[k]))
        })
    };
    let (low, high) = (fold(f64::MAX, f64::min), fold(f64::MIN, f64::max));
    let longest = minus(high, low).into_iter().fold(0.0, f64::max);
    let scale = f64::from(count) / longest.max(f64::MIN_POSITIVE);
    let cell = |(number, p): (usize, &V3)| match surface.locked[number] {
        true => 1 << 63 | number as u64,
        false => minus(*p, low).into_iter().fold(0, |cell, x| {
            cell << 21 | ((x * scale) as u64).min(u64::from(count - 1))
        }),
    };
    surface.points.iter().enumerate().map(cell).collect()
}

fn is_whole<T: PartialEq>([a, b, c]: [T; 3]) -> bool {
    a != b && b != c && c != a
}

/// Joins the vertices in each cell of a grid, the finest by which there are few enough triangles: parts may grow
/// together, and small ones go.
pub(super) fn coarse(surface: Surface<'_>, target: usize) -> Vec<[u32; 3]> {
    let (mut few, mut many) = (1, CELLS);
    while many - few > 1 {
        let middle = few + (many - few) / 2;
        let cells = cells(surface, middle);
        let whole = surface
            .triangles
            .iter()
            .map(|t| t.map(|v| cells[v as usize]));
        match whole.filter(|t| is_whole(*t)).count() <= target {
            true => few = middle,
            false => many = middle,
        }
    }
    let joined = joined(surface, &cells(surface, few));
    match joined.is_empty() {
        // Something is left to show.
        true => self::joined(surface, &cells(surface, many)),
        false => joined,
    }
}

/// The triangles that are left if the vertices in each cell are joined.
fn joined(surface: Surface<'_>, cells: &[u64]) -> Vec<[u32; 3]> {
    let chosen = chosen(surface, cells);
    let mut known = FxHashSet::default();
    let joined = surface
        .triangles
        .iter()
        .map(|t| t.map(|v| chosen[v as usize]));
    joined
        .filter(|t| {
            let mut turned = *t;
            let first = (0..3).min_by_key(|n| t[*n]).unwrap_or(0);
            turned.rotate_left(first);
            is_whole(*t) && known.insert(turned)
        })
        .collect()
}

/// For each vertex that of its cell which is nearest to the planes of all triangles there.
fn chosen(surface: Surface<'_>, cells: &[u64]) -> Vec<u32> {
    let quadrics = of_triangles(surface.points, surface.triangles);
    let mut order: Vec<u32> = (0..surface.points.len() as u32).collect();
    order.sort_unstable_by_key(|v| (cells[*v as usize], *v));
    let mut chosen = vec![0; order.len()];
    for same in order.chunk_by(|v, w| cells[*v as usize] == cells[*w as usize]) {
        let about = surface.points[same[0] as usize];
        let away = |v: u32| minus(surface.points[v as usize], about);
        let sum = same.iter().fold(Quadric::default(), |sum, v| {
            let back = away(*v).map(|x| -x);
            sum.plus(&quadrics[*v as usize].moved(back))
        });
        let mut best = (f64::INFINITY, same[0]);
        for v in same.iter().filter(|v| quadrics[**v as usize].area > 0.0) {
            let value = sum.at(away(*v));
            if value < best.0 {
                best = (value, *v);
            }
        }
        same.iter().for_each(|v| chosen[*v as usize] = best.1);
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A wavy grid of `side` squares along each side, with its rim locked.
    fn grid(side: u32) -> (Vec<V3>, Vec<[u32; 3]>, Vec<bool>) {
        let row = side + 1;
        let places = (0..row * row).map(|n| (n % row, n / row));
        let point = |(x, y): (u32, u32)| [x.into(), y.into(), f64::from(x * y % 5) / 50.0];
        let is_rim = |(x, y): (u32, u32)| x % side == 0 || y % side == 0;
        let squares = (0..side * side).map(|n| n / side * row + n % side);
        let halves = squares.flat_map(|a| [[a, a + 1, a + row], [a + 1, a + row + 1, a + row]]);
        (
            places.clone().map(point).collect(),
            halves.collect(),
            places.map(is_rim).collect(),
        )
    }

    #[test]
    fn few_triangles_are_left_and_the_rim_stays() {
        let (points, triangles, locked) = grid(40);
        let surface = Surface {
            points: &points,
            triangles: &triangles,
            locked: &locked,
        };
        let rim = locked.iter().filter(|locked| **locked).count();
        for (manner, target) in [(careful as Manner, 600), (coarse as Manner, 600)] {
            let left = manner(surface, target);
            assert!(
                left.len() <= target && left.len() > target / 3,
                "{}",
                left.len()
            );
            let corners: FxHashSet<u32> = left.iter().flatten().copied().collect();
            assert!(corners.len() > rim / 2);
            assert_eq!(left, manner(surface, target));
        }
        let left = careful(surface, 600);
        let corners: FxHashSet<u32> = left.iter().flatten().copied().collect();
        assert!((0..points.len()).all(|v| !locked[v] || corners.contains(&(v as u32))));
        // No triangle is upside down, and all together cover the square.
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| points[v as usize]);
            let (p, q) = (minus(b, a), minus(c, a));
            (p[0] * q[1] - p[1] * q[0]) / 2.0
        };
        assert!(left.iter().all(|t| area(t) > 0.0));
        assert_eq!(left.iter().map(area).sum::<f64>(), 1600.0);
    }

    #[test]
    fn triangles_without_neighbours_go_the_small_ones_first() {
        let triangles: Vec<[u32; 3]> = (0..50).map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect();
        let point = |n: u32| {
            let size = f64::from(n / 3 + 1);
            [
                f64::from(n / 3) * 200.0 + if n % 3 == 1 { size } else { 0.0 },
                if n % 3 == 2 { size } else { 0.0 },
                0.0,
            ]
        };
        let points: Vec<V3> = (0..150).map(point).collect();
        let surface = Surface {
            points: &points,
            triangles: &triangles,
            locked: &[false; 150],
        };
        let left = careful(surface, 10);
        assert!(
            left.len() <= 10 && left.contains(&triangles[49]),
            "{left:?}"
        );
    }

    proptest! {
        /// Whatever the triangles are, those that are left have corners of them, and locked corners stay.
        #[test]
        fn any_triangles_can_be_simplified(
            places in prop::collection::vec(([-5i8..5, -5i8..5, -5i8..5], any::<bool>()), 3..40),
            corners in prop::collection::vec([0u32..1000, 0u32..1000, 0u32..1000], 0..120),
            target in 0usize..60,
        ) {
            let count = places.len() as u32;
            let points: Vec<V3> = places.iter().map(|(p, _)| p.map(f64::from)).collect();
            let locked: Vec<bool> = places.iter().map(|(_, locked)| *locked).collect();
            let triangles: Vec<[u32; 3]> = corners.iter().map(|t| t.map(|v| v % count)).collect();
            let surface = Surface { points: &points, triangles: &triangles, locked: &locked };
            let whole: Vec<_> = triangles.iter().filter(|t| is_whole(**t)).collect();
            let used: FxHashSet<u32> = whole.iter().copied().flatten().copied().collect();
            let left = careful(surface, target);
            let kept: FxHashSet<u32> = left.iter().flatten().copied().collect();
            prop_assert!(left.len() <= whole.len() && kept.is_subset(&used));
            prop_assert!(used.iter().all(|v| !locked[*v as usize] || kept.contains(v)));
            let left = coarse(surface, target);
            let kept: FxHashSet<u32> = left.iter().flatten().copied().collect();
            prop_assert!(left.len() <= whole.len() && kept.is_subset(&used));
            let mut ordered = crate::order::of(points.len(), &triangles);
            let mut sorted = triangles.clone();
            ordered.sort_unstable();
            sorted.sort_unstable();
            prop_assert_eq!(ordered, sorted);
        }
    }
}
