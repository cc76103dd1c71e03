//! The answers of `status`, and the ways to submit.

use crate::end_to_end::util;
use crate::shared::run::Case;
use std::os::unix::fs::PermissionsExt;
use std::time::{Duration, SystemTime};

fn json(case: &Case) -> serde_json::Value {
    let said = case.say("status", &["--json"]);
    assert_eq!(said.code, Some(0), "{said:?}");
    serde_json::from_str(&said.out).unwrap()
}

#[test]
fn status_tells_what_runs_what_failed_and_why_and_what_is_lost() {
    let case = Case::new(&[]);
    case.plan(&["--shards", "4"]);
    case.advance_to("cells");
    case.work(0);
    // One fails, one is killed and silent for an hour, one is killed just now.
    for (shard, fault) in [(1, "full:2"), (2, "write:3"), (3, "write:3")] {
        case.start(shard, fault).wait_with_output().unwrap();
    }
    let generation = case.status().generation();
    let journal = case.scratch.join(format!("tasks/{generation:06}/2.0"));
    let journal = std::fs::File::options().write(true).open(journal).unwrap();
    let past = SystemTime::now() - Duration::from_secs(3600);
    journal.set_modified(past).unwrap();

    let status = json(&case);
    let states: Vec<_> = status["begun"].as_array().unwrap().iter().collect();
    let state = |k: usize| {
        (
            states[k]["shard"].as_u64().unwrap(),
            states[k]["state"].as_str().unwrap(),
        )
    };
    assert_eq!(
        (state(0), state(1), state(2)),
        ((1, "failed"), (2, "lost"), (3, "running"))
    );
    let why = states[0]["why"].as_str().unwrap();
    assert!(why.contains("not enough space"), "{why}");
    assert!(states[1]["silent_seconds"].as_u64().unwrap() >= 3600);
    let points = status["points"].as_u64().unwrap();
    assert!((32_000..=33_100).contains(&points), "{points}");
    assert!(status["points_per_second"].as_f64().unwrap() > 0.0);
    assert!(status["step_seconds_left"].as_f64().unwrap() > 0.0);
    assert!(status["seconds_left"].as_f64().unwrap() >= 0.0);

    let text = case.say("status", &[]).out;
    for part in [
        "1 of 4 done, 1 running, 1 failed, 1 lost, 0 not begun",
        "failed        shard 1: ",
        "not enough space",
        "lost          shard 2, silent for 60 min",
        "a second in this step",
        "time left     about",
        "go on with    outcrop submit",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    // Whoever tries again is at work, and the old reason is still told.
    case.start(1, "write:3").wait_with_output().unwrap();
    let text = case.say("status", &[]).out;
    assert!(
        text.contains("again         shard 1, 2 attempts: "),
        "{text}"
    );
    case.finish();
}

#[test]
fn status_tells_why_an_advance_failed() {
    let case = Case::new(&[]);
    case.plan(&["--shards", "2"]);
    case.advance_to("stitch");
    case.work_all();
    let mut advance = case.command("advance", &[]);
    let ended = advance.env("OUTCROP_FAULT", "full:1").output().unwrap();
    assert_eq!(ended.status.code(), Some(2), "{ended:?}");
    let text = case.say("status", &[]).out;
    assert!(
        text.contains("failed        advance: ") && text.contains("not enough space"),
        "{text}"
    );
    case.finish();
}

#[test]
fn one_command_leads_from_points_to_the_mesh() {
    let case = Case::new(&["--relax", "0"]);
    case.plan(&["--shards", "3", "--submit", "local", "--workers", "2"]);
    case.check();
}

#[test]
fn what_is_only_for_submitting_needs_it() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = folder.path().join("m.ply").display().to_string();
    let said = util::run(["plan", "a.laz", "-o", &mesh, "--", "--partition=long"]);
    assert!(
        said.code == Some(2) && said.err.contains("SITE FLAGS"),
        "{said:?}"
    );
    let said = util::run(["plan", "a.laz", "-o", &mesh, "--workers", "2"]);
    assert!(
        said.code == Some(2) && said.err.contains("--submit"),
        "{said:?}"
    );
}

/// Stands for srun: notes its options and runs the command.
const SRUN: &str = r#"#!/bin/sh
echo "$*" >>"$SRUN_LOG"
while [ "${1#-}" != "$1" ]; do shift; done
exec "$@"
"#;

#[test]
fn inside_an_allocation_tasks_are_steps() {
    let case = Case::new(&[]);
    case.plan(&["--shards", "3", "--task-threads", "2"]);
    let bin = tempfile::tempdir().unwrap();
    let (srun, log) = (bin.path().join("srun"), bin.path().join("log"));
    std::fs::write(&srun, SRUN).unwrap();
    std::fs::set_permissions(&srun, PermissionsExt::from_mode(0o755)).unwrap();
    let more = [
        "--engine",
        "slurm",
        "--within-allocation",
        "--",
        "--overlap",
    ];
    let said = case.say("submit", &more);
    assert!(
        said.code == Some(2) && said.err.contains("SLURM_NTASKS"),
        "{said:?}"
    );
    let path = format!(
        "{}:{}",
        bin.path().display(),
        std::env::var("PATH").unwrap()
    );
    let mut submit = case.command("submit", &more);
    submit.envs([("PATH", path), ("SLURM_NTASKS", "2".into())]);
    let ended = submit.env("SRUN_LOG", &log).output().unwrap();
    assert_eq!(ended.status.code(), Some(0), "{ended:?}");
    case.check();
    let log = std::fs::read_to_string(&log).unwrap();
    for line in log.lines() {
        let options = "--nodes=1 --ntasks=1 --exact --cpus-per-task=2 --mem=2156M --overlap ";
        assert!(
            line.starts_with(options) && line.contains(" work "),
            "{line}"
        );
    }
    assert!(log.lines().count() >= 26, "{log}");
}
