//! `outcrop raster` as a program: what it writes and prints, whatever the threads, the memory and the order of points, and
//! what it refuses.

use std::path::Path;
use std::process::{Command, Output};

fn outcrop(folder: &Path, words: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_outcrop"));
    let command = command.current_dir(folder).arg("raster").args(words);
    command.output().expect("it runs")
}

fn told(folder: &Path, words: &[&str]) -> String {
    let output = outcrop(folder, words);
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{words:?}: {error}");
    String::from_utf8(output.stdout).expect("text")
}

/// Points of a hill with colours, in an order of their own.
fn hill(turn: usize) -> String {
    const SIDE: usize = 300;
    let mut lines: Vec<String> = (0..SIDE * SIDE)
        .map(|k| {
            let [x, y] = [k % SIDE, k / SIDE].map(|k| (k * 7 % SIDE) as f64 * 0.1);
            let z = 40.0 - 0.1 * (x - 15.0).powi(2) - 0.05 * (y - 10.0).powi(2);
            let z = (z * 1000.0).round() / 1000.0;
            format!("{x:.1} {y:.1} {z} {} {} 9", k % 256, k / 7 % 256)
        })
        .collect();
    lines.rotate_left(turn);
    if turn % 2 == 1 {
        lines.reverse();
    }
    format!("x y z red green blue\n{}\n", lines.join("\n"))
}

#[test]
fn the_files_are_the_same_for_any_threads_memory_and_order() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let mut all = Vec::new();
    for (number, limits) in [["1", "192MiB"], ["2", "192MiB"], ["3", "2GiB"]]
        .iter()
        .enumerate()
    {
        std::fs::write(folder.join("hill.xyz"), hill(number * 4567)).expect("a cloud");
        let text = told(
            folder,
            &[
                "hill.xyz",
                "-o",
                "dem.tif",
                "--cell",
                "0.25",
                "--contours",
                "2",
                "--orthophoto",
                "photo.tif",
                "--threads",
                limits[0],
                "--memory",
                limits[1],
            ],
        );
        assert!(text.contains("120 × 120 cells of 0.25"), "{text}");
        assert!(text.contains("dem-contours.geojson"), "{text}");
        let names = ["dem.tif", "photo.tif", "dem-contours.geojson"];
        all.push(names.map(|name| std::fs::read(folder.join(name)).expect("a file")));
    }
    assert!(all.iter().all(|files| *files == all[0]));
    assert!(all[0].iter().all(|file| file.len() > 2000));
}

#[test]
fn a_mesh_keeps_its_reference_system() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let mesh = "ply\nformat ascii 1.0\ncomment epsg 2949\nelement vertex 4\nproperty float x\nproperty float y\n\
                property float z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n\
                0 0 5\n4 0 5\n0 4 5\n4 4 6\n3 0 1 2\n3 1 3 2\n";
    std::fs::write(folder.join("mesh.ply"), mesh).expect("a file");
    let words = ["mesh.ply", "-o", "dem.tif", "--cell", "1", "--json"];
    let found: serde_json::Value = serde_json::from_str(&told(folder, &words)).expect("JSON");
    assert_eq!(
        (
            &found["columns"],
            &found["cells"],
            &found["source"]["triangles"]
        ),
        (&4.into(), &16.into(), &2.into())
    );
    assert!(
        found["source"]["system"]
            .as_str()
            .is_some_and(|s| s.contains("2949"))
    );
    // The key of the projected system, and its code.
    let file = std::fs::read(folder.join("dem.tif")).expect("a file");
    let key: Vec<u8> = [3072u16, 0, 1, 2949]
        .iter()
        .flat_map(|n| n.to_le_bytes())
        .collect();
    assert!(file.windows(8).any(|bytes| bytes == key));
}

#[test]
fn one_line_says_what_is_wrong() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    std::fs::write(folder.join("two.xyz"), "0 0 1\n9 9 2\n").expect("a cloud");
    let cell = ["two.xyz", "-o", "dem.tif", "--cell"];
    for (words, part) in [
        (
            vec!["two.xyz", "-o", "dem.png", "--cell", "1"],
            "ends with .tif",
        ),
        (
            vec!["two.xyz", "-o", "s3://bucket/dem.tif", "--cell", "1"],
            "a file of this machine",
        ),
        (
            vec!["absent.laz", "-o", "dem.tif", "--cell", "1"],
            "absent.laz",
        ),
        ([&cell[..], &["0"]].concat(), "--cell"),
        ([&cell[..], &["1e-9"]].concat(), "longer sides"),
        ([&cell[..], &["1", "--contours", "1e-9"]].concat(), "levels"),
        (
            [&cell[..], &["1", "--crop", "50,50,60,60"]].concat(),
            "50,50,60,60",
        ),
        (
            [&cell[..], &["1", "--orthophoto", "dem.tif"]].concat(),
            "nothing else",
        ),
        (
            [&cell[..], &["1", "--orthophoto", "photo.tif"]].concat(),
            "red",
        ),
        (
            [&cell[..], &["1", "--surface", "ground-class"]].concat(),
            "classification",
        ),
    ] {
        let output = outcrop(folder, &words);
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{words:?}: {error}");
        assert!(error.contains(part), "{words:?}: {error}");
        assert_eq!(error.lines().count(), 1, "{words:?}: {error}");
        assert!(!folder.join("dem.tif").exists(), "{words:?}");
    }
}

#[test]
fn a_killed_run_goes_on_to_the_same_files() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    std::fs::write(folder.join("hill.xyz"), hill(0)).expect("a cloud");
    let words = |output| {
        let common = [
            "hill.xyz",
            "--cell",
            "0.05",
            "--contours",
            "0.5",
            "--memory",
            "192MiB",
        ];
        [&common[..], &["-o", output, "--resume"]].concat()
    };
    let run = |output, fault: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_outcrop"));
        let command = command.current_dir(folder).arg("raster");
        let command = command.args(words(output)).env("OUTCROP_FAULT", fault);
        command.output().expect("it runs")
    };
    assert!(run("whole.tif", "count:events").status.success());
    let events = std::fs::read_to_string(folder.join("events")).expect("counts");
    let mut kills = 0;
    for (kind, share) in ["record", "torn", "recorded", "write"]
        .iter()
        .flat_map(|kind| (0..4).map(move |share| (kind, share)))
    {
        let start = format!("{kind} ");
        let count = events.lines().find_map(|line| line.strip_prefix(&start));
        let count: u64 = count.expect(kind).parse().expect("a count");
        let fault = format!("{kind}:{}", 1 + share * (count - 1) / 4);
        let killed = run("killed.tif", &fault);
        assert!(!killed.status.success(), "{fault}");
        told(folder, &words("killed.tif"));
        for [whole, killed] in [
            ["whole.tif", "killed.tif"],
            ["whole-contours.geojson", "killed-contours.geojson"],
        ] {
            let read = |name| std::fs::read(folder.join(name)).expect("a file");
            assert!(read(whole) == read(killed), "{fault}: {killed}");
            std::fs::remove_file(folder.join(killed)).expect("a file");
        }
        kills += 1;
    }
    assert_eq!(kills, 16);
    let left: Vec<_> = std::fs::read_dir(folder)
        .expect("a folder")
        .map(|entry| entry.expect("an entry").file_name())
        .filter(|name| name.to_string_lossy().contains(".outcrop-"))
        .collect();
    assert!(left.is_empty(), "{left:?}");
    // An unfinished run is no mistake that passes unseen.
    let given = [&words("killed.tif")[..], &["--restart"]].concat();
    assert_eq!(outcrop(folder, &given).status.code(), Some(2));
}
