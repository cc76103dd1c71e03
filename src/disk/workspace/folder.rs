//! The scratch folder of a run that can be resumed: private and locked.

mod journals;

use super::IoCounters;
use super::fault::{self, Event};
use super::history::History;
use super::journal::{self, Journal, Record};
use super::keeper::Keeper;
use super::listing::{LOCK, MANIFEST, OURS, data, is_ours, listing};
use super::memory::MemoryPool;
use super::open::{failed_write, open_existing, options};
use super::progress::{Cancel, Observer};
use super::recover::{Whereabouts, recover};
use super::run::{ResumableRun, Role};
use crate::error::{Error, Remedy, Result};
use journals::{Ends, read_history, workers};
use outcrop_platform::{FileAt, make_private_folder};
use std::collections::HashSet;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Upper bound of the bytes that a journal and its first record have in addition to the manifest.
const FIRST_RECORD: u64 = 64;

/// A locked scratch folder.
#[derive(Debug)]
pub struct Folder {
    /// Path of the folder.
    pub path: PathBuf,
    /// The manifest of the run.
    pub manifest: Vec<u8>,
    /// The temporary path of the output, and its final path.
    pub output: [PathBuf; 2],
    lock: File,
    /// True if there is a journal with the manifest.
    begun: bool,
    /// Warnings about the state of the folder.
    warnings: Vec<String>,
    /// True if the manifest must be written again.
    rewrite: bool,
}

/// The result of looking for a run.
#[derive(Debug)]
pub enum Found {
    /// No folder, or a folder in which no run began.
    Nothing,
    /// An unfinished run.
    Run(Folder),
    /// A run with an unreadable manifest.
    Damaged(Folder),
}

/// A manifest with its checksum.
pub(super) fn sealed(manifest: &[u8]) -> Vec<u8> {
    let seal = format!("\n{:08x}\n", crc32fast::hash(manifest));
    [manifest, seal.as_bytes()].concat()
}

pub(super) fn unsealed(bytes: &[u8]) -> Option<Vec<u8>> {
    let (manifest, _) = bytes.split_at_checked(bytes.len().checked_sub(10)?)?;
    (sealed(manifest) == bytes).then(|| manifest.to_vec())
}

impl Folder {
    /// Looks for a run at `path` and locks it.
    ///
    /// # Errors
    /// [`Error::Locked`]; [`Error::NotResumable`] for a folder that is not private or has another owner;
    /// [`Error::Io`].
    pub fn find(path: &Path) -> Result<Found> {
        if !is_private(path)? {
            return Ok(Found::Nothing);
        }
        let names = listing(path)?;
        if names.is_empty() {
            return Ok(Found::Nothing);
        }
        if is_shared(path) {
            let submit = Remedy::Command("submit", "to go on with it");
            return Err(Error::not_resumable(path, "tasks share the run here").with(submit));
        }
        if !names.iter().any(|name| is_ours(name)) {
            return Err(Error::not_resumable(
                path,
                "it is not a scratch folder of outcrop",
            ));
        }
        Self::locked(path, Vec::new())?.read()
    }

    /// Locks the folder `path`.
    fn locked(path: &Path, manifest: Vec<u8>) -> Result<Self> {
        Ok(Self {
            lock: lock(path)?,
            path: path.to_path_buf(),
            manifest,
            output: Default::default(),
            begun: false,
            warnings: Vec::new(),
            rewrite: false,
        })
    }

    fn read(mut self) -> Result<Found> {
        let mut in_journal = None;
        let _ = journal::read(&self.path.join(journal::NAME), None, |entry| {
            if let Record::Manifest(bytes) = entry.record {
                in_journal = Some(bytes.clone());
            }
            false
        });
        self.begun = in_journal.is_some();
        let path = self.path.join(MANIFEST);
        let bytes = open_existing(&path).and_then(|file| {
            let mut bytes = vec![0; file.metadata()?.len().min(64 << 20) as usize];
            file.read_exact_at(&mut bytes, 0)?;
            Ok(bytes)
        });
        let begun = bytes.is_ok() || self.begun;
        match (bytes.ok().and_then(|b| unsealed(&b)), in_journal) {
            (Some(manifest), Some(_)) => self.manifest = manifest,
            (Some(manifest), None) => {
                // A journal without a whole first record holds no work.
                let first = manifest.len() as u64 + FIRST_RECORD;
                let bytes = path_bytes(&self.path.join(journal::NAME));
                if bytes.is_none_or(|bytes| bytes <= first) && data(&self.path)?.is_empty() {
                    return Ok(Found::Nothing);
                }
                self.warn_of(journal::NAME, "the run begins again");
                self.manifest = manifest;
            }
            (None, Some(manifest)) => {
                self.manifest = manifest;
                self.warn_of(MANIFEST, "the journal has what it said");
                self.rewrite = true;
            }
            (None, None) if begun => {
                self.warn_of(MANIFEST, "the run begins again");
                return Ok(Found::Damaged(self));
            }
            (None, None) => return Ok(Found::Nothing),
        }
        Ok(Found::Run(self))
    }

    fn warn_of(&mut self, name: &str, what: &str) {
        let path = self.path.join(name);
        self.warnings
            .push(format!("{}: damaged; {what}", path.display()));
    }

    /// Creates the folder, or empties an existing one, for a new run.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Locked`], [`Error::Disk`].
    pub fn create(path: &Path, manifest: Vec<u8>) -> Result<Self> {
        if let Some(parent) = path.parent().filter(|p| !p.as_os_str().is_empty()) {
            std::fs::create_dir_all(parent)
                .map_err(|e| Error::io(parent, "make the scratch folder", e))?;
        }
        match make_private_folder(path) {
            Err(e) if e.kind() != std::io::ErrorKind::AlreadyExists => {
                return Err(Error::io(path, "make the scratch folder", e));
            }
            // Another process may have created it meanwhile.
            _ => is_private(path)?,
        };
        let begun = Self::locked(path, Vec::new())?.restart(manifest);
        begun.inspect_err(|_| _ = Self::remove(path, false))
    }

    /// Empties the folder for a new run.
    ///
    /// # Errors
    /// [`Error::Io`], [`Error::Disk`].
    pub fn restart(mut self, manifest: Vec<u8>) -> Result<Self> {
        self.manifest = manifest;
        self.begun = false;
        self.clean(&HashSet::from([LOCK]))?;
        self.write_manifest()?;
        Ok(self)
    }

    fn write_manifest(&self) -> Result<()> {
        let path = self.path.join(MANIFEST);
        let _ = std::fs::remove_file(&path);
        let bytes = sealed(&self.manifest);
        options()
            .create_new(true)
            .open(&path)
            .and_then(|file| file.write_all_at(&bytes, 0).and_then(|()| file.sync_all()))
            .map_err(|e| failed_write(&path, bytes.len(), 0, e))
    }

    /// Removes all files except those named in `but`.
    fn clean(&self, but: &HashSet<&str>) -> Result<()> {
        for name in listing(&self.path)? {
            if !but.contains(name.as_str()) {
                let path = self.path.join(&name);
                std::fs::remove_file(&path).map_err(|e| Error::io(&path, "delete", e))?;
            }
        }
        Ok(())
    }

    /// Removes a folder, in an order that may be interrupted: the rest is a folder of a run that begins, or,
    /// if the journal records that the data are deleted, of a finished one. False if the folder is left, with the names
    /// of files that are open, or with what cannot be deleted.
    pub fn remove(path: &Path, finished: bool) -> bool {
        let delete = |name: &str| {
            fault::point(Event::Delete);
            // A file that cannot be deleted does no harm.
            let _ = std::fs::remove_file(path.join(name));
        };
        if !finished {
            delete(journal::NAME);
            delete(MANIFEST);
        }
        let (ours, data): (Vec<String>, Vec<String>) = listing(path)
            .unwrap_or_default()
            .into_iter()
            .partition(|name| is_ours(name));
        data.iter().for_each(|name| delete(name));
        [MANIFEST, journal::NAME].into_iter().for_each(delete);
        // Without these, the journal of the program would seem damaged.
        let workers = ours.iter().filter(|name| journal::worker(name).is_some());
        workers.for_each(|name| delete(name));
        delete(LOCK);
        std::fs::remove_dir(path).is_ok() || !path.exists()
    }

    /// Opens the run in the folder on `threads` threads, with the results of earlier attempts.
    pub(super) fn open(
        self,
        threads: usize,
        memory: &MemoryPool,
        io: &Arc<IoCounters>,
        observer: &dyn Observer,
        cancel: &Cancel,
    ) -> Result<ResumableRun> {
        self.warnings.iter().for_each(|w| observer.warn(w));
        if self.rewrite {
            self.write_manifest()?;
        }
        let path = self.path.join(journal::NAME);
        let (history, journal) = if self.begun {
            let places = Whereabouts {
                folder: &self.path,
                output: &self.output,
                away: None,
            };
            let (mut history, mut ends) = read_history(&self.path, u64::MAX)?;
            if let Some(until) = recover(&mut history, &places, observer, cancel)? {
                (history, ends) = read_history(&self.path, until)?;
            }
            (history, self.go_on(&ends)?)
        } else {
            self.clean(&HashSet::from([LOCK, MANIFEST]))?;
            let journal = Journal::create(&path)?;
            journal.append(Record::Manifest(self.manifest.clone()))?;
            (History::default(), journal)
        };
        let held = memory.reserve("history", history.bytes())?;
        let segments = history.segments();
        let journals = workers(&self.path)?.into_iter().map(journal::of_worker);
        let journals: Vec<String> = journals.collect();
        let known = segments.iter().chain(&journals).map(String::as_str);
        self.clean(&known.chain(OURS).collect())?;
        // Also larger than the numbers of an attempt whose record was lost.
        let used = listing(&self.path)?;
        let used = used
            .iter()
            .filter_map(|name| name.rsplit_once('.')?.1.parse::<u32>().ok());
        let first = used.fold(history.next_worker(), |next, n| {
            next.max(n.saturating_add(1))
        });
        let next = first.checked_add(threads as u32 + 1);
        let next =
            next.ok_or_else(|| Error::not_resumable(&self.path, "it had too many attempts"))?;
        journal.append(Record::Attempt(next))?;
        let keeper = Keeper::start(journal.file(), &self.path, io.clone())
            .map_err(|e| Error::io(&self.path, "start a thread for", e))?;
        Ok(ResumableRun::new(
            self.path,
            Role::Alone(self.lock),
            (first, threads),
            (journal, path),
            keeper,
            (history, held),
        ))
    }

    /// Cuts all journals at these ends, and continues that of the program.
    fn go_on(&self, ends: &Ends) -> Result<Journal> {
        for (number, end) in &ends.workers {
            let path = self.path.join(journal::of_worker(*number));
            match end {
                Some((bytes, records)) => _ = Journal::go_on(&path, *bytes, *records)?,
                None => std::fs::remove_file(&path).map_err(|e| Error::io(&path, "delete", e))?,
            }
        }
        let (bytes, records) = ends.program;
        Journal::go_on(&self.path.join(journal::NAME), bytes, records)
    }

    /// True if an earlier attempt has finished a unit of work.
    #[must_use]
    pub fn has_progress(path: &Path) -> bool {
        let workers = workers(path).unwrap_or_default().into_iter().map(Some);
        let mut journals = std::iter::once(None).chain(workers);
        journals.any(|worker| {
            let mut found = false;
            let _ = journal::read(&journal::path_of(path, worker), worker, |entry| {
                found |= matches!(entry.record, Record::Unit { .. });
                !found
            });
            found
        })
    }
}

/// The folder with the generations of a run that tasks share.
pub(super) const GENERATIONS: &str = "generations";

/// True if `path` is the folder of a run that tasks share.
pub(super) fn is_shared(path: &Path) -> bool {
    path.join(GENERATIONS).is_dir()
}

/// False if there is nothing at `path`; an error unless it is a private folder of this user.
pub(super) fn is_private(path: &Path) -> Result<bool> {
    let meta = match path.symlink_metadata() {
        Ok(meta) => meta,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(false),
        Err(e) => return Err(Error::io(path, "look at", e)),
    };
    if !meta.is_dir() {
        return Err(Error::not_resumable(path, "it is not a folder"));
    }
    let private = outcrop_platform::is_private(path, &meta);
    if !private.map_err(|e| Error::io(path, "look at", e))? {
        let why = "it is open to other users, so what is in it cannot be trusted";
        return Err(Error::not_resumable(path, why));
    }
    Ok(true)
}

fn path_bytes(path: &Path) -> Option<u64> {
    path.symlink_metadata().ok().map(|meta| meta.len())
}

/// Locks a folder until the process ends.
fn lock(folder: &Path) -> Result<File> {
    let path = folder.join(LOCK);
    let file = options().create(true).truncate(false).open(&path);
    let file = file.map_err(|e| Error::io(&path, "open", e))?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(std::fs::TryLockError::WouldBlock) => Err(Error::Locked {
            path: folder.to_path_buf(),
        }),
        // Some file systems do not support locks; the run then works without one.
        Err(std::fs::TryLockError::Error(e)) if e.kind() == std::io::ErrorKind::Unsupported => {
            Ok(file)
        }
        Err(std::fs::TryLockError::Error(e)) => Err(Error::io(&path, "lock", e)),
    }
}
