//! Mending (section 1.6, robust): loops are filled if they are holes, and else zipped from their
//! sharpest corners.

use super::big::dot;
use super::holes::{Filling, Holes};
use super::insert::normal;
use super::surface::Edge;
use outcrop::geom::distance2;
use std::collections::BTreeSet;

/// Longer loops are left alone.
const LONGEST: usize = 100_000;
/// Loops of so few edges are never taken for an outline.
const SMALL: usize = 6;

/// The triangles that close a loop, or a part of it.
pub fn mend(
    holes: &Holes<'_>,
    hole: &[u32],
    longest: usize,
    filling: &mut Filling,
) -> Vec<[u32; 3]> {
    let only_gaps = longest < 3;
    let longest = longest.max(3);
    if hole.len()
        > if only_gaps {
            longest
        } else {
            longest.max(LONGEST)
        }
    {
        filling.too_long += 1;
        return Vec::new();
    }
    let behind = holes.behind(hole);
    let around = hole.len() > SMALL && holes.is_outline(hole, &behind);
    let found: u128 = squares(holes, hole);
    let is_wide = |area: f64, rest: usize| {
        let limit = 4.5 * found as f64 * rest as f64;
        area * hole.len() as f64 > limit
    };
    let is_opening = |rest: &[u32]| is_wide(vector_area(holes, rest), rest.len());
    let is_spanned = |rest: &[u32], patch: &[[u32; 3]]| is_wide(area(holes, patch), rest.len());
    let is_too_wide = |patch: &[[u32; 3]]| {
        let wide = |t: &[u32; 3]| holes.density.is_some_and(|d| d.is_wide(*t, holes.file));
        patch.iter().any(wide)
    };
    if !around && hole.len() <= longest {
        let patch = filled(holes, hole, &behind, &BTreeSet::new());
        if is_opening(hole) {
            filling.openings += 1;
        } else if patch.as_ref().is_some_and(|patch| is_spanned(hole, patch)) {
            filling.spanned += 1;
        } else if patch.as_ref().is_some_and(|patch| is_too_wide(patch)) {
            filling.wide += 1;
        } else if let Some(patch) = patch {
            if let [gap] = patch[..] {
                filling.gaps += 1;
                return vec![gap];
            }
            filling.filled += 1;
            filling.triangles += patch.len();
            return patch;
        }
    }
    if only_gaps {
        filling.not_split += 1;
        return Vec::new();
    }
    let mut zipper = Zipper::new(holes, hole, &behind);
    zipper.zip();
    let left = zipper.begin_at_smallest();
    let (left, behind): (Vec<u32>, Vec<u32>) = left.into_iter().unzip();
    let mut triangles = zipper.closed;
    let mut whole = left.is_empty();
    let fillable = |rest: &[u32]| !around && rest.len() <= longest && !is_opening(rest);
    if !whole && !triangles.is_empty() && fillable(&left) {
        let edges = |&[a, b, c]: &[u32; 3]| [[a, b], [b, c], [c, a]];
        let taken = triangles.iter().flat_map(edges);
        let taken = taken.map(|[a, b]| [a.min(b), a.max(b)]).collect();
        if let Some(patch) = filled(holes, &left, &behind, &taken)
            && !is_spanned(&left, &patch)
            && !is_too_wide(&patch)
        {
            triangles.extend(patch);
            whole = true;
        }
    }
    if whole {
        filling.filled += 1;
        filling.zipped_whole += 1;
    } else {
        filling.zipped += 1;
        filling.partly += usize::from(!triangles.is_empty());
    }
    filling.triangles += triangles.len();
    triangles
}

/// Fills a loop if it is none around a piece of surface.
fn filled(
    holes: &Holes<'_>,
    hole: &[u32],
    behind: &[u32],
    taken: &BTreeSet<Edge>,
) -> Option<Vec<[u32; 3]>> {
    let around_a_triangle = hole.len() == 3 && hole.contains(&behind[0]);
    if around_a_triangle || hole.len() > SMALL && holes.is_outline(hole, behind) {
        return None;
    }
    holes.patch(hole, taken)
}

fn vector_area(holes: &Holes<'_>, hole: &[u32]) -> f64 {
    let area2 = holes.area2(hole);
    0.5 * dot(area2, area2).approximate().sqrt()
}

/// The sum of the areas of some triangles.
fn area(holes: &Holes<'_>, triangles: &[[u32; 3]]) -> f64 {
    let one = |&t: &[u32; 3]| {
        let n = normal(holes.points, t);
        0.5 * (product(n, n) as f64).sqrt()
    };
    triangles.iter().map(one).sum()
}

fn squares(holes: &Holes<'_>, hole: &[u32]) -> u128 {
    let next = |k: usize| hole[(k + 1) % hole.len()];
    let one = |k: usize| u128::from(square(holes, hole[k], next(k)));
    (0..hole.len()).map(one).sum()
}

fn square(holes: &Holes<'_>, a: u32, b: u32) -> u64 {
    distance2(holes.points[a as usize], holes.points[b as usize])
}

fn length(holes: &Holes<'_>, a: u32, b: u32) -> f64 {
    (square(holes, a, b) as f64).sqrt()
}

/// A corner of what is left of a loop.
#[derive(Debug, Clone, Copy)]
struct Corner {
    v: u32,
    /// Its place in the loop as it was found.
    place: usize,
    spacing: f64,
    /// The third corner of the triangle at the edge to the next corner.
    behind: u32,
    /// The ratio of its ear, as long as that is waiting to be closed.
    ratio: Option<f64>,
}

struct Zipper<'a> {
    holes: &'a Holes<'a>,
    ring: Vec<Corner>,
    chords: BTreeSet<Edge>,
    closed: Vec<[u32; 3]>,
}

impl<'a> Zipper<'a> {
    fn new(holes: &'a Holes<'a>, hole: &[u32], behind: &[u32]) -> Self {
        let n = hole.len();
        // Of the triangle at the edge from corner k to the next.
        let mean = |k: usize| {
            let (from, to) = (hole[k], hole[(k + 1) % n]);
            let sides = [(from, to), (to, behind[k]), (from, behind[k])];
            let [a, b, c] = sides.map(|(a, b)| length(holes, a, b));
            (a + b + c) / 3.0
        };
        let spacing = |k: usize| {
            let four = [k + n - 2, k + n - 1, k, k + 1].map(|edge| mean(edge % n));
            (four[0] + four[1] + four[2] + four[3]) / 4.0
        };
        let corner = |k: usize| Corner {
            v: hole[k],
            place: k,
            spacing: spacing(k),
            behind: behind[k],
            ratio: None,
        };
        Self {
            holes,
            ring: (0..n).map(corner).collect(),
            chords: BTreeSet::new(),
            closed: Vec::new(),
        }
    }

    fn at(&self, k: isize) -> &Corner {
        &self.ring[k.rem_euclid(self.ring.len() as isize) as usize]
    }

    /// Closes ears, the one with the least ratio first. An ear that may not be closed when it is
    /// looked at is looked at again when one of its two edges is new.
    fn zip(&mut self) {
        for k in 0..self.ring.len() {
            self.ring[k].ratio = self.ear(k as isize);
        }
        loop {
            let waiting = (0..self.ring.len()).filter(|&k| self.ring[k].ratio.is_some());
            let order = |k: &usize| (self.ring[*k].ratio.expect("waiting"), self.ring[*k].place);
            let Some(k) = waiting.min_by(|a, b| order(a).partial_cmp(&order(b)).expect("finite"))
            else {
                return;
            };
            if self.ear(k as isize).is_none() {
                self.ring[k].ratio = None;
                continue;
            }
            let [s, x, e] = [-1, 0, 1].map(|d| self.at(k as isize + d).v);
            self.closed.push([s, x, e]);
            if self.ring.len() == 3 {
                self.ring.clear();
                return;
            }
            self.chords.insert([s.min(e), s.max(e)]);
            let before = (k + self.ring.len() - 1) % self.ring.len();
            self.ring[before].behind = x;
            self.ring.remove(k);
            let before = before - usize::from(before > k);
            let after = (before + 1) % self.ring.len();
            for y in [before, after] {
                self.ring[y].ratio = self.ear(y as isize);
            }
        }
    }

    /// The ratio of chord to edges of the ear at a corner, if it may be closed.
    fn ear(&self, k: isize) -> Option<f64> {
        let (holes, last) = (self.holes, self.ring.len() == 3);
        let [cs, cx, ce] = [-1, 0, 1].map(|d| *self.at(k + d));
        let (s, x, e) = (cs.v, cx.v, ce.v);
        if s == x || x == e || s == e {
            return None;
        }
        let chord = length(holes, s, e);
        if !last {
            let edge = [s.min(e), s.max(e)];
            let is_edge = !holes.surface.at_edge(edge).is_empty() || self.chords.contains(&edge);
            let pinched = holes.pinched.contains(&s) && holes.pinched.contains(&e);
            let spacing = 0.5 * (cs.spacing + ce.spacing);
            if is_edge || pinched || chord > 6.0 * spacing || self.covers(k) {
                return None;
            }
        }
        let ear = normal(holes.points, [s, x, e]);
        let fits = |t: [u32; 3]| smooth(ear, normal(holes.points, t));
        let along = fits([x, s, cs.behind]) && fits([e, x, cx.behind]);
        let fine = along && (!last || fits([s, e, ce.behind])) && !holes.collinear(s, x, e);
        fine.then(|| chord / (length(holes, s, x) + length(holes, x, e)))
    }

    /// Whether one of the next six corners along the loop, either way, is over or under the ear.
    fn covers(&self, k: isize) -> bool {
        let points = self.holes.points;
        let [s, x, e] = [-1, 0, 1].map(|d| self.at(k + d).v);
        let n = normal(points, [s, x, e]);
        let inside = |from: u32, to: u32, p: u32| product(normal(points, [from, to, p]), n) >= 0;
        let over = |p: u32| inside(s, x, p) && inside(x, e, p) && inside(e, s, p);
        (2..8)
            .flat_map(|d| [self.at(k - d).v, self.at(k + d).v])
            .any(|p| ![s, x, e].contains(&p) && over(p))
    }

    /// What is left, with what is behind each edge, from its smallest (from, to) pair on.
    fn begin_at_smallest(&self) -> Vec<(u32, u32)> {
        let mut left: Vec<(u32, u32)> = self.ring.iter().map(|c| (c.v, c.behind)).collect();
        let pair = |&k: &usize| (left[k].0, left[(k + 1) % left.len()].0);
        let first = (0..left.len()).min_by_key(pair).unwrap_or(0);
        left.rotate_left(first);
        left
    }
}

fn product(a: [i128; 3], b: [i128; 3]) -> i128 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Whether two triangles that run alike make an angle of at most 100 degrees.
fn smooth(n: [i128; 3], m: [i128; 3]) -> bool {
    let size = |v: [i128; 3]| (product(v, v) as f64).sqrt();
    product(n, m) as f64 >= -0.17364817766693036 * size(n) * size(m)
}
