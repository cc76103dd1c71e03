//! Which corners of a polygon lie beyond a line.

use super::kernel;

/// Corners are looked at in groups of this size; columns are padded to a multiple.
pub const CORNER_LANES: usize = 8;

/// Factor of the forward error bounds, in units of the last place; several times what a count of
/// the roundings gives.
pub(crate) const SLACK: f64 = 32.0 * f64::EPSILON;

/// Corners of a convex polygon around the origin, in columns of equal length, a multiple of
/// [`CORNER_LANES`]. All zeros is a place without a corner: it is at the origin, which no line
/// cuts off.
#[derive(Debug, Clone, Default)]
pub struct CornerColumns {
    /// Position.
    pub x: Vec<f64>,
    /// Position.
    pub y: Vec<f64>,
    /// Bound on the distance from the true corner.
    pub error: Vec<f64>,
    /// Distance from the origin, at most.
    pub reach: Vec<f64>,
}

/// A corner in [`CornerColumns`].
#[derive(Debug, Clone, Copy, Default)]
pub struct CornerPlace {
    /// Position.
    pub x: f64,
    /// Position.
    pub y: f64,
    /// Bound on the distance from the true corner.
    pub error: f64,
    /// Distance from the origin, at most.
    pub reach: f64,
}

impl CornerColumns {
    /// Number of places.
    #[must_use]
    pub fn len(&self) -> usize {
        self.x.len()
    }

    /// True if there is no place.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.x.is_empty()
    }

    /// Makes room for `places`, a multiple of [`CORNER_LANES`].
    pub fn resize(&mut self, places: usize) {
        for column in [&mut self.x, &mut self.y, &mut self.error, &mut self.reach] {
            column.resize(places, 0.0);
        }
    }

    /// Puts a corner in place `k`.
    #[inline]
    pub fn set(&mut self, k: usize, corner: CornerPlace) {
        self.x[k] = corner.x;
        self.y[k] = corner.y;
        self.error[k] = corner.error;
        self.reach[k] = corner.reach;
    }

    /// Leaves no corner in place `k`.
    #[inline]
    pub fn clear(&mut self, k: usize) {
        self.set(k, CornerPlace::default());
    }
}

/// The line `line · q = offset`, `offset > 0`; what is beyond it is cut off.
#[derive(Debug, Clone, Copy)]
pub struct Line {
    /// Normal of the line, of any length.
    pub line: [f64; 2],
    /// Where the line is.
    pub offset: f64,
    /// Scales the error of `line`.
    pub length: f64,
}

impl Line {
    /// How far beyond the line a corner is, times the length of the line's normal.
    #[inline(always)]
    pub fn depth(&self, x: f64, y: f64) -> f64 {
        self.line[0] * x + self.line[1] * y - self.offset
    }

    /// A bound on the error of [`Line::depth`].
    #[inline(always)]
    pub fn bound(&self, error: f64, reach: f64) -> f64 {
        self.length * error + SLACK * (self.length * reach + self.offset)
    }
}

kernel! {
    /// Sets bit `k` of `cut` if corner `k` is surely cut off by the line, and bit `k` of `doubt` if
    /// the error bound does not allow to say. Both have a word for each 64 corners. False if no
    /// bit was set.
    pub fn cut_corners(corners: &CornerColumns, line: &Line, cut: &mut [u64], doubt: &mut [u64]) -> bool = cut_body
}

#[inline(always)]
fn cut_body(corners: &CornerColumns, line: &Line, cut: &mut [u64], doubt: &mut [u64]) -> bool {
    let n = corners.x.len();
    let (x, y) = (&corners.x[..n], &corners.y[..n]);
    let (error, reach) = (&corners.error[..n], &corners.reach[..n]);
    cut.fill(0);
    doubt.fill(0);
    let mut any = 0;
    let groups = x
        .chunks_exact(CORNER_LANES)
        .zip(y.chunks_exact(CORNER_LANES))
        .zip(error.chunks_exact(CORNER_LANES))
        .zip(reach.chunks_exact(CORNER_LANES));
    for (group, (((x, y), error), reach)) in groups.enumerate() {
        let mut depth = [0.0; CORNER_LANES];
        let mut bound = [0.0; CORNER_LANES];
        for k in 0..CORNER_LANES {
            depth[k] = line.depth(x[k], y[k]);
            bound[k] = line.bound(error[k], reach[k]);
        }
        let (mut sure, mut open) = (0u64, 0u64);
        for k in 0..CORNER_LANES {
            sure |= u64::from(depth[k] > bound[k]) << k;
            // Not a number is in doubt, too.
            #[allow(clippy::neg_cmp_op_on_partial_ord, reason = "must be true for NaN")]
            let doubtful = !(depth[k].abs() > bound[k]);
            open |= u64::from(doubtful) << k;
        }
        let at = group * CORNER_LANES;
        cut[at / 64] |= sure << (at % 64);
        doubt[at / 64] |= open << (at % 64);
        any |= sure | open;
    }
    any != 0
}

kernel! {
    /// The largest of the corners' reaches.
    pub fn farthest(corners: &CornerColumns) -> f64 = farthest_body
}

#[inline(always)]
fn farthest_body(corners: &CornerColumns) -> f64 {
    let mut lanes = [0.0f64; CORNER_LANES];
    for reach in corners.reach.chunks_exact(CORNER_LANES) {
        for k in 0..CORNER_LANES {
            lanes[k] = if reach[k] > lanes[k] { reach[k] } else { lanes[k] };
        }
    }
    lanes.into_iter().fold(0.0, |a, b| if b > a { b } else { a })
}

#[cfg(test)]
mod tests {
    use super::super::Level;
    use super::*;
    use proptest::prelude::*;

    fn number() -> impl Strategy<Value = f64> {
        prop_oneof![
            8 => -1e3f64..1e3,
            1 => Just(f64::NAN),
            1 => Just(f64::INFINITY),
            2 => (-4i32..5).prop_map(f64::from),
        ]
    }

    proptest! {
        #[test]
        fn every_level_gives_the_same_bits(
            rows in prop::collection::vec((number(), number(), number(), number()), 0..150),
            line in prop::array::uniform2(-4i32..5),
            offset in 0.5f64..5.0,
        ) {
            let padded = rows.len().next_multiple_of(CORNER_LANES);
            let mut corners = CornerColumns {
                x: rows.iter().map(|r| r.0).collect(),
                y: rows.iter().map(|r| r.1).collect(),
                error: rows.iter().map(|r| r.2.abs() * 1e-3).collect(),
                reach: rows.iter().map(|r| r.3.abs()).collect(),
            };
            for column in [&mut corners.x, &mut corners.y, &mut corners.error, &mut corners.reach] {
                column.resize(padded, 0.0);
            }
            let line = Line { line: line.map(f64::from), offset, length: 8.0 };
            let words = padded.div_ceil(64);
            let (mut cut, mut doubt) = (vec![0; words], vec![0; words]);
            let any = cut_body(&corners, &line, &mut cut, &mut doubt);
            for (k, row) in rows.iter().enumerate() {
                let depth = line.depth(row.0, row.1);
                let bound = line.bound(row.2.abs() * 1e-3, row.3.abs());
                prop_assert_eq!(cut[k / 64] >> (k % 64) & 1 == 1, depth > bound);
                let surely = depth.abs() > bound;
                prop_assert_eq!(doubt[k / 64] >> (k % 64) & 1 == 0, surely);
            }
            for level in Level::all() {
                let (mut c, mut d) = (vec![1; words], vec![1; words]);
                prop_assert_eq!(cut_corners(level, &corners, &line, &mut c, &mut d), any);
                prop_assert_eq!((&c, &d), (&cut, &doubt));
                prop_assert_eq!(farthest(level, &corners).to_bits(), farthest_body(&corners).to_bits());
            }
        }
    }
}
