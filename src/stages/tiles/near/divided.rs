//! The sorted list of just the nearest neighbours: they are divided from the others first, so that fewer are
//! sorted.

use super::Search;
use super::sums::divided_body;
use outcrop_geom::Point;
use outcrop_paper::kernels::{BLOCK, Pick, kernel};

kernel! {
    /// Measures the candidates from `point` and lists the `k` nearest neighbours and no others. Returns the squared
    /// distance up to which all are listed; `None` if the candidates do not include them, or if ties or rounding do
    /// not let them be divided from the others.
    pub(super) fn list_divided(search: &mut Search, point: Point, own: u32, k: usize) -> Option<u64> = list_divided_body<Eight>
}

#[inline(always)]
fn list_divided_body<P: Pick>(
    search: &mut Search,
    point: Point,
    own: u32,
    k: usize,
) -> Option<u64> {
    let (room, limit) = divided_body::<P, true>(search, point, k).ok()?;
    let distances = search.distances[..room].as_chunks::<BLOCK>().0;
    let mut picked = 0;
    for (block, distances) in distances.iter().enumerate() {
        let within = P::within(distances, limit);
        for column in search.picked.slices_mut() {
            // Packed values never overtake those that are read.
            if let Some(values) = column[block * BLOCK..].first_chunk().copied() {
                P::pack_at(&values, within, column, picked);
            }
        }
        picked += within.count_ones() as usize;
    }
    let complete2 = search.list_picked::<P>(picked, point, own, limit);
    (search.near.len() >= k).then_some(complete2)
}
