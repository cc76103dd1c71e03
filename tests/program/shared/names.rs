//! A run has three names: that of its folder, of its mesh, and of the folder for scratch files.

use crate::end_to_end::util::{self, Bench, Said};
use outcrop_cloudgen::{Cloud, Kind};
use std::path::{Path, PathBuf};

/// A cloud, and a plan for a mesh of this name in a folder for scratch files.
fn planned(bench: &Bench, mesh: &str, scratch: Option<&Path>) -> (PathBuf, PathBuf) {
    let cloud = bench.path("cloud.ply");
    if !cloud.exists() {
        bench.cloud("cloud.ply", &Cloud::new(Kind::Terrain).points(3_000));
    }
    let mesh = bench.path(mesh);
    let mut words = vec![
        "plan".into(),
        cloud.into_os_string(),
        "-o".into(),
        mesh.clone().into_os_string(),
    ];
    words.extend(["--shards".into(), "2".into()]);
    if let Some(scratch) = scratch {
        words.extend(["--scratch".into(), scratch.as_os_str().to_owned()]);
    }
    let said = util::run(words);
    assert_eq!(said.code, Some(0), "{said:?}");
    let folder = said
        .out
        .strip_prefix("planned in ")
        .unwrap()
        .split("; go on with")
        .next()
        .unwrap();
    (mesh, folder.into())
}

fn status(name: &Path) -> Said {
    util::run(["status".as_ref(), "--json".as_ref(), name.as_os_str()])
}

/// The folder that a name stands for.
fn folder_of(name: &Path) -> PathBuf {
    let said = status(name);
    assert_eq!(said.code, Some(0), "{}: {said:?}", name.display());
    let json: serde_json::Value = serde_json::from_str(&said.out).unwrap();
    json["folder"].as_str().unwrap().into()
}

#[test]
fn a_run_is_found_by_each_of_its_names() {
    let bench = Bench::new();
    let scratch = bench.subfolder("scratch");
    let (mesh, folder) = planned(&bench, "mesh.ply", Some(&scratch));
    for name in [&mesh, &folder, &scratch] {
        assert_eq!(folder_of(name), folder, "{}", name.display());
    }
    for command in ["work", "advance"] {
        let more: &[&str] = if command == "work" {
            &["--shard", "0"]
        } else {
            &[]
        };
        let said = util::program([command.as_ref(), mesh.as_os_str()])
            .args(more)
            .output()
            .unwrap();
        assert!(said.status.success(), "{said:?}");
    }
    let said = util::run(["submit".as_ref(), scratch.as_os_str()]);
    assert_eq!(said.code, Some(0), "{said:?}");
    assert!(mesh.exists());
    // Nothing is left of the run, nor of its names.
    assert_eq!(
        util::listing(bench.folder()),
        ["cloud.ply", "mesh.ply", "scratch"]
    );
    assert_eq!(util::listing(&scratch), [""; 0]);
    let said = status(&mesh);
    assert_eq!(said.code, Some(2));
    assert!(
        said.err.contains("no run that tasks share is here"),
        "{}",
        said.err
    );
    // Beside the mesh.
    let (mesh, folder) = planned(&bench, "other.ply", None);
    assert_eq!(
        (folder_of(&mesh), folder_of(&folder)),
        (folder.clone(), folder.clone())
    );
    assert_eq!(folder_of(bench.folder()), folder);
    let said = util::run(["submit".as_ref(), mesh.as_os_str()]);
    assert_eq!(said.code, Some(0), "{said:?}");
}

#[test]
fn several_runs_in_a_folder_are_listed() {
    let bench = Bench::new();
    let scratch = bench.subfolder("scratch");
    let said = util::run(["submit".as_ref(), scratch.as_os_str()]);
    assert_eq!(said.code, Some(2));
    assert!(
        said.err
            .contains("no run that tasks share is here; run `outcrop plan` to begin one"),
        "{}",
        said.err
    );
    let (one, first) = planned(&bench, "one.ply", Some(&scratch));
    let (two, second) = planned(&bench, "two.ply", Some(&scratch));
    let said = util::run(["submit".as_ref(), scratch.as_os_str()]);
    assert_eq!(said.code, Some(2));
    let name = |path: &Path| path.file_name().unwrap().to_str().unwrap().to_owned();
    let words = format!(
        "several runs are here: {}, {}; name one of them",
        name(&first),
        name(&second)
    );
    assert!(said.err.contains(&words), "{}", said.err);
    assert_eq!((folder_of(&one), folder_of(&two)), (first, second));
}
