//! A run that is started again while the process before it still ends.

use crate::resume::run::{Case, PAPER};
use crate::resume::util;
use std::process::Stdio;
use std::time::{Duration, Instant};

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
        let begin = Instant::now();
        let process = again.stderr(Stdio::piped()).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(1200));
        drop(lock);
        let said: util::Said = process.wait_with_output().unwrap().into();
        assert!(begin.elapsed() > Duration::from_millis(1200));
        case.check(&said, command);
        let lines = said.err.lines();
        let waited =
            lines.filter(|line| line.contains("another run is at work here; waiting up to 10 s"));
        assert_eq!(waited.count(), 1, "{}", said.err);
    }
}

#[test]
fn only_a_run_that_goes_on_waits() {
    let case = Case::new(PAPER);
    case.killed("recorded:20");
    let _lock = held(&case);
    for more in [&["--restart"][..], &[]] {
        let begin = Instant::now();
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
        assert!(begin.elapsed() < Duration::from_secs(8));
    }
}
