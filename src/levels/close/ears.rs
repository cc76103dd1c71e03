//! Ear clipping of a loop in a plane, the shortest chords first, so that the triangles grow evenly towards the middle.

use crate::meet::norm;
use outcrop_geom::vector::{V3, cross, sub};
use rustc_hash::FxHashSet;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// A clipped loop.
pub(super) struct Clipped {
    /// The ears.
    pub triangles: Vec<[u32; 3]>,
    /// The vertices of the loop that is left; none if it is closed.
    pub left: Vec<u32>,
    /// Ears that overlap others in the plane.
    pub forced: u64,
}

/// The vertices that are left, by cells of a grid.
struct Grid {
    low: [f64; 2],
    cell: f64,
    across: [usize; 2],
    starts: Vec<u32>,
    points: Vec<u32>,
}

impl Grid {
    /// Of the points with these numbers: about one in a cell.
    fn of(flat: &[[f64; 2]], numbers: &[u32]) -> Self {
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 2];
        for v in numbers {
            for k in 0..2 {
                low[k] = low[k].min(flat[*v as usize][k]);
                high[k] = high[k].max(flat[*v as usize][k]);
            }
        }
        let size = [0, 1].map(|k| (high[k] - low[k]).max(0.0));
        let count = numbers.len().max(1) as f64;
        let cell = (size[0] * size[1] / count).sqrt();
        let cell = cell.max((size[0] + size[1]) / count).max(f64::MIN_POSITIVE);
        let across = size.map(|s| ((s / cell) as usize).min(4 * numbers.len()) + 1);
        let mut grid = Self {
            low,
            cell,
            across,
            starts: vec![0; across[0] * across[1] + 1],
            points: vec![0; numbers.len()],
        };
        for v in numbers {
            let at = grid.index(flat[*v as usize]);
            grid.starts[at + 1] += 1;
        }
        for at in 1..grid.starts.len() {
            grid.starts[at] += grid.starts[at - 1];
        }
        let mut next = grid.starts.clone();
        for v in numbers {
            let at = grid.index(flat[*v as usize]);
            grid.points[next[at] as usize] = *v;
            next[at] += 1;
        }
        grid
    }

    fn column(&self, x: f64, axis: usize) -> usize {
        (((x - self.low[axis]) / self.cell) as usize).min(self.across[axis] - 1)
    }

    fn index(&self, [x, y]: [f64; 2]) -> usize {
        self.column(x, 0) + self.across[0] * self.column(y, 1)
    }

    /// Calls `found` with the points of all cells that a box meets, until it says true.
    fn any(&self, low: [f64; 2], high: [f64; 2], mut found: impl FnMut(u32) -> bool) -> bool {
        let [from, to] = [low, high].map(|p| [self.column(p[0], 0), self.column(p[1], 1)]);
        for row in from[1]..=to[1] {
            let row = row * self.across[0];
            let range = self.starts[row + from[0]] as usize..self.starts[row + to[0] + 1] as usize;
            if self.points[range].iter().any(|v| found(*v)) {
                return true;
            }
        }
        false
    }
}

/// How ears are judged, the strictest first.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Rule {
    /// It is convex and no other vertex lies in it.
    Clean,
    /// It is convex.
    Convex,
    /// Its triangle has an area.
    Any,
}

/// Part of the vertices that are clipped against the rule before clean ears are sought again. With all at once, loops
/// that cross themselves once would be covered by folds.
const FORCED: usize = 32;

struct Clipper<'a, A> {
    flat: &'a [[f64; 2]],
    points: &'a [V3],
    allows: A,
    before: Vec<u32>,
    after: Vec<u32>,
    age: Vec<u32>,
    left: usize,
    chords: FxHashSet<[u32; 2]>,
    grid: Grid,
    rule: Rule,
}

/// Twice the area of a triangle in the plane, and a bound of its error.
fn turn(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> (f64, f64) {
    let (u, v) = ([b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]);
    let (x, y) = (u[0] * v[1], u[1] * v[0]);
    // Eight roundings of relative size 2^-53, about.
    (x - y, 1e-15 * (x.abs() + y.abs()))
}

impl<A: Fn(u32, u32) -> bool> Clipper<'_, A> {
    /// The length of the chord of the ear at a vertex, if the rule permits it.
    fn ear(&self, v: u32) -> Option<f64> {
        let (s, e) = (self.before[v as usize], self.after[v as usize]);
        if s == e {
            return None;
        }
        let [a, b, c] = [s, v, e].map(|x| self.flat[x as usize]);
        let [pa, pb, pc] = [s, v, e].map(|x| self.points[x as usize]);
        let size = norm(cross(sub(pb, pa), sub(pc, pa)));
        let chord = norm(sub(pc, pa));
        if size <= 1e-12 * chord * norm(sub(pb, pa)) {
            return None;
        }
        let closes = self.left == 3;
        let pair = [s.min(e), s.max(e)];
        if !closes && (!(self.allows)(s, e) || self.chords.contains(&pair)) {
            return None;
        }
        if self.rule != Rule::Any {
            let (area, error) = turn(a, b, c);
            if area <= error || self.rule == Rule::Clean && !closes && self.covers([s, v, e]) {
                return None;
            }
        }
        Some(chord)
    }

    /// True if another vertex lies in the ear or on its border.
    fn covers(&self, ear: [u32; 3]) -> bool {
        let corners = ear.map(|x| self.flat[x as usize]);
        let [a, b, c] = corners;
        let low = [0, 1].map(|k| a[k].min(b[k]).min(c[k]));
        let high = [0, 1].map(|k| a[k].max(b[k]).max(c[k]));
        self.grid.any(low, high, |x| {
            if self.age[x as usize] == u32::MAX || ear.contains(&x) {
                return false;
            }
            let p = self.flat[x as usize];
            let inside = |from, to| {
                let (area, error) = turn(from, to, p);
                area >= -error
            };
            if corners.contains(&p) {
                // At the place of a corner: it is in the ear if its own edges lead into it.
                return false;
            }
            inside(a, b) && inside(b, c) && inside(c, a)
        })
    }

    fn enter(&self, v: u32, heap: &mut BinaryHeap<Reverse<(u64, u32, u32)>>) {
        if let Some(chord) = self.ear(v) {
            heap.push(Reverse((chord.to_bits(), v, self.age[v as usize])));
        }
    }

    fn rest(&self) -> Vec<u32> {
        let Some(first) = (0..self.age.len()).find(|v| self.age[*v] != u32::MAX) else {
            return Vec::new();
        };
        let mut all = vec![first as u32];
        let mut at = self.after[first];
        while at != first as u32 {
            all.push(at);
            at = self.after[at as usize];
        }
        all
    }

    /// Clips ears by a rule until none is permitted, `most` at most; true if it clipped one.
    fn run(&mut self, rule: Rule, most: usize, triangles: &mut Vec<[u32; 3]>) -> bool {
        self.rule = rule;
        let before = self.left;
        let mut heap = BinaryHeap::new();
        self.rest().iter().for_each(|v| self.enter(*v, &mut heap));
        let mut dense = self.left;
        while let Some(Reverse((_, v, age))) = heap.pop() {
            if self.age[v as usize] != age || self.ear(v).is_none() {
                continue;
            }
            let (s, e) = (self.before[v as usize], self.after[v as usize]);
            triangles.push([s, v, e]);
            self.age[v as usize] = u32::MAX;
            if self.left == 3 {
                self.left = 0;
                return true;
            }
            self.left -= 1;
            self.chords.insert([s.min(e), s.max(e)]);
            self.after[s as usize] = e;
            self.before[e as usize] = s;
            if 2 * self.left < dense {
                dense = self.left;
                self.grid = Grid::of(self.flat, &self.rest());
            }
            for x in [s, e] {
                self.age[x as usize] += 1;
                self.enter(x, &mut heap);
            }
            if before - self.left == most {
                break;
            }
        }
        self.left < before
    }
}

/// Clips a loop, given by its places in a plane, counter-clockwise, and by its points. What crosses itself in the
/// plane is clipped as well as can be. `allows` says which vertices may be joined.
pub(super) fn clip(flat: &[[f64; 2]], points: &[V3], allows: impl Fn(u32, u32) -> bool) -> Clipped {
    let n = flat.len();
    let all: Vec<u32> = (0..n as u32).collect();
    let mut clipper = Clipper {
        grid: Grid::of(flat, &all),
        flat,
        points,
        allows,
        before: (0..n).map(|v| ((v + n - 1) % n) as u32).collect(),
        after: (0..n).map(|v| ((v + 1) % n) as u32).collect(),
        age: vec![0; n],
        left: n,
        chords: FxHashSet::default(),
        rule: Rule::Clean,
    };
    let (mut triangles, mut forced) = (Vec::with_capacity(n), 0);
    // What is forced may make room for clean ears.
    while clipper.left > 0 {
        let some = 1 + clipper.left / FORCED;
        if clipper.run(Rule::Clean, n, &mut triangles) {
            continue;
        }
        let before = triangles.len();
        if !clipper.run(Rule::Convex, some, &mut triangles)
            && !clipper.run(Rule::Any, some, &mut triangles)
        {
            break;
        }
        forced += (triangles.len() - before) as u64;
    }
    Clipped {
        triangles,
        forced,
        left: match clipper.left {
            0 => Vec::new(),
            _ => clipper.rest(),
        },
    }
}
