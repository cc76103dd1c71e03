//! The triangles around those vertices of a block at which something may be inserted.

use crate::stages::surface::star::{Triangle, others};
use crate::workspace::memory::{Holding, bytes_of, hold};
use std::ops::Range;

/// For each active vertex its triangles; what the tests look at lies together.
#[derive(Debug)]
pub struct Fans {
    first: u32,
    slots: Vec<Slot>,
    /// The other two vertices of a triangle, ascending.
    others: Vec<[u32; 2]>,
    /// The number of the same triangle.
    numbers: Vec<u32>,
    _held: Holding,
}

/// A vertex.
#[derive(Debug, Clone, Copy, Default)]
struct Slot {
    start: u32,
    used: u32,
    end: u32,
    /// The time of the last insertion.
    changed: u32,
}

impl Fans {
    /// No triangles yet, with room for all of `triangles` at those vertices that are `active`.
    pub fn with_room(
        ids: Range<u32>,
        active: &[bool],
        triangles: impl Iterator<Item = Triangle>,
    ) -> Self {
        let mut slots = vec![Slot::default(); ids.len()];
        for t in triangles {
            for v in t {
                if ids.contains(&v) {
                    let v = (v - ids.start) as usize;
                    slots[v].end += u32::from(active[v]);
                }
            }
        }
        let mut room_for = 0;
        for slot in &mut slots {
            slot.start = room_for;
            slot.used = room_for;
            room_for += slot.end;
            slot.end = room_for;
        }
        Self {
            first: ids.start,
            _held: hold(bytes_of(&slots) + u64::from(room_for) * 12),
            slots,
            others: vec![[0; 2]; room_for as usize],
            numbers: vec![0; room_for as usize],
        }
    }

    /// Puts in triangle `t` as `number` at the time `now`; room must have been left.
    pub fn add(&mut self, t: Triangle, number: u32, now: u32) {
        for v in t {
            let Some(slot) = self.slots.get_mut(v.wrapping_sub(self.first) as usize) else {
                continue;
            };
            if slot.used < slot.end {
                self.others[slot.used as usize] = others(t, v);
                self.numbers[slot.used as usize] = number;
                slot.used += 1;
                slot.changed = now;
            }
        }
    }

    /// When the last triangle was put in at a vertex of the block.
    pub fn changed(&self, v: u32) -> u32 {
        self.slots[(v - self.first) as usize].changed
    }

    /// How many triangles there are at an active vertex.
    pub fn count(&self, v: u32) -> usize {
        let slot = self.slots[(v - self.first) as usize];
        (slot.used - slot.start) as usize
    }

    /// Triangles at an active vertex, in order of insertion: numbers and other two vertices.
    pub fn at(&self, v: u32) -> impl Iterator<Item = (u32, [u32; 2])> + '_ {
        let slot = self.slots[(v - self.first) as usize];
        let range = slot.start as usize..slot.used as usize;
        let numbers = &self.numbers[range.clone()];
        let others = self.others[range].iter().copied();
        others.enumerate().map(|(at, other)| (numbers[at], other))
    }
}
