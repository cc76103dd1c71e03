//! T12 insertion across blocks (paper, section 3.5, second part): one turn for each block, in ascending
//! order. Results that later turns need are on disk.

use super::base::Base;
use super::deferred::Deferred;
use super::insertion::{Candidate, CandidateRow, insert_candidates};
use super::interior::{Follower, Interior, block_bytes};
use super::stats::InsertStats;
use super::surroundings::Surroundings;
use crate::error::Result;
use crate::spill::{Shuffle, Table};
use crate::stages::blocks::Blocks;
use crate::stages::surface::rows::{LabelledTo, TriangleTo};
use crate::workspace::Workspace;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

const SHUFFLE_BUFFER: u64 = 8 << 20;

/// The crossing part of the mesh.
#[derive(Debug)]
pub struct Crossing {
    /// Crossing triangles of the mesh and interior candidates that were inserted late, once for each block
    /// that they touch.
    pub added: Table<TriangleTo>,
    /// Interior triangles that are removed again.
    pub removed: Table<TriangleTo>,
}

crate::workspace::persist::persist!(Crossing { added, removed });

/// The pass across blocks, which advances while other threads still work inside blocks: a thread that has
/// finished a block advances it as far as the finished blocks allow.
pub struct Across<'a> {
    /// The blocks in the order in which the pass needs them.
    order: Vec<u32>,
    done: Vec<AtomicBool>,
    /// Most bytes for one turn: the part of the budget that the blocks in progress cannot need.
    spare: u64,
    pass: Mutex<Pass<'a>>,
}

impl<'a> Across<'a> {
    /// Starts the pass before its first block.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Memory`].
    pub fn new(
        base: &'a Base,
        interior: &'a Interior,
        blocks: Blocks,
        cos_max_angle: f64,
        workspace: &'a Workspace,
    ) -> Result<Self> {
        let pass = Pass::new(base, interior, blocks, cos_max_angle, workspace)?;
        let all = 0..blocks.count();
        let most = all.clone().map(|block| block_bytes(base, block)).max();
        let at_work = most.unwrap_or(0) * workspace.threads as u64;
        Ok(Self {
            order: pass.order.clone(),
            done: all.map(|_| AtomicBool::new(false)).collect(),
            spare: workspace.memory.available().saturating_sub(at_work),
            pass: Mutex::new(pass),
        })
    }

    /// Takes the remaining turns, after all blocks are finished.
    ///
    /// # Errors
    /// See [`Pass::advance`].
    pub fn finish(self) -> Result<(Crossing, InsertStats)> {
        let pass = self.pass.into_inner();
        let mut pass = pass.unwrap_or_else(PoisonError::into_inner);
        pass.advance(|_| true, None)?;
        pass.finish()
    }
}

impl Follower for Across<'_> {
    fn order(&self) -> &[u32] {
        &self.order
    }

    fn finished(&self, block: u32) {
        self.done[block as usize].store(true, Ordering::Release);
    }

    fn go_on(&self) -> Result<()> {
        let ready = |block: u32| self.done[block as usize].load(Ordering::Acquire);
        match self.pass.try_lock() {
            Ok(mut pass) => pass.advance(ready, Some(self.spare)),
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
    order: Vec<u32>,
    /// Candidates that wait for the turn of a later block.
    waiting: Deferred<CandidateRow>,
    counts: InsertStats,
    /// The block whose turn is next, and the number of blocks of `order` known to be ready.
    group: usize,
    ready: usize,
    added: Shuffle<TriangleTo>,
    removed: Shuffle<TriangleTo>,
    cos_max_angle: f64,
}

impl<'a> Pass<'a> {
    /// Starts the pass before its first block.
    ///
    /// # Errors
    /// [`crate::Error::Memory`].
    pub fn new(
        base: &'a Base,
        interior: &'a Interior,
        blocks: Blocks,
        cos_max_angle: f64,
        workspace: &'a Workspace,
    ) -> Result<Self> {
        let shuffle = |name| Shuffle::new(workspace, name, SHUFFLE_BUFFER);
        let mut order: Vec<u32> = (0..blocks.count() as u32).collect();
        order.sort_by_key(|block| base.spans[*block as usize].0);
        Ok(Self {
            mesh: Surroundings::new(base, interior, blocks, workspace)?,
            order,
            waiting: Deferred::new(workspace, "stitch.waiting", blocks.count())?,
            counts: InsertStats::default(),
            group: 0,
            ready: 0,
            added: shuffle("stitch.added")?,
            removed: shuffle("stitch.removed")?,
            cos_max_angle,
        })
    }

    /// Takes all turns for which the blocks that are `ready` suffice, each in at most `most` bytes (`None`:
    /// in the available memory). A turn that needs more waits for the next call.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Corrupt`], [`crate::Error::Memory`],
    /// [`crate::Error::Cancelled`].
    fn advance(&mut self, ready: impl Fn(u32) -> bool, most: Option<u64>) -> Result<()> {
        while self.group < self.mesh.blocks.count() {
            self.mesh.workspace.check_cancel()?;
            let spans = &self.mesh.base.spans;
            while let Some(&block) = self.order.get(self.ready)
                && spans[block as usize].0 as usize <= self.group
            {
                if !ready(block) {
                    return Ok(());
                }
                self.ready += 1;
            }
            if !self.turn(self.group, most)? {
                return Ok(());
            }
            self.group += 1;
            self.mesh.workspace.observer.advance(1);
        }
        Ok(())
    }

    /// Takes the turn of a block; false if it would need more than `most` bytes.
    fn turn(&mut self, group: usize, most: Option<u64>) -> Result<bool> {
        let blocks = self.mesh.blocks;
        let mut tried = self.waiting.get(group)?;
        tried.append(&mut self.mesh.interior.ranked.get(group)?);
        let mut tried: Vec<_> = tried.into_iter().map(Candidate::of).collect();
        if !self.mesh.gather(&tried, most)? {
            return Ok(false);
        }
        let gone = self.mesh.confirm_merges(group)?;
        self.counts.joints_removed += gone.len() as u64;
        self.removed.send(&gone)?;
        // Consists of ascending runs, which this sort merges.
        tried.sort();
        let (angle, counts) = (self.cos_max_angle, &mut self.counts);
        insert_candidates(&mut self.mesh, &mut tried, angle, counts);
        // A candidate without a vertex in a later block is not tried again.
        let mut waiting = Vec::new();
        for candidate in tried {
            let of = candidate.ids.map(|v| blocks.of(v));
            match of.into_iter().find(|b| *b > group as u32) {
                Some(next) => waiting.push((next, candidate.row())),
                None => self.counts.unconnected += 1,
            }
        }
        waiting.sort_unstable();
        for part in waiting.chunk_by(|a, b| a.0 == b.0) {
            let rows: Vec<_> = part.iter().map(|(_, row)| *row).collect();
            self.waiting.send(part[0].0, &rows)?;
        }
        let spans = &self.mesh.base.spans;
        let later = |block: u32| spans[block as usize].1 > group as u32;
        self.added.send(&self.mesh.end(later)?)?;
        Ok(true)
    }

    /// Ends the pass after all turns.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Corrupt`].
    pub fn finish(self) -> Result<(Crossing, InsertStats)> {
        let (blocks, workspace) = (self.mesh.blocks, self.mesh.workspace);
        // The crossing triangles of the base belong to the mesh as well.
        let base = &self.mesh.base.surface;
        for block in 0..blocks.count() {
            let rows = base.crossing.get(block)?.into_iter();
            let rows = rows.map(|LabelledTo { to, triangle, .. }| TriangleTo { to, triangle });
            self.added.send(&rows.collect::<Vec<_>>())?;
        }
        let crossing = Crossing {
            added: self.added.deliver(workspace, blocks.count())?,
            removed: self.removed.deliver(workspace, blocks.count())?,
        };
        Ok((crossing, self.counts))
    }
}

#[cfg(test)]
mod tests;
