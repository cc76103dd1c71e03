//! Events at which tests make the program fail. [`install`] says what happens at them; without it, nothing does.

use std::io;
use std::sync::OnceLock;
use std::time::Duration;

/// Events at which a fault can be injected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
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

/// What happens at the events of this process.
pub trait Faults: Send + Sync {
    /// At an event: ends the process, or decides whether what follows fails.
    ///
    /// # Errors
    /// The error with which it fails, if it is something that may fail.
    fn at(&self, event: Event) -> io::Result<()>;

    /// In the middle of a record: if the process has to end there, calls `part`, which writes a part of the
    /// record, and ends it.
    fn tear(&self, part: &mut dyn FnMut());

    /// Most bytes that a format of meshes holds, of `bytes` without a fault.
    fn most(&self, bytes: u64) -> u64;

    /// Time between two signs of life of a process whose files are in a store; `usual` without a fault.
    fn beat(&self, usual: Duration) -> Duration;

    /// At the end of the work.
    fn finish(&self);
}

static FAULTS: OnceLock<Box<dyn Faults>> = OnceLock::new();

/// Says what happens at the events of this process. Only the first call counts.
pub fn install(faults: Box<dyn Faults>) {
    let _ = FAULTS.set(faults);
}

/// An event at which the program may be ended.
pub fn point(event: Event) {
    let _ = fallible(event);
}

/// An event before something that may fail, a write or a sync: it fails, or the program is ended.
///
/// # Errors
/// The injected error.
pub fn fallible(event: Event) -> io::Result<()> {
    FAULTS.get().map_or(Ok(()), |faults| faults.at(event))
}

/// Most bytes that a format of meshes holds, of `bytes` without a fault.
#[must_use]
pub fn most(bytes: u64) -> u64 {
    FAULTS.get().map_or(bytes, |faults| faults.most(bytes))
}

/// Time between two signs of life of a process whose files are in a store; `usual` without a fault.
#[must_use]
pub fn beat(usual: Duration) -> Duration {
    FAULTS.get().map_or(usual, |faults| faults.beat(usual))
}

/// Writes a record; if the program has to end at it, only a part of the record.
///
/// # Errors
/// Errors of `write`.
pub fn record(bytes: &[u8], write: impl Fn(&[u8]) -> io::Result<()>) -> io::Result<()> {
    point(Event::Record);
    if let Some(faults) = FAULTS.get() {
        faults.tear(&mut || drop(write(&bytes[..bytes.len() * 2 / 3])));
    }
    write(bytes)?;
    point(Event::Recorded);
    Ok(())
}

/// Tells that the work has ended.
pub fn finish() {
    if let Some(faults) = FAULTS.get() {
        faults.finish();
    }
}
