//! Units of work on all threads; the memory budget limits the number of simultaneous units.

use super::memory::{Slot, Usage};
use super::{Unit, Workspace, lock};
use crate::error::{Error, Result};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

impl Workspace {
    /// Runs `work(unit)` for every unit in `0..count`, on all threads, started in ascending order.
    ///
    /// Before a unit starts, `bytes(unit)` are reserved as `name`, waiting for other units to end. So the
    /// budget, not the number of threads, bounds the memory. A unit may reduce its reservation once its sizes
    /// are known, and reports its usage ([`super::memory`]). The first error (that of the lowest unit) ends
    /// the loop and is returned.
    ///
    /// # Errors
    /// Errors of `work`; [`Error::Memory`] if one unit alone does not fit; [`Error::Cancelled`].
    pub fn for_each_unit(
        &self,
        name: &'static str,
        count: usize,
        bytes: impl Fn(usize) -> u64 + Sync,
        work: impl Fn(&Unit<'_>) -> Result<()> + Sync,
    ) -> Result<()> {
        let all: Vec<usize> = (0..count).collect();
        self.for_units(name, &all, &bytes, &|unit| {
            work(&unit)?;
            Ok(unit.end().1)
        })
    }

    /// As [`Workspace::for_each_unit`], for the `units` with these numbers; `work` ends the unit. Compiled once
    /// for all kinds of work.
    pub(super) fn for_units(
        &self,
        name: &'static str,
        units: &[usize],
        bytes: &(dyn Fn(usize) -> u64 + Sync),
        work: &(dyn Fn(Unit<'_>) -> Result<Usage> + Sync),
    ) -> Result<()> {
        let next = AtomicUsize::new(0);
        let stop = AtomicBool::new(false);
        let failed: Mutex<Option<(usize, Error)>> = Mutex::new(None);
        // The usage of a thread counts until all threads have ended.
        let slots = Mutex::new(Vec::new());
        let worker = || {
            let mut slot = Slot::new(&self.memory, name);
            while !stop.load(Ordering::Relaxed) {
                let Some(&unit) = units.get(next.fetch_add(1, Ordering::Relaxed)) else {
                    break;
                };
                let outcome = self
                    .check_cancel()
                    .and_then(|()| self.memory.promise_waiting(name, bytes(unit)))
                    .and_then(|reserved| work(Unit::new(self, unit, Usage::of(reserved))))
                    .map(|usage| slot.ended(usage));
                if let Err(error) = outcome {
                    stop.store(true, Ordering::Relaxed);
                    let mut first = lock(&failed);
                    if first.as_ref().is_none_or(|(u, _)| unit < *u) {
                        *first = Some((unit, error));
                    }
                }
            }
            lock(&slots).push(slot);
        };
        // Always the same threads: memory that the allocator keeps for one is of no use to another.
        self.pool.broadcast(|_| worker());
        let failed = lock(&failed).take();
        failed.map_or(Ok(()), |(_, error)| Err(error))
    }
}
