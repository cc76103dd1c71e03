//! A thread that protects a run from a loss of power: it syncs written files every few seconds, and deletes
//! unneeded files once that is safe.
//!
//! A killed process needs no sync, since written data are in the system's cache. No other thread waits for
//! this one, so a loss of power costs at most a few seconds of work.

use super::fault::{self, Event};
use super::{IoCounters, lock};
use std::collections::HashSet;
use std::fs::File;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Time between two rounds of syncing, if no file waits to be deleted. A file that waits triggers a round at
/// once, since the run may need its space.
const ROUND: Duration = Duration::from_secs(5);

/// A file to delete, and its size.
#[derive(Debug)]
pub struct Leaving {
    /// Name of the file.
    pub name: Arc<str>,
    /// Path of the file.
    pub path: PathBuf,
    /// Scratch bytes that its deletion frees.
    pub bytes: u64,
}

impl Leaving {
    /// Deletes the file at once.
    pub fn delete(&self, io: &IoCounters) {
        fault::point(Event::Delete);
        // A scratch file that cannot be deleted is deleted with its folder.
        let _ = std::fs::remove_file(&self.path);
        io.shrink_scratch(self.bytes);
    }
}

/// A file with unsynced data.
#[derive(Debug)]
struct Dirty {
    name: Arc<str>,
    file: Arc<File>,
    flag: Arc<AtomicBool>,
}

#[derive(Debug, Default)]
struct State {
    journals: Vec<Arc<File>>,
    dirty: Vec<Dirty>,
    /// Files of this attempt without any synced data.
    fresh: HashSet<Arc<str>>,
    leaving: Vec<Leaving>,
    stop: bool,
}

#[derive(Debug, Default)]
struct Table {
    state: Mutex<State>,
    wake: Condvar,
}

/// The thread and its queue.
#[derive(Debug)]
pub struct Keeper {
    table: Arc<Table>,
    io: Arc<IoCounters>,
}

impl Table {
    fn state(&self) -> MutexGuard<'_, State> {
        lock(&self.state)
    }

    /// Waits for the next round or for a file to delete; false if the thread has to stop.
    fn wait(&self, round: Duration) -> bool {
        let idle = |state: &mut State| !state.stop && state.leaving.is_empty();
        let waited = self.wake.wait_timeout_while(self.state(), round, idle);
        !waited.unwrap_or_else(PoisonError::into_inner).0.stop
    }

    fn round(&self, folder: &File, io: &IoCounters) {
        let (dirty, leaving, journals) = {
            let mut state = self.state();
            let dirty = std::mem::take(&mut state.dirty);
            for file in &dirty {
                state.fresh.remove(&file.name);
            }
            let leaving = std::mem::take(&mut state.leaving);
            (dirty, leaving, state.journals.clone())
        };
        for Dirty { file, flag, .. } in dirty {
            if self.state().stop {
                return;
            }
            flag.store(false, Ordering::Relaxed);
            // Unsynced data are found by their checksums when the run is resumed.
            let _ = file.sync_data();
        }
        // Syncs the names of new files.
        let _ = folder.sync_all();
        for journal in journals {
            let _ = journal.sync_data();
        }
        fault::point(Event::Synced);
        for file in leaving {
            // After the run the folder may belong to another run.
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
    /// Errors of the system.
    pub fn start(journal: Arc<File>, folder: File, io: Arc<IoCounters>) -> std::io::Result<Self> {
        Self::every(ROUND, journal, folder, io)
    }

    fn every(
        time: Duration,
        journal: Arc<File>,
        folder: File,
        io: Arc<IoCounters>,
    ) -> std::io::Result<Self> {
        let table = Arc::new(Table::default());
        table.state().journals.push(journal);
        let (shared, counters) = (table.clone(), io.clone());
        let work = move || {
            while shared.wait(time) {
                shared.round(&folder, &counters);
            }
        };
        let thread = std::thread::Builder::new().name("outcrop-keeper".into());
        thread.spawn(work)?;
        Ok(Self { table, io })
    }

    /// Notes a journal that is synced in every round.
    pub fn journal(&self, file: Arc<File>) {
        self.table.state().journals.push(file);
    }

    /// Notes a new file.
    pub fn made(&self, name: &Arc<str>) {
        self.table.state().fresh.insert(name.clone());
    }

    /// Notes a file that was written to.
    pub fn sync_later(&self, name: &Arc<str>, file: &Arc<File>, flag: &Arc<AtomicBool>) {
        self.table.state().dirty.push(Dirty {
            name: name.clone(),
            file: file.clone(),
            flag: flag.clone(),
        });
    }

    /// Notes files to delete; the journal already records their deletion. A file that was never synced would
    /// not survive a loss of power anyway, so it is deleted at once.
    pub fn delete(&self, files: Vec<Leaving>) {
        let mut now = Vec::new();
        let mut state = self.table.state();
        for file in files {
            // It will not be read, so it needs no sync.
            state.dirty.retain(|dirty| dirty.name != file.name);
            if state.fresh.remove(&file.name) {
                now.push(file);
            } else {
                state.leaving.push(file);
            }
        }
        let waits = !state.leaving.is_empty();
        drop(state);
        if waits {
            self.table.wake.notify_all();
        }
        now.iter().for_each(|file| file.delete(&self.io));
    }
}

impl Drop for Keeper {
    fn drop(&mut self) {
        // The end of the run does not wait for a sync under way.
        self.table.state().stop = true;
        self.table.wake.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_may_have_been_synced_goes_without_waiting_for_a_round() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str| {
            let path = folder.path().join(name);
            (File::create(&path).unwrap(), path)
        };
        let never = Duration::from_secs(1 << 20);
        let (journal, (_, path)) = (file("journal").0, file("left"));
        let io = Arc::new(IoCounters::default());
        io.grow_scratch(7);
        let opened = File::open(folder.path()).unwrap();
        let keeper = Keeper::every(never, Arc::new(journal), opened, io.clone()).unwrap();
        keeper.delete(vec![Leaving {
            name: "left".into(),
            path: path.clone(),
            bytes: 7,
        }]);
        while path.exists() || io.scratch() > 0 {
            std::thread::sleep(Duration::from_millis(1));
        }
    }
}
