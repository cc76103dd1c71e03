//! The distance between a tile and its children, measured both ways.
//!
//! From the finer surface to the coarser it is measured at all vertices, at the centres of all triangles and in the
//! middles of their edges; from the coarser to the finer at points all over its triangles, about as
//! dense as the vertices of the finer. Each is the exact distance of a point to the nearest triangle. Only the
//! largest matters, so points that are certainly nearer are passed over.

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

/// Most parts into which an edge of a coarse triangle is divided by points.
const PARTS: usize = 6;

/// The largest distance of points of either surface from the other. The coarser has vertices of the finer, in the
/// same list.
pub(super) fn measure(fine: Surface<'_>, coarse: Surface<'_>) -> f64 {
    if fine.triangles.is_empty() {
        return 0.0;
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
    let mut farthest = from_fine(fine, &Grid::new(coarse), &kept);
    let mut grid = None;
    for number in 0..coarse.triangles.len() {
        let corners = coarse.corners(number);
        let edge = longest(corners);
        if edge * REACH <= farthest {
            continue;
        }
        let grid = grid.get_or_insert_with(|| Grid::new(fine));
        let parts = ((edge / grid.side).ceil() as usize).clamp(2, PARTS);
        for i in 0..=parts {
            for j in 0..=parts - i {
                let k = parts - i - j;
                if i.max(j).max(k) < parts {
                    let weights = [i, j, k].map(|w| w as f64 / parts as f64);
                    farthest = farthest.max(grid.distance(between(corners, weights), farthest));
                }
            }
        }
    }
    farthest
}

fn between(corners: [V3; 3], weights: V3) -> V3 {
    std::array::from_fn(|k| (0..3).map(|n| weights[n] * corners[n][k]).sum())
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
                let (p, q) = (fine.points[a], fine.points[b]);
                let edge = (0..3)
                    .map(|k| (p[k] - q[k]) * (p[k] - q[k]))
                    .sum::<f64>()
                    .sqrt();
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
