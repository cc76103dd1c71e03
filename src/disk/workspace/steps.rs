//! Steps that a resumed run does not repeat.

use super::memory::Usage;
use super::place::Place;
use super::run::ResumableRun;
use super::unit::Notes;
use super::{Unit, Workspace, journal, lock};
use crate::error::{Error, Result};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::Ordering;

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

/// What the work on a unit made, whatever its type.
trait Outcome {
    /// What a resumed run reads in the place of doing the unit: its progress, and the value.
    fn payload(&self, workspace: &Workspace, items: u64) -> Result<Vec<u8>>;

    /// Gives the value to the caller of [`Workspace::units`].
    fn hand_on(self: Box<Self>, unit: usize) -> Result<()>;
}

struct Done<'a, T, F> {
    value: T,
    hand_on: &'a F,
}

impl<T: Serialize, F: Fn(usize, T) -> Result<()>> Outcome for Done<'_, T, F> {
    fn payload(&self, workspace: &Workspace, items: u64) -> Result<Vec<u8>> {
        workspace.saved_as::<T>(&(items, &self.value))
    }

    fn hand_on(self: Box<Self>, unit: usize) -> Result<()> {
        (self.hand_on)(unit, self.value)
    }
}

type Work<'a> = dyn Fn(&Unit<'_>) -> Result<Box<dyn Outcome + 'a>> + Sync + 'a;

/// By which a result of another type is noticed, such as a tuple with one more number: another build of the program left
/// it, whose format of scratch files is the same by the names of types.
fn type_of<T>() -> [u8; 4] {
    crc32fast::hash(std::any::type_name::<T>().as_bytes()).to_le_bytes()
}

/// Inside a step until it is dropped.
struct Inside<'a>(&'a ResumableRun);

impl Drop for Inside<'_> {
    fn drop(&mut self) {
        self.0.leave();
    }
}

impl Workspace {
    /// Does `work`, or restores its result if an earlier attempt finished it.
    ///
    /// Steps may be nested. Only one thread at a time may begin steps, in an order that depends only on the
    /// input and the parameters.
    ///
    /// # Errors
    /// Errors of `work`, [`Error::Io`], [`Error::Disk`].
    pub fn once<T: Serialize + DeserializeOwned>(
        &self,
        name: &str,
        work: impl FnOnce(&Unit<'_>) -> Result<T>,
    ) -> Result<T> {
        let unit = self.unit();
        let Some(run) = self.run() else {
            return work(&unit);
        };
        let path = run.begin(name)?;
        if let Some(payload) = run.payload(&path, 0)? {
            return self.restored_as::<T, T>(&payload);
        }
        run.enter(&path);
        let inside = Inside(run);
        let value = work(&unit)?;
        drop(inside);
        run.finish(
            unit.worker(),
            &path,
            0,
            unit.end().0.puts,
            self.saved_as::<T>(&value)?,
        )?;
        Ok(value)
    }

    /// As [`Workspace::once`], for a value that cannot be saved, such as one with open files. `make` returns it with
    /// what is saved of it, from which `open` makes it again in a later attempt.
    ///
    /// # Errors
    /// Errors of [`Workspace::once`] and of `open`.
    pub fn once_opened<T, S: Serialize + DeserializeOwned>(
        &self,
        name: &str,
        make: impl FnOnce(&Unit<'_>) -> Result<(T, S)>,
        open: impl FnOnce(S) -> Result<T>,
    ) -> Result<T> {
        let mut made = None;
        let saved = self.once(name, |unit| {
            let (value, saved) = make(unit)?;
            made = Some(value);
            Ok(saved)
        })?;
        made.map_or_else(|| open(saved), Ok)
    }

    /// A unit of work without a reservation of its own, for work on one thread.
    #[must_use]
    pub fn unit(&self) -> Unit<'_> {
        Unit::new(self, 0, Usage::default())
    }

    fn saved(&self, value: &impl Serialize) -> Result<Vec<u8>> {
        // Results have sizes that are known, so this cannot happen.
        postcard::to_allocvec(value).map_err(|e| {
            Error::io(
                self.path(journal::NAME),
                "save a result for",
                std::io::Error::other(e),
            )
        })
    }

    /// A value that is or holds a result of type `T`, with what tells the type.
    fn saved_as<T>(&self, value: &impl Serialize) -> Result<Vec<u8>> {
        Ok([&type_of::<T>()[..], &self.saved(value)?].concat())
    }

    /// A result of type `T` from an earlier attempt, with what [`Workspace::saved_as`] saved besides it.
    fn restored_as<T, V: DeserializeOwned>(&self, payload: &[u8]) -> Result<V> {
        match payload.split_first_chunk() {
            Some((found, _)) if *found != type_of::<T>() => {
                Err(self.corrupt::<T>("a result of another type, left by another build".to_owned()))
            }
            Some((_, value)) => self.restored(value),
            None => self.restored(payload),
        }
    }

    /// A result from an earlier attempt.
    fn restored<T: DeserializeOwned>(&self, payload: &[u8]) -> Result<T> {
        match postcard::take_from_bytes(payload) {
            Ok((value, [])) => Ok(value),
            Ok((_, rest)) => {
                Err(self.corrupt::<T>(format!("a result with {} bytes more", rest.len())))
            }
            Err(error) => {
                Err(self.corrupt::<T>(format!("a result of {} bytes: {error}", payload.len())))
            }
        }
    }

    /// An error of the journal: `found` instead of a result of type `T`.
    fn corrupt<T>(&self, found: String) -> Error {
        Error::Corrupt {
            path: self.path(journal::NAME),
            offset: 0,
            found,
            expected: std::any::type_name::<T>().to_owned(),
        }
    }

    /// As [`Workspace::for_each_unit`], but units that an earlier attempt finished are not repeated. The
    /// result of a unit, apart from files, is the value that `work` returns. `each` is called with it once
    /// for every unit, in any order.
    ///
    /// # Errors
    /// Errors of [`Workspace::for_each_unit`] and of `each`.
    pub fn units<T: Serialize + DeserializeOwned + Send>(
        &self,
        name: impl Into<UnitsName>,
        count: usize,
        bytes: impl Fn(usize) -> u64 + Sync,
        work: impl Fn(&Unit<'_>) -> Result<T> + Sync,
        each: impl FnMut(usize, T) -> Result<()> + Send,
    ) -> Result<()> {
        let each = Mutex::new(each);
        let hand_on = |unit, value| (*lock(&each))(unit, value);
        let work = |unit: &Unit<'_>| -> Result<Box<dyn Outcome + '_>> {
            let (value, hand_on) = (work(unit)?, &hand_on);
            Ok(Box::new(Done { value, hand_on }))
        };
        self.units_of(name.into(), count, &bytes, &work, &|unit, payload| {
            let (items, value) = self.restored_as::<T, (u64, T)>(payload)?;
            self.observer.advance(items);
            hand_on(unit, value)
        })
    }

    /// [`Workspace::units`], compiled once for all kinds of work; `restore` takes the payload of a finished unit.
    fn units_of(
        &self,
        UnitsName { step, memory }: UnitsName,
        count: usize,
        bytes: &(dyn Fn(usize) -> u64 + Sync),
        work: &Work<'_>,
        restore: &dyn Fn(usize, &[u8]) -> Result<()>,
    ) -> Result<()> {
        let Some(run) = self.run() else {
            return self.for_each_unit(memory, count, bytes, |unit| {
                work(unit)?.hand_on(unit.number())
            });
        };
        let step = run.begin(&step)?;
        let mut finished = run.finished(&step).into_iter().peekable();
        let (done, mut left): (Vec<usize>, Vec<usize>) =
            (0..count).partition(|unit| finished.next_if_eq(&(*unit as u64)).is_some());
        let shared = run.shared_units(&step, count as u64, &left);
        if let Some(own) = &shared {
            left.retain(|unit| own.contains(&(*unit as u64)));
        }
        // Whoever does some units of a step does not need the results of the others.
        for unit in done.into_iter().filter(|_| shared.is_none()) {
            restore(unit, &run.payload(&step, unit as u64)?.unwrap_or_default())?;
        }
        let files = Mutex::new(BTreeSet::new());
        self.for_units(memory, &left, bytes, &|unit| {
            let (number, worker) = (unit.number(), unit.worker());
            let outcome = work(&unit)?;
            let (Notes { puts, items }, usage) = unit.end();
            lock(&files).extend(puts.iter().map(|put| put.file.clone()));
            let payload = outcome.payload(self, items)?;
            run.finish(worker, &step, number as u64, puts, payload)?;
            outcome.hand_on(number)?;
            Ok(usage)
        })?;
        if shared.is_some() {
            return Err(Error::left());
        }
        run.end(&step, count as u64, std::mem::take(&mut *lock(&files)))
    }

    /// Begins the next step `name` of the program, for callers that manage its units themselves.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Disk`].
    pub fn step(&self, name: &str) -> Result<Step<'_>> {
        let run = self.run();
        Ok(Step {
            path: run.map_or(Ok(String::new()), |run| run.begin(name))?,
            workspace: self,
        })
    }

    /// The parts of a file that earlier attempts wrote.
    pub fn places(&self, file: &str) -> Vec<(u32, Place)> {
        self.run().map_or_else(Vec::new, |run| run.places(file))
    }

    pub(super) fn run(&self) -> Option<&ResumableRun> {
        self.shared.run.as_ref()
    }

    /// True if the run can be resumed.
    #[must_use]
    pub fn is_resumable(&self) -> bool {
        self.shared.run.is_some()
    }

    /// True if tasks share the run.
    #[must_use]
    pub fn is_shared(&self) -> bool {
        self.run().is_some_and(ResumableRun::is_shared)
    }

    /// Notes a file that this process has written to, and that others read.
    pub fn touched(&self, path: &Path) {
        if let Some(run) = self.run() {
            run.touched(path);
        }
    }

    /// If tasks share the run: a number that no other process of it has.
    #[must_use]
    pub fn shared_number(&self) -> Option<u32> {
        let run = self.run().filter(|run| run.is_shared());
        run.map(ResumableRun::first)
    }

    /// Notes the number of points, for those who ask for the state of a run that tasks share.
    pub fn note_points(&self, points: u64) {
        if let Some(run) = self.run() {
            run.points.store(points, Ordering::Relaxed);
        }
    }

    /// The number of points that was noted last.
    #[must_use]
    pub fn noted_points(&self) -> u64 {
        self.run()
            .map_or(0, |run| run.points.load(Ordering::Relaxed))
    }

    /// True if this process is a task, which does some units of a run.
    #[must_use]
    pub fn is_task(&self) -> bool {
        self.run().is_some_and(ResumableRun::is_task)
    }
}

/// A step whose units are not known in advance. One thread does all of them.
pub struct Step<'w> {
    workspace: &'w Workspace,
    path: String,
}

impl Step<'_> {
    /// The finished units and their results.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Corrupt`].
    pub fn finished<T: DeserializeOwned>(&self) -> Result<Vec<(u64, T)>> {
        let Some(run) = self.workspace.run() else {
            return Ok(Vec::new());
        };
        let units = run.finished(&self.path).into_iter();
        units
            .map(|unit| {
                let payload = run.payload(&self.path, unit)?.unwrap_or_default();
                Ok((unit, self.workspace.restored(&payload)?))
            })
            .collect()
    }

    /// Records as one unit the parts of files that `put` writes, and `value`.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Disk`].
    pub fn finish(
        &self,
        unit: u64,
        value: &impl Serialize,
        put: impl FnOnce(&Unit<'_>) -> Result<()>,
    ) -> Result<()> {
        let at_work = self.workspace.unit();
        put(&at_work)?;
        let Some(run) = self.workspace.run() else {
            return Ok(());
        };
        let value = self.workspace.saved(value)?;
        run.finish(
            at_work.worker(),
            &self.path,
            unit,
            at_work.end().0.puts,
            value,
        )
    }
}

#[cfg(test)]
mod tests;
