//! A cell with few edges, divided into trapezoids.

use super::super::convex::Convex;
use outcrop_geom::vector::V3;

type P2 = [f64; 2];

/// An edge that is not upright in plan, its left end first.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Line(P2, P2);

impl Line {
    fn at(&self, x: f64) -> f64 {
        let (a, b) = (self.0, self.1);
        let share = ((x - a[0]) / (b[0] - a[0])).clamp(0.0, 1.0);
        a[1] + share * (b[1] - a[1])
    }

    /// Above 0 for what is above it, linear.
    fn above(&self, p: V3) -> f64 {
        let (a, b) = (self.0, self.1);
        (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])
    }

    /// The x where it passes the height `y`.
    fn passes(&self, y: f64) -> Option<f64> {
        let (a, b) = (self.0, self.1);
        let share = (y - a[1]) / (b[1] - a[1]);
        (0.0..=1.0)
            .contains(&share)
            .then(|| a[0] + share * (b[0] - a[0]))
    }

    /// The x where two lines cross.
    fn crosses(&self, other: &Self) -> Option<f64> {
        let [d, e, f] = [
            [self.1[0] - self.0[0], self.1[1] - self.0[1]],
            [other.1[0] - other.0[0], other.1[1] - other.0[1]],
            [other.0[0] - self.0[0], other.0[1] - self.0[1]],
        ];
        let cross = |a: P2, b: P2| a[0] * b[1] - a[1] * b[0];
        let share = cross(f, e) / cross(d, e);
        (0.0..=1.0)
            .contains(&share)
            .then(|| self.0[0] + share * d[0])
    }
}

/// A part of a cell that is inside: between two x, above and below lines, where it has them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Trapezoid {
    x: [f64; 2],
    /// The line below, and the line above.
    lines: [Option<Line>; 2],
}

impl Trapezoid {
    pub fn cut(&self, part: &Convex, [min, max]: [P2; 2]) -> Convex {
        let [low, high] = self.x;
        let mut cut = *part;
        if max[0] <= low || min[0] >= high {
            return cut.cut(|_| -1.0);
        }
        if min[0] < low {
            cut.keep(|p| p[0] - low);
        }
        if max[0] > high {
            cut.keep(|p| high - p[0]);
        }
        if let Some(line) = self.lines[0] {
            cut.keep(|p| line.above(p));
        }
        if let Some(line) = self.lines[1] {
            cut.keep(|p| -line.above(p));
        }
        cut
    }
}

/// Appends the trapezoids of a cell with these edges that are inside, as `contains` tells of places.
pub(super) fn slabs(
    bounds: [P2; 2],
    edges: &[[P2; 2]],
    contains: &impl Fn(P2) -> bool,
    parts: &mut Vec<Trapezoid>,
) {
    let [low, high] = bounds;
    let lines = edges.iter().filter(|[a, b]| a[0] != b[0]);
    let lines = lines.map(|[a, b]| {
        if a[0] < b[0] {
            Line(*a, *b)
        } else {
            Line(*b, *a)
        }
    });
    let lines: Vec<Line> = lines.collect();
    let mut at: Vec<f64> = edges.iter().flatten().map(|end| end[0]).collect();
    for (number, line) in lines.iter().enumerate() {
        at.extend(
            lines[..number]
                .iter()
                .filter_map(|other| line.crosses(other)),
        );
        at.extend([low[1], high[1]].iter().filter_map(|y| line.passes(*y)));
    }
    at.retain(|x| low[0] < *x && *x < high[0]);
    at.extend([low[0], high[0]]);
    at.sort_unstable_by(f64::total_cmp);
    at.dedup();
    for pair in at.windows(2) {
        slab([pair[0], pair[1]], bounds, &lines, contains, parts);
    }
}

fn slab(
    x: [f64; 2],
    [low, high]: [P2; 2],
    lines: &[Line],
    contains: &impl Fn(P2) -> bool,
    parts: &mut Vec<Trapezoid>,
) {
    let middle = x[0] / 2.0 + x[1] / 2.0;
    let here = lines.iter().filter(|l| l.0[0] < middle && middle < l.1[0]);
    let here = here.map(|line| (line.at(middle), Some(*line)));
    let mut here: Vec<_> = here
        .filter(|(y, _)| low[1] < *y && *y < high[1])
        .chain([(low[1], None), (high[1], None)])
        .collect();
    here.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut below: Option<Trapezoid> = None;
    for pair in here.windows(2) {
        let is_inside =
            pair[0].0 < pair[1].0 && contains([middle, pair[0].0 / 2.0 + pair[1].0 / 2.0]);
        if !is_inside {
            parts.extend(below.take());
            continue;
        }
        // A line between two parts that are inside is no border.
        let bottom = below.map_or(pair[0].1, |part| part.lines[0]);
        let lines = [bottom, pair[1].1];
        below = Some(Trapezoid { x, lines });
    }
    parts.extend(below);
}
