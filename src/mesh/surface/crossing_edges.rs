//! The edges of crossing triangles, during the pass over these triangles in ascending order.

use super::parity::{OrientationConstraint, Turned, constraint};
use super::star::{EDGES, Triangle, opposed};
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::memory::{Reservation, table_bytes};
use outcrop_stages::blocks::Blocks;
use outcrop_stages::ids::{Block, GlobalLabel, Id};
use rustc_hash::FxHashMap;

/// Estimated bytes of an edge: its place in a hash table, which exists twice while it grows, and its list.
const EDGE: u64 = 128 + LIST;

/// Bytes of the list of triangles at an edge: room for four, and the allocator's overhead.
const LIST: u64 = 128;

/// A triangle, `label << 1 | flip`, and its unit normal if it is needed.
type Entry = (Triangle, Turned<GlobalLabel>, [f32; 3]);

/// The triangles so far at edges that later triangles may share. Crossing triangles are few and scattered, so
/// their edges are in a hash table. Edges that no later triangle can share are removed block by block.
pub(super) struct CrossingEdges {
    edges: FxHashMap<(Id, Id), Vec<Entry>>,
    reserved: Reservation,
}

impl CrossingEdges {
    /// No edges.
    pub(super) fn new(workspace: &Workspace) -> Result<Self> {
        Ok(Self {
            edges: FxHashMap::default(),
            reserved: workspace.promise("stitch: edges", 0)?,
        })
    }

    /// Reserves room for the edges of this number of additional triangles.
    pub(super) fn make_room(&mut self, triangles: usize) -> Result<()> {
        let edges = (self.edges.len() + 3 * triangles) as u64;
        self.reserved.at_least(edges * EDGE)
    }

    /// Adds a triangle with `label << 1 | flip`; room must have been reserved.
    pub(super) fn put(&mut self, t: Triangle, word: Turned<GlobalLabel>, normal: [f64; 3]) {
        let normal = normal.map(|x| x as f32);
        for (a, b, ..) in EDGES {
            let at = self.edges.entry((t[a], t[b])).or_default();
            at.push((t, word, normal));
        }
    }

    /// The triangles at the edges of `t`: each with its constraint on `t`, true if `t` must be turned against
    /// the triangle itself, and its normal.
    pub(super) fn adjacent(
        &self,
        t: Triangle,
    ) -> impl Iterator<Item = (OrientationConstraint<GlobalLabel>, bool, [f64; 3])> + '_ {
        EDGES.into_iter().flat_map(move |(a, b, ..)| {
            let at = self.edges.get(&(t[a], t[b])).into_iter().flatten();
            at.map(move |&(other, word, normal)| {
                let opposed = opposed(t, other, t[a], t[b]);
                let (label, flip) = constraint(word);
                ((label, opposed ^ flip), opposed, normal.map(f64::from))
            })
        })
    }

    /// Removes the edges that triangles of the blocks after `group` cannot share.
    pub(super) fn end(&mut self, group: usize, blocks: Blocks) {
        let lists = self.edges.len() as u64 * LIST;
        self.reserved.set_held(table_bytes(&self.edges) + lists);
        // The smallest vertex of a triangle is at most the lower vertex of its edge.
        self.edges
            .retain(|(low, _), _| blocks.of(*low) > Block::at(group));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::parity::word;
    use outcrop_disk::error::Error;
    use outcrop_stages::ids::triangle;

    #[test]
    fn takes_no_more_than_is_reserved() {
        let workspace = Workspace::for_tests(1).expect("a scratch folder");
        let pool = &workspace.memory;
        let mut edges = CrossingEdges::new(&workspace).unwrap();
        let blocks = Blocks::new(1000, 10);
        for group in 0..90u32 {
            let first = group * 10;
            let new: Vec<Triangle> = (10..19)
                .map(|n| triangle([first, first + n, first + n + 10]))
                .collect();
            edges.make_room(new.len()).unwrap();
            for t in new {
                edges.put(t, word((GlobalLabel::new(group), false)), [0.0; 3]);
                assert!(
                    edges
                        .adjacent(t)
                        .any(|(found, ..)| found == (GlobalLabel::new(group), true))
                );
            }
            edges.end(group as usize, blocks);
            let kept = edges.edges.keys().all(|(low, _)| low.get() >= first + 10);
            assert!(kept && edges.edges.len() == 9);
        }
        assert!(pool.held_at_peak()["stitch: edges"] <= edges.reserved.bytes());
        let least = pool.capacity() / (3 * EDGE) + 1;
        let refused = edges.make_room(least as usize);
        assert!(matches!(refused, Err(Error::Memory { .. })), "{refused:?}");
        drop(edges);
        assert_eq!(pool.available(), pool.capacity());
    }
}
