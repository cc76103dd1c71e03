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

/// Between two rounds of syncing, if no file waits to be deleted. One that does is room that the run
/// may need, so it does not wait for the time of a round.
const ROUND: Duration = Duration::from_secs(5);

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

    /// Waits for the time of the next round, or for a file to be deleted; false when there is none.
    fn wait(&self, round: Duration) -> bool {
        let idle = |state: &mut State| !state.stop && state.leaving.is_empty();
        let waited = self.wake.wait_timeout_while(self.state(), round, idle);
        !waited.unwrap_or_else(PoisonError::into_inner).0.stop
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
        Self::every(ROUND, journal, folder, io)
    }

    fn every(
        time: Duration,
        journal: Arc<File>,
        folder: File,
        io: Arc<IoCounters>,
    ) -> std::io::Result<Self> {
        let table = Arc::new(Table::default());
        let (shared, counters) = (table.clone(), io.clone());
        let work = move || {
            while shared.wait(time) {
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
            // Nobody will read it, so it need not be synced any more either.
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
        // Nobody waits for a sync that is under way.
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
