//! What the unit of work on this thread holds.

use super::{MemoryPool, Reservation, THREAD};
use std::cell::{Cell, RefCell};
use std::collections::HashMap;

thread_local! {
    static NOW: Cell<u64> = const { Cell::new(0) };
    static MOST: Cell<u64> = const { Cell::new(0) };
    static RESERVED: RefCell<Option<Reservation>> = const { RefCell::new(None) };
}

/// Bytes that the unit on this thread holds until this is dropped, on the same thread.
#[derive(Debug, Default)]
pub struct Holding(u64);

impl Holding {
    /// Now it is so many bytes.
    pub fn set(&mut self, bytes: u64) {
        let now = NOW.get().saturating_sub(self.0).saturating_add(bytes);
        self.0 = bytes;
        NOW.set(now);
        MOST.set(MOST.get().max(now));
    }
}

impl Drop for Holding {
    fn drop(&mut self) {
        NOW.set(NOW.get().saturating_sub(self.0));
    }
}

/// Says that the unit on this thread holds `bytes` as long as the result lives.
pub fn hold(bytes: u64) -> Holding {
    let mut holding = Holding::default();
    holding.set(bytes);
    holding
}

/// Bytes that a list has room for.
pub fn bytes_of<T>(list: &Vec<T>) -> u64 {
    (list.capacity() * size_of::<T>()) as u64
}

/// Bytes that a table has room for.
pub fn table_bytes<K, V, S>(table: &HashMap<K, V, S>) -> u64 {
    // Seven eighths of the places may be taken; each has a byte beside it.
    (table.capacity().div_ceil(7) * 8 * (size_of::<(K, V)>() + 1)) as u64
}

/// Gives back part of what the unit on this thread has reserved: its sizes are known, and it will not
/// take that.
pub fn give_back(bytes: u64) {
    RESERVED.with_borrow_mut(|reserved| {
        if let Some(reserved) = reserved {
            reserved.give_back(bytes);
        }
    });
}

/// A unit at work on this thread.
pub(in crate::workspace) struct Unit;

impl Unit {
    /// Begins a unit that has `reserved` so much.
    pub(in crate::workspace) fn begin(reserved: Reservation) -> Self {
        NOW.set(0);
        MOST.set(0);
        RESERVED.set(Some(reserved));
        Self
    }

    /// What it held at most, if it said anything.
    pub(in crate::workspace) fn most(&self) -> Option<u64> {
        Some(MOST.get()).filter(|most| *most > 0)
    }
}

impl Drop for Unit {
    fn drop(&mut self) {
        RESERVED.set(None);
    }
}

/// A thread that does one unit after the other.
pub(in crate::workspace) struct Slot {
    pool: MemoryPool,
    name: &'static str,
    most: u64,
    used: bool,
}

impl Slot {
    pub(in crate::workspace) fn new(pool: &MemoryPool, name: &'static str) -> Self {
        Self {
            pool: pool.clone(),
            name,
            most: 0,
            used: false,
        }
    }

    /// A unit has ended that held so much.
    pub(in crate::workspace) fn ended(&mut self, bytes: u64) {
        let more = bytes.saturating_sub(self.most);
        let mut state = self.pool.state();
        if !self.used {
            self.used = true;
            state.threads.0 += 1;
            // A thread that has worked keeps that until memory is trimmed.
            if state.threads.0 > state.threads.1 {
                state.threads.1 += 1;
                state.held.add("threads", THREAD);
            }
        }
        state.held.add(self.name, more);
        self.most += more;
    }
}

impl Drop for Slot {
    fn drop(&mut self) {
        let mut state = self.pool.state();
        state.held.take(self.name, self.most);
        state.threads.0 -= u64::from(self.used);
    }
}
