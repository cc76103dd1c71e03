//! Lengths, and whether two triangles cross.

use outcrop_geom::vector::{Box3, V3, cross, dot, sub};

/// Corners of a triangle.
pub(crate) type Corners = [V3; 3];

/// Lowest and highest corner of the box around a triangle.
pub(crate) fn bounds(t: &Corners) -> [V3; 2] {
    let all = Box3::of(t);
    [all.min, all.max]
}

/// The length of a vector.
pub(crate) fn norm(v: V3) -> f64 {
    dot(v, v).sqrt()
}

/// The side of `d` from the plane of `a`, `b` and `c`: 0 if rounding may decide.
fn side(a: V3, b: V3, c: V3, d: V3) -> i8 {
    let (u, v, w) = (sub(a, d), sub(b, d), sub(c, d));
    let volume = dot(u, cross(v, w));
    let size = |x: V3| x[0].abs() + x[1].abs() + x[2].abs();
    // Above all roundings, with differences of coordinates that may be rounded too.
    let error = 1e-14 * size(u) * size(v) * size(w);
    match volume {
        v if v > error => 1,
        v if v < -error => -1,
        _ => 0,
    }
}

/// True if the inside of a line from `p` to `q` runs through the inside of a triangle.
fn pierces(p: V3, q: V3, [a, b, c]: Corners) -> bool {
    let (from, to) = (side(a, b, c, p), side(a, b, c, q));
    if from * to >= 0 {
        return false;
    }
    let first = side(p, q, a, b);
    first != 0 && first == side(p, q, b, c) && first == side(p, q, c, a)
}

/// True if two triangles cross. Those that only touch do not, nor those in one plane; corners at one place are one
/// vertex.
pub(crate) fn cross_each_other(s: &Corners, t: &Corners) -> bool {
    // From near by, so that far coordinates lose nothing.
    let origin = s[0];
    let [s, t] = [s, t].map(|t| t.map(|p| sub(p, origin)));
    let common = |p: &V3| t.contains(p);
    match s.iter().filter(|p| common(p)).count() {
        0 => (0..3).any(|k| {
            let next = (k + 1) % 3;
            pierces(s[k], s[next], t) || pierces(t[k], t[next], s)
        }),
        1 => {
            let opposite = |t: &Corners, other: &Corners| {
                let at = t.iter().position(|p| other.contains(p)).unwrap_or(0);
                (t[(at + 1) % 3], t[(at + 2) % 3])
            };
            let (p, q) = opposite(&s, &t);
            let (u, v) = opposite(&t, &s);
            pierces(p, q, t) || pierces(u, v, s)
        }
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FLAT: Corners = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];

    #[test]
    fn triangles_cross_or_touch() {
        let crosses = |t: Corners| {
            for far in [0.0, 635_000.0] {
                let moved = |t: Corners| t.map(|p| p.map(|x| x + far));
                let both = [
                    cross_each_other(&moved(FLAT), &moved(t)),
                    cross_each_other(&moved(t), &moved(FLAT)),
                ];
                assert_eq!(both[0], both[1]);
                if both[0] {
                    return true;
                }
            }
            false
        };
        assert!(crosses([
            [1.0, 1.0, -1.0],
            [1.0, 1.0, 1.0],
            [5.0, 5.0, 1.0]
        ]));
        // A common corner, and the opposite side through the other triangle.
        assert!(crosses([
            [0.0, 0.0, 0.0],
            [1.0, 1.5, -1.0],
            [1.0, 1.0, 1.0]
        ]));
        // Above, at an edge, in the plane, with a common edge.
        assert!(!crosses([
            [1.0, 1.0, 0.5],
            [1.0, 1.0, 1.0],
            [5.0, 5.0, 1.0]
        ]));
        assert!(!crosses([
            [1.0, 0.0, 0.0],
            [2.0, 0.0, 0.0],
            [1.0, -1.0, 3.0]
        ]));
        assert!(!crosses([
            [1.0, 1.0, 0.0],
            [1.5, 1.0, 0.0],
            [1.0, 1.5, 0.0]
        ]));
        assert!(!crosses([
            [0.0, 0.0, 0.0],
            [4.0, 0.0, 0.0],
            [1.0, 1.0, 1.0]
        ]));
    }
}
