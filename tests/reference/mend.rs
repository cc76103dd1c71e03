//! Filling and ear clipping (section 8.7): loops are filled if they are holes, otherwise their sharpest ears
//! are clipped.

use super::big::dot;
use super::holes::{Filling, Holes};
use super::insert::normal;
use super::narrow::left_out;
use super::surface::Edge;
use outcrop_geom::distance2;
use std::collections::BTreeSet;

/// Longer loops stay open.
const LONGEST: usize = 100_000;
/// Loops with at most this number of edges are never outlines.
const SMALL: usize = 6;

/// A boundary loop before filling.
struct Found<'a> {
    holes: &'a Holes<'a>,
    /// Number of its edges, and the sum of their squared lengths.
    edges: usize,
    squares: u128,
    /// True if it is an outline.
    around: bool,
    /// Loops with more edges are not filled.
    longest: usize,
}

/// The result of filling a loop.
enum Outcome {
    /// It is too long, an outline, or cannot be split.
    Cannot,
    /// It is an opening, by itself or by the area of its filling.
    Opening,
    Spanned,
    /// All triangles of the filling are left out.
    Wide,
    /// Some are; the triangles that remain, and the number of those left out without being too wide.
    Part(Vec<[u32; 3]>, usize),
    Whole(Vec<[u32; 3]>),
}

/// The triangles that close a loop, or a part of it.
pub fn mend(
    holes: &Holes<'_>,
    hole: &[u32],
    longest: usize,
    filling: &mut Filling,
) -> Vec<[u32; 3]> {
    let only_gaps = longest < 3;
    let longest = longest.max(3);
    let most = if only_gaps {
        longest
    } else {
        longest.max(LONGEST)
    };
    if hole.len() > most {
        filling.too_long += 1;
        return Vec::new();
    }
    let behind = holes.behind(hole);
    let found = Found {
        holes,
        edges: hole.len(),
        squares: squares(holes, hole),
        around: hole.len() > SMALL && holes.is_outline(hole, &behind),
        longest,
    };
    match found.fill(hole, &behind, &BTreeSet::new()) {
        Outcome::Cannot => {}
        Outcome::Opening => filling.openings += 1,
        Outcome::Spanned => filling.spanned += 1,
        Outcome::Wide => filling.wide += 1,
        Outcome::Part(patch, between) => {
            filling.left_open += 1;
            filling.between += between;
            return in_part(patch, filling);
        }
        Outcome::Whole(patch) => {
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
    found.zip(hole, &behind, filling)
}

/// Counts a loop that stays open in part, and the triangles of its closed part.
fn in_part(triangles: Vec<[u32; 3]>, filling: &mut Filling) -> Vec<[u32; 3]> {
    filling.clipped += 1;
    filling.partly += usize::from(!triangles.is_empty());
    filling.triangles += triangles.len();
    triangles
}

impl Found<'_> {
    /// True if the area is larger than that of a hole of `rest` edges.
    fn is_open(&self, area: f64, rest: usize) -> bool {
        area * self.edges as f64 > 4.5 * self.squares as f64 * rest as f64
    }

    /// Fills the loop or the rest of it.
    fn fill(&self, rest: &[u32], behind: &[u32], taken: &BTreeSet<Edge>) -> Outcome {
        let holes = self.holes;
        if self.around || rest.len() > self.longest {
            return Outcome::Cannot;
        }
        if self.is_open(vector_area(holes, rest), rest.len()) {
            return Outcome::Opening;
        }
        let Some(patch) = filled(holes, rest, behind, taken) else {
            return Outcome::Cannot;
        };
        let ids = |t: &[usize; 3]| t.map(|k| rest[k]);
        let all: Vec<[u32; 3]> = patch.iter().map(ids).collect();
        if self.is_open(area(holes, &all), rest.len()) {
            return Outcome::Spanned;
        }
        let is_wide = |t: &[usize; 3]| holes.density.is_some_and(|d| d.is_wide(ids(t), holes.file));
        let out = left_out(rest.len(), &patch, is_wide);
        let count = out.iter().filter(|out| **out).count();
        if count == 0 {
            return Outcome::Whole(all);
        }
        if count == all.len() {
            return Outcome::Wide;
        }
        let wide = patch.iter().filter(|t| is_wide(t)).count();
        let kept = all.into_iter().zip(out).filter(|(_, out)| !out);
        Outcome::Part(kept.map(|(t, _)| t).collect(), count - wide)
    }

    /// Clips ears of the loop and fills the rest.
    fn zip(&self, hole: &[u32], behind: &[u32], filling: &mut Filling) -> Vec<[u32; 3]> {
        let mut zipper = Zipper::new(self.holes, hole, behind);
        zipper.zip();
        let left = zipper.begin_at_smallest();
        let (left, behind): (Vec<u32>, Vec<u32>) = left.into_iter().unzip();
        let mut triangles = zipper.closed;
        let mut whole = left.is_empty();
        if !whole && !triangles.is_empty() {
            let edges = |&[a, b, c]: &[u32; 3]| [[a, b], [b, c], [c, a]];
            let taken = triangles.iter().flat_map(edges);
            let taken = taken.map(|[a, b]| [a.min(b), a.max(b)]).collect();
            match self.fill(&left, &behind, &taken) {
                Outcome::Whole(patch) => {
                    triangles.extend(patch);
                    whole = true;
                }
                Outcome::Part(patch, between) => {
                    filling.left_open_clipped += 1;
                    filling.between += between;
                    triangles.extend(patch);
                }
                _ => {}
            }
        }
        if !whole {
            return in_part(triangles, filling);
        }
        filling.filled += 1;
        filling.clipped_whole += 1;
        filling.triangles += triangles.len();
        triangles
    }
}

/// Fills a loop unless it is an outline; corners by their positions in it.
fn filled(
    holes: &Holes<'_>,
    hole: &[u32],
    behind: &[u32],
    taken: &BTreeSet<Edge>,
) -> Option<Vec<[usize; 3]>> {
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

/// A corner of the rest of a loop.
#[derive(Debug, Clone, Copy)]
struct Corner {
    v: u32,
    /// Its place in the original loop.
    place: usize,
    spacing: f64,
    /// The third corner of the triangle at the edge to the next corner.
    behind: u32,
    /// The ratio of its ear, while that waits to be clipped.
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

    /// Clips ears, the one with the least ratio first. An ear that may not be clipped when it is examined is
    /// examined again when one of its two edges is new.
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

    /// The ratio of chord to edges of the ear at a corner, if it may be clipped.
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

    /// True if one of the next six corners along the loop, in either direction, is over or under the ear.
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

    /// The rest of the loop, with the third corner at each edge, from its smallest (from, to) pair on.
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

/// True if two triangles that run alike make an angle of at most 100 degrees.
fn smooth(n: [i128; 3], m: [i128; 3]) -> bool {
    let size = |v: [i128; 3]| (product(v, v) as f64).sqrt();
    product(n, m) as f64 >= -0.17364817766693036 * size(n) * size(m)
}
