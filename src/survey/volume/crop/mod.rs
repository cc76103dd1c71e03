//! The part of a triangle inside a region, whatever its polygons: concave, with holes, crossing themselves.
//!
//! The box of the region is divided into cells by halves, until few edges are in a cell. A cell without edges is
//! inside or outside. In any other cell, the ends of edges, and the places where they cross each other or leave
//! the cell, divide it into slabs between which no edge begins, ends or crosses. So the edges of a slab lie one
//! above the other, and between two of them is a trapezoid, which is inside or outside as its middle is. That is
//! decided by [`Area::contains`], exactly and by the same rule as in every other command. A triangle goes down
//! through the cells and is cut by each, and in the last cell by the trapezoids.
//!
//! Places where edges cross are rounded, so the area of a region is off by about 2^-50 of its box for each edge.

mod division;
mod slabs;

use super::convex::Convex;
use division::{Cell, DEEPEST, Division};
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::memory::Reservation;
use outcrop_geom::region::Region;
use outcrop_geom::vector::V3;
use slabs::Trapezoid;

/// Bytes of cells and trapezoids: most for each corner of the polygons, and those that few corners may take as well.
/// A ring of 20 000 corners takes 213 for each; edges that cross very often take more, and are refused.
const BYTES: [u64; 2] = [1 << 10, 1 << 20];

type P2 = [f64; 2];

/// A region prepared for cutting.
#[derive(Debug)]
pub(crate) struct Cutter {
    bounds: [P2; 2],
    cells: Vec<Cell>,
    parts: Vec<Trapezoid>,
    area: f64,
    _held: Reservation,
}

impl Cutter {
    /// Prepares a region, from the origin on.
    pub fn new(region: &Region, origin: V3, workspace: &Workspace) -> Result<Self> {
        let rings = rings(region);
        let corners: usize = rings.iter().map(Vec::len).sum();
        let most_bytes = corners as u64 * BYTES[0] + BYTES[1];
        let edges = (corners * size_of::<[P2; 2]>()) as u64;
        let deep = edges * u64::from(DEEPEST) / 2;
        let held = workspace.reserve(
            "volume: region",
            2 * most_bytes + edges + deep + region.area_bytes(),
        )?;
        let origin = [origin[0], origin[1]];
        let moved = |p: P2| [p[0] - origin[0], p[1] - origin[1]];
        let mut edges = Vec::with_capacity(corners);
        for ring in &rings {
            let next = ring.iter().cycle().skip(1);
            edges.extend(ring.iter().zip(next).map(|(a, b)| [moved(*a), moved(*b)]));
        }
        let mut division = Division {
            contains: region.area(),
            origin,
            cells: vec![Cell::Outside],
            parts: Vec::new(),
            most_bytes,
        };
        let bounds = region.bounds().map(moved);
        division.divide(0, bounds, &edges, DEEPEST)?;
        let Division { cells, parts, .. } = division;
        let mut cutter = Self {
            bounds,
            cells,
            parts,
            area: 0.0,
            _held: held,
        };
        cutter.area = cutter.whole_area();
        Ok(cutter)
    }

    /// The area of the region.
    pub fn area(&self) -> f64 {
        self.area
    }

    fn whole_area(&self) -> f64 {
        let [[ax, ay], [bx, by]] = self.bounds;
        let mut sum = 0.0;
        for corners in [
            [[ax, ay, 0.0], [bx, ay, 0.0], [bx, by, 0.0]],
            [[ax, ay, 0.0], [bx, by, 0.0], [ax, by, 0.0]],
        ] {
            self.cut(&corners, |part| {
                let parts = part.triangles();
                sum += parts.map(|t| super::sums::plan_area(&t)).sum::<f64>();
            });
        }
        sum
    }

    /// Lowest and highest x and y, from the origin on.
    pub fn bounds(&self) -> [P2; 2] {
        self.bounds
    }

    /// Calls `each` with the parts of a triangle that are inside.
    pub fn cut(&self, triangle: &[V3; 3], mut each: impl FnMut(&Convex)) {
        let mut part = Convex::of(triangle);
        let ([low, high], [min, max]) = (self.bounds, part.bounds());
        if (0..2).any(|axis| max[axis] <= low[axis] || min[axis] >= high[axis]) {
            return;
        }
        for axis in 0..2 {
            if min[axis] < low[axis] {
                part.keep(|p| p[axis] - low[axis]);
            }
            if max[axis] > high[axis] {
                part.keep(|p| high[axis] - p[axis]);
            }
        }
        if !part.is_empty() {
            self.descend(0, &part, part.bounds(), &mut each);
        }
    }

    /// Cuts a part that is inside a cell.
    fn descend(&self, cell: usize, part: &Convex, bounds: [P2; 2], each: &mut impl FnMut(&Convex)) {
        match self.cells[cell] {
            Cell::Outside => {}
            Cell::Inside => each(part),
            Cell::Halves(axis, at, first) if bounds[1][axis] <= at => {
                self.descend(first, part, bounds, each);
            }
            Cell::Halves(axis, at, first) if bounds[0][axis] >= at => {
                self.descend(first + 1, part, bounds, each);
            }
            Cell::Halves(axis, at, first) => {
                let halves = [part.cut(|p| at - p[axis]), part.cut(|p| p[axis] - at)];
                for (half, number) in halves.iter().zip(first..) {
                    if !half.is_empty() {
                        self.descend(number, half, half.bounds(), each);
                    }
                }
            }
            Cell::Parts(from, to) => {
                for trapezoid in &self.parts[from..to] {
                    let inside = trapezoid.cut(part, bounds);
                    if !inside.is_empty() {
                        each(&inside);
                    }
                }
            }
        }
    }
}

fn rings(region: &Region) -> Vec<Vec<P2>> {
    match region {
        Region::Box { min, max, .. } => {
            let [[ax, ay], [bx, by]] = [*min, *max];
            vec![vec![[ax, ay], [bx, ay], [bx, by], [ax, by]]]
        }
        Region::Polygons(polygons) => polygons.iter().flatten().cloned().collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::sums::plan_area;
    use super::*;
    use proptest::prelude::*;

    fn cutter(text: &str) -> Cutter {
        let workspace = Workspace::for_tests(1).unwrap();
        let region: Region = text.parse().unwrap();
        Cutter::new(&region, [1.0, 2.0, 0.0], &workspace).unwrap()
    }

    #[test]
    fn regions_have_their_areas() {
        for (text, area) in [
            ("0,0,4,2", 8.0),
            ("POLYGON((0 0, 4 0, 4 4, 0 4), (1 1, 1 3, 3 3, 3 1))", 12.0),
            // A star that crosses itself: its middle is outside.
            ("POLYGON((0 0, 4 4, 4 0, 0 4))", 8.0),
            // Two that overlap.
            (
                "MULTIPOLYGON(((0 0, 2 0, 2 2, 0 2)), ((1 1, 3 1, 3 3, 1 3)))",
                7.0,
            ),
            (
                "POLYGON((0 0, 10 0, 10 1, 1 1, 1 9, 10 9, 10 10, 0 10))",
                28.0,
            ),
        ] {
            let found = cutter(text).area();
            assert!((found - area).abs() < 1e-12, "{text}: {found}");
        }
    }

    /// A star of many corners, of radii that alternate: a concave ring.
    #[test]
    fn large_polygons_are_divided() {
        let count = 20_000;
        let corner = |k: usize| {
            let (radius, angle) = (
                if k.is_multiple_of(2) { 1000.0 } else { 999.7 },
                k as f64 / count as f64 * std::f64::consts::TAU,
            );
            [radius * angle.cos(), radius * angle.sin()]
        };
        let ring: Vec<_> = (0..count).map(corner).collect();
        let twice = |a: [f64; 2], b: [f64; 2]| a[0] * b[1] - a[1] * b[0];
        let area: f64 = (0..count)
            .map(|k| twice(ring[k], ring[(k + 1) % count]) / 2.0)
            .sum();
        let text: Vec<_> = ring.iter().map(|[x, y]| format!("{x} {y}")).collect();
        let found = cutter(&format!("POLYGON(({}))", text.join(", ")));
        assert!(
            (found.area() / area - 1.0).abs() < 1e-11,
            "{} {area}",
            found.area()
        );
        assert!(found.cells.len() > 1000);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// Against the share of a fine grid of places that are in the triangle and in the region.
        #[test]
        fn the_part_inside_has_the_area_of_its_places(
            ring in proptest::collection::vec((0u8..32, 0u8..32), 3..24),
            hole in proptest::collection::vec((8u8..24, 8u8..24), 3..5),
            triangle in proptest::array::uniform3((0u8..40, 0u8..40)),
        ) {
            let text = |ring: &[(u8, u8)]| {
                let all: Vec<_> = ring.iter().map(|(x, y)| format!("{x} {y}")).collect();
                format!("({})", all.join(", "))
            };
            let text = format!("POLYGON({}, {})", text(&ring), text(&hole));
            let parsed: Result<Region, _> = text.parse();
            prop_assume!(parsed.is_ok());
            let region = parsed.unwrap();
            let workspace = Workspace::for_tests(1).unwrap();
            let cutter = Cutter::new(&region, [0.0; 3], &workspace).unwrap();
            let corners = triangle.map(|(x, y)| [f64::from(x), f64::from(y), 1.0]);
            let mut found = 0.0;
            cutter.cut(&corners, |part| found += part.triangles().map(|t| plan_area(&t)).sum::<f64>());
            let (area, whole) = (region.area(), plan_area(&corners));
            let inside = |p: [f64; 3]| {
                let [a, b, c] = corners;
                let all = [[a, b, p], [b, c, p], [c, a, p]].map(|t| plan_area(&t) * whole.signum());
                all.iter().all(|part| *part >= 0.0)
            };
            let steps = 160;
            let at = |k: i32| (f64::from(k) + 0.5) * 40.0 / f64::from(steps);
            let places = (0..steps * steps).map(|k| [at(k % steps), at(k / steps), 0.0]);
            let hits = places.filter(|p| inside(*p) && area.contains(*p)).count();
            let grid = hits as f64 * (40.0 / f64::from(steps)).powi(2) * whole.signum();
            prop_assert!((found - grid).abs() < 12.0, "{} {}", found, grid);
        }
    }
}
