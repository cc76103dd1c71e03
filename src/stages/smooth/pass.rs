//! A pass over all points that moves some of them: same ids, same pages, other positions.

use crate::cells::TileRanges;
use crate::order::{PointStore, Rewriter, StoredPoints};
use crate::tiles::Tile;
use crate::tiles::walk::PageCache;
use outcrop_disk::error::Result;
use outcrop_disk::workspace::memory::bytes_of;
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_geom::Point;
use outcrop_paper::method::METHOD;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::ops::Range;

/// The names of a pass and the division of its work.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pass<'a> {
    /// Name of the scratch file.
    pub file: &'a str,
    /// Name of its memory reservation.
    pub memory: &'static str,
    /// Approximate number of points processed at a time.
    pub tile: u32,
    /// Number of consecutive points that are never divided: a multiple of a run.
    pub whole: usize,
    /// Bytes for each point in addition to its tile and its position.
    pub bytes: u64,
}

impl<'a> Pass<'a> {
    /// A pass that may divide points between any two runs and needs no additional memory.
    pub fn new(file: &'a str, memory: &'static str, tiles: TileRanges) -> Self {
        Self {
            file,
            memory,
            tile: tiles.size(),
            whole: METHOD.curve.run,
            bytes: 0,
        }
    }

    /// Moves the points of `store`. `work` is called in a unit with a range of ids and their positions, which
    /// it changes; `each` receives its result.
    pub fn over<T: Serialize + DeserializeOwned + Send>(
        self,
        store: &PointStore,
        workspace: &Workspace,
        work: impl Fn(&Unit<'_>, Range<usize>, &mut [Point]) -> Result<T> + Sync,
        mut each: impl FnMut(T) + Send,
    ) -> Result<StoredPoints> {
        let whole = common_multiple(store.page_size() * METHOD.curve.run, self.whole);
        let size = (self.tile as usize).next_multiple_of(whole);
        let piece = |number: usize| number * size..((number + 1) * size).min(store.len());
        let bytes = |number: usize| {
            let points = piece(number).len();
            Tile::estimate(points) + PageCache::estimate(store) + points as u64 * (12 + self.bytes)
        };
        let moved = Rewriter::of(store, workspace, self.file)?;
        let one = |unit: &Unit<'_>| {
            let ids = piece(unit.number());
            let mut points = store.slice(ids.clone())?;
            let _held = unit.hold(bytes_of(&points));
            let found = work(unit, ids.clone(), &mut points)?;
            unit.advance(points.len() as u64);
            moved.put(unit, ids.start, &points)?;
            Ok(found)
        };
        let count = store.len().div_ceil(size);
        workspace.units((self.file, self.memory), count, bytes, one, |_, found| {
            each(found);
            Ok(())
        })?;
        moved.finish(workspace)
    }
}

fn common_multiple(a: usize, b: usize) -> usize {
    let (mut larger, mut rest) = (a, b);
    while rest > 0 {
        (larger, rest) = (rest, larger % rest);
    }
    a / larger.max(1) * b
}
