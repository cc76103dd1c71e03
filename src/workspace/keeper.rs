//! What makes a run outlive a loss of power: a thread that syncs what was written every few seconds,
//! and deletes what is not needed any more once that is safe.
//!
//! A process that is killed needs none of this: the system has what was written. Nobody waits for the
//! thread, so a run loses at most the work of a few seconds.

use super::IoCounters;
use super::fault::{self, Event};
use std::fs::File;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Time between two rounds of syncing.
const ROUND: Duration = Duration::from_secs(5);
/// The same while there are files to delete.
const SOON: Duration = Duration::from_secs(1);

/// A file that is not needed any more, and its size.
#[derive(Debug)]
pub struct Leaving {
    /// Where it is.
    pub path: PathBuf,
    /// Bytes of scratch that go with it.
    pub bytes: u64,
}

#[derive(Debug, Default)]
struct State {
    dirty: Vec<(Arc<File>, Arc<AtomicBool>)>,
    leaving: Vec<Leaving>,
    stop: bool,
}

#[derive(Debug, Default)]
struct Table {
    state: Mutex<State>,
    wake: Condvar,
}

/// The thread, and what it has to do.
#[derive(Debug)]
pub struct Keeper {
    table: Arc<Table>,
    thread: Option<std::thread::JoinHandle<()>>,
}

impl Table {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits for the time of the next round; false when there is none.
    fn wait(&self) -> bool {
        let mut state = self.state();
        let pause = if state.leaving.is_empty() { ROUND } else { SOON };
        if !state.stop {
            let waited = self.wake.wait_timeout(state, pause);
            state = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
        !state.stop
    }

    fn round(&self, journal: &File, io: &IoCounters) {
        let (dirty, leaving) = {
            let mut state = self.state();
            (
                std::mem::take(&mut state.dirty),
                std::mem::take(&mut state.leaving),
            )
        };
        for (file, flag) in dirty {
            flag.store(false, Ordering::Relaxed);
            // What did not get to the disk is found by its checksum when the run is resumed.
            let _ = file.sync_data();
        }
        let _ = journal.sync_data();
        fault::point(Event::Synced);
        for file in leaving {
            fault::point(Event::Delete);
            // A scratch file that cannot be deleted goes with its folder.
            let _ = std::fs::remove_file(&file.path);
            io.shrink_scratch(file.bytes);
        }
    }
}

impl Keeper {
    /// Starts the thread.
    ///
    /// # Errors
    /// What the system says.
    pub fn start(journal: Arc<File>, io: Arc<IoCounters>) -> std::io::Result<Self> {
        let table = Arc::new(Table::default());
        let shared = table.clone();
        let work = move || {
            while shared.wait() {
                shared.round(&journal, &io);
            }
        };
        let thread = std::thread::Builder::new().name("outcrop-keeper".into());
        Ok(Self {
            thread: Some(thread.spawn(work)?),
            table,
        })
    }

    /// Takes in a file that was written to.
    pub fn sync_later(&self, file: &Arc<File>, flag: &Arc<AtomicBool>) {
        let mut state = self.table.state();
        state.dirty.push((file.clone(), flag.clone()));
    }

    /// Takes in files that nobody needs; the journal says so already.
    pub fn delete_later(&self, files: Vec<Leaving>) {
        if !files.is_empty() {
            self.table.state().leaving.extend(files);
            self.table.wake.notify_all();
        }
    }
}

impl Drop for Keeper {
    fn drop(&mut self) {
        self.table.state().stop = true;
        self.table.wake.notify_all();
        if let Some(thread) = self.thread.take() {
            // It cannot panic.
            let _ = thread.join();
        }
    }
}
