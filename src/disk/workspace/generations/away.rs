//! The files of a run, in the folder that processes share or as objects of a store.

use super::{GENERATIONS, Generation, MANIFEST, SharedFolder, TASKS, exists};
use crate::error::{Error, Remedy, Result};
use crate::workspace::away::Away;
use crate::workspace::folder::sealed;
use crate::workspace::journal::Sharing;
use crate::workspace::listing::is_ours;
use crate::workspace::open::open_existing;
use std::collections::BTreeMap;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

/// Most rounds of removing a run.
const REMOVALS: u32 = 20;

/// A file of the run.
#[derive(Debug)]
pub(super) struct Entry {
    /// Its name in its folder.
    pub name: String,
    /// Its path here.
    pub path: PathBuf,
    /// The time of its last change, if it is known.
    pub modified: Option<SystemTime>,
}

/// Sizes of segments.
pub(super) enum Sizes {
    /// They are asked for.
    Here,
    /// As the store has listed them.
    Away(BTreeMap<String, u64>),
}

impl Sizes {
    /// Bytes of a segment of the run in `folder`; none if it is not there.
    pub fn of(&self, folder: &Path, name: &str) -> Option<u64> {
        match self {
            // Opening a file asks the server for its size; looking at it may not.
            Self::Here => open_existing(&folder.join(name))
                .and_then(|file| file.metadata())
                .ok()
                .map(|meta| meta.len()),
            Self::Away(sizes) => sizes.get(name).copied(),
        }
    }
}

impl Generation {
    /// True for a segment that a process of an earlier generation made.
    pub(super) fn is_of_before(&self, name: &str) -> bool {
        let segment = name
            .rsplit_once('.')
            .and_then(|(_, n)| n.parse::<u32>().ok());
        segment.is_some_and(|segment| segment < self.history.next_worker())
    }
}

impl SharedFolder {
    /// Puts a new run into a store. Errors name it `shown`.
    ///
    /// # Errors
    /// [`Error::NotResumable`] if a run is there; [`Error::Io`].
    pub fn create_away(
        away: Away,
        shown: &Path,
        manifest: Vec<u8>,
        sharing: Sharing,
    ) -> Result<Self> {
        let away = Arc::new(away);
        // Made elsewhere first: the names in the folder of this process are those of objects.
        let place = tempfile::tempdir_in(away.folder())
            .map_err(|e| Error::io(away.folder(), "make a folder in it", e))?;
        let made = Self::create(&place.path().join("new"), manifest, sharing)?;
        let new = Self {
            path: away.folder().to_path_buf(),
            manifest: made.manifest.clone(),
            away: Some(away.clone()),
        };
        let first = new.generation(0);
        let read = |path: PathBuf| std::fs::read(&path).map_err(|e| Error::io(&path, "read", e));
        let journal = read(made.generation(0))?;
        // Another run may have the same manifest; its journal has another number.
        let manifest = away.put_as_new(&new.path.join(MANIFEST), &sealed(&new.manifest))?;
        if !manifest || !away.put_as_new(&first, &journal)? {
            return Err(exists(shown));
        }
        Ok(new)
    }

    /// True if a run is in the store.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn is_away(away: &Away) -> Result<bool> {
        away.exists(&away.folder().join(MANIFEST))
    }

    /// Opens the run in a store. Errors name it `shown`.
    ///
    /// # Errors
    /// [`Error::NotResumable`], [`Error::Io`].
    pub fn open_away(away: Away, shown: &Path) -> Result<Self> {
        let folder = away.folder().to_path_buf();
        let failed = |e| Error::io(&folder, "make a folder in it", e);
        for name in [GENERATIONS, TASKS] {
            std::fs::create_dir_all(folder.join(name)).map_err(failed)?;
        }
        if !away.fetch(&folder.join(MANIFEST))? {
            let plan = Remedy::Command("plan", "to begin one");
            let why = "no run that tasks share is here, or it is finished";
            return Err(Error::not_resumable(shown, why).with(plan));
        }
        let mut opened = Self::open(&folder)?;
        opened.away = Some(Arc::new(away));
        Ok(opened)
    }

    /// Requests to the store of the run, if it is in one.
    #[must_use]
    pub fn away(&self) -> Option<&Away> {
        self.away.as_deref()
    }

    /// The files in a folder of the run; none if it is not there.
    pub(super) fn entries(&self, folder: &Path) -> Result<Vec<Entry>> {
        if let Some(away) = &self.away {
            let listed = away.list(folder)?.into_iter();
            let entries = listed.filter_map(|stored| {
                let name = stored.name.rsplit('/').next()?.to_owned();
                Some(Entry {
                    path: folder.join(&name),
                    name,
                    modified: Some(stored.modified),
                })
            });
            return Ok(entries.collect());
        }
        let names = match std::fs::read_dir(folder) {
            Ok(names) => names,
            Err(e) if e.kind() == ErrorKind::NotFound && !folder.ends_with(GENERATIONS) => {
                return Ok(Vec::new());
            }
            Err(e) => return Err(Error::io(folder, "list", e)),
        };
        let entries = names.filter_map(|name| {
            let name = name.ok()?.file_name().into_string().ok()?;
            let path = folder.join(&name);
            Some(Entry {
                modified: path.metadata().and_then(|meta| meta.modified()).ok(),
                name,
                path,
            })
        });
        Ok(entries.collect())
    }

    /// True if a file is there, also if a list of its folder does not show it yet.
    pub(super) fn is_there(&self, path: &Path) -> Result<bool> {
        match &self.away {
            Some(away) => away.exists(path),
            None => Ok(open_existing(path).is_ok()),
        }
    }

    /// The time of the last change of a file.
    pub(super) fn modified(&self, path: &Path) -> Option<SystemTime> {
        match &self.away {
            Some(away) => Some(away.look(path).ok()??.modified),
            None => path.metadata().ok()?.modified().ok(),
        }
    }

    /// Brings a whole file into the folder of this process; false if there is none.
    pub(super) fn bring(&self, path: &Path) -> Result<bool> {
        match &self.away {
            Some(away) => away.fetch(path),
            None => Ok(true),
        }
    }

    /// The same path, after the file was brought here.
    pub(super) fn here(&self, path: PathBuf) -> Result<PathBuf> {
        self.bring(&path)?;
        Ok(path)
    }

    /// True if this process is the first to claim the name of a journal that it has begun.
    pub(super) fn claims(&self, path: &Path) -> Result<bool> {
        match &self.away {
            Some(away) => away.claim(path),
            None => Ok(true),
        }
    }

    /// Puts a file again that was changed here.
    pub(super) fn put_again(&self, path: &Path) -> Result<()> {
        match &self.away {
            Some(away) => away.put(path),
            None => Ok(()),
        }
    }

    /// Deletes a file.
    pub(super) fn remove_file(&self, path: &Path) -> io::Result<()> {
        match &self.away {
            Some(away) => {
                let _ = std::fs::remove_file(path);
                away.delete(&[path.to_path_buf()]);
                Ok(())
            }
            None => std::fs::remove_file(path),
        }
    }

    /// Sizes of all segments.
    pub(super) fn sizes(&self) -> Result<Sizes> {
        let Some(away) = &self.away else {
            return Ok(Sizes::Here);
        };
        let all = away.list(&self.path)?.into_iter();
        Ok(Sizes::Away(
            all.map(|stored| (stored.name, stored.bytes)).collect(),
        ))
    }

    /// True if a later generation began, or the run is finished.
    pub(super) fn is_over(&self, number: u64) -> Result<bool> {
        Ok(self.is_there(&self.generation(number + 1))? || self.is_gone()?)
    }

    /// True if the run is in a store, and was removed there. In a folder nothing can be published then.
    pub(super) fn is_gone(&self) -> Result<bool> {
        match &self.away {
            Some(away) => Ok(!away.exists(&self.path.join(MANIFEST))?),
            None => Ok(false),
        }
    }

    /// Deletes the objects that no process of generation `number` needs, and empties earlier generations.
    pub(super) fn clean_away(&self, away: &Away, number: u64) -> Result<()> {
        let now = self.read(number)?;
        let needed = now.history.segments();
        let (mut over, mut old) = (Vec::new(), Vec::new());
        for stored in away.list(&self.path)? {
            let mut parts = stored.name.split('/');
            match (parts.next(), parts.next()) {
                (Some(TASKS), Some(of)) if of.parse::<u64>().is_ok_and(|of| of < number) => {
                    over.push(stored.name);
                }
                (Some(GENERATIONS), Some(name)) => match name.parse::<u64>() {
                    Ok(n) if n + 1 < number && stored.bytes > 0 => old.push(n),
                    Err(_) if name < &*format!("{number:06}") => over.push(stored.name),
                    _ => {}
                },
                (Some(name), None)
                    if !is_ours(name) && now.is_of_before(name) && !needed.contains(name) =>
                {
                    over.push(stored.name);
                }
                _ => {}
            }
        }
        away.delete_all(&over);
        old.into_iter()
            .try_for_each(|n| away.empty(&self.generation(n)))
    }

    /// Removes all objects of a finished run; the manifest goes last.
    pub(super) fn remove_away(&self, away: &Away) {
        for _ in 0..REMOVALS {
            let Ok(all) = away.list(&self.path) else {
                return;
            };
            let names = all.into_iter().map(|stored| stored.name);
            let (last, first): (Vec<String>, Vec<String>) = names
                .filter(|name| name != MANIFEST)
                .partition(|name| name.starts_with(GENERATIONS));
            if first.is_empty() && last.is_empty() {
                return away.delete_all(&[MANIFEST.to_owned()]);
            }
            away.delete_all(&first);
            away.delete_all(&last);
        }
    }
}
