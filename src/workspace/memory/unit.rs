//! What the unit of work on this thread holds.

use super::{MemoryPool, Reservation};
use std::cell::{Cell, RefCell};
use std::collections::HashMap;

/// Changes below this are told later.
const STEP: u64 = 64 << 10;

thread_local! {
    static NOW: Cell<u64> = const { Cell::new(0) };
    static MOST: Cell<u64> = const { Cell::new(0) };
    /// What the pool knows of it; `None` if it is told only when the unit has ended.
    static TOLD: Cell<Option<u64>> = const { Cell::new(None) };
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
        MOST.set(MOST.get().max(now));
        change(now);
    }
}

impl Drop for Holding {
    fn drop(&mut self) {
        change(NOW.get().saturating_sub(self.0));
    }
}

/// Now the unit on this thread holds so much.
fn change(now: u64) {
    NOW.set(now);
    if TOLD.get().is_some_and(|told| told.abs_diff(now) >= STEP) {
        TOLD.set(Some(now));
        RESERVED.with_borrow_mut(|reserved| {
            if let Some(reserved) = reserved {
                reserved.set_held(now);
            }
        });
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
        TOLD.set(reserved.pool.is_tight().then_some(0));
        RESERVED.set(Some(reserved));
        Self
    }

    /// What it held at most; all that it reserved, if it said nothing.
    fn most(&self) -> u64 {
        match MOST.get() {
            0 => RESERVED.with_borrow(|reserved| reserved.as_ref().map_or(0, Reservation::bytes)),
            most => most,
        }
    }
}

impl Drop for Unit {
    fn drop(&mut self) {
        TOLD.set(None);
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

    /// A unit has ended.
    pub(in crate::workspace) fn ended(&mut self, unit: Unit) {
        let (most, said) = (unit.most(), MOST.get() > 0);
        drop(unit);
        let mut state = self.pool.state();
        if !self.used {
            self.used = true;
            state.threads.0 += 1;
            // A thread that has worked keeps that as long as it lives.
            if state.threads.0 > state.threads.1 {
                state.threads.1 += 1;
                state.held.add("threads", self.pool.thread());
            }
        }
        if self.pool.is_tight() {
            // The pool was told, if there was anything to tell.
            let silent = if said { 0 } else { most };
            state.held.add(self.name, silent);
            state.held.take(self.name, silent);
            return;
        }
        let more = most.saturating_sub(self.most);
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
