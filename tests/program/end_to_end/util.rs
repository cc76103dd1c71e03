//! Shared by the end-to-end tests: generated clouds, runs of the library and of the program, and their
//! results.

use outcrop::inspect::verify::{Verdict, verify};
use outcrop::params::Params;
use outcrop::report::Report;
use outcrop::{Builder, Reconstruction};
use outcrop_cloudgen::{Cloud, Format};
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::memory::{MINIMUM_BUDGET, MemoryPool};
use outcrop_disk::workspace::progress::{Cancel, Silent};
use std::ffi::OsStr;
use std::hash::Hasher;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::Arc;

pub use crate::skip::skip;

/// Folder of real scans, if it exists.
pub const SCANS: &str = "../shared/data/scans";

/// The real scan `name`; if it is absent, the test is skipped.
pub fn scan(name: &str) -> Option<PathBuf> {
    crate::skip::if_present(Path::new(SCANS).join(name))
}

/// A folder for the files of one test.
pub struct Bench(tempfile::TempDir);

impl Bench {
    pub fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    pub fn folder(&self) -> &Path {
        self.0.path()
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Writes `bytes` to the file `name`.
    pub fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path(name);
        std::fs::write(&path, bytes).unwrap();
        path
    }

    /// Writes a generated cloud to the file `name`, in the format of its extension.
    pub fn cloud(&self, name: &str, cloud: &Cloud) -> PathBuf {
        let path = self.path(name);
        cloud
            .write(&path, Format::from_path(&path).unwrap())
            .unwrap();
        path
    }

    /// Writes points as text.
    pub fn points(&self, name: &str, points: &[[f64; 3]]) -> PathBuf {
        let lines: Vec<_> = points
            .iter()
            .map(|[x, y, z]| format!("{x} {y} {z}\n"))
            .collect();
        self.write(name, lines.concat())
    }

    /// A new, empty folder.
    pub fn subfolder(&self, name: &str) -> PathBuf {
        let path = self.path(name);
        std::fs::create_dir(&path).unwrap();
        path
    }
}

/// Names of everything in a folder, sorted.
pub fn listing(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<_> = entries
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

/// A hash of a file's bytes.
pub fn hash(path: &Path) -> u64 {
    let bytes = std::fs::read(path).unwrap();
    let mut hasher = std::collections::hash_map::DefaultHasher::new();
    hasher.write(&bytes);
    hasher.finish()
}

/// A builder with the smallest budget and two threads.
pub fn builder(inputs: &[PathBuf], output: &Path, params: &Params) -> Builder {
    let start = Reconstruction::builder()
        .output(output)
        .params(params.clone())
        .memory(MINIMUM_BUDGET)
        .threads(2);
    inputs
        .iter()
        .fold(start, |builder, input| builder.input(input))
}

/// Runs with the smallest budget and two threads.
pub fn reconstruct(input: &Path, output: &Path, params: &Params) -> Report {
    builder(&[input.into()], output, params)
        .build()
        .unwrap()
        .run()
        .unwrap()
}

/// The verdict of `verify` on a mesh.
pub fn verdict(mesh: &Path) -> Verdict {
    let memory = MemoryPool::new(MINIMUM_BUDGET).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let workspace =
        Workspace::new(folder.path(), memory, 2, Arc::new(Silent), Cancel::new()).unwrap();
    verify(mesh, &workspace).unwrap()
}

/// The program with arguments, not started.
pub fn program<S: AsRef<OsStr>>(arguments: impl IntoIterator<Item = S>) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_outcrop"));
    command.args(arguments).stdin(Stdio::null());
    command
}

/// Output and exit code of a finished program.
#[derive(Debug)]
pub struct Said {
    pub code: Option<i32>,
    pub out: String,
    pub err: String,
}

impl From<Output> for Said {
    fn from(output: Output) -> Self {
        Self {
            code: output.status.code(),
            out: String::from_utf8(output.stdout).unwrap(),
            err: String::from_utf8(output.stderr).unwrap(),
        }
    }
}

/// Runs the program to its end.
pub fn run<S: AsRef<OsStr>>(arguments: impl IntoIterator<Item = S>) -> Said {
    program(arguments).output().unwrap().into()
}
