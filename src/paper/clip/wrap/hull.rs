//! Gift wrapping of the convex hulls of sixteen sets of points, one in each lane. In `f32`: a hull is a guess
//! that has to be certified.

use super::{Lanes, MOST_NEIGHBORS, MOST_SIDES, TOGETHER};
use crate::kernels::sixteen::Sixteen;

/// Comparisons that need not wait for each other.
const CHAINS: usize = 4;

/// Wraps the hulls of the first `lanes` lanes, counter-clockwise. Returns their numbers of sides, 0 where
/// there are too many.
#[inline(always)]
pub(super) fn hulls<S: Sixteen>(
    dual: &[[Lanes<f32>; MOST_NEIGHBORS]; 2],
    count: usize,
    lanes: usize,
    sides: &mut [Lanes<u32>; MOST_SIDES],
) -> Lanes<u32> {
    let rows = count.next_multiple_of(CHAINS).min(MOST_NEIGHBORS);
    let duals = [&dual[0][..rows], &dual[1][..rows]];
    let first = farthest_along_x::<S>(duals[0]);
    let mut side = first;
    let mut at = points_of(dual, &side);
    // Backwards along the tangent; the hull is to the left of the tangent.
    let mut back = [[0.0; TOGETHER], [-1.0; TOGETHER]];
    let mut counts = [0; TOGETHER];
    let mut open = [0; TOGETHER];
    open[..lanes].fill(u32::MAX);
    for (place, sides) in (1u32..).zip(sides) {
        *sides = side;
        let next = rightmost::<S>(duals, &at, &back);
        let mut any = 0;
        for l in 0..TOGETHER {
            let closed = if next[l] == first[l] { open[l] } else { 0 };
            counts[l] |= closed & place;
            open[l] &= !closed;
            any |= open[l];
        }
        if any == 0 {
            break;
        }
        let to = points_of(dual, &next);
        for (back, (at, to)) in back.iter_mut().zip(at.iter().zip(&to)) {
            for l in 0..TOGETHER {
                back[l] = at[l] - to[l];
            }
        }
        (at, side) = (to, next);
    }
    counts
}

/// The points of the dual with these numbers, by coordinate and lane.
#[inline(always)]
fn points_of(dual: &[[Lanes<f32>; MOST_NEIGHBORS]; 2], numbers: &Lanes<u32>) -> [Lanes<f32>; 2] {
    let mut at = [[0.0; TOGETHER]; 2];
    for (dual, at) in dual.iter().zip(&mut at) {
        for l in 0..TOGETHER {
            at[l] = dual[numbers[l] as usize % MOST_NEIGHBORS][l];
        }
    }
    at
}

/// The numbers of the points with the largest x, which are corners of the hulls.
#[inline(always)]
fn farthest_along_x<S: Sixteen>(dual_x: &[Lanes<f32>]) -> Lanes<u32> {
    let mut most = S::floats(&[0.0; TOGETHER]);
    let mut number = S::integer(0);
    for (this, x) in (0u32..).zip(dual_x) {
        let x = S::floats(x);
        let take = S::less(most, x);
        most = S::choose(take, x, most);
        number = S::choose_integers(take, S::integer(this), number);
    }
    let mut numbers = [0; TOGETHER];
    S::store_integers(number, &mut numbers);
    numbers
}

/// A direction and the number of the point there.
type Direction<S> = (
    <S as Sixteen>::Floats,
    <S as Sixteen>::Floats,
    <S as Sixteen>::Integers,
);

/// Of two directions, that to the right.
#[inline(always)]
fn right<S: Sixteen>(a: Direction<S>, b: Direction<S>) -> Direction<S> {
    let take = S::less(S::times(a.0, b.1), S::times(a.1, b.0));
    (
        S::choose(take, b.0, a.0),
        S::choose(take, b.1, a.1),
        S::choose_integers(take, b.2, a.2),
    )
}

/// The numbers of the points that are farthest to the right as seen from `at`, where `back` is a direction to
/// the left of all of them.
#[inline(always)]
fn rightmost<S: Sixteen>(
    [dual_x, dual_y]: [&[Lanes<f32>]; 2],
    at: &[Lanes<f32>; 2],
    back: &[Lanes<f32>; 2],
) -> Lanes<u32> {
    let (at_x, at_y) = (S::floats(&at[0]), S::floats(&at[1]));
    let start = (S::floats(&back[0]), S::floats(&back[1]), S::integer(0));
    let mut best = [start; CHAINS];
    let rows = dual_x.chunks_exact(CHAINS).zip(dual_y.chunks_exact(CHAINS));
    for (chunk, (dual_x, dual_y)) in (0u32..).zip(rows) {
        for (link, best) in best.iter_mut().enumerate() {
            let x = S::minus(S::floats(&dual_x[link]), at_x);
            let y = S::minus(S::floats(&dual_y[link]), at_y);
            let number = S::integer(chunk * CHAINS as u32 + link as u32);
            *best = right::<S>(*best, (x, y, number));
        }
    }
    let mut all = best[0];
    for other in &best[1..] {
        all = right::<S>(all, *other);
    }
    let (.., number) = all;
    let mut numbers = [0; TOGETHER];
    S::store_integers(number, &mut numbers);
    numbers
}
