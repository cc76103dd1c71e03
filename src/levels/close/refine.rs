//! A lid refined to the spacing of its rim (Liepa 2003): triangles are split at their middles, and edges flipped until
//! no pair of triangles has opposite angles of more than 180 degrees.

use super::lid::{Loop, Patch};
use crate::meet::norm;
use outcrop_geom::vector::{V3, add, cross, dot, scale, sub};
use rustc_hash::FxHashSet;

/// A triangle is split if its middle is so many times farther from its corners than their spacing (Liepa 2003: the
/// root of 2, for triangles of the density of the rim).
const DENSITY: f64 = std::f64::consts::SQRT_2;

/// No neighbour.
const NONE: u32 = u32::MAX;

/// A patch that is refined.
pub(super) struct Net<'a> {
    pub around: &'a Loop,
    /// Positions of the rim, then of the new vertices.
    pub points: Vec<V3>,
    /// Where they lie on the lid.
    flat: Vec<V3>,
    /// True while triangles are split and edges flipped as they lie on the lid. On the patch alone that might never
    /// end: fairing moves vertices along it.
    pub on_lid: bool,
    /// The wanted spacing at each vertex.
    spacing: Vec<f64>,
    /// How the spacing grows from triangle to triangle: 1 for that of the rim everywhere.
    growth: f64,
    pub parents: Vec<[u32; 3]>,
    pub triangles: Vec<[u32; 3]>,
    /// The neighbour at the edge opposite of each corner.
    across: Vec<[u32; 3]>,
    edges: FxHashSet<[u32; 2]>,
}

impl<'a> Net<'a> {
    pub fn of(around: &'a Loop, lid: Patch, growth: f64) -> Self {
        let n = around.len();
        let length = |k: usize| norm(sub(around.points[(k + 1) % n], around.points[k % n]));
        let mut spacing: Vec<f64> = (0..n)
            .map(|k| (length(k) + length(k + n - 1)) / 2.0)
            .collect();
        let mean = spacing.iter().sum::<f64>() / n as f64;
        spacing.resize(n + lid.new.len(), mean);
        let mut points = around.points.clone();
        points.extend(lid.new);
        let mut net = Self {
            around,
            flat: points.clone(),
            points,
            on_lid: true,
            spacing,
            growth,
            parents: lid.parents,
            triangles: lid.triangles,
            across: Vec::new(),
            edges: FxHashSet::default(),
        };
        net.link();
        net
    }

    /// Number of vertices of the rim.
    pub fn rim(&self) -> usize {
        self.around.len()
    }

    fn link(&mut self) {
        let mut sides: Vec<([u32; 2], u32, u8)> = Vec::with_capacity(3 * self.triangles.len());
        for (number, t) in self.triangles.iter().enumerate() {
            for k in 0..3 {
                let (a, b) = (t[(k + 1) % 3], t[(k + 2) % 3]);
                sides.push(([a.min(b), a.max(b)], number as u32, k as u8));
            }
        }
        sides.sort_unstable();
        self.edges = sides.iter().map(|side| side.0).collect();
        self.across = vec![[NONE; 3]; self.triangles.len()];
        for same in sides.chunk_by(|a, b| a.0 == b.0) {
            if let [(_, s, i), (_, t, j)] = same {
                self.across[*s as usize][usize::from(*i)] = *t;
                self.across[*t as usize][usize::from(*j)] = *s;
            }
        }
    }

    fn corners(&self, t: [u32; 3]) -> [V3; 3] {
        t.map(|v| self.at(v))
    }

    fn at(&self, v: u32) -> V3 {
        match self.on_lid {
            true => self.flat[v as usize],
            false => self.points[v as usize],
        }
    }

    /// Splits every triangle that is too large; true if there was one.
    pub fn split(&mut self, most: usize) -> bool {
        let mut any = false;
        for number in 0..self.triangles.len() {
            if self.points.len() >= most {
                break;
            }
            let t = self.triangles[number];
            let corners = self.corners(t);
            let middle = mean(corners);
            let spacings = t.map(|v| self.spacing[v as usize]);
            let spacing = self.growth * (spacings[0] + spacings[1] + spacings[2]) / 3.0;
            let is_large = corners.iter().zip(spacings).all(|(corner, own)| {
                let away = DENSITY * norm(sub(middle, *corner));
                away > spacing && away > own
            });
            if is_large {
                self.insert(number, spacing);
                any = true;
            }
        }
        any
    }

    /// Divides a triangle by a new vertex.
    fn insert(&mut self, number: usize, spacing: f64) {
        let new = self.points.len() as u32;
        let [a, b, c] = self.triangles[number];
        let middle = |points: &[V3]| mean([a, b, c].map(|v| points[v as usize]));
        self.points.push(middle(&self.points));
        self.flat.push(middle(&self.flat));
        self.spacing.push(spacing);
        self.parents.push([a, b, c]);
        let (first, second, third) = (
            number as u32,
            self.triangles.len() as u32,
            self.triangles.len() as u32 + 1,
        );
        let [at_a, at_b, at_c] = self.across[number];
        self.triangles[number] = [new, b, c];
        self.triangles.extend([[new, c, a], [new, a, b]]);
        self.across[number] = [at_a, second, third];
        self.across.push([at_b, third, first]);
        self.across.push([at_c, first, second]);
        for (other, now) in [(at_b, second), (at_c, third)] {
            if other != NONE {
                let sides = &mut self.across[other as usize];
                sides
                    .iter_mut()
                    .filter(|s| **s == first)
                    .for_each(|s| *s = now);
            }
        }
        for v in [a, b, c] {
            self.edges.insert([v, new]);
        }
    }

    /// Flips edges until all are as they should be, or long enough.
    pub fn relax(&mut self) {
        let mut queue: Vec<(u32, u8)> = Vec::new();
        for t in (0..self.triangles.len()).rev() {
            queue.extend((0..3).map(|k| (t as u32, k)));
        }
        let mut left = 20 * self.triangles.len() + 100;
        while let Some((t, k)) = queue.pop() {
            if left == 0 {
                break;
            }
            if let Some(other) = self.flip(t as usize, usize::from(k)) {
                left -= 1;
                queue.extend((0..3).flat_map(|k| [(t, k), (other, k)]));
            }
        }
    }

    /// Flips the edge opposite of corner `k`, if that is better; returns the other triangle.
    fn flip(&mut self, t: usize, k: usize) -> Option<u32> {
        let other = self.across[t][k];
        if other == NONE {
            return None;
        }
        let o = other as usize;
        let j = self.across[o].iter().position(|x| *x == t as u32)?;
        let (a, b, c) = (
            self.triangles[t][k],
            self.triangles[t][(k + 1) % 3],
            self.triangles[t][(k + 2) % 3],
        );
        let d = self.triangles[o][j];
        let pair = [a.min(d), a.max(d)];
        let rim = self.rim() as u32;
        if a == d
            || self.edges.contains(&pair)
            || pair[1] < rim && !self.around.allows(pair[0], pair[1])
        {
            return None;
        }
        let [pa, pb, pc, pd] = [a, b, c, d].map(|v| self.at(v));
        if !flips(pa, pb, pc, pd) {
            return None;
        }
        // Triangles a b c and d c b become a b d and a d c.
        let (at_b, at_c) = (self.across[t][(k + 1) % 3], self.across[t][(k + 2) % 3]);
        let place = |v: u32| self.triangles[o].iter().position(|x| *x == v);
        let (on_b, on_c) = (self.across[o][place(b)?], self.across[o][place(c)?]);
        self.edges.remove(&[b.min(c), b.max(c)]);
        self.edges.insert(pair);
        self.triangles[t] = [a, b, d];
        self.across[t] = [on_c, other, at_c];
        self.triangles[o] = [a, d, c];
        self.across[o] = [on_b, at_b, t as u32];
        for (side, was, now) in [(on_c, other, t as u32), (at_b, t as u32, other)] {
            if side != NONE {
                let sides = &mut self.across[side as usize];
                sides
                    .iter_mut()
                    .filter(|s| **s == was)
                    .for_each(|s| *s = now);
            }
        }
        Some(other)
    }

    /// The patch, and its vertices.
    pub fn finish(self) -> Patch {
        let rim = self.around.len();
        Patch {
            new: self.points[rim..].to_vec(),
            parents: self.parents,
            triangles: self.triangles,
        }
    }
}

fn mean([a, b, c]: [V3; 3]) -> V3 {
    scale(add(add(a, b), c), 1.0 / 3.0)
}

/// True if the angles at `a` and `d`, opposite of the edge from `b` to `c`, have more than 180 degrees together, and
/// the triangles with the other edge do not fold more than those with this one.
fn flips(a: V3, b: V3, c: V3, d: V3) -> bool {
    let cosine = |at: V3, p: V3, q: V3| {
        let (u, v) = (sub(p, at), sub(q, at));
        let size = norm(u) * norm(v);
        if size > 0.0 { dot(u, v) / size } else { 1.0 }
    };
    let (x, y) = (cosine(a, b, c), cosine(d, b, c));
    // The sum of two angles is above 180 degrees if the sum of their cosines is negative.
    if x + y >= -1e-9 {
        return false;
    }
    let normal = |p: V3, q: V3, r: V3| cross(sub(q, p), sub(r, p));
    let fold = |u: V3, v: V3| {
        let size = norm(u) * norm(v);
        if size > 0.0 { dot(u, v) / size } else { -1.0 }
    };
    let before = fold(normal(a, b, c), normal(d, c, b));
    let after = fold(normal(a, b, d), normal(a, d, c));
    after >= before.min(0.5) || after > 0.9
}
