//! The main function of a tool: arguments, one line for an error, exit code.

use clap::Parser;
use clap::error::ErrorKind;
use std::fmt::Display;
use std::process::ExitCode;

/// Exit code for errors.
const FAILED: u8 = 2;

/// Without a command clap prints help, which is more than one line.
const HELP: ErrorKind = ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand;

/// Reads the arguments and runs the tool. Errors are printed to standard error, on one line.
#[must_use]
pub fn main<A: Parser, E: Display>(run: impl FnOnce(&A) -> Result<(), E>) -> ExitCode {
    let args = match A::try_parse() {
        Ok(args) => args,
        Err(error) if !error.use_stderr() || error.kind() == HELP => error.exit(),
        Err(error) => {
            eprintln!("{}", one_line(&error));
            return ExitCode::from(FAILED);
        }
    };
    match run(&args) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{}: {error}", A::command().get_name());
            ExitCode::from(FAILED)
        }
    }
}

/// The message of a usage error without the usage text.
fn one_line(error: &clap::Error) -> String {
    let text = error.to_string();
    let lines = text
        .lines()
        .take_while(|line| !line.trim().is_empty())
        .map(str::trim);
    lines.collect::<Vec<_>>().join(" ")
}
