//! The tests that a T12 triangle must pass (paper, section 3.5): combinatorial I to III and the
//! geometric one. Test IV is with the callers, who know the components.

use crate::geom::Point;
use crate::stages::located::normal;
use crate::stages::surface::star::{EDGES, Triangle, opposed, others};

/// The mesh around the vertices of a triangle.
pub trait View {
    /// All triangles at `v`: their number and their other two vertices, ascending.
    fn around(&self, v: u32) -> impl Iterator<Item = (u32, [u32; 2])>;
    /// The position of a vertex of a triangle of the mesh or of a candidate.
    fn position(&self, v: u32) -> Point;
}

/// Why a candidate is not inserted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refusal {
    /// Not properly connected to the mesh, for now.
    Unconnected,
    /// An edge has two triangles already.
    FullEdge,
    /// A vertex would have a closed fan and more.
    Excess,
    /// The normals differ too much.
    Angle,
}

/// A triangle adjacent to a candidate: its number, and whether the candidate must be turned
/// against it.
pub type Adjacent = (u32, bool);

/// Applies the tests I, II, III and G in this order; the adjacent triangles by edge on success.
/// `link` is room to work in.
///
/// # Errors
/// The first test that fails.
pub fn examine(
    t: Triangle,
    view: &impl View,
    cos_max_angle: f64,
    link: &mut Vec<[u32; 2]>,
) -> Result<[Option<Adjacent>; 3], Refusal> {
    // At each edge the number of a triangle and its third vertex.
    let mut found: [Option<(u32, u32)>; 3] = [None; 3];
    let mut counts = [0usize; 3];
    let mut used = [false; 3];
    // Does the triangle with `other` beside its first vertex have the edge to `end`?
    let mut see = |edge: usize, number: u32, [a, b]: [u32; 2], end: u32| {
        if a == end || b == end {
            counts[edge] += 1;
            found[edge] = Some((number, if a == end { b } else { a }));
        }
    };
    // The edges are (0,1), (0,2) and (1,2); the first two are seen from vertex 0.
    for (number, other) in view.around(t[0]) {
        used[0] = true;
        see(0, number, other, t[1]);
        see(1, number, other, t[2]);
    }
    for (number, other) in view.around(t[1]) {
        used[1] = true;
        see(2, number, other, t[2]);
    }
    used[2] = view.around(t[2]).next().is_some();
    let connected = counts.iter().filter(|c| **c > 0).count();
    let lone = (0..3).find(|&e| counts[e] > 0);
    match (connected, lone) {
        (0, _) | (_, None) => return Err(Refusal::Unconnected),
        (1, Some(edge)) if used[EDGES[edge].2] => return Err(Refusal::Unconnected),
        _ => {}
    }
    if counts.iter().any(|c| *c > 1) {
        return Err(Refusal::FullEdge);
    }
    if t.iter().any(|&v| makes_excess(t, v, view, link)) {
        return Err(Refusal::Excess);
    }
    let mut adjacent = [None; 3];
    for (edge, (a, b, c, _)) in EDGES.into_iter().enumerate() {
        let Some((number, far)) = found[edge] else {
            continue;
        };
        if !angle_fits(
            [t[a], t[b], t[c]].map(|v| view.position(v)),
            view.position(far),
            cos_max_angle,
        ) {
            return Err(Refusal::Angle);
        }
        let other = with_edge(t[a], t[b], far);
        adjacent[edge] = Some((number, opposed(t, other, t[a], t[b])));
    }
    Ok(adjacent)
}

/// The triangle of an edge `low < high` and a third vertex.
fn with_edge(low: u32, high: u32, third: u32) -> Triangle {
    if third < low {
        [third, low, high]
    } else if third < high {
        [low, third, high]
    } else {
        [low, high, third]
    }
}

/// True if with `t` the link of `v` would have a closed cycle and another component.
fn makes_excess(t: Triangle, v: u32, view: &impl View, link: &mut Vec<[u32; 2]>) -> bool {
    link.clear();
    link.extend(view.around(v).map(|(_, other)| other));
    let edges = link.len();
    if edges == 0 {
        return false;
    }
    // A link without ends is closed already.
    let degree = |node: u32| link.iter().filter(|e| e[0] == node || e[1] == node).count();
    if link.iter().flatten().all(|&node| degree(node) == 2) {
        return true;
    }
    let [from, goal] = others(t, v);
    let mut node = from;
    while node != goal {
        let next = link.iter().position(|e| e[0] == node || e[1] == node);
        let Some(next) = next else { return false };
        let [a, b] = link.swap_remove(next);
        node ^= a ^ b;
    }
    !link.is_empty()
}

/// Do `a b c` and its neighbour `b a far` across the edge `a b` agree?
fn angle_fits([a, b, c]: [Point; 3], far: Point, cos_max_angle: f64) -> bool {
    let n = normal(a, b, c);
    let m = normal(b, a, far);
    let dot = |x: [i128; 3], y: [i128; 3]| (x[0] * y[0] + x[1] * y[1] + x[2] * y[2]) as f64;
    dot(n, m) >= cos_max_angle * dot(n, n).sqrt() * dot(m, m).sqrt()
}

/// A triangle that may be inserted; in the order in which they are tried.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Candidate {
    /// Class and, below 2^62, the square of the longest edge.
    rank: u64,
    /// Vertices.
    pub ids: Triangle,
    /// When it was last tried; used by the one who tries.
    pub tried: u32,
}

impl Candidate {
    /// The candidate seen by `count` cells (3: it was flagged).
    #[must_use]
    pub fn new(ids: Triangle, count: u32, [a, b, c]: [Point; 3]) -> Self {
        let d = crate::geom::distance2;
        let length = d(a, b).max(d(b, c)).max(d(a, c));
        Self {
            rank: u64::from(3 - count.min(3)) << 62 | length,
            ids,
            tried: 0,
        }
    }

    /// As a record, in the same order.
    #[must_use]
    pub fn record(&self) -> [u32; 5] {
        let [i, j, k] = self.ids;
        [(self.rank >> 32) as u32, self.rank as u32, i, j, k]
    }

    /// From a record.
    #[must_use]
    pub fn from_record([high, low, i, j, k]: [u32; 5]) -> Self {
        Self {
            rank: u64::from(high) << 32 | u64::from(low),
            ids: [i, j, k],
            tried: 0,
        }
    }
}
