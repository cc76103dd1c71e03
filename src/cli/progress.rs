//! Progress on a terminal: stage, rate, time left, memory; one line for each stage.

use crate::workspace::progress::Observer;
use crate::workspace::{limits, lock};
use indicatif::{HumanCount, ProgressBar, ProgressState, ProgressStyle};
use std::fmt::Write;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

/// A progress bar for the current stage on standard error. Only [`Bars::draw`] draws it, so that workers never
/// wait for the terminal.
#[derive(Default)]
pub struct Bars {
    current: Mutex<Option<ProgressBar>>,
    done: AtomicU64,
}

const KNOWN: &str =
    "{prefix:>8} [{bar:24}] {human_pos}/{human_len} {msg}  {rate}  {eta} left  {memory}";
const UNKNOWN: &str = "{prefix:>8} {spinner} {human_pos} {msg}  {rate}  {elapsed}  {memory}";
const DONE: &str = "{prefix:>8} {human_pos} {msg} in {elapsed_precise}";

fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template)
        .unwrap_or_else(|_| ProgressStyle::default_bar())
        .progress_chars("=> ")
        .with_key("rate", |state: &ProgressState, out: &mut dyn Write| {
            let _ = write!(out, "{}/s", HumanCount(state.per_sec() as u64));
        })
        .with_key("memory", |_: &ProgressState, out: &mut dyn Write| {
            let _ = write!(out, "{} MiB", limits::resident() >> 20);
        })
}

impl Bars {
    /// Draws the bar, if there is one.
    pub fn draw(&self) {
        if let Some(bar) = &*lock(&self.current) {
            bar.set_position(self.done.load(Ordering::Relaxed));
        }
    }
}

impl Observer for Bars {
    fn begin(&self, name: &'static str, unit: &'static str, total: u64) {
        let bar = if total > 0 {
            ProgressBar::new(total).with_style(style(KNOWN))
        } else {
            ProgressBar::new_spinner().with_style(style(UNKNOWN))
        };
        let bar = bar.with_prefix(name).with_message(unit);
        self.done.store(0, Ordering::Relaxed);
        *lock(&self.current) = Some(bar);
    }

    fn advance(&self, count: u64) {
        self.done.fetch_add(count, Ordering::Relaxed);
    }

    fn end(&self) {
        self.draw();
        if let Some(bar) = lock(&self.current).take() {
            bar.set_style(style(DONE));
            bar.finish();
        }
    }

    fn warn(&self, message: &str) {
        match &*lock(&self.current) {
            Some(bar) => bar.suspend(|| Warnings.warn(message)),
            None => Warnings.warn(message),
        }
    }
}

/// Prints warnings only.
pub struct Warnings;

impl Observer for Warnings {
    fn warn(&self, message: &str) {
        eprintln!("outcrop: warning: {message}");
    }
}
