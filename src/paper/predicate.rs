//! Exact decisions about the corners of restricted Voronoi cells.
//!
//! In coordinates relative to the cell's point `i`, the corner of the bisectors of `j` and `k` on the disk's
//! plane (normal `n`) is the point `q` with `n·q = 0`, `2 a·q = |a|²`, `2 b·q = |b|²`, where `a = p_j − p_i`,
//! `b = p_k − p_i`. The bisector of `l`, `c = p_l − p_i`, cuts it off if `2 c·q > |c|²`. With `D = n·(a×b)`
//! and `W = |a|² (b×c) + |b|² (c×a) + |c|² (a×b)` this is `sign(n·W) · sign(D) < 0`; both are integers. For
//! co-circular points in a plane `W = 0` for every normal.
//!
//! Ties are broken as in a power diagram with infinitesimal weights `ε_0 ≫ ε_1 ≫ …`
//! (simulation of simplicity): `|a|²` becomes `|a|² + ε_i − ε_j`, and so on. A larger weight
//! means a larger cell.

use super::plane::Normal;

type Vector = [i64; 3];

/// A neighbour of the cell's point: its difference to the point, and its id.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Neighbor {
    /// Position minus the position of the cell's point, each component below 2^30 in absolute value.
    pub difference: Vector,
    /// The neighbour's id.
    pub id: u32,
}

fn cross(a: Vector, b: Vector) -> [i128; 3] {
    let m = |x: i64, y: i64| i128::from(x) * i128::from(y);
    [
        m(a[1], b[2]) - m(a[2], b[1]),
        m(a[2], b[0]) - m(a[0], b[2]),
        m(a[0], b[1]) - m(a[1], b[0]),
    ]
}

fn length2(a: Vector) -> i128 {
    a.iter().map(|&x| i128::from(x) * i128::from(x)).sum()
}

/// Exact sign of `n·v`; `v` is split into words so that no product overflows.
fn sign_dot(n: Normal, v: [i128; 3]) -> i32 {
    let mut high = 0i128;
    let mut low = 0i128;
    for axis in 0..3 {
        high += i128::from(n[axis]) * (v[axis] >> 64);
        low += i128::from(n[axis]) * (v[axis] & i128::from(u64::MAX));
    }
    high += low >> 64;
    let low = low & i128::from(u64::MAX);
    if high != 0 {
        high.signum() as i32
    } else {
        i32::from(low != 0)
    }
}

/// Sign of the determinant of `n`, `a`, `b`: the orientation of the corner of `a` and `b`.
#[must_use]
pub fn turn(n: Normal, a: Vector, b: Vector) -> i32 {
    sign_dot(n, cross(a, b))
}

/// True if the bisector of `c` cuts off the corner of the bisectors of `a` and `b` in the cell of point
/// `own`, whose disk has normal `n`. Exact; ties are broken by id.
///
/// The corner must exist: the bisectors of `a` and `b` are not parallel on the disk's plane.
#[must_use]
pub fn cuts_corner(n: Normal, own: u32, a: Neighbor, b: Neighbor, c: Neighbor) -> bool {
    let (va, vb, vc) = (a.difference, b.difference, c.difference);
    let (bc, ca, ab) = (cross(vb, vc), cross(vc, va), cross(va, vb));
    let (la, lb, lc) = (length2(va), length2(vb), length2(vc));
    let w = std::array::from_fn(|i| la * bc[i] + lb * ca[i] + lc * ab[i]);
    let orientation = sign_dot(n, ab);
    let sign = sign_dot(n, w);
    if sign != 0 {
        return sign * orientation < 0;
    }
    // Coefficients of the weights in n·W, in ascending order of ids (the largest weight first).
    let sum: [i128; 3] = std::array::from_fn(|i| bc[i] + ca[i] + ab[i]);
    let minus = |v: [i128; 3]| v.map(|x| -x);
    let mut terms = [
        (own, sum),
        (a.id, minus(bc)),
        (b.id, minus(ca)),
        (c.id, minus(ab)),
    ];
    terms.sort_unstable_by_key(|(id, _)| *id);
    for (_, coefficient) in terms {
        let sign = sign_dot(n, coefficient);
        if sign != 0 {
            return sign * orientation < 0;
        }
    }
    // Reached only for a corner that does not exist.
    false
}

/// For bisectors of `a` and `c` that are parallel on the disk's plane: true if the bisector of `c` cuts off
/// the points on the bisector of `a`; `None` if the two are not parallel.
#[must_use]
pub fn cuts_parallel(n: Normal, own: u32, a: Neighbor, c: Neighbor) -> Option<bool> {
    let (va, vc) = (a.difference, c.difference);
    if turn(n, va, vc) != 0 {
        return None;
    }
    let (fa, fc) = (flatten(n, va), flatten(n, vc));
    let axis = (0..3).max_by_key(|&k| fa[k].unsigned_abs())?;
    // On the plane c = (p / q) a with q > 0; on the bisector of a, 2 c·x is (p / q) |a|².
    let (p, q) = (fc[axis] * fa[axis].signum(), fa[axis].abs());
    if q == 0 {
        return Some(false);
    }
    let (la, lc) = (length2(va), length2(vc));
    let order = match (p.checked_mul(la), q.checked_mul(lc)) {
        (Some(x), Some(y)) => x.cmp(&y),
        _ => (p as f64 * la as f64).total_cmp(&(q as f64 * lc as f64)),
    };
    if order.is_ne() {
        return Some(order.is_gt());
    }
    // With weights: p (ε_i − ε_j) > q (ε_i − ε_l); the lowest id decides.
    let mut terms = [(own, p - q), (a.id, -p), (c.id, q)];
    terms.sort_unstable_by_key(|(id, _)| *id);
    Some(
        terms
            .iter()
            .find(|(_, x)| *x != 0)
            .is_some_and(|(_, x)| *x > 0),
    )
}

/// The projection of `v` on the plane across `n`, times `|n|²`.
fn flatten(n: Normal, v: Vector) -> [i128; 3] {
    let n = n.map(i128::from);
    let v = v.map(i128::from);
    let nn = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
    let nv = n[0] * v[0] + n[1] * v[1] + n[2] * v[2];
    std::array::from_fn(|k| nn * v[k] - nv * n[k])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_differences_do_not_overflow() {
        let far = (1i64 << 30) - 1;
        let n = [1 << 24, 1 << 24, 1 << 24];
        let a = Neighbor {
            difference: [far, -far, 0],
            id: 1,
        };
        let b = Neighbor {
            difference: [-far, 0, far],
            id: 2,
        };
        let c = Neighbor {
            difference: [far, far, far],
            id: 3,
        };
        let d = Neighbor {
            difference: [far, 0, -far],
            id: 4,
        };
        let _ = cuts_corner(n, 0, a, b, c);
        let _ = cuts_corner(n, 0, a, b, d);
    }

    #[test]
    fn four_on_a_circle_make_two_triangles_whatever_the_normal() {
        // A unit square: all its cells must choose the same diagonal.
        let square = [[0i64, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]];
        for n in [[0, 0, 1 << 24], [3, -5, 1 << 24], [100, 7, -(1 << 20)]] {
            let mut seen = std::collections::BTreeMap::new();
            for own in 0..4usize {
                let others: Vec<_> = (1..4)
                    .map(|k| {
                        let other = (own + k) % 4;
                        let difference = std::array::from_fn(|x| square[other][x] - square[own][x]);
                        Neighbor {
                            difference,
                            id: other as u32,
                        }
                    })
                    .collect();
                for (x, y, z) in [(0, 1, 2), (0, 2, 1), (1, 2, 0)] {
                    if !cuts_corner(n, own as u32, others[x], others[y], others[z]) {
                        let mut triple = [own as u32, others[x].id, others[y].id];
                        triple.sort_unstable();
                        *seen.entry(triple).or_insert(0) += 1;
                    }
                }
            }
            assert_eq!(seen.len(), 2, "{seen:?}");
            assert!(seen.values().all(|count| *count == 3), "{seen:?}");
        }
    }
}
