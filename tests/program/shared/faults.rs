//! Tasks and the work between generations are killed, late, done twice, or damaged.

use crate::end_to_end::util;
use crate::shared::run::{Case, wait_until};
use rustix::process::{Pid, Signal, kill_process};
use std::os::unix::process::ExitStatusExt;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

const SHARDS: &[&str] = &["--shards", "3"];

/// True if the process is stopped.
fn is_stopped(child: &Child) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{}/stat", child.id())).unwrap();
    stat.rsplit_once(')')
        .unwrap()
        .1
        .trim_start()
        .starts_with('T')
}

/// An advance that is stopped before it publishes its work.
fn late_advance(case: &Case) -> Child {
    let late = case
        .command("advance", &[])
        .env("OUTCROP_FAULT", "freeze:publish")
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    wait_until(|| is_stopped(&late));
    late
}

fn go_on(child: Child) -> std::process::Output {
    kill_process(Pid::from_child(&child), Signal::CONT).unwrap();
    child.wait_with_output().unwrap()
}

#[test]
fn tasks_and_advances_are_killed_anywhere() {
    let case = Case::new(&[]);
    case.plan(SHARDS);
    let mut kills = 0;
    for round in 0.. {
        let faults = [
            format!("recorded:{}", 1 + round % 5),
            format!("torn:{}", 1 + round % 7),
            format!("write:{}", 2 + 5 * (round % 4)),
            "publish:1".into(),
            "published:1".into(),
        ];
        let fault = &faults[round % faults.len()];
        if case.status().can_advance() {
            let mut command = case.command("advance", &[]);
            let ended = command.env("OUTCROP_FAULT", fault).output().unwrap();
            kills += usize::from(ended.status.signal() == Some(9));
            if ended.status.success() && !case.scratch.exists() {
                break;
            }
            if case.status().can_advance() && !case.advance() {
                break;
            }
        }
        for shard in case.status().missing() {
            let ended = case.start(shard, fault).wait_with_output().unwrap();
            kills += usize::from(ended.status.signal() == Some(9));
            // Its work is lost, or it was published before.
            if case.status().missing().contains(&shard) {
                case.work(shard);
            }
        }
    }
    assert!(kills > 20, "{kills}");
    case.check();
}

#[test]
fn killed_while_the_mesh_gets_its_name() {
    let case = Case::new(&[]);
    for fault in ["rename:1", "renamed:1", "publish:1", "published:1"] {
        case.plan(SHARDS);
        case.advance_to("export");
        case.work_all();
        let mut command = case.command("advance", &[]);
        let ended = command.env("OUTCROP_FAULT", fault).output().unwrap();
        assert_eq!(ended.status.signal(), Some(9), "{fault}: {ended:?}");
        case.finish();
    }
}

#[test]
fn a_task_that_comes_late_changes_nothing() {
    for step in ["laz", "cells", "stitch"] {
        let case = Case::new(&[]);
        case.plan(SHARDS);
        case.advance_to(if step == "laz" { "LAZ" } else { step });
        let zombie = case.start(1, "freeze:publish");
        wait_until(|| is_stopped(&zombie));
        case.work_all();
        // It wakes up in a later generation, or after the mesh is finished.
        if step == "stitch" {
            case.finish();
            let said = go_on(zombie);
            assert!(said.status.success(), "{said:?}");
            continue;
        }
        assert!(case.advance());
        let before = util::listing(&case.scratch);
        let said = go_on(zombie);
        assert!(said.status.success(), "{said:?}");
        let after = util::listing(&case.scratch);
        assert!(after.iter().all(|name| before.contains(name)), "{after:?}");
        case.finish();
    }
}

#[test]
fn of_two_equal_tasks_the_first_one_counts() {
    let case = Case::new(&[]);
    case.plan(SHARDS);
    case.advance_to("cells");
    let late = case.start(0, "freeze:publish");
    wait_until(|| is_stopped(&late));
    case.work(0);
    let said = go_on(late);
    assert!(said.status.success(), "{said:?}");
    case.finish();
}

#[test]
fn of_two_advances_one_wins() {
    let case = Case::new(&[]);
    case.plan(SHARDS);
    loop {
        let late = late_advance(&case);
        let more = case.advance();
        let said = go_on(late);
        assert!(said.status.success(), "{said:?}");
        if !more {
            break;
        }
        case.work_all();
    }
    case.check();
}

#[test]
fn a_late_advance_does_not_turn_the_run_back() {
    let case = Case::new(&[]);
    case.plan(SHARDS);
    case.advance_to("relax");
    case.work_all();
    let late = late_advance(&case);
    case.advance_to("stitch");
    let said = go_on(late);
    assert!(said.status.success(), "{said:?}");
    case.finish();
}

#[test]
fn a_task_on_a_full_disk_is_done_again() {
    let case = Case::new(&[]);
    case.plan(SHARDS);
    case.advance_to("cells");
    let ended = case.start(2, "full:2").wait_with_output().unwrap();
    let text = String::from_utf8_lossy(&ended.stderr).into_owned();
    assert_eq!(ended.status.code(), Some(2), "{text}");
    assert!(text.contains("not enough space"), "{text}");
    case.finish();
}

#[test]
fn a_signal_ends_a_task_soon_and_costs_it_only() {
    let case = Case::new(&["--neighbors", "60"]);
    case.plan(&["--shards", "2"]);
    case.advance_to("cells");
    case.work(1);
    let task = case.start(0, "");
    std::thread::sleep(Duration::from_millis(30));
    let begin = Instant::now();
    kill_process(Pid::from_child(&task), Signal::TERM).unwrap();
    let ended = task.wait_with_output().unwrap();
    assert!(begin.elapsed() < Duration::from_secs(10));
    let code = (ended.status.code(), ended.status.signal());
    // Before the handler is installed, the signal itself ends it; or it was faster.
    assert!(
        matches!(code, (Some(143 | 0), _) | (_, Some(15))),
        "{ended:?}"
    );
    assert!(!case.status().missing().contains(&1));
    case.finish();
}

#[test]
fn what_a_slow_folder_does_not_show_yet_is_waited_for() {
    let case = Case::new(&[]);
    case.plan(SHARDS);
    case.advance_to("cells");
    case.work_all();
    let tasks = case
        .scratch
        .join(format!("tasks/{:06}", case.status().generation()));
    let (done, hidden) = (tasks.join("1.done"), case.bench.path("hidden"));
    std::fs::rename(&done, &hidden).unwrap();
    let said = case.say("advance", &[]);
    assert!(
        said.code == Some(75) && said.err.contains("shard 1 is missing"),
        "{said:?}"
    );
    std::fs::rename(&hidden, &done).unwrap();
    case.finish();
}

/// Flips a bit in the middle of each segment of a file.
fn damage(case: &Case, file: &str) {
    let segments = util::listing(&case.scratch).into_iter();
    let of_file = |name: &String| name.rsplit_once('.').is_some_and(|(stem, _)| stem == file);
    let mut count = 0;
    for name in segments.filter(of_file) {
        let path = case.scratch.join(name);
        let mut bytes = std::fs::read(&path).unwrap();
        if let Some(middle) = bytes.len().checked_div(2).filter(|middle| *middle > 0) {
            bytes[middle] ^= 16;
            std::fs::write(&path, bytes).unwrap();
            count += 1;
        }
    }
    assert!(count > 0, "there is no {file}");
}

/// The work of tasks is damaged after it was taken over; what it was made from is there, or is gone.
#[test]
fn damaged_work_is_made_again() {
    for (before, file) in [
        ("triples", "cells.own"),
        ("stitch/orient", "triples.own"),
        ("relax", "points"),
        ("export", "points"),
    ] {
        // Measured positions are needed to the end.
        let case = Case::new(&["--smooth", "0"]);
        case.plan(SHARDS);
        case.advance_to(before);
        case.work(0);
        damage(&case, file);
        let tasks = ["1", "2"].map(|shard| case.say("work", &["--shard", shard]));
        let found = tasks.iter().find(|said| said.code == Some(65));
        let found = found.unwrap_or_else(|| panic!("{before}: {tasks:?}"));
        assert!(found.err.contains("outcrop advance"), "{found:?}");
        assert_eq!(case.say("status", &["--missing"]).out, "");
        let text = case.say("status", &[]).out;
        assert!(text.contains("go on with    outcrop advance"), "{text}");
        let said = case.say("submit", &["--workers", "2"]);
        assert_eq!(said.code, Some(0), "{file}: {said:?}");
        case.check();
    }
}

#[test]
fn damage_that_is_gone_again_is_no_damage() {
    let case = Case::new(&[]);
    case.plan(SHARDS);
    case.advance_to("triples");
    let hidden = case.bench.path("hidden");
    let segments = util::listing(&case.scratch).into_iter();
    let name = segments.filter(|name| name.starts_with("cells.own.")).max();
    let path = case.scratch.join(name.unwrap());
    std::fs::rename(&path, &hidden).unwrap();
    let codes: Vec<_> = (0..3)
        .map(|shard: u64| case.say("work", &["--shard", &shard.to_string()]).code)
        .collect();
    assert!(codes.contains(&Some(65)), "{codes:?}");
    std::fs::rename(&hidden, &path).unwrap();
    let said = case.say("advance", &[]);
    assert_eq!(said.code, Some(75), "{said:?}");
    let text = case.say("status", &[]).out;
    assert!(text.contains("all files were whole"), "{text}");
    case.finish();
}

/// A folder that was not removed as a whole, for example because a file in it was open on a network.
#[test]
fn what_is_left_of_a_finished_run_is_removed() {
    let case = Case::new(&[]);
    case.plan(SHARDS);
    let generations = util::listing(&case.scratch.join("generations"));
    for name in generations {
        std::fs::remove_file(case.scratch.join("generations").join(name)).unwrap();
    }
    let said = case.say("status", &["--missing"]);
    assert!(said.code == Some(0) && said.out.is_empty(), "{said:?}");
    let said = case.say("status", &["--json"]);
    assert!(said.out.contains("\"finished\": true"), "{said:?}");
    case.work(0);
    let said = case.say("advance", &[]);
    assert!(
        said.code == Some(0) && said.out.contains("finished"),
        "{said:?}"
    );
    assert!(!case.scratch.exists());
    std::fs::create_dir_all(case.scratch.join("generations")).unwrap();
    let mode = std::os::unix::fs::PermissionsExt::from_mode(0o700);
    std::fs::set_permissions(&case.scratch, mode).unwrap();
    let said = case.say("status", &[]);
    assert!(
        said.code == Some(2) && said.err.contains("may be removed"),
        "{said:?}"
    );
}

#[test]
fn a_damaged_result_is_not_believed_and_made_again() {
    let case = Case::new(&[]);
    case.plan(SHARDS);
    case.advance_to("cells");
    case.work_all();
    let cut = |name: &str| {
        let path = case.scratch.join(name);
        let file = std::fs::File::options().write(true).open(&path).unwrap();
        file.set_len(path.metadata().unwrap().len() - 1).unwrap();
    };
    let done = format!("tasks/{:06}/1.done", case.status().generation());
    cut(&done);
    let refused = |shard: u64| {
        let said = case.say("advance", &[]);
        let expected = format!("shard {shard} is missing");
        assert!(
            said.code == Some(75) && said.err.contains(&expected),
            "{said:?}"
        );
        assert_eq!(case.status().missing(), [shard]);
        case.work(shard);
    };
    refused(1);
    let segments = util::listing(&case.scratch)
        .into_iter()
        .filter(|name| name.starts_with("cells"));
    let newest =
        segments.max_by_key(|name| name.rsplit_once('.').unwrap().1.parse::<u32>().unwrap());
    cut(&newest.unwrap());
    refused(2);
    case.finish();
}
