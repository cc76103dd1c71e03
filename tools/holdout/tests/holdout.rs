//! The program from a scan to a row of the table.

#[path = "../../../tests/program/skip.rs"]
mod skip;

use std::path::Path;
use std::process::{Command, Output};

fn run(arguments: &[&str], folder: &Path) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_holdout"));
    command.current_dir(folder).args(arguments);
    command.output().unwrap()
}

fn said(arguments: &[&str], folder: &Path) -> String {
    let output = run(arguments, folder);
    assert!(output.status.success(), "{output:?}");
    String::from_utf8(output.stdout).unwrap()
}

/// A grid of 40 × 40 points, each twice, and the square it lies on.
fn files(folder: &Path) {
    let point = |i: u32| format!("{} {} 0\n", i % 40, i / 40 % 40);
    let points: String = (0..3200).map(point).collect();
    std::fs::write(folder.join("scan.xyz"), points + "nan 0 0\n").unwrap();
    let mesh = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
                property float z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n\
                0 0 0.25\n39 0 0.25\n39 39 0.25\n0 39 0.25\n3 0 1 2\n3 0 2 3\n";
    std::fs::write(folder.join("mesh.ply"), mesh).unwrap();
}

const SPLIT: [&str; 6] = [
    "split",
    "scan.xyz",
    "--train",
    "train.ply",
    "--held",
    "held.ply",
];

#[test]
fn from_scan_to_row() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    files(folder);
    let text = said(&SPLIT, folder);
    assert_eq!(text, "1600 distinct points: 1280 stay, 320 are left out\n");
    for (file, count) in [("train.ply", 1280), ("held.ply", 320)] {
        let bytes = std::fs::read(folder.join(file)).unwrap();
        let header = format!("element vertex {count}\n");
        assert!(String::from_utf8_lossy(&bytes).contains(&header), "{file}");
    }

    let json = said(
        &["measure", "train.ply", "held.ply", "mesh.ply", "--json"],
        folder,
    );
    let found: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(
        (&found["train"], &found["held"]),
        (&1280.into(), &320.into())
    );
    // A distance of 0.25 everywhere, and nearly all points with a neighbour at 1.
    assert_eq!(found["distance"]["max"], 0.25);
    assert_eq!(found["spacing"]["p50"], 1.0);
    assert_eq!(found["error"]["p50"], 0.25);
    std::fs::write(folder.join("held.json"), json).unwrap();
    let words = said(&["measure", "train.ply", "held.ply", "mesh.ply"], folder);
    assert!(words.contains("320 points left out of 1600"), "{words}");

    let report = r#"{"points": 1280, "seconds": 1.25, "holes_left": 3,
        "mesh": {"points_used": 1279}, "repair": {"holes_found": 12345}}"#;
    std::fs::write(folder.join("report.json"), report).unwrap();
    let verdict = r#"{"boundary_edges": 40, "components": 2}"#;
    std::fs::write(folder.join("verdict.json"), verdict).unwrap();
    let files = [
        "--report",
        "report.json",
        "--verdict",
        "verdict.json",
        "--held-out",
        "held.json",
    ];
    let arguments = [
        &["row", "--scan", "a|b", "--options", "--smooth 1"],
        &files[..],
    ]
    .concat();
    let row = said(&arguments, folder);
    let want = "| a\\|b | `--smooth 1` | 1 280 | 1 279 | 12 345 | 3 | 40 | 2 | 0.250 | 0.250 | 0.250 | 1.2 |\n";
    assert_eq!(row, want);
    let head = said(&["row", "--head"], folder);
    let failed = said(&["row", "--scan", "x", "--failed", "no surface"], folder);
    assert!(
        head.lines()
            .chain(failed.lines())
            .all(|l| l.matches('|').count() == 13),
        "{head}{failed}"
    );
}

#[test]
fn what_cannot_be_done_is_said_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    files(folder);
    std::fs::write(folder.join("one.xyz"), "1 2 3\n1 2 3\n").unwrap();
    std::fs::write(
        folder.join("bad.pcd"),
        "VERSION 0.7\nFIELDS x y\nDATA ascii\n",
    )
    .unwrap();
    std::fs::write(folder.join("bad.e57"), "ASTM-E57 and nothing else").unwrap();
    let to = &SPLIT[2..];
    for arguments in [
        [&SPLIT[..], &["--fraction", "1"]].concat(),
        [&SPLIT[..], &["--fraction", "nan"]].concat(),
        vec!["split", "scan.xyz", "--train", "x.ply", "--held", "x.ply"],
        [&["split", "one.xyz"], to].concat(),
        [&["split", "absent.laz"], to].concat(),
        [&["split", "bad.pcd"], to].concat(),
        [&["split", "bad.e57"], to].concat(),
        vec!["measure", "one.xyz", "scan.xyz", "mesh.ply"],
        vec![
            "row",
            "--scan",
            "x",
            "--report",
            "a",
            "--verdict",
            "b",
            "--held-out",
            "c",
        ],
    ] {
        let output = run(&arguments, folder);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        let error = String::from_utf8(output.stderr).unwrap();
        assert_eq!(error.lines().count(), 1, "{arguments:?}: {error}");
    }
}

/// Real scans, if available: name, and number of distinct finite points.
const SCANS: [(&str, &str); 5] = [
    ("pump.e57", "155201"),
    ("facade-steps.pcd", "108104"),
    ("railway.pcd", "487208"),
    ("rgbd.pcd", "249647"),
    ("room2d.pcd", "56159"),
];

#[test]
fn real_scans_of_other_formats() {
    let folder = tempfile::tempdir().unwrap();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/scans");
    for (name, points) in SCANS {
        let Some(scan) = skip::if_present(root.join(name)) else {
            continue;
        };
        let scan = scan.to_str().unwrap();
        let arguments = [&["split", scan], &SPLIT[2..]].concat();
        let text = said(&arguments, folder.path());
        assert!(
            text.starts_with(&format!("{points} distinct points")),
            "{name}: {text}"
        );
    }
}
