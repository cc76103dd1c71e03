//! Progress reports of a run, and the flag that stops it.

use super::outlook::Planned;
use crate::error::{Error, Result, Setting};
use crossbeam_channel::{Receiver, Sender, bounded};
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

/// Receives the progress of a run. Methods may be called from several threads.
pub trait Observer: Send + Sync {
    /// The stages that are to come, in their order; called again when more is known of them. A
    /// [`Outlook`](super::outlook::Outlook) tells from it how long the whole run takes.
    fn plan(&self, stages: &[Planned]) {
        let _ = stages;
    }
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
    /// An option as the user writes it, for the words of warnings, also of those in the report.
    fn spell(&self, setting: &Setting) -> String {
        setting.to_string()
    }
}

/// An [`Observer`] that ignores everything.
#[derive(Debug, Default, Clone, Copy)]
pub struct Silent;

impl Observer for Silent {}

/// A flag that makes a run stop at its next unit of work.
#[derive(Debug, Clone)]
pub struct Cancel {
    flag: Arc<AtomicU8>,
    raised: (Sender<()>, Receiver<()>),
}

/// Values of the flag.
const STOP: u8 = 1;
const TIME: u8 = 2;

impl Default for Cancel {
    fn default() -> Self {
        Self {
            flag: Arc::default(),
            raised: bounded(1),
        }
    }
}

impl Cancel {
    /// A flag that is not raised.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Cancels the run.
    pub fn cancel(&self) {
        self.flag.store(STOP, Ordering::Relaxed);
        let _ = self.raised.0.try_send(());
    }

    /// Stops the run because its time is up.
    pub fn expire(&self) {
        let (set, get) = (Ordering::Relaxed, Ordering::Relaxed);
        if self.flag.compare_exchange(0, TIME, set, get).is_ok() {
            let _ = self.raised.0.try_send(());
        }
    }

    /// Receives a message when the flag is raised, for one thread that waits for it.
    pub fn raised(&self) -> Receiver<()> {
        self.raised.1.clone()
    }

    /// True if the run is cancelled or its time is up.
    #[must_use]
    pub fn is_cancelled(&self) -> bool {
        self.flag.load(Ordering::Relaxed) != 0
    }

    /// True if the time of the run is up.
    #[must_use]
    pub fn is_expired(&self) -> bool {
        self.flag.load(Ordering::Relaxed) == TIME
    }

    /// # Errors
    /// [`Error::Cancelled`] or [`Error::TimeLimit`] if the run has to stop.
    pub fn check(&self) -> Result<()> {
        match self.flag.load(Ordering::Relaxed) {
            0 => Ok(()),
            TIME => Err(Error::TimeLimit),
            _ => Err(Error::Cancelled),
        }
    }
}
