//! Fault injection for tests: the environment variable `OUTCROP_FAULT` is read once.
//!
//! `KIND:N` kills the program at the `N`th event of a kind, or makes that event fail; `count:FILE` writes the
//! number of events of each kind; `freeze:publish` stops it before it publishes a finished journal, and
//! `hold:N` makes it take N MiB there; with `most:N` a format of meshes with a limit holds N bytes. See
//! `CONTRIBUTING.md`.

use std::io;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

/// Events at which a fault can be injected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(usize)]
pub enum Event {
    /// A write to a scratch file or the output.
    Write,
    /// Before a record is appended to the journal.
    Record,
    /// In the middle of appending a record.
    Torn,
    /// After a record was appended.
    Recorded,
    /// A sync of a file or of the folder.
    Sync,
    /// After files were synced.
    Synced,
    /// Before the output is renamed.
    Rename,
    /// After the output was renamed.
    Renamed,
    /// Before a file is deleted.
    Delete,
    /// Before a finished journal is published.
    Publish,
    /// After a finished journal was published.
    Published,
}

const NAMES: [&str; 11] = [
    "write",
    "record",
    "torn",
    "recorded",
    "sync",
    "synced",
    "rename",
    "renamed",
    "delete",
    "publish",
    "published",
];

#[derive(Debug)]
enum Plan {
    Kill(usize, u64),
    /// Stop, as by SIGSTOP, before a finished journal is published.
    Freeze,
    /// Have this number of MiB resident for some seconds before a finished journal is published.
    Hold(u64),
    /// From this event of a kind on, all of that kind fail, as on a disk that is full or removed.
    Fail(Event, rustix::io::Errno, u64),
    /// A format of meshes with a limit holds this number of bytes.
    Most(u64),
    Count(std::path::PathBuf),
}

static PLAN: OnceLock<Option<Plan>> = OnceLock::new();
static SEEN: [AtomicU64; NAMES.len()] = [const { AtomicU64::new(0) }; NAMES.len()];

fn read() -> Option<Plan> {
    let text = std::env::var("OUTCROP_FAULT").ok()?;
    let (kind, rest) = text.split_once(':')?;
    if text == "freeze:publish" {
        return Some(Plan::Freeze);
    }
    if kind == "count" {
        return Some(Plan::Count(rest.into()));
    }
    let number = rest.parse().ok()?;
    match kind {
        "full" => Some(Plan::Fail(Event::Write, rustix::io::Errno::NOSPC, number)),
        "hold" => Some(Plan::Hold(number)),
        "most" => Some(Plan::Most(number)),
        "sync" => Some(Plan::Fail(Event::Sync, rustix::io::Errno::IO, number)),
        "eio" => Some(Plan::Fail(Event::Write, rustix::io::Errno::IO, number)),
        _ => NAMES
            .iter()
            .position(|name| *name == kind)
            .map(|event| Plan::Kill(event, number)),
    }
}

fn plan() -> Option<&'static Plan> {
    PLAN.get_or_init(read).as_ref()
}

/// Counts an event; true if the program has to end at it.
fn dies(event: Event) -> bool {
    let Some(plan) = plan() else {
        return false;
    };
    let number = SEEN[event as usize].fetch_add(1, Ordering::Relaxed) + 1;
    matches!(plan, Plan::Kill(kind, at) if *kind == event as usize && *at == number)
}

/// Ends the program like `kill -9`.
fn die() -> ! {
    let _ = rustix::process::kill_process(rustix::process::getpid(), rustix::process::Signal::KILL);
    std::process::abort()
}

/// An event at which the program may be ended.
pub fn point(event: Event) {
    if dies(event) {
        die();
    }
    if event != Event::Publish {
        return;
    }
    match plan() {
        Some(Plan::Freeze) => {
            let (own, stop) = (rustix::process::getpid(), rustix::process::Signal::STOP);
            let _ = rustix::process::kill_process(own, stop);
        }
        Some(Plan::Hold(mebibytes)) => hold(mebibytes << 20),
        _ => {}
    }
}

/// Has this number of bytes resident in all, long enough for a scheduler that polls to see it.
fn hold(bytes: u64) {
    let more = bytes.saturating_sub(super::limits::resident());
    let held = vec![1u8; more as usize];
    std::thread::sleep(std::time::Duration::from_secs(3));
    std::hint::black_box(&held);
}

/// An event before something that may fail, a write or a sync: it fails, or the program ends.
///
/// # Errors
/// The injected error.
pub fn fallible(event: Event) -> io::Result<()> {
    point(event);
    match plan() {
        Some(Plan::Fail(kind, error, at))
            if *kind == event && SEEN[event as usize].load(Ordering::Relaxed) >= *at =>
        {
            Err((*error).into())
        }
        _ => Ok(()),
    }
}

/// Most bytes that a format of meshes holds, of `bytes` without a fault.
#[must_use]
pub fn most(bytes: u64) -> u64 {
    match plan() {
        Some(Plan::Most(number)) => *number,
        _ => bytes,
    }
}

/// Writes a record; if the program has to end at it, only a part of the record.
///
/// # Errors
/// Errors of `write`.
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

/// Writes the number of events of each kind, if requested.
pub fn finish() {
    if let Some(Plan::Count(path)) = plan() {
        let lines = NAMES.iter().zip(&SEEN);
        let lines: Vec<String> = lines
            .map(|(name, seen)| format!("{name} {}\n", seen.load(Ordering::Relaxed)))
            .collect();
        let _ = std::fs::write(path, lines.concat());
    }
}
