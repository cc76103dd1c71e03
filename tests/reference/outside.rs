//! Which side is out, where it is known without the surface (sections 1.5 and 6.3).

use super::patches::unit_normal;
use super::surface::Triangle;
use outcrop_geom::Point;
use std::collections::{BTreeMap, BTreeSet};

/// The place of a scanner on the lattice.
pub type Scanner = [i64; 3];

/// `--facing`; without scanners `Auto` is also up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Facing {
    #[default]
    Auto,
    Out,
    In,
    /// A position on the lattice.
    At([i64; 3]),
}

/// What is known of a point, so that it does not face up even if it is highest.
#[derive(Debug, Clone, Copy)]
pub enum Known {
    /// It faces a scanner, or the position of `--facing`.
    Place([i64; 3]),
    /// The sum of the directions in which it is extreme, or of their opposites; zero for most points.
    Ends([i64; 3]),
    /// It has this normal, a unit vector; true if those around it agree.
    Normal([f64; 3], bool),
}

/// What is known of each point, from what files tell.
pub fn known(points: &[Point], told: &[Option<Known>], facing: Facing) -> Vec<Option<Known>> {
    let sign = match facing {
        Facing::Auto => {
            let of = |v| told.get(v).copied().flatten();
            return (0..points.len()).map(of).collect();
        }
        Facing::At(place) => return vec![Some(Known::Place(place)); points.len()],
        Facing::Out => 1,
        Facing::In => -1,
    };
    let mut sums = vec![[0; 3]; points.len()];
    for (axis, direction) in (0..3).flat_map(|axis| [(axis, -1), (axis, 1)]) {
        for v in extreme(points, axis, direction) {
            sums[v as usize][axis] += sign * direction;
        }
    }
    sums.into_iter().map(|sum| Some(Known::Ends(sum))).collect()
}

/// The points that are farthest along an axis, or against it, in their columns along it.
pub fn extreme(points: &[Point], axis: usize, direction: i64) -> BTreeSet<u32> {
    let least = |axis: usize| points.iter().map(|p| i64::from(p[axis])).min();
    let most = |axis: usize| points.iter().map(|p| i64::from(p[axis])).max();
    let [a, b] = [(axis + 1) % 3, (axis + 2) % 3];
    let (Some(x), Some(y)) = (least(a), least(b)) else {
        return BTreeSet::new();
    };
    let (wide, deep) = (most(a).expect("points") - x, most(b).expect("points") - y);
    let allowed = (points.len() as i64 / 64).max(1);
    let mut side = 1;
    while (wide / side + 1) * (deep / side + 1) > allowed {
        side *= 2;
    }
    let place = |p: &Point| direction * i64::from(p[axis]);
    let mut extreme: BTreeMap<[i64; 2], u32> = BTreeMap::new();
    for (id, p) in (0..).zip(points) {
        let column = [(i64::from(p[a]) - x) / side, (i64::from(p[b]) - y) / side];
        let best = extreme.entry(column).or_insert(id);
        // Among points equally far the smallest id came first.
        if place(p) > place(&points[*best as usize]) {
            *best = id;
        }
    }
    extreme.into_values().collect()
}

/// The evidence that the run i → j → k of a triangle faces the side that is out at its vertex `v`.
pub fn facing(points: &[Point], known: &[Option<Known>], t: Triangle, v: u32) -> i64 {
    let way: [f64; 3] = match known[v as usize] {
        Some(Known::Place(place)) => {
            let at = points[v as usize].map(i64::from);
            std::array::from_fn(|axis| (place[axis] - at[axis]) as f64)
        }
        Some(Known::Ends(sum)) => sum.map(|x| x as f64),
        Some(Known::Normal(normal, _)) => return evidence(points, t, normal),
        None => return 0,
    };
    let length = (way[0] * way[0] + way[1] * way[1] + way[2] * way[2]).sqrt();
    if length == 0.0 {
        return 0;
    }
    evidence(points, t, way.map(|x| x / length))
}

/// The evidence that the run i → j → k of a triangle faces a direction, a unit vector.
fn evidence(points: &[Point], t: Triangle, d: [f64; 3]) -> i64 {
    let n = unit_normal(points, t);
    (16.0 * (n[0] * d[0] + n[1] * d[1] + n[2] * d[2])).trunc() as i64
}
