//! Bisectors as lines in a plane, and the corners of a polygon beyond a line.

use super::eight::Eight;
use super::kernel;

/// Size of the groups in which corners and lines are processed.
pub const LANES: usize = 8;

/// Factor of the forward error bounds, in units of the last place: several times the number of roundings.
pub const SLACK: f64 = 32.0 * f64::EPSILON;

/// Corners of a convex polygon around the origin, in columns. All zeros means no corner: the origin is not
/// cut off by any line.
#[derive(Debug, Clone, Copy, Default)]
pub struct CornerGroup {
    /// x coordinate.
    pub x: [f64; LANES],
    /// y coordinate.
    pub y: [f64; LANES],
    /// Upper bound on the distance from the true corner.
    pub error: [f64; LANES],
    /// Upper bound on the squared distance of the true corner from the origin.
    pub reach2: [f64; LANES],
}

/// The line `line · q = offset`, `offset > 0`; the side with `line · q > offset` is cut off.
#[derive(Debug, Clone, Copy)]
pub struct Line {
    /// Normal of the line, of any length.
    pub line: [f64; 2],
    /// Right-hand side of the equation.
    pub offset: f64,
    /// Upper bound on the length of the difference in space whose bisector it is; scales the error of `line`.
    pub length: f64,
}

impl Line {
    /// Distance of a corner beyond the line, times the length of the line's normal.
    #[inline(always)]
    #[must_use]
    pub fn depth(&self, x: f64, y: f64) -> f64 {
        self.line[0] * x + self.line[1] * y - self.offset
    }

    /// Upper bound on the error of [`Line::depth`].
    #[inline(always)]
    #[must_use]
    pub fn bound(&self, x: f64, y: f64, error: f64) -> f64 {
        self.length * (error + SLACK * (x.abs() + y.abs())) + SLACK * self.offset
    }
}

/// Lines in columns.
#[derive(Debug, Clone, Copy, Default)]
pub struct LineGroup {
    /// Normals of the lines, along x.
    pub x: [f64; LANES],
    /// Along y.
    pub y: [f64; LANES],
    /// Right-hand sides.
    pub offset: [f64; LANES],
    /// Upper bounds on the lengths of the differences.
    pub length: [f64; LANES],
}

impl LineGroup {
    /// The line at one index.
    #[inline(always)]
    #[must_use]
    pub fn get(&self, k: usize) -> Line {
        Line {
            line: [self.x[k], self.y[k]],
            offset: self.offset[k],
            length: self.length[k],
        }
    }
}

/// Two unit vectors that span a plane.
pub type Frame = [[f64; 3]; 2];

kernel! {
    /// The bisectors between the origin and up to [`LANES`] differences, in a plane through the origin. The
    /// line of a zero difference is meaningless.
    pub fn bisectors(x: &[i32], y: &[i32], z: &[i32], frame: &Frame) -> LineGroup = bisectors_body<Eight>
}

/// The definition of [`bisectors`].
#[inline(always)]
pub fn bisectors_body<E: Eight>(x: &[i32], y: &[i32], z: &[i32], frame: &Frame) -> LineGroup {
    let columns = (
        <&[i32; LANES]>::try_from(x),
        <&[i32; LANES]>::try_from(y),
        <&[i32; LANES]>::try_from(z),
    );
    if let (Ok(x), Ok(y), Ok(z)) = columns {
        return eight_bisectors::<E>(x, y, z, frame);
    }
    let mut padded = [[1; LANES]; 3];
    for (column, padded) in [x, y, z].into_iter().zip(&mut padded) {
        for (value, padded) in column.iter().zip(padded) {
            *padded = *value;
        }
    }
    eight_bisectors::<E>(&padded[0], &padded[1], &padded[2], frame)
}

#[inline(always)]
fn eight_bisectors<E: Eight>(
    x: &[i32; LANES],
    y: &[i32; LANES],
    z: &[i32; LANES],
    [u, v]: &Frame,
) -> LineGroup {
    let (x, y, z) = (E::convert(x), E::convert(y), E::convert(z));
    let length2 = x.mul(x).add(y.mul(y)).add(z.mul(z));
    let mut lines = LineGroup::default();
    dot(x, y, z, u).store(&mut lines.x);
    dot(x, y, z, v).store(&mut lines.y);
    E::splat(0.5).mul(length2).store(&mut lines.offset);
    // The sum of absolute values: at least the true length, without a square root.
    x.abs().add(y.abs()).add(z.abs()).store(&mut lines.length);
    lines
}

#[inline(always)]
fn dot<E: Eight>(x: E, y: E, z: E, w: &[f64; 3]) -> E {
    let (x, y, z) = (
        x.mul(E::splat(w[0])),
        y.mul(E::splat(w[1])),
        z.mul(E::splat(w[2])),
    );
    x.add(y).add(z)
}

kernel! {
    /// Two words for up to 64 corners. In the first, bit `k` is set if the line certainly cuts off corner
    /// `k`; in the second, if the error bound leaves it in doubt.
    pub fn cut_corners(corners: &[CornerGroup], line: &Line) -> (u64, u64) = cut_body<Eight>
}

/// The definition of [`cut_corners`].
#[inline(always)]
pub fn cut_body<E: Eight>(corners: &[CornerGroup], line: &Line) -> (u64, u64) {
    let (u, v) = (E::splat(line.line[0]), E::splat(line.line[1]));
    let (offset, length) = (E::splat(line.offset), E::splat(line.length));
    let slack = E::splat(SLACK);
    let (mut cut, mut doubt) = (0, 0);
    for (group, corners) in corners.iter().enumerate() {
        let (x, y) = (E::load(&corners.x), E::load(&corners.y));
        // As `Line::depth` and `Line::bound`.
        let depth = u.mul(x).add(v.mul(y)).sub(offset);
        let around = slack.mul(x.abs().add(y.abs()));
        let error = E::load(&corners.error).add(around);
        let bound = length.mul(error).add(slack.mul(offset));
        cut |= depth.greater(bound) << (group * LANES);
        // NaN is in doubt, too.
        doubt |= (!depth.abs().greater(bound) & 0xff) << (group * LANES);
    }
    (cut, doubt)
}

kernel! {
    /// Bit `k` is set unless line `k` certainly cuts off no corner: [`cut_corners`] would return two zeros.
    pub fn touching_lines(corners: &[CornerGroup], lines: &LineGroup) -> u64 = touching_body<Eight>
}

/// The definition of [`touching_lines`].
#[inline(always)]
pub fn touching_body<E: Eight>(corners: &[CornerGroup], lines: &LineGroup) -> u64 {
    let corners = corners
        .iter()
        .flat_map(|group| (0..LANES).map(|k| Place::of(group, k)));
    touching_places_body::<E>(corners, lines)
}

/// A corner, as far as it decides whether lines touch it.
#[derive(Debug, Clone, Copy, Default)]
pub struct Place {
    x: f64,
    y: f64,
    /// The part of [`Line::bound`] that does not depend on the line.
    error: f64,
}

impl Place {
    /// A corner at `x`, `y`, with that part of the error.
    #[inline(always)]
    #[must_use]
    pub fn new(x: f64, y: f64, error: f64) -> Self {
        Self { x, y, error }
    }

    #[inline(always)]
    fn of(group: &CornerGroup, k: usize) -> Self {
        let (x, y) = (group.x[k], group.y[k]);
        let error = group.error[k] + SLACK * (x.abs() + y.abs());
        Self { x, y, error }
    }

    /// Writes the corners to `to`, without the places where there is none, and returns how many there are;
    /// `None` if there are more than `to` has room for.
    #[inline(always)]
    pub fn list(corners: &[CornerGroup], to: &mut [Self]) -> Option<usize> {
        let mut count = 0;
        for group in corners {
            for k in 0..LANES {
                if group.reach2[k] != 0.0 {
                    *to.get_mut(count)? = Self::of(group, k);
                    count += 1;
                }
            }
        }
        Some(count)
    }
}

/// As [`touching_body`], for corners one by one.
#[inline(always)]
pub fn touching_places_body<E: Eight>(
    corners: impl Iterator<Item = Place>,
    lines: &LineGroup,
) -> u64 {
    let (u, v) = (E::load(&lines.x), E::load(&lines.y));
    let (offset, length) = (E::load(&lines.offset), E::load(&lines.length));
    let least = E::splat(SLACK).mul(offset);
    let mut clear = 0xff;
    for corner in corners {
        // As in `cut_body`.
        let (x, y) = (E::splat(corner.x), E::splat(corner.y));
        let depth = u.mul(x).add(v.mul(y)).sub(offset);
        let bound = length.mul(E::splat(corner.error)).add(least);
        clear &= E::splat(0.0).sub(depth).greater(bound);
    }
    !clear & 0xff
}

kernel! {
    /// The largest squared reach of the corners.
    pub fn farthest(corners: &[CornerGroup]) -> f64 = farthest_body<Eight>
}

/// The definition of [`farthest`].
#[inline(always)]
pub fn farthest_body<E: Eight>(corners: &[CornerGroup]) -> f64 {
    let mut most = E::splat(0.0);
    for group in corners {
        most = E::load(&group.reach2).larger(most);
    }
    most.largest()
}

#[cfg(test)]
mod tests {
    use super::super::Level;
    use super::super::eight::Base;
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
        fn every_level_cuts_the_same_corners(
            rows in prop::collection::vec((number(), number(), number(), number()), 0..64),
            line in prop::array::uniform2(-4i32..5),
            offset in 0.5f64..5.0,
        ) {
            let mut corners = vec![CornerGroup::default(); rows.len().div_ceil(LANES)];
            for (k, row) in rows.iter().enumerate() {
                let group = &mut corners[k / LANES];
                let k = k % LANES;
                (group.x[k], group.y[k]) = (row.0, row.1);
                (group.error[k], group.reach2[k]) = (row.2.abs() * 1e-3, row.3.abs());
            }
            let line = Line { line: line.map(f64::from), offset, length: 8.0 };
            let (cut, doubt) = cut_body::<Base>(&corners, &line);
            for k in 0..corners.len() * LANES {
                let group = &corners[k / LANES];
                let depth = line.depth(group.x[k % LANES], group.y[k % LANES]);
                let bound = line.bound(group.x[k % LANES], group.y[k % LANES], group.error[k % LANES]);
                prop_assert_eq!(cut >> k & 1 == 1, depth > bound);
                let surely = depth.abs() > bound;
                prop_assert_eq!(doubt >> k & 1 == 0, surely);
            }
            let lines = LineGroup {
                x: std::array::from_fn(|k| f64::from(k as i32 - 3)),
                y: std::array::from_fn(|k| line.line[k % 2]),
                offset: std::array::from_fn(|k| offset * k as f64),
                length: [8.0; LANES],
            };
            for level in Level::all() {
                prop_assert_eq!(cut_corners(level, &corners, &line), (cut, doubt));
                let touching = touching_lines(level, &corners, &lines);
                for k in 0..LANES {
                    let (cut, doubt) = cut_body::<Base>(&corners, &lines.get(k));
                    prop_assert_eq!(touching >> k & 1 == 1, cut | doubt != 0);
                }
                prop_assert_eq!(farthest(level, &corners).to_bits(), farthest_body::<Base>(&corners).to_bits());
            }
        }

        #[test]
        fn every_level_makes_the_same_lines(
            d in prop::collection::vec(prop::array::uniform3(-(1i32 << 30)..1 << 30), 1..=LANES),
            frame in prop::array::uniform2(prop::array::uniform3(-1.0f64..1.0)),
        ) {
            let column = |axis: usize| d.iter().map(|d| d[axis]).collect::<Vec<_>>();
            let (x, y, z) = (column(0), column(1), column(2));
            let expected = bisectors_body::<Base>(&x, &y, &z, &frame);
            for level in Level::all() {
                let got = bisectors(level, &x, &y, &z, &frame);
                for k in 0..d.len() {
                    let words = |l: Line| [l.line[0], l.line[1], l.offset, l.length].map(f64::to_bits);
                    prop_assert_eq!(words(got.get(k)), words(expected.get(k)));
                }
            }
        }
    }
}
