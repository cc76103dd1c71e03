//! The end of an attempt: its journal gets the name that others look for.

use super::{GENERATIONS, MANIFEST, SharedFolder, Took};
use crate::error::{Error, Result};
use crate::workspace::Workspace;
use crate::workspace::away::Away;
use crate::workspace::fault::{self, Event};
use crate::workspace::journal::{Failure, OpenStep, Record};
use crate::workspace::listing::data;
use crate::workspace::open::open_existing;
use crate::workspace::run::ResumableRun;
use std::fs::File;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Most rounds of removing a folder, and the time between them.
const REMOVALS: u32 = 20;
const REMOVAL_PAUSE: Duration = Duration::from_millis(100);

impl SharedFolder {
    /// Deletes the segments of an attempt that failed, or that came too late. Its journal stays, so that it
    /// is counted.
    pub fn withdraw(&self, workspace: &Workspace) {
        let made = workspace.segments_made();
        for path in &made {
            let _ = std::fs::remove_file(path);
        }
        if let Some(away) = &self.away {
            away.end_beat();
            away.delete(&made);
        }
    }

    /// Publishes the work of a task; false if another attempt was faster, or its generation is over.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Disk`].
    pub fn end_task(&self, workspace: &Workspace, task: (u64, u32), took: Took) -> Result<bool> {
        let path = workspace.seal(&[Record::Took(took)])?;
        let done = self.done(task.0, task.1);
        if let Some(away) = &self.away {
            let first = publish(away, &path, &done, workspace)?;
            if first && self.is_over(task.0)? {
                away.delete(&[done]);
                return Ok(false);
            }
            return Ok(first);
        }
        match link(&path, &done) {
            // The generation is over, and its folder is gone.
            Err(Error::Io { source, .. }) if source.kind() == ErrorKind::NotFound => Ok(false),
            other => other,
        }
    }

    /// Publishes the next generation; false if another process was faster. What nobody needs any more is then
    /// deleted.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Disk`].
    pub fn end_next(
        &self,
        workspace: &Workspace,
        number: u64,
        took: Took,
        finished: bool,
    ) -> Result<bool> {
        let end = match finished {
            true => Record::Finished,
            false => Record::Open(workspace.take_open()),
        };
        let path = workspace.seal(&[Record::Took(took), end])?;
        let generation = self.generation(number);
        let first = match &self.away {
            Some(away) => publish(away, &path, &generation, workspace)?,
            None => link(&path, &generation)?,
        };
        if !first {
            return Ok(false);
        }
        let _ = self.remove_file(&path);
        if self.is_gone()? {
            let _ = self.remove_file(&generation);
            return Ok(false);
        }
        if !finished {
            // What others have been told of must stay; what is not deleted now does no harm.
            let _ = self.clean(number);
        }
        Ok(true)
    }

    /// Deletes what no process of generation `number` needs. Names of generations stay, so that a process
    /// that was late cannot take one.
    fn clean(&self, number: u64) -> Result<()> {
        if let Some(away) = &self.away {
            return self.clean_away(away, number);
        }
        let now = self.read(number)?;
        let needed = now.history.segments();
        let files = data(&self.path)?.into_iter();
        for name in files.filter(|name| now.is_of_before(name) && !needed.contains(name)) {
            let _ = std::fs::remove_file(self.path.join(name));
        }
        for old in (0..number).rev() {
            let _ = std::fs::remove_dir_all(self.tasks(old));
            let path = self.generation(old);
            // All before the first empty one are empty.
            if path.metadata().map_or(true, |meta| meta.len() == 0) {
                break;
            }
            if old + 1 < number {
                let _ = File::create(&path);
            }
        }
        Ok(())
    }

    /// Removes the folder of a finished run. What tells that this is its folder goes last, so that whoever
    /// is killed meanwhile can begin again.
    pub fn remove(&self) {
        if let Some(away) = &self.away {
            return self.remove_away(away);
        }
        for _ in 0..REMOVALS {
            let last = [GENERATIONS, MANIFEST];
            remove_inside(&self.path, |name| !last.contains(&name));
            remove_inside(&self.path.join(GENERATIONS), |_| true);
            // A network file system keeps a file under another name as long as it is open here.
            if self.is_left_over() {
                let _ = std::fs::remove_file(self.path.join(MANIFEST));
                let _ = std::fs::remove_dir(self.path.join(GENERATIONS));
            }
            // It fails unless the folder is empty, as when a late process has put a file there meanwhile.
            if std::fs::remove_dir(&self.path).is_ok() || !self.path.exists() {
                return;
            }
            std::thread::sleep(REMOVAL_PAUSE);
        }
    }

    /// True if no generation is left: the folder is being removed, or its removal was interrupted.
    #[must_use]
    pub fn is_left_over(&self) -> bool {
        let generations = self.entries(&self.path.join(GENERATIONS));
        generations.is_ok_and(|names| names.is_empty())
    }
}

/// Deletes what is in a folder as far as it can be deleted, if `which` is true for its name.
fn remove_inside(folder: &Path, which: impl Fn(&str) -> bool) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        if entry.file_name().to_str().is_none_or(&which) {
            let path = entry.path();
            let _ = match entry.file_type().is_ok_and(|kind| kind.is_dir()) {
                true => std::fs::remove_dir_all(&path),
                false => std::fs::remove_file(&path),
            };
        }
    }
}

pub(super) fn sync(path: &Path) -> Result<()> {
    match open_existing(path).and_then(|file| file.sync_all()) {
        Err(e) if e.kind() != ErrorKind::NotFound => Err(Error::io(path, "sync", e)),
        _ => Ok(()),
    }
}

/// Puts a journal as the object that others look for; false if there is one.
fn publish(away: &Away, from: &Path, to: &Path, workspace: &Workspace) -> Result<bool> {
    fault::point(Event::Publish);
    away.end_beat();
    let first = away.publish(from, to, &workspace.memory)?;
    fault::point(Event::Published);
    Ok(first)
}

/// Gives a file a second name; false if it exists.
pub(super) fn link(from: &Path, to: &Path) -> Result<bool> {
    fault::point(Event::Publish);
    match std::fs::hard_link(from, to) {
        Ok(()) => {
            fault::point(Event::Published);
            Ok(true)
        }
        // The reply of a server may have been lost after it made the link.
        Err(_) if outcrop_platform::links(from) == Some(2) => Ok(true),
        Err(e) if e.kind() == ErrorKind::AlreadyExists => Ok(false),
        Err(e) => Err(Error::io(to, "link a finished journal to", e)),
    }
}

impl Workspace {
    /// Segments that this process made, of a run that tasks share.
    fn segments_made(&self) -> Vec<PathBuf> {
        self.run()
            .map_or_else(Vec::new, ResumableRun::segments_made)
    }

    /// Notes in the journal of this process why it failed, for those who ask for the state of the run. An
    /// error that tells of damaged scratch files, the work of others, is returned as a value.
    ///
    /// # Errors
    /// Any other error.
    pub fn note_failure(&self, error: Error) -> Result<Error> {
        let Some(run) = self.run() else {
            return Err(error);
        };
        let damage = match &error {
            Error::Corrupt { path, .. } => path.starts_with(&self.folder),
            Error::Io { path, source, .. } => {
                let lost = matches!(
                    source.kind(),
                    ErrorKind::NotFound | ErrorKind::UnexpectedEof
                );
                lost && path.starts_with(&self.folder)
            }
            _ => false,
        };
        let why = error.to_string();
        // It may be the disk that is full.
        let _ = run
            .journal()
            .append(Record::Failed(Failure { why, damage }));
        if let Some(away) = run.away() {
            away.end_beat();
            let _ = away.put(run.journal().path());
        }
        match damage {
            true => Ok(error),
            false => Err(error),
        }
    }

    fn take_open(&self) -> Vec<OpenStep> {
        self.run().map_or_else(Vec::new, ResumableRun::take_open)
    }

    /// Ends the journal of this process with `records` and syncs all that it wrote; returns its path.
    fn seal(&self, records: &[Record]) -> Result<PathBuf> {
        let Some(run) = self.run() else {
            return Ok(PathBuf::new());
        };
        for path in run.segments_made().iter().chain(&run.files_touched()) {
            sync(path)?;
        }
        if let Some(away) = run.away() {
            away.put_all(&run.segments_made(), &self.memory)?;
        }
        let journal = run.journal();
        for record in records {
            let mut record = record.clone();
            if let (Record::Took(took), Some(away)) = (&mut record, run.away()) {
                took.traffic = away.traffic();
            }
            journal.append(record)?;
        }
        sync(journal.path())?;
        Ok(journal.path().to_path_buf())
    }
}
