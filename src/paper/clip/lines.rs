//! Lines in a disk's plane and their intersections.

use super::Normal;
use crate::kernels::numbers::Numbers;
use crate::kernels::{Frame, Line, SLACK};

/// A corner of the polygon.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Corner {
    pub at: [f64; 2],
    /// Upper bound on the distance of `at` from the true corner.
    pub error: f64,
    /// Upper bound on the squared distance of the true corner from the centre.
    pub reach2: f64,
}

/// Two unit vectors that span the plane across `normal`.
pub(super) fn frame(normal: Normal) -> Frame {
    let n = normal.map(f64::from);
    let unit = |v: [f64; 3]| {
        let length = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
        v.map(|x| x / length)
    };
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ]
    };
    let mut axis = [0.0; 3];
    let mut least = 0;
    for k in 1..3 {
        if n[k].abs() < n[least].abs() {
            least = k;
        }
    }
    axis[least] = 1.0;
    let u = unit(cross(n, axis));
    [u, cross(unit(n), u)]
}

/// The intersection of two lines.
#[inline(always)]
pub(super) fn meet(a: &Line, b: &Line) -> Corner {
    let columns = |line: &Line| [line.line[0], line.line[1], line.offset, line.length];
    let ([x, y], error, reach2) = meet_columns(columns(a), columns(b));
    Corner {
        at: [x, y],
        error,
        reach2,
    }
}

/// The intersections of pairs of lines, each given by its normal, offset and length: positions, bounds of
/// their errors, bounds of their squared distances from the centre.
#[inline(always)]
pub(super) fn meet_columns<N: Numbers>(
    [a_x, a_y, a_offset, a_length]: [N; 4],
    [b_x, b_y, b_offset, b_length]: [N; 4],
) -> ([N; 2], N, N) {
    let slack = N::splat(SLACK);
    let determinant = a_x * b_y - a_y * b_x;
    let inverse = N::splat(1.0) / determinant;
    let x = (a_offset * b_y - b_offset * a_y) * inverse;
    let y = (b_offset * a_x - a_offset * b_x) * inverse;
    let distance = x.abs() + y.abs();
    let lengths = a_length + b_length;
    let error = slack * lengths * inverse.abs() * (a_offset + b_offset + lengths * distance);
    let reach2 =
        (x * x + y * y) * N::splat(1.0 + SLACK) + error * (N::splat(2.0) * distance + error);
    ([x, y], error, reach2)
}

/// A tighter bound on the distance of `at`, the intersection computed by [`meet`], from the true corner.
pub(super) fn error_of_meeting(a: &Line, b: &Line, at: [f64; 2]) -> f64 {
    let determinant = a.line[0] * b.line[1] - a.line[1] * b.line[0];
    let distance = at[0].abs() + at[1].abs();
    let crossed = a.offset * b.length + b.offset * a.length;
    SLACK * (crossed + 2.0 * a.length * b.length * distance) / determinant.abs()
}
