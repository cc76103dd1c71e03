//! The tests that a T12 triangle must pass (paper, section 3.5): combinatorial I to III and the
//! geometric one. Test IV is with the callers, who know the components.

use crate::geom::{Point, sub};
use crate::stages::surface::star::{EDGES, Triangle, has, opposed, others};

/// The mesh around the vertices of a triangle.
pub trait View {
    /// Calls `each` with all triangles at `v`: their number and their ids.
    fn around(&self, v: u32, each: &mut dyn FnMut(u32, Triangle));
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
///
/// # Errors
/// The first test that fails.
pub fn examine(
    t: Triangle,
    view: &impl View,
    cos_max_angle: f64,
) -> Result<[Option<Adjacent>; 3], Refusal> {
    let mut found: [Option<(u32, Triangle)>; 3] = [None; 3];
    let mut counts = [0usize; 3];
    let mut opposite_used = [false; 3];
    // Position 0 sees edges (0,1) and (0,2); position 1 sees (1,2); each says if it is used.
    for (position, &v) in t.iter().enumerate() {
        view.around(v, &mut |number, other| {
            opposite_used[position] = true;
            for (edge, (a, b, ..)) in EDGES.into_iter().enumerate() {
                if a == position && has(other, t[b]) {
                    counts[edge] += 1;
                    found[edge] = Some((number, other));
                }
            }
        });
    }
    let connected = counts.iter().filter(|c| **c > 0).count();
    let lone = (0..3).find(|&e| counts[e] > 0);
    match (connected, lone) {
        (0, _) | (_, None) => return Err(Refusal::Unconnected),
        (1, Some(edge)) if opposite_used[EDGES[edge].2] => return Err(Refusal::Unconnected),
        _ => {}
    }
    if counts.iter().any(|c| *c > 1) {
        return Err(Refusal::FullEdge);
    }
    if t.iter().any(|&v| makes_excess(t, v, view)) {
        return Err(Refusal::Excess);
    }
    let mut adjacent = [None; 3];
    for (edge, (a, b, c, _)) in EDGES.into_iter().enumerate() {
        let Some((number, other)) = found[edge] else {
            continue;
        };
        let far = others_than(other, t[a], t[b]);
        if !angle_fits(
            [t[a], t[b], t[c]].map(|v| view.position(v)),
            view.position(far),
            cos_max_angle,
        ) {
            return Err(Refusal::Angle);
        }
        adjacent[edge] = Some((number, opposed(t, other, t[a], t[b])));
    }
    Ok(adjacent)
}

fn others_than(t: Triangle, a: u32, b: u32) -> u32 {
    t.into_iter().find(|v| *v != a && *v != b).unwrap_or(a)
}

/// True if with `t` the link of `v` would have a closed cycle and another component.
fn makes_excess(t: Triangle, v: u32, view: &impl View) -> bool {
    let mut edges: Vec<(u32, u32)> = Vec::with_capacity(12);
    view.around(v, &mut |_, other| {
        let [a, b] = others(other, v);
        edges.push((a, b));
    });
    if edges.is_empty() {
        return false;
    }
    // A link without ends is closed already.
    let degree = |node: u32| {
        edges
            .iter()
            .filter(|(a, b)| *a == node || *b == node)
            .count()
    };
    if edges.iter().all(|&(a, b)| degree(a) == 2 && degree(b) == 2) {
        return true;
    }
    let [from, goal] = others(t, v);
    let mut node = from;
    let mut used = vec![false; edges.len()];
    let mut steps = 0;
    while node != goal {
        let next =
            (0..edges.len()).find(|&e| !used[e] && (edges[e].0 == node || edges[e].1 == node));
        let Some(edge) = next else { return false };
        used[edge] = true;
        steps += 1;
        node = if edges[edge].0 == node {
            edges[edge].1
        } else {
            edges[edge].0
        };
    }
    steps < edges.len()
}

/// The exact normal of the triangle `a → b → c`, twice its area long.
#[must_use]
pub fn normal(a: Point, b: Point, c: Point) -> [i128; 3] {
    let (u, v) = (sub(b, a).map(i128::from), sub(c, a).map(i128::from));
    [
        u[1] * v[2] - u[2] * v[1],
        u[2] * v[0] - u[0] * v[2],
        u[0] * v[1] - u[1] * v[0],
    ]
}

/// Do `a b c` and its neighbour `b a far` across the edge `a b` agree?
fn angle_fits([a, b, c]: [Point; 3], far: Point, cos_max_angle: f64) -> bool {
    let n = normal(a, b, c);
    let m = normal(b, a, far);
    let dot = |x: [i128; 3], y: [i128; 3]| (x[0] * y[0] + x[1] * y[1] + x[2] * y[2]) as f64;
    dot(n, m) >= cos_max_angle * dot(n, n).sqrt() * dot(m, m).sqrt()
}

/// The order in which candidates are tried: class, square of the longest edge, ids.
pub type Rank = (u32, u64, Triangle);

/// The rank of a candidate seen by `count` cells (3: it was flagged).
#[must_use]
pub fn rank(t: Triangle, count: u32, [a, b, c]: [Point; 3]) -> Rank {
    let d = crate::geom::distance2;
    (3 - count.min(3), d(a, b).max(d(b, c)).max(d(a, c)), t)
}
