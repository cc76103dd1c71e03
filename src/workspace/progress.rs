//! What a run tells its caller while it works, and how the caller stops it.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

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
pub struct Cancel(Arc<AtomicBool>);

impl Cancel {
    /// A flag that is not raised.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Asks the run to stop.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// True once [`Cancel::cancel`] was called.
    #[must_use]
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}
