//! The rounding of a lossy tileset: each leaf has a coarser lattice, by the lengths of its edges.
//!
//! A vertex is rounded once, before all tiles, so that every tile has it at one place. If several leaves have it, its
//! place is on the coarsest of their lattices, but at most twice as coarse as the finest.

/// Largest step of a leaf, as a part of the median length of its edges. Positions take 1.0 bytes a triangle on the
/// lion and 0.6 % of its triangles collapse; with a half 0.9 and 3.0 %, with an eighth 1.4 and 0.1 % (docs/tiles.md).
pub(super) const SHARE: f64 = 0.25;

/// Most bits that are rounded away: positions have 31.
const MOST: u8 = 28;

/// Median squared length of the edges of these triangles that have a length, in steps of the mesh; 0 without one.
pub(super) fn median2(points: &[[u32; 3]], triangles: &[[u32; 3]]) -> u64 {
    let mut all: Vec<u64> = Vec::with_capacity(3 * triangles.len());
    for &[a, b, c] in triangles {
        for (a, b) in [(a, b), (b, c), (c, a)] {
            let (p, q) = (points[a as usize], points[b as usize]);
            let squares = (0..3).map(|axis| u64::from(p[axis].abs_diff(q[axis])).pow(2));
            all.push(squares.fold(0, u64::saturating_add));
        }
    }
    all.retain(|length2| *length2 > 0);
    let middle = all.len() / 2;
    match all.is_empty() {
        true => 0,
        false => *all.select_nth_unstable(middle).1,
    }
}

/// The low bits of positions that a leaf rounds away whose edges have this median squared length.
pub(super) fn bits(median2: u64) -> u8 {
    let longest = (median2 as f64).sqrt() * SHARE;
    let fits = |bits: &u8| f64::from(1u32 << bits) <= longest;
    (1..=MOST).rev().find(fits).unwrap_or(0)
}

/// The low bits that a vertex of leaves rounds away that round away these.
pub(super) fn common(bits: impl Iterator<Item = u8>) -> u8 {
    let (least, most) = bits.fold((MOST, 0), |(least, most), b| (b.min(least), b.max(most)));
    most.min(least + 1)
}

/// The nearest position with so many low bits that are zero.
pub(super) fn rounded(point: [u32; 3], bits: u8) -> [u32; 3] {
    let half = (1u32 << bits) >> 1;
    point.map(|x| x.saturating_add(half) >> bits << bits)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_a_share_of_edges() {
        let points = [[0, 0, 0], [64, 0, 0], [0, 64, 0], [0, 0, 0]];
        let median = median2(&points, &[[0, 1, 2], [0, 3, 1]]);
        assert_eq!(median, 64 * 64);
        assert_eq!(f64::from(1u32 << bits(median)), 64.0 * SHARE);
        assert_eq!(
            (median2(&points, &[[0, 3, 0]]), bits(0), bits(3)),
            (0, 0, 0)
        );
        assert_eq!(bits(u64::MAX), MOST);
    }

    #[test]
    fn vertices_of_several_leaves_are_on_all_lattices_but_one() {
        assert_eq!(common([3, 4].into_iter()), 4);
        assert_eq!(common([3, 9, 7].into_iter()), 4);
        assert_eq!(common([5].into_iter()), 5);
        assert_eq!(rounded([7, 8, 12], 3), [8, 8, 16]);
        assert_eq!(rounded([7, 8, 12], 0), [7, 8, 12]);
    }
}
