//! Progress reports of a run, and the flag that stops it.

use crate::error::{Error, Result};
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

/// Receives the progress of a run. Methods may be called from several threads.
pub trait Observer: Send + Sync {
    /// Stage `name` begins; it has `total` items called `unit` (0: unknown).
    fn begin(&self, name: &'static str, unit: &'static str, total: u64) {
        let _ = (name, unit, total);
    }
    /// `count` further items of the current stage are done.
    fn advance(&self, count: u64) {
        let _ = count;
    }
    /// The current stage is finished.
    fn end(&self) {}
    /// A warning for the user, one line.
    fn warn(&self, message: &str) {
        let _ = message;
    }
}

/// An [`Observer`] that ignores everything.
#[derive(Debug, Default, Clone, Copy)]
pub struct Silent;

impl Observer for Silent {}

/// A flag that makes a run stop at its next unit of work.
#[derive(Debug, Clone, Default)]
pub struct Cancel(Arc<AtomicU8>);

/// Values of the flag.
const STOP: u8 = 1;
const TIME: u8 = 2;

impl Cancel {
    /// A flag that is not raised.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Cancels the run.
    pub fn cancel(&self) {
        self.0.store(STOP, Ordering::Relaxed);
    }

    /// Stops the run because its time is up.
    pub fn expire(&self) {
        let _ = self
            .0
            .compare_exchange(0, TIME, Ordering::Relaxed, Ordering::Relaxed);
    }

    /// True if the run is cancelled or its time is up.
    #[must_use]
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed) != 0
    }

    /// True if the time of the run is up.
    #[must_use]
    pub fn is_expired(&self) -> bool {
        self.0.load(Ordering::Relaxed) == TIME
    }

    /// # Errors
    /// [`Error::Cancelled`] or [`Error::TimeLimit`] if the run has to stop.
    pub fn check(&self) -> Result<()> {
        match self.0.load(Ordering::Relaxed) {
            0 => Ok(()),
            TIME => Err(Error::TimeLimit),
            _ => Err(Error::Cancelled),
        }
    }
}
