//! What a run tells its caller while it works, and how the caller stops it.

use crate::error::{Error, Result};
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

/// Receives the progress of a run. All methods may be called from several threads.
pub trait Observer: Send + Sync {
    /// Stage `name` begins; it consists of `total` items called `unit` (0: not known).
    fn begin(&self, name: &'static str, unit: &'static str, total: u64) {
        let _ = (name, unit, total);
    }
    /// `count` more items of the current stage are done.
    fn advance(&self, count: u64) {
        let _ = count;
    }
    /// The current stage is finished.
    fn end(&self) {}
    /// Something the user should know, one line.
    fn warn(&self, message: &str) {
        let _ = message;
    }
}

/// An [`Observer`] that ignores everything.
#[derive(Debug, Default, Clone, Copy)]
pub struct Silent;

impl Observer for Silent {}

/// A flag that asks a run to stop at its next unit of work.
#[derive(Debug, Clone, Default)]
pub struct Cancel(Arc<AtomicU8>);

/// States of the flag.
const STOP: u8 = 1;
const TIME: u8 = 2;

impl Cancel {
    /// A flag that is not raised.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Asks the run to stop.
    pub fn cancel(&self) {
        self.0.store(STOP, Ordering::Relaxed);
    }

    /// Asks the run to stop because its time is up.
    pub fn expire(&self) {
        let _ = self
            .0
            .compare_exchange(0, TIME, Ordering::Relaxed, Ordering::Relaxed);
    }

    /// True once the run was asked to stop.
    #[must_use]
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed) != 0
    }

    /// True once the run was asked to stop because its time is up.
    #[must_use]
    pub fn is_expired(&self) -> bool {
        self.0.load(Ordering::Relaxed) == TIME
    }

    /// # Errors
    /// [`Error::Cancelled`] or [`Error::TimeLimit`] once the run was asked to stop.
    pub fn check(&self) -> Result<()> {
        match self.0.load(Ordering::Relaxed) {
            0 => Ok(()),
            TIME => Err(Error::TimeLimit),
            _ => Err(Error::Cancelled),
        }
    }
}
