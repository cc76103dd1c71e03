//! Commands that cannot do what they are asked for say why, and change nothing.

use crate::end_to_end::util;
use crate::shared::run::Case;

#[test]
fn what_does_not_fit_the_plan_is_refused() {
    let case = Case::new(&[]);
    case.plan(&["--shards", "3", "--task-threads", "2"]);
    // Nothing is open yet.
    assert_eq!(case.say("work", &["--shard", "0"]).code, Some(0));
    let said = case.say("work", &["--shard", "0", "--generation", "1"]);
    assert_eq!(said.code, Some(75), "{said:?}");
    assert!(case.advance());
    for (more, word) in [
        (&["--shard", "3"][..], "0 to 2"),
        (&["--shard", "1/4"], "the 3 that were planned"),
        (&["--shard", "1", "--threads", "3"], "at most 2"),
        (&[], "the number of the shard"),
    ] {
        let said = case.say("work", more);
        assert!(said.code == Some(2) && said.err.contains(word), "{said:?}");
        assert_eq!(said.err.lines().count(), 1, "{said:?}");
    }
    let said = case.say("advance", &[]);
    assert_eq!(said.code, Some(75), "{said:?}");
    assert!(said.err.contains("shards 1, 2 are missing"), "{said:?}");
    // An older generation is over.
    assert_eq!(
        case.say("work", &["--shard", "0", "--generation", "0"])
            .code,
        Some(0)
    );
    case.finish();
}

#[test]
fn one_process_does_not_take_over_a_shared_run() {
    let case = Case::new(&[]);
    case.plan(&["--shards", "2"]);
    let input = case.input.display().to_string();
    let mesh = case.mesh.display().to_string();
    let scratch = case.scratch.display().to_string();
    for arguments in [
        &["reconstruct", &input, "-o", &mesh][..],
        &["reconstruct", &input, "-o", &mesh, "--restart"],
        &["resume", &scratch],
        &["plan", &input, "-o", &mesh],
    ] {
        let said = util::run(arguments);
        assert_eq!(said.code, Some(2), "{said:?}");
        assert!(
            said.err.contains("outcrop submit") || said.err.contains("exists already"),
            "{said:?}"
        );
    }
    case.finish();
    let said = case.say("status", &[]);
    assert!(
        said.code == Some(2) && said.err.contains("outcrop plan"),
        "{said:?}"
    );
}

#[test]
fn another_program_or_input_is_refused() {
    let case = Case::new(&[]);
    case.plan(&["--shards", "2"]);
    assert!(case.advance());
    let other = case.bench.path("other");
    let mut bytes = std::fs::read(env!("CARGO_BIN_EXE_outcrop")).unwrap();
    bytes.push(0);
    std::fs::write(&other, bytes).unwrap();
    let mode = std::os::unix::fs::PermissionsExt::from_mode(0o755);
    std::fs::set_permissions(&other, mode).unwrap();
    let mut command = std::process::Command::new(&other);
    let ended = command
        .arg("work")
        .arg(&case.scratch)
        .args(["--shard", "0"])
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&ended.stderr).into_owned();
    assert!(
        ended.status.code() == Some(2) && text.contains("the program was"),
        "{text}"
    );
    std::fs::remove_file(other).unwrap();
    case.work_all();
    let tile = case.input.join("b.ply");
    let before = std::fs::read(&tile).unwrap();
    let modified = tile.metadata().unwrap().modified().unwrap();
    std::fs::write(&tile, b"ply").unwrap();
    let said = case.say("advance", &[]);
    assert!(
        said.code == Some(2) && said.err.contains("b.ply"),
        "{said:?}"
    );
    std::fs::write(&tile, before).unwrap();
    let file = std::fs::File::options().write(true).open(&tile).unwrap();
    file.set_modified(modified).unwrap();
    case.finish();
}

#[test]
fn a_dry_run_shows_what_would_be_done() {
    let case = Case::new(&[]);
    case.plan(&[
        "--shards",
        "2",
        "--task-memory",
        "1900MiB",
        "--task-threads",
        "2",
    ]);
    let said = case.say("submit", &["--dry-run"]);
    assert!(said.out.contains("\"advance\""), "{said:?}");
    assert!(case.advance());
    let said = case.say("submit", &["--dry-run"]);
    assert_eq!(said.out.lines().count(), 2, "{said:?}");
    let said = case.say(
        "submit",
        &["--engine", "slurm", "--dry-run", "--", "--partition=long"],
    );
    for word in [
        "#SBATCH --mem=2000M",
        "#SBATCH --cpus-per-task=2",
        "--array=0-1",
        "--partition=long",
    ] {
        assert!(said.out.contains(word), "{word}: {}", said.out);
    }
    // A task that was lost may have had too little memory.
    let ended = case.start(1, "publish:1").wait_with_output().unwrap();
    assert!(ended.status.code().is_none(), "{ended:?}");
    let said = case.say("submit", &["--engine", "slurm", "--dry-run"]);
    assert!(said.out.contains("\"--mem=2500M\""), "{}", said.out);
    case.finish();
}

#[test]
fn places_that_cannot_have_a_run_are_refused_before_anything_is_asked() {
    let case = Case::new(&[]);
    let input = case.input.display().to_string();
    let mesh = case.mesh.display().to_string();
    let bucket = "s3://bucket/runs";
    let run = "s3://bucket/runs/mesh.ply-0.outcrop-scratch";
    for (arguments, word) in [
        (
            &[
                "plan",
                &input,
                "-o",
                &mesh,
                "--scratch",
                "https://host/runs",
            ][..],
            "a web server takes no files",
        ),
        (
            &["reconstruct", &input, "-o", &mesh, "--scratch", bucket],
            "runs that tasks share (`outcrop plan`) can be in a store",
        ),
        (
            &["submit", run, "--engine", "slurm"],
            "a folder that all machines see",
        ),
        (
            &["work", run, "--shard", "0", "--shards", "x"],
            "numbers of shards like 3,7,12-15",
        ),
    ] {
        let said = util::run(arguments);
        assert!(said.code == Some(2) && said.err.contains(word), "{said:?}");
        assert_eq!(said.err.lines().count(), 1, "{said:?}");
    }
}

#[test]
fn a_plan_is_resumed_or_begun_again_and_not_another_one() {
    let case = Case::new(&[]);
    case.plan(&["--shards", "2"]);
    assert!(case.advance());
    let arguments = |more: &[&str]| {
        let paths = [&case.input, &case.mesh].map(|path| path.display().to_string());
        let fixed = ["plan", &paths[0], "-o", &paths[1], "--block-points", "4096"];
        let all = fixed.iter().chain(&["--tile-points", "1500"]).chain(more);
        all.map(ToString::to_string).collect::<Vec<_>>()
    };
    let said = util::run(arguments(&["--resume", "--shards", "5"]));
    assert_eq!(said.code, Some(0), "{said:?}");
    assert_eq!(case.status().generation(), 1);
    let said = util::run(arguments(&["--resume", "--smooth", "3"]));
    assert!(
        said.code == Some(2) && said.err.contains("smooth"),
        "{said:?}"
    );
    let said = util::run(arguments(&["--restart", "--shards", "3"]));
    assert_eq!(said.code, Some(0), "{said:?}");
    assert_eq!(case.status().generation(), 0);
    case.finish();
}
