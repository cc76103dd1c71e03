//! Faults on purpose, for tests: the environment variable `OUTCROP_FAULT` is read once.
//!
//! `KIND:N` kills the program at, or fails, the `N`th event of a kind; `count:FILE` writes how many
//! there were of each. See `CONTRIBUTING.md`.

use std::io;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

/// Where something can be made to go wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(usize)]
pub enum Event {
    /// A write to a scratch file or the output.
    Write,
    /// Before a record goes into the journal.
    Record,
    /// In the middle of a record.
    Torn,
    /// After a record.
    Recorded,
    /// After files were synced.
    Synced,
    /// Before the output gets its name.
    Rename,
    /// After the output got its name.
    Renamed,
    /// Before a file is deleted.
    Delete,
}

const NAMES: [&str; 8] = [
    "write", "record", "torn", "recorded", "synced", "rename", "renamed", "delete",
];

#[derive(Debug)]
enum Plan {
    Kill(usize, u64),
    Fail(rustix::io::Errno, u64),
    Count(std::path::PathBuf),
}

static PLAN: OnceLock<Option<Plan>> = OnceLock::new();
static SEEN: [AtomicU64; NAMES.len()] = [const { AtomicU64::new(0) }; NAMES.len()];

fn read() -> Option<Plan> {
    let text = std::env::var("OUTCROP_FAULT").ok()?;
    let (kind, rest) = text.split_once(':')?;
    if kind == "count" {
        return Some(Plan::Count(rest.into()));
    }
    let number = rest.parse().ok()?;
    match kind {
        "full" => Some(Plan::Fail(rustix::io::Errno::NOSPC, number)),
        "eio" => Some(Plan::Fail(rustix::io::Errno::IO, number)),
        _ => NAMES
            .iter()
            .position(|name| *name == kind)
            .map(|event| Plan::Kill(event, number)),
    }
}

fn plan() -> Option<&'static Plan> {
    PLAN.get_or_init(read).as_ref()
}

/// Notes an event; true if the program is to die of it.
fn dies(event: Event) -> bool {
    let Some(plan) = plan() else {
        return false;
    };
    let number = SEEN[event as usize].fetch_add(1, Ordering::Relaxed) + 1;
    matches!(plan, Plan::Kill(kind, at) if *kind == event as usize && *at == number)
}

/// Ends the program as `kill -9` does.
fn die() -> ! {
    let _ = rustix::process::kill_process(rustix::process::getpid(), rustix::process::Signal::KILL);
    std::process::abort()
}

/// An event that may be the program's last.
pub fn point(event: Event) {
    if dies(event) {
        die();
    }
}

/// Before a write: it may fail, or be the program's last event.
///
/// # Errors
/// The error that was asked for.
pub fn write() -> io::Result<()> {
    let Some(plan) = plan() else {
        return Ok(());
    };
    point(Event::Write);
    match plan {
        // From then on every write fails, as on a disk that is full or gone.
        Plan::Fail(error, at) if SEEN[Event::Write as usize].load(Ordering::Relaxed) >= *at => {
            Err((*error).into())
        }
        _ => Ok(()),
    }
}

/// Writes a record whole, or as much of it as a dying program does.
///
/// # Errors
/// What `write` returned.
pub fn record(bytes: &[u8], write: impl FnOnce(&[u8]) -> io::Result<()>) -> io::Result<()> {
    point(Event::Record);
    if dies(Event::Torn) {
        let _ = write(&bytes[..bytes.len() * 2 / 3]);
        die();
    }
    write(bytes)?;
    point(Event::Recorded);
    Ok(())
}

/// Writes down how many events there were, if that was asked for.
pub fn finish() {
    if let Some(Plan::Count(path)) = plan() {
        let lines = NAMES.iter().zip(&SEEN);
        let lines: Vec<String> = lines
            .map(|(name, seen)| format!("{name} {}\n", seen.load(Ordering::Relaxed)))
            .collect();
        let _ = std::fs::write(path, lines.concat());
    }
}
