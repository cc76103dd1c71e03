//! Vertex positions: all of them in memory, or those of one range.

use super::plan::Plan;
use crate::error::Result;
use crate::spill::Sections;
use crate::workspace::Workspace;

/// Three `f64` as words.
type Words = [u32; 6];

/// Positions of the vertices.
#[derive(Debug)]
pub(super) struct Positions {
    first: u32,
    window: Vec<Words>,
    /// One section a range, unless all positions stay in memory.
    stored: Option<Sections<6>>,
    length: usize,
    next: usize,
}

impl Positions {
    pub(super) fn new(workspace: &Workspace, plan: &Plan) -> Result<Self> {
        let length = match plan.all_positions {
            true => plan.vertices as usize,
            false => plan.range_length().min(plan.vertices as usize),
        };
        let stored = match plan.all_positions {
            true => None,
            false => Some(Sections::unpacked(
                workspace,
                "verify.positions",
                plan.ranges,
            )?),
        };
        let mut window = Vec::new();
        window.reserve_exact(length);
        Ok(Self {
            first: 0,
            window,
            stored,
            length,
            next: 0,
        })
    }

    /// Takes in the next vertices.
    pub(super) fn append(&mut self, mut positions: &[[f64; 3]]) -> Result<()> {
        while !positions.is_empty() {
            let room = self.length - self.window.len();
            let (now, later) = positions.split_at(room.min(positions.len()));
            self.window
                .extend(now.iter().map(|p| bytemuck::cast::<[f64; 3], Words>(*p)));
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
            stored.put(self.next, &self.window)?;
            self.next += 1;
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

    /// Brings a range into memory.
    pub(super) fn load(&mut self, k: usize, first: u32) -> Result<()> {
        if let Some(stored) = &self.stored {
            stored.get_into(k, &mut self.window)?;
            self.first = first;
        }
        Ok(())
    }

    /// The position of a vertex, if it is in memory.
    pub(super) fn get(&self, vertex: u32) -> Option<[f64; 3]> {
        let words = self.window.get(vertex.wrapping_sub(self.first) as usize)?;
        Some(bytemuck::cast(*words))
    }
}
