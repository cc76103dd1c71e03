//! Scratch files that are damaged, cut short, deleted or replaced; full disks.

use crate::end_to_end::util;
use crate::resume::run::{Case, ROBUST, copy};
use std::collections::BTreeSet;
use std::path::Path;

/// Damages a file in one of several ways.
fn spoil(path: &Path, how: usize) -> &'static str {
    let mut bytes = std::fs::read(path).unwrap();
    match how % 4 {
        0 if !bytes.is_empty() => {
            bytes[0] ^= 4;
            std::fs::write(path, bytes).unwrap();
            "a bit flipped"
        }
        1 => {
            bytes.truncate(bytes.len() / 2);
            std::fs::write(path, bytes).unwrap();
            "cut short"
        }
        2 => {
            std::fs::remove_file(path).unwrap();
            let victim = path.parent().unwrap().with_file_name("victim");
            std::fs::write(&victim, "something dear").unwrap();
            std::os::unix::fs::symlink(&victim, path).unwrap();
            "a link to elsewhere"
        }
        _ => {
            std::fs::remove_file(path).unwrap();
            "gone"
        }
    }
}

/// The file to which a segment belongs.
fn file_of(name: &str) -> &str {
    match name.rsplit_once('.') {
        Some((file, number)) if number.parse::<u32>().is_ok() => file,
        _ => name,
    }
}

#[test]
fn damage_to_any_file_is_found_and_mended() {
    let case = Case::new(ROBUST);
    // The last tenth of the records are the deletions of all files at the end.
    let records = case.events["recorded"] * 9 / 10;
    let saved = case.bench.path("saved");
    let mut named = BTreeSet::new();
    for (turn, part) in [5, 20, 33, 44, 58, 70, 85, 96].into_iter().enumerate() {
        case.killed(&format!("recorded:{}", records * part / 100));
        copy(&case.scratch, &saved);
        let (part_file, saved_part) = (
            case.bench.path(".mesh.ply.outcrop-part"),
            saved.join("lock"),
        );
        if part_file.exists() {
            // The unfinished mesh, in the place of an empty file.
            std::fs::rename(&part_file, &saved_part).unwrap();
        }
        for (number, name) in util::listing(&saved).into_iter().enumerate() {
            if name == "lock" {
                continue;
            }
            copy(&saved, &case.scratch);
            let _ = std::fs::remove_file(&case.mesh);
            if std::fs::metadata(&saved_part).unwrap().len() > 0 {
                std::fs::copy(&saved_part, &part_file).unwrap();
            }
            let how = spoil(&case.scratch.join(&name), turn + number);
            let what = format!("{name} {how} at {part} %");
            let said = case.go_on(&what);
            // Damage to a file that is not needed any more has no effect.
            if said.contains("damaged") {
                // A journal that was cut short has no record that these files are deleted.
                let named_or_journal = said.contains(&name) || name.starts_with("journal");
                assert!(named_or_journal, "{what}: {said}");
                assert_eq!(said.lines().count(), 1, "{what}: {said}");
                named.insert(file_of(&name).to_owned());
            }
            let victim = case.bench.path("victim");
            if victim.exists() {
                assert_eq!(std::fs::read(victim).unwrap(), b"something dear", "{what}");
            }
        }
    }
    println!("noticed: {named:?}");
    for file in [
        "manifest",
        "journal",
        "ingest-0.spool",
        "points",
        "relaxed2",
    ] {
        assert!(named.contains(file), "{file}");
    }
    assert!(named.iter().any(|name| name.ends_with(".index")));
    assert!(named.len() > 15, "{named:?}");
}

#[test]
fn a_damaged_manifest_alone_is_no_loss() {
    let case = Case::new(ROBUST);
    case.killed("recorded:120");
    spoil(&case.scratch.join("manifest"), 0);
    let said = util::run(["resume".into(), case.scratch.clone().into_os_string()]);
    case.check(&said, "resume");
    assert!(said.err.contains("manifest: damaged"), "{}", said.err);
    // Without manifest and journal the run is unknown.
    case.killed("recorded:120");
    spoil(&case.scratch.join("manifest"), 0);
    spoil(&case.scratch.join("journal"), 0);
    let said = util::run(["resume".into(), case.scratch.clone().into_os_string()]);
    assert_eq!(said.code, Some(2));
    assert!(said.err.contains("--restart"), "{}", said.err);
    assert!(case.go_on("both").contains("begins again"));
}

/// The error is one line that names a file, and the run can be resumed.
fn fails(case: &Case, fault: &str, reason: &str) {
    case.clear();
    let ended = case.attempt(fault, &["--threads", "2"]);
    let said = &ended.said;
    if said.code == Some(0) {
        return;
    }
    assert_eq!(said.code, Some(2), "{fault}: {ended:?}");
    assert_eq!(said.err.lines().count(), 1, "{fault}: {ended:?}");
    assert!(said.err.contains(reason), "{fault}: {ended:?}");
    assert!(said.err.contains("mesh.ply"), "{fault}: {ended:?}");
    case.check_whole_or_none(fault);
    if case.scratch.exists() {
        let how = format!("outcrop resume {}", case.scratch.display());
        assert!(said.err.contains(&how), "{fault}: {ended:?}");
        let said = util::run(["resume".as_ref(), case.scratch.as_os_str()]);
        case.check(&said, fault);
    }
}

#[test]
fn a_file_that_cannot_be_synced_ends_the_run_and_loses_nothing() {
    let case = Case::new(ROBUST);
    let mut ended = 0;
    // Files of an earlier attempt are synced before others are deleted. The last attempts find a
    // mesh that lacks only its name, and get no further than the removal of scratch.
    let records = (1..=case.events["recorded"]).rev();
    for (turn, record) in records.step_by(9).enumerate() {
        case.clear();
        case.killed(&format!("recorded:{record}"));
        let fault = format!("sync:{}", 1 + turn % 3);
        let said = case.attempt(&fault, &["--threads", "2", "--resume"]).said;
        if said.code == Some(0) {
            continue;
        }
        ended += 1;
        assert_eq!(said.code, Some(2), "{fault}: {said:?}");
        assert!(said.err.contains("cannot sync: "), "{fault}: {said:?}");
        assert!(said.err.contains("mesh.ply"), "{fault}: {said:?}");
        case.check_whole_or_none(&fault);
        let said = util::run(["resume".as_ref(), case.scratch.as_os_str()]);
        case.check(&said, &fault);
    }
    assert!(ended > 3, "{ended}");
}

#[test]
fn a_full_or_broken_disk_is_told_and_survived() {
    let case = Case::new(ROBUST);
    let writes = case.events["write"];
    for (turn, number) in (1..=writes).step_by(13).enumerate() {
        if turn % 2 == 0 {
            fails(&case, &format!("full:{number}"), "more bytes");
        } else {
            fails(&case, &format!("eio:{number}"), "Input/output error");
        }
    }
}
