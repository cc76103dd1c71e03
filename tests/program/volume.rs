//! `outcrop volume` as a program: what it prints, in which formats it reads, and what it refuses.

use std::path::Path;
use std::process::{Command, Output};

/// A cube of side 2 from `z` on, as OBJ; without its upper side if it is `open`.
fn cube(z: f64, open: bool) -> String {
    let corner = |k: u32| {
        let at = |axis: u32| f64::from(k >> axis & 1) * 2.0;
        format!("v {} {} {}\n", at(0), at(1), at(2) + z)
    };
    let sides = [
        "1 3 4 2", "1 2 6 5", "3 7 8 4", "1 5 7 3", "2 4 8 6", "5 6 8 7",
    ];
    let corners: String = (0..8).map(corner).collect();
    let sides = sides.iter().take(if open { 5 } else { 6 });
    corners + &sides.map(|side| format!("f {side}\n")).collect::<String>()
}

fn outcrop(folder: &Path, words: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_outcrop"));
    let command = command.current_dir(folder).arg("volume").args(words);
    command.output().expect("it runs")
}

fn told(folder: &Path, words: &[&str]) -> String {
    let output = outcrop(folder, words);
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{words:?}: {error}");
    String::from_utf8(output.stdout).expect("text")
}

fn json(folder: &Path, words: &[&str]) -> serde_json::Value {
    let words = [words, &["--json"]].concat();
    serde_json::from_str(&told(folder, &words)).expect("JSON")
}

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| {
        std::fs::write(folder.path().join(name), text).expect("a file");
    };
    write("cube.obj", &cube(10.0, false));
    write("tub.obj", &cube(10.0, true));
    let sheet = "v -1 -1 11.5\nv 3 -1 11.5\nv 3 3 11.5\nv -1 3 11.5\nf 1 2 3 4\n";
    write("sheet.obj", sheet);
    write("half.wkt", "POLYGON((0 0, 2 0, 2 2))");
    folder
}

#[test]
fn volumes_are_told() {
    let folder = folder();
    let folder = folder.path();
    let text = told(folder, &["cube.obj"]);
    assert!(
        text.contains("volume                       8 units³"),
        "{text}"
    );
    assert!(text.contains("no reference system"), "{text}");
    let body = &json(folder, &["cube.obj"])["body"];
    assert_eq!(
        (&body["volume"], &body["is_closed"]),
        (&8.0.into(), &true.into())
    );
    let text = told(folder, &["tub.obj"]);
    assert!(text.contains("the mesh has a boundary"), "{text}");
    let earth = &json(folder, &["cube.obj", "--above", "11.5"])["earth"];
    assert_eq!(
        (&earth["above"], &earth["below"]),
        (&2.0.into(), &(-6.0).into())
    );
    let earth = &json(folder, &["cube.obj", "--above=-1e1", "--crop", "half.wkt"])["earth"];
    assert!((earth["above"].as_f64().expect("a number") - 4.0).abs() < 1e-12);
    let found = json(
        folder,
        &["sheet.obj", "--above", "cube.obj", "--crop", "0,0,1,9"],
    );
    // The upper and the lower side of the cube cancel, so the sheet is alone.
    assert_eq!(
        (&found["earth"]["only_this"], &found["crop_area"]),
        (&3.0.into(), &9.0.into())
    );
    let text = told(folder, &["sheet.obj", "--above", "11"]);
    assert!(
        text.contains("above                        8 units³ over 16 units²"),
        "{text}"
    );
}

#[test]
fn a_reference_system_tells_the_units() {
    let folder = folder();
    let folder = folder.path();
    let mesh = "ply\nformat ascii 1.0\ncomment epsg 2949\nelement vertex 3\nproperty float x\nproperty float y\n\
                property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
                0 0 5\n4 0 5\n0 4 5\n3 0 1 2\n";
    std::fs::write(folder.join("mesh.ply"), mesh).expect("a file");
    let text = told(folder, &["mesh.ply", "--above", "3"]);
    assert!(
        text.contains("16 m³ over 8 m²") && text.contains("EPSG:2949"),
        "{text}"
    );
    let degrees = mesh.replace("2949", "4326");
    std::fs::write(folder.join("mesh.ply"), degrees).expect("a file");
    let output = outcrop(folder, &["mesh.ply", "--above", "3"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("degrees"));
}

#[test]
fn one_line_says_what_is_wrong() {
    let folder = folder();
    let folder = folder.path();
    for (words, part) in [
        (&["cube.obj", "--crop", "0,0,1,1"][..], "to measure from"),
        (
            &["cube.obj", "--above", "0", "--crop", "0,0,0,1,1,1"],
            "a region in plan",
        ),
        (
            &["cube.obj", "--above", "absent.ply"],
            "neither a number nor a file",
        ),
        (&["cube.obj", "--above", "nan"], "not a level"),
        (&["absent.ply"], "absent.ply"),
        (&["half.wkt"], "half.wkt"),
    ] {
        let output = outcrop(folder, words);
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{words:?}: {error}");
        assert!(error.contains(part), "{words:?}: {error}");
        assert!(!error.contains("panicked"), "{error}");
    }
}
