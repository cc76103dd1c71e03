//! The error type of the library. A variant has what was found and what was expected. What helps is data
//! ([`Error::remedies`]): the command line and Python name options each in their own way, in warnings too
//! ([`crate::workspace::progress::Observer::spell`]).

mod remedy;

pub use remedy::{Remedy, Setting};

use std::path::{Path, PathBuf};

/// Result with this crate's [`Error`].
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// The errors that end a run.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file cannot be read or written.
    #[error("{path}: cannot {action}: {source}", path = path.display())]
    Io {
        /// File or folder concerned.
        path: PathBuf,
        /// The failed action, e.g. `open` or `write 65536 bytes`.
        action: String,
        /// The system's reason.
        source: std::io::Error,
    },
    /// An input file is invalid.
    #[error("{path}: {place}: found {found}, expected {expected}", path = path.display())]
    Input {
        /// The input file.
        path: PathBuf,
        /// Place in the file: a byte offset, line, header field or chunk.
        place: String,
        /// The invalid content.
        found: String,
        /// The expected content.
        expected: String,
        /// What the user can do about it; none if nothing is known.
        remedies: Vec<Remedy>,
    },
    /// The cloud has too few distinct points for a triangle.
    #[error(
        "cannot build a surface: {found}; at least three distinct points that are not on one line are needed"
    )]
    Degenerate {
        /// Description of the cloud.
        found: String,
    },
    /// No point of the cloud is in the region of interest.
    #[error(
        "no point is in {region}, nor within {margin} around it; the cloud lies between {bounds}"
    )]
    Outside {
        /// The region.
        region: String,
        /// Width of the margin around it.
        margin: f64,
        /// The lowest and highest coordinates of the cloud.
        bounds: String,
    },
    /// A mesh exceeds a limit of its format.
    #[error("{path}: {format} holds at most {most} {unit}, this mesh has {found}{}", if *finished { "; the surface is finished" } else { "" }, path = path.display())]
    TooLarge {
        /// Path of the mesh.
        path: PathBuf,
        /// Name of the format.
        format: &'static str,
        /// `bytes` or `triangles`.
        unit: &'static str,
        /// The limit.
        most: u64,
        /// The number that the mesh has; with `about` if it is estimated.
        found: String,
        /// True if the surface is finished: the run can go on with another output.
        finished: bool,
    },
    /// The cells gave no triangle.
    #[error("the cloud yields no triangle: {why}")]
    NoTriangles {
        /// The reason.
        why: String,
        /// What the user can do about it; none if nothing is known.
        remedies: Vec<Remedy>,
    },
    /// A parameter is out of range.
    #[error("{name}: {found} is not valid, expected {expected}")]
    Parameter {
        /// Its name, in lower case with `_` between words.
        name: &'static str,
        /// The given value.
        found: String,
        /// The accepted range.
        expected: String,
    },
    /// The memory budget is too small.
    #[error("memory budget of {budget} bytes is too small: {what} needs {needed} bytes ({needed_mib} MiB)", needed_mib = needed.div_ceil(1 << 20))]
    Memory {
        /// The failed reservation, with the current holders.
        what: String,
        /// A budget that would suffice, in bytes.
        needed: u64,
        /// The given budget, in bytes.
        budget: u64,
    },
    /// A disk is full, or too small.
    #[error("{path}: not enough space: {needed} more bytes ({mib} MiB) are needed, {free} are free", path = path.display(), mib = needed.div_ceil(1 << 20))]
    Disk {
        /// Scratch or output folder, or the file of the failed write.
        path: PathBuf,
        /// Further bytes that the run needs there.
        needed: u64,
        /// Free bytes.
        free: u64,
    },
    /// A scratch file does not match its checksum or has invalid content.
    #[error("{path}: scratch file damaged at byte {offset}: found {found}, expected {expected}", path = path.display())]
    Corrupt {
        /// The scratch file.
        path: PathBuf,
        /// Byte offset of the damaged part.
        offset: u64,
        /// The content found there.
        found: String,
        /// The expected content.
        expected: String,
    },
    /// There are more distinct points than ids.
    #[error("{found} distinct points are more than the {limit} that 32-bit ids can name")]
    TooManyPoints {
        /// Points found.
        found: u64,
        /// Largest number supported.
        limit: u64,
    },
    /// Another process uses the scratch folder.
    #[error("{path}: another run is at work here", path = path.display())]
    Locked {
        /// The scratch folder.
        path: PathBuf,
    },
    /// There is an unfinished run in the scratch folder.
    #[error("{path}: an unfinished run is here already", path = path.display())]
    Unfinished {
        /// The scratch folder.
        path: PathBuf,
    },
    /// The unfinished run has other inputs or parameters.
    #[error("{path}: cannot go on: {what} was {was}, now it is {now}", path = path.display())]
    Mismatch {
        /// The scratch folder.
        path: PathBuf,
        /// The property that differs.
        what: String,
        /// Its value when the run began.
        was: String,
        /// Its value now.
        now: String,
    },
    /// The folder has no run that can be resumed.
    #[error("{path}: {why}", path = path.display())]
    NotResumable {
        /// The folder.
        path: PathBuf,
        /// The reason.
        why: String,
        /// What the user can do about it; none if nothing is known.
        remedies: Vec<Remedy>,
    },
    /// A part of the program that was left out of this build is needed.
    #[error("{}this outcrop was built without {what}: build it with --features {feature}", place(path.as_deref()))]
    NotBuilt {
        /// The file that needs it, if it is a file.
        path: Option<PathBuf>,
        /// The part.
        what: &'static str,
        /// The feature of the build that has it.
        feature: &'static str,
    },
    /// No error: the way in which a process of a run that tasks share leaves the stages. No run returns it.
    #[doc(hidden)]
    #[error("the next units of work are for tasks")]
    Left(Left),
    /// The time limit is reached.
    #[error("stopped: the time limit is reached")]
    TimeLimit,
    /// The run is cancelled.
    #[error("stopped on request")]
    Cancelled,
}

/// The rest of the run's units are for tasks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Left(());

/// The file at the beginning of a message, if there is one.
fn place(path: Option<&Path>) -> String {
    path.map_or_else(String::new, |path| format!("{}: ", path.display()))
}

impl Error {
    /// True if a run that ended with this error can be resumed once the cause is removed.
    #[must_use]
    pub fn can_resume(&self) -> bool {
        match self {
            Error::Io { .. }
            | Error::Memory { .. }
            | Error::Disk { .. }
            | Error::Corrupt { .. }
            | Error::Left(_)
            | Error::TimeLimit
            | Error::Cancelled => true,
            Error::TooLarge { finished, .. } => *finished,
            Error::Input { .. }
            | Error::Degenerate { .. }
            | Error::Outside { .. }
            | Error::NoTriangles { .. }
            | Error::Parameter { .. }
            | Error::TooManyPoints { .. }
            | Error::Locked { .. }
            | Error::Unfinished { .. }
            | Error::Mismatch { .. }
            | Error::NotBuilt { .. }
            | Error::NotResumable { .. } => false,
        }
    }

    /// An [`Error::Io`] for `path`; `action` completes "cannot ...".
    pub fn io(path: impl AsRef<Path>, action: impl Into<String>, source: std::io::Error) -> Self {
        Error::Io {
            path: path.as_ref().to_path_buf(),
            action: action.into(),
            source,
        }
    }

    /// Leaves the stages, because the next units of work are for tasks.
    #[doc(hidden)]
    #[must_use]
    pub fn left() -> Self {
        Error::Left(Left(()))
    }

    /// An [`Error::NotResumable`].
    pub fn not_resumable(path: impl AsRef<Path>, why: impl Into<String>) -> Self {
        Error::NotResumable {
            path: path.as_ref().to_path_buf(),
            why: why.into(),
            remedies: Vec::new(),
        }
    }

    /// An [`Error::NoTriangles`].
    pub fn no_triangles(why: impl Into<String>) -> Self {
        Error::NoTriangles {
            why: why.into(),
            remedies: Vec::new(),
        }
    }

    /// The error of a PLY file.
    pub fn ply(path: &Path, error: outcrop_ply::Error) -> Self {
        match error {
            outcrop_ply::Error::Io(source) => Self::io(path, "read", source),
            outcrop_ply::Error::Input {
                place,
                found,
                expected,
            } => Self::input(path, place, found, expected),
        }
    }

    /// An [`Error::Input`] for a file that is not valid in its format.
    pub fn input(
        path: impl AsRef<Path>,
        place: impl Into<String>,
        found: impl Into<String>,
        expected: impl Into<String>,
    ) -> Self {
        Error::Input {
            path: path.as_ref().to_path_buf(),
            place: place.into(),
            found: found.into(),
            expected: expected.into(),
            remedies: Vec::new(),
        }
    }
}
