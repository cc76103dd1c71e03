//! What lies behind the edges of the triangles inside a block.

use super::by_end::ByLowerEnd;
use super::star::Triangle;
use crate::workspace::memory::{bytes_of, hold};
use std::ops::Range;

/// An edge without a triangle inside the block behind it.
pub const NONE: u32 = u32::MAX;

/// An edge of a triangle as one word: the one opposite a corner.
#[must_use]
#[inline]
pub fn side(triangle: u32, corner: u32) -> u32 {
    triangle << 2 | corner
}

/// The triangle and the corner of [`side`].
#[must_use]
#[inline]
pub fn parts(side: u32) -> (usize, usize) {
    ((side >> 2) as usize, (side & 3) as usize)
}

/// For each of the `triangles`, ascending, with all their vertices in `ids`, opposite each corner the
/// [`side`] behind the edge, or [`NONE`]. No edge has more than two triangles.
#[must_use]
pub fn across(ids: Range<u32>, triangles: &[Triangle]) -> Vec<[u32; 3]> {
    let mut across = vec![[NONE; 3]; triangles.len()];
    let size = ids.len() as u32;
    let edges = ByLowerEnd::of(ids.clone(), triangles);
    // For each vertex, the last lower end that its edge to was seen from, plus one, and whose.
    let mut seen = vec![(0u32, 0u32); size as usize];
    let _held = hold(edges.bytes() + bytes_of(&seen));
    let mut next = 0;
    for v in 0..size {
        let mut visit = |y: u32, number: u32, corner: u32| {
            let place = &mut seen[(y - ids.start) as usize];
            let this = side(number, corner);
            if place.0 == v + 1 {
                across[number as usize][corner as usize] = place.1;
                let (other, opposite) = parts(place.1);
                across[other][opposite] = this;
            } else {
                *place = (v + 1, this);
            }
        };
        for &number in edges.upper(v) {
            visit(triangles[number as usize][2], number, 0);
        }
        while let Some(t) = triangles.get(next).filter(|t| t[0] == v + ids.start) {
            visit(t[1], next as u32, 2);
            visit(t[2], next as u32, 1);
            next += 1;
        }
    }
    across
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    proptest! {
        #[test]
        fn sides_are_those_with_the_same_ends(
            some in prop::collection::btree_set(prop::array::uniform3(5u32..25), 0..60),
        ) {
            // At most two triangles at an edge.
            let mut behind: BTreeMap<[u32; 2], Vec<Triangle>> = BTreeMap::new();
            let mut triangles: Vec<Triangle> = Vec::new();
            for mut t in some {
                t.sort_unstable();
                let edges = [[t[1], t[2]], [t[0], t[2]], [t[0], t[1]]];
                let free = edges.iter().all(|e| behind.get(e).is_none_or(|b| b.len() < 2));
                if t[0] < t[1] && t[1] < t[2] && free && !triangles.contains(&t) {
                    edges.iter().for_each(|e| behind.entry(*e).or_default().push(t));
                    triangles.push(t);
                }
            }
            triangles.sort_unstable();
            for (t, across) in triangles.iter().zip(across(5..25, &triangles)) {
                let edges = [[t[1], t[2]], [t[0], t[2]], [t[0], t[1]]];
                for (edge, side) in edges.iter().zip(across) {
                    let other = behind[edge].iter().find(|u| *u != t);
                    let found = (side != NONE).then(|| {
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
