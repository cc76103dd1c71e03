//! Pairs of triangles that share an edge inside a block.

use super::star::{ByVertex, Triangle};
use outcrop_stages::ids::{Id, Ids, Side, TriangleIndex};

/// An edge of a triangle packed in a word: the triangle, and the corner opposite the edge.
#[must_use]
#[inline]
pub fn side(triangle: TriangleIndex, corner: u32) -> Side {
    Side::new(triangle.get() << 2 | corner)
}

/// The triangle and the corner of a [`side`].
#[must_use]
#[inline]
pub fn parts(side: Side) -> (usize, usize) {
    ((side.get() >> 2) as usize, (side.get() & 3) as usize)
}

/// Visits the edges with both ends in `ids`, ascending by their lower ends. `pair` receives the two [`side`]s
/// of an edge with two triangles; `lone` receives the side of an edge with one triangle, and its ends as
/// indices in the block. `triangles` are all that touch the block, ascending; no edge may have more than two.
///
/// Nothing is sorted or hashed: the triangles around a lower end mark the upper ends.
#[inline]
pub fn pair_edges(
    ids: Ids,
    triangles: &[Triangle],
    mut pair: impl FnMut(Side, Side),
    mut lone: impl FnMut(Side, [u32; 2]),
) {
    let size = ids.len() as u32;
    let local = |v: Id| ids.find(v) as u32;
    let inside = |t: &Triangle| local(t[1]) < size && local(t[2]) < size;
    // By their middle vertices, the triangles whose upper edge is inside the block.
    let middles = triangles.iter().filter(|t| inside(t)).map(|t| t[1]);
    let mut upper = ByVertex::with_room(ids, middles);
    for (number, t) in (0..)
        .map(TriangleIndex::new)
        .zip(triangles)
        .filter(|(_, t)| inside(t))
    {
        upper.push(t[1], number);
    }
    // For each vertex, the last lower end from which an edge to it was found, plus one, and the side of this
    // edge.
    let mut seen = vec![(0u32, Side::NONE); size as usize];
    let mut next = triangles.partition_point(|t| t[0] < ids.start) as u32;
    for v in 0..size {
        let first = next;
        let own = triangles[next as usize..].iter();
        next += own.take_while(|t| local(t[0]) == v).count() as u32;
        let own = (first..next).map(TriangleIndex::new);
        let upper = upper.at(ids.id(v as usize));
        // The place of a corner in the block: the upper end of an edge from `v`.
        let end = |number: TriangleIndex, corner: usize| local(triangles[number.index()][corner]);
        let mut single = 0;
        let mut mark = |number: TriangleIndex, corner: u32, y: u32| {
            if y < size {
                let seen = &mut seen[y as usize];
                let this = side(number, corner);
                if seen.0 == v + 1 {
                    pair(seen.1, this);
                    *seen = (v + 1, Side::NONE);
                    single -= 1;
                } else {
                    *seen = (v + 1, this);
                    single += 1;
                }
            }
        };
        for &n in upper {
            mark(n, 0, end(n, 2));
        }
        for n in own.clone() {
            mark(n, 2, end(n, 1));
            mark(n, 1, end(n, 2));
        }
        if single > 0 {
            let mut report = |number: TriangleIndex, corner: u32, y: u32| {
                let this = side(number, corner);
                if y < size && seen[y as usize].1 == this {
                    lone(this, [v, y]);
                }
            };
            for &n in upper {
                report(n, 0, end(n, 2));
            }
            for n in own {
                report(n, 2, end(n, 1));
                report(n, 1, end(n, 2));
            }
        }
    }
}

/// For each of the ascending `triangles`, all with their vertices in `ids`: for the edge opposite each
/// corner, the [`side`] of the adjacent triangle, or [`Side::NONE`]. For traversals from triangle to triangle. No
/// edge may have more than two triangles.
#[must_use]
pub fn across(ids: Ids, triangles: &[Triangle]) -> Vec<[Side; 3]> {
    let mut across = vec![[Side::NONE; 3]; triangles.len()];
    let pair = |a, b| {
        for (this, other) in [(a, b), (b, a)] {
            let (number, corner) = parts(this);
            across[number][corner] = other;
        }
    };
    pair_edges(ids, triangles, pair, |_, _| ());
    across
}

#[cfg(test)]
mod tests {
    use super::*;
    use outcrop_stages::ids::triangle;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    proptest! {
        #[test]
        fn sides_are_those_with_the_same_ends(
            some in prop::collection::btree_set(prop::array::uniform3(5u32..25), 0..60),
        ) {
            // At most two triangles at an edge.
            let mut behind: BTreeMap<[Id; 2], Vec<Triangle>> = BTreeMap::new();
            let mut triangles: Vec<Triangle> = Vec::new();
            for mut t in some.into_iter().map(triangle) {
                t.sort_unstable();
                let edges = [[t[1], t[2]], [t[0], t[2]], [t[0], t[1]]];
                let free = edges.iter().all(|e| behind.get(e).is_none_or(|b| b.len() < 2));
                if t[0] < t[1] && t[1] < t[2] && free && !triangles.contains(&t) {
                    edges.iter().for_each(|e| behind.entry(*e).or_default().push(t));
                    triangles.push(t);
                }
            }
            triangles.sort_unstable();
            for (t, across) in triangles.iter().zip(across(Ids::of(5..25), &triangles)) {
                let edges = [[t[1], t[2]], [t[0], t[2]], [t[0], t[1]]];
                for (edge, side) in edges.iter().zip(across) {
                    let other = behind[edge].iter().find(|u| *u != t);
                    let found = (side != Side::NONE).then(|| {
                        let (number, corner) = parts(side);
                        let u = &triangles[number];
                        assert!(!edge.contains(&u[corner]));
                        u
                    });
                    prop_assert_eq!(found, other);
                }
            }
        }
    }
}
