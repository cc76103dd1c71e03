//! A signal stops the program soon and cleanly.

use crate::end_to_end::util::{self, Bench};
use outcrop_cloudgen::{Cloud, Kind};
use rustix::process::{Pid, Signal, kill_process};
use std::io::Read;
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

/// Much more than a run needs to stop, so that the test passes on a busy machine.
const PATIENCE: Duration = Duration::from_secs(30);

fn wait(child: &mut Child, what: &str, mut done: impl FnMut(&mut Child) -> bool) {
    let start = Instant::now();
    while !done(child) {
        if start.elapsed() > PATIENCE {
            child.kill().unwrap();
            panic!("{what} takes more than {PATIENCE:?}");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Sends `signal` once the scratch folder has `file`, in the middle of a long run. Finished work stays, if
/// there is any.
fn stops(input: &Path, file: &str, signal: Signal, code: i32) {
    let bench = Bench::new();
    let scratch = bench.subfolder("scratch");
    let output = bench.subfolder("output");
    let mesh = output.join("mesh.ply");
    std::fs::write(&mesh, "something dear").unwrap();
    let mut command = util::program(["reconstruct", "--memory", "192MiB", "--smooth", "100", "-o"]);
    command.arg(&mesh).arg(input).arg("--scratch").arg(&scratch);
    command.arg("--report").arg(output.join("report.json"));
    let mut child = command
        .stderr(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    wait(&mut child, "the start", |child| {
        assert_eq!(
            child.try_wait().unwrap(),
            None,
            "the run ended before it could be stopped"
        );
        let folders = util::listing(&scratch);
        folders.first().is_some_and(|folder| {
            let Ok(entries) = std::fs::read_dir(scratch.join(folder)) else {
                return false;
            };
            let mut names = entries.filter_map(|e| e.ok()?.file_name().into_string().ok());
            names.any(|name| name.starts_with(file))
        })
    });
    let start = Instant::now();
    kill_process(Pid::from_child(&child), signal).unwrap();
    wait(&mut child, "stopping", |child| {
        child.try_wait().unwrap().is_some()
    });
    println!("{file}: stopped after {:?}", start.elapsed());
    assert_eq!(child.wait().unwrap().code(), Some(code));
    let (mut out, mut err) = (String::new(), String::new());
    child
        .stdout
        .take()
        .unwrap()
        .read_to_string(&mut out)
        .unwrap();
    child
        .stderr
        .take()
        .unwrap()
        .read_to_string(&mut err)
        .unwrap();
    assert_eq!(out, "");
    let folders = util::listing(&scratch);
    if let Some(folder) = folders.first() {
        let path = scratch.join(folder);
        let how = format!("; go on with: outcrop resume {}", path.display());
        assert_eq!(err, format!("outcrop: stopped on request{how}\n"));
    } else {
        assert_eq!((file, err.as_str()), ("", "outcrop: stopped on request\n"));
    }
    assert_eq!(util::listing(&output), ["mesh.ply"]);
    assert_eq!(std::fs::read(&mesh).unwrap(), b"something dear");
}

#[test]
fn signals_stop_a_run() {
    let bench = Bench::new();
    let input = bench.cloud("cloud.laz", &Cloud::new(Kind::Terrain).points(300_000));
    for (signal, code) in [(Signal::INT, 130), (Signal::TERM, 143)] {
        // At once, and in the middle of the run.
        for file in ["", "points"] {
            stops(&input, file, signal, code);
        }
    }
}
