//! `outcrop change` as a program: its map, its areas, what it prints and what it refuses.

use outcrop_cloudgen::{Cloud, Format, HEAP_VOLUME, Kind, Objects, PIT_VOLUME};
use serde_json::Value;
use std::fmt::Write;
use std::path::Path;
use std::process::{Command, Output};

/// A grid of 41 × 41 vertices with steps of 1, as OBJ.
fn grid(height: impl Fn(i32, i32) -> f64) -> String {
    let mut text = String::new();
    for k in 0..41 * 41 {
        let (x, y) = (k % 41, k / 41);
        writeln!(text, "v {x} {y} {}", height(x, y)).unwrap();
    }
    for k in (1..=41 * 40).filter(|k| k % 41 != 0) {
        writeln!(text, "f {k} {} {} {}", k + 1, k + 42, k + 41).unwrap();
    }
    text
}

/// A wall of 3 steps around a square is sloped, not upright.
fn block(x: i32, y: i32) -> f64 {
    let inside = |c: i32| f64::from((c - 10).min(30 - c).clamp(0, 3)) / 3.0;
    2.0 * inside(x).min(inside(y))
}

fn outcrop(folder: &Path, words: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_outcrop"));
    let command = command.current_dir(folder).args(words);
    command.output().expect("it runs")
}

fn change(folder: &Path, words: &[&str]) -> String {
    let output = outcrop(folder, &[&["change"], words].concat());
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{words:?}: {error}");
    String::from_utf8(output.stdout).expect("text")
}

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("old.obj"), grid(|_, _| 0.0)).expect("a file");
    std::fs::write(folder.path().join("new.obj"), grid(block)).expect("a file");
    std::fs::write(folder.path().join("cloud.xyz"), "0 0 0\n1 0 0\n0 1 0\n").expect("a file");
    folder
}

#[test]
fn a_map_and_its_areas_are_written() {
    let folder = folder();
    let folder = folder.path();
    let words = [
        "old.obj", "new.obj", "-o", "map.ply", "--areas", "a.csv", "--json",
    ];
    let told = change(folder, &words);
    let told: serde_json::Value = serde_json::from_str(&told).expect("JSON");
    // The block: a pyramid without its top.
    let volume = 2.0 / 6.0 * (20.0 * 20.0 + 4.0 * 17.0 * 17.0 + 14.0 * 14.0);
    let gained = told["gained"].as_f64().expect("a number");
    assert!((gained / volume - 1.0).abs() < 0.01, "{gained} {volume}");
    assert_eq!(told["areas"].as_array().map(Vec::len), Some(1));
    assert_eq!(told["lost"], 0.0);
    let table = std::fs::read_to_string(folder.join("a.csv")).expect("a table");
    assert_eq!(table.lines().count(), 2);
    let map = std::fs::read(folder.join("map.ply")).expect("a map");
    let head = String::from_utf8_lossy(&map[..map.len().min(2000)]).into_owned();
    for line in ["float change", "float uncertainty", "uchar significant"] {
        assert_eq!(
            head.matches(&format!("property {line}\n")).count(),
            1,
            "{head}"
        );
    }
    assert!(outcrop(folder, &["verify", "map.ply"]).status.success());

    // A map is a mesh: its values are replaced, and threads and memory do not matter.
    let words = [
        "old.obj",
        "map.ply",
        "-o",
        "again.ply",
        "--areas",
        "a.geojson",
    ];
    let text = change(
        folder,
        &[&words[..], &["--threads", "1", "--memory", "192MiB"]].concat(),
    );
    assert!(text.contains("significant"), "{text}");
    assert!(map == std::fs::read(folder.join("again.ply")).expect("a map"));
    let polygons = std::fs::read_to_string(folder.join("a.geojson")).expect("polygons");
    let polygons: serde_json::Value = serde_json::from_str(&polygons).expect("JSON");
    assert_eq!(polygons["features"].as_array().map(Vec::len), Some(1));
}

#[test]
fn a_page_shows_the_map() {
    let folder = folder();
    let folder = folder.path();
    let page = |name: &str, threads: &str| {
        let words = ["old.obj", "new.obj", "-o", "map.ply", "--threads", threads];
        change(folder, &[&words[..], &["--html", name]].concat());
        std::fs::read_to_string(folder.join(name)).expect("a page")
    };
    let one = page("page.html", "1");
    assert_eq!(one.matches("data:image/png;base64,").count(), 2);
    for words in [
        "From old.obj to new.obj",
        "Volume gained",
        "only old",
        "<svg",
    ] {
        assert!(one.contains(words), "{words}");
    }
    // The two limits of the distribution.
    assert_eq!(one.matches("class=\"limit\"").count(), 2);
    assert!(one == page("other.html", "3"));
    // The map is the same without a page.
    let with = std::fs::read(folder.join("map.ply")).expect("a map");
    change(folder, &["old.obj", "new.obj", "-o", "map.ply"]);
    assert!(with == std::fs::read(folder.join("map.ply")).expect("a map"));
    let refused = outcrop(folder, &["change", "old.obj", "new.obj", "--html", "p.txt"]);
    assert_eq!(refused.status.code(), Some(2));
}

#[test]
fn what_cannot_be_compared_is_refused() {
    let folder = folder();
    let folder = folder.path();
    let refused: [(&[&str], &str); 7] = [
        (
            &["old.obj", "cloud.xyz"],
            "cloud.xyz: new surface: found a cloud, expected a mesh",
        ),
        (&["old.obj", "new.obj", "-o", "map.obj"], "ends with .ply"),
        (
            &["old.obj", "new.obj", "-o", "s3://here/map.ply"],
            "ends with .ply",
        ),
        (&["old.obj", "new.obj", "--registration=-1"], "registration"),
        (&["old.obj", "new.obj", "--radius", "0"], "radius"),
        (
            &["old.obj", "new.obj", "--areas", "areas.txt"],
            ".csv or .geojson",
        ),
        (&["old.obj", "absent.obj"], "absent.obj"),
    ];
    for (words, why) in refused {
        let output = outcrop(folder, &[&["change"], words].concat());
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{words:?}: {error}");
        assert!(error.contains(why), "{words:?}: {error}");
        assert_eq!(
            error
                .lines()
                .filter(|line| line.starts_with("outcrop: "))
                .count(),
            1,
            "{error}"
        );
    }
    let names = std::fs::read_dir(folder).expect("a folder");
    assert_eq!(names.count(), 3, "nothing half-written");
    // A surface is not overwritten.
    let map = change(folder, &["old.obj", "new.obj", "-o", "map.ply"]);
    assert!(map.contains("volume"), "{map}");
    let output = outcrop(folder, &["change", "old.obj", "map.ply", "-o", "map.ply"]);
    assert_eq!(output.status.code(), Some(2));
}

#[test]
fn a_pit_and_a_heap_between_two_surveys_have_their_volumes() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let survey = |epoch| {
        let objects = Objects {
            epoch,
            ..Objects::default()
        };
        let cloud = Cloud::new(Kind::Outdoor).points(400_000).seed(5);
        cloud.noise(0.03).objects(objects)
    };
    for (name, epoch) in [("old", false), ("new", true)] {
        let cloud = folder.join(format!("{name}.xyz"));
        let mesh = format!("{name}-mesh.ply");
        survey(epoch).write(&cloud, Format::Xyz).expect("a cloud");
        let cloud = cloud.display().to_string();
        let made = outcrop(folder, &["reconstruct", &cloud, "-o", &mesh, "--quiet"]);
        assert!(made.status.success(), "{made:?}");
    }
    let told = change(
        folder,
        &[
            "old-mesh.ply",
            "new-mesh.ply",
            "--registration",
            "0.02",
            "--json",
        ],
    );
    let told: Value = serde_json::from_str(&told).expect("JSON");
    let number = |area: &Value, key: &str| area[key].as_f64().expect("a number");
    // The volume of the area around a place.
    let volume = |[x, y]: [f64; 2]| {
        let inside = |area: &&Value| {
            let end = |corner: &str, axis: usize| area[corner][axis].as_f64().expect("a number");
            (end("min", 0)..end("max", 0)).contains(&x)
                && (end("min", 1)..end("max", 1)).contains(&y)
        };
        let area = told["areas"]
            .as_array()
            .and_then(|areas| areas.iter().find(inside));
        let area = area.expect("an area of change");
        number(area, "gained") - number(area, "lost")
    };
    let changes = survey(true).changes().expect("changes");
    for (place, right) in [(changes.pit, -PIT_VOLUME), (changes.heap, HEAP_VOLUME)] {
        let found = volume(place);
        assert!((found / right - 1.0).abs() < 0.02, "{found} {right}");
    }
}
