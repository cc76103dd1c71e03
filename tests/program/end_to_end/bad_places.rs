//! Folders in which a file cannot be written end a run with one clear line.

use super::bad_input::{good, refused};
use crate::end_to_end::util::{self, Bench, Said};
use outcrop_cloudgen::{Cloud, Kind};
use std::path::Path;
use std::process::Command;

#[test]
fn outputs_that_cannot_be_written() {
    let bench = Bench::new();
    let cloud = good(&bench, "cloud.ply");
    let file = bench.write("file", "");
    let folder = bench.subfolder("folder");
    let before = util::listing(bench.folder());
    for output in [
        bench.path("absent/mesh.ply"),
        file.join("mesh.ply"),
        folder.clone(),
    ] {
        let mut command = util::program(["reconstruct"]);
        command.arg(&cloud).arg("-o").arg(&output);
        refused(
            &command.output().unwrap().into(),
            &[output.to_str().unwrap()],
        );
    }
    let report = bench.path("absent/report.json");
    let mut command = util::program(["reconstruct"]);
    command
        .arg(&cloud)
        .arg("-o")
        .arg(bench.path("mesh.ply"))
        .arg("--report")
        .arg(&report);
    refused(
        &command.output().unwrap().into(),
        &[report.to_str().unwrap()],
    );
    let mut command = util::program(["reconstruct"]);
    command
        .arg(&cloud)
        .arg("-o")
        .arg(bench.path("mesh.ply"))
        .arg("--scratch")
        .arg(&file);
    refused(&command.output().unwrap().into(), &[file.to_str().unwrap()]);
    assert_eq!(util::listing(bench.folder()), before);
    assert_eq!(util::listing(&folder), [""; 0]);
}

/// Runs the program through a shell that first runs `before` in the same process.
fn in_shell(before: &str, arguments: &[&Path]) -> Said {
    let mut command = Command::new("sh");
    command
        .arg("-c")
        .arg(format!("{before} && exec \"$@\""))
        .arg("sh");
    command
        .arg(env!("CARGO_BIN_EXE_outcrop"))
        .arg("reconstruct")
        .args(arguments);
    command.output().unwrap().into()
}

#[test]
fn a_scratch_file_that_cannot_grow() {
    let bench = Bench::new();
    let cloud = bench.cloud("cloud.laz", &Cloud::new(Kind::Sphere).points(50_000));
    let mesh = bench.path("mesh.ply");
    // Blocks of 512 bytes; if the signal is ignored a write beyond them fails.
    let limits = [
        (1, "write"),
        (200, "write"),
        (1000, "write"),
        (2000, "make room for the mesh"),
    ];
    let mut resumed_runs = 0;
    for (blocks, action) in limits {
        let limit = format!("trap '' XFSZ && ulimit -f {blocks}");
        let said = in_shell(&limit, &[&cloud, Path::new("-o"), &mesh]);
        let scratch = bench.path("mesh.ply.outcrop-scratch");
        refused(&said, &[action]);
        // Finished work stays, and without the limit the run can be resumed.
        assert_eq!(scratch.exists(), said.err.contains("; go on with: "));
        if scratch.exists() {
            resumed_runs += 1;
            let resumed = util::run(["resume".as_ref(), scratch.as_os_str()]);
            assert_eq!(resumed.code, Some(0), "{resumed:?}");
            std::fs::remove_file(&mesh).unwrap();
        }
        assert_eq!(
            util::listing(bench.folder()),
            ["cloud.laz"],
            "{blocks} blocks"
        );
    }
    assert!(resumed_runs > 0);
}

#[test]
fn a_scratch_folder_that_is_too_small() {
    let bench = Bench::new();
    let cloud = bench.cloud("cloud.laz", &Cloud::new(Kind::Sphere).points(100_000));
    let small = bench.subfolder("small");
    let mesh = bench.path("mesh.ply");
    let mount = |size: &str| format!("mount -t tmpfs -o size={size} none '{}'", small.display());
    // A mount namespace of its own, so that the mount ends with the process.
    let run = |script: &str, arguments: &[&Path]| -> Said {
        let mut command = Command::new("unshare");
        command.args([
            "--user",
            "--map-root-user",
            "--mount",
            "sh",
            "-c",
            script,
            "sh",
        ]);
        command.args(arguments);
        command.output().map_or_else(
            |e| Said {
                code: None,
                out: String::new(),
                err: e.to_string(),
            },
            Said::from,
        )
    };
    let probe = run(&mount("1m"), &[]);
    if probe.code != Some(0) {
        let why = probe.err.trim();
        util::skip(format_args!("no private mounts here: {why}"));
        return;
    }
    let program = Path::new(env!("CARGO_BIN_EXE_outcrop"));
    // Too small from the start, or with a limit on the number of files, which free space does not show.
    let few = ["64m,nr_inodes=10", "64m,nr_inodes=13"];
    for size in ["64k", "512k", "2m"].into_iter().chain(few) {
        // Once there is room, the run is resumed.
        let script = format!(
            "{} && {{ \"$@\"; code=$?; cd '{}'; mount -o remount,size=64m,nr_inodes=1000 . || exit 3; \
             for left in *.outcrop-scratch; do \
             [ ! -e $left ] || '{}' resume $left --quiet || exit 4; done; ls -A; exit $code; }}",
            mount(size),
            small.display(),
            program.display(),
        );
        let arguments: [&Path; 7] = [
            program,
            Path::new("reconstruct"),
            &cloud,
            Path::new("-o"),
            &mesh,
            Path::new("--scratch"),
            &small,
        ];
        let said = run(&script, &arguments);
        let resumed = said.err.contains("; go on with: ");
        assert_eq!(resumed, size.contains("inodes"), "{size}: {said:?}");
        let word = if resumed { "go on with" } else { "more bytes" };
        refused(&said, &["small", "space", word]);
        assert_eq!(mesh.exists(), resumed, "{size}: {said:?}");
        let _ = std::fs::remove_file(&mesh);
        assert_eq!(
            util::listing(bench.folder()),
            ["cloud.laz", "small"],
            "{size}"
        );
    }
}
