//! The commands for other programs: the words of a command line in, results out. Nothing is printed, no signal
//! is caught, and the program does not end.
//!
//! Options have the names, meanings, defaults and messages that they have on the command line, since the same
//! code reads them; warnings name options as the observer spells them. [`crate::Reconstruction`] and its like have
//! the same abilities with types of their own.
//!
//! ```
//! use outcrop::call::{self, Answer};
//! use outcrop::{Cancel, Silent};
//! use std::sync::Arc;
//!
//! # let folder = tempfile::tempdir()?;
//! # let (cloud, mesh) = (folder.path().join("grid.xyz"), folder.path().join("grid.ply"));
//! # let points = (0..400).map(|n| format!("{} {} 0\n", n % 20, n / 20));
//! # std::fs::write(&cloud, points.collect::<String>())?;
//! # let (cloud, output) = (cloud.to_str().unwrap(), format!("--output={}", mesh.display()));
//! let words = ["reconstruct", "--memory=256MiB", &output, cloud];
//! let answer = call::run(words, Arc::new(Silent), Cancel::new())?;
//! let Answer::Mesh { report, .. } = answer else { unreachable!() };
//! assert_eq!(report.mesh.vertices, 400);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use super::command::{Args, Command};
use super::shared::After;
use super::shared::jobs::{self as tasks, Step};
use super::{jobs, output};
use crate::info::{Headers, Info};
pub use crate::pipeline::part_of;
use crate::pipeline::{Status, Worked};
use crate::report::{CloseReport, Report, SimplifyReport, TilesReport};
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{ArgAction, CommandFactory, Parser};
use outcrop_disk::error::{Error, Result, Setting};
use outcrop_disk::workspace::progress::{Cancel, Observer};
use outcrop_inspect::change::Change;
use outcrop_inspect::compare::Comparison;
use outcrop_inspect::verify::Verdict;
use outcrop_survey::{raster::Raster, volume::Volumes};
use serde::Serialize;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::Arc;

/// The result of a command.
#[derive(Debug)]
#[non_exhaustive]
pub enum Answer {
    /// Of `reconstruct` and `resume`.
    Mesh {
        /// Counts and measurements of the run.
        report: Box<Report>,
        /// Path of the mesh.
        output: PathBuf,
    },
    /// Of `info`.
    Info(Box<Info>),
    /// Of `info`, if only headers are read.
    Headers(Box<Headers>),
    /// Of `verify`.
    Verdict(Box<Verdict>),
    /// Of `compare`.
    Comparison(Box<Comparison>),
    /// Of `change`.
    Change(Box<Change>),
    /// Of `volume`.
    Volumes(Box<Volumes>),
    /// Of `raster`.
    Raster(Box<Raster>),
    /// Of `tiles`.
    Tiles(Box<TilesReport>),
    /// Of `simplify`.
    Simplify(Box<SimplifyReport>),
    /// Of `close`.
    Close(Box<CloseReport>),
    /// Of `plan`: the folder of the run.
    Plan(PathBuf),
    /// Of `status`.
    Status(Box<Status>),
    /// Of `work`.
    Work(Part),
    /// Of `advance`.
    Advance(Box<Opened>),
}

/// How the work of a task ended, or the work between two generations.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
pub struct Part {
    /// It is done, or nothing is left of it to do.
    pub done: bool,
    /// Why it is not done and is to be tried again later.
    pub why: Option<String>,
}

/// How the work between two generations ended.
#[derive(Debug, Serialize)]
#[non_exhaustive]
pub struct Opened {
    /// Whether it is done.
    #[serde(flatten)]
    pub part: Part,
    /// True if the mesh is finished.
    pub finished: bool,
    /// Counts and measurements of the run, if this process finished it.
    pub report: Option<Box<Report>>,
    /// Path of the mesh, if it is finished.
    pub output: Option<PathBuf>,
    #[serde(skip)]
    after: Option<After>,
}

impl Part {
    fn of(why: Option<String>) -> Self {
        let done = why.is_none();
        Self { done, why }
    }

    fn text(&self) -> String {
        self.why.clone().unwrap_or_else(|| "done".into())
    }
}

impl Opened {
    fn of(step: Step) -> Self {
        let why = match step {
            Step::Done(done) => {
                let finished = done.after.finished;
                return Self {
                    part: Part::of(None),
                    finished,
                    report: done.report,
                    output: finished.then_some(done.output),
                    after: Some(done.after),
                };
            }
            Step::Missing(what) => what,
            Step::Damaged(error) => error.to_string(),
        };
        Self {
            part: Part::of(Some(why)),
            finished: false,
            report: None,
            output: None,
            after: None,
        }
    }

    fn text(&self) -> String {
        match (&self.report, &self.output, &self.after) {
            (Some(report), Some(output), _) => output::summary(report, output),
            (_, _, Some(after)) => after.to_string(),
            _ => self.part.text(),
        }
    }
}

impl Answer {
    /// As JSON: what `--json` prints, or what `--report` writes.
    ///
    /// # Errors
    /// [`Error::Io`] if a value has no representation in JSON.
    pub fn json(&self) -> Result<String> {
        match self {
            Self::Mesh { report, .. } => output::json(report),
            Self::Info(info) => output::json(info),
            Self::Headers(headers) => output::json(headers),
            Self::Verdict(verdict) => output::json(verdict),
            Self::Comparison(comparison) => output::json(comparison),
            Self::Change(change) => output::json(change),
            Self::Volumes(volumes) => output::json(volumes),
            Self::Raster(raster) => output::json(raster),
            Self::Tiles(report) => output::json(report),
            Self::Simplify(report) => output::json(report),
            Self::Close(report) => output::json(report),
            Self::Plan(folder) => output::json(&BTreeMap::from([("folder", folder)])),
            Self::Status(status) => output::json(status),
            Self::Work(part) => output::json(part),
            Self::Advance(opened) => output::json(opened),
        }
    }

    /// As text, as the command prints it on a terminal.
    #[must_use]
    pub fn text(&self) -> String {
        self.told(output::spelled)
    }

    /// The same, for a front that spells options so.
    #[must_use]
    pub fn told(&self, spell: impl Fn(&Setting) -> String) -> String {
        match self {
            Self::Mesh { report, output } => output::summary(report, output),
            Self::Info(info) => info.told(spell),
            Self::Headers(headers) => headers.to_string(),
            Self::Verdict(verdict) => verdict.to_string(),
            Self::Comparison(comparison) => comparison.to_string(),
            Self::Change(change) => change.to_string(),
            Self::Volumes(volumes) => volumes.to_string(),
            Self::Raster(raster) => raster.to_string(),
            Self::Tiles(report) => report.told(spell),
            Self::Simplify(report) => report.to_string(),
            Self::Close(report) => report.to_string(),
            Self::Plan(folder) => folder.display().to_string(),
            Self::Status(status) => status.to_string(),
            Self::Work(part) => part.text(),
            Self::Advance(opened) => opened.text(),
        }
    }
}

/// The error of a call.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CallError {
    /// The words are no command line, or one of a command that only the program has.
    #[error("{why}")]
    Usage {
        /// The reason, in the words of the command line.
        why: String,
        /// The options in the reason, as they stand there, such as `--threads <N>`.
        options: Vec<String>,
    },
    /// The command failed.
    #[error(transparent)]
    Run(#[from] Error),
}

impl CallError {
    /// The first paragraph of the message of the parser, on one line.
    fn usage(error: &clap::Error) -> Self {
        let text = error.to_string();
        let text = text.strip_prefix("error: ").unwrap_or(&text);
        let lines = text.lines().take_while(|line| !line.trim().is_empty());
        let lines: Vec<&str> = lines.map(str::trim).collect();
        let asked = matches!(
            error.kind(),
            ErrorKind::DisplayHelp | ErrorKind::DisplayVersion
        );
        let options = match error.get(ContextKind::InvalidArg) {
            Some(ContextValue::String(option)) => vec![option.clone()],
            Some(ContextValue::Strings(options)) => options.clone(),
            _ => Vec::new(),
        };
        let why = match asked {
            true => "help and version are for the command line".to_owned(),
            false => lines.join(" "),
        };
        Self::Usage { why, options }
    }
}

/// Runs `reconstruct`, `resume`, `info`, `verify`, `compare`, `change`, `volume`, `raster`, `simplify`, `close` or `tiles`, and
/// `plan`, `status`, `work` and `advance` of runs that tasks share; `words` are those behind the name of the program.
///
/// # Errors
/// [`CallError`]. After one that [can be resumed](Error::can_resume) the scratch folder stays.
pub fn run<W: Into<OsString>>(
    words: impl IntoIterator<Item = W>,
    observer: Arc<dyn Observer>,
    cancel: Cancel,
) -> Result<Answer, CallError> {
    let words = words.into_iter().map(Into::into);
    let words = std::iter::once(OsString::from("outcrop")).chain(words);
    let args = Args::try_parse_from(words).map_err(|e| CallError::usage(&e))?;
    let watch = (observer, cancel);
    let mesh = |(report, output): jobs::Made| Answer::Mesh {
        report: Box::new(report),
        output,
    };
    Ok(match args.command {
        Command::Reconstruct(args) => mesh(jobs::reconstruct(&args, watch, |_| ())?),
        Command::Resume(args) => mesh(jobs::resume(&args, watch, |_| ())?),
        Command::Info(args) => match jobs::headers(&args)? {
            Some(headers) => Answer::Headers(Box::new(headers)),
            None => Answer::Info(Box::new(jobs::info(&args, watch)?)),
        },
        Command::Verify(args) => Answer::Verdict(Box::new(jobs::verify(&args, watch)?)),
        Command::Compare(args) => Answer::Comparison(Box::new(jobs::compare(&args, watch)?)),
        Command::Change(args) => Answer::Change(Box::new(jobs::change(&args, watch)?)),
        Command::Volume(args) => Answer::Volumes(Box::new(jobs::volume(&args, watch)?)),
        Command::Raster(args) => Answer::Raster(Box::new(jobs::raster(&args, watch)?)),
        Command::Simplify(args) => Answer::Simplify(Box::new(jobs::simplify(&args, watch)?)),
        Command::Close(args) => Answer::Close(Box::new(jobs::close(&args, watch)?)),
        Command::Tiles(args) => Answer::Tiles(Box::new(jobs::tiles(&args, watch)?)),
        Command::Plan(args) if args.submit.is_none() => Answer::Plan(tasks::plan(&args)?),
        Command::Status(args) => Answer::Status(Box::new(tasks::status(&args.folder)?)),
        Command::Work(args) => Answer::Work(match tasks::work(&args, watch, |_| ())? {
            Worked::Done | Worked::Superseded => Part::of(None),
            Worked::TooEarly => Part::of(Some("its generation has not begun".into())),
            Worked::Damaged(error) => Part::of(Some(error.to_string())),
        }),
        Command::Advance(args) => {
            Answer::Advance(Box::new(Opened::of(tasks::advance(&args, watch, |_| ())?)))
        }
        _ => {
            let why = "this command is for the command line only";
            return Err(CallError::Usage {
                why: why.into(),
                options: Vec::new(),
            });
        }
    })
}

/// An option of a command.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct OptionOf {
    /// Name, without dashes in front.
    pub name: String,
    /// True if it has no value.
    pub is_flag: bool,
    /// True if it may be given several times.
    pub repeats: bool,
    /// The default, as text; none if it says so in its help, or has none.
    pub default: Option<String>,
    /// True if the help does not show it.
    pub is_hidden: bool,
    /// The text of the help.
    pub help: String,
}

/// The options of a command, as its help has them; empty if there is no such command.
#[must_use]
pub fn options(command: &str) -> Vec<OptionOf> {
    let mut program = Args::command();
    program.build();
    let Some(command) = program.find_subcommand(command) else {
        return Vec::new();
    };
    let described = command.get_arguments().filter_map(|arg| {
        let action = arg.get_action();
        let default = arg.get_default_values().first();
        let is_flag = !action.takes_values();
        Some(OptionOf {
            name: arg.get_long()?.to_owned(),
            is_flag,
            repeats: matches!(action, ArgAction::Append) && arg.get_value_delimiter().is_none(),
            default: default
                .filter(|_| !is_flag)
                .map(|text| text.to_string_lossy().into_owned()),
            is_hidden: arg.is_hide_set(),
            help: arg.get_help().map(ToString::to_string).unwrap_or_default(),
        })
    });
    described.filter(|option| option.name != "help").collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use outcrop_disk::workspace::progress::Silent;

    fn usage(words: &[&str]) -> String {
        match run(words, Arc::new(Silent), Cancel::new()) {
            Err(CallError::Usage { why, options }) => {
                assert!(options.iter().all(|option| why.contains(option)), "{why}");
                why
            }
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_wrong_command_line_is_one_line() {
        let why = usage(&["info", "--threads=none", "a.xyz"]);
        assert!(
            why.starts_with("invalid value 'none' for '--threads <N>'"),
            "{why}"
        );
        let why = usage(&["reconstruct", "a.xyz"]);
        assert!(why.contains("--output <MESH.ply>"), "{why}");
        assert!(!why.contains('\n') && !why.contains("Usage"), "{why}");
        let absent = run(["reconstruct", "a.xyz"], Arc::new(Silent), Cancel::new());
        let Err(CallError::Usage { options, .. }) = absent else {
            panic!("{absent:?}")
        };
        assert_eq!(options, ["--output <MESH.ply>"]);
        assert!(usage(&["--help"]).contains("command line"));
        assert!(usage(&["view", "a.ply"]).contains("command line only"));
    }

    #[test]
    fn options_are_those_of_the_help() {
        let of = |command: &str, name: &str| {
            let mut all = options(command).into_iter();
            all.find(|option| option.name == name).unwrap()
        };
        assert!(of("reconstruct", "keep-all").is_flag);
        assert!(!of("reconstruct", "drop-classes").repeats);
        assert!(of("reconstruct", "report").repeats);
        assert!(of("reconstruct", "tile-points").is_hidden);
        assert_eq!(of("compare", "samples").default.as_deref(), Some("1000000"));
        assert_eq!(of("reconstruct", "keep-all").default, None);
        assert!(options("nothing").is_empty());
    }
}
