//! The progress of a run: the latest state of its stages, kept until Python reads it.

use crate::job::keyword;
use outcrop::error::Setting;
use outcrop::{Observer, Outlook, Planned};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// A stage: its name, its unit, items done, items in all (0: unknown).
pub type Stage = (&'static str, &'static str, u64, u64);

/// Receives the progress of a run.
pub struct Progress {
    state: Mutex<State>,
    /// Items of the current stage that are done.
    done: AtomicU64,
    began: Instant,
}

#[derive(Default)]
struct State {
    outlook: Outlook,
    current: Option<Stage>,
    /// Stages that ended since the last question.
    ended: Vec<Stage>,
    warnings: Vec<String>,
}

impl Default for Progress {
    fn default() -> Self {
        Self {
            state: Mutex::default(),
            done: AtomicU64::new(0),
            began: Instant::now(),
        }
    }
}

impl Progress {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The stages that ended since the last call, and the current one.
    pub fn stages(&self) -> Vec<Stage> {
        let mut state = self.state();
        let mut stages = std::mem::take(&mut state.ended);
        if let Some((name, unit, _, total)) = state.current {
            stages.push((name, unit, self.done.load(Ordering::Relaxed), total));
        }
        stages
    }

    /// The share of the whole run that is done, and the seconds left; none without a plan.
    pub fn outlook(&self) -> Option<(f64, f64)> {
        let done = self.done.load(Ordering::Relaxed);
        let position = self.state().outlook.position(done, self.began.elapsed())?;
        Some((position.share, position.left.as_secs_f64()))
    }

    /// The warnings since the last call.
    pub fn warnings(&self) -> Vec<String> {
        std::mem::take(&mut self.state().warnings)
    }
}

impl Observer for Progress {
    fn plan(&self, stages: &[Planned]) {
        self.state().outlook.plan(stages);
    }

    fn begin(&self, name: &'static str, unit: &'static str, total: u64) {
        let mut state = self.state();
        self.done.store(0, Ordering::Relaxed);
        state.outlook.begin(name, total, self.began.elapsed());
        state.current = Some((name, unit, 0, total));
    }

    fn advance(&self, count: u64) {
        self.done.fetch_add(count, Ordering::Relaxed);
    }

    fn end(&self) {
        let mut state = self.state();
        state.outlook.end(self.began.elapsed());
        if let Some((name, unit, _, total)) = state.current.take() {
            let done = self.done.load(Ordering::Relaxed);
            state.ended.push((name, unit, done, total));
        }
    }

    fn warn(&self, message: &str) {
        self.state().warnings.push(message.to_owned());
    }

    fn spell(&self, setting: &Setting) -> String {
        keyword(setting)
    }
}
