//! The triangles of a cell while edges are contracted: fans of vertices, and what a contraction would do to them.

use super::quadric::{NUMBERS, Quadric, V3, cross, dot, minus, of_triangles};

/// The end of a list.
const NONE: u32 = u32::MAX;

/// Least cosine between the normals of a triangle before and after a contraction.
const TURN: f64 = 0.5;

/// Least quality of a triangle that a contraction may make, unless one was worse before: 1 for equal sides, 0 for no
/// area.
const QUALITY: f64 = 0.03;

/// Weight of the planes that hold a boundary, a part of the squared length of its edges.
const BOUNDARY: f64 = 1.0;

/// A vertex of a cell as it is read.
#[derive(Debug, Clone)]
pub(super) struct Vertices {
    pub points: Vec<V3>,
    /// One quadric for each vertex; none in the first pass.
    pub quadrics: Vec<Quadric>,
    /// The values of all vertices, one after the other.
    pub values: Vec<f64>,
    /// True for values that lie between those of both ends of an edge.
    pub blended: Vec<bool>,
    /// True for vertices that stay where they are.
    pub locked: Vec<bool>,
}

/// The triangles of a cell.
pub(super) struct Patch {
    pub points: Vec<V3>,
    pub quadrics: Vec<Quadric>,
    pub values: Vec<f64>,
    blended: Vec<bool>,
    pub locked: Vec<bool>,
    pub boundary: Vec<bool>,
    /// Corners; a triangle that is gone has [`NONE`] as its first.
    pub triangles: Vec<[u32; 3]>,
    /// The first corner (3 × triangle + place) at each vertex, and the next at the same vertex.
    head: Vec<u32>,
    next: Vec<u32>,
    /// For each vertex the last search that saw it.
    seen: Vec<u32>,
    search: u32,
    pub count: usize,
}

/// What is found around an edge: the triangles and neighbours of both ends.
#[derive(Default)]
pub(super) struct Around {
    /// Triangles with one end, and those with both.
    pub of_a: Vec<u32>,
    pub of_b: Vec<u32>,
    pub of_both: Vec<u32>,
    neighbours: Vec<u32>,
}

pub(super) fn is_gone(triangle: &[u32; 3]) -> bool {
    triangle[0] == NONE
}

fn normal(corners: [V3; 3]) -> V3 {
    cross(minus(corners[1], corners[0]), minus(corners[2], corners[0]))
}

/// 1 for equal sides, 0 for no area.
fn quality(corners: [V3; 3], normal: V3) -> f64 {
    let [a, b, c] = corners;
    let sides = [minus(b, a), minus(c, b), minus(a, c)];
    let sum: f64 = sides.iter().map(|side| dot(*side, *side)).sum();
    match sum > 0.0 {
        true => 2.0 * 3f64.sqrt() * dot(normal, normal).sqrt() / sum,
        false => 0.0,
    }
}

impl Patch {
    /// The triangles of a cell. Triangles with two equal corners are left out. Vertices at which it is no surface are
    /// locked.
    pub fn new(vertices: Vertices, mut triangles: Vec<[u32; 3]>, keep_boundary: bool) -> Self {
        triangles.retain(|[a, b, c]| a != b && b != c && c != a);
        let count = vertices.points.len();
        let is_first = vertices.quadrics.is_empty();
        let mut patch = Self {
            blended: vertices.blended,
            quadrics: match is_first {
                true => of_triangles(&vertices.points, &triangles),
                false => vertices.quadrics,
            },
            points: vertices.points,
            values: vertices.values,
            locked: vertices.locked,
            boundary: vec![false; count],
            head: vec![NONE; count],
            next: vec![NONE; 3 * triangles.len()],
            seen: vec![0; count],
            search: 0,
            count: triangles.len(),
            triangles,
        };
        for corner in (0..3 * patch.triangles.len()).rev() {
            let vertex = patch.triangles[corner / 3][corner % 3] as usize;
            patch.next[corner] = patch.head[vertex];
            patch.head[vertex] = corner as u32;
        }
        patch.look_at_edges(is_first);
        patch.lock_pinches();
        if keep_boundary {
            let all = patch.locked.iter_mut().zip(&patch.boundary);
            all.for_each(|(locked, boundary)| *locked |= boundary);
        }
        patch
    }

    /// The number of triangles with a corner that stays.
    pub fn held(&self) -> usize {
        let is_held = |t: &&[u32; 3]| t.iter().any(|v| self.locked[*v as usize]);
        self.triangles.iter().filter(is_held).count()
    }

    fn corners(&self, triangle: u32) -> [V3; 3] {
        self.triangles[triangle as usize].map(|v| self.points[v as usize])
    }

    /// All sides of triangles: smaller end, larger end, and the triangle, with a bit for the direction.
    fn sides(&self) -> Vec<(u32, u32, u32)> {
        let mut all = Vec::with_capacity(3 * self.triangles.len());
        for ([a, b, c], number) in self.triangles.iter().zip(0u32..) {
            for (a, b) in [(*a, *b), (*b, *c), (*c, *a)] {
                all.push((a.min(b), a.max(b), number << 1 | u32::from(a > b)));
            }
        }
        all.sort_unstable();
        all
    }

    /// Finds the boundary, and locks the ends of edges that are no edges of an oriented surface.
    fn look_at_edges(&mut self, is_first: bool) {
        for same in self.sides().chunk_by(|s, t| (s.0, s.1) == (t.0, t.1)) {
            let ends = [same[0].0 as usize, same[0].1 as usize];
            match same {
                [only] => {
                    // Between two locked vertices the edge may have triangles in other cells.
                    if !ends.iter().all(|v| self.locked[*v]) {
                        ends.iter().for_each(|v| self.boundary[*v] = true);
                        if is_first {
                            self.hold(ends, only.2 >> 1);
                        }
                    }
                }
                [one, other] if (one.2 ^ other.2) & 1 == 1 => {}
                _ => ends.iter().for_each(|v| self.locked[*v] = true),
            }
        }
    }

    /// Adds the plane through an edge of the boundary that is upright on its triangle.
    fn hold(&mut self, ends: [usize; 2], triangle: u32) {
        let along = minus(self.points[ends[1]], self.points[ends[0]]);
        let upright = cross(along, normal(self.corners(triangle)));
        let length = dot(upright, upright).sqrt();
        if length > 0.0 {
            let weight = BOUNDARY * dot(along, along);
            for v in ends {
                self.quadrics[v].add_plane(upright.map(|x| x / length), weight);
            }
        }
    }

    /// Locks vertices whose triangles are more than one fan.
    fn lock_pinches(&mut self) {
        let (mut fan, mut reached) = (Vec::new(), Vec::new());
        for v in 0..self.points.len() as u32 {
            if self.locked[v as usize] {
                continue;
            }
            fan.clear();
            self.fan(v, &mut fan);
            let Some(first) = fan.first() else { continue };
            reached.clear();
            reached.push(*first);
            let mut at = 0;
            while at < reached.len() {
                let known = self.triangles[reached[at] as usize];
                at += 1;
                for &other in &fan {
                    let corners = self.triangles[other as usize];
                    let shares = |c: &u32| *c != v && known.contains(c);
                    if corners.iter().any(shares) && !reached.contains(&other) {
                        reached.push(other);
                    }
                }
            }
            self.locked[v as usize] = reached.len() < fan.len();
        }
    }

    /// Appends the triangles at a vertex.
    pub fn fan(&mut self, vertex: u32, all: &mut Vec<u32>) {
        let (mut before, mut corner) = (NONE, self.head[vertex as usize]);
        while corner != NONE {
            let next = self.next[corner as usize];
            if is_gone(&self.triangles[corner as usize / 3]) {
                match before {
                    NONE => self.head[vertex as usize] = next,
                    before => self.next[before as usize] = next,
                }
            } else {
                all.push(corner / 3);
                before = corner;
            }
            corner = next;
        }
    }

    /// The neighbours of a vertex, each once, in a fixed order.
    pub fn neighbours(&mut self, vertex: u32, fan: &[u32], all: &mut Vec<u32>) {
        self.search += 1;
        self.seen[vertex as usize] = self.search;
        for triangle in fan {
            for v in self.triangles[*triangle as usize] {
                if self.seen[v as usize] != self.search {
                    self.seen[v as usize] = self.search;
                    all.push(v);
                }
            }
        }
    }

    /// Looks around the edge from `a` to `b`: true if the surface stays one, and has the same shape in the sense of
    /// topology, when `b` is put into `a`, and no boundary moves to the inside.
    pub fn can_contract(&mut self, a: u32, b: u32, around: &mut Around) -> bool {
        let Around {
            of_a,
            of_b,
            of_both,
            neighbours,
        } = around;
        for list in [&mut *of_a, of_b, of_both, neighbours] {
            list.clear();
        }
        self.fan(a, of_a);
        self.neighbours(a, of_a, neighbours);
        self.fan(b, of_b);
        let has = |all: &[[u32; 3]], t: &u32, v: u32| all[*t as usize].contains(&v);
        of_b.retain(|t| !has(&self.triangles, t, a));
        of_both.extend(of_a.extract_if(.., |t| has(&self.triangles, t, b)));
        let opposite = |t: &u32| {
            let corners = self.triangles[*t as usize];
            corners.into_iter().find(|v| *v != a && *v != b)
        };
        let mut tips = of_both.iter().filter_map(opposite);
        let tips = [tips.next(), tips.next()];
        if of_both.is_empty() || of_both.len() > 2 || of_b.is_empty() && of_a.is_empty() {
            return false;
        }
        // The neighbours of `a` are still marked. Those of both ends must be the tips.
        let locked = self.locked[a as usize];
        for t in of_b.iter() {
            for v in self.triangles[*t as usize] {
                let near = self.seen[v as usize] == self.search;
                if v == b || tips.contains(&Some(v)) {
                    continue;
                }
                // A new edge between locked vertices might be one of another cell.
                if near || locked && self.locked[v as usize] {
                    return false;
                }
            }
        }
        if let [Some(c), Some(d)] = tips {
            let closes = |all: &[u32]| {
                all.iter()
                    .any(|t| has(&self.triangles, t, c) && has(&self.triangles, t, d))
            };
            // Both ends have a triangle with both tips: one triangle would lie on the other.
            if c == d || closes(of_a) && closes(of_b) {
                return false;
            }
        }
        self.keeps_boundary(a, b, of_both.len())
            && tips
                .iter()
                .flatten()
                .all(|tip| self.has_others(*tip, of_both))
    }

    /// True if a vertex has triangles besides these.
    fn has_others(&self, vertex: u32, these: &[u32]) -> bool {
        let mut corner = self.head[vertex as usize];
        while corner != NONE {
            let triangle = corner / 3;
            if !is_gone(&self.triangles[triangle as usize]) && !these.contains(&triangle) {
                return true;
            }
            corner = self.next[corner as usize];
        }
        false
    }

    fn keeps_boundary(&self, a: u32, b: u32, both: usize) -> bool {
        let [a, b] = [a, b].map(|v| v as usize);
        match (self.boundary[a] || self.locked[a], self.boundary[b]) {
            (true, true) => both == 1,
            _ => both == 2,
        }
    }

    /// True if no triangle around turns over or becomes a sliver when both ends of the edge are at `place`.
    pub fn keeps_triangles(&self, a: u32, b: u32, place: V3, around: &Around) -> bool {
        let mut worst = 1f64;
        let mut made = 1f64;
        for (end, triangles) in [(a, &around.of_a), (b, &around.of_b)] {
            for triangle in triangles {
                let old = self.corners(*triangle);
                let corners = self.triangles[*triangle as usize];
                let new: [V3; 3] =
                    std::array::from_fn(|k| if corners[k] == end { place } else { old[k] });
                let [was, is] = [old, new].map(normal);
                let lengths = (dot(was, was) * dot(is, is)).sqrt();
                if dot(was, is) < TURN * lengths || dot(is, is) <= 0.0 && dot(was, was) > 0.0 {
                    return false;
                }
                worst = worst.min(quality(old, was));
                made = made.min(quality(new, is));
            }
        }
        made >= QUALITY.min(worst)
    }

    /// Puts `b` into `a`, which comes to be at `place`.
    pub fn contract(&mut self, a: u32, b: u32, place: V3, around: &Around) {
        let [at, from] = [a, b].map(|v| v as usize);
        let (p, q) = (self.points[at], self.points[from]);
        let moved = self.quadrics[at].moved(minus(place, p));
        self.quadrics[at] = moved.plus(&self.quadrics[from].moved(minus(place, q)));
        self.blend(at, from, place);
        self.points[at] = place;
        self.boundary[at] |= self.boundary[from];
        for triangle in &around.of_both {
            self.triangles[*triangle as usize][0] = NONE;
        }
        self.count -= around.of_both.len();
        for triangle in &around.of_b {
            let corners = &mut self.triangles[*triangle as usize];
            corners
                .iter_mut()
                .for_each(|v| *v = if *v == b { a } else { *v });
        }
        // The list of `b` goes before that of `a`.
        let mut last = NONE;
        let mut corner = self.head[from];
        while corner != NONE {
            last = corner;
            corner = self.next[corner as usize];
        }
        if last != NONE {
            self.next[last as usize] = self.head[at];
            self.head[at] = self.head[from];
            self.head[from] = NONE;
        }
    }

    /// Removes all triangles that hang together with a vertex.
    pub fn remove(&mut self, vertex: u32) {
        let (mut open, mut fan) = (vec![vertex], Vec::new());
        while let Some(vertex) = open.pop() {
            fan.clear();
            self.fan(vertex, &mut fan);
            self.count -= fan.len();
            for triangle in &fan {
                let corners = &mut self.triangles[*triangle as usize];
                open.extend(*corners);
                corners[0] = NONE;
            }
        }
    }

    /// The triangles that are left.
    pub fn left(&self) -> impl Iterator<Item = &[u32; 3]> {
        self.triangles.iter().filter(|t| !is_gone(t))
    }

    /// Values of a vertex.
    pub fn width(&self) -> usize {
        self.blended.len()
    }

    /// The values at `place`: between those of both ends, as far as it lies along the edge, or those of the nearer end.
    fn blend(&mut self, at: usize, from: usize, place: V3) {
        if self.locked[at] || self.width() == 0 {
            return;
        }
        let along = minus(self.points[from], self.points[at]);
        let length2 = dot(along, along);
        let part = match length2 > 0.0 {
            true => (dot(minus(place, self.points[at]), along) / length2).clamp(0.0, 1.0),
            false => 0.0,
        };
        let width = self.width();
        for k in 0..width {
            let part = if self.blended[k] { part } else { part.round() };
            let (old, other) = (self.values[at * width + k], self.values[from * width + k]);
            self.values[at * width + k] = match part {
                0.0 => old,
                1.0 => other,
                part => old + part * (other - old),
            };
        }
    }

    /// Bytes of memory for each triangle of a cell, with the queue of edges.
    pub fn bytes_each(width: usize) -> u64 {
        // Half a vertex; three corners and their lists; at most nine edges for each vertex in the queue, and the
        // vector that holds them may be twice as large.
        let vertex = 24 + 8 * NUMBERS as u64 + 8 * width as u64 + 2 + 12;
        vertex / 2 + 24 + 9 * 16 + 64
    }
}
