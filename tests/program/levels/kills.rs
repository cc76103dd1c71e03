//! Runs that are killed at events after which something is durable: resumed they give the same bytes. `scripts/kill-test`
//! covers all events.

use super::meshes::hills;
use super::resumed::{cloud, files};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A command on a mesh, or `reconstruct` on a cloud, in a folder of its own.
struct Case<'a> {
    folder: tempfile::TempDir,
    command: &'a str,
    /// The name of an input that comes first, if there is one.
    first: Option<&'a str>,
    options: &'a [&'a str],
}

impl<'a> Case<'a> {
    fn new(command: &'a str, options: &'a [&'a str]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        match command {
            "reconstruct" => cloud(&folder.path().join("input")),
            _ => hills(70, true).write(&folder.path().join("input")),
        }
        Self {
            folder,
            command,
            first: None,
            options,
        }
    }

    fn at(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn run(&self, output: &Path, fault: &str) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_outcrop"));
        command
            .arg(self.command)
            .args(self.first.map(|name| self.at(name)));
        command.arg(self.at("input"));
        command.arg("-o").arg(output).args(self.options);
        command.args(["--quiet", "--resume", "--memory=192MiB", "--threads=2"]);
        if !fault.is_empty() {
            command.env("OUTCROP_FAULT", fault);
        }
        command.output().unwrap()
    }

    /// As [`Case::run`], to the end.
    fn whole(&self, output: &Path, fault: &str, what: &str) {
        let ended = self.run(output, fault);
        let words = String::from_utf8_lossy(&ended.stderr);
        assert!(ended.status.success(), "{what}: {words}");
    }
}

/// What a run wrote: the files of a tileset, or the mesh.
fn made(output: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    match output {
        tileset if tileset.ends_with("tileset.json") => files(tileset.parent().unwrap()),
        folder if folder.is_dir() => files(folder),
        mesh => BTreeMap::from([(PathBuf::new(), std::fs::read(mesh).unwrap())]),
    }
}

fn clear(output: &Path) {
    match output {
        tileset if tileset.ends_with("tileset.json") => clear(tileset.parent().unwrap()),
        folder if folder.is_dir() => std::fs::remove_dir_all(folder).unwrap(),
        mesh => std::fs::remove_file(mesh).unwrap(),
    }
}

/// Kills a run at `parts` events of each kind, and resumes it. `output` is the end of the name of what it writes.
fn survives(command: &str, output: &str, options: &[&str], parts: u64) {
    goes_on(&Case::new(command, options), output, parts);
}

fn goes_on(case: &Case<'_>, output: &str, parts: u64) {
    let (command, options) = (case.command, case.options);
    let [first, again] = ["first", "again"].map(|name| case.at(&format!("{name}{output}")));
    let events = case.at("events");
    case.whole(
        &first,
        &format!("count:{}", events.display()),
        "undisturbed",
    );
    let want = made(&first);
    let counts = std::fs::read_to_string(&events).unwrap();
    let count = |event: &str| -> u64 {
        let line = counts.lines().find(|line| line.starts_with(event));
        line.and_then(|line| line.split_whitespace().last()?.parse().ok())
            .unwrap_or(0)
    };
    let mut killed = 0;
    for event in ["record", "torn", "recorded", "write", "synced", "delete"] {
        let all = count(event).max(1);
        for part in 0..parts {
            let fault = format!("{event}:{}", 1 + (all - 1) * part / (parts - 1));
            let stopped = case.run(&again, &fault);
            killed += u64::from(!stopped.status.success());
            case.whole(&again, "", &fault);
            assert!(made(&again) == want, "{command} {options:?} {fault}");
            clear(&again);
        }
    }
    assert!(killed >= 3 * parts, "{killed}: {counts}");
    // Nothing is left beside.
    let left = std::fs::read_dir(case.folder.path()).unwrap();
    let left: Vec<_> = left.map(|entry| entry.unwrap().file_name()).collect();
    let inputs = 1 + usize::from(case.first.is_some());
    assert_eq!(left.len(), 2 + inputs, "{left:?}");
}

const TILES: &[&str] = &["--most-triangles=300"];
const SIMPLIFY: &[&str] = &["--ratio=0.1", "--most-triangles=900", "--samples=1000"];

#[test]
fn levels_of_detail_are_made_in_spite_of_kills() {
    survives("tiles", "", TILES, 4);
}

#[test]
fn lossy_levels_of_detail_are_made_in_spite_of_kills() {
    survives("tiles", "", &[TILES, &["--lossy"]].concat(), 3);
}

#[test]
fn a_mesh_is_simplified_in_spite_of_kills() {
    survives("simplify", ".ply", SIMPLIFY, 3);
}

#[test]
fn a_mesh_is_simplified_and_closed_in_spite_of_kills() {
    survives(
        "simplify",
        ".ply",
        &[SIMPLIFY, &["--close=base"]].concat(),
        4,
    );
}

#[test]
fn a_mesh_is_closed_in_spite_of_kills() {
    survives("close", ".ply", &["--kind=base"], 3);
}

/// What changed since another surface, which `write` makes.
fn change_survives(write: impl FnOnce(&Path), parts: u64) {
    let mut case = Case::new("change", &["--radius=0.5"]);
    case.first = Some("old");
    write(&case.at("old"));
    goes_on(&case, ".ply", parts);
}

#[test]
fn what_changed_since_a_mesh_is_measured_in_spite_of_kills() {
    change_survives(|old| hills(60, true).write(old), 4);
}

#[test]
fn what_changed_since_a_cloud_is_measured_in_spite_of_kills() {
    change_survives(cloud, 3);
}

#[test]
fn a_cloud_becomes_a_small_closed_mesh_in_spite_of_kills() {
    survives(
        "reconstruct",
        ".obj",
        &["--triangles=900", "--close=auto"],
        5,
    );
}

#[test]
fn a_cloud_becomes_a_closed_mesh_in_spite_of_kills() {
    survives("reconstruct", ".ply", &["--close=lids"], 4);
}

#[test]
fn a_cloud_becomes_a_lossy_tileset_in_spite_of_kills() {
    survives("reconstruct", "/tileset.json", &["--lossy"], 4);
}
