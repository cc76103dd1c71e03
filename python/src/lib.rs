//! The extension `outcrop._outcrop`: a command of the program on a thread of its own. Python writes the words of
//! the command line, waits, and reads the result; no thread of the run ever needs the interpreter.

#![forbid(unsafe_code)]

mod job;
mod progress;

use pyo3::prelude::*;

/// The part of outcrop that is not Python.
#[pymodule]
mod _outcrop {
    #[pymodule_export]
    use super::job::Job;
    #[pymodule_export]
    use super::{options, part_of};
    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        outcrop::hide_caught_panics();
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}

/// An option: name, is a flag, repeats, default, is hidden, help.
type OptionRow = (String, bool, bool, Option<String>, bool, String);

/// The options of a command, as `outcrop COMMAND --help` has them.
#[pyfunction]
fn options(command: &str) -> Vec<OptionRow> {
    let all = outcrop::call::options(command).into_iter();
    all.map(|o| (o.name, o.is_flag, o.repeats, o.default, o.is_hidden, o.help))
        .collect()
}

/// Names the file of this extension: all processes that share a run must have the very same.
#[pyfunction]
fn part_of(file: std::path::PathBuf) {
    outcrop::call::part_of(file);
}
