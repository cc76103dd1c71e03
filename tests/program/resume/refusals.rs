//! Runs that are not resumed, and the reasons.

use crate::end_to_end::util::{self, Said};
use crate::resume::run::{Case, PAPER, ROBUST};
use std::os::unix::fs::PermissionsExt;
use std::process::Stdio;

/// The program with the arguments of the case and `more`.
fn again(case: &Case, more: &[&str]) -> Said {
    let arguments = case.arguments().into_iter();
    util::run(arguments.chain(more.iter().map(ToString::to_string)))
}

fn refused(said: &Said, words: &[&str]) {
    assert_eq!(said.code, Some(2), "{said:?}");
    assert_eq!(said.err.lines().count(), 1, "{said:?}");
    for word in words {
        assert!(said.err.contains(word), "{word}: {said:?}");
    }
}

#[test]
fn an_unfinished_run_is_not_thrown_away() {
    let case = Case::new(ROBUST);
    case.killed("recorded:50");
    refused(&again(&case, &[]), &["--resume", "--restart"]);
    let said = again(&case, &["--restart"]);
    case.check(&said, "--restart");
    // Without an unfinished run, --resume begins one.
    case.clear();
    case.check(&again(&case, &["--resume"]), "--resume");
    let said = util::run(["resume".as_ref(), case.scratch.as_os_str()]);
    refused(&said, &["no unfinished run"]);
}

#[test]
fn what_changed_is_named() {
    let case = Case::new(PAPER);
    case.killed("recorded:50");
    let resume = |more: &[&str]| again(&case, &[&["--resume"], more].concat());
    refused(
        &resume(&["--neighbors", "29"]),
        &["neighbors was 30, now it is 29"],
    );
    refused(&resume(&["--radius", "5%"]), &["radius", "percent"]);
    refused(&resume(&["--drop-classes", "7"]), &["classes"]);
    let other = case.bench.write("other.xyz", "1 2 3\n");
    refused(
        &resume(&[other.to_str().unwrap()]),
        &["number of inputs was 1"],
    );

    let bytes = std::fs::read(&case.input).unwrap();
    let meta = std::fs::metadata(&case.input).unwrap();
    let (time, name) = (meta.modified().unwrap(), case.input.display().to_string());
    let touch = || {
        let file = std::fs::File::options().write(true).open(&case.input);
        file.unwrap().set_modified(time).unwrap();
    };
    std::fs::write(&case.input, [&bytes[..], b"more"].concat()).unwrap();
    refused(&resume(&[]), &["size", &name]);
    let mut other = bytes.clone();
    other[1000] ^= 1;
    std::fs::write(&case.input, &other).unwrap();
    touch();
    refused(&resume(&[]), &["content", &name]);
    std::fs::write(&case.input, &bytes).unwrap();
    refused(&resume(&[]), &["time of last change", &name]);
    std::fs::remove_file(&case.input).unwrap();
    refused(&resume(&[]), &["cannot", &name]);
    std::fs::write(&case.input, &bytes).unwrap();
    touch();
    assert_eq!(case.go_on("as it was"), "");
}

#[test]
fn two_runs_do_not_share_a_folder() {
    let case = Case::new(ROBUST);
    case.killed("recorded:20");
    // A run that waits for a while.
    let mut command = util::program(case.arguments());
    command.args(["--resume", "--smooth", "0"]);
    let lock = case.scratch.join("lock");
    let file = std::fs::File::options().write(true).open(&lock).unwrap();
    file.lock().unwrap();
    let output = command.stderr(Stdio::piped()).output().unwrap();
    // Both wait for some seconds, say so, and are refused then.
    let resumed = util::run(["resume".as_ref(), case.scratch.as_os_str()]);
    for said in [output.into(), resumed] {
        let said: Said = said;
        assert_eq!(said.code, Some(2), "{said:?}");
        let lines: Vec<&str> = said.err.lines().collect();
        assert_eq!(lines.len(), 2, "{said:?}");
        assert!(
            lines[0].contains("waiting up to 10 s for it to end"),
            "{said:?}"
        );
        assert!(
            lines[1].contains("another run is at work here; wait for it"),
            "{said:?}"
        );
    }
    refused(&again(&case, &["--restart"]), &["another run is at work"]);
    drop(file);
    assert_eq!(case.go_on("unlocked"), "");
}

#[test]
fn scratch_is_private() {
    let case = Case::new(ROBUST);
    case.killed("recorded:90");
    let mode = |path: &std::path::Path| path.metadata().unwrap().permissions().mode() & 0o777;
    assert_eq!(mode(&case.scratch), 0o700);
    for name in util::listing(&case.scratch) {
        assert_eq!(mode(&case.scratch.join(&name)), 0o600, "{name}");
    }
    // A folder to which others can write may have any content.
    let open = std::fs::Permissions::from_mode(0o777);
    std::fs::set_permissions(&case.scratch, open).unwrap();
    refused(&again(&case, &["--resume"]), &["open to other users"]);
    case.clear();
    // A link is not followed, and a folder with other content is not emptied.
    let elsewhere = case.bench.subfolder("elsewhere");
    std::fs::write(elsewhere.join("dear"), "something dear").unwrap();
    std::os::unix::fs::symlink(&elsewhere, &case.scratch).unwrap();
    refused(&again(&case, &["--restart"]), &["not a folder"]);
    std::fs::remove_file(&case.scratch).unwrap();
    std::fs::rename(&elsewhere, &case.scratch).unwrap();
    let private = std::fs::Permissions::from_mode(0o700);
    std::fs::set_permissions(&case.scratch, private).unwrap();
    refused(&again(&case, &["--restart"]), &["not a scratch folder"]);
    assert!(case.scratch.join("dear").exists());
}

#[test]
fn what_cannot_be_resumed_leaves_nothing() {
    let case = Case::new(ROBUST);
    std::fs::write(&case.input, "1 2 3\n4 5 6\n7 8 9\n").unwrap();
    refused(&again(&case, &[]), &["format"]);
    assert!(!case.scratch.exists());
}

#[test]
fn scratch_elsewhere_is_found_again() {
    let case = Case::new(ROBUST);
    let scratch = case.bench.subfolder("fast disk");
    let more = ["--scratch", scratch.to_str().unwrap(), "--resume"];
    let ended = case.attempt("recorded:70", &more);
    assert_eq!(ended.signal, Some(9));
    let folders = util::listing(&scratch);
    assert!(folders[0].ends_with(".outcrop-scratch"), "{folders:?}");
    assert!(!case.scratch.exists());
    let said = again(&case, &more);
    case.check(&said, "--scratch");
    assert_eq!(util::listing(&scratch), [""; 0]);
}
