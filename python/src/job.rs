//! Work on a thread of its own.

use crate::progress::{Progress, Stage};
use outcrop::call::{self, CallError};
use outcrop::convert;
use outcrop::error::Setting;
use outcrop::inspect::verify;
use outcrop::{Cancel, Error, MemoryPool, Result, Workspace, default_memory, default_threads};
use pyo3::exceptions::PyOSError;
use pyo3::prelude::*;
use std::ffi::OsString;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::Duration;

/// Bytes of the stack of the thread, as the main thread of the program has.
const STACK: usize = 8 << 20;

/// Longest time that Python waits at once, in seconds.
const LONGEST_WAIT: f64 = 3600.0;

/// JSON, text, and path of what was made.
type Answer = (String, String, Option<PathBuf>);

/// Kind, message, whether the run can be resumed, and the system's number of the error.
type Failure = (&'static str, String, bool, Option<i32>);

/// The result of the work.
enum Outcome {
    Answer(Answer),
    Picture(Vec<u8>),
    Failure(Failure),
}

/// State shared by the thread of the run and the thread of Python that waits for it.
#[derive(Default)]
struct Shared {
    outcome: Mutex<Option<Outcome>>,
    ended: Condvar,
    progress: Arc<Progress>,
    cancel: Cancel,
}

/// A command at work. It is stopped when this object is deleted.
#[pyclass(frozen)]
pub struct Job {
    shared: Arc<Shared>,
}

impl Drop for Job {
    fn drop(&mut self) {
        self.shared.cancel.cancel();
    }
}

#[pymethods]
impl Job {
    /// Begins a command; `words` are those behind the name of the program.
    #[staticmethod]
    fn command(words: Vec<OsString>) -> PyResult<Self> {
        Self::begin(move |shared| {
            let answer = call::run(words, shared.progress.clone(), shared.cancel.clone())?;
            let output = match &answer {
                call::Answer::Mesh { output, .. } => Some(output.clone()),
                call::Answer::Advance(opened) => opened.output.clone(),
                _ => None,
            };
            Ok(Outcome::Answer((
                answer.json()?,
                answer.told(keyword),
                output,
            )))
        })
    }

    /// Begins to draw a mesh.
    #[staticmethod]
    fn picture(mesh: PathBuf) -> PyResult<Self> {
        Self::begin(move |shared| Ok(Outcome::Picture(draw(&mesh, shared)?)))
    }

    /// Begins to write a mesh as GLB, with these comments.
    #[staticmethod]
    fn save_glb(mesh: PathBuf, output: PathBuf, comments: Vec<String>) -> PyResult<Self> {
        Self::begin(move |shared| {
            let workspace = workspace(shared)?;
            convert::to_glb(&mesh, &output, comments, &workspace)?;
            Ok(Outcome::Answer((
                "null".into(),
                String::new(),
                Some(output),
            )))
        })
    }

    /// Waits until the work has ended, at most so many seconds; true if it has.
    fn wait(&self, py: Python<'_>, seconds: f64) -> bool {
        let time = Duration::from_secs_f64(seconds.clamp(0.0, LONGEST_WAIT));
        py.detach(|| {
            let outcome = self.shared.outcome.lock();
            let outcome = outcome.unwrap_or_else(PoisonError::into_inner);
            let waited = self
                .shared
                .ended
                .wait_timeout_while(outcome, time, |outcome| outcome.is_none());
            waited.unwrap_or_else(PoisonError::into_inner).0.is_some()
        })
    }

    /// Stops the work at its next unit.
    fn cancel(&self) {
        self.shared.cancel.cancel();
    }

    /// The stages that ended since the last call, and the current one: name, unit, done, total.
    fn stages(&self) -> Vec<Stage> {
        self.shared.progress.stages()
    }

    /// The share of the run that is done and the seconds left, if that is known.
    fn outlook(&self) -> Option<(f64, f64)> {
        self.shared.progress.outlook()
    }

    /// The warnings since the last call.
    fn warnings(&self) -> Vec<String> {
        self.shared.progress.warnings()
    }

    /// JSON, text, and path of what was made; none before the end, and after an error.
    fn answer(&self) -> Option<Answer> {
        self.look(|outcome| match outcome {
            Outcome::Answer(answer) => Some(answer.clone()),
            _ => None,
        })
    }

    /// The picture, as PNG.
    fn png(&self) -> Option<Vec<u8>> {
        self.look(|outcome| match outcome {
            Outcome::Picture(png) => Some(png.clone()),
            _ => None,
        })
    }

    /// Kind of the error, its message, whether the run can be resumed, and the system's number.
    fn failure(&self) -> Option<Failure> {
        self.look(|outcome| match outcome {
            Outcome::Failure(failure) => Some(failure.clone()),
            _ => None,
        })
    }
}

impl Job {
    /// Does work on a new thread.
    fn begin<F>(work: F) -> PyResult<Self>
    where
        F: FnOnce(&Shared) -> Result<Outcome, CallError> + Send + 'static,
    {
        let shared = Arc::new(Shared::default());
        let held = Arc::clone(&shared);
        let thread = std::thread::Builder::new().name("outcrop".into());
        let thread = thread.stack_size(STACK).spawn(move || {
            let done = catch_unwind(AssertUnwindSafe(|| work(&held)));
            let outcome = match done {
                Ok(Ok(outcome)) => outcome,
                Ok(Err(error)) => Outcome::Failure(failure(&error)),
                Err(_) => Outcome::Failure(("internal", "an error in outcrop".into(), false, None)),
            };
            *held.outcome.lock().unwrap_or_else(PoisonError::into_inner) = Some(outcome);
            held.ended.notify_all();
        });
        thread.map_err(|e| PyOSError::new_err(format!("cannot begin a thread: {e}")))?;
        Ok(Self { shared })
    }

    fn look<T>(&self, at: impl FnOnce(&Outcome) -> Option<T>) -> Option<T> {
        let outcome = self.shared.outcome.lock();
        let outcome = outcome.unwrap_or_else(PoisonError::into_inner);
        outcome.as_ref().and_then(at)
    }
}

/// A place for work beside the commands, with the usual memory and threads.
fn workspace(shared: &Shared) -> Result<Workspace> {
    Workspace::new(
        &std::env::temp_dir(),
        MemoryPool::new(default_memory())?,
        default_threads(),
        shared.progress.clone(),
        shared.cancel.clone(),
    )
}

/// A picture of a mesh, as PNG.
fn draw(mesh: &Path, shared: &Shared) -> Result<Vec<u8>> {
    let workspace = workspace(shared)?;
    let options = verify::Options::default();
    let (_, drawn) = verify::illustrated(mesh, &options, &workspace)?;
    let first = drawn.pictures.into_iter().next();
    Ok(first.map(|picture| picture.png).unwrap_or_default())
}

/// An option as a keyword.
pub fn keyword(setting: &Setting) -> String {
    match setting {
        Setting::Option(name) => (*name).to_owned(),
        Setting::Flag(name) => format!("{name}=True"),
        Setting::Value(name, value) if value.parse::<f64>().is_ok() => format!("{name}={value}"),
        Setting::Value(name, value) => format!("{name}={value:?}"),
    }
}

/// A reason with its options as keywords.
fn reworded(why: &str, options: &[String]) -> String {
    options.iter().fold(why.to_owned(), |why, option| {
        // Options of which one must be given are `<--a <N>|--b <N>>`.
        let each: Vec<&str> = match option.starts_with("<-") {
            true => option.split('|').collect(),
            false => vec![option],
        };
        let names = each.into_iter().map(|option| {
            let name = option.trim_start_matches(['<', '-']);
            let name = name.split([' ', '=', '[', '>']).next().unwrap_or(name);
            name.replace('-', "_")
        });
        let name = names.collect::<Vec<_>>().join(" or ");
        why.replace(&format!("'{option}'"), &name)
            .replace(option, &name)
    })
}

/// The description of an error.
fn failure(error: &CallError) -> Failure {
    let error = match error {
        CallError::Run(error) => error,
        CallError::Usage { why, options } => {
            return ("parameter", reworded(why, options), false, None);
        }
        other => return ("parameter", other.to_string(), false, None),
    };
    let message = error.told(keyword);
    let number = match error {
        Error::Io { source, .. } => source.raw_os_error(),
        _ => None,
    };
    let kind = match error {
        Error::Io { .. } => "file",
        Error::Input { .. }
        | Error::Degenerate { .. }
        | Error::Outside { .. }
        | Error::NoTriangles { .. }
        | Error::TooManyPoints { .. } => "input",
        Error::Parameter { .. } | Error::TooLarge { .. } => "parameter",
        Error::Memory { .. } => "memory",
        Error::Disk { .. } => "disk",
        Error::Corrupt { .. }
        | Error::Locked { .. }
        | Error::Unfinished { .. }
        | Error::Mismatch { .. }
        | Error::NotResumable { .. } => "scratch",
        Error::TimeLimit => "time",
        Error::Cancelled => "cancelled",
        _ => "other",
    };
    (kind, message, error.can_resume(), number)
}
