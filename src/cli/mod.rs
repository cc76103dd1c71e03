//! The command line: arguments, messages, exit codes. The only code that prints.

mod areas;
mod args;
pub mod call;
mod command;
mod commands;
#[cfg(feature = "demo")]
mod demo;
mod ended;
mod jobs;
mod manual;
mod new_file;
mod output;
mod pages;
mod parse;
mod progress;
mod shared;
mod stop;
mod style;
#[cfg(feature = "view")]
mod view;

use clap::Parser;
use ended::Ended;
use outcrop_disk::error::Error;
pub use output::told;
use std::process::ExitCode;

/// Exit code for a negative answer (`verify`).
const NO: u8 = 1;
/// Exit code for errors.
const FAILED: u8 = 2;

/// Exit code of a task, or of `advance`, that found the work of others damaged.
const DAMAGED: u8 = 65;

/// Runs the command line. Exit codes: 0 success, 1 negative answer, 2 error, 65 damaged work of tasks,
/// 75 time limit, 128 + signal.
#[must_use]
pub fn main() -> ExitCode {
    #[cfg(feature = "ablation")]
    match outcrop_paper::method::report() {
        Ok(list) if list.is_empty() => {}
        Ok(list) => {
            print!("{list}");
            return ExitCode::SUCCESS;
        }
        Err(why) => {
            eprintln!("outcrop: {why}");
            return ExitCode::from(FAILED);
        }
    }
    #[cfg(feature = "faults")]
    if let Err(why) = crate::faults::install() {
        eprintln!("outcrop: {why}");
        return ExitCode::from(FAILED);
    }
    outcrop_formats::hide_caught_panics();
    let args = command::Args::parse_from(outcrop_platform::names::arguments());
    match commands::run(args.command) {
        Ok(Ended::Yes) => ExitCode::SUCCESS,
        Ok(Ended::No) => ExitCode::from(NO),
        Ok(Ended::TooEarly(what)) => {
            eprintln!("outcrop: {what}; try again later");
            ExitCode::from(stop::TIME_IS_UP)
        }
        Ok(Ended::Damaged(error)) => {
            let error = told(&error);
            eprintln!(
                "outcrop: {error}; `outcrop advance` finds what is damaged and has it made again"
            );
            ExitCode::from(DAMAGED)
        }
        Err(error) => {
            // A closed pipe (`| head`) is no error.
            if !style::is_broken_pipe(&error) {
                let mut hint = error.can_resume().then(stop::hint).unwrap_or_default();
                if let (Error::TooLarge { path, .. }, false) = (&error, hint.is_empty()) {
                    let other = stop::quoted(&path.with_extension("ply"));
                    hint.push_str(&format!(" --output {other}"));
                }
                eprintln!("outcrop: {}{hint}", told(&error));
            }
            ExitCode::from(match error {
                Error::Cancelled => stop::code(false),
                Error::TimeLimit => stop::code(true),
                _ => FAILED,
            })
        }
    }
}
