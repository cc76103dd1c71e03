//! Odd, old, empty and broken files: each has its expected outcome, without a panic.

use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::memory::{MINIMUM_BUDGET, MemoryPool};
use outcrop_disk::workspace::progress::{Cancel, Silent};
use outcrop_formats::ingest;
use outcrop_points::Spool;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::sync::Arc;

const ZOO: &str = "../shared/data/zoo";

fn zoo() -> Option<PathBuf> {
    crate::skip::if_present(ZOO)
}

fn workspace(folder: &Path) -> Workspace {
    let memory = MemoryPool::new(MINIMUM_BUDGET).unwrap();
    Workspace::new(folder, memory, 2, Arc::new(Silent), Cancel::new()).unwrap()
}

fn manifest(path: &Path) -> Vec<Value> {
    let text = std::fs::read_to_string(path.join("MANIFEST.json")).unwrap();
    serde_json::from_str(&text).unwrap()
}

/// Streams the spool and checks properties of every cloud.
fn check_stream(spool: &Spool, workspace: &Workspace) {
    let stats = spool.stats();
    assert_eq!(
        stats.read,
        stats.kept + stats.dropped_non_finite + stats.withheld + stats.invalid
    );
    let Ok(lattice) = spool.choose_lattice(0) else {
        assert_eq!(spool.points(), 0);
        return;
    };
    let mut count = 0;
    let (mut low, mut high) = ([i32::MAX; 3], [i32::MIN; 3]);
    spool
        .for_each(workspace, &lattice, |points| {
            count += points.len() as u64;
            for p in points {
                for axis in 0..3 {
                    low[axis] = low[axis].min(p[axis]);
                    high[axis] = high[axis].max(p[axis]);
                }
            }
            Ok(())
        })
        .unwrap();
    assert_eq!(count, spool.points());
    assert_eq!(low, [0; 3]);
    let file = &stats.files[0];
    let tolerance = if lattice.exact { 1e-6 } else { 0.51 } * lattice.step;
    for axis in 0..3 {
        let (found, want) = (lattice.position(high)[axis], file.max.unwrap()[axis]);
        let slack = tolerance + want.abs() * 1e-15;
        assert!(
            (found - want).abs() <= slack,
            "axis {axis}: {found} for {want}, {lattice:?}"
        );
    }
}

/// Number of points, or the error.
fn read(path: &Path, workspace: &Workspace) -> Result<u64, String> {
    match ingest(&[PathBuf::from(path)], workspace) {
        Ok(spool) => {
            check_stream(&spool, workspace);
            assert_eq!(workspace.memory.available(), workspace.memory.capacity());
            let stats = spool.stats();
            let points = stats.read - stats.dropped_non_finite - stats.invalid;
            spool.release(workspace).unwrap();
            Ok(points)
        }
        Err(error) => {
            let text = error.to_string();
            assert!(!text.contains('\n'), "{text:?} is more than one line");
            assert!(
                text.starts_with(&*path.display().to_string()),
                "{text} names no file"
            );
            Err(text)
        }
    }
}

/// Formats that are recognised and refused.
fn refused_format(file: &str) -> Option<&'static str> {
    let extension = Path::new(file).extension()?.to_str()?;
    (extension == "obj").then_some("OBJ")
}

#[test]
fn generated_files_have_their_expected_outcome() {
    let Some(zoo) = zoo() else { return };
    let zoo = zoo.join("generated");
    let scratch = tempfile::tempdir().unwrap();
    let workspace = workspace(scratch.path());
    let mut wrong = Vec::new();
    for entry in manifest(&zoo) {
        let file = entry["file"].as_str().unwrap();
        let points = entry["points"].as_u64();
        let outcome = read(&zoo.join(file), &workspace);
        let good = match (file, entry["expect"].as_str().unwrap(), &outcome) {
            (f, _, Err(text)) if refused_format(f).is_some() => {
                text.contains(refused_format(f).unwrap())
            }
            // The content decides, not the name: these are lists of points.
            ("xyz_named.ply", _, Ok(n)) => *n == 2000,
            // The header of an interrupted writer: the existing points are read.
            ("count_zero.las", _, Ok(n)) => *n == 2000,
            (_, "ok" | "ok-empty" | "ok-no-crash" | "ok-or-warn" | "ok-drop-nonfinite", o) => {
                o.as_ref().ok().copied() == points
            }
            (_, "error", o) => o.is_err(),
            (_, "error-or-partial" | "error-or-garbage" | "ambiguous", _) => true,
            (_, "ok-or-error" | "error-or-ok" | "error-or-warn", Ok(n)) => {
                points.is_none_or(|p| p == *n)
            }
            (_, "ok-or-error" | "error-or-ok" | "error-or-warn", Err(_)) => true,
            (_, expect, _) => panic!("unknown expectation {expect}"),
        };
        println!("{file}: {} -> {outcome:?}", entry["expect"]);
        if !good {
            wrong.push(format!("{file}: {outcome:?}, expected {entry}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn real_files_hold_as_many_points_as_another_reader_finds() {
    let Some(zoo) = zoo() else { return };
    let scratch = tempfile::tempdir().unwrap();
    let workspace = workspace(scratch.path());
    let mut wrong = Vec::new();
    for entry in manifest(&zoo) {
        let file = entry["file"].as_str().unwrap();
        let points = entry["points_by_another_reader"].as_u64();
        let outcome = read(&zoo.join(file), &workspace);
        let good = match (&outcome, points) {
            // An empty file: an error is a valid outcome, too.
            (Err(_), Some(0) | None) => true,
            (Err(text), _) if refused_format(file).is_some() => {
                text.contains(refused_format(file).unwrap())
            }
            (Ok(n), Some(p)) => *n == p,
            (Ok(_), None) => true,
            (Err(_), Some(_)) => false,
        };
        println!("{file}: {points:?} -> {outcome:?}");
        if !good {
            wrong.push(format!("{file}: {outcome:?}, expected {entry}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// All positions in the input's unit, sorted.
fn coordinates(path: PathBuf, workspace: &Workspace) -> Vec<[f64; 3]> {
    let spool = ingest(&[path], workspace).unwrap();
    let lattice = spool.choose_lattice(0).unwrap();
    let mut all = Vec::new();
    spool
        .for_each(workspace, &lattice, |points| {
            all.extend(points.iter().map(|p| lattice.position(*p)));
            Ok(())
        })
        .unwrap();
    all.sort_by(|a, b| a.partial_cmp(b).unwrap());
    all
}

#[test]
fn compressed_files_hold_the_same_points() {
    let Some(zoo) = zoo() else { return };
    let scratch = tempfile::tempdir().unwrap();
    let workspace = workspace(scratch.path());
    for pair in [
        ["laz-rs/point10.las", "laz-rs/point10.laz"],
        ["laz-rs/point-time.las", "laz-rs/point-time.laz"],
        ["laz-rs/point-color.las", "laz-rs/point-color.laz"],
        ["laz-rs/point-time-color.las", "laz-rs/point-time-color.laz"],
        ["laz-rs/extra-bytes.las", "laz-rs/extra-bytes.laz"],
        [
            "laz-rs/point-version-1-point-wise.las",
            "laz-rs/point-version-1-point-wise.laz",
        ],
        ["laspy/simple.las", "laspy/simple.laz"],
        ["laspy/simple.las", "laspy/simple.copc.laz"],
        ["laspy/1_4_w_evlr.las", "laspy/1_4_w_evlr.laz"],
        ["../scans/lone-star.laz", "../scans/lone-star.copc.laz"],
    ] {
        let [a, b] = pair.map(|file| coordinates(zoo.join(file), &workspace));
        assert_eq!(a.len(), b.len(), "{pair:?}");
        for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
            // Offsets may differ, and so may the last bit.
            assert!((a - b).abs() < 1e-6, "{pair:?}: {a}, {b}");
        }
    }
}
