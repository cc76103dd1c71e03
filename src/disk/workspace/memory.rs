//! The memory budget: one pool, named reservations.
//!
//! Two figures are kept. A *reservation* is an upper bound of the memory that its holder may take.
//! Reservations gate admission. The memory *held* is the usage, which is reported. A unit of work reports the
//! size of its large buffers with [`Unit::hold`](super::Unit::hold), a sorter as its buffer grows; other
//! reservations count as held in full. The largest usage of a unit counts for its thread until the loop over the units ends, since the
//! allocator keeps that memory for the next unit.

mod usage;

pub use usage::{Holding, bytes_of, table_bytes};
pub(super) use usage::{Slot, Usage};

use super::lock;
use crate::error::{Error, Result};
use outcrop_platform::process::{CAN_TRIM, trim};
use std::collections::BTreeMap;
use std::sync::{Arc, Condvar, Mutex};

/// Smallest budget a run accepts, in bytes.
pub const MINIMUM_BUDGET: u64 = 192 << 20;

/// Part of the budget for the program itself before any work: code, tables, stacks.
pub const PROGRAM: u64 = 13 << 20;

/// Bytes that a thread which has worked holds beside its units: its stack, small lists, and the free pieces
/// that the allocator keeps for it between larger ones. Paid from [`SLACK`].
const THREAD: u64 = 9 << 18;

/// The same if memory is tight.
const TIGHT_THREAD: u64 = 7 << 18;

/// Below this budget memory is tight: freed memory is returned to the system, which takes some per cent of
/// the time.
const TIGHT: u64 = 512 << 20;

/// Part of the budget for memory that is not reserved by name: small buffers, allocator slack.
pub const SLACK: u64 = 35 << 20;

/// Part of the budget that no stage can reserve.
pub const OVERHEAD: u64 = PROGRAM + SLACK;

#[derive(Debug)]
struct State {
    used: u64,
    peak: u64,
    holders: BTreeMap<&'static str, u64>,
    /// Reservations at the peak, by name.
    at_peak: BTreeMap<&'static str, u64>,
    held: Ledger,
    /// Threads that do units now, and their largest number at one time.
    threads: (u64, u64),
}

/// Memory held, by name.
#[derive(Debug, Default)]
struct Ledger {
    now: BTreeMap<&'static str, u64>,
    sum: u64,
    peak: u64,
    at_peak: BTreeMap<&'static str, u64>,
    /// The peak since the last [`MemoryPool::take_held`].
    lately: u64,
}

impl Ledger {
    fn add(&mut self, name: &'static str, bytes: u64) {
        if bytes == 0 {
            return;
        }
        self.sum += bytes;
        *self.now.entry(name).or_insert(0) += bytes;
        self.lately = self.lately.max(self.sum);
        if self.sum > self.peak {
            self.peak = self.sum;
            self.at_peak.clone_from(&self.now);
        }
    }

    fn take(&mut self, name: &'static str, bytes: u64) {
        self.sum -= bytes;
        take(&mut self.now, name, bytes);
    }
}

fn take(all: &mut BTreeMap<&'static str, u64>, name: &'static str, bytes: u64) {
    if let Some(now) = all.get_mut(name) {
        *now -= bytes;
        if *now == 0 {
            all.remove(name);
        }
    }
}

#[derive(Debug)]
struct Shared {
    budget: u64,
    capacity: u64,
    state: Mutex<State>,
    freed: Condvar,
}

/// A pool of bytes. Every large buffer is reserved from it by name.
#[derive(Debug, Clone)]
pub struct MemoryPool(Arc<Shared>);

impl MemoryPool {
    /// A pool for a process with a budget of `budget` bytes.
    ///
    /// # Errors
    /// [`Error::Memory`] if the budget is below [`MINIMUM_BUDGET`].
    pub fn new(budget: u64) -> Result<Self> {
        if budget < MINIMUM_BUDGET {
            return Err(Error::Memory {
                what: "the program itself".into(),
                needed: MINIMUM_BUDGET,
                budget,
            });
        }
        let mut held = Ledger::default();
        held.add("program", PROGRAM);
        Ok(Self(Arc::new(Shared {
            budget,
            capacity: budget - SLACK,
            state: Mutex::new(State {
                used: PROGRAM,
                peak: PROGRAM,
                holders: BTreeMap::from([("program", PROGRAM)]),
                at_peak: BTreeMap::from([("program", PROGRAM)]),
                held,
                threads: (0, 0),
            }),
            freed: Condvar::new(),
        })))
    }

    /// The whole budget in bytes.
    #[must_use]
    pub fn budget(&self) -> u64 {
        self.0.budget
    }

    /// Bytes that can be reserved when nothing else is reserved.
    #[must_use]
    pub fn capacity(&self) -> u64 {
        self.0.capacity - PROGRAM
    }

    /// Bytes not reserved now.
    #[must_use]
    pub fn available(&self) -> u64 {
        self.0.capacity - self.state().used
    }

    /// Peak of the reserved bytes, with those of the program.
    #[must_use]
    pub fn peak(&self) -> u64 {
        self.state().peak
    }

    /// The reservations at that peak, by name.
    #[must_use]
    pub fn at_peak(&self) -> BTreeMap<&'static str, u64> {
        self.state().at_peak.clone()
    }

    /// Peak of the held bytes, with those of the program.
    #[must_use]
    pub fn peak_held(&self) -> u64 {
        self.state().held.peak
    }

    /// The memory held at that peak, by name.
    #[must_use]
    pub fn held_at_peak(&self) -> BTreeMap<&'static str, u64> {
        self.state().held.at_peak.clone()
    }

    /// Peak of the held bytes since the last call.
    #[must_use]
    pub fn take_held(&self) -> u64 {
        let held = &mut self.state().held;
        std::mem::replace(&mut held.lately, held.sum)
    }

    /// Returns freed memory that the allocator keeps, mainly for `threads`, to the system if memory is tight.
    /// For the time between stages, when none of the threads is at work.
    pub fn trim(&self, threads: &rayon::ThreadPool) {
        if self.is_tight() {
            trim(|work| drop(threads.broadcast(|_| work())));
        }
    }

    /// True if the budget is so small that freed memory is returned to the system. Then the present usage
    /// counts; otherwise a thread keeps the largest usage of its units.
    fn is_tight(&self) -> bool {
        CAN_TRIM && self.0.budget < TIGHT
    }

    fn thread(&self) -> u64 {
        if self.is_tight() {
            TIGHT_THREAD
        } else {
            THREAD
        }
    }

    fn state(&self) -> std::sync::MutexGuard<'_, State> {
        lock(&self.0.state)
    }

    /// Reserves `bytes` under `name`; the error has a budget that would suffice.
    ///
    /// # Errors
    /// [`Error::Memory`], naming the current holders.
    pub fn reserve(&self, name: &'static str, bytes: u64) -> Result<Reservation> {
        let mut reservation = self.promise(name, bytes)?;
        self.state().held.add(name, bytes);
        reservation.held = bytes;
        Ok(reservation)
    }

    /// Reserves `bytes` under `name` for as long as the pool is used; only the first call counts.
    ///
    /// # Errors
    /// As [`MemoryPool::reserve`].
    pub fn keep(&self, name: &'static str, bytes: u64) -> Result<()> {
        if self.state().holders.contains_key(name) {
            return Ok(());
        }
        let mut kept = self.reserve(name, bytes)?;
        // Nothing is left to give back.
        (kept.bytes, kept.held) = (0, 0);
        Ok(())
    }

    /// Reserves `bytes` that are not in use yet.
    ///
    /// # Errors
    /// As [`MemoryPool::reserve`].
    pub fn promise(&self, name: &'static str, bytes: u64) -> Result<Reservation> {
        let mut state = self.state();
        if state.used.saturating_add(bytes) > self.0.capacity {
            let held: Vec<String> = state
                .holders
                .iter()
                .filter(|(name, _)| **name != "program")
                .map(|(n, b)| format!("{n}: {b}"))
                .collect();
            return Err(Error::Memory {
                what: if held.is_empty() {
                    name.to_owned()
                } else {
                    format!("{name} (beside {})", held.join(", "))
                },
                needed: (state.used + SLACK).saturating_add(bytes),
                budget: self.0.budget,
            });
        }
        Self::grant(&mut state, name, bytes);
        drop(state);
        Ok(Reservation {
            pool: self.clone(),
            name,
            bytes,
            held: 0,
        })
    }

    /// Like [`MemoryPool::promise`], but waits while other reservations of the same name exist.
    ///
    /// # Errors
    /// [`Error::Memory`] if it does not fit although there is no other reservation of `name`.
    pub fn promise_waiting(&self, name: &'static str, bytes: u64) -> Result<Reservation> {
        let mut state = self.state();
        while state.used.saturating_add(bytes) > self.0.capacity && state.holders.contains_key(name)
        {
            state = self
                .0
                .freed
                .wait(state)
                .unwrap_or_else(std::sync::PoisonError::into_inner);
        }
        drop(state);
        // Another thread can take the freed bytes first only under the same name.
        match self.promise(name, bytes) {
            Err(_) if self.state().holders.contains_key(name) => self.promise_waiting(name, bytes),
            other => other,
        }
    }

    fn grant(state: &mut State, name: &'static str, bytes: u64) {
        state.used += bytes;
        *state.holders.entry(name).or_insert(0) += bytes;
        if state.used > state.peak {
            state.peak = state.used;
            state.at_peak.clone_from(&state.holders);
        }
    }
}

/// Bytes reserved out of a [`MemoryPool`]; dropping it gives them back.
#[derive(Debug)]
pub struct Reservation {
    pool: MemoryPool,
    name: &'static str,
    bytes: u64,
    held: u64,
}

impl Reservation {
    /// Bytes reserved.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Reports the usage of the reservation in bytes.
    pub fn set_held(&mut self, bytes: u64) {
        let mut state = self.pool.state();
        state.held.add(self.name, bytes.saturating_sub(self.held));
        state.held.take(self.name, self.held.saturating_sub(bytes));
        self.held = bytes;
    }

    /// Raises the reservation to `bytes`, if it is smaller.
    ///
    /// # Errors
    /// [`Error::Memory`]; the reservation is then unchanged.
    pub fn at_least(&mut self, bytes: u64) -> Result<()> {
        if bytes > self.bytes {
            let mut more = self.pool.promise(self.name, bytes - self.bytes)?;
            self.bytes += std::mem::take(&mut more.bytes);
        }
        Ok(())
    }

    /// Reduces the reservation by `bytes`.
    pub fn give_back(&mut self, bytes: u64) {
        let bytes = bytes.min(self.bytes);
        let mut state = self.pool.state();
        state.used -= bytes;
        take(&mut state.holders, self.name, bytes);
        self.bytes -= bytes;
        // One byte stays reserved, so that threads waiting for reservations of this name still find a holder.
        if self.bytes == 0 && bytes > 0 {
            state.used += 1;
            *state.holders.entry(self.name).or_insert(0) += 1;
            self.bytes = 1;
        }
        drop(state);
        self.pool.0.freed.notify_all();
    }
}

impl Drop for Reservation {
    fn drop(&mut self) {
        let mut state = self.pool.state();
        state.used -= self.bytes;
        take(&mut state.holders, self.name, self.bytes);
        state.held.take(self.name, self.held);
        drop(state);
        self.pool.0.freed.notify_all();
    }
}

#[cfg(test)]
mod tests;
