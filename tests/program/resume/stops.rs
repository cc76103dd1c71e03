//! Signals and time limits stop a run soon, and it can be resumed.

use crate::resume::util::{self, Bench, Said};
use outcrop_cloudgen::{Cloud, Kind};
use rustix::process::{Pid, Signal, kill_process};
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::{Duration, Instant};

/// A run of a few seconds.
fn long(bench: &Bench) -> (PathBuf, PathBuf, Vec<String>) {
    let cloud = Cloud::new(Kind::Terrain).points(400_000).noise(0.6);
    let (input, mesh) = (bench.cloud("cloud.laz", &cloud), bench.path("mesh.ply"));
    let paths = [&input, &mesh].map(|p| p.display().to_string());
    let fixed = ["reconstruct", &paths[0], "-o", &paths[1], "--threads", "2"];
    let fixed = fixed.iter().chain(&["--smooth", "2", "--memory", "192MiB"]);
    (
        mesh.clone(),
        input,
        fixed.map(ToString::to_string).collect(),
    )
}

fn resume(scratch: &Path) -> Said {
    util::run(["resume".as_ref(), scratch.as_os_str()])
}

#[test]
fn signals_and_time_limits_stop_a_run_that_goes_on() {
    let bench = Bench::new();
    let (mesh, _, arguments) = long(&bench);
    let scratch = bench.path("mesh.ply.outcrop-scratch");
    let start = Instant::now();
    assert_eq!(util::run(&arguments).code, Some(0));
    let (whole, expected) = (start.elapsed(), util::hash(&mesh));
    for (signal, code, share) in [
        (Signal::INT, 130, 0.3),
        (Signal::TERM, 143, 0.5),
        (Signal::TERM, 143, 0.7),
        (Signal::HUP, 129, 0.85),
    ] {
        let _ = std::fs::remove_file(&mesh);
        let mut command = util::program(&arguments);
        let child = command.stderr(Stdio::piped()).stdout(Stdio::piped());
        let child = child.spawn().unwrap();
        std::thread::sleep(whole.mul_f64(share));
        let sent = Instant::now();
        let _ = kill_process(Pid::from_child(&child), signal);
        let said = Said::from(child.wait_with_output().unwrap());
        println!("{signal:?} at {share}: ended after {:?}", sent.elapsed());
        if said.code == Some(0) {
            continue;
        }
        assert!(
            sent.elapsed() < Duration::from_secs(3),
            "{:?}",
            sent.elapsed()
        );
        assert_eq!(said.code, Some(code), "{said:?}");
        let how = format!("; go on with: outcrop resume {}\n", scratch.display());
        assert!(said.err.ends_with(&how), "{said:?}");
        assert!(!mesh.exists());
        let said = resume(&scratch);
        assert_eq!((said.code, said.err.as_str()), (Some(0), ""));
        assert!(util::hash(&mesh) == expected && !scratch.exists());
    }
    let _ = std::fs::remove_file(&mesh);
    let limit = format!("{}ms", whole.as_millis() * 2 / 3);
    let limited = arguments.iter().map(String::as_str);
    let mut said = util::run(limited.chain(["--time-limit", &limit]));
    let mut attempts = 1;
    while said.code == Some(75) {
        assert!(said.err.contains("time limit"), "{said:?}");
        let path = scratch.to_str().unwrap();
        said = util::run(["resume", path, "--time-limit", &limit]);
        attempts += 1;
        assert!(attempts < 20, "the run gets nowhere");
    }
    assert_eq!(said.code, Some(0), "{said:?}");
    assert!(util::hash(&mesh) == expected && !scratch.exists());
    println!("done in {attempts} attempts of {limit}");
}
