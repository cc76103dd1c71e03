//! Tests of points against a region: inside, or not farther from it than a margin.

use super::{MOST_CORNERS, NoRegion, Region, in_range};
use crate::boxes::BoxTree;
use robust::{Coord, orient2d};

/// A polygon: its rings, each a list of corners without a repetition of the first. A point is inside if a ray
/// from it crosses the rings an odd number of times, so the rings after the first are holes, in any direction,
/// and rings may cross themselves.
pub type Polygon = Vec<Vec<[f64; 2]>>;

/// Checks that polygons have corners, and not too many.
pub(super) fn check(polygons: &[Polygon]) -> Result<(), NoRegion> {
    let rings = || polygons.iter().flatten();
    let corners: usize = rings().map(Vec::len).sum();
    if corners > MOST_CORNERS {
        return Err(NoRegion::new(
            format!("polygons of {corners} corners"),
            format!("at most {MOST_CORNERS}; simplify them"),
        ));
    }
    if let Some(ring) = rings().find(|ring| ring.len() < 3) {
        return Err(NoRegion::new(
            format!("a ring of {} different corners", ring.len()),
            "at least three",
        ));
    }
    rings().flatten().flatten().try_for_each(|c| in_range(*c))?;
    let [min, max] = bounds(polygons);
    if min[0] < max[0] && min[1] < max[1] {
        return Ok(());
    }
    Err(NoRegion::new(
        match polygons.iter().all(|polygon| polygon.is_empty()) {
            true => "no polygon".to_owned(),
            false => "polygons without an area".to_owned(),
        },
        "a polygon",
    ))
}

pub(super) fn bounds(polygons: &[Polygon]) -> [[f64; 2]; 2] {
    let (mut min, mut max) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for corner in polygons.iter().flatten().flatten() {
        for axis in 0..2 {
            min[axis] = min[axis].min(corner[axis]);
            max[axis] = max[axis].max(corner[axis]);
        }
    }
    [min, max]
}

/// Bytes of an [`Area`] of these polygons.
pub(super) fn bytes(polygons: &[Polygon]) -> u64 {
    let corners: usize = polygons.iter().flatten().map(Vec::len).sum();
    corners as u64 * (size_of::<Edge>() as u64 + BoxTree::<f64>::BYTES)
}

/// An edge of a polygon.
#[derive(Debug, Clone, Copy)]
struct Edge {
    ends: [[f64; 2]; 2],
    /// Number of its polygon.
    polygon: u32,
}

impl Edge {
    /// True if a point is on it, exactly.
    fn has(&self, p: [f64; 2]) -> bool {
        let [a, b] = self.ends;
        let between = |k: usize| a[k].min(b[k]) <= p[k] && p[k] <= a[k].max(b[k]);
        between(0) && between(1) && turn(a, b, p) == 0.0
    }

    /// True if it crosses the ray from a point to larger x. An edge has its lower end, not its upper one.
    fn crosses_ray(&self, p: [f64; 2]) -> bool {
        let [a, b] = self.ends;
        if (a[1] > p[1]) == (b[1] > p[1]) {
            return false;
        }
        let (low, high) = if a[1] < b[1] { (a, b) } else { (b, a) };
        turn(low, high, p) > 0.0
    }

    /// Squared distance from a point.
    fn distance2(&self, p: [f64; 2]) -> f64 {
        let [a, b] = self.ends;
        let (d, e) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
        let length2 = d[0] * d[0] + d[1] * d[1];
        let along = (d[0] * e[0] + d[1] * e[1]) / length2;
        // An edge without length has no direction.
        let along = if length2 > 0.0 {
            along.clamp(0.0, 1.0)
        } else {
            0.0
        };
        let off = [0, 1].map(|k| e[k] - along * d[k]);
        off[0] * off[0] + off[1] * off[1]
    }
}

/// Positive if `c` is to the left of the line from `a` to `b`, 0 if it is on it; the sign is exact.
fn turn(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    let [a, b, c] = [a, b, c].map(|[x, y]| Coord { x, y });
    orient2d(a, b, c)
}

/// A region prepared for tests of points.
#[derive(Debug)]
pub struct Area<'a> {
    region: &'a Region,
    bounds: [[f64; 2]; 2],
    edges: Vec<Edge>,
    tree: BoxTree<f64>,
}

impl<'a> Area<'a> {
    pub(super) fn of(region: &'a Region) -> Self {
        let polygons = match region {
            Region::Box { .. } => &[][..],
            Region::Polygons(polygons) => polygons,
        };
        let mut edges = Vec::new();
        for (polygon, rings) in (0..).zip(polygons) {
            for ring in rings {
                let next = ring.iter().cycle().skip(1);
                let ends = ring.iter().zip(next).map(|(a, b)| [*a, *b]);
                edges.extend(ends.map(|ends| Edge { ends, polygon }));
            }
        }
        let flat = |Edge { ends: [a, b], .. }: &Edge| {
            let corner = |pick: fn(f64, f64) -> f64| [pick(a[0], b[0]), pick(a[1], b[1]), 0.0];
            [corner(f64::min), corner(f64::max)]
        };
        Self {
            region,
            bounds: region.bounds(),
            tree: BoxTree::of(edges.iter().map(flat)),
            edges,
        }
    }

    /// The region.
    #[must_use]
    pub fn region(&self) -> &'a Region {
        self.region
    }

    /// True if the region contains a point.
    #[must_use]
    pub fn contains(&self, p: [f64; 3]) -> bool {
        match self.region {
            Region::Box { .. } => self.is_near(p, 0.0),
            Region::Polygons(_) => {
                let [x, y, _] = p;
                let [min, max] = self.bounds;
                let around = min[0] <= x && x <= max[0] && min[1] <= y && y <= max[1];
                around && self.polygons_contain([x, y])
            }
        }
    }

    /// True if the region contains a point, or one not farther than `margin` from it: for a box along each
    /// axis, for polygons in the plane.
    #[must_use]
    pub fn is_near(&self, [x, y, z]: [f64; 3], margin: f64) -> bool {
        let [min, max] = self.bounds;
        let near = |low: f64, high: f64, c: f64| low - margin <= c && c <= high + margin;
        if !near(min[0], max[0], x) || !near(min[1], max[1], y) {
            return false;
        }
        match self.region {
            Region::Box { z: range, .. } => range.is_none_or(|[low, high]| near(low, high, z)),
            Region::Polygons(_) => {
                let wanted = [[x - margin, y - margin, 0.0], [x + margin, y + margin, 0.0]];
                let mut edges = self.edges_in(wanted);
                edges.any(|edge| edge.distance2([x, y]) <= margin * margin)
                    || self.polygons_contain([x, y])
            }
        }
    }

    /// False only if no point of a box is in the region or within the margin. True where that is not certain.
    #[must_use]
    pub fn may_meet(&self, [low, high]: [[f64; 3]; 2], margin: f64) -> bool {
        let [min, max] = self.bounds;
        let meets = |min: f64, max: f64, axis: usize| {
            min - margin <= high[axis] && low[axis] <= max + margin
        };
        if !meets(min[0], max[0], 0) || !meets(min[1], max[1], 1) {
            return false;
        }
        match self.region {
            Region::Box { z, .. } => z.is_none_or(|[min, max]| meets(min, max, 2)),
            Region::Polygons(_) => {
                // Without an edge near it, the box is inside or outside as a whole.
                let wide = |c: [f64; 3], by: f64| [c[0] + by, c[1] + by, 0.0];
                let wanted = [wide(low, -margin), wide(high, margin)];
                self.edges_in(wanted).next().is_some() || self.polygons_contain([low[0], low[1]])
            }
        }
    }

    fn edges_in(&self, wanted: [[f64; 3]; 2]) -> impl Iterator<Item = &Edge> {
        self.tree.meeting(wanted).map(|edge| &self.edges[edge])
    }

    fn polygons_contain(&self, p: [f64; 2]) -> bool {
        let ray = [[p[0], p[1], 0.0], [self.bounds[1][0].max(p[0]), p[1], 0.0]];
        let mut crossed = Vec::new();
        for edge in self.edges_in(ray) {
            if edge.has(p) {
                return true;
            }
            if edge.crosses_ray(p) {
                crossed.push(edge.polygon);
            }
        }
        crossed.sort_unstable();
        let mut polygons = crossed.chunk_by(|a, b| a == b);
        polygons.any(|edges| edges.len() % 2 == 1)
    }
}
