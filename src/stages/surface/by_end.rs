//! The edges inside a block, by their lower ends.

use super::star::Triangle;
use crate::workspace::memory::bytes_of;
use std::ops::Range;

/// For each vertex of a block, the triangles with an edge up from it that lies inside the block.
#[derive(Debug)]
pub struct ByLowerEnd {
    /// Per vertex, where its triangles begin in `list`.
    starts: Vec<u32>,
    /// Numbers of the triangles whose upper edge lies inside, by their middle vertex, ascending.
    list: Vec<u32>,
    /// Number of triangles that begin before the block.
    before: usize,
}

impl ByLowerEnd {
    /// Sorts all `triangles` that touch the vertices `ids`, in ascending order.
    #[must_use]
    pub fn of(ids: Range<u32>, triangles: &[Triangle]) -> Self {
        let size = ids.len() as u32;
        let local = |v: u32| v.wrapping_sub(ids.start);
        let middle = |t: &Triangle| (local(t[1]) < size && local(t[2]) < size).then(|| local(t[1]));
        let mut starts = vec![0u32; size as usize + 1];
        for v in triangles.iter().filter_map(middle) {
            starts[v as usize] += 1;
        }
        let mut sum = 0;
        for start in &mut starts {
            sum += *start;
            *start = sum;
        }
        let mut list = vec![0u32; sum as usize];
        for (number, t) in triangles.iter().enumerate().rev() {
            if let Some(v) = middle(t) {
                starts[v as usize] -= 1;
                list[starts[v as usize] as usize] = number as u32;
            }
        }
        Self {
            starts,
            list,
            before: triangles.partition_point(|t| t[0] < ids.start),
        }
    }

    /// Bytes of its lists.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        bytes_of(&self.starts) + bytes_of(&self.list)
    }

    /// Number of the first triangle whose smallest vertex is in the block.
    #[must_use]
    pub fn first(&self) -> usize {
        self.before
    }

    /// Numbers of the triangles whose middle vertex is the `v`-th of the block and whose largest is
    /// in it.
    #[must_use]
    pub fn upper(&self, v: u32) -> &[u32] {
        let v = v as usize;
        &self.list[self.starts[v] as usize..self.starts[v + 1] as usize]
    }
}
