//! The memory that a unit of work holds.

use super::{MemoryPool, Reservation};
use std::cell::{Cell, RefCell};
use std::collections::HashMap;

/// Smaller changes are not reported at once.
const STEP: u64 = 64 << 10;

impl MemoryPool {
    /// Bytes held now, with those of the program.
    #[must_use]
    pub fn held(&self) -> u64 {
        self.state().held.sum
    }
}

/// The reservation of a unit of work and what it holds of it.
#[derive(Debug, Default)]
pub(in crate::workspace) struct Usage {
    now: Cell<u64>,
    most: Cell<u64>,
    /// The usage last reported to the pool; `None` if it is reported only when the unit ends.
    told: Cell<Option<u64>>,
    reserved: RefCell<Option<Reservation>>,
}

impl Usage {
    /// The usage of a unit with the reservation `reserved`.
    pub(in crate::workspace) fn of(reserved: Reservation) -> Self {
        Self {
            told: Cell::new(reserved.pool.is_tight().then_some(0)),
            reserved: RefCell::new(Some(reserved)),
            ..Self::default()
        }
    }

    /// Sets the number of bytes held.
    fn change(&self, now: u64) {
        self.now.set(now);
        self.most.set(self.most.get().max(now));
        if self
            .told
            .get()
            .is_some_and(|told| told.abs_diff(now) >= STEP)
        {
            self.told.set(Some(now));
            if let Some(reserved) = &mut *self.reserved.borrow_mut() {
                reserved.set_held(now);
            }
        }
    }

    /// Holds `bytes` as long as the result lives.
    pub(in crate::workspace) fn hold(&self, bytes: u64) -> Holding<'_> {
        let mut holding = Holding {
            usage: self,
            bytes: 0,
        };
        holding.set(bytes);
        holding
    }

    /// Reduces the reservation by `bytes`.
    pub(in crate::workspace) fn give_back(&self, bytes: u64) {
        if let Some(reserved) = &mut *self.reserved.borrow_mut() {
            reserved.give_back(bytes);
        }
    }

    /// Largest usage; the whole reservation if none was reported.
    fn most(&self) -> u64 {
        match self.most.get() {
            0 => self
                .reserved
                .borrow()
                .as_ref()
                .map_or(0, Reservation::bytes),
            most => most,
        }
    }
}

/// Bytes that a unit of work holds until this value is dropped.
#[derive(Debug)]
pub struct Holding<'u> {
    usage: &'u Usage,
    bytes: u64,
}

impl Holding<'_> {
    /// Changes the number of bytes.
    pub fn set(&mut self, bytes: u64) {
        let others = self.usage.now.get().saturating_sub(self.bytes);
        self.bytes = bytes;
        self.usage.change(others.saturating_add(bytes));
    }
}

impl Drop for Holding<'_> {
    fn drop(&mut self) {
        let others = self.usage.now.get().saturating_sub(self.bytes);
        self.usage.change(others);
    }
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
    pub(in crate::workspace) fn ended(&mut self, usage: Usage) {
        let (most, said) = (usage.most(), usage.most.get() > 0);
        drop(usage);
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
