//! The tests of a T12 triangle (paper, section 3.5): the combinatorial tests I to III and the geometric test.
//! Test IV needs the components and is in [`super::insertion`].

use crate::surface::star::{EDGES, Triangle, opposed, others};
use outcrop_geom::Point;
use outcrop_geom::triangle::normal;
use outcrop_stages::ids::{Id, TriangleIndex, Width};
use rustc_hash::FxHashMap;

/// The mesh around the vertices of a triangle.
pub trait Neighborhood {
    /// The star of `v`: for each of its triangles the number and the other two vertices, ascending.
    fn star(&self, v: Id) -> impl Iterator<Item = (TriangleIndex, [Id; 2])>;
    /// The number of triangles at `v`.
    fn count(&self, v: Id) -> usize;
    /// The position of a vertex of a triangle of the mesh or of a candidate.
    fn position(&self, v: Id) -> Point;
    /// The position of `v`, a vertex of the triangle `number` of the mesh.
    fn position_in(&self, _number: TriangleIndex, v: Id) -> Point {
        self.position(v)
    }
}

/// The test that a candidate fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refusal {
    /// Test I: not properly connected to the mesh, so far.
    Unconnected,
    /// Test II: an edge has two triangles already.
    FullEdge,
    /// Test III: a vertex would have a closed fan and another fan.
    Excess,
    /// Geometric test: the angle between normals is too large.
    Angle,
}

/// A vertex with more triangles is a hub: its star is not searched if that of another vertex suffices.
const HUB: usize = 64;

/// A triangle adjacent to a candidate: its number, and true if the candidate must be turned to be oriented
/// like it.
pub type Adjacent = (TriangleIndex, bool);

/// Applies the tests I, II, III and G in this order. Returns the adjacent triangles by edge. `link` is a
/// buffer.
///
/// # Errors
/// The first test that fails.
pub fn examine(
    t: Triangle,
    mesh: &impl Neighborhood,
    cos_max_angle: f64,
    link: &mut Vec<[Id; 2]>,
) -> Result<[Option<Adjacent>; 3], Refusal> {
    let (counts, found) = at_edges(t, mesh, HUB);
    let mut connected = (0..3).filter(|&edge| counts[edge] > 0);
    match (connected.next(), connected.next()) {
        (Some(edge), None) if mesh.count(t[EDGES[edge].2]) == 0 => {}
        (_, None) => return Err(Refusal::Unconnected),
        _ => {}
    }
    if counts.iter().any(|c| *c > 1) {
        return Err(Refusal::FullEdge);
    }
    // At a new edge, a component of the link is only extended at its end; no cycle is closed.
    for (v, [e, f]) in t.into_iter().zip([[0, 1], [0, 2], [1, 2]]) {
        if counts[e] + counts[f] == 2 && makes_excess(t, v, mesh, link) {
            return Err(Refusal::Excess);
        }
    }
    let mut adjacent = [None; 3];
    for (edge, (a, b, c, _)) in EDGES.into_iter().enumerate() {
        let Some((number, far)) = found[edge] else {
            continue;
        };
        let corners = [t[a], t[b], t[c]].map(|v| mesh.position(v));
        if !angle_fits(corners, mesh.position_in(number, far), cos_max_angle) {
            return Err(Refusal::Angle);
        }
        let mut other = [t[a], t[b], far];
        other.sort_unstable();
        adjacent[edge] = Some((number, opposed(t, other, t[a], t[b])));
    }
    Ok(adjacent)
}

/// For each edge of `t`, the number of triangles of the mesh at it, and the number and third vertex of one of
/// them. The stars of vertices with more than `hub` triangles are avoided.
fn at_edges(
    t: Triangle,
    mesh: &impl Neighborhood,
    hub: usize,
) -> ([usize; 3], [Option<(TriangleIndex, Id)>; 3]) {
    let mut found: [Option<(TriangleIndex, Id)>; 3] = [None; 3];
    let mut counts = [0usize; 3];
    // Counts triangle `number` at one end of an edge, with the other vertices `a` and `b`, if one is `end`.
    let mut see = |edge: usize, number: TriangleIndex, [a, b]: [Id; 2], end: Id| {
        if a == end || b == end {
            counts[edge] += 1;
            found[edge] = Some((number, if a == end { b } else { a }));
        }
    };
    // The edges are (0,1), (0,2) and (1,2).
    if t[..2].iter().all(|v| mesh.count(*v) <= hub) {
        for (number, other) in mesh.star(t[0]) {
            see(0, number, other, t[1]);
            see(1, number, other, t[2]);
        }
        for (number, other) in mesh.star(t[1]) {
            see(2, number, other, t[2]);
        }
    } else {
        for (edge, (a, b, ..)) in EDGES.into_iter().enumerate() {
            let (mut from, mut end) = (t[a], t[b]);
            if mesh.count(from) > mesh.count(end) {
                std::mem::swap(&mut from, &mut end);
            }
            for (number, other) in mesh.star(from) {
                see(edge, number, other, end);
            }
        }
    }
    (counts, found)
}

/// True if `t`, both of whose edges at `v` have one triangle, would give the link of `v` a cycle and another
/// component.
fn makes_excess(t: Triangle, v: Id, mesh: &impl Neighborhood, link: &mut Vec<[Id; 2]>) -> bool {
    link.clear();
    link.extend(mesh.star(v).map(|(_, other)| other));
    let [from, goal] = others(t, v);
    if link.len() > HUB {
        return closes_part(link, from, goal);
    }
    let mut node = from;
    while node != goal {
        let next = link.iter().position(|e| e[0] == node || e[1] == node);
        let Some(next) = next else { return false };
        node = node.other(link.swap_remove(next));
    }
    !link.is_empty()
}

/// True if the path that starts at the end node `from` leads to `goal` and does not contain the whole link.
fn closes_part(link: &[[Id; 2]], from: Id, goal: Id) -> bool {
    // Nodes have at most two edges; the XOR of their other ends gives the next node from either side.
    let mut beside: FxHashMap<Id, (Width, u32)> = FxHashMap::default();
    for [a, b] in link {
        for (node, other) in [(a, b), (b, a)] {
            let (both, count) = beside.entry(*node).or_default();
            *both ^= other.get();
            *count += 1;
        }
    }
    let (mut before, mut node) = (Id::default(), from);
    for length in 0..link.len() {
        match beside.get(&node) {
            _ if node == goal => return true,
            Some((both, count)) if length == 0 || *count > 1 => {
                (before, node) = (node, Id::new(both ^ before.get()));
            }
            // Another end node.
            _ => return false,
        }
    }
    // The path contains the whole link.
    false
}

/// True if the normals of `a b c` and of its neighbour `b a far` across the edge `a b` differ by a small
/// enough angle.
fn angle_fits([a, b, c]: [Point; 3], far: Point, cos_max_angle: f64) -> bool {
    let n = normal(a, b, c);
    let m = normal(b, a, far);
    let dot = |x: [i128; 3], y: [i128; 3]| (x[0] * y[0] + x[1] * y[1] + x[2] * y[2]) as f64;
    dot(n, m) >= cos_max_angle * dot(n, n).sqrt() * dot(m, m).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use outcrop_stages::ids::triangle;
    use proptest::prelude::*;

    /// Triangles by vertex; `looks` counts the triangles visited.
    struct Mesh {
        triangles: Vec<Triangle>,
        looks: std::cell::Cell<usize>,
    }

    impl Neighborhood for Mesh {
        fn star(&self, v: Id) -> impl Iterator<Item = (TriangleIndex, [Id; 2])> {
            let at = (0..)
                .map(TriangleIndex::new)
                .zip(&self.triangles)
                .filter(move |(_, t)| t.contains(&v));
            at.map(move |(number, t)| {
                self.looks.set(self.looks.get() + 1);
                (number, others(*t, v))
            })
        }

        fn count(&self, v: Id) -> usize {
            self.triangles.iter().filter(|t| t.contains(&v)).count()
        }

        fn position(&self, v: Id) -> Point {
            let v = v.get() as i32;
            [v, v * v % 7, 0]
        }
    }

    proptest! {
        #[test]
        fn edges_seen_from_either_end_are_the_same(
            triangles in prop::collection::btree_set(prop::collection::btree_set(0u32..9, 3), 0..20),
            t in prop::collection::btree_set(0u32..9, 3),
        ) {
            let triangle = |t: &std::collections::BTreeSet<u32>| -> Triangle {
                let t: Vec<u32> = t.iter().copied().collect();
                triangle([t[0], t[1], t[2]])
            };
            let triangles = triangles.iter().map(triangle).collect();
            let mesh = Mesh { triangles, looks: 0.into() };
            let (plain, hubs) = (at_edges(triangle(&t), &mesh, 99), at_edges(triangle(&t), &mesh, 0));
            prop_assert_eq!(plain.0, hubs.0);
            for edge in (0..3).filter(|e| plain.0[*e] < 2) {
                prop_assert_eq!(plain.1[edge], hubs.1[edge]);
            }
        }

        /// Links of paths and cycles; a path is closed by an edge between its ends.
        #[test]
        fn a_path_that_is_closed_leaves_others_or_not(
            lengths in prop::collection::vec((1u32..6, any::<bool>()), 1..5),
            pick in any::<prop::sample::Index>(),
            with_other in any::<prop::sample::Index>(),
        ) {
            let (mut link, mut ends, mut next) = (Vec::new(), Vec::new(), 0u32);
            for &(length, cycle) in &lengths {
                let length = if cycle { length + 2 } else { length };
                link.extend((next..next + length).map(|k| [k, k + 1].map(Id::new)));
                if cycle {
                    link.push([next, next + length].map(Id::new));
                } else {
                    ends.push((Id::new(next), Id::new(next + length)));
                }
                next += length + 1;
            }
            link.reverse();
            prop_assume!(!ends.is_empty());
            let (from, to) = *pick.get(&ends);
            let (_, other) = *with_other.get(&ends);
            prop_assert_eq!(closes_part(&link, from, to), lengths.len() > 1);
            prop_assert_eq!(closes_part(&link, to, from), lengths.len() > 1);
            if other != to {
                prop_assert!(!closes_part(&link, from, other));
            }
        }
    }

    /// The many triangles around a hub are not visited for every candidate there.
    #[test]
    fn a_hub_is_not_gone_through() {
        let triangles = (1..1000).map(|k| triangle([0, k, k + 1])).collect();
        let mesh = Mesh {
            triangles,
            looks: 0.into(),
        };
        let mut link = Vec::new();
        for t in [[0, 1000, 1001], [0, 500, 2000], [0, 1, 3000]] {
            let _ = examine(triangle(t), &mesh, -1.0, &mut link);
        }
        assert!(mesh.looks.get() < 20, "{}", mesh.looks.get());
    }
}
