//! Vertex positions: all in memory, or those of one range.

use super::plan::Plan;
use crate::error::Result;
use crate::spill::LocalTable;
use crate::workspace::Workspace;

/// Positions of the vertices.
#[derive(Debug)]
pub(super) struct Positions {
    first: u32,
    window: Vec<[f64; 3]>,
    /// One section for each range, unless all positions stay in memory.
    stored: Option<LocalTable<[f64; 3]>>,
    length: usize,
}

impl Positions {
    pub(super) fn new(workspace: &Workspace, plan: &Plan) -> Result<Self> {
        let length = plan.held_positions();
        let stored =
            (!plan.all_positions).then(|| LocalTable::create(workspace, "verify.positions"));
        Ok(Self {
            first: 0,
            window: Vec::with_capacity(length),
            stored: stored.transpose()?,
            length,
        })
    }

    /// Adds the positions of the next vertices.
    pub(super) fn append(&mut self, mut positions: &[[f64; 3]]) -> Result<()> {
        while !positions.is_empty() {
            let room = self.length - self.window.len();
            let (now, later) = positions.split_at(room.min(positions.len()));
            self.window.extend_from_slice(now);
            positions = later;
            if self.window.len() == self.length {
                match self.stored {
                    Some(_) => self.store()?,
                    None => break,
                }
            }
        }
        Ok(())
    }

    fn store(&mut self) -> Result<()> {
        if let Some(stored) = &self.stored {
            stored.append(&self.window)?;
            self.window.clear();
        }
        Ok(())
    }

    /// Ends input.
    pub(super) fn finish(&mut self) -> Result<()> {
        if self.window.is_empty() {
            Ok(())
        } else {
            self.store()
        }
    }

    /// Loads a range into memory.
    pub(super) fn load(&mut self, k: usize, first: u32) -> Result<()> {
        if let Some(stored) = &self.stored {
            stored.get_into(k, &mut self.window)?;
            self.first = first;
        }
        Ok(())
    }

    /// The position of a vertex, if it is in memory.
    pub(super) fn get(&self, vertex: u32) -> Option<[f64; 3]> {
        let at = vertex.wrapping_sub(self.first) as usize;
        self.window.get(at).copied()
    }
}
