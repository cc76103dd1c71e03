//! Flips of edges (section 8.1); neighbours are found by a search through all triangles.

use super::surface::{Surface, Triangle, edges};
use outcrop_geom::Point;
use std::collections::BTreeSet;

/// Sum of bends around an edge below which it is flat enough.
const FLAT: f32 = 1.2;
/// Least reduction of that sum by a flip.
const GAIN: f32 = 0.1;
/// Least shape of a new triangle, if it is less than that of both old ones: twice the area over
/// the two longest sides.
const SLENDER: f64 = 0.2;
/// Passes over all changed edges.
const SWEEPS: usize = 3;

type Edge = [u32; 2];

/// A triangle as it runs; its place in the list decides the order and does not change.
type Run = [u32; 3];

/// Flips edges, block by block: only those between interior triangles with a moved point.
pub fn flip(file: &[Point], shape: &[Point], surface: &mut Surface, block: u32) -> usize {
    let mut flips = 0;
    for b in 0..(file.len() as u32).div_ceil(block) {
        let moved = |v: &u32| file[*v as usize] != shape[*v as usize];
        let these = |t: &&Triangle| t.iter().all(|v| v / block == b) && t.iter().any(moved);
        let runs: Vec<Run> = surface.triangles().iter().filter(these).copied().collect();
        let mut sheet = Sheet {
            file,
            shut: shut(surface, &runs),
            runs: runs.clone(),
        };
        let here = sheet.flip();
        flips += here;
        runs.iter().for_each(|t| surface.remove(*t));
        for mut t in sheet.runs {
            t.sort_unstable();
            surface.insert(t);
        }
    }
    flips
}

/// Vertices whose triangles stay: those with triangles outside the block, and those at a boundary.
fn shut(surface: &Surface, runs: &[Run]) -> BTreeSet<u32> {
    let all: BTreeSet<u32> = runs.iter().flatten().copied().collect();
    let closed = |v: &u32| {
        let others = surface
            .triangles()
            .iter()
            .any(|t| t.contains(v) && !runs.contains(t));
        let mut own = runs.iter().filter(|t| t.contains(v));
        others
            || own.any(|t| {
                edges(*t)
                    .iter()
                    .any(|e| e.contains(v) && surface.is_boundary(*e))
            })
    };
    all.into_iter().filter(closed).collect()
}

struct Sheet<'a> {
    file: &'a [Point],
    runs: Vec<Run>,
    shut: BTreeSet<u32>,
}

impl Sheet<'_> {
    fn flip(&mut self) -> usize {
        let owners = 0..self.runs.len();
        let all = owners.flat_map(|n| (0..3).map(move |k| (n, k)));
        let mut due: BTreeSet<Edge> = all
            .filter(|&(n, k)| {
                self.behind(n, k)
                    .is_some_and(|other| n < other && self.around(n, k, other) >= FLAT)
            })
            .map(|(n, k)| self.edge(n, k))
            .collect();
        let mut flips = 0;
        for _ in 0..SWEEPS {
            let mut after = None;
            while let Some((n, k)) = self.first(&due, after) {
                after = Some((n, k));
                due.remove(&self.edge(n, k));
                let other = self.behind(n, k).expect("an edge with two triangles");
                if let Some(new) = self.pays(n, k, other) {
                    [self.runs[n], self.runs[other]] = new;
                    flips += 1;
                    for t in new {
                        let mut sorted = t;
                        sorted.sort_unstable();
                        due.extend(edges(sorted));
                    }
                }
            }
        }
        flips
    }

    /// The first edge to be examined after a place: by the earlier of its triangles, then by corner.
    fn first(&self, due: &BTreeSet<Edge>, after: Option<(usize, usize)>) -> Option<(usize, usize)> {
        let places = (0..self.runs.len()).flat_map(|n| (0..3).map(move |k| (n, k)));
        let later = |place: &(usize, usize)| after.is_none_or(|a| *place > a);
        places.filter(later).find(|&(n, k)| {
            due.contains(&self.edge(n, k)) && self.behind(n, k).is_some_and(|other| n < other)
        })
    }

    /// The edge opposite corner `k`, lower end first.
    fn edge(&self, n: usize, k: usize) -> Edge {
        let (u, v) = (self.runs[n][(k + 1) % 3], self.runs[n][(k + 2) % 3]);
        [u.min(v), u.max(v)]
    }

    /// The other triangle at the edge opposite corner `k`.
    fn behind(&self, n: usize, k: usize) -> Option<usize> {
        let edge = self.edge(n, k);
        (0..self.runs.len()).find(|&m| m != n && edge.iter().all(|v| self.runs[m].contains(v)))
    }

    /// The sum of bends at an edge and at the other edges of its two triangles; the two of each triangle are
    /// added first.
    fn around(&self, n: usize, k: usize, other: usize) -> f32 {
        let at = self.corner(n, k, other);
        let of = |n: usize, k: usize| self.bend(n, (k + 1) % 3) + self.bend(n, (k + 2) % 3);
        self.bend(n, k) + of(n, k) + of(other, at)
    }

    /// The corner of `other` opposite to its common edge with `n`.
    fn corner(&self, n: usize, k: usize, other: usize) -> usize {
        let edge = self.edge(n, k);
        let t = self.runs[other];
        t.iter().position(|v| !edge.contains(v)).expect("a corner")
    }

    fn bend(&self, n: usize, k: usize) -> f32 {
        self.behind(n, k).map_or(0.0, |other| {
            let (u, v) = (self.runs[n][(k + 1) % 3], self.runs[n][(k + 2) % 3]);
            distance(self.unit(self.runs[n]), self.seen(other, u, v))
        })
    }

    /// The unit normal of a triangle, oriented so that it runs from `u` to `v`.
    fn seen(&self, n: usize, u: u32, v: u32) -> [f32; 3] {
        let t = self.runs[n];
        let along = (0..3).any(|k| (t[k], t[(k + 1) % 3]) == (u, v));
        let normal = self.unit(t);
        if along { normal.map(|x| -x) } else { normal }
    }

    fn normal(&self, t: Run) -> [f32; 3] {
        let [a, b, c] = t.map(|v| self.file[v as usize].map(i64::from));
        let side = |to: [i64; 3]| std::array::from_fn::<f32, 3, _>(|i| (to[i] - a[i]) as f32);
        let (u, v) = (side(b), side(c));
        [
            u[1] * v[2] - u[2] * v[1],
            u[2] * v[0] - u[0] * v[2],
            u[0] * v[1] - u[1] * v[0],
        ]
    }

    fn unit(&self, t: Run) -> [f32; 3] {
        let n = self.normal(t);
        let inverse = 1.0 / (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
        n.map(|x| x * inverse)
    }

    /// The two triangles that replace `n` and `other`, if the flip pays.
    fn pays(&self, n: usize, k: usize, other: usize) -> Option<[Run; 2]> {
        let was = self.around(n, k, other);
        let t = self.runs[n];
        let (c, u, v) = (t[k], t[(k + 1) % 3], t[(k + 2) % 3]);
        let d = self.runs[other][self.corner(n, k, other)];
        if was < FLAT || [c, u, d, v].iter().any(|v| self.shut.contains(v)) {
            return None;
        }
        let meet = self.runs.iter().any(|t| t.contains(&c) && t.contains(&d));
        let (one, two) = ([u, d, c], [d, v, c]);
        let (mine, theirs) = (self.unit(t), self.seen(other, u, v));
        let both: [f32; 3] = std::array::from_fn(|i| mine[i] + theirs[i]);
        let faces = |t: Run| {
            let n = self.normal(t);
            n[0] * both[0] + n[1] * both[1] + n[2] * both[2] > 0.0
        };
        let shape = |t: Run| self.shape(t);
        let made = shape(one).min(shape(two));
        let slender = made < SLENDER * SLENDER && made < shape([c, u, v]).min(shape([d, v, u]));
        if meet || !faces(one) || !faces(two) || made == 0.0 || slender {
            return None;
        }
        let side = |new: Run, of: usize, from: u32, to: u32| {
            let k = (0..3).find(|&k| ![from, to].contains(&self.runs[of][k]));
            let beyond = self.behind(of, k.expect("a corner"));
            beyond.map_or(0.0, |m| distance(self.unit(new), self.seen(m, from, to)))
        };
        let inner = distance(self.unit(one), self.unit(two));
        let is = inner
            + (side(one, n, c, u) + side(one, other, u, d))
            + (side(two, other, d, v) + side(two, n, v, c));
        (was - is > GAIN).then_some([one, two])
    }

    /// The square of twice a triangle's area over its two longest sides.
    fn shape(&self, t: Run) -> f64 {
        let [a, b, c] = t.map(|v| self.file[v as usize].map(i64::from));
        let side = |p: [i64; 3], q: [i64; 3]| [q[0] - p[0], q[1] - p[1], q[2] - p[2]];
        let square = |v: [i64; 3]| {
            let v = v.map(|x| x as f64);
            v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
        };
        let (u, v) = (side(a, b), side(a, c));
        let normal = [
            u[1] * v[2] - u[2] * v[1],
            u[2] * v[0] - u[0] * v[2],
            u[0] * v[1] - u[1] * v[0],
        ];
        let (ab, bc, ca) = (square(side(a, b)), square(side(b, c)), square(side(c, a)));
        square(normal) * ab.min(bc).min(ca) / (ab * bc * ca)
    }
}

fn distance(a: [f32; 3], b: [f32; 3]) -> f32 {
    let [x, y, z] = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    (x * x + y * y + z * z).sqrt()
}
