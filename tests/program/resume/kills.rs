//! Runs killed at events after which something is durable. `scripts/kill-test` covers all events.

use crate::end_to_end::util;
use crate::resume::run::{Case, FILTERS, PAPER, ROBUST};

/// Kills a run at every `step`th event of some kinds and resumes it.
fn survives(options: &[&str], step: u64, kinds: &[&str]) {
    let case = Case::new(options);
    let mut kills = 0;
    for (kind, start) in kinds.iter().zip([1, 3, 7, 2, 5, 4].iter().cycle()) {
        let count = case.events[*kind];
        for number in (*start..=count).step_by(step as usize) {
            let fault = format!("{kind}:{number}");
            case.killed(&fault);
            if case.scratch.exists() {
                assert_eq!(case.go_on(&fault), "", "{fault}");
                kills += 1;
            }
        }
    }
    println!("{options:?}: survived {kills} kills");
    assert!(kills > 10);
}

#[test]
fn killed_anywhere_a_run_goes_on() {
    survives(ROBUST, 14, &["torn", "recorded", "write"]);
}

#[test]
fn killed_anywhere_the_papers_method_goes_on() {
    survives(PAPER, 16, &["recorded", "torn"]);
}

#[test]
fn killed_anywhere_filters_go_on() {
    survives(FILTERS, 18, &["torn", "recorded"]);
}

#[test]
fn killed_while_far_points_are_searched() {
    let case = Case::with_far_point();
    assert_eq!(case.counts["input"]["dropped_far"], 1);
    let said = |said: &str| said.contains("1 points left out, far from all others");
    for number in 1..30 {
        let fault = format!("recorded:{number}");
        case.killed(&fault);
        assert!(said(&case.go_on(&fault)), "{fault}");
        let text = std::fs::read_to_string(case.bench.path("mesh.prj")).unwrap();
        assert_eq!(text.trim_end(), "LOCAL_CS[\"site\"]");
        std::fs::remove_file(case.bench.path("mesh.prj")).unwrap();
    }
    // What a file beside an input says is in the mesh.
    case.killed("recorded:20");
    case.bench.write("far.prj", "LOCAL_CS[\"another site\"]");
    let ended = case.attempt("", &["--resume"]);
    assert_eq!(ended.said.code, Some(2));
    assert!(ended.said.err.contains("far.prj was"), "{ended:?}");
}

#[test]
fn killed_while_the_mesh_gets_its_name() {
    let case = Case::new(ROBUST);
    for fault in ["rename:1", "renamed:1"] {
        case.killed(fault);
        assert!(case.scratch.exists());
        assert_eq!(case.mesh.exists(), fault == "renamed:1");
        assert_eq!(case.go_on(fault), "", "{fault}");
    }
}

#[test]
fn killed_while_a_compressed_mesh_is_written() {
    let case = Case::with_mesh("mesh.ply.zst", ROBUST);
    let last = |kind: &str| case.events[kind];
    let writes = (last("write") - 20..=last("write")).map(|n| format!("write:{n}"));
    let records = (last("recorded") - 6..=last("recorded")).map(|n| format!("recorded:{n}"));
    let names = ["rename:1", "renamed:1"].map(String::from);
    for fault in writes.chain(records).chain(names) {
        case.killed(&fault);
        if case.scratch.exists() {
            assert_eq!(case.go_on(&fault), "", "{fault}");
        }
    }
    // Of a disk that is full nothing is left under the final name, and the run goes on when there is room.
    let full = format!("full:{}", last("write") - 8);
    case.clear();
    let ended = case.attempt(&full, &["--threads", "2"]);
    assert_eq!(ended.said.code, Some(2), "{ended:?}");
    assert!(ended.said.err.contains("not enough space"), "{ended:?}");
    assert!(!case.mesh.exists());
    assert_eq!(case.go_on(&full), "");
}

#[test]
fn killed_while_a_mesh_in_another_format_is_written() {
    for (name, options) in [
        ("mesh.obj", &["--normals"][..]),
        ("mesh.stl", ROBUST),
        ("mesh.glb", &["--normals"]),
    ] {
        let case = Case::with_mesh(name, options);
        let last = |kind: &str| case.events[kind];
        let records = (last("recorded") - 4..=last("recorded")).map(|n| format!("recorded:{n}"));
        let writes = (last("write") - 24..=last("write")).step_by(9);
        let writes = writes.map(|n| format!("write:{n}"));
        let mut kills = 0;
        for fault in records.chain(writes).chain(["rename:1".to_owned()]) {
            case.killed(&fault);
            if case.scratch.exists() {
                assert_eq!(case.go_on(&fault), "", "{name}, {fault}");
                kills += 1;
            }
        }
        assert!(kills > 5, "{name}: {kills}");
    }
}

/// Some squares have their names when others are still unfinished.
#[test]
fn killed_while_a_divided_mesh_is_written() {
    for name in ["mesh.ply", "mesh.ply.zst"] {
        let crop = [
            "--crop",
            "-300,-300,250,300",
            "--crop-margin",
            "70",
            "--split",
            "150",
        ];
        let case = Case::with_mesh(name, &crop);
        let last = |kind: &str| case.events[kind];
        assert!(last("rename") > 8, "{}", last("rename"));
        let records = (last("recorded") - 30..=last("recorded")).step_by(3);
        let records = records.map(|n| format!("recorded:{n}"));
        let writes = (last("write") - 60..=last("write")).step_by(7);
        let writes = writes.map(|n| format!("write:{n}"));
        let names =
            [1, 2, 5, last("rename")].map(|n| [format!("rename:{n}"), format!("renamed:{n}")]);
        let mut kills = 0;
        for fault in records.chain(writes).chain(names.into_iter().flatten()) {
            case.killed(&fault);
            if case.scratch.exists() {
                assert_eq!(case.go_on(&fault), "", "{name}, {fault}");
                kills += 1;
            }
        }
        assert!(kills > 15, "{name}: {kills}");
    }
}

#[test]
fn killed_while_scratch_is_removed() {
    let case = Case::new(ROBUST);
    let events = case.events["delete"];
    for number in (1..=events).step_by(3) {
        let fault = format!("delete:{number}");
        case.killed(&fault);
        // How many threads wrote to a file, and so the number of its segments, differs between runs.
        if 10 * number > 9 * events && !case.scratch.exists() {
            break;
        }
        // The first files are deleted during the run, the rest when the mesh is complete.
        assert!(case.scratch.exists(), "{fault}");
        let said = case.go_on(&fault);
        // Of the files that identify the run, the manifest is deleted first.
        assert!(said.is_empty() || said.contains("manifest"), "{said}");
    }
}

#[test]
fn killed_again_and_again() {
    let case = Case::new(ROBUST);
    case.killed("recorded:9");
    let mut attempts = 1;
    // Every attempt is killed after its fourth record: several end inside the same step, of which they know
    // all earlier units.
    while case.scratch.exists() {
        let threads = ["1", "2", "3"][attempts % 3];
        let more = ["--resume", "--threads", threads];
        let fault = ["recorded:4", "torn:5"][attempts % 2];
        let ended = case.attempt(fault, &more);
        if ended.said.code == Some(0) {
            case.check(&ended.said, "the last attempt");
        } else {
            assert_eq!(ended.signal, Some(9), "{ended:?}");
        }
        attempts += 1;
        assert!(attempts < 300, "the run gets nowhere");
    }
    println!("{attempts} attempts");
    assert!(attempts > 5 && util::listing(case.bench.folder()).contains(&"mesh.ply".into()));
}
