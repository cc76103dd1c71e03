//! Where the vertices of triangles are: those of one block, and some of others.

use super::blocks::Blocks;
use super::order::PointStore;
use super::spacing::Density;
use crate::error::Result;
use crate::geom::triangle::on_a_line;
use crate::geom::Point;
use crate::workspace::memory::{Holding, bytes_of, hold, table_bytes};
use rustc_hash::FxHashMap;
use std::ops::Range;

/// Positions by id, twice: those by which points are connected, and those that go into the file.
/// They are the same store unless points were moved for the connection only.
#[derive(Debug, Clone, Copy)]
pub struct Places<'a> {
    /// To connect by.
    pub shape: &'a PointStore,
    /// In the file.
    pub file: &'a PointStore,
    /// How dense the surface is, if edges that are too long for it are left out.
    pub density: Option<Density<'a>>,
}

impl Places<'_> {
    /// True if positions in the file are not those that points are connected by.
    #[must_use]
    pub fn differ(&self) -> bool {
        !std::ptr::eq(self.shape, self.file)
    }

    /// True if positions in the file may make triangles unfit that were fit to be seen by cells.
    #[must_use]
    pub fn limit_triangles(&self) -> bool {
        self.differ() || self.density.is_some()
    }

    /// True if a triangle, with its corners where they are in the file, is on a line or too long.
    #[must_use]
    pub fn unfit(&self, t: [u32; 3], at: [Point; 3]) -> bool {
        on_a_line(at) || self.density.is_some_and(|density| density.is_long(t, at))
    }
}

/// The positions of the vertices of a block and of some others.
#[derive(Debug, Default)]
pub struct Located {
    ids: Range<u32>,
    own: Vec<Point>,
    foreign: FxHashMap<u32, Point>,
    held: Holding,
}

impl Located {
    /// Those of `block`, and of `vertices` in any order.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Corrupt`].
    pub fn load(
        store: &PointStore,
        blocks: Blocks,
        block: usize,
        vertices: impl Iterator<Item = u32>,
    ) -> Result<Self> {
        let ids = blocks.ids(block);
        let mut located = Self {
            own: store.slice(ids.start as usize..ids.end as usize)?,
            ids,
            foreign: FxHashMap::default(),
            held: Holding::default(),
        };
        located.add(store, vertices)?;
        Ok(located)
    }

    /// Points by id, for tests.
    #[cfg(test)]
    pub(crate) fn of(points: &[Point]) -> Self {
        Self {
            ids: 0..points.len() as u32,
            own: points.to_vec(),
            foreign: FxHashMap::default(),
            held: Holding::default(),
        }
    }

    /// Takes in those of `vertices` that are not in the block.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Corrupt`].
    pub fn add(&mut self, store: &PointStore, vertices: impl Iterator<Item = u32>) -> Result<()> {
        let mut far: Vec<u32> = vertices.filter(|v| !self.ids.contains(v)).collect();
        let _far = hold(bytes_of(&far));
        far.sort_unstable();
        far.dedup();
        let mut points = Vec::with_capacity(far.len());
        store.fetch(&far, &mut points)?;
        self.foreign.extend(far.into_iter().zip(points));
        self.held
            .set(bytes_of(&self.own) + table_bytes(&self.foreign));
        Ok(())
    }

    /// The position of a vertex that was loaded.
    #[must_use]
    #[inline]
    pub fn at(&self, v: u32) -> Point {
        if self.ids.contains(&v) {
            self.own[(v - self.ids.start) as usize]
        } else {
            self.foreign[&v]
        }
    }
}
