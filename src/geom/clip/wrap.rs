//! The cells of several points at once, by gift wrapping.
//!
//! In the dual, the line `l · q = o` is the point `l / o`, and the corners of a cell are the sides of the
//! convex hull of these points. Hulls are wrapped in `f32`, one in each lane; they are guesses. A guess is
//! certified as the cell: the intersection of each side with the next, with a bound on its error, must be
//! clear of all other lines. A cell without a certificate has to be clipped ([`super::Cell`]); most of these
//! have co-circular neighbours, or reach beyond the points at hand.

use super::RIM_DISTANCE;
use super::lines::meet_columns;
use crate::geom::Point;
use crate::geom::plane::Normal;
use crate::kernels::eight::Eight;
use crate::kernels::sixteen::Sixteen;
use crate::kernels::{
    Frame, LANES, Level, LineGroup, Place, SLACK, bisectors_body, kernel, touching_places_body,
};

/// Most points whose cells are computed together, one in each lane.
pub const TOGETHER: usize = 16;

/// Most neighbours of a point.
pub const MOST_NEIGHBORS: usize = 32;

/// Comparisons that need not wait for each other.
const CHAINS: usize = 4;

/// Most sides of a cell.
const MOST_SIDES: usize = 2 * LANES;

/// A point, its disk, and its neighbours: all points within a distance.
#[derive(Debug, Clone, Copy)]
pub struct Site<'a> {
    /// Differences to the neighbours, one axis after the other; [`MOST_NEIGHBORS`] with zeros at the end.
    pub differences: [&'a [i32; MOST_NEIGHBORS]; 3],
    /// Number of neighbours.
    pub count: usize,
    /// Normal of the disk's plane.
    pub normal: Normal,
    /// Radius of the disk, in steps.
    pub radius: f64,
}

/// The cell that the neighbours leave of a disk.
#[derive(Debug, Clone, Copy)]
pub struct Outline {
    count: usize,
    sides: [u8; MOST_SIDES],
    secure2: u64,
}

impl Outline {
    const NONE: Self = Self {
        count: 0,
        sides: [0; MOST_SIDES],
        secure2: u64::MAX,
    };

    /// The sides in order around the cell, as indices of neighbours; none if the cell is not certified.
    #[must_use]
    pub fn sides(&self) -> &[u8] {
        &self.sides[..self.count]
    }

    /// Points at a larger squared distance cannot touch the cell: four times the squared radius of security,
    /// rounded up.
    #[must_use]
    pub fn reach2(&self) -> u64 {
        self.secure2
    }
}

type Lines = [LineGroup; MOST_NEIGHBORS / LANES];
type Lanes<T> = [T; TOGETHER];

/// The lines of a guess in order, as columns of their normals, offsets and lengths; the first one again after
/// the last.
type Around = [[f64; MOST_SIDES + 1]; 4];

/// The corners of a cell in columns: x, y, and the part of the error bound that depends on no line.
type Corners = [[f64; MOST_SIDES]; 3];

/// Memory for cells that are computed together.
#[derive(Debug, Clone)]
pub struct Wrapper {
    level: Level,
    frames: Lanes<Frame>,
    lines: Lanes<Lines>,
    /// Points of the dual, by coordinate, neighbour and lane.
    dual: [[Lanes<f32>; MOST_NEIGHBORS]; 2],
    /// The sides of the guesses, by place around the cell and lane.
    sides: [Lanes<u32>; MOST_SIDES],
    around: Lanes<Around>,
    corners: Lanes<Corners>,
    outlines: Lanes<Outline>,
}

impl Default for Wrapper {
    fn default() -> Self {
        Self::at(Level::best())
    }
}

impl Wrapper {
    /// With the kernels of `level`; levels differ only in speed.
    #[must_use]
    pub fn at(level: Level) -> Self {
        Self {
            level,
            frames: Default::default(),
            lines: Default::default(),
            dual: [[[0.0; TOGETHER]; MOST_NEIGHBORS]; 2],
            sides: [[0; TOGETHER]; MOST_SIDES],
            around: [[[0.0; MOST_SIDES + 1]; 4]; TOGETHER],
            corners: [[[0.0; MOST_SIDES]; 3]; TOGETHER],
            outlines: [Outline::NONE; TOGETHER],
        }
    }

    /// Computes the cells of the first [`TOGETHER`] sites.
    pub fn wrap(&mut self, sites: &[Site<'_>]) {
        wrap(self.level, self, &sites[..sites.len().min(TOGETHER)]);
    }

    /// The cell of the site at a place.
    #[must_use]
    pub fn outline(&self, place: usize) -> &Outline {
        &self.outlines[place]
    }

    /// True if none of the points in `columns` touches the cell of the site at a place, whose position is
    /// `own`; only points at more than the squared distance `known2` count.
    #[must_use]
    pub fn is_clear(&self, place: usize, own: Point, known2: u64, columns: [&[i32]; 3]) -> bool {
        is_clear(self.level, self, place, own, known2, columns)
    }
}

kernel! {
    /// See [`Wrapper::is_clear`].
    fn is_clear(
        wrapper: &Wrapper,
        place: usize,
        own: Point,
        known2: u64,
        columns: [&[i32]; 3],
    ) -> bool = is_clear_body<Eight>
}

#[inline(always)]
fn is_clear_body<E: Eight>(
    wrapper: &Wrapper,
    lane: usize,
    own: Point,
    known2: u64,
    [x, y, z]: [&[i32]; 3],
) -> bool {
    let (frame, outline) = (&wrapper.frames[lane], &wrapper.outlines[lane]);
    let [corner_x, corner_y, errors] = &wrapper.corners[lane];
    // Far distances are rounded; then more points count.
    let exact = known2 < 1 << 52;
    let known = E::splat(known2 as f64 * if exact { 0.5 } else { 0.5 - SLACK });
    let secure = E::splat(outline.secure2 as f64 * (0.5 + SLACK));
    for start in (0..x.len()).step_by(LANES) {
        let group = start..(start + LANES).min(x.len());
        let mut from = [[0; LANES]; 3];
        for ((from, column), own) in from.iter_mut().zip([x, y, z]).zip(own) {
            for (from, at) in from.iter_mut().zip(&column[group.clone()]) {
                *from = at.wrapping_sub(own);
            }
        }
        let lines = bisectors_body::<E>(&from[0], &from[1], &from[2], frame);
        let halves = E::load(&lines.offset);
        let near = halves.greater(known) & !halves.greater(secure) & 0xff;
        if near == 0 {
            continue;
        }
        let corners = corner_x
            .iter()
            .zip(corner_y)
            .zip(errors)
            .take(outline.count);
        let corners = corners.map(|((x, y), error)| Place::new(*x, *y, *error));
        if touching_places_body::<E>(corners, &lines) & near != 0 {
            return false;
        }
    }
    true
}

kernel! {
    /// Computes the outlines of at most [`TOGETHER`] sites.
    fn wrap(wrapper: &mut Wrapper, sites: &[Site<'_>]) = wrap_body<Eight>
}

#[inline(always)]
fn wrap_body<E: Eight + Sixteen>(wrapper: &mut Wrapper, sites: &[Site<'_>]) {
    let mut most = 0;
    // By coordinate and half of the neighbours.
    let mut rows = [[[[0.0; TOGETHER]; TOGETHER]; 2]; 2];
    for (half, sites) in sites.chunks(LANES).enumerate() {
        let frames = frames::<E>(sites);
        for (place, site) in sites.iter().enumerate() {
            let lane = half * LANES + place;
            let frame = frames.map(|vector| vector.map(|column| column[place]));
            wrapper.frames[lane] = frame;
            let lines = &mut wrapper.lines[lane];
            let [x, y, z] = site.differences.map(|column| column.as_chunks::<LANES>().0);
            for (((x, y), z), lines) in x.iter().zip(y).zip(z).zip(&mut *lines) {
                *lines = bisectors_body::<E>(x, y, z, &frame);
            }
            let rows = rows
                .each_mut()
                .map(|rows| rows.each_mut().map(|rows| &mut rows[lane]));
            set_dual::<E>(lines, site.count, rows);
            most = site.count.max(most);
        }
    }
    let halves = wrapper
        .dual
        .iter_mut()
        .flat_map(|dual| dual.as_chunks_mut().0);
    for (rows, half) in rows.iter().flatten().zip(halves) {
        E::store_turned(rows, half);
    }
    let counts = guess_body::<E>(&wrapper.dual, most, sites.len(), &mut wrapper.sides);
    // In two steps: what is written number by number is then not read at once as a whole.
    for (lane, around) in wrapper.around.iter_mut().enumerate().take(sites.len()) {
        let outline = &mut wrapper.outlines[lane];
        for (to, sides) in outline.sides.iter_mut().zip(&wrapper.sides) {
            *to = sides[lane] as u8;
        }
        outline.count = counts[lane] as usize;
        if !line_up(&wrapper.lines[lane], outline.sides(), around) {
            outline.count = 0;
        }
    }
    for (lane, site) in sites.iter().enumerate() {
        let (outline, corners) = (&mut wrapper.outlines[lane], &mut wrapper.corners[lane]);
        let (lines, around) = (&wrapper.lines[lane], &wrapper.around[lane]);
        let reach2 = (outline.count > 0)
            .then(|| certify::<E>(site, lines, outline.sides(), around, corners))
            .flatten();
        match reach2 {
            Some(reach2) => outline.secure2 = reach2,
            None => *outline = Outline::NONE,
        }
    }
}

/// Two unit vectors that span the plane of each site, in columns. Any two do for a certificate.
#[inline(always)]
fn frames<E: Eight>(sites: &[Site<'_>]) -> [[[f64; LANES]; 3]; 2] {
    // Along z where there is no site.
    let mut columns = [[0.0; LANES], [0.0; LANES], [1.0; LANES]];
    for (place, site) in sites.iter().enumerate() {
        for (column, x) in columns.iter_mut().zip(site.normal) {
            column[place] = f64::from(x);
        }
    }
    let [x, y, z] = &columns;
    let [x, y, z] = [E::load(x), E::load(y), E::load(z)];
    let zero = E::splat(0.0);
    // Across x or y, whichever is farther from the normal.
    let is_along_x = x.abs().greater(y.abs());
    let across = E::choose(is_along_x, [zero - z, zero, x], [zero, z, zero - y]);
    let u = unit::<E>(across);
    let n = unit::<E>([x, y, z]);
    let v = [
        n[1] * u[2] - n[2] * u[1],
        n[2] * u[0] - n[0] * u[2],
        n[0] * u[1] - n[1] * u[0],
    ];
    let mut frames = [[[0.0; LANES]; 3]; 2];
    for (to, vector) in frames.iter_mut().zip([u, v]) {
        for (to, x) in to.iter_mut().zip(vector) {
            x.store(to);
        }
    }
    frames
}

#[inline(always)]
fn unit<E: Eight>([x, y, z]: [E; 3]) -> [E; 3] {
    let length = (x * x + y * y + z * z).sqrt();
    let inverse = E::splat(1.0) / length;
    [x * inverse, y * inverse, z * inverse]
}

/// The lines as points of the dual, in rows by coordinate and half; the origin for places without a line.
#[inline(always)]
fn set_dual<E: Eight + Sixteen>(lines: &Lines, count: usize, rows: [[&mut Lanes<f32>; 2]; 2]) {
    let one = E::floats(&[1.0; TOGETHER]);
    let [rows_x, rows_y] = rows;
    let halves = lines.as_chunks::<2>().0.iter().enumerate();
    for ((half, [low, high]), (row_x, row_y)) in halves.zip(rows_x.into_iter().zip(rows_y)) {
        let offset = E::rounded(E::load(&low.offset), E::load(&high.offset));
        let inverse = E::over(one, offset);
        let x = E::rounded(E::load(&low.x), E::load(&high.x));
        let y = E::rounded(E::load(&low.y), E::load(&high.y));
        let left = count.saturating_sub(half * TOGETHER).min(TOGETHER);
        for (row, x) in [(row_x, x), (row_y, y)] {
            E::store_floats(E::times(x, inverse), row);
            row[left..].fill(0.0);
        }
    }
}

/// Wraps the hulls of the first `lanes` lanes, counter-clockwise. Returns their numbers of sides, 0 where
/// there are too many.
#[inline(always)]
fn guess_body<S: Sixteen>(
    dual: &[[Lanes<f32>; MOST_NEIGHBORS]; 2],
    count: usize,
    lanes: usize,
    sides: &mut [Lanes<u32>; MOST_SIDES],
) -> Lanes<u32> {
    let rows = count.next_multiple_of(CHAINS).min(MOST_NEIGHBORS);
    let duals = [&dual[0][..rows], &dual[1][..rows]];
    let first = nearest_lines::<S>(duals);
    let mut side = first;
    let mut at = points_of(dual, &side);
    // Backwards along the tangent; the hull is to the left of the tangent.
    let mut back = [[0.0; TOGETHER]; 2];
    for l in 0..TOGETHER {
        (back[0][l], back[1][l]) = (at[1][l], -at[0][l]);
    }
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

/// The numbers of the lines nearest to the centre.
#[inline(always)]
fn nearest_lines<S: Sixteen>([dual_x, dual_y]: [&[Lanes<f32>]; 2]) -> Lanes<u32> {
    let zero = S::floats(&[0.0; TOGETHER]);
    let mut far = [(zero, S::integer(0)); CHAINS];
    let rows = dual_x.chunks_exact(CHAINS).zip(dual_y.chunks_exact(CHAINS));
    for (chunk, (dual_x, dual_y)) in (0u32..).zip(rows) {
        for (link, far) in far.iter_mut().enumerate() {
            let (x, y) = (S::floats(&dual_x[link]), S::floats(&dual_y[link]));
            let far2 = S::minus(S::times(x, x), S::times(S::minus(zero, y), y));
            let take = S::less(far.0, far2);
            let number = S::integer(chunk * CHAINS as u32 + link as u32);
            *far = (
                S::choose(take, far2, far.0),
                S::choose_integers(take, number, far.1),
            );
        }
    }
    let (mut most, mut number) = far[0];
    for other in &far[1..] {
        let take = S::less(most, other.0);
        most = S::choose(take, other.0, most);
        number = S::choose_integers(take, other.1, number);
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

/// Writes the lines `sides` to `around`; false if they are not the sides of a cell.
#[inline(always)]
fn line_up(lines: &Lines, sides: &[u8], around: &mut Around) -> bool {
    let [x, y, offset, length] = around;
    let again = sides.iter().chain(sides.first());
    for (place, side) in again.enumerate() {
        let (group, k) = (*side as usize / LANES, *side as usize % LANES);
        let Some(lines) = lines.get(group) else {
            return false;
        };
        x[place] = lines.x[k];
        y[place] = lines.y[k];
        offset[place] = lines.offset[k];
        length[place] = lines.length[k];
    }
    sides.len() >= 3
}

/// Four times the squared radius of security if the lines `sides`, in this order, are the sides of the cell,
/// far from the rim. Writes the corners.
#[inline(always)]
fn certify<E: Eight>(
    site: &Site<'_>,
    lines: &Lines,
    sides: &[u8],
    around: &Around,
    corners: &mut Corners,
) -> Option<u64> {
    let [corner_x, corner_y, errors] = corners;
    let mut reaches = [0.0; MOST_SIDES];
    for start in (0..sides.len()).step_by(LANES) {
        let (these, next) = (
            load_lines::<E>(around, start),
            load_lines::<E>(around, start + 1),
        );
        let ([x, y], error, reach2) = meet_columns(these, next);
        let near = E::splat(SLACK).mul(x.abs().add(y.abs()));
        let to = start..start + LANES;
        store(x, &mut corner_x[to.clone()]);
        store(y, &mut corner_y[to.clone()]);
        store(error.add(near), &mut errors[to.clone()]);
        store(reach2, &mut reaches[to]);
    }
    let mut reach2 = 0.0f64;
    let (mut unclear, mut seen) = (0, 0);
    for (place, side) in sides.iter().enumerate() {
        reach2 = reach2.max(reaches[place]);
        let next = sides.get(place + 1).unwrap_or(&sides[0]);
        let own = 1u64 << side | 1 << next;
        let corner = [corner_x[place], corner_y[place], errors[place]];
        unclear |= !(clear_lines::<E>(lines, corner) | own);
        seen |= 1u64 << side;
    }
    let clear = unclear & ((1 << site.count) - 1) == 0;
    // A side has two corners: if all sides are different, they close around the cell once.
    let once = seen.count_ones() as usize == sides.len();
    let secure2 = 4.0 * reach2 * (1.0 + 1e-9);
    // At half the distance of the rim: its sides, and what rounding decides there, do not matter.
    let rim = site.radius * RIM_DISTANCE;
    (clear && once && secure2 <= rim * rim).then_some((secure2 as u64).saturating_add(1))
}

/// Eight lines.
#[inline(always)]
fn load_lines<E: Eight>([x, y, offset, length]: &Around, start: usize) -> [E; 4] {
    let (x, y) = (load::<E>(x, start), load::<E>(y, start));
    [x, y, load::<E>(offset, start), load::<E>(length, start)]
}

#[inline(always)]
fn load<E: Eight>(column: &[f64], start: usize) -> E {
    let lanes = column[start..].first_chunk();
    E::load(lanes.unwrap_or(&[0.0; LANES]))
}

#[inline(always)]
fn store<E: Eight>(lanes: E, to: &mut [f64]) {
    if let Some(to) = to.first_chunk_mut() {
        lanes.store(to);
    }
}

/// Bit `k` is set if line `k` certainly does not cut off the corner. See
/// [`crate::kernels::touching_lines`].
#[inline(always)]
fn clear_lines<E: Eight>(lines: &Lines, [x, y, error]: [f64; 3]) -> u64 {
    let (x, y, error) = (E::splat(x), E::splat(y), E::splat(error));
    let slack = E::splat(SLACK);
    let mut clear = 0;
    for (group, lines) in lines.iter().enumerate() {
        let offset = E::load(&lines.offset);
        let depth = E::load(&lines.x)
            .mul(x)
            .add(E::load(&lines.y).mul(y))
            .sub(offset);
        let bound = E::load(&lines.length).mul(error).add(slack.mul(offset));
        clear |= E::splat(0.0).sub(depth).greater(bound) << (group * LANES);
    }
    clear
}

#[cfg(test)]
mod tests {
    use super::super::Cell;
    use super::*;
    use proptest::prelude::*;

    type Differences = Vec<[i32; 3]>;

    /// Anywhere, in a plane, on a grid in a plane (with many co-circular points), or around a circle.
    fn clouds() -> impl Strategy<Value = Differences> {
        let all = |from: i32| prop::collection::vec(prop::array::uniform3(-from..from), 3..=32);
        prop_oneof![
            2 => all(1 << 20),
            1 => all(1 << 29),
            4 => (all(1 << 12), 0i32..1 << 8).prop_map(|(all, thick)| {
                all.iter().map(|[x, y, z]| [*x, *y, z % (thick + 1)]).collect()
            }),
            2 => all(4).prop_map(|all| all.iter().map(|[x, y, _]| [*x, *y, 0]).collect()),
            1 => (3usize..32, 10.0f64..1e6).prop_map(|(count, radius)| {
                let at = |k: usize| (k as f64 * std::f64::consts::TAU / count as f64).sin_cos();
                (0..count).map(at).map(|(s, c)| [(s * radius) as i32, (c * radius) as i32, 0]).collect()
            }),
        ]
    }

    fn length2(d: &[i32; 3]) -> u64 {
        d.iter().map(|c| i64::from(*c).pow(2) as u64).sum()
    }

    /// The pairs of neighbours at the corners of the cell, clipped line by line, and its reach.
    fn clipped(differences: &[[i32; 3]], site: &Site<'_>) -> (Vec<(u32, u32)>, u64) {
        let mut cell = Cell::new(1000, site.normal, site.radius);
        let mut numbers: Vec<u32> = (0..differences.len() as u32).collect();
        numbers.sort_by_key(|n| (length2(&differences[*n as usize]), *n));
        for number in numbers {
            cell.clip(differences[number as usize].map(i64::from), number);
        }
        let mut pairs = Vec::new();
        cell.triples(|a, b| pairs.push((a.min(b), a.max(b))));
        pairs.sort_unstable();
        (pairs, cell.reach2())
    }

    fn pairs(outline: &Outline) -> Vec<(u32, u32)> {
        let sides = outline.sides();
        let next = sides.iter().cycle().skip(1);
        let mut pairs: Vec<_> = (sides.iter().zip(next))
            .map(|(a, b)| (u32::from(*a.min(b)), u32::from(*a.max(b))))
            .collect();
        pairs.sort_unstable();
        pairs
    }

    fn columns(differences: &[[i32; 3]]) -> [[i32; MOST_NEIGHBORS]; 3] {
        let mut columns = [[0; MOST_NEIGHBORS]; 3];
        for (place, difference) in differences.iter().enumerate() {
            for (column, at) in columns.iter_mut().zip(difference) {
                column[place] = *at;
            }
        }
        columns
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(1000))]
        #[test]
        fn certified_cells_are_those_of_clipping(
            clouds in prop::collection::vec(clouds(), 1..=TOGETHER),
            normal in prop_oneof![
                3 => Just([0, 0, 1 << 24]),
                1 => (-9i32..9, -9i32..9).prop_map(|(x, y)| [x << 18, y << 18, 1 << 24]),
            ],
            radius in prop_oneof![3 => Just(1e10), 1 => 1.0f64..1e6],
            near in 0usize..40,
        ) {
            let clouds: Vec<Differences> = clouds.into_iter().map(|all| {
                let mut all: Vec<_> = all.into_iter().filter(|d| *d != [0; 3]).collect();
                all.sort_by_key(length2);
                all
            }).collect();
            // Some of the neighbours are first left out, and examined later.
            let near: Vec<_> = clouds.iter().map(|all| {
                let last2 = all.get(near).or(all.last()).map_or(0, length2);
                all.partition_point(|d| length2(d) <= last2)
            }).collect();
            let columns: Vec<_> = clouds.iter().zip(&near)
                .map(|(all, near)| columns(&all[..*near])).collect();
            let sites: Vec<_> = columns.iter().zip(&near).map(|(columns, near)| Site {
                differences: columns.each_ref(),
                count: *near,
                normal,
                radius,
            }).collect();
            for level in Level::all() {
                let mut wrapper = Wrapper::at(level);
                wrapper.wrap(&sites);
                for (place, ((cloud, site), near)) in clouds.iter().zip(&sites).zip(&near).enumerate() {
                    let outline = wrapper.outline(place);
                    let pairs = pairs(outline);
                    if pairs.is_empty() {
                        continue;
                    }
                    let (expected, reach2) = clipped(&cloud[..*near], site);
                    prop_assert_eq!(&pairs, &expected);
                    prop_assert!(outline.reach2().abs_diff(reach2) <= reach2 >> 20);
                    let own = [1 << 28; 3];
                    let all = [0, 1, 2].map(|axis| cloud.iter().map(|d| d[axis] + own[axis]).collect::<Vec<_>>());
                    let known2 = cloud[..*near].last().map_or(0, length2);
                    let all = all.each_ref().map(|column| &column[..]);
                    if wrapper.is_clear(place, own, known2, all) {
                        prop_assert_eq!(&pairs, &clipped(cloud, site).0);
                    }
                }
            }
        }

        /// Also where the last lanes are not used, and after cells with more neighbours.
        #[test]
        fn cells_of_scattered_points_are_certified(
            clouds in prop::collection::vec(
                prop::collection::vec((-1i32 << 24..1 << 24, -1i32 << 24..1 << 24), 20..=32), 1..=2 * TOGETHER),
        ) {
            let mut known = 0;
            let clouds: Vec<Differences> = clouds.iter()
                .map(|all| all.iter().map(|(x, y)| [*x | 1, *y, (x ^ y) % 64]).collect()).collect();
            for level in Level::all() {
                let mut wrapper = Wrapper::at(level);
                for clouds in clouds.chunks(TOGETHER) {
                    let columns: Vec<_> = clouds.iter().map(|all| columns(all)).collect();
                    let sites: Vec<_> = clouds.iter().zip(&columns).map(|(cloud, columns)| Site {
                        differences: columns.each_ref(),
                        count: cloud.len(),
                        normal: [0, 0, 1 << 24],
                        radius: 1e10,
                    }).collect();
                    wrapper.wrap(&sites);
                    for (place, (cloud, site)) in clouds.iter().zip(&sites).enumerate() {
                        let outline = wrapper.outline(place);
                        let (pairs, _) = clipped(cloud, site);
                        // On the rim, or with more sides than there is room for.
                        let closed = pairs.len() >= 3 && {
                            let mut ends: Vec<_> = pairs.iter().flat_map(|(a, b)| [a, b]).collect();
                            ends.sort_unstable();
                            ends.chunk_by(|a, b| a == b).all(|same| same.len() == 2)
                        };
                        known += usize::from(closed);
                        prop_assert!(!closed || outline.sides().len() == pairs.len());
                    }
                }
            }
            prop_assert!(known * 2 > clouds.len());
        }
    }
}
