//! Positions of the vertices of a block and of some other vertices.

use super::blocks::Blocks;
use super::cells::CountedTriple;
use super::ids::{Id, Ids, Triangle};
use super::levels::Levels;
use super::order::PointStore;
use super::outside::Outside;
use super::spacing::Density;
use outcrop_disk::error::Result;
use outcrop_disk::workspace::memory::{bytes_of, table_bytes};
use outcrop_geom::Point;
use outcrop_geom::triangle::on_a_line;
use rustc_hash::FxHashMap;

/// The two positions of every id: those that decide the connectivity, and those that are written to the file.
/// They are the same store unless points were relaxed.
#[derive(Debug, Clone, Copy)]
pub struct Places<'a> {
    /// The positions that decide the connectivity.
    pub shape: &'a PointStore,
    /// The positions in the file.
    pub file: &'a PointStore,
    /// The density of the surface, if triangles too long for it are left out.
    pub density: Option<Density<'a>>,
    /// What tells which side is out; nothing if the highest points, which face up, are all there is.
    pub outside: Option<Outside<'a>>,
    /// True if points were relaxed.
    differ: bool,
}

impl<'a> Places<'a> {
    /// The positions in the file, and those that decide the connectivity, if these are others.
    #[must_use]
    pub fn new(
        file: &'a PointStore,
        shape: Option<&'a PointStore>,
        density: Option<Density<'a>>,
        outside: Option<Outside<'a>>,
    ) -> Self {
        Self {
            shape: shape.unwrap_or(file),
            file,
            density,
            outside,
            differ: shape.is_some(),
        }
    }

    /// With how coarse points are.
    #[must_use]
    pub fn with_coarse(self, coarse: Option<&'a Levels>) -> Self {
        let with = |density| Density { coarse, ..density };
        Self {
            density: self.density.map(with),
            ..self
        }
    }

    /// True if the positions in the file differ from those that decide the connectivity.
    #[must_use]
    pub fn differ(&self) -> bool {
        self.differ
    }

    /// True if there is noise at a point.
    #[must_use]
    pub fn is_noisy(&self, id: Id) -> bool {
        self.density.is_some_and(|density| density.is_noisy(id))
    }

    /// True if triangles can be unfit by their positions in the file although cells saw them.
    #[must_use]
    pub fn limit_triangles(&self) -> bool {
        self.differ() || self.density.is_some()
    }

    /// Returns a test of triangles with the positions of their corners in the file: true if the corners are
    /// collinear or a side is too long.
    pub fn unfit(&self) -> impl Fn(Triangle, [Point; 3]) -> bool + Copy {
        let differ = self.differ();
        let is_long = self.density.map(Density::is_long);
        // Without relaxing, cells see no three collinear points.
        #[inline(always)]
        move |t, at| differ && on_a_line(at) || is_long.is_some_and(|is_long| is_long(t, at))
    }

    /// Removes the candidates that are unfit by their positions in the file, and returns their number.
    pub fn drop_unfit(&self, candidates: &mut Vec<CountedTriple>, file: &Located) -> u64 {
        let (unfit, before) = (self.unfit(), candidates.len());
        candidates.retain(|c| !unfit(c.triple, file.corners(c.triple)));
        (before - candidates.len()) as u64
    }
}

/// Positions of the vertices of a block and of some others.
#[derive(Debug, Default)]
pub struct Located {
    ids: Ids,
    own: Vec<Point>,
    foreign: FxHashMap<Id, Point>,
}

impl Located {
    /// Loads the positions of `block`, and of `vertices` in any order.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`].
    pub fn load(
        store: &PointStore,
        blocks: Blocks,
        block: usize,
        vertices: impl Iterator<Item = Id>,
    ) -> Result<Self> {
        let ids = blocks.ids(block);
        let mut located = Self {
            own: store.slice(ids.indices())?,
            ids,
            foreign: FxHashMap::default(),
        };
        located.add(store, vertices)?;
        Ok(located)
    }

    /// Points by id, for unit tests.
    #[doc(hidden)]
    #[must_use]
    pub fn of(points: &[Point]) -> Self {
        Self {
            ids: Ids::at(&(0..points.len())),
            own: points.to_vec(),
            foreign: FxHashMap::default(),
        }
    }

    /// Adds the positions of those `vertices` that are not in the block.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`].
    pub fn add(&mut self, store: &PointStore, vertices: impl Iterator<Item = Id>) -> Result<()> {
        let is_far = |v: &Id| self.ids.find(*v) >= self.ids.len();
        let mut far: Vec<Id> = vertices.filter(is_far).collect();
        far.sort_unstable();
        far.dedup();
        let mut points = Vec::with_capacity(far.len());
        store.fetch(&far, &mut points)?;
        self.foreign.extend(far.into_iter().zip(points));
        Ok(())
    }

    /// The positions of the block's vertices, in their order.
    #[must_use]
    pub fn own(&self) -> &[Point] {
        &self.own
    }

    /// Allocated bytes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        bytes_of(&self.own) + table_bytes(&self.foreign)
    }

    /// The position of a vertex that was loaded.
    #[must_use]
    #[inline(always)]
    pub fn at(&self, v: Id) -> Point {
        match self.own.get(self.ids.find(v)) {
            Some(point) => *point,
            None => self.foreign(v),
        }
    }

    /// The positions of the corners of a triangle.
    #[must_use]
    #[inline(always)]
    pub fn corners(&self, [a, b, c]: Triangle) -> [Point; 3] {
        [self.at(a), self.at(b), self.at(c)]
    }

    #[cold]
    #[inline(never)]
    fn foreign(&self, v: Id) -> Point {
        self.foreign[&v]
    }
}
