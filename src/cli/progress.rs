//! Progress on a terminal: stage, rate, time left, memory, one line for each stage; and one for the whole run.

use super::output::spelled;
use indicatif::{
    HumanCount, HumanDuration, MultiProgress, ProgressBar, ProgressState, ProgressStyle,
};
use outcrop_disk::error::Setting;
use outcrop_disk::workspace::outlook::{Outlook, Planned, Position};
use outcrop_disk::workspace::progress::Observer;
use outcrop_disk::workspace::{limits, lock};
use std::fmt::Write;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// A progress bar for the current stage on standard error, and one for the whole run below it. Only
/// [`Bars::draw`] draws them, so that workers never wait for the terminal.
#[derive(Default)]
pub struct Bars {
    lines: MultiProgress,
    current: Mutex<Option<ProgressBar>>,
    whole: Mutex<Whole>,
    done: AtomicU64,
}

/// The line of the whole run.
struct Whole {
    outlook: Outlook,
    began: Instant,
    /// None without a plan, and when the run is over.
    bar: Option<ProgressBar>,
}

impl Default for Whole {
    fn default() -> Self {
        Self {
            outlook: Outlook::default(),
            began: Instant::now(),
            bar: None,
        }
    }
}

impl Whole {
    fn now(&self) -> Duration {
        self.began.elapsed()
    }

    fn draw(&mut self, items: u64) {
        let now = self.now();
        if let (Some(bar), Some(position)) = (&self.bar, self.outlook.position(items, now)) {
            bar.set_position(parts(&position));
            bar.set_message(left(&position));
        }
    }
}

/// Parts of the bar of the whole run.
const PARTS: u64 = 1000;

/// The parts that are done.
fn parts(position: &Position) -> u64 {
    (position.share * PARTS as f64) as u64
}

/// The time left, in words.
fn left(position: &Position) -> String {
    // Estimates are not that precise.
    let seconds = position.left.as_secs();
    let rounded = if seconds > 20 {
        seconds.next_multiple_of(5)
    } else {
        seconds
    };
    format!("about {} left", HumanDuration(Duration::from_secs(rounded)))
}

const KNOWN: &str =
    "{prefix:>8} [{bar:24}] {human_pos}/{human_len} {msg}  {rate}  {eta} left  {memory}";
const UNKNOWN: &str = "{prefix:>8} {spinner} {human_pos} {msg}  {rate}  {elapsed}  {memory}";
const WHOLE: &str = "{prefix:>8} [{bar:24}] {percent} %  {msg}";
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
    /// Draws the bars, if there are any.
    pub fn draw(&self) {
        let done = self.done.load(Ordering::Relaxed);
        if let Some(bar) = &*lock(&self.current) {
            bar.set_position(done);
        }
        lock(&self.whole).draw(done);
    }
}

impl Observer for Bars {
    fn plan(&self, stages: &[Planned]) {
        let mut whole = lock(&self.whole);
        // Another run of the same command.
        if whole.outlook.is_over() && whole.bar.is_none() {
            *whole = Whole::default();
        }
        whole.outlook.plan(stages);
        if whole.bar.is_none() && stages.iter().any(|stage| stage.seconds > 0.0) {
            let bar = ProgressBar::new(PARTS).with_style(style(WHOLE));
            whole.bar = Some(self.lines.add(bar.with_prefix("all")));
        }
    }

    fn begin(&self, name: &'static str, unit: &'static str, total: u64) {
        let bar = if total > 0 {
            ProgressBar::new(total).with_style(style(KNOWN))
        } else {
            ProgressBar::new_spinner().with_style(style(UNKNOWN))
        };
        let bar = bar.with_prefix(name).with_message(unit);
        self.done.store(0, Ordering::Relaxed);
        let mut whole = lock(&self.whole);
        let now = whole.now();
        whole.outlook.begin(name, total, now);
        let bar = match &whole.bar {
            Some(below) => self.lines.insert_before(below, bar),
            None => self.lines.add(bar),
        };
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
        let mut whole = lock(&self.whole);
        let now = whole.now();
        whole.outlook.end(now);
        if whole.outlook.is_over()
            && let Some(bar) = whole.bar.take()
        {
            bar.finish_and_clear();
        }
    }

    fn warn(&self, message: &str) {
        self.lines.suspend(|| Warnings.warn(message));
    }

    fn spell(&self, setting: &Setting) -> String {
        spelled(setting)
    }
}

/// Prints warnings only.
pub struct Warnings;

impl Observer for Warnings {
    fn warn(&self, message: &str) {
        eprintln!("outcrop: warning: {message}");
    }

    fn spell(&self, setting: &Setting) -> String {
        spelled(setting)
    }
}

/// Prints nothing; the report has the warnings.
pub struct Nothing;

impl Observer for Nothing {
    fn spell(&self, setting: &Setting) -> String {
        spelled(setting)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn warnings_have_options_as_on_the_command_line() {
        let observers: [&dyn Observer; 3] = [&Bars::default(), &Warnings, &Nothing];
        for observer in observers {
            let said = |setting| observer.spell(&setting);
            assert_eq!(said(Setting::Flag("keep_far")), "--keep-far");
            let value = Setting::Value("crop_margin", "1.250".into());
            assert_eq!(said(value), "--crop-margin 1.250");
        }
    }

    #[test]
    fn the_line_of_the_whole_run_says_how_much_and_how_long() {
        let position = |share, seconds| Position {
            share,
            left: Duration::from_secs(seconds),
        };
        assert_eq!(parts(&position(0.4567, 0)), 456);
        assert_eq!(parts(&position(1.0, 0)), PARTS);
        assert_eq!(left(&position(0.5, 7)), "about 7 seconds left");
        assert_eq!(left(&position(0.5, 48)), "about 50 seconds left");
        assert_eq!(left(&position(0.5, 7000)), "about 2 hours left");
    }

    #[test]
    fn the_line_is_there_from_the_plan_to_the_end_of_the_last_stage() {
        let bars = Bars::default();
        bars.begin("verify", "triangles", 5);
        assert!(lock(&bars.whole).bar.is_none());
        bars.end();
        let planned = |name, seconds| Planned { name, seconds };
        bars.plan(&[planned("cells", 3.0), planned("export", 1.0)]);
        bars.begin("cells", "points", 10);
        bars.advance(5);
        bars.draw();
        let shown = lock(&bars.whole).bar.as_ref().map(ProgressBar::position);
        assert_eq!(shown, Some(375));
        bars.end();
        bars.begin("export", "blocks", 0);
        assert!(lock(&bars.whole).bar.is_some());
        bars.end();
        assert!(lock(&bars.whole).bar.is_none());
    }
}
