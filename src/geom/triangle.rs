//! Exact normals of triangles.

use super::{Point, sub};

/// The exact normal of the triangle `a → b → c`; its length is twice the area.
#[must_use]
pub fn normal(a: Point, b: Point, c: Point) -> [i128; 3] {
    small_normal(a, b, c).map(i128::from)
}

/// As [`normal`], in machine words: coordinates have 30 bits, so nothing overflows.
#[must_use]
#[inline]
pub fn small_normal(a: Point, b: Point, c: Point) -> [i64; 3] {
    let (u, v) = (sub(b, a), sub(c, a));
    [
        u[1] * v[2] - u[2] * v[1],
        u[2] * v[0] - u[0] * v[2],
        u[0] * v[1] - u[1] * v[0],
    ]
}

/// True if three points are exactly collinear.
#[must_use]
#[inline]
pub fn on_a_line([a, b, c]: [Point; 3]) -> bool {
    small_normal(a, b, c) == [0; 3]
}

/// The length of a normal.
#[must_use]
pub fn length(v: [i128; 3]) -> f64 {
    v.iter().map(|x| *x as f64 * *x as f64).sum::<f64>().sqrt()
}

/// The direction of a vector, by operations that every machine rounds alike; up for a vector without length.
#[must_use]
pub fn direction(sum: &[i128; 3]) -> [f32; 3] {
    let [x, y, z] = sum.map(|x| x as f64);
    let length = (x * x + y * y + z * z).sqrt();
    if length == 0.0 {
        return [0.0, 0.0, 1.0];
    }
    [x, y, z].map(|x| (x / length) as f32)
}

/// Adds a vector to a sum.
pub fn add(sum: &mut [i128; 3], part: [i128; 3]) {
    (0..3).for_each(|axis| sum[axis] += part[axis]);
}

/// The area of a triangle.
#[must_use]
pub fn area([a, b, c]: [Point; 3]) -> f64 {
    0.5 * length(normal(a, b, c))
}
