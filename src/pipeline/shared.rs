//! A run that tasks share, perhaps on several machines: its plan, the work of a task, and the work between
//! two generations of tasks. [`outcrop_disk::workspace::generations`] has the files.

use super::away::Copies;
use super::checks::{all_are_kept, not_an_input, one_system, writable};
use super::manifest::Manifest;
use super::{Builder, Known, Reconstruction, Start, made};
use crate::report::Report;
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::away::Traffic;
use outcrop_disk::workspace::generations::{Generation, Opened, Resources, SharedFolder};
use outcrop_disk::workspace::journal::{Sharing, Took};
use outcrop_disk::workspace::{Workspace, limits};
use outcrop_mesh_files::export;
use std::hash::{BuildHasher, Hasher};
use std::path::Path;
use std::time::{Instant, SystemTime};

mod find;
mod place;
mod program;
mod status;

pub use find::shared_folder;
pub use program::part_of;
use program::program;
pub use status::{Begun, Status, TaskState, Totals, status};

/// Largest number of shards: array jobs of Slurm end here by default.
pub const MOST_SHARDS: u32 = 1000;

/// The result of a task.
#[derive(Debug)]
pub enum Worked {
    /// Its work is finished.
    Done,
    /// There was nothing to do: another attempt was faster, or its generation is over.
    Superseded,
    /// Its generation has not begun.
    TooEarly,
    /// The work of others is damaged, as this error tells: the work between two generations repairs it.
    Damaged(Error),
}

/// The result of the work between two generations.
#[derive(Debug)]
pub enum Advanced {
    /// The units of this generation are open for tasks.
    Open(u64),
    /// These shards of this generation are missing.
    Missing(u64, Vec<u32>),
    /// Another process was faster.
    Superseded,
    /// The work of others is damaged, as this error tells: the same work, done again, repairs it.
    Damaged(Error),
    /// The mesh is finished; the report is missing if it was finished before.
    Finished(Option<Box<(Report, Totals)>>),
}

/// The number of shards that were planned for the run in a folder.
///
/// # Errors
/// [`Error::NotResumable`], [`Error::Io`], [`Error::Corrupt`].
pub(crate) fn planned_shards(folder: &Path, copies: &Copies) -> Result<u32> {
    Ok(place::open(folder, copies)?.sharing()?.shards)
}

impl Reconstruction {
    /// Plans a run that tasks share in `shards` shards. The threads and the memory of this run are those of
    /// each task. Returns its folder. A run that was planned before goes on if it is to be resumed, with the shards,
    /// threads and memory of then.
    ///
    /// # Errors
    /// [`Error::Parameter`]; [`Error::NotResumable`] if the folder exists; [`Error::Mismatch`] if the run in it is
    /// another one; [`Error::Io`].
    pub fn plan(&self, shards: u32) -> Result<&Path> {
        if shards == 0 || shards > MOST_SHARDS {
            return Err(Error::Parameter {
                name: "shards",
                found: shards.to_string(),
                expected: format!("1 to {MOST_SHARDS}"),
            });
        }
        if self.delivery.is_some() {
            return Err(Error::Parameter {
                name: "output",
                found: self.output().display().to_string(),
                expected: "a path: the finished mesh of a run that tasks share is sent to a store afterwards"
                    .into(),
            });
        }
        if self.tiles.is_some() {
            return Err(Error::Parameter {
                name: "output",
                found: self.output().display().to_string(),
                expected: "a mesh; `outcrop tiles` makes levels of detail of it afterwards".into(),
            });
        }
        if let Some(name) = made::asked(&self.params) {
            return Err(Error::Parameter {
                name,
                found: "a run that tasks share".into(),
                expected: "`outcrop simplify` or `outcrop close` afterwards".into(),
            });
        }
        writable(&self.mesh)?;
        not_an_input(&self.mesh, self.params.split.is_some(), &self.inputs)?;
        one_system(&self.params, &self.inputs)?;
        // Who begins the first generation tells of a header that cannot be read.
        let headers = Known::from_headers(&self.inputs, &self.params.selection()).ok();
        if let Some(known) = headers.filter(|_| all_are_kept(&self.params)) {
            // Its output cannot be changed later.
            known.fits(&self.params, &self.mesh, 1.0)?;
        }
        let manifest = Manifest::of(self)?;
        if self.start != Start::New && place::is_at(&self.folder)? {
            let begun = place::open(&self.folder, &self.copies)?;
            if self.start == Start::Resume && !begun.is_left_over() {
                let was = Manifest::from_bytes(&self.folder, &begun.manifest)?;
                was.check(&manifest, &self.folder)?;
                return Ok(&self.folder);
            }
            begun.remove();
        }
        let manifest = manifest.to_bytes()?;
        let random = std::hash::RandomState::new().build_hasher().finish();
        let sharing = Sharing {
            run: random,
            shards,
            threads: self.threads as u32,
            memory: self.memory.budget(),
            program: program()?,
        };
        place::create(&self.folder, manifest, sharing)?;
        find::note(&self.mesh, &self.folder)?;
        Ok(&self.folder)
    }

    /// The builder of a run that tasks share, with the threads and memory of its plan. These, observer and
    /// flag can be changed.
    ///
    /// # Errors
    /// [`Error::NotResumable`], [`Error::Io`], [`Error::Corrupt`].
    pub fn shared(folder: impl AsRef<Path>) -> Result<Builder> {
        Self::shared_with(folder.as_ref(), Copies::default())
    }

    /// The same, with copies of what is in a store.
    pub(crate) fn shared_with(folder: &Path, copies: Copies) -> Result<Builder> {
        let path = folder.to_path_buf();
        let folder = place::open(&path, &copies)?;
        let manifest = Manifest::from_bytes(&path, &folder.manifest)?;
        if folder.is_left_over() {
            // There is nothing to do but to remove it.
            return Ok(Builder::of(&manifest).folder(path).threads(1));
        }
        let plan = folder.sharing()?;
        let builder = Builder::of(&manifest).folder(path).with_copies(copies);
        Ok(builder.threads(plan.threads as usize).memory(plan.memory))
    }

    /// Does the units of a shard of a generation, by default the newest.
    ///
    /// # Errors
    /// Any [`Error`].
    pub fn work(&self, generation: Option<u64>, shard: u32) -> Result<Worked> {
        let begin = Instant::now();
        let folder = place::open(&self.folder, &self.copies)?;
        if folder.is_left_over() {
            return Ok(Worked::Superseded);
        }
        let newest = folder.newest()?;
        let number = generation.unwrap_or(newest);
        if number < newest {
            return Ok(Worked::Superseded);
        }
        if number > newest && !folder.has_begun(number) {
            return Ok(Worked::TooEarly);
        }
        let outcome = self.try_work(&folder, number, shard, begin);
        // Whatever fails after a generation is over is no error.
        match outcome {
            Err(_) | Ok(Worked::Damaged(_)) if is_over(&folder, number) => Ok(Worked::Superseded),
            Ok(Worked::Damaged(e)) => Ok(Worked::Damaged(self.told(e, &folder))),
            outcome => outcome.map_err(|e| self.told(e, &folder)),
        }
    }

    fn try_work(
        &self,
        folder: &SharedFolder,
        number: u64,
        shard: u32,
        begin: Instant,
    ) -> Result<Worked> {
        let now = self.generation(folder, number)?;
        if shard >= now.sharing.shards {
            return Err(Error::Parameter {
                name: "shard",
                found: shard.to_string(),
                expected: format!("0 to {}", now.sharing.shards - 1),
            });
        }
        let task = |resources: &Resources<'_>| folder.begin_task(now, shard, resources);
        let opened = self.open_shared(folder, task)?;
        let Ok(workspace) = opened else {
            return Ok(Worked::Done);
        };
        let outcome = match self.reconstruct(&workspace) {
            Err(Error::Left(_)) => {
                let took = took(&workspace, Some(shard), begin);
                let first = folder.end_task(&workspace, (number, shard), took);
                first.map(|first| match first {
                    true => Worked::Done,
                    false => Worked::Superseded,
                })
            }
            Err(e) => workspace.note_failure(e).map(Worked::Damaged),
            // A task ends with its units, which are not finished in this generation.
            Ok(_) => Ok(Worked::Superseded),
        };
        if !matches!(outcome, Ok(Worked::Done)) {
            folder.withdraw(&workspace);
        }
        outcome
    }

    /// Does the work between the newest generation and the next, if all its shards are finished.
    ///
    /// # Errors
    /// Any [`Error`].
    pub fn advance(&self) -> Result<Advanced> {
        let begin = Instant::now();
        let folder = place::open(&self.folder, &self.copies)?;
        if folder.is_left_over() {
            find::forget(&self.mesh);
            folder.remove();
            return Ok(Advanced::Finished(None));
        }
        let number = folder.newest()?;
        match self.try_advance(&folder, number, begin) {
            Err(_) | Ok(Advanced::Damaged(_)) if is_over(&folder, number) => {
                Ok(Advanced::Superseded)
            }
            Ok(Advanced::Damaged(e)) => Ok(Advanced::Damaged(self.told(e, &folder))),
            outcome => outcome.map_err(|e| self.told(e, &folder)),
        }
    }

    fn try_advance(&self, folder: &SharedFolder, number: u64, begin: Instant) -> Result<Advanced> {
        let mut now = self.generation(folder, number)?;
        writable(&self.mesh)?;
        let was = Manifest::from_bytes(&self.folder, &folder.manifest)?;
        was.check(&Manifest::of(self)?, &self.folder)?;
        let damaged = folder.is_damaged(&now)?;
        let opened = self.open_shared(folder, |resources| {
            let watched = (&*self.observer, &self.cancel);
            if damaged && let Some(run) = folder.begin_repair(&mut now, resources, watched)? {
                return Ok(run);
            }
            folder.begin_next(now, resources)
        })?;
        let workspace = match opened {
            Ok(workspace) => workspace,
            Err(Opened::Missing(shards)) => return Ok(Advanced::Missing(number, shards)),
            Err(_) => {
                find::forget(&self.mesh);
                folder.remove();
                return Ok(Advanced::Finished(None));
            }
        };
        // The report of a finished mesh; none at the next units of tasks.
        let outcome = match self.reconstruct(&workspace) {
            Ok(report) => Ok(Some(report)),
            Err(Error::Left(_)) => Ok(None),
            Err(e) => Err(workspace.note_failure(e).map(Advanced::Damaged)),
        };
        let next = number + 1;
        let published = match &outcome {
            Ok(report) => {
                let took = took(&workspace, None, begin);
                folder.end_next(&workspace, next, took, report.is_some())
            }
            Err(_) => Ok(false),
        };
        if !matches!(published, Ok(true)) {
            folder.withdraw(&workspace);
            if let Some(number) = workspace.shared_number() {
                let _ = std::fs::remove_file(export::temporary_of(&self.mesh, number));
            }
        }
        match (outcome, published?) {
            (Err(failed), _) => failed,
            (Ok(_), false) => Ok(Advanced::Superseded),
            (Ok(None), true) => Ok(Advanced::Open(next)),
            (Ok(Some(report)), true) => {
                let totals = Totals::of(&folder.read(next)?.took);
                self.remove_unfinished();
                find::forget(&self.mesh);
                drop(workspace);
                folder.remove();
                Ok(Advanced::Finished(Some(Box::new((report, totals)))))
            }
        }
    }

    /// Deletes meshes that killed attempts left unfinished.
    fn remove_unfinished(&self) {
        let name = export::temporary(&self.mesh).into_os_string();
        let Some(name) = Path::new(&name).file_name().and_then(|name| name.to_str()) else {
            return;
        };
        if self.params.split.is_some() {
            export::remove_unfinished(&self.mesh);
        }
        let beside = std::fs::read_dir(export::folder_of(&self.mesh)).into_iter();
        for entry in beside.flatten().flatten() {
            let number = entry
                .file_name()
                .to_str()
                .and_then(|n| n.strip_prefix(name)?.strip_prefix('.')?.parse::<u32>().ok());
            if number.is_some() {
                let _ = std::fs::remove_file(entry.path());
            }
        }
    }

    /// The state of the run; an error if it was planned by another program.
    fn generation(&self, folder: &SharedFolder, number: u64) -> Result<Generation> {
        let now = folder.read(number)?;
        let (was, is) = (now.sharing.program, program()?);
        if was != is {
            return Err(Error::Mismatch {
                path: self.folder.clone(),
                what: "the program".into(),
                was: format!("{was:08x}"),
                now: format!("{is:08x}"),
            });
        }
        Ok(now)
    }

    /// An error with the name that the user has for a file of the run.
    fn told(&self, error: Error, folder: &SharedFolder) -> Error {
        place::told(error, &self.folder, Some(&folder.path))
    }

    fn open_shared(
        &self,
        folder: &SharedFolder,
        begin: impl FnOnce(&Resources<'_>) -> Result<Opened>,
    ) -> Result<Result<Workspace, Opened>> {
        let opened = Workspace::shared(
            &folder.path,
            self.memory.clone(),
            self.threads,
            self.observer.clone(),
            self.cancel.clone(),
            begin,
        )?;
        if let Ok(workspace) = &opened {
            workspace.set_storage(self.storage)?;
        }
        Ok(opened)
    }
}

/// True if a newer generation began, or the run is finished.
fn is_over(folder: &SharedFolder, number: u64) -> bool {
    folder.newest().map_or(true, |newest| newest > number)
}

fn took(workspace: &Workspace, shard: Option<u32>, begin: Instant) -> Took {
    Took {
        shard,
        seconds: begin.elapsed().as_secs_f64(),
        cpu_seconds: limits::cpu_seconds(),
        resident: limits::peak_resident(),
        read: workspace.io.read(),
        written: workspace.io.written(),
        traffic: Traffic::default(),
        points: workspace.noted_points(),
        ended: SystemTime::now()
            .duration_since(SystemTime::UNIX_EPOCH)
            .map_or(0, |since| since.as_secs()),
    }
}
