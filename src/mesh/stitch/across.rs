//! T12 insertion across blocks (paper, section 3.5, second part): one turn for each block, in ascending
//! order. Results that later turns need are on disk.

use super::deferred::Deferred;
use super::insertion::{Candidate, CandidateRow, insert_candidates};
use super::interior::{block_bytes, insert};
use super::stats::InsertStats;
use super::surroundings::Surroundings;
use super::{Insertion, Stitched};
use crate::surface::rows::{LabelledTo, TriangleTo};
use outcrop_disk::error::Result;
use outcrop_disk::spill::Shuffle;
use outcrop_disk::workspace::Unit;
use outcrop_stages::ids::Block;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

/// The pass across blocks, which advances while other threads still work inside blocks: a thread that has
/// finished a block advances it as far as the finished blocks allow.
pub struct Across<'a> {
    /// The blocks in the order in which the pass needs them.
    order: Vec<Block>,
    done: Vec<AtomicBool>,
    /// Most bytes for one turn: the part of the budget that the blocks in progress cannot need.
    spare: u64,
    pass: Mutex<Pass<'a>>,
}

impl<'a> Across<'a> {
    /// Starts the pass before its first block.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Memory`].
    pub fn new(insertion: Insertion<'a>) -> Result<Self> {
        let (workspace, all) = (insertion.workspace, 0..insertion.blocks.count());
        let pass = Pass::new(insertion)?;
        let bytes = all.clone().map(|block| block_bytes(insertion, block));
        let at_work = bytes.max().unwrap_or(0) * workspace.threads as u64;
        Ok(Self {
            order: pass.order.clone(),
            done: all.map(|_| AtomicBool::new(false)).collect(),
            spare: workspace.memory.available().saturating_sub(at_work),
            pass: Mutex::new(pass),
        })
    }

    /// Inserts the interior candidates of all blocks; returns the counts, and how many triangles of the base
    /// were cut. Meanwhile the pass advances.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`], [`outcrop_disk::error::Error::Memory`],
    /// [`outcrop_disk::error::Error::Cancelled`].
    pub fn insert_inside(&self, insertion: Insertion<'_>) -> Result<(InsertStats, u64)> {
        let order = &self.order;
        let mut all = InsertStats {
            unfit: insertion.base.flat_candidates,
            ..InsertStats::default()
        };
        let mut all_cut = 0;
        let work = |unit: &Unit<'_>| {
            let block = order[unit.number()];
            let found = insert(insertion, block.index(), unit)?;
            unit.advance(1);
            self.finished(block);
            // A task has no blocks but its own.
            if !unit.is_task() {
                self.go_on(unit)?;
            }
            Ok(found)
        };
        let bytes = |unit: usize| block_bytes(insertion, order[unit].index());
        let each = |unit: usize, (counts, cut): (InsertStats, u64)| {
            // The block may have been finished in an earlier attempt.
            self.finished(order[unit]);
            all.add(&counts);
            all_cut += cut;
            Ok(())
        };
        let workspace = insertion.workspace;
        workspace.units("stitch: block", order.len(), bytes, work, each)?;
        Ok((all, all_cut))
    }

    /// Takes the remaining turns, after all blocks are finished.
    ///
    /// # Errors
    /// See [`Pass::advance`].
    pub fn finish(self, unit: &Unit<'_>) -> Result<(Stitched, InsertStats)> {
        let pass = self.pass.into_inner();
        let mut pass = pass.unwrap_or_else(PoisonError::into_inner);
        pass.advance(unit, |_| true, None)?;
        pass.finish(unit)
    }

    /// Records that a block is finished.
    fn finished(&self, block: Block) {
        self.done[block.index()].store(true, Ordering::Release);
    }

    /// Advances as far as the finished blocks allow. A thread calls this at the end of its `unit`.
    fn go_on(&self, unit: &Unit<'_>) -> Result<()> {
        let ready = |block: Block| self.done[block.index()].load(Ordering::Acquire);
        match self.pass.try_lock() {
            Ok(mut pass) => pass.advance(unit, ready, Some(self.spare)),
            // Another thread is advancing the pass.
            Err(_) => Ok(()),
        }
    }
}

/// The insertion of crossing candidates, and of interior candidates that depend on them. It advances as far
/// as the blocks that it needs are finished.
struct Pass<'a> {
    mesh: Surroundings<'a>,
    /// The blocks in the order in which turns need them: by the first turn with a candidate at one of their
    /// vertices.
    order: Vec<Block>,
    /// Candidates that wait for the turn of a later block.
    waiting: Deferred<CandidateRow>,
    counts: InsertStats,
    /// The block whose turn is next, and the number of blocks of `order` known to be ready.
    group: usize,
    ready: usize,
    /// The triangles that each turn adds and removes, see [`Stitched`]. A turn may be taken inside a unit of
    /// another step, whose record must not contain them.
    added: Deferred<TriangleTo>,
    removed: Deferred<TriangleTo>,
}

impl<'a> Pass<'a> {
    /// Starts the pass before its first block.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Memory`].
    pub fn new(insertion: Insertion<'a>) -> Result<Self> {
        let (spans, count) = (&insertion.base.spans, insertion.blocks.count());
        let mut order: Vec<Block> = (0..count).map(Block::at).collect();
        order.sort_by_key(|block| spans[block.index()].0);
        Ok(Self {
            mesh: Surroundings::new(insertion)?,
            order,
            waiting: Deferred::new("stitch.waiting", count),
            counts: InsertStats::default(),
            group: 0,
            ready: 0,
            added: Deferred::new("stitch.turns.added", count),
            removed: Deferred::new("stitch.turns.removed", count),
        })
    }

    /// Takes all turns for which the blocks that are `ready` suffice, each in at most `most` bytes (`None`:
    /// in the available memory). A turn that needs more waits for the next call.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`], [`outcrop_disk::error::Error::Memory`],
    /// [`outcrop_disk::error::Error::Cancelled`].
    fn advance(
        &mut self,
        unit: &Unit<'_>,
        ready: impl Fn(Block) -> bool,
        most: Option<u64>,
    ) -> Result<()> {
        while self.group < self.mesh.insertion.blocks.count() {
            unit.check_cancel()?;
            let spans = &self.mesh.insertion.base.spans;
            while let Some(&block) = self.order.get(self.ready)
                && spans[block.index()].0.index() <= self.group
            {
                if !ready(block) {
                    return Ok(());
                }
                self.ready += 1;
            }
            if !self.turn(unit, self.group, most)? {
                return Ok(());
            }
            self.group += 1;
            // Not as progress of the unit, which would be reported again when the run is resumed.
            unit.observer.advance(1);
        }
        Ok(())
    }

    /// Takes the turn of a block; false if it would need more than `most` bytes.
    fn turn(&mut self, unit: &Unit<'_>, group: usize, most: Option<u64>) -> Result<bool> {
        let blocks = self.mesh.insertion.blocks;
        let mut tried = self.waiting.get(unit, group)?;
        tried.append(&mut self.mesh.insertion.interior.ranked.get(unit, group)?);
        let mut tried: Vec<_> = tried.into_iter().map(Candidate::of).collect();
        let mut held = most.map(|_| unit.hold(0));
        if !self.mesh.gather(unit, &tried, most, &mut held)? {
            return Ok(false);
        }
        let gone = self.mesh.confirm_merges(unit, group)?;
        self.counts.merges_reverted += gone.len() as u64;
        self.removed.send(unit, group, &gone)?;
        // Consists of ascending runs, which this sort merges.
        tried.sort();
        let (angle, counts) = (self.mesh.insertion.cos_max_angle, &mut self.counts);
        insert_candidates(&mut self.mesh, &mut tried, angle, counts);
        // A candidate without a vertex in a later block is not tried again.
        let mut waiting = Vec::new();
        for candidate in tried {
            let of = candidate.ids.map(|v| blocks.of(v));
            match of.into_iter().find(|b| *b > Block::at(group)) {
                Some(next) => waiting.push((next, candidate.row())),
                None => self.counts.unconnected += 1,
            }
        }
        waiting.sort_unstable();
        for part in waiting.chunk_by(|a, b| a.0 == b.0) {
            let rows: Vec<_> = part.iter().map(|(_, row)| *row).collect();
            self.waiting.send(unit, part[0].0.index(), &rows)?;
        }
        let spans = &self.mesh.insertion.base.spans;
        let later = |block: Block| spans[block.index()].1 > Block::at(group);
        let added = self.mesh.end(unit, later)?;
        self.added.send(unit, group, &added)?;
        Ok(true)
    }

    /// Ends the pass after all turns.
    ///
    /// # Errors
    /// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Disk`], [`outcrop_disk::error::Error::Corrupt`].
    pub fn finish(self, unit: &Unit<'_>) -> Result<(Stitched, InsertStats)> {
        let stitched = Stitched {
            interior: self.mesh.insertion.interior.mesh.clone(),
            added: Shuffle::new("stitch.added"),
            removed: Shuffle::new("stitch.removed"),
        };
        let Insertion { base, blocks, .. } = self.mesh.insertion;
        for group in 0..blocks.count() {
            let mut added = self.added.get(unit, group)?;
            // The crossing triangles of the base belong to the mesh as well.
            let rows = base.surface.crossing.get(unit, group)?.into_iter();
            added.extend(rows.map(|LabelledTo { to, triangle, .. }| TriangleTo { to, triangle }));
            stitched.added.send(unit, group, added)?;
            let removed = self.removed.get(unit, group)?;
            stitched.removed.send(unit, group, removed)?;
        }
        self.mesh.changes.release(unit)?;
        self.waiting.release(unit)?;
        self.added.release(unit)?;
        self.removed.release(unit)?;
        Ok((stitched, self.counts))
    }
}

#[cfg(test)]
mod tests;
