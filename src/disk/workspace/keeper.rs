//! A thread that protects a run from a loss of power: it syncs written files every few seconds, and deletes
//! unneeded files once that is safe.
//!
//! A killed process needs no sync, since written data are in the system's cache. No other thread waits for
//! this one, so a loss of power costs at most a few seconds of work. If something cannot be synced, no file is
//! deleted any more, and the run ends ([`Keeper::check`]): a resumed run finds what it began with.

use super::fault::{self, Event};
use super::open::open_existing;
use super::{IoCounters, lock};
use crate::error::{Error, Result};
use crossbeam_channel::{Receiver, Sender, TryRecvError, after, select, unbounded};
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{Arc, Mutex, OnceLock};
use std::time::Duration;

/// Time between two rounds of syncing, if no file waits to be deleted. A file that waits triggers a round at
/// once, since the run may need its space.
const ROUND: Duration = Duration::from_secs(5);

/// Bit of a file's state: the file has unsynced data, and the keeper knows it.
const DIRTY: u8 = 1;
/// Bit of a file's state: some of its data may have been synced, by this attempt or an earlier one.
const SYNCED: u8 = 2;
/// Bit of a file's state: nobody reads the file any more.
const UNNEEDED: u8 = 4;

/// A file, and how much of it would survive a loss of power.
#[derive(Debug)]
pub struct Kept {
    /// Its path.
    pub path: PathBuf,
    state: AtomicU8,
}

impl Kept {
    /// A file of an earlier attempt, or one that does not exist yet.
    pub fn new(path: PathBuf) -> Self {
        let state = AtomicU8::new(SYNCED);
        Self { path, state }
    }

    /// Notes that this attempt made the file.
    pub fn made(&self) {
        self.state.store(0, Ordering::Release);
    }

    fn add(&self, bit: u8) -> u8 {
        self.state.fetch_or(bit, Ordering::AcqRel)
    }

    /// Syncs the data, unless nobody needs them.
    fn sync(&self) -> io::Result<()> {
        // Of this and `Keeper::delete`, one sees what the other did: a file is deleted at once or synced.
        if self.add(SYNCED) & UNNEEDED != 0 {
            return Ok(());
        }
        self.state.fetch_and(!DIRTY, Ordering::AcqRel);
        match open_existing(&self.path) {
            // Whoever deleted it does not need it, and a resumed run that does finds that it is missing.
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
            // A file that cannot be opened is no file system without syncing.
            file => file.and_then(|file| sync(|| file.sync_data())),
        }
    }
}

/// Syncs with `all`. On a file system that has no syncing, this is no error.
fn sync(all: impl FnOnce() -> io::Result<()>) -> io::Result<()> {
    use io::ErrorKind::{InvalidInput, Unsupported};
    fault::fallible(Event::Sync)?;
    match all() {
        Err(error) if matches!(error.kind(), InvalidInput | Unsupported) => Ok(()),
        done => done,
    }
}

/// The first thing that could not be synced, and the system's reason.
type Failed = OnceLock<(PathBuf, io::Error)>;

/// A file to delete, and the scratch bytes that its deletion frees.
#[derive(Debug)]
pub struct Leaving(pub Arc<Kept>, pub u64);

impl Leaving {
    /// Deletes the file at once.
    pub fn delete(&self, io: &IoCounters) {
        fault::point(Event::Delete);
        // A scratch file that cannot be deleted is deleted with its folder.
        let _ = std::fs::remove_file(&self.0.path);
        io.shrink_scratch(self.1);
    }
}

#[derive(Debug)]
enum Message {
    /// A journal that is synced in every round.
    Journal(Arc<File>),
    /// A file has unsynced data.
    Dirty(Arc<Kept>),
    /// Files to delete after a round.
    Leaving(Vec<Leaving>),
}

/// The thread's end of the channel, and what it knows.
struct Rounds {
    messages: Receiver<Message>,
    /// The scratch folder, and its path.
    folder: File,
    path: PathBuf,
    io: Arc<IoCounters>,
    failed: Arc<Failed>,
    deleting: Arc<Mutex<()>>,
    journals: Vec<Arc<File>>,
    dirty: Vec<Arc<Kept>>,
    leaving: Vec<Leaving>,
}

/// The run is over, or it has to end.
struct Over;

impl Rounds {
    fn take(&mut self, message: Message) {
        match message {
            Message::Journal(file) => self.journals.push(file),
            Message::Dirty(file) => self.dirty.push(file),
            Message::Leaving(files) => self.leaving.extend(files),
        }
    }

    /// Notes what could not be synced: `path`, or something in that folder.
    fn synced(&self, path: &Path, done: io::Result<()>) -> Result<(), Over> {
        done.map_err(|error| {
            let _ = self.failed.set((path.to_path_buf(), error));
            Over
        })
    }

    /// Takes all messages that are there.
    fn take_all(&mut self) -> Result<(), Over> {
        loop {
            match self.messages.try_recv() {
                Ok(message) => self.take(message),
                Err(TryRecvError::Empty) => return Ok(()),
                Err(TryRecvError::Disconnected) => return Err(Over),
            }
        }
    }

    fn run(mut self, time: Duration) -> Result<(), Over> {
        loop {
            let due = after(time);
            while self.leaving.is_empty() {
                select! {
                    recv(self.messages) -> message => self.take(message.map_err(|_| Over)?),
                    recv(due) -> _ => break,
                }
            }
            self.round()?;
        }
    }

    fn round(&mut self) -> Result<(), Over> {
        self.take_all()?;
        let leaving = std::mem::take(&mut self.leaving);
        for file in std::mem::take(&mut self.dirty) {
            // The end of the run does not wait for more than one sync, and nobody waits for that.
            self.take_all()?;
            self.synced(&file.path, file.sync())?;
        }
        // Syncs the names of new files.
        self.synced(
            &self.path,
            sync(|| outcrop_platform::sync_names(&self.folder)),
        )?;
        for journal in &self.journals {
            self.synced(&self.path, sync(|| journal.sync_data()))?;
        }
        fault::point(Event::Synced);
        let deleting = self.deleting.clone();
        for file in leaving {
            let _deleting = lock(&deleting);
            self.take_all()?;
            file.delete(&self.io);
        }
        Ok(())
    }
}

/// Sends messages to the thread; dropping it ends the thread.
#[derive(Debug)]
pub struct Keeper {
    /// Not bounded, since nobody must wait: one message for each unsynced, leaving or journal file.
    messages: Option<Sender<Message>>,
    io: Arc<IoCounters>,
    failed: Arc<Failed>,
    /// Locked while the thread deletes a file.
    deleting: Arc<Mutex<()>>,
}

impl Keeper {
    /// Starts the thread.
    ///
    /// # Errors
    /// Errors of the system.
    pub fn start(journal: Arc<File>, folder: &Path, io: Arc<IoCounters>) -> io::Result<Self> {
        Self::every(ROUND, journal, folder, io)
    }

    fn every(
        time: Duration,
        journal: Arc<File>,
        folder: &Path,
        io: Arc<IoCounters>,
    ) -> io::Result<Self> {
        let (sender, messages) = unbounded();
        let deleting: Arc<Mutex<()>> = Arc::default();
        let failed: Arc<Failed> = Arc::default();
        let rounds = Rounds {
            messages,
            folder: outcrop_platform::open_folder(folder)?,
            path: folder.to_path_buf(),
            io: io.clone(),
            failed: failed.clone(),
            deleting: deleting.clone(),
            journals: vec![journal],
            dirty: Vec::new(),
            leaving: Vec::new(),
        };
        let thread = std::thread::Builder::new().name("outcrop-keeper".into());
        thread.spawn(move || rounds.run(time))?;
        Ok(Self {
            messages: Some(sender),
            io,
            failed,
            deleting,
        })
    }

    /// Fails if something could not be synced.
    ///
    /// # Errors
    /// [`Error::Io`] with the file, or with the folder for its names and journals.
    pub fn check(&self) -> Result<()> {
        let Some((path, error)) = self.failed.get() else {
            return Ok(());
        };
        let again = error.raw_os_error().map(io::Error::from_raw_os_error);
        let again = again.unwrap_or_else(|| io::Error::new(error.kind(), error.to_string()));
        Err(Error::io(path, "sync", again))
    }

    fn send(&self, message: Message) {
        // The thread is there until the sender is dropped, or until something could not be synced.
        let _ = self.messages.as_ref().map(|thread| thread.send(message));
    }

    /// Notes a journal that is synced in every round.
    pub fn journal(&self, file: Arc<File>) {
        self.send(Message::Journal(file));
    }

    /// Notes that a file was written to.
    pub fn sync_later(&self, file: &Arc<Kept>) {
        if file.add(DIRTY) & DIRTY == 0 {
            self.send(Message::Dirty(file.clone()));
        }
    }

    /// Deletes files; the journal already records their deletion. A file that was never synced would not
    /// survive a loss of power anyway, so it is deleted at once, which frees its space even during a sync.
    ///
    /// # Errors
    /// [`Error::Io`] if something could not be synced: all files are kept then.
    pub fn delete(&self, files: impl Iterator<Item = Leaving>) -> Result<()> {
        self.check()?;
        let synced = |file: &Leaving| file.0.add(UNNEEDED) & SYNCED != 0;
        let (leaving, fresh): (Vec<_>, Vec<_>) = files.partition(synced);
        if !leaving.is_empty() {
            self.send(Message::Leaving(leaving));
        }
        fresh.iter().for_each(|file| file.delete(&self.io));
        Ok(())
    }
}

impl Drop for Keeper {
    fn drop(&mut self) {
        // After the run the folder may belong to another run: nothing is deleted then.
        self.messages = None;
        drop(lock(&self.deleting));
    }
}

#[cfg(test)]
mod tests;
