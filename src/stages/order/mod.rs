//! Sorts points along the Hilbert curve, on disk, and removes duplicates; the rank of a point is its id (not
//! in the paper). This makes all later stages independent of memory and threads.

mod bits;
mod files;
mod packed;
mod rewrite;
mod sample;
mod store;
mod writer;

pub use files::StoredPoints;
pub use rewrite::Rewriter;
pub use sample::{Grouped, MOST_GROUPS, cuts, sample_sort};
pub use store::{PAGE, PointStore};
pub use writer::{Position, StoreWriter};

use crate::ids::Id;
use outcrop_disk::error::{Error, Result};
use outcrop_disk::spill::{Sorted, Sorter, row};
use outcrop_disk::workspace::Workspace;
use outcrop_geom::lattice::Lattice;
use outcrop_geom::{Point, hilbert};
use outcrop_points::{READ_BUFFERS, Spool};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::sync::atomic::{AtomicU64, Ordering};

/// Keys encoded at a time.
const CHUNK: usize = 1 << 12;

/// Keys that a thread merges at a time; more if there are many runs.
const PART: usize = 1 << 18;

/// Room in the sort buffer in addition to all points.
const SPARE: u64 = 1 << 17;

/// Most points of a stream in one run.
const MOST_IN_RUN: usize = 1 << 26;

/// The note kept with a run of a stream: the mark after it and the counts up to there; the number of points
/// so far, and true if these are all.
type Note<M, S> = ((Option<M>, S), (u64, bool));

/// Receives points of a stream, the mark after them, and the counts up to there.
pub type Each<'a, M, S> = &'a mut dyn FnMut(&[Point], Option<M>, S) -> Result<()>;

row! {
    /// The key of a position on the curve.
    pub struct CurveKey {
        /// The key computed by [`hilbert::encode`].
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

/// Accepts positions in any order and returns the ordered store.
#[derive(Debug)]
pub struct Orderer {
    sorter: Sorter<CurveKey>,
    taken: AtomicU64,
    /// Size of the sort buffer in bytes.
    buffer: u64,
}

impl Orderer {
    /// Reserves about a third of the available memory for sorting.
    ///
    /// # Errors
    /// [`Error::Memory`].
    pub fn new(workspace: &Workspace) -> Result<Self> {
        Self::for_points(workspace, u64::MAX)
    }

    /// Reserves memory for sorting up to `most` points: about a third of the available memory, or less if
    /// they fit in less.
    ///
    /// # Errors
    /// [`Error::Memory`].
    pub fn for_points(workspace: &Workspace, most: u64) -> Result<Self> {
        let third = (workspace.memory.available() / 3).max(16 << 20);
        // A full buffer is written to disk, so there is room for more points than there are.
        let all = most
            .saturating_add(SPARE)
            .saturating_mul(size_of::<CurveKey>() as u64);
        let buffer = third.min(all);
        let held = workspace.promise("order: sort buffer", buffer)?;
        let sorter = Sorter::new(workspace, "order", buffer);
        Ok(Self {
            sorter: sorter.reporting(held).whole(),
            taken: AtomicU64::new(0),
            buffer,
        })
    }

    /// Adds positions, each coordinate in `0..2^30`; may be called from several threads.
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

    /// Adds parts of the input, given by their numbers and numbers of points; `push` passes all points of a
    /// part to `self`. In a run that can be resumed, parts that are already sorted are not read again.
    ///
    /// # Errors
    /// Errors of `push`, [`Error::Io`], [`Error::Disk`].
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

    /// Adds a stream of points that can be restarted between any two of its parts. `stream` is called with
    /// the mark at which to start (`None`: at the beginning) and the counts before it. It passes on points,
    /// the mark after them and the counts up to there, and returns the counts of all.
    ///
    /// # Errors
    /// Errors of `stream`, [`Error::Io`], [`Error::Disk`], [`Error::Cancelled`].
    pub fn take_stream<M, S>(
        &self,
        workspace: &Workspace,
        stream: impl FnOnce(Option<M>, S, Each<'_, M, S>) -> Result<S>,
    ) -> Result<S>
    where
        M: Serialize + DeserializeOwned,
        S: Serialize + DeserializeOwned + Default,
    {
        let step = workspace.step("runs")?;
        let last: Option<Note<M, S>> = self.sorter.reopen_runs(&step)?;
        let ((mark, counts), (taken, complete)) = last.unwrap_or_default();
        self.taken.store(taken, Ordering::Relaxed);
        if complete {
            return Ok(counts);
        }
        let mut since = 0;
        let taken = || self.taken.load(Ordering::Relaxed);
        let counts = stream(mark, counts, &mut |points, mark, counts| {
            self.push(workspace, points)?;
            since += points.len();
            // The next points must not fill the buffer: it would be written without a note, and lost on
            // resume.
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

    /// True if all points added are on disk.
    #[must_use]
    pub fn is_sorted(&self) -> bool {
        self.sorter.is_spilled()
    }

    /// The store of all distinct points in curve order, with `page` points in a page, and the number of
    /// duplicates removed.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Corrupt`], [`Error::TooManyPoints`], [`Error::Cancelled`].
    pub fn finish(self, workspace: &Workspace, page: usize) -> Result<(StoredPoints, u64)> {
        // The runs are deleted only when the store is known to be finished.
        let (store, runs) = workspace.once("sort", |_| {
            let mut writer = StoreWriter::create(workspace, "points", page)?;
            let sorted = self.sorter.finish(workspace)?;
            let runs = sorted.runs();
            match sorted.in_memory() {
                Ok((mut keys, _held)) => {
                    keys.dedup();
                    let left = &keys[writer.len.min(keys.len())..];
                    writer.append(left, CurveKey::point)?;
                }
                Err(sorted) => merge(sorted, self.buffer, &mut writer, workspace)?,
            }
            Ok((writer.finish()?, runs))
        })?;
        runs.release(workspace)?;
        let (found, limit) = (store.len() as u64, Id::MOST);
        if found > limit {
            return Err(Error::TooManyPoints { found, limit });
        }
        Ok((store, self.taken.into_inner() - found))
    }
}

/// Sorts all points of a spool, with `page` points in a page. Returns the store and the number of duplicates
/// removed. The spool comes back if it may be read again, for values or after an interruption, or is deleted.
///
/// # Errors
/// [`Error::Io`], [`Error::Corrupt`], [`Error::TooManyPoints`], [`Error::Memory`], [`Error::Cancelled`].
pub fn order(
    spool: Spool,
    lattice: &Lattice,
    page: usize,
    workspace: &Workspace,
) -> Result<(StoredPoints, u64, Option<Spool>)> {
    // The read buffers may only take a small part of the memory for sorting.
    let most = workspace.memory.available() / (8 * READ_BUFFERS);
    let threads = workspace.threads.min(most as usize).max(1);
    let held = workspace.reserve("order: frames", threads as u64 * READ_BUFFERS)?;
    let orderer = Orderer::for_points(workspace, spool.points())?;
    orderer.take_parts(workspace, &spool.frames(), |frames| {
        let push = |points: &[_]| orderer.push(workspace, points);
        spool.par_for_frames(workspace, threads, lattice, frames, push)
    })?;
    drop(held);
    // After an interruption, points that were only in memory have to be read again; with values all are.
    let again = spool.has_values() || workspace.is_resumable() && !orderer.is_sorted();
    let spool = spool.kept_if(again, workspace)?;
    let (store, duplicates) = orderer.finish(workspace, page)?;
    Ok((store, duplicates, spool))
}

/// The successor of a key.
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

/// Merges the sorted runs on disk part by part, one thread for each part, in `memory` bytes; the calling
/// thread writes them.
fn merge(
    mut sorted: Sorted<CurveKey>,
    memory: u64,
    writer: &mut StoreWriter<'_>,
    workspace: &Workspace,
) -> Result<()> {
    // A key can be computed from a position, so the last point written determines where to continue.
    let start = writer.last_found()?.map(|point| next(CurveKey::of(point)));
    let cuts = sorted.cuts(PART).into_iter().map(Some);
    let cuts = cuts.filter(|cut| *cut > start);
    let ends: Vec<_> = [start].into_iter().chain(cuts).chain([None]).collect();
    // A part reads up to one extra frame of each run, and its list grows by doubling. One list more is written.
    let (list, merging) = ((PART * size_of::<CurveKey>()) as u64, sorted.merge_bytes());
    let threads = (memory / (3 * list + 4 * merging)).clamp(1, workspace.threads as u64) as usize;
    sorted.report_usage(threads as u64 * (list + merging) + list);
    let one = |part: usize| {
        workspace.check_cancel()?;
        let (mut points, mut last) = (Vec::with_capacity(PART), None);
        sorted.for_range(ends[part], ends[part + 1], |key| {
            if last.replace(key) != Some(key) {
                points.push(key.point());
            }
            Ok(())
        })?;
        Ok(points)
    };
    workspace.pipe(threads, ends.len() - 1, one, |points: Vec<Point>| {
        workspace.observer.advance(points.len() as u64);
        writer.push(&points)
    })
}
