//! Steps that a resumed run does not repeat.

use super::Workspace;
use super::persist::{Persist, Saved};
use super::place::{Place, Put};
use super::run::{Notes, ResumableRun};
use crate::error::Result;
use std::sync::{Arc, Mutex, PoisonError};

/// The name of a step that consists of units, and the name under which their memory is reserved.
#[derive(Debug)]
pub struct UnitsName {
    step: String,
    memory: &'static str,
}

impl From<&'static str> for UnitsName {
    fn from(name: &'static str) -> Self {
        Self::from((name, name))
    }
}

impl<S: Into<String>> From<(S, &'static str)> for UnitsName {
    fn from((step, memory): (S, &'static str)) -> Self {
        let step = step.into();
        Self { step, memory }
    }
}

/// Inside a step until it is dropped.
struct Inside<'a>(&'a ResumableRun);

impl Drop for Inside<'_> {
    fn drop(&mut self) {
        self.0.leave();
    }
}

fn bytes(value: &impl Persist) -> Vec<u8> {
    let mut bytes = Vec::new();
    value.save(&mut bytes);
    bytes
}

impl Workspace {
    /// Does `work`, or restores its result if an earlier attempt finished it.
    ///
    /// Steps may be nested. Only one thread at a time may begin steps, in an order that depends only on the
    /// input and the parameters.
    ///
    /// # Errors
    /// Errors of `work`, [`crate::Error::Io`], [`crate::Error::Disk`].
    pub fn once<T: Persist>(&self, name: &str, work: impl FnOnce() -> Result<T>) -> Result<T> {
        let Some(run) = &self.shared.run else {
            return work();
        };
        let path = run.begin(name)?;
        if let Some(payload) = run.payload(&path, 0)? {
            return T::load(&mut Saved::new(&payload, self));
        }
        let notes = Notes::begin();
        run.enter(&path);
        let inside = Inside(run);
        let value = work()?;
        drop(inside);
        run.finish(&path, 0, notes.finish().puts, bytes(&value))?;
        run.delete_dropped()?;
        Ok(value)
    }

    /// As [`Workspace::for_each_unit`], but units that an earlier attempt finished are not repeated. The
    /// result of a unit, apart from files, is the value that `work` returns. `each` is called with it once
    /// for every unit, in any order.
    ///
    /// # Errors
    /// Errors of [`Workspace::for_each_unit`] and of `each`.
    pub fn units<T: Persist + Send>(
        &self,
        name: impl Into<UnitsName>,
        count: usize,
        bytes_of: impl Fn(usize) -> u64 + Sync,
        work: impl Fn(usize) -> Result<T> + Sync,
        each: impl FnMut(usize, T) -> Result<()> + Send,
    ) -> Result<()> {
        let each = Mutex::new(each);
        let hand_on = |unit, value| {
            let mut each = each.lock().unwrap_or_else(PoisonError::into_inner);
            (*each)(unit, value)
        };
        let UnitsName { step, memory } = name.into();
        let Some(run) = &self.shared.run else {
            return self.for_each_unit(memory, count, bytes_of, |unit| hand_on(unit, work(unit)?));
        };
        let step = run.begin(&step)?;
        let mut left: Vec<usize> = Vec::new();
        let mut finished = run.finished(&step).into_iter().peekable();
        for unit in 0..count {
            if finished.next_if_eq(&(unit as u64)).is_none() {
                left.push(unit);
                continue;
            }
            let payload = run.payload(&step, unit as u64)?.unwrap_or_default();
            let (items, value) = Persist::load(&mut Saved::new(&payload, self))?;
            self.observer.advance(items);
            hand_on(unit, value)?;
        }
        let bytes_of = |n: usize| bytes_of(left[n]);
        self.for_each_unit(memory, left.len(), bytes_of, |n| {
            let unit = left[n];
            let notes = Notes::begin();
            let value = work(unit)?;
            let noted = notes.finish();
            let mut payload = bytes(&noted.items);
            value.save(&mut payload);
            run.finish(&step, unit as u64, noted.puts, payload)?;
            hand_on(unit, value)
        })
    }

    /// Begins the next step `name` of the program, for callers that manage its units themselves.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Disk`].
    pub(crate) fn step(&self, name: &str) -> Result<Step> {
        let run = self.shared.run.clone();
        Ok(Step {
            path: run
                .as_ref()
                .map_or(Ok(String::new()), |run| run.begin(name))?,
            run,
        })
    }

    /// Notes a part of a file that is not in the scratch folder.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Disk`].
    pub(crate) fn put(&self, put: Put) -> Result<()> {
        self.run().map_or(Ok(()), |run| run.put(put))
    }

    /// The parts of a file that earlier attempts wrote.
    pub(crate) fn places(&self, file: &str) -> Vec<(u32, Place)> {
        self.run().map_or_else(Vec::new, |run| run.places(file))
    }

    pub(super) fn run(&self) -> Option<&ResumableRun> {
        self.shared.run.as_deref()
    }

    /// True if the run can be resumed.
    #[must_use]
    pub fn is_resumable(&self) -> bool {
        self.shared.run.is_some()
    }
}

/// A step whose units are not known in advance.
#[derive(Debug, Default)]
pub(crate) struct Step {
    run: Option<Arc<ResumableRun>>,
    path: String,
}

impl Step {
    /// The finished units and their results.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Corrupt`].
    pub fn finished<T: Persist>(&self, workspace: &Workspace) -> Result<Vec<(u64, T)>> {
        let Some(run) = &self.run else {
            return Ok(Vec::new());
        };
        let units = run.finished(&self.path).into_iter();
        units
            .map(|unit| {
                let payload = run.payload(&self.path, unit)?.unwrap_or_default();
                Ok((unit, T::load(&mut Saved::new(&payload, workspace))?))
            })
            .collect()
    }

    /// Records as one unit the parts of files that `put` writes, and `value`.
    ///
    /// # Errors
    /// [`crate::Error::Io`], [`crate::Error::Disk`].
    pub fn finish(
        &self,
        unit: u64,
        value: &impl Persist,
        put: impl FnOnce() -> Result<()>,
    ) -> Result<()> {
        let Some(run) = &self.run else {
            return put();
        };
        let notes = Notes::begin();
        put()?;
        run.finish(&self.path, unit, notes.finish().puts, bytes(value))
    }
}
