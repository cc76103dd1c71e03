//! The distinct triples of the cells of a tile with their counts (paper, section 3.4).

use super::{CountedTriple, SentTriple, TileRanges};
use crate::ids::{Id, Triangle};
use outcrop_disk::workspace::memory::bytes_of;
use std::ops::Range;

/// Triples of the cells of one tile, and memory for sorting them.
#[derive(Debug)]
pub(super) struct TileTriples {
    ids: Range<usize>,
    /// Triples whose smallest vertex is in the tile: its rank there, and the other two vertices in one word.
    here: Vec<(u32, u32, u32)>,
    /// The number of triples in `here` for each smallest vertex.
    begins: Vec<u32>,
    elsewhere: Vec<Triangle>,
}

/// Counted triples of this tile and those sent to other tiles, both ascending.
pub(super) type Folded = (Vec<CountedTriple>, Vec<SentTriple>);

impl TileTriples {
    /// Upper estimate of the bytes for the triples of `points` cells: usual cells have five or six corners
    /// between bisectors.
    pub fn estimate(points: usize) -> u64 {
        points as u64 * 200
    }

    /// For the cells of the points `ids`.
    pub fn new(ids: Range<usize>) -> Self {
        Self {
            here: Vec::with_capacity(ids.len() * 6),
            begins: vec![0; ids.len() + 1],
            elsewhere: Vec::new(),
            ids,
        }
    }

    /// Bytes of its lists. Room that was never written to is not counted.
    pub fn bytes(&self) -> u64 {
        let lists = size_of_val(&*self.here) + size_of_val(&*self.elsewhere);
        lists as u64 + bytes_of(&self.begins)
    }

    /// Bytes of the list that [`TileTriples::fold`] makes for itself.
    pub fn fold_bytes(&self) -> u64 {
        self.here.len() as u64 * 8
    }

    /// Number of triples so far, with repetitions.
    pub fn len(&self) -> usize {
        self.here.len() + self.elsewhere.len()
    }

    /// Adds the triple of `a` and `b` in the cell of `v`.
    #[inline]
    pub fn see(&mut self, v: Id, [a, b]: [u32; 2]) {
        let (v, low, high) = (v.get(), a.min(b), a.max(b));
        let [i, j, k] = [v.min(low), v.max(low).min(high), v.max(high)];
        let rank = (i as usize).wrapping_sub(self.ids.start);
        if rank < self.ids.len() {
            self.begins[rank + 1] += 1;
            self.here.push((rank as u32, j, k));
        } else {
            self.elsewhere.push([i, j, k].map(Id::new));
        }
    }

    /// Merges equal triples into one row with a count.
    pub fn fold(mut self, tiles: &TileRanges) -> Folded {
        // A counting sort by smallest vertex; then one small sort for each vertex, of about six triples.
        let mut start = std::mem::take(&mut self.begins);
        for rank in 1..start.len() {
            start[rank] += start[rank - 1];
        }
        let mut sorted = vec![0u64; self.here.len()];
        for (rank, j, k) in self.here.drain(..) {
            let place = &mut start[rank as usize];
            sorted[*place as usize] = u64::from(j) << 32 | u64::from(k);
            *place += 1;
        }
        self.here = Vec::new();
        let mut kept: Vec<CountedTriple> = Vec::with_capacity(sorted.len() / 2);
        let mut begin = 0;
        for (i, end) in (self.ids.start as u32..).zip(&start[..self.ids.len()]) {
            // After the counting sort, the start of a vertex has become the start of the next one.
            let pairs = &mut sorted[begin..*end as usize];
            begin = *end as usize;
            pairs.sort_unstable();
            for group in pairs.chunk_by(|a, b| a == b) {
                let (j, k) = ((group[0] >> 32) as u32, group[0] as u32);
                kept.push(CountedTriple {
                    triple: [i, j, k].map(Id::new),
                    count: group.len() as u32,
                });
            }
        }
        drop(sorted);
        self.elsewhere.sort_unstable();
        let sent = self.elsewhere.chunk_by(|a, b| a == b).map(|group| {
            let triple = group[0];
            SentTriple {
                to: tiles.of(triple[0]),
                triple,
                count: group.len() as u32,
            }
        });
        (kept, sent.collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blocks::Blocks;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    proptest! {
        #[test]
        fn counts_what_was_seen(
            seen in prop::collection::vec(prop::collection::hash_set(0u32..60, 3), 0..300),
        ) {
            let tiles = TileRanges::new(Blocks::new(60, 30), 20);
            let ids = tiles.ids(1);
            let mut here = TileTriples::new(ids.clone());
            let mut counts: BTreeMap<Triangle, u32> = BTreeMap::new();
            for triple in &seen {
                let t: Vec<u32> = triple.iter().copied().collect();
                here.see(Id::new(t[0]), [t[1], t[2]]);
                let mut t = [t[0], t[1], t[2]].map(Id::new);
                t.sort_unstable();
                *counts.entry(t).or_default() += 1;
            }
            prop_assert_eq!(here.len(), seen.len());
            let (kept, sent) = here.fold(&tiles);
            let mine = |t: &Triangle| ids.contains(&t[0].index());
            let expected: Vec<_> = counts.iter().filter(|(t, _)| mine(t))
                .map(|(&triple, &count)| CountedTriple { triple, count }).collect();
            prop_assert_eq!(kept, expected);
            let expected: Vec<_> = counts.iter().filter(|(t, _)| !mine(t))
                .map(|(&triple, &count)| SentTriple { to: tiles.of(triple[0]), triple, count }).collect();
            prop_assert_eq!(sent, expected);
        }
    }
}
