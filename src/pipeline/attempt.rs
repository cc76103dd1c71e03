//! One attempt at a run: its beginning, its time limit, and the removal of its scratch files.

use super::away::is_store;
use super::hidden::open_of;
use super::manifest::Manifest;
use super::{Reconstruction, Start, beside, levels};
use crossbeam_channel::{RecvTimeoutError, Sender, bounded};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::progress::Cancel;
use outcrop_disk::workspace::{Folder, Found, Workspace, fault};
use outcrop_mesh_files::export;
use std::path::Path;
use std::time::Duration;

/// Raises a flag when the time is up, unless it is dropped before.
#[derive(Debug)]
pub(super) struct Alarm(#[expect(dead_code, reason = "dropping it is the message")] Sender<()>);

/// Time before the limit at which the run is stopped.
fn margin(limit: Duration) -> Duration {
    Duration::from_secs(5).min(limit / 10)
}

impl Alarm {
    pub fn set(limit: Duration, cancel: Cancel) -> Self {
        let (sender, receiver) = bounded(0);
        let wait = limit.saturating_sub(margin(limit));
        std::thread::spawn(move || {
            if receiver.recv_timeout(wait) == Err(RecvTimeoutError::Timeout) {
                cancel.expire();
            }
        });
        Self(sender)
    }
}

impl Reconstruction {
    /// The scratch folder of this run, from which it can be resumed.
    #[must_use]
    pub fn scratch_folder(&self) -> &Path {
        &self.folder
    }

    /// True if the run is unfinished and can be resumed.
    #[must_use]
    pub fn is_unfinished(&self) -> bool {
        Folder::has_progress(&self.folder)
    }

    pub(super) fn open(&self) -> Result<Workspace> {
        if is_store(&self.folder) {
            return Err(Error::Parameter {
                name: "scratch",
                found: self.folder.display().to_string(),
                expected: "a folder; runs that tasks share (`outcrop plan`) can be in a store"
                    .into(),
            });
        }
        let manifest = Manifest::of(self)?;
        let bytes = manifest.to_bytes()?;
        let found = match self.start {
            Start::Resume => Folder::find_when_free(&self.folder, &*self.observer, &self.cancel)?,
            Start::New | Start::Restart => Folder::find(&self.folder)?,
        };
        let is_left = matches!(found, Found::Run(_) | Found::Damaged(_));
        if is_left && self.start == Start::New && self.is_unfinished() {
            return Err(Error::Unfinished {
                path: self.folder.clone(),
            });
        }
        if let Some(delivery) = &self.delivery
            && !matches!((&found, self.start), (Found::Run(_), Start::Resume))
        {
            delivery
                .begin(&*self.observer)
                .inspect_err(|_| delivery.end(&*self.observer))?;
        }
        let mut folder = match (found, self.start) {
            (Found::Nothing, _) => Folder::create(&self.folder, bytes)?,
            (Found::Run(folder), Start::Resume) => {
                let mut was = Manifest::from_bytes(&self.folder, &folder.manifest)?;
                if self.goes_on {
                    was.write_elsewhere(&manifest);
                }
                was.check(&manifest, &self.folder)?;
                folder
            }
            (Found::Run(folder) | Found::Damaged(folder), _) => folder.restart(bytes)?,
        };
        folder.output = [export::temporary(&self.mesh), self.mesh.clone()];
        let workspace = Workspace::resumable(
            folder,
            self.memory.clone(),
            self.threads,
            self.observer.clone(),
            self.cancel.clone(),
        );
        let workspace = workspace.and_then(|workspace| {
            workspace.set_storage(self.storage)?;
            Ok(workspace)
        });
        if workspace.is_err() && !self.is_unfinished() {
            Folder::remove(&self.folder, false);
        }
        workspace
    }

    /// Removes the scratch folder, unless the run can be resumed.
    pub(super) fn close<T>(&self, workspace: Workspace, outcome: &Result<T>) {
        let keep = outcome.as_ref().is_err_and(Error::can_resume) && self.is_unfinished();
        if !keep {
            workspace.remove(outcome.is_ok());
            // An unfinished mesh; if it cannot be deleted it does no harm.
            let _ = std::fs::remove_file(export::temporary(&self.mesh));
            if let Some(tiles) = &self.tiles {
                levels::remove_unfinished(tiles);
                beside::remove(&self.mesh);
            }
            if let Some(made) = &self.made {
                let _ = std::fs::remove_file(export::temporary(made));
                let _ = std::fs::remove_file(open_of(made));
                let _ = std::fs::remove_file(&self.mesh);
            }
            if self.params.split.is_some() {
                export::remove_unfinished(&self.mesh);
            }
            if let Some(delivery) = &self.delivery {
                delivery.end(&*self.observer);
            }
        }
        // The workspace has the lock, which must outlive the files.
        drop(workspace);
        fault::finish();
    }
}
