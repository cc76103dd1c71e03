//! Ear clipping of a boundary loop, sharpest corners first, as far as the surface is torn. Where it is open,
//! as at doors and at the outline of a survey, ears would be longer than the spacing of the surface allows.

use super::fill::{Corner, distance, edges, undirected};
use outcrop_geom::Point;
use outcrop_geom::triangle::{length, normal, on_a_line};
use outcrop_paper::method::METHOD;
use outcrop_stages::ids::{Id, Triangle};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// A loop after ear clipping.
pub struct Clipped {
    /// The ears, as oriented triangles.
    pub triangles: Vec<Triangle>,
    /// The remaining corners in order; none if the loop is closed.
    pub left: Vec<Corner>,
}

/// A candidate ear: its sharpness as the bits of a positive number, its corner, and the corner's age. The
/// entry is outdated if the corner has another age by then.
type Ear = Reverse<(u64, usize, u32)>;

struct EarClipper<E> {
    corners: Vec<Corner>,
    /// Local width of the triangles at each corner of the loop.
    spacing: Vec<f64>,
    before: Vec<usize>,
    after: Vec<usize>,
    age: Vec<u32>,
    count: usize,
    edge: E,
    chords: rustc_hash::FxHashSet<(Id, Id)>,
    heap: BinaryHeap<Ear>,
    out: Vec<Triangle>,
}

/// Clips ears of the loop of `corners`; `edge(a, b)` is true if the mesh has that edge.
pub fn zip(corners: Vec<Corner>, edge: impl Fn(Id, Id) -> bool) -> Clipped {
    let n = corners.len();
    let mut clipper = EarClipper {
        spacing: spacing(&corners),
        before: (0..n).map(|x| (x + n - 1) % n).collect(),
        after: (0..n).map(|x| (x + 1) % n).collect(),
        age: vec![0; n],
        count: n,
        corners,
        edge,
        chords: rustc_hash::FxHashSet::default(),
        heap: BinaryHeap::new(),
        out: Vec::new(),
    };
    (0..n).for_each(|x| clipper.consider(x));
    let last = clipper.run();
    let mut left = Vec::new();
    if clipper.count >= 3 {
        let mut x = last;
        for _ in 0..clipper.count {
            left.push(clipper.corners[x]);
            x = clipper.after[x];
        }
    }
    Clipped {
        triangles: clipper.out,
        left,
    }
}

/// For each corner, the mean side length of the triangles at its two edges and at the edges next to them.
fn spacing(corners: &[Corner]) -> Vec<f64> {
    let n = corners.len();
    let width = |(from, to): (&Corner, &Corner)| {
        let sides = [(from.at, to.at), (to.at, to.apex), (from.at, to.apex)];
        sides.map(|(a, b)| distance(a, b)).iter().sum::<f64>() / 3.0
    };
    let own: Vec<f64> = edges(corners).map(width).collect();
    let mean = |x: usize| {
        let near = [(x + n - 1) % n, x, (x + 1) % n, (x + 2) % n];
        near.iter().map(|&y| own[y]).sum::<f64>() / 4.0
    };
    (0..n).map(mean).collect()
}

impl<E: Fn(Id, Id) -> bool> EarClipper<E> {
    /// Enters the ear at a corner if it may be closed.
    fn consider(&mut self, x: usize) {
        if let Some(sharpness) = self.ear(x) {
            let entry = Reverse((sharpness.to_bits(), x, self.age[x]));
            self.heap.push(entry);
        }
    }

    /// Closes ears until no more may be closed; returns one of the remaining corners.
    fn run(&mut self) -> usize {
        let mut some = 0;
        while let Some(Reverse((_, x, age))) = self.heap.pop() {
            if age != self.age[x] || self.count < 3 || self.ear(x).is_none() {
                continue;
            }
            let (s, e) = (self.before[x], self.after[x]);
            self.out.push([s, x, e].map(|c| self.corners[c].id));
            if self.count == 3 {
                self.count = 0;
                return some;
            }
            let (a, b) = (self.corners[s].id, self.corners[e].id);
            self.chords.insert(undirected(a, b));
            self.corners[e].apex = self.corners[x].at;
            self.after[s] = e;
            self.before[e] = s;
            self.age[x] = u32::MAX;
            self.count -= 1;
            some = s;
            for y in [s, e] {
                self.age[y] += 1;
                self.consider(y);
            }
        }
        some
    }

    /// Ratio of the chord to the two edges of a corner, less for sharper ones; `None` if its ear must stay
    /// open.
    fn ear(&self, x: usize) -> Option<f64> {
        let (s, e) = (self.before[x], self.after[x]);
        let [cs, cx, ce] = [s, x, e].map(|c| &self.corners[c]);
        if cs.id == ce.id || cs.id == cx.id || cx.id == ce.id {
            return None;
        }
        let closes = self.count == 3;
        let chord = distance(cs.at, ce.at);
        let way = distance(cs.at, cx.at) + distance(cx.at, ce.at);
        if !closes {
            let spacing = 0.5 * (self.spacing[s] + self.spacing[e]);
            if chord > METHOD.ear_clipping.reach * spacing
                || cs.pinched && ce.pinched
                || self.chords.contains(&undirected(cs.id, ce.id))
                || (self.edge)(cs.id, ce.id)
            {
                return None;
            }
        }
        let n = normal(cs.at, cx.at, ce.at);
        let size = length(n);
        let fits = |m: [i128; 3]| {
            let dot: f64 = (0..3).map(|k| (n[k] * m[k]) as f64).sum();
            dot >= METHOD.ear_clipping.fold * size * length(m)
        };
        if n == [0; 3]
            || on_a_line([cs.file, cx.file, ce.file])
            || !fits(normal(cx.at, cs.at, cx.apex))
            || !fits(normal(ce.at, cx.at, ce.apex))
            || closes && !fits(normal(cs.at, ce.at, cs.apex))
            || !closes && self.covers(s, x, e, n)
        {
            return None;
        }
        Some(chord / way)
    }

    /// True if a corner nearby along the loop lies under or over the ear.
    fn covers(&self, s: usize, x: usize, e: usize, n: [i128; 3]) -> bool {
        let [a, b, c] = [s, x, e].map(|y| self.corners[y].at);
        let under = |p: Point| {
            let side = |from: Point, to: Point| {
                let m = normal(from, to, p);
                m[0] * n[0] + m[1] * n[1] + m[2] * n[2] >= 0
            };
            side(a, b) && side(b, c) && side(c, a)
        };
        let ends = [s, x, e].map(|y| self.corners[y].id);
        let (mut left, mut right) = (s, e);
        for _ in 0..METHOD.ear_clipping.look {
            left = self.before[left];
            right = self.after[right];
            for y in [left, right] {
                let corner = &self.corners[y];
                if !ends.contains(&corner.id) && under(corner.at) {
                    return true;
                }
            }
        }
        false
    }
}
