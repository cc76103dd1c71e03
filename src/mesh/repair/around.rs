//! The triangles of the stitched surface that touch a block.

use crate::stitch::Stitched;
use crate::surface::rows::{TriangleRow, TriangleTo};
use crate::surface::star::Triangle;
use outcrop_disk::error::Result;
use outcrop_disk::spill::{Inbox, Table};
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_stages::blocks::Blocks;
use outcrop_stages::ids::Block;

/// The stitched surface while it is read.
pub struct Around<'a> {
    interior: &'a Table<TriangleRow>,
    added: Inbox<TriangleTo>,
    removed: Inbox<TriangleTo>,
}

impl<'a> Around<'a> {
    /// Opens the stitched surface.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`], [`outcrop_disk::error::Error::Memory`].
    pub fn open(stitched: &'a Stitched, blocks: Blocks, workspace: &Workspace) -> Result<Self> {
        Ok(Self {
            interior: &stitched.interior,
            added: stitched.added.open(workspace, blocks.count())?,
            removed: stitched.removed.open(workspace, blocks.count())?,
        })
    }

    /// An upper bound on the number of triangles that touch a block.
    pub fn records(&self, workspace: &Workspace, block: usize) -> usize {
        self.interior.expected_rows(workspace, block) + self.added.rows(block)
    }

    /// All triangles that touch a block, ascending.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`].
    pub fn load(&self, unit: &Unit<'_>, block: usize) -> Result<Vec<Triangle>> {
        let mut triangles: Vec<Triangle> = bytemuck::cast_vec(self.interior.get(unit, block)?);
        let removed = self.removed.get(unit, block)?;
        if !removed.is_empty() {
            let gone = |&triangle: &Triangle| {
                let to = Block::at(block);
                removed.binary_search(&TriangleTo { to, triangle })
            };
            triangles.retain(|t| gone(t).is_err());
        }
        let added = self.added.get(unit, block)?;
        merge(&mut triangles, added.iter().map(|t| t.triangle));
        Ok(triangles)
    }
}

/// Merges ascending triangles into a list of ascending ones, in place and from the back.
pub fn merge(
    into: &mut Vec<Triangle>,
    more: impl DoubleEndedIterator<Item = Triangle> + ExactSizeIterator,
) {
    let (mut from, mut to) = (into.len(), into.len() + more.len());
    into.reserve_exact(more.len());
    into.resize(to, Triangle::default());
    for t in more.rev() {
        while from > 0 && into[from - 1] > t {
            from -= 1;
            to -= 1;
            into[to] = into[from];
        }
        to -= 1;
        into[to] = t;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use outcrop_stages::ids::triangle;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn merging_is_sorting(
            a in prop::collection::vec([0u32..9, 0u32..9, 0u32..9], 0..40),
            b in prop::collection::vec([0u32..9, 0u32..9, 0u32..9], 0..40),
        ) {
            let [mut a, mut b]: [Vec<Triangle>; 2] =
                [a, b].map(|all| all.into_iter().map(triangle).collect());
            a.sort_unstable();
            b.sort_unstable();
            let mut want = [a.clone(), b.clone()].concat();
            want.sort_unstable();
            merge(&mut a, b.iter().copied());
            prop_assert_eq!(a, want);
        }
    }
}
