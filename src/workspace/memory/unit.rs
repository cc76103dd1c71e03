//! The memory that the unit of work on this thread holds.

use super::{MemoryPool, Reservation};
use std::cell::{Cell, RefCell};
use std::collections::HashMap;

/// Smaller changes are not reported at once.
const STEP: u64 = 64 << 10;

thread_local! {
    static NOW: Cell<u64> = const { Cell::new(0) };
    static MOST: Cell<u64> = const { Cell::new(0) };
    /// The usage last reported to the pool; `None` if it is reported only when the unit ends.
    static TOLD: Cell<Option<u64>> = const { Cell::new(None) };
    static RESERVED: RefCell<Option<Reservation>> = const { RefCell::new(None) };
}

/// Bytes that the unit on this thread holds until this value is dropped, on the same thread.
#[derive(Debug, Default)]
pub struct Holding(u64);

impl Holding {
    /// Changes the number of bytes.
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

/// Sets the number of bytes that the unit on this thread holds.
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

/// Reports that the unit on this thread holds `bytes` as long as the result lives.
pub fn hold(bytes: u64) -> Holding {
    let mut holding = Holding::default();
    holding.set(bytes);
    holding
}

/// Bytes of a list's capacity.
pub fn bytes_of<T>(list: &Vec<T>) -> u64 {
    (list.capacity() * size_of::<T>()) as u64
}

/// Bytes of a hash table's capacity.
pub fn table_bytes<K, V, S>(table: &HashMap<K, V, S>) -> u64 {
    // At most seven eighths of the places are in use; each place has a byte of control data.
    (table.capacity().div_ceil(7) * 8 * (size_of::<(K, V)>() + 1)) as u64
}

/// Reduces the reservation of the unit on this thread by `bytes`, once its sizes are known.
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
    /// Begins a unit with the reservation `reserved`.
    pub(in crate::workspace) fn begin(reserved: Reservation) -> Self {
        NOW.set(0);
        MOST.set(0);
        TOLD.set(reserved.pool.is_tight().then_some(0));
        RESERVED.set(Some(reserved));
        Self
    }

    /// Largest usage of the unit; its whole reservation if it reported none.
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

/// A thread that does one unit after another.
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

    /// Notes the end of a unit.
    pub(in crate::workspace) fn ended(&mut self, unit: Unit) {
        let (most, said) = (unit.most(), MOST.get() > 0);
        drop(unit);
        let mut state = self.pool.state();
        if !self.used {
            self.used = true;
            state.threads.0 += 1;
            // A thread that has worked keeps its own memory as long as it lives.
            if state.threads.0 > state.threads.1 {
                state.threads.1 += 1;
                state.held.add("threads", self.pool.thread());
            }
        }
        if self.pool.is_tight() {
            // Usage that the unit reported is in the pool already.
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
