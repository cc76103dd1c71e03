//! A run that is started again while the process before it still ends.

use crate::end_to_end::util;
use crate::resume::run::{Case, PAPER};
use std::io::{BufRead, BufReader, Read};
use std::process::Stdio;

/// Holds the lock of a scratch folder.
fn held(case: &Case) -> std::fs::File {
    let lock = case.scratch.join("lock");
    let file = std::fs::File::options().write(true).open(lock).unwrap();
    file.lock().unwrap();
    file
}

#[test]
fn a_run_waits_for_the_process_before_it() {
    let case = Case::new(PAPER);
    for command in ["--resume", "resume"] {
        case.killed("recorded:20");
        let lock = held(&case);
        let mut again = match command {
            "resume" => util::program(["resume".as_ref(), case.scratch.as_os_str()]),
            _ => {
                let mut again = util::program(case.arguments());
                again.arg("--resume");
                again
            }
        };
        let again = again.stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut process = again.spawn().unwrap();
        // What it says before the lock is free: that it waits.
        let mut said = BufReader::new(process.stderr.take().unwrap());
        let mut first = String::new();
        said.read_line(&mut first).unwrap();
        let waits = "another run is at work here; waiting up to 10 s";
        assert!(first.contains(waits), "{first}");
        drop(lock);
        let mut rest = String::new();
        said.read_to_string(&mut rest).unwrap();
        let mut said: util::Said = process.wait_with_output().unwrap().into();
        said.err = rest;
        case.check(&said, command);
        assert!(!said.err.contains(waits), "{}", said.err);
    }
}

#[test]
fn only_a_run_that_goes_on_waits() {
    let case = Case::new(PAPER);
    case.killed("recorded:20");
    let _lock = held(&case);
    for more in [&["--restart"][..], &[]] {
        let said = util::run(
            case.arguments()
                .into_iter()
                .chain(more.iter().map(ToString::to_string)),
        );
        assert_eq!(said.code, Some(2), "{said:?}");
        assert!(
            said.err
                .contains("another run is at work here; wait for it"),
            "{}",
            said.err
        );
        // One that waits says so first.
        assert_eq!(said.err.lines().count(), 1, "{}", said.err);
    }
}
