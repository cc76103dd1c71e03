//! T12 insertion across blocks (paper, section 3.5, second part): block by block in ascending
//! order. What a turn leaves for later ones is on disk.

use super::InsertStats;
use super::base::Base;
use super::context::Context;
use super::interior::{Interior, RANKED};
use super::mail::Mail;
use super::tests_of_paper::Candidate;
use crate::error::Result;
use crate::spill::layouts::SENT;
use crate::spill::{Exchange, Sections};
use crate::stages::blocks::Blocks;
use crate::workspace::Workspace;

const EXCHANGE_BUFFER: u64 = 8 << 20;

/// The crossing part of the mesh.
#[derive(Debug)]
pub struct Crossing {
    /// `[block, i, j, k]` for each block that the triangle touches: crossing triangles of the mesh,
    /// and interior candidates that were inserted late.
    pub added: Sections<4>,
    /// `[block, i, j, k]`: interior triangles to be taken out again.
    pub removed: Sections<4>,
}

crate::workspace::persist::persist!(Crossing { added, removed });

/// The insertion of what crosses blocks, and of what inside them waits for it. It goes on as far as
/// the blocks that it needs are done.
pub struct Pass<'a> {
    context: Context<'a>,
    lives: Lives,
    /// Candidates that wait for the turn of a later block.
    waiting: Mail<5>,
    counts: InsertStats,
    /// The block whose turn is next, and how many of those it needs first are ready.
    group: usize,
    ready: usize,
    added: Exchange<4>,
    removed: Exchange<4>,
    cos_max_angle: f64,
}

impl<'a> Pass<'a> {
    /// The pass before its first block.
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
        let exchange = |name| -> Result<Exchange<4>> {
            Ok(Exchange::new(workspace, name, EXCHANGE_BUFFER)?.packed(SENT))
        };
        Ok(Self {
            context: Context::new(base, interior, blocks, workspace)?,
            lives: Lives::of(&base.spans),
            waiting: Mail::new(workspace, "stitch.waiting", blocks.count(), RANKED)?,
            counts: InsertStats::default(),
            group: 0,
            ready: 0,
            added: exchange("stitch.added")?,
            removed: exchange("stitch.removed")?,
            cos_max_angle,
        })
    }

    /// The cosine of the largest angle between neighbours.
    pub fn cos_max_angle(&self) -> f64 {
        self.cos_max_angle
    }

    /// Blocks in the order in which they are needed.
    pub fn order(&self) -> Vec<u32> {
        self.lives.begin.concat()
    }

    /// Takes all turns for which the blocks that are `ready` suffice. Within `most` bytes for a turn,
    /// or as many as there are if it is `None`; otherwise it waits to be called again.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Corrupt`], [`crate::Error::Memory`],
    /// [`crate::Error::Cancelled`].
    pub fn advance(&mut self, ready: impl Fn(u32) -> bool, most: Option<u64>) -> Result<()> {
        while self.group < self.lives.begin.len() {
            self.context.workspace.check_cancel()?;
            let needed = &self.lives.begin[self.group];
            while let Some(&block) = needed.get(self.ready) {
                if !ready(block) {
                    return Ok(());
                }
                self.ready += 1;
            }
            if !self.turn(self.group, most)? {
                return Ok(());
            }
            self.group += 1;
            self.ready = 0;
            self.context.workspace.observer.advance(1);
        }
        Ok(())
    }

    /// The turn of a block; false if it would take more than `most` bytes.
    fn turn(&mut self, group: usize, most: Option<u64>) -> Result<bool> {
        let blocks = self.context.blocks;
        let mut tried = self.waiting.get(group)?;
        tried.append(&mut self.context.interior.ranked.get(group)?);
        let mut tried: Vec<_> = tried.into_iter().map(Candidate::from_record).collect();
        if !self.context.gather(&tried, most)? {
            return Ok(false);
        }
        let gone = self.context.joints(group)?;
        self.counts.joints_removed += gone.len() as u64;
        self.removed.send(&gone)?;
        // Ascending runs: this sort merges them.
        tried.sort();
        let (angle, counts) = (self.cos_max_angle, &mut self.counts);
        let new = self.context.rounds(&mut tried, angle, counts);
        self.added.send(&new)?;
        // What has no vertex in a later block will not be tried again.
        let mut waiting = Vec::new();
        for candidate in tried {
            let of = candidate.ids.map(|v| blocks.of(v));
            match of.into_iter().find(|b| *b > group as u32) {
                Some(next) => waiting.push((next, candidate.record())),
                None => self.counts.unconnected += 1,
            }
        }
        waiting.sort_unstable();
        for part in waiting.chunk_by(|a, b| a.0 == b.0) {
            let records: Vec<_> = part.iter().map(|(_, record)| *record).collect();
            self.waiting.send(part[0].0, &records)?;
        }
        let last = &self.lives.last;
        self.context
            .end(|block| last[block as usize] > group as u32)?;
        Ok(true)
    }

    /// Ends the pass once all turns were taken.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Corrupt`].
    pub fn finish(self) -> Result<(Crossing, InsertStats)> {
        let (blocks, workspace) = (self.context.blocks, self.context.workspace);
        // The crossing triangles of the base belong to the mesh as well.
        let base = &self.context.base.surface;
        for block in 0..blocks.count() {
            let records = base.crossing.get(block)?;
            let records: Vec<_> = records.iter().map(|r| [r[0], r[1], r[2], r[3]]).collect();
            self.added.send(&records)?;
        }
        let crossing = Crossing {
            added: self.added.deliver(workspace, blocks.count())?,
            removed: self.removed.deliver(workspace, blocks.count())?,
        };
        Ok((crossing, self.counts))
    }
}

/// When the surroundings of each block are needed: from the first to the last group that has a
/// candidate at one of its vertices.
struct Lives {
    /// The blocks that a group is the first to need.
    begin: Vec<Vec<u32>>,
    /// The last group that needs a block.
    last: Vec<u32>,
}

impl Lives {
    fn of(spans: &[(u32, u32)]) -> Self {
        let mut lives = Self {
            begin: vec![Vec::new(); spans.len()],
            last: spans.iter().map(|span| span.1).collect(),
        };
        for (block, &(first, _)) in spans.iter().enumerate() {
            lives.begin[first as usize].push(block as u32);
        }
        lives
    }
}

#[cfg(test)]
mod tests;
