//! The cells of several points at once, by gift wrapping.
//!
//! In the dual, the line `l · q = o` is the point `l / o`, and the corners of a cell are the sides of the
//! convex hull of these points. Hulls are wrapped in `f32`, one in each lane; they are guesses. A guess is
//! certified as the cell: the intersection of each side with the next, with a bound on its error, must be
//! clear of all other lines. A cell without a certificate has to be clipped ([`super::Cell`]); most of these
//! have co-circular neighbours, or reach beyond the points at hand.

mod hull;

use super::lines::meet_columns;
use super::touch::differences;
use super::{RIM_DISTANCE, secure2};
use crate::kernels::eight::{Eight, loaded, stored};
use crate::kernels::sixteen::Sixteen;
use crate::kernels::{
    Frame, LANES, Level, LineGroup, Place, SLACK, bisectors_body, kernel, touching_places_body,
};
use crate::plane::Normal;
use hull::hulls;
use outcrop_geom::Point;

/// Most points whose cells are computed together, one in each lane.
pub const TOGETHER: usize = 16;

/// Most neighbours of a point.
pub const MOST_NEIGHBORS: usize = 32;

/// Most sides of a cell.
const MOST_SIDES: usize = 2 * LANES;

/// Share of the disk's radius by which a certified cell keeps away from the rim. Rounding moves the rim by less
/// than 10⁻¹⁴ of it.
const RIM_MARGIN: f64 = 1e-6;

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
        let [x, y, z] = differences([x, y, z], start, own);
        let lines = bisectors_body::<E>(&x, &y, &z, frame);
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
    let counts = hulls::<E>(&wrapper.dual, most, sites.len(), &mut wrapper.sides);
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
    let [x, y, z] = loaded::<E, 3>(&columns);
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
    [stored(u), stored(v)]
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
/// inside the rim. Writes the corners.
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
    let (mut touching, mut seen) = (0, 0);
    for (place, side) in sides.iter().enumerate() {
        reach2 = reach2.max(reaches[place]);
        let next = sides.get(place + 1).unwrap_or(&sides[0]);
        let own = 1u64 << side | 1 << next;
        let corner = Place::new(corner_x[place], corner_y[place], errors[place]);
        touching |= touching_lines::<E>(lines, corner) & !own;
        seen |= 1u64 << side;
    }
    let clear = touching & ((1 << site.count) - 1) == 0;
    // A side has two corners: if all sides are different, they close around the cell once.
    let once = seen.count_ones() as usize == sides.len();
    // Inside the rim: its sides, and what rounding decides there, do not matter. (What is rounded to an
    // integer would not show a corner beyond the rim of a disk larger than any cloud.)
    let rim = site.radius * (RIM_DISTANCE - RIM_MARGIN);
    (clear && once && reach2 <= rim * rim).then(|| secure2(reach2))
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

/// Bit `k` is set unless line `k` certainly does not cut off the corner.
#[inline(always)]
fn touching_lines<E: Eight>(lines: &Lines, corner: Place) -> u64 {
    let mut touching = 0;
    for (group, lines) in lines.iter().enumerate() {
        touching |= touching_places_body::<E>(std::iter::once(corner), lines) << (group * LANES);
    }
    touching
}

#[cfg(test)]
mod tests;
