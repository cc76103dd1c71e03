//! Whether the edges opposite a vertex, one for each triangle around it, form one path or one cycle.

use super::kernel;
use super::pick::{BLOCK, Pick, first_bits};

/// Most edges of one call.
pub const MOST_EDGES: usize = BLOCK;

kernel! {
    /// True if the first `count` edges form one path or one cycle, or if there is none. `ends` are their two
    /// different ends; after the last edge, a number that is no end.
    pub fn is_one_fan(ends: &[[u32; MOST_EDGES]; 2], count: usize) -> bool = fan_body<Eight>
}

#[inline(always)]
fn fan_body<P: Pick>(ends: &[[u32; MOST_EDGES]; 2], count: usize) -> bool {
    let all = first_bits(count);
    // For each edge, the bits of the edges that it shares an end with, and its own.
    let mut beside = [0; MOST_EDGES];
    let mut crowded = 0;
    for (edge, beside) in beside.iter_mut().enumerate().take(count) {
        for column in ends {
            let end = column[edge];
            let here = P::equal(&ends[0], end) | P::equal(&ends[1], end);
            // More than two bits.
            let others = here & here.wrapping_sub(1);
            crowded |= others & others.wrapping_sub(1);
            *beside |= here;
        }
    }
    let mut reached = 1 & all;
    let mut new = reached;
    while new != 0 {
        let mut more = 0;
        while new != 0 {
            more |= beside[new.trailing_zeros() as usize % MOST_EDGES];
            new &= new - 1;
        }
        new = more & !reached;
        reached |= more;
    }
    crowded == 0 && reached == all
}

#[cfg(test)]
mod tests {
    use super::super::Level;
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    /// By merging the ends of edges, and counting edges at each of them.
    fn expected(edges: &[[u32; 2]]) -> bool {
        let mut group: BTreeMap<u32, u32> =
            edges.iter().flatten().map(|end| (*end, *end)).collect();
        for [a, b] in edges {
            let (from, to) = (group[a], group[b]);
            group
                .values_mut()
                .filter(|of| **of == from)
                .for_each(|of| *of = to);
        }
        let mut groups: Vec<u32> = group.values().copied().collect();
        groups.sort_unstable();
        groups.dedup();
        let degree = |end: &u32| edges.iter().flatten().filter(|e| *e == end).count();
        groups.len() <= 1 && group.keys().all(|end| degree(end) <= 2)
    }

    fn check(edges: &[[u32; 2]]) {
        let mut ends = [[u32::MAX; MOST_EDGES]; 2];
        for (place, [a, b]) in edges.iter().enumerate() {
            (ends[0][place], ends[1][place]) = (*a, *b);
        }
        for level in Level::all() {
            assert_eq!(
                is_one_fan(level, &ends, edges.len()),
                expected(edges),
                "{edges:?}"
            );
        }
    }

    proptest! {
        #[test]
        fn a_fan_is_one_path_or_cycle(
            order in Just((0u32..16).collect::<Vec<_>>()).prop_shuffle(),
            count in 0usize..16,
            cycles in prop::collection::vec(any::<bool>(), 3),
            turned in any::<u16>(),
            some in prop::collection::vec((0u32..9, 0u32..9), 0..16),
        ) {
            // Paths and cycles over the vertices in order, cut at most twice.
            let mut edges = Vec::new();
            let parts = order[..count].chunks(count.div_ceil(1 + turned as usize % 3).max(3));
            for (part, cycle) in parts.zip(cycles) {
                edges.extend(part.windows(2).map(|w| [w[0], w[1]]));
                edges.extend((cycle && part.len() > 2).then(|| [part[part.len() - 1], part[0]]));
            }
            for (n, edge) in edges.iter_mut().enumerate().filter(|(n, _)| turned >> n & 1 == 1) {
                edge.rotate_left(n % 2);
            }
            check(&edges);
            let mut some: Vec<_> = some.into_iter().filter(|(a, b)| a < b).map(|(a, b)| [a, b]).collect();
            some.sort_unstable();
            some.dedup();
            check(&some);
        }
    }
}
