//! Sections 8.5 and 8.6: boundary loops, and the filling of holes.

use super::big::{Big, Big3, cross, dot, plus, vector};
use super::insert::normal;
use super::repair::{ClockwiseAngle, pinched, run};
use super::spacing::Density;
use super::surface::{Component, Edge, Surface, Triangle};
use super::{Settings, mend};
use outcrop_geom::{Point, distance2, sub};
use std::collections::{BTreeMap, BTreeSet};

/// Counts of the loops.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Filling {
    pub loops: usize,
    pub too_long: usize,
    pub outlines: usize,
    pub not_split: usize,
    pub filled: usize,
    pub triangles: usize,
    /// Robust: neither filled as a whole nor closed by ear clipping; and the number of them closed in part.
    pub clipped: usize,
    pub partly: usize,
    /// Robust: filled only after ear clipping, or closed by ear clipping alone.
    pub clipped_whole: usize,
    /// Robust: short enough to be filled, but an opening.
    pub openings: usize,
    /// Robust: likewise, but only its filling shows that.
    pub spanned: usize,
    /// Robust: likewise, but all triangles would be too wide.
    pub wide: usize,
    /// Robust: of those closed in part, loops of which a part was filled as they were found, and after ear
    /// clipping; and the triangles left out that were not wide themselves.
    pub left_open: usize,
    pub left_open_clipped: usize,
    pub between: usize,
    /// Robust: loops of three edges, closed before holes are counted.
    pub gaps: usize,
}

/// From one vertex to another, in the direction of the loop.
type HalfEdge = (u32, u32);

pub struct Holes<'a> {
    pub points: &'a [Point],
    /// Positions in the file.
    pub file: &'a [Point],
    pub density: Option<&'a Density>,
    pub surface: &'a Surface,
    /// Triangles as they run, by each of their directed edges.
    half_edges: BTreeMap<HalfEdge, Triangle>,
    turned: Component,
    /// Vertices with several fans (of any components).
    pub pinched: BTreeSet<u32>,
}

/// The triangles that fill the holes of an oriented surface, as they run. All loops are found and all chords
/// chosen on the surface before filling.
pub fn fill(
    points: &[Point],
    file: &[Point],
    density: Option<&Density>,
    surface: &Surface,
    components: &[Component],
    settings: &Settings,
) -> (Vec<[u32; 3]>, Filling) {
    let mut holes = Holes {
        points,
        file,
        density,
        surface,
        half_edges: BTreeMap::new(),
        turned: components
            .iter()
            .flatten()
            .map(|(&t, &turned)| (t, turned))
            .collect(),
        pinched: pinched(surface),
    };
    for (&t, &turned) in &holes.turned {
        let [a, b, c] = run(t, turned);
        for half_edge in [(a, b), (b, c), (c, a)] {
            let before = holes.half_edges.insert(half_edge, t);
            assert!(before.is_none(), "two triangles run along {half_edge:?}");
        }
    }
    let mut filling = Filling::default();
    let mut triangles = Vec::new();
    for hole in holes.loops(components) {
        filling.loops += 1;
        if settings.robust {
            triangles.extend(mend::mend(
                &holes,
                &hole,
                settings.max_hole_edges,
                &mut filling,
            ));
        } else if hole.len() > settings.max_hole_edges {
            filling.too_long += 1;
        } else if holes.is_outline(&hole, &holes.behind(&hole)) {
            filling.outlines += 1;
        } else if let Some(patch) = holes.patch(&hole, &BTreeSet::new()) {
            filling.filled += 1;
            filling.triangles += patch.len();
            triangles.extend(patch.into_iter().map(|t| t.map(|k| hole[k])));
        } else {
            filling.not_split += 1;
        }
    }
    (triangles, filling)
}

/// An open fan: `v → start` is in its first triangle, `end → v` in its last.
struct Opening {
    start: u32,
    end: u32,
}

impl Holes<'_> {
    fn difference(&self, from: u32, to: u32) -> [i64; 3] {
        sub(self.points[to as usize], self.points[from as usize])
    }

    /// Every loop as its vertices in order, beginning with its smallest (from, to).
    fn loops(&self, components: &[Component]) -> Vec<Vec<u32>> {
        let mut next: BTreeMap<HalfEdge, HalfEdge> = BTreeMap::new();
        for component in components {
            let vertices: BTreeSet<u32> = component.keys().flatten().copied().collect();
            for v in vertices {
                for (start, end) in self.matching(v, component) {
                    next.insert((start, v), (v, end));
                }
            }
        }
        let mut found = Vec::new();
        while let Some((&first, _)) = next.first_key_value() {
            let mut hole = Vec::new();
            let mut at = first;
            while let Some(following) = next.remove(&at) {
                hole.push(at.0);
                at = following;
            }
            assert_eq!(at, first, "a hole ends where it began");
            found.push(hole);
        }
        found
    }

    /// For the fans of one component at `v`: the incoming edge of a loop and its outgoing edge.
    fn matching(&self, v: u32, component: &Component) -> Vec<(u32, u32)> {
        let mut openings = Vec::new();
        let mut axis = [0i128; 3];
        for fan in self.surface.fans(v) {
            if fan.closed || !fan.triangles.iter().all(|t| component.contains_key(t)) {
                continue;
            }
            for &t in &fan.triangles {
                let n = normal(self.points, t);
                let sign = if component[&t] { -1 } else { 1 };
                axis = std::array::from_fn(|k| axis[k] + sign * n[k]);
            }
            let free = |from, to| {
                let own = self
                    .half_edges
                    .get(&(from, to))
                    .is_some_and(|t| fan.triangles.contains(t));
                own && !self.half_edges.contains_key(&(to, from))
            };
            let others: BTreeSet<u32> = fan.triangles.iter().flatten().copied().collect();
            let start = others
                .iter()
                .copied()
                .find(|&x| free(v, x))
                .expect("a fan has a start");
            let end = others
                .iter()
                .copied()
                .find(|&x| free(x, v))
                .expect("a fan has an end");
            openings.push(Opening { start, end });
        }
        let mut pairs = Vec::new();
        for a in &openings {
            for b in &openings {
                let (from, to) = (self.difference(v, a.start), self.difference(v, b.end));
                pairs.push((ClockwiseAngle::new(axis, from, to), a.start, b.end));
            }
        }
        pairs.sort_by(|p, q| p.0.compare(&q.0).then((p.1, p.2).cmp(&(q.1, q.2))));
        let (mut ins, mut outs) = (BTreeSet::new(), BTreeSet::new());
        let mut matched = Vec::new();
        for (_, start, end) in pairs {
            if !ins.contains(&start) && !outs.contains(&end) {
                ins.insert(start);
                outs.insert(end);
                matched.push((start, end));
            }
        }
        matched
    }

    /// For each edge of a loop, from `hole[k]` to the next, the third corner of its triangle.
    pub fn behind(&self, hole: &[u32]) -> Vec<u32> {
        let edge = |k: usize| [hole[k], hole[(k + 1) % hole.len()]];
        let third = |[from, to]: [u32; 2]| {
            let t = self.half_edges[&(to, from)];
            let [a, b, c] = run(t, self.turned[&t]);
            a + b + c - from - to
        };
        (0..hole.len()).map(edge).map(third).collect()
    }

    /// Twice the vector area of a loop; it does not depend on the reference point.
    pub fn area2(&self, hole: &[u32]) -> Big3<8> {
        let mut area2: Big3<8> = [Big::ZERO; 3];
        for (k, &from) in hole.iter().enumerate() {
            let to = hole[(k + 1) % hole.len()];
            let (a, b) = (self.difference(hole[0], from), self.difference(hole[0], to));
            area2 = plus(area2, cross(vector(a), vector(b)));
        }
        area2
    }

    /// True if a loop is an outline of its surface; `behind` are the third corners of the triangles along it.
    /// A triangle with two edges in the loop counts twice.
    pub fn is_outline(&self, hole: &[u32], behind: &[u32]) -> bool {
        let area2 = self.area2(hole);
        let mut normals: Big3<8> = [Big::ZERO; 3];
        let mut lengths = 0.0;
        for (k, &from) in hole.iter().enumerate() {
            let to = hole[(k + 1) % hole.len()];
            let n = normal(self.points, [to, from, behind[k]]);
            lengths += n
                .iter()
                .map(|&x| (x as f64) * (x as f64))
                .sum::<f64>()
                .sqrt();
            normals = plus(normals, vector(n));
        }
        let size = dot(area2, area2).approximate().sqrt();
        dot(area2, normals).approximate() < -0.5 * size * lengths
    }

    /// The triangles that fill a loop, by the positions of their corners in it, or none; `taken` are further
    /// edges besides those of the mesh.
    pub fn patch(&self, hole: &[u32], taken: &BTreeSet<Edge>) -> Option<Vec<[usize; 3]>> {
        let mut chords = taken.clone();
        let mut triangles = Vec::new();
        let corners: Vec<(usize, u32)> = hole.iter().copied().enumerate().collect();
        self.split(&corners, &mut chords, &mut triangles)
            .then_some(triangles)
    }

    /// Fills a part of a loop, given as positions; false if that is impossible. Of the two parts that a chord
    /// between places `a < b` of the part makes, the one at `a..=b` comes first, then `0..=a, b..`.
    fn split(
        &self,
        part: &[(usize, u32)],
        chords: &mut BTreeSet<Edge>,
        out: &mut Vec<[usize; 3]>,
    ) -> bool {
        if let &[a, b, c] = part {
            out.push([a.0, b.0, c.0]);
            return !self.collinear(a.1, b.1, c.1);
        }
        let ids: Vec<u32> = part.iter().map(|corner| corner.1).collect();
        let Some((a, b)) = self.best_chord(&ids, chords) else {
            return false;
        };
        chords.insert([ids[a].min(ids[b]), ids[a].max(ids[b])]);
        let rest: Vec<_> = part[..=a].iter().chain(&part[b..]).copied().collect();
        self.split(&part[a..=b], chords, out) && self.split(&rest, chords, out)
    }

    /// The positions of the chord with the least length relative to the shorter way round the part. The way
    /// from `a` to `b` is the difference of two running sums of edge lengths from position 0 on; the other
    /// way is the whole sum less this. The first of equal chords is taken.
    fn best_chord(&self, part: &[u32], chords: &BTreeSet<Edge>) -> Option<(usize, usize)> {
        let count = part.len();
        let length = |a: u32, b: u32| {
            (distance2(self.points[a as usize], self.points[b as usize]) as f64).sqrt()
        };
        let mut along = vec![0.0];
        for k in 0..count {
            along.push(along[k] + length(part[k], part[(k + 1) % count]));
        }
        let mut best: Option<(f64, usize, usize)> = None;
        for a in 0..count {
            for b in a + 2..count {
                if a == 0 && b == count - 1 || !self.allowed(part, a, b, chords) {
                    continue;
                }
                let one_way = along[b] - along[a];
                let ratio = length(part[a], part[b]) / one_way.min(along[count] - one_way);
                if best.is_none_or(|(least, ..)| ratio < least) {
                    best = Some((ratio, a, b));
                }
            }
        }
        best.map(|(_, a, b)| (a, b))
    }

    fn allowed(&self, part: &[u32], a: usize, b: usize, chords: &BTreeSet<Edge>) -> bool {
        let (u, v) = (part[a], part[b]);
        let edge = [u.min(v), u.max(v)];
        let count = part.len();
        let flat = b - a == 2 && self.collinear(u, part[a + 1], v)
            || count - (b - a) == 2 && self.collinear(v, part[(b + 1) % count], u);
        u != v
            && !flat
            && self.surface.at_edge(edge).is_empty()
            && !chords.contains(&edge)
            && !(self.pinched.contains(&u) && self.pinched.contains(&v))
    }

    /// True if three points are on a line, in the shape or in the file.
    pub fn collinear(&self, a: u32, b: u32, c: u32) -> bool {
        let flat = |points| normal(points, [a, b, c]) == [0; 3];
        flat(self.points) || flat(self.file)
    }
}
