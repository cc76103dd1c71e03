//! The distance between a tile and its children, both ways.
//!
//! From the finer surface to the coarser it is measured at all vertices, at the centres of all triangles and in the
//! middles of their edges. Only the largest matters, so points that are certainly nearer are passed over.
//!
//! From the coarser to the finer there is a bound for all points. A part of a triangle is at most as far from the
//! other surface as from any one triangle of it; since that is convex, the largest distance from it is at a corner of
//! the part. So one triangle near the middle of the part gives a bound; where it is not good enough the part is
//! divided.

use crate::inspect::compare::distance2;

type V3 = [f64; 3];

/// A surface: points and corners.
#[derive(Clone, Copy)]
pub(super) struct Surface<'a> {
    pub points: &'a [V3],
    pub triangles: &'a [[u32; 3]],
}

impl Surface<'_> {
    fn corners(&self, triangle: usize) -> [V3; 3] {
        self.triangles[triangle].map(|corner| self.points[corner as usize])
    }
}

/// Triangles by the cells of a grid.
struct Grid<'a> {
    surface: Surface<'a>,
    low: V3,
    side: f64,
    size: [usize; 3],
    starts: Vec<u32>,
    /// The triangles of the cells, with balls around them.
    triangles: Vec<Ball>,
}

/// A triangle and a ball that holds it.
#[derive(Clone, Copy, Default)]
struct Ball {
    middle: [f32; 3],
    radius: f32,
    triangle: u32,
}

impl Ball {
    fn of(corners: [V3; 3], triangle: u32) -> Self {
        let middle = between(corners, [1.0 / 3.0; 3]).map(|x| x as f32);
        let reach = corners.map(|c| {
            (0..3)
                .map(|k| (c[k] - f64::from(middle[k])).powi(2))
                .sum::<f64>()
        });
        let radius = reach.into_iter().fold(0.0, f64::max).sqrt();
        Self {
            middle,
            radius: radius as f32 * 1.000_01,
            triangle,
        }
    }

    /// True if all of it is certainly farther from `p` than `most`.
    fn is_farther(&self, p: V3, most: f64) -> bool {
        let reach = most + f64::from(self.radius);
        let from = (0..3).map(|k| (p[k] - f64::from(self.middle[k])).powi(2));
        from.sum::<f64>() > reach * reach
    }
}

fn longest([a, b, c]: [V3; 3]) -> f64 {
    let edge = |p: V3, q: V3| (0..3).map(|k| (p[k] - q[k]) * (p[k] - q[k])).sum::<f64>();
    edge(a, b).max(edge(b, c)).max(edge(c, a)).sqrt()
}

impl<'a> Grid<'a> {
    fn new(surface: Surface<'a>) -> Self {
        let (mut low, mut high, mut sides) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3], 0.0);
        for number in 0..surface.triangles.len() {
            let corners = surface.corners(number);
            sides += longest(corners);
            for corner in corners {
                for k in 0..3 {
                    low[k] = low[k].min(corner[k]);
                    high[k] = high[k].max(corner[k]);
                }
            }
        }
        let count = surface.triangles.len();
        let span: V3 = std::array::from_fn(|k| (high[k] - low[k]).max(0.0));
        let mut side = (sides / count as f64).max(1e-9);
        let size = |side: f64| span.map(|s| (s / side) as usize + 1);
        let cells = |size: [usize; 3]| size.iter().fold(1usize, |n, s| n.saturating_mul(*s));
        while cells(size(side)) > 4 * count + 64 {
            side *= 1.25;
        }
        let mut grid = Self {
            surface,
            low,
            side,
            size: size(side),
            starts: Vec::new(),
            triangles: Vec::new(),
        };
        grid.fill(cells(grid.size));
        grid
    }

    fn fill(&mut self, cells: usize) {
        let mut starts = vec![0u32; cells + 2];
        for number in 0..self.surface.triangles.len() {
            self.around(number, |cell| starts[cell + 2] += 1);
        }
        (2..cells + 2).for_each(|cell| starts[cell] += starts[cell - 1]);
        let mut triangles = vec![Ball::default(); starts[cells + 1] as usize];
        for number in 0..self.surface.triangles.len() {
            let ball = Ball::of(self.surface.corners(number), number as u32);
            self.around(number, |cell| {
                triangles[starts[cell + 1] as usize] = ball;
                starts[cell + 1] += 1;
            });
        }
        (self.starts, self.triangles) = (starts, triangles);
    }

    fn cell(&self, p: V3) -> [usize; 3] {
        std::array::from_fn(|k| {
            let at = ((p[k] - self.low[k]) / self.side).max(0.0) as usize;
            at.min(self.size[k] - 1)
        })
    }

    fn number(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.size[1] + y) * self.size[0] + x
    }

    /// The cells of the box around a triangle.
    fn around(&self, triangle: usize, mut each: impl FnMut(usize)) {
        let [a, b, c] = self
            .surface
            .corners(triangle)
            .map(|corner| self.cell(corner));
        let low: [usize; 3] = std::array::from_fn(|k| a[k].min(b[k]).min(c[k]));
        let high: [usize; 3] = std::array::from_fn(|k| a[k].max(b[k]).max(c[k]));
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                (low[0]..=high[0]).for_each(|x| each(self.number([x, y, z])));
            }
        }
    }

    /// The distance to the nearest triangle if it is more than `enough`; otherwise any number up to that.
    fn distance(&self, p: V3, enough: f64) -> f64 {
        let middle = self.cell(p);
        let mut best = f64::INFINITY;
        let farthest = self.size.iter().max().copied().unwrap_or(1);
        for ring in 0..=farthest {
            // Whatever is in no cell yet looked at is farther than the cells between.
            let between = ring.saturating_sub(1) as f64 * self.side;
            if best <= between {
                break;
            }
            self.ring(middle, ring, |cell| {
                let range = self.starts[cell] as usize..self.starts[cell + 1] as usize;
                for ball in &self.triangles[range] {
                    if !ball.is_farther(p, best) {
                        let corners = self.surface.corners(ball.triangle as usize);
                        best = best.min(distance2(&corners, p).sqrt());
                        if best <= enough {
                            return true;
                        }
                    }
                }
                false
            });
            if best <= enough {
                break;
            }
        }
        best
    }

    /// A bound of the distances of all points of a triangle from this surface, and the distance of its middle. It is
    /// the best that one triangle gives, or the first that is at most `enough`; then the distance may be larger.
    fn bound(&self, part: [V3; 3], enough: f64) -> (f64, f64) {
        let p = between(part, [1.0 / 3.0; 3]);
        let middle = self.cell(p);
        let (mut best, mut bound) = (f64::INFINITY, f64::INFINITY);
        let reach = reach(part, p);
        let farthest = self.size.iter().max().copied().unwrap_or(1);
        for ring in 0..=farthest {
            // Whatever is in no cell yet looked at is farther than the cells between.
            let between = ring.saturating_sub(1) as f64 * self.side;
            if best <= between {
                break;
            }
            self.ring(middle, ring, |cell| {
                let range = self.starts[cell] as usize..self.starts[cell + 1] as usize;
                for ball in &self.triangles[range] {
                    if ball.is_farther(p, best) {
                        continue;
                    }
                    let corners = self.surface.corners(ball.triangle as usize);
                    let distance = distance2(&corners, p).sqrt();
                    if distance < best {
                        best = distance;
                        bound = bound.min(distance + reach);
                        if bound > enough {
                            let ends = part.map(|corner| distance2(&corners, corner));
                            bound = bound.min(ends.into_iter().fold(0.0, f64::max).sqrt());
                        }
                        if bound <= enough {
                            return true;
                        }
                    }
                }
                false
            });
            if bound <= enough {
                break;
            }
        }
        (bound, best)
    }

    /// Calls `each` with the cells at this distance from one, counted in cells, until it returns true.
    fn ring(&self, middle: [usize; 3], ring: usize, mut each: impl FnMut(usize) -> bool) {
        let low: [usize; 3] = std::array::from_fn(|k| middle[k].saturating_sub(ring));
        let high: [usize; 3] = std::array::from_fn(|k| (middle[k] + ring).min(self.size[k] - 1));
        let on = |k: usize, at: usize| at.abs_diff(middle[k]) == ring;
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                if on(2, z) || on(1, y) {
                    for x in low[0]..=high[0] {
                        if each(self.number([x, y, z])) {
                            return;
                        }
                    }
                } else {
                    let ends = [middle[0].checked_sub(ring), Some(middle[0] + ring)];
                    for x in ends.into_iter().flatten().filter(|x| *x < self.size[0]) {
                        if each(self.number([x, y, z])) {
                            return;
                        }
                    }
                }
            }
        }
    }
}

/// A point of a triangle is at most this times its longest edge from the nearest corner.
const REACH: f64 = 0.577_350_27;

/// Factor of the largest distance at a point, since it may be larger between them, and for bounds that are good
/// enough.
const MARGIN: f64 = 1.1;

/// The least bound, in steps, so that finer tiles are always better.
const LEAST: f64 = 0.5;

/// How often a triangle is halved at most.
const HALVINGS: u32 = 8;

/// A bound of the distance of each surface from the other, at least [`LEAST`]; that of the finer from the coarser is
/// measured at points. The coarser has vertices of the finer, in the same list.
pub(super) fn measure(fine: Surface<'_>, coarse: Surface<'_>) -> f64 {
    if fine.triangles.is_empty() {
        return LEAST;
    }
    if coarse.triangles.is_empty() {
        return f64::INFINITY;
    }
    let mut kept = vec![false; fine.points.len()];
    coarse
        .triangles
        .as_flattened()
        .iter()
        .for_each(|v| kept[*v as usize] = true);
    let mut found = Found {
        point: from_fine(fine, &Grid::new(coarse), &kept),
        part: 0.0,
    };
    let mut grid = None;
    for number in 0..coarse.triangles.len() {
        let corners = coarse.corners(number);
        if longest(corners) * REACH > found.limit() {
            let grid = grid.get_or_insert_with(|| Grid::new(fine));
            found.look(corners, grid);
        }
    }
    found.limit()
}

fn between(corners: [V3; 3], weights: V3) -> V3 {
    std::array::from_fn(|k| (0..3).map(|n| weights[n] * corners[n][k]).sum())
}

fn apart(a: V3, b: V3) -> f64 {
    let squares = (0..3).map(|k| (a[k] - b[k]) * (a[k] - b[k]));
    squares.sum::<f64>().sqrt()
}

/// The distance of the farthest corner.
fn reach(corners: [V3; 3], from: V3) -> f64 {
    corners
        .into_iter()
        .fold(0.0, |most, c| apart(c, from).max(most))
}

/// The halves of a triangle, cut through its longest edge.
fn halves([a, b, c]: [V3; 3]) -> [[V3; 3]; 2] {
    let (ab, bc, ca) = (apart(a, b), apart(b, c), apart(c, a));
    let [a, b, c] = match (ab >= bc && ab >= ca, bc >= ca) {
        (true, _) => [a, b, c],
        (false, true) => [b, c, a],
        (false, false) => [c, a, b],
    };
    let middle = between([a, b, c], [0.5, 0.5, 0.0]);
    [[a, middle, c], [middle, b, c]]
}

/// Distances found so far.
struct Found {
    /// The largest distance of a point.
    point: f64,
    /// The largest bound of a part that was not divided further.
    part: f64,
}

impl Found {
    /// The bound of all that was looked at, and the one up to which nothing needs to be.
    fn limit(&self) -> f64 {
        (self.point * MARGIN).max(self.part).max(LEAST)
    }

    /// Looks at a triangle.
    fn look(&mut self, corners: [V3; 3], other: &Grid<'_>) {
        let mut parts = vec![(corners, 0)];
        while let Some((part, halvings)) = parts.pop() {
            let (bound, distance) = other.bound(part, self.limit());
            if bound <= self.limit() {
                continue;
            }
            self.point = self.point.max(distance);
            if bound <= self.limit() {
                continue;
            }
            if halvings == HALVINGS {
                self.part = self.part.max(bound);
            } else {
                parts.extend(halves(part).map(|half| (half, halvings + 1)));
            }
        }
    }
}

/// The largest distance of points of the finer surface from the coarser, to whose corners its `kept` vertices belong.
fn from_fine(fine: Surface<'_>, coarse: &Grid<'_>, kept: &[bool]) -> f64 {
    // An upper bound for each vertex: its distance from a neighbour that was kept.
    let mut near: Vec<f32> = kept
        .iter()
        .map(|kept| if *kept { 0.0 } else { f32::INFINITY })
        .collect();
    for triangle in fine.triangles {
        for (a, b) in [(0, 1), (1, 2), (2, 0)] {
            let [a, b] = [triangle[a] as usize, triangle[b] as usize];
            if kept[a] != kept[b] {
                let edge = apart(fine.points[a], fine.points[b]);
                let gone = if kept[a] { b } else { a };
                near[gone] = near[gone].min(edge as f32 * 1.000_001);
            }
        }
    }
    let mut farthest = 0.0f64;
    let mut look = |vertex: usize| {
        if f64::from(near[vertex]) > farthest {
            farthest = farthest.max(coarse.distance(fine.points[vertex], farthest));
        }
    };
    // A few first, so that most others can be passed over.
    (0..fine.points.len()).step_by(61).for_each(&mut look);
    (0..fine.points.len()).for_each(&mut look);
    for (number, triangle) in fine.triangles.iter().enumerate() {
        let corners = fine.corners(number);
        let nearest = triangle
            .map(|v| near[v as usize])
            .into_iter()
            .fold(f32::INFINITY, f32::min);
        if f64::from(nearest) + longest(corners) > farthest {
            for weights in SAMPLES {
                farthest = farthest.max(coarse.distance(between(corners, weights), farthest));
            }
        }
    }
    farthest
}

/// Points of a fine triangle: its centre, and the middles of its edges.
const SAMPLES: [V3; 4] = [
    [1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0],
    [0.5, 0.5, 0.0],
    [0.0, 0.5, 0.5],
    [0.5, 0.0, 0.5],
];

#[cfg(test)]
mod tests {
    use super::*;

    /// A square of `side` by `side` points with these heights, and its triangles.
    fn square(side: usize, mut height: impl FnMut() -> f64) -> (Vec<V3>, Vec<[u32; 3]>) {
        let at = |n: usize| [(n % side) as f64 * 10.0, (n / side) as f64 * 10.0];
        let points = (0..side * side).map(at).map(|[x, y]| [x, y, height()]);
        let cells = (0..side * side).filter(|n| n % side + 1 < side && n / side + 1 < side);
        let s = side as u32;
        let triangles = cells.map(|n| n as u32).flat_map(|n| {
            let two = [[n, n + 1, n + s], [n + 1, n + s + 1, n + s]];
            two.into_iter()
        });
        (points.collect(), triangles.collect())
    }

    #[test]
    fn all_points_of_coarse_triangles_are_within_the_bound() {
        let mut random = oorandom::Rand64::new(11);
        for roughness in [0.0, 1.0, 30.0] {
            let side = 9;
            let (points, fine) = square(side, || roughness * random.rand_float());
            let last = (side * side - 1) as u32;
            let (right, up) = (side as u32 - 1, last + 1 - side as u32);
            let coarse = [[0, right, up], [right, last, up]];
            let surface = |triangles| Surface {
                points: &points,
                triangles,
            };
            let bound = measure(surface(&fine), surface(&coarse));
            let grid = Grid::new(surface(&fine));
            let mut farthest = 0.0f64;
            for triangle in 0..2 {
                let corners = surface(&coarse).corners(triangle);
                for (i, j) in (0..=60).flat_map(|i| (0..=60 - i).map(move |j| (i, j))) {
                    let weights = [i, j, 60 - i - j].map(|w| f64::from(w) / 60.0);
                    farthest = farthest.max(grid.distance(between(corners, weights), 0.0));
                }
            }
            assert!(farthest <= bound, "{farthest} {bound}");
            let highest = points.iter().fold(0.0, |most: f64, p| most.max(p[2]));
            assert!(bound <= LEAST.max(1.5 * highest), "{bound} {highest}");
        }
    }
}
