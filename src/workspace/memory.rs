//! The memory budget: one pool, named reservations.

use crate::error::{Error, Result};
use std::collections::BTreeMap;
use std::sync::{Arc, Condvar, Mutex};

/// Smallest budget a run accepts, in bytes.
pub const MINIMUM_BUDGET: u64 = 192 << 20;

/// Part of the budget that the program takes before it has anything to do: code, tables, stacks.
pub const PROGRAM: u64 = 8 << 20;

/// Part of the budget kept for what is not reserved by name: small buffers, allocator slack.
pub const SLACK: u64 = 40 << 20;

/// Part of the budget that no stage can reserve.
pub const OVERHEAD: u64 = PROGRAM + SLACK;

#[derive(Debug)]
struct State {
    used: u64,
    peak: u64,
    holders: BTreeMap<&'static str, u64>,
    /// Who held what at the peak.
    at_peak: BTreeMap<&'static str, u64>,
}

#[derive(Debug)]
struct Shared {
    budget: u64,
    capacity: u64,
    state: Mutex<State>,
    freed: Condvar,
}

/// A pool of bytes out of which every large buffer is reserved by name.
#[derive(Debug, Clone)]
pub struct MemoryPool(Arc<Shared>);

impl MemoryPool {
    /// A pool for a process that may use `budget` bytes in all.
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
        Ok(Self(Arc::new(Shared {
            budget,
            capacity: budget - SLACK,
            state: Mutex::new(State {
                used: PROGRAM,
                peak: PROGRAM,
                holders: BTreeMap::from([("program", PROGRAM)]),
                at_peak: BTreeMap::from([("program", PROGRAM)]),
            }),
            freed: Condvar::new(),
        })))
    }

    /// The whole budget in bytes, as the user gave it.
    #[must_use]
    pub fn budget(&self) -> u64 {
        self.0.budget
    }

    /// Bytes that can be reserved when nothing is held.
    #[must_use]
    pub fn capacity(&self) -> u64 {
        self.0.capacity - PROGRAM
    }

    /// Bytes not reserved now.
    #[must_use]
    pub fn available(&self) -> u64 {
        self.0.capacity - self.state().used
    }

    /// Largest number of bytes reserved at one time so far, the program's own among them.
    #[must_use]
    pub fn peak(&self) -> u64 {
        self.state().peak
    }

    /// What was reserved at the peak, by name.
    #[must_use]
    pub fn at_peak(&self) -> BTreeMap<&'static str, u64> {
        self.state().at_peak.clone()
    }

    fn state(&self) -> std::sync::MutexGuard<'_, State> {
        self.0
            .state
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    /// Reserves `bytes` under `name`, or fails with the budget that would have done.
    ///
    /// # Errors
    /// [`Error::Memory`], naming the current holders.
    pub fn reserve(&self, name: &'static str, bytes: u64) -> Result<Reservation> {
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
        })
    }

    /// Like [`MemoryPool::reserve`], but waits while others of the same name hold memory.
    ///
    /// # Errors
    /// [`Error::Memory`] if it does not fit although no other holder of `name` is left to wait for.
    pub fn reserve_waiting(&self, name: &'static str, bytes: u64) -> Result<Reservation> {
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
        // A race for the freed bytes can only be lost to a holder of the same name.
        match self.reserve(name, bytes) {
            Err(_) if self.state().holders.contains_key(name) => self.reserve_waiting(name, bytes),
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

/// Bytes held out of a [`MemoryPool`]; dropping it gives them back.
#[derive(Debug)]
pub struct Reservation {
    pool: MemoryPool,
    name: &'static str,
    bytes: u64,
}

impl Reservation {
    /// Bytes held.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.bytes
    }
}

impl Drop for Reservation {
    fn drop(&mut self) {
        let mut state = self.pool.state();
        state.used -= self.bytes;
        if let Some(held) = state.holders.get_mut(self.name) {
            *held -= self.bytes;
            if *held == 0 {
                state.holders.remove(self.name);
            }
        }
        drop(state);
        self.pool.0.freed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refuses_with_the_number_that_would_do() {
        let pool = MemoryPool::new(MINIMUM_BUDGET).unwrap();
        let held = pool.reserve("held", 1 << 20).unwrap();
        let error = pool.reserve("big", pool.capacity()).unwrap_err();
        match &error {
            Error::Memory { needed, .. } => assert_eq!(*needed, MINIMUM_BUDGET + (1 << 20)),
            other => panic!("{other}"),
        }
        assert!(error.to_string().contains("held: 1048576"), "{error}");
        drop(held);
        let all = pool.reserve("big", pool.capacity()).unwrap();
        assert_eq!(pool.available(), 0);
        drop(all);
        assert_eq!(pool.available(), pool.capacity());
    }

    /// Found by fuzzing: the sum was taken modulo 2^64, and so this was granted.
    #[test]
    fn refuses_what_has_no_sum_with_what_is_held() {
        let pool = MemoryPool::new(MINIMUM_BUDGET).unwrap();
        let _held = pool.reserve("held", 4096).unwrap();
        for bytes in [u64::MAX, u64::MAX - 100, u64::MAX - 4095] {
            let error = pool.reserve("huge", bytes).unwrap_err();
            assert!(
                matches!(
                    error,
                    Error::Memory {
                        needed: u64::MAX,
                        ..
                    }
                ),
                "{error}"
            );
            assert!(pool.reserve_waiting("huge", bytes).is_err());
        }
        assert_eq!(pool.peak(), PROGRAM + 4096);
    }

    #[test]
    fn refuses_a_budget_below_the_minimum() {
        assert!(matches!(
            MemoryPool::new(1 << 20),
            Err(Error::Memory { .. })
        ));
    }

    #[test]
    fn waits_for_its_own_kind() {
        let pool = MemoryPool::new(MINIMUM_BUDGET).unwrap();
        let most = pool.capacity() * 2 / 3;
        let peak = std::thread::scope(|scope| {
            for _ in 0..4 {
                let pool = pool.clone();
                scope.spawn(move || drop(pool.reserve_waiting("unit", most).unwrap()));
            }
            pool.peak()
        });
        assert!(peak <= pool.capacity());
        assert_eq!(pool.available(), pool.capacity());
    }
}
