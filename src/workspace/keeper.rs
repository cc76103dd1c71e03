//! What makes a run outlive a loss of power: a thread that syncs what was written every few seconds,
//! and deletes what is not needed any more once that is safe.
//!
//! A process that is killed needs none of this: the system has what was written. Nobody waits for the
//! thread, so a run loses at most the work of a few seconds.

use super::IoCounters;
use super::fault::{self, Event};
use std::collections::HashSet;
use std::fs::File;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// How often there is a look at what to do.
const LOOK: Duration = Duration::from_millis(250);
/// Looks between two rounds of syncing, if no file waits to be deleted.
const ROUND: u32 = 20;

/// A file that is not needed any more, and its size.
#[derive(Debug)]
pub struct Leaving {
    /// Its name.
    pub name: Arc<str>,
    /// Where it is.
    pub path: PathBuf,
    /// Bytes of scratch that go with it.
    pub bytes: u64,
}

impl Leaving {
    fn delete(&self, io: &IoCounters) {
        fault::point(Event::Delete);
        // A scratch file that cannot be deleted goes with its folder.
        let _ = std::fs::remove_file(&self.path);
        io.shrink_scratch(self.bytes);
    }
}

/// A file that was written to.
#[derive(Debug)]
struct Dirty {
    name: Arc<str>,
    file: Arc<File>,
    flag: Arc<AtomicBool>,
}

#[derive(Debug, Default)]
struct State {
    dirty: Vec<Dirty>,
    /// Files of this attempt of which nothing was synced yet.
    fresh: HashSet<Arc<str>>,
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
    io: Arc<IoCounters>,
}

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
            let dirty = std::mem::take(&mut state.dirty);
            for file in &dirty {
                state.fresh.remove(&file.name);
            }
            (dirty, std::mem::take(&mut state.leaving))
        };
        for Dirty { file, flag, .. } in dirty {
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
            // Once the run is over, the folder may be that of another one.
            let state = self.state();
            if state.stop {
                return;
            }
            file.delete(io);
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
        let (shared, counters) = (table.clone(), io.clone());
        let work = move || {
            while shared.wait() {
                shared.round(&journal, &folder, &counters);
            }
        };
        let thread = std::thread::Builder::new().name("outcrop-keeper".into());
        thread.spawn(work)?;
        Ok(Self { table, io })
    }

    /// Takes in a new file.
    pub fn made(&self, name: &Arc<str>) {
        self.table.state().fresh.insert(name.clone());
    }

    /// Takes in a file that was written to.
    pub fn sync_later(&self, name: &Arc<str>, file: &Arc<File>, flag: &Arc<AtomicBool>) {
        self.table.state().dirty.push(Dirty {
            name: name.clone(),
            file: file.clone(),
            flag: flag.clone(),
        });
    }

    /// Takes in files that nobody needs; the journal says so already. One that was never synced would
    /// not outlive a loss of power anyway, so it is deleted at once.
    pub fn delete(&self, files: Vec<Leaving>) {
        let mut now = Vec::new();
        let mut state = self.table.state();
        for file in files {
            if state.fresh.remove(&file.name) {
                state.dirty.retain(|dirty| dirty.name != file.name);
                now.push(file);
            } else {
                state.leaving.push(file);
            }
        }
        drop(state);
        now.iter().for_each(|file| file.delete(&self.io));
    }
}

impl Drop for Keeper {
    fn drop(&mut self) {
        // Nobody waits for a sync that is under way.
        self.table.state().stop = true;
        self.table.wake.notify_all();
    }
}
