//! T12 insertion across blocks (paper, section 3.5, second part): block by block in ascending
//! order, with only the surroundings of borders that are still needed in memory.

use super::InsertStats;
use super::base::Base;
use super::context::Context;
use super::interior::Interior;
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
    pending: Vec<Candidate>,
    counts: InsertStats,
    /// The block whose turn is next, and how many of those it needs first are loaded.
    group: usize,
    loaded: usize,
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
            pending: Vec::new(),
            counts: InsertStats::default(),
            group: 0,
            loaded: 0,
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

    /// Takes all turns for which the blocks that are `ready` suffice. Within `most` bytes for what
    /// is loaded, or as many as there are if it is `None`; otherwise it waits to be called again.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Corrupt`], [`crate::Error::Memory`],
    /// [`crate::Error::Cancelled`].
    pub fn advance(&mut self, ready: impl Fn(u32) -> bool, most: Option<u64>) -> Result<()> {
        while self.group < self.lives.begin.len() {
            self.context.workspace.check_cancel()?;
            let needed = &self.lives.begin[self.group];
            while let Some(&block) = needed.get(self.loaded) {
                if !ready(block) || !self.context.load(block, most)? {
                    return Ok(());
                }
                self.loaded += 1;
            }
            self.turn(self.group)?;
            self.group += 1;
            self.loaded = 0;
            self.context.workspace.observer.advance(1);
        }
        Ok(())
    }

    /// The turn of a block.
    fn turn(&mut self, group: usize) -> Result<()> {
        let blocks = self.context.blocks;
        let gone = self.context.joints(group)?;
        self.counts.joints_removed += gone.len() as u64;
        self.removed.send(&gone)?;
        let here = |c: &Candidate| c.ids.iter().any(|v| blocks.of(*v) == group as u32);
        let (mut tried, mut waiting): (Vec<_>, Vec<_>) = std::mem::take(&mut self.pending)
            .into_iter()
            .partition(here);
        tried.iter_mut().for_each(|c| c.tried = 0);
        let ranked = self.context.interior.ranked.get(group)?;
        tried.extend(ranked.into_iter().map(Candidate::from_record));
        // Ascending runs: this sort merges them.
        tried.sort();
        let (angle, counts) = (self.cos_max_angle, &mut self.counts);
        let new = self.context.rounds(&mut tried, angle, counts);
        self.added.send(&new)?;
        // What has no vertex in a later block will not be tried again.
        for candidate in tried {
            if blocks.of(candidate.ids[2]) > group as u32 {
                waiting.push(candidate);
            } else {
                self.counts.unconnected += 1;
            }
        }
        self.pending = waiting;
        for &block in &self.lives.end[group] {
            self.context.unload(block);
        }
        Ok(())
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
    begin: Vec<Vec<u32>>,
    end: Vec<Vec<u32>>,
}

impl Lives {
    fn of(spans: &[(u32, u32)]) -> Self {
        let mut lives = Self {
            begin: vec![Vec::new(); spans.len()],
            end: vec![Vec::new(); spans.len()],
        };
        for (block, &(first, last)) in spans.iter().enumerate() {
            lives.begin[first as usize].push(block as u32);
            lives.end[last as usize].push(block as u32);
        }
        lives
    }
}
