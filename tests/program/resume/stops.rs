//! Signals and time limits stop a run soon, and it can be resumed.

use crate::end_to_end::util::{self, Bench, Said};
use outcrop_cloudgen::{Cloud, Kind};
use rustix::process::{Pid, Signal, WaitOptions, kill_process, waitpid};
use std::path::PathBuf;
use std::process::Stdio;

/// The arguments of a run of some hundred units.
fn long(bench: &Bench) -> (PathBuf, Vec<String>) {
    let cloud = Cloud::new(Kind::Terrain).points(100_000).noise(0.6);
    let (input, mesh) = (bench.cloud("cloud.laz", &cloud), bench.path("mesh.ply"));
    let paths = [&input, &mesh].map(|p| p.display().to_string());
    let fixed = ["reconstruct", &paths[0], "-o", &paths[1], "--threads", "2"];
    let parts = ["--block-points", "4096", "--tile-points", "2048"];
    let fixed = fixed.iter().chain(&parts);
    let fixed = fixed.chain(&["--smooth", "2", "--memory", "192MiB"]);
    (mesh.clone(), fixed.map(ToString::to_string).collect())
}

/// Runs the program to its end, and returns what it says and the number of records that it wrote.
fn counted(bench: &Bench, arguments: &[String]) -> (Said, u64) {
    let counts = bench.path("counts");
    let mut command = util::program(arguments);
    command.env("OUTCROP_FAULT", format!("count:{}", counts.display()));
    let said = command.output().unwrap().into();
    let counts = std::fs::read_to_string(counts).unwrap();
    let records = counts.lines().find_map(|line| line.strip_prefix("record "));
    (said, records.unwrap().parse().unwrap())
}

/// Stops a run with a signal before it writes its record of this number.
fn stopped(arguments: &[String], record: u64, signal: Signal) -> Said {
    let mut command = util::program(arguments);
    command.env("OUTCROP_FAULT", format!("freeze:{record}"));
    let child = command.stderr(Stdio::piped()).stdout(Stdio::piped());
    let child = child.spawn().unwrap();
    let pid = Pid::from_child(&child);
    let (_, status) = waitpid(Some(pid), WaitOptions::UNTRACED).unwrap().unwrap();
    assert!(status.stopped(), "{status:?}");
    kill_process(pid, signal).unwrap();
    kill_process(pid, Signal::CONT).unwrap();
    child.wait_with_output().unwrap().into()
}

#[test]
fn signals_stop_a_run_that_goes_on() {
    let bench = Bench::new();
    let (mesh, arguments) = long(&bench);
    let scratch = bench.path("mesh.ply.outcrop-scratch");
    let (said, records) = counted(&bench, &arguments);
    assert_eq!(said.code, Some(0), "{said:?}");
    let expected = util::hash(&mesh);
    for (signal, code, percent) in [
        (Signal::INT, 130, 30),
        (Signal::TERM, 143, 50),
        (Signal::TERM, 143, 70),
        (Signal::HUP, 129, 85),
    ] {
        std::fs::remove_file(&mesh).unwrap();
        let at = records * percent / 100;
        let said = stopped(&arguments, at, signal);
        assert_eq!(said.code, Some(code), "{said:?}");
        let how = format!(
            "; go on with: outcrop resume {}
",
            scratch.display()
        );
        assert!(said.err.ends_with(&how), "{said:?}");
        assert!(!mesh.exists());
        let resume = ["resume".to_owned(), scratch.display().to_string()];
        let (said, more) = counted(&bench, &resume);
        assert_eq!((said.code, said.err.as_str()), (Some(0), ""));
        assert!(util::hash(&mesh) == expected && !scratch.exists());
        // It stopped soon: most of the work that was left then was left for the next attempt.
        assert!(
            more > (records - at) / 2,
            "{signal:?} at {at} of {records}: {more}"
        );
    }
}

#[test]
fn a_run_gets_to_its_end_within_time_limits() {
    let bench = Bench::new();
    let (mesh, arguments) = long(&bench);
    let scratch = bench.path("mesh.ply.outcrop-scratch");
    assert_eq!(util::run(&arguments).code, Some(0));
    let expected = util::hash(&mesh);
    std::fs::remove_file(&mesh).unwrap();
    // The first is over before any run is, and each one is twice as long.
    let mut limits = (0..).map(|doubled| format!("{}ms", 1u64 << doubled));
    let mut attempt = || {
        let limit = limits.next().unwrap();
        let more = ["--resume", "--time-limit", &limit].map(str::to_owned);
        util::run(arguments.iter().cloned().chain(more))
    };
    let mut said = attempt();
    assert_eq!(said.code, Some(75), "{said:?}");
    while said.code == Some(75) {
        assert!(said.err.contains("time limit"), "{said:?}");
        assert!(!mesh.exists());
        said = attempt();
    }
    assert_eq!(said.code, Some(0), "{said:?}");
    assert!(util::hash(&mesh) == expected && !scratch.exists());
}
