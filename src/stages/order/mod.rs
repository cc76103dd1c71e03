//! Points in curve order: an external sort, duplicates folded; the rank is the id (paper: none;
//! this is what makes everything after it independent of memory and threads).

mod rewrite;
mod store;
mod writer;

pub use rewrite::Rewriter;
pub use store::{PAGE, PointStore};
pub use writer::{Position, StoreWriter};

use crate::error::{Error, Result};
use crate::geom::lattice::Lattice;
use crate::geom::{Point, hilbert};
use crate::spill::{Sorted, Sorter, row};
use crate::stages::ingest::{READ_BUFFERS, Spool};
use crate::workspace::Workspace;
use crate::workspace::persist::Persist;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};

/// Keys encoded at a time.
const CHUNK: usize = 1 << 12;

/// Keys of a merge that one thread takes at a time, or more if there are many runs.
const PART: usize = 1 << 18;

/// Room in the sort buffer beside all points.
const SPARE: u64 = 1 << 17;

/// Points of a stream that a run holds at most.
const MOST_IN_RUN: usize = 1 << 26;

/// What is noted with a run of a stream: the mark after it and the counts up to there; the points so
/// far, and whether they are all.
type Note<M, S> = ((Option<M>, S), (u64, bool));

/// Takes points of a stream, the mark after them, and the counts up to there.
pub type Each<'a, M, S> = &'a mut dyn FnMut(&[Point], Option<M>, S) -> Result<()>;

row! {
    /// The key of a position on the curve.
    pub struct CurveKey {
        /// As [`hilbert::encode`] has it.
        key: hilbert::Key,
    }
    unpacked
}

impl CurveKey {
    fn of(point: Point) -> Self {
        let key = hilbert::encode(point);
        Self { key }
    }

    fn point(&self) -> Point {
        hilbert::decode(self.key)
    }
}

/// Takes in positions in any order and gives back the ordered store.
#[derive(Debug)]
pub struct Orderer {
    sorter: Sorter<CurveKey>,
    taken: AtomicU64,
    /// Bytes of the sort buffer.
    buffer: u64,
}

impl Orderer {
    /// Sorts in about a third of the memory that is free now.
    ///
    /// # Errors
    /// [`Error::Memory`].
    pub fn new(workspace: &Workspace) -> Result<Self> {
        Self::for_points(workspace, u64::MAX)
    }

    /// Sorts up to so many points in about a third of the memory that is free now, or in less if they
    /// fit.
    ///
    /// # Errors
    /// [`Error::Memory`].
    pub fn for_points(workspace: &Workspace, most: u64) -> Result<Self> {
        let third = (workspace.memory.available() / 3).max(16 << 20);
        // A buffer that is full is written: there is room for more than there are.
        let all = most
            .saturating_add(SPARE)
            .saturating_mul(size_of::<CurveKey>() as u64);
        let buffer = third.min(all);
        let held = workspace.promise("order: sort buffer", buffer)?;
        let sorter = Sorter::new(workspace, "order", buffer);
        Ok(Self {
            sorter: sorter.telling(held).whole(),
            taken: AtomicU64::new(0),
            buffer,
        })
    }

    /// Takes in positions, each coordinate in `0..2^30`; safe to call from several threads.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Cancelled`].
    pub fn push(&self, workspace: &Workspace, points: &[Point]) -> Result<()> {
        workspace.check_cancel()?;
        let mut keys = Vec::with_capacity(CHUNK.min(points.len()));
        for part in points.chunks(CHUNK) {
            keys.clear();
            keys.extend(part.iter().map(|&p| CurveKey::of(p)));
            self.sorter.push(&keys)?;
        }
        self.taken.fetch_add(points.len() as u64, Ordering::Relaxed);
        Ok(())
    }

    /// Takes in parts of the input, given by their numbers and points, all of which `push` pushes to it.
    /// In a run that can be resumed, those that are sorted are not taken in again.
    ///
    /// # Errors
    /// What `push` returned, [`Error::Io`], [`Error::Disk`].
    pub fn take_parts(
        &self,
        workspace: &Workspace,
        parts: &[(u32, u64)],
        push: impl Fn(&[u32]) -> Result<()>,
    ) -> Result<()> {
        let taken = self.sorter.take_parts(workspace, parts, false, push)?;
        self.taken.store(taken, Ordering::Relaxed);
        Ok(())
    }

    /// Takes in a stream of points that can be begun anywhere between two of its parts. `stream` is
    /// called with a mark where to begin (none: at the start) and with what was counted before that;
    /// it hands on points, the mark after them and the counts up to there, and returns the counts of all.
    ///
    /// # Errors
    /// What `stream` returned, [`Error::Io`], [`Error::Disk`], [`Error::Cancelled`].
    pub fn take_stream<M, S>(
        &self,
        workspace: &Workspace,
        stream: impl FnOnce(Option<M>, S, Each<'_, M, S>) -> Result<S>,
    ) -> Result<S>
    where
        M: Persist,
        S: Persist + Default,
    {
        let step = workspace.step("runs")?;
        let last: Option<Note<M, S>> = self.sorter.take_up(workspace, &step)?;
        let ((mark, counts), (taken, complete)) =
            last.unwrap_or(((None, S::default()), (0, false)));
        self.taken.store(taken, Ordering::Relaxed);
        if complete {
            return Ok(counts);
        }
        let mut since = 0;
        let taken = || self.taken.load(Ordering::Relaxed);
        let counts = stream(mark, counts, &mut |points, mark, counts| {
            self.push(workspace, points)?;
            since += points.len();
            // The next points must not fill the buffer: it would be written, and not for good.
            let full = self.sorter.buffered() + points.len() >= self.sorter.capacity();
            if workspace.is_resumable() && mark.is_some() && (full || since > MOST_IN_RUN) {
                since = 0;
                let note: Note<M, S> = ((mark, counts), (taken(), false));
                self.sorter.close_run(&step, &note)?;
            }
            Ok(())
        })?;
        if workspace.is_resumable() {
            let note: Note<M, S> = ((None, counts), (taken(), true));
            self.sorter.close_run(&step, &note)?;
            return Ok(note.0.1);
        }
        Ok(counts)
    }

    /// True if all that was taken in is on disk.
    #[must_use]
    pub fn is_sorted(&self) -> bool {
        self.sorter.is_spilled()
    }

    /// The store of all distinct points in curve order, in pages of `page` points, and the number
    /// of duplicates folded.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Corrupt`], [`Error::TooManyPoints`], [`Error::Cancelled`].
    pub fn finish(self, workspace: &Workspace, page: usize) -> Result<(PointStore, u64)> {
        let Self {
            sorter,
            taken,
            buffer,
        } = self;
        let mut writer = StoreWriter::create(workspace, "points", page)?;
        match sorter.finish(workspace)?.in_memory() {
            Ok((mut keys, _held)) => {
                keys.dedup();
                let left = &keys[writer.len().min(keys.len())..];
                writer.append(workspace, left, CurveKey::point)?;
            }
            Err(sorted) => merge(sorted, buffer, &mut writer, workspace)?,
        }
        let store = writer.finish(workspace)?;
        let limit = u64::from(u32::MAX) - 1;
        if store.len() as u64 > limit {
            return Err(Error::TooManyPoints {
                found: store.len() as u64,
                limit,
            });
        }
        let folded = taken.into_inner() - store.len() as u64;
        Ok((store, folded))
    }
}

/// Puts all points of a spool in order, in pages of `page` points; the spool is deleted. The store, and
/// the number of duplicates folded.
///
/// # Errors
/// [`Error::Io`], [`Error::Corrupt`], [`Error::TooManyPoints`], [`Error::Memory`], [`Error::Cancelled`].
pub fn order(
    spool: Spool,
    lattice: &Lattice,
    page: usize,
    workspace: &Workspace,
) -> Result<(PointStore, u64)> {
    // Their buffers must not take much of what is there to sort in.
    let most = workspace.memory.available() / (8 * READ_BUFFERS);
    let threads = workspace.threads.min(most as usize).max(1);
    let held = workspace.reserve("order: frames", threads as u64 * READ_BUFFERS)?;
    let orderer = Orderer::for_points(workspace, spool.points())?;
    orderer.take_parts(workspace, &spool.frames(), |frames| {
        let push = |points: &[_]| orderer.push(workspace, points);
        spool.par_for_frames(threads, lattice, frames, push)
    })?;
    drop(held);
    // An attempt that dies has to read again what was only in memory.
    let read_again = workspace.is_resumable() && !orderer.is_sorted();
    let _spool = read_again.then_some(spool);
    orderer.finish(workspace, page)
}

/// Where a part of the keys begins and ends.
type Part = (Option<CurveKey>, Option<CurveKey>);

/// The key after this one.
fn next(mut key: CurveKey) -> CurveKey {
    for word in key.key.iter_mut().rev() {
        let (sum, over) = word.overflowing_add(1);
        *word = sum;
        if !over {
            break;
        }
    }
    key
}

/// Writes what is on disk in order, part by part, each merged by one thread, in `memory` bytes.
fn merge(
    mut sorted: Sorted<CurveKey>,
    memory: u64,
    writer: &mut StoreWriter,
    workspace: &Workspace,
) -> Result<()> {
    // A key is a position, so the last one written says where to go on.
    let start = writer.last()?.map(|point| next(CurveKey::of(point)));
    let cuts = sorted.cuts(PART).into_iter().map(Some);
    let cuts = cuts.filter(|cut| *cut > start);
    let ends: Vec<_> = [start].into_iter().chain(cuts).chain([None]).collect();
    let parts: Vec<Part> = ends.windows(2).map(|w| (w[0], w[1])).collect();
    // A part has a frame more of each run at most, and its list grows by doubling.
    let (list, merging) = ((PART * size_of::<CurveKey>()) as u64, sorted.merge_bytes());
    let threads = (memory / (3 * list + 4 * merging)).clamp(1, workspace.threads as u64) as usize;
    sorted.tell(threads as u64 * (list + merging));
    let one = |&(from, to): &Part| {
        workspace.check_cancel()?;
        let mut keys = Vec::with_capacity(PART);
        sorted.for_range(from, to, |key| {
            if keys.last() != Some(&key) {
                keys.push(key);
            }
            Ok(())
        })?;
        Ok(keys)
    };
    for wave in parts.chunks(threads) {
        let merged: Result<Vec<Vec<CurveKey>>> =
            workspace.install(|| wave.par_iter().with_max_len(1).map(one).collect());
        for keys in merged? {
            writer.append(workspace, &keys, CurveKey::point)?;
        }
    }
    Ok(())
}
