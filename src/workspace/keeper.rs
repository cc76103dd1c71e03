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

/// How often there is a look at what to do.
const LOOK: Duration = Duration::from_secs(1);
/// Looks between two rounds of syncing, if no file waits to be deleted.
const ROUND: u32 = 5;

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
pub struct Keeper(Arc<Table>);

impl Table {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits for the time of the next round; false when there is none.
    fn wait(&self) -> bool {
        let mut state = self.state();
        for look in 1.. {
            if state.stop {
                return false;
            }
            let waited = self.wake.wait_timeout(state, LOOK);
            state = waited.unwrap_or_else(PoisonError::into_inner).0;
            if look >= ROUND || !state.leaving.is_empty() {
                break;
            }
        }
        !state.stop
    }

    fn round(&self, journal: &File, folder: &File, io: &IoCounters) {
        let (dirty, leaving) = {
            let mut state = self.state();
            (
                std::mem::take(&mut state.dirty),
                std::mem::take(&mut state.leaving),
            )
        };
        for (file, flag) in dirty {
            if self.state().stop {
                return;
            }
            flag.store(false, Ordering::Relaxed);
            // What did not get to the disk is found by its checksum when the run is resumed.
            let _ = file.sync_data();
        }
        // The names of new files, too.
        let _ = folder.sync_all();
        let _ = journal.sync_data();
        fault::point(Event::Synced);
        for file in leaving {
            fault::point(Event::Delete);
            // Once the run is over, the folder may be that of another one.
            let state = self.state();
            if state.stop {
                return;
            }
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
    pub fn start(journal: Arc<File>, folder: File, io: Arc<IoCounters>) -> std::io::Result<Self> {
        let table = Arc::new(Table::default());
        let shared = table.clone();
        let work = move || {
            while shared.wait() {
                shared.round(&journal, &folder, &io);
            }
        };
        let thread = std::thread::Builder::new().name("outcrop-keeper".into());
        thread.spawn(work)?;
        Ok(Self(table))
    }

    /// Takes in a file that was written to.
    pub fn sync_later(&self, file: &Arc<File>, flag: &Arc<AtomicBool>) {
        let mut state = self.0.state();
        state.dirty.push((file.clone(), flag.clone()));
    }

    /// Takes in files that nobody needs; the journal says so already.
    pub fn delete_later(&self, files: Vec<Leaving>) {
        self.0.state().leaving.extend(files);
    }
}

impl Drop for Keeper {
    fn drop(&mut self) {
        // Nobody waits for a sync that is under way.
        self.0.state().stop = true;
        self.0.wake.notify_all();
    }
}
