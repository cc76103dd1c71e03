//! Vertex positions: all in memory, or those of one range.

use super::buckets::Buckets;
use super::plan::Plan;
use outcrop_disk::error::Result;
use outcrop_disk::spill::{LocalTable, row};
use outcrop_disk::workspace::Workspace;

row! {
    /// The position of a vertex.
    struct Placed {
        /// The vertex.
        vertex: u64,
        /// Its position.
        at: [f64; 3],
    }
    unpacked
}

/// Positions of the vertices.
#[derive(Debug)]
pub(super) struct Positions {
    first: u32,
    window: Vec<[f64; 3]>,
    /// One section for each range, unless all positions stay in memory.
    stored: Option<LocalTable<[f64; 3]>>,
    /// Positions of single vertices instead, in the buckets of their ranges.
    some: Option<Buckets<Placed>>,
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
            some: None,
            length,
        })
    }

    /// Positions of single vertices, each added by [`Positions::put`].
    pub(super) fn of_some(workspace: &Workspace, plan: &Plan) -> Result<Self> {
        let (ranges, block) = (plan.ranges, plan.blocks[3]);
        let some = Buckets::new(workspace, "verify.places", ranges, block)?;
        let length = plan.range_length().min(plan.vertices as usize);
        Ok(Self {
            first: 0,
            window: vec![[0.0; 3]; length],
            stored: None,
            some: Some(some),
            length,
        })
    }

    /// Adds the position of a vertex of range `k`.
    pub(super) fn put(&mut self, k: usize, vertex: u32, at: [f64; 3]) -> Result<()> {
        let vertex = vertex.into();
        let some = self.some.as_mut();
        some.map_or(Ok(()), |some| some.push(k, Placed { vertex, at }))
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
        if let Some(some) = &mut self.some {
            self.first = first;
            let mut cursor = some.cursor(k);
            while let Some(block) = some.next(&mut cursor)? {
                for row in block {
                    let at = row.vertex.wrapping_sub(first.into()) as usize;
                    if let Some(place) = self.window.get_mut(at) {
                        *place = row.at;
                    }
                }
            }
            some.clear(k);
        }
        Ok(())
    }

    /// The position of a vertex, if it is in memory.
    pub(super) fn get(&self, vertex: u32) -> Option<[f64; 3]> {
        let at = vertex.wrapping_sub(self.first) as usize;
        self.window.get(at).copied()
    }
}
