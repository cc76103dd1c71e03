//! Exact geometry on the integer lattice: points, boxes, curve keys, triangles; and regions of space.

pub mod aabb;
pub mod boxes;
pub mod distance;
pub mod hilbert;
pub mod lattice;
pub mod region;
pub mod round;
pub mod triangle;
pub mod vector;

/// A position on the lattice, each coordinate in `0..2^30`.
pub type Point = [i32; 3];

/// Difference of two positions, exact in `i64`.
#[must_use]
pub fn sub(a: Point, b: Point) -> [i64; 3] {
    [
        i64::from(a[0]) - i64::from(b[0]),
        i64::from(a[1]) - i64::from(b[1]),
        i64::from(a[2]) - i64::from(b[2]),
    ]
}

/// Exact squared distance of two positions, in squared lattice steps.
#[must_use]
pub fn distance2(a: Point, b: Point) -> u64 {
    let d = sub(a, b);
    (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) as u64
}
