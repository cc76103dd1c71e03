//! The distance from a point to a triangle of any shape.

use super::vector::{V3, add, dot, scale, sub};

/// Squared height over squared side below which the edges are always examined: for such a needle the result
/// for the inside is less accurate than that for the edges.
const NEEDLE: f64 = 1e-4;

/// Squared distance from `p` to the nearest point of a triangle, which may be a segment or a point.
#[must_use]
pub fn distance2(triangle: &[V3; 3], p: V3) -> f64 {
    let [a, b, c] = triangle.map(|corner| sub(corner, p));
    let (ab, ac) = (sub(b, a), sub(c, a));
    let base2 = dot(ab, ab);
    let edges = || segment(a, b).min(segment(b, c)).min(segment(c, a));
    if base2 == 0.0 {
        return edges();
    }
    // `height` is orthogonal to `ab`, so each coordinate is computed separately.
    let along = dot(ac, ab) / base2;
    let height = sub(ac, scale(ab, along));
    let height2 = dot(height, height);
    let w = -dot(a, height) / height2;
    let v = -dot(a, ab) / base2 - w * along;
    // The negated form is also true if one of them is not a number.
    if !(v >= 0.0 && w >= 0.0 && v + w <= 1.0) {
        return edges();
    }
    let nearest = add(a, add(scale(ab, v), scale(ac, w)));
    let inside = dot(nearest, nearest);
    if height2 < NEEDLE * (base2 + dot(ac, ac)) {
        inside.min(edges())
    } else {
        // The distance from a corner is zero, in spite of rounding above.
        inside.min(dot(a, a)).min(dot(b, b)).min(dot(c, c))
    }
}

/// Squared distance from the origin to the segment `a b`.
fn segment(a: V3, b: V3) -> f64 {
    let ab = sub(b, a);
    let along = -dot(a, ab);
    let length2 = dot(ab, ab);
    if along <= 0.0 {
        return dot(a, a);
    }
    if along >= length2 {
        return dot(b, b);
    }
    let nearest = add(a, scale(ab, along / length2));
    dot(nearest, nearest)
}
