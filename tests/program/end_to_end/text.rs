//! Columns of text on the command line: what is said, and what the caller says.

use crate::end_to_end::util::{self, Bench, Said};
use serde_json::Value;
use std::fmt::Write as _;

/// A wavy surface: number, northing, easting, height and a word in each line.
fn survey(bench: &Bench, name: &str, header: &str) -> std::path::PathBuf {
    let mut text = header.to_owned();
    for i in 0..400u32 {
        let (x, y) = (f64::from(i % 20), f64::from(i / 20));
        let z = (x * 0.4).sin() + (y * 0.3).cos();
        writeln!(
            text,
            "{i},{:.3},{:.3},{z:.3},TREE",
            8000.001 + y,
            600.001 + x
        )
        .unwrap();
    }
    bench.write(name, text)
}

fn run(words: &[&str], path: &std::path::Path) -> Said {
    let path = path.to_str().unwrap();
    util::run(words.iter().copied().chain([path]))
}

#[test]
fn what_is_taken_of_text_is_said() {
    let bench = Bench::new();
    let path = survey(&bench, "a.csv", "Point,Northing,Easting,Height,Code\n");
    let taken = "x y z from columns 3, 2, 4 \"Easting Northing Height\"";
    let said = run(&["info"], &path);
    assert!(said.code == Some(0) && said.out.contains(taken), "{said:?}");
    let said = run(&["info", "--json"], &path);
    let info: Value = serde_json::from_str(&said.out).unwrap();
    let file = &info["input"]["files"][0];
    assert!(file["taken"].as_str().unwrap().starts_with(taken), "{file}");
    assert_eq!(file["guessed"], true);
    assert_eq!(info["min"][0], 600.001);
    let mesh = bench.path("mesh.ply");
    let said = run(&["reconstruct", "-o", mesh.to_str().unwrap()], &path);
    assert_eq!(said.code, Some(0), "{}", said.err);
    assert_eq!(said.err.matches(taken).count(), 1, "{}", said.err);
}

#[test]
fn what_cannot_be_told_is_refused_until_the_caller_tells() {
    let bench = Bench::new();
    let path = survey(&bench, "a.csv", "");
    let mesh = bench.path("mesh.ply");
    let out = ["reconstruct", "-o", mesh.to_str().unwrap()];
    let said = run(&out, &path);
    assert_eq!(said.code, Some(2), "{}", said.err);
    assert!(
        said.err.contains("columns: found 5 columns without names"),
        "{}",
        said.err
    );
    assert!(said.err.contains("--columns"), "{}", said.err);
    let said = run(&[&out[..], &["--columns", "-,y,x,z,-"]].concat(), &path);
    assert_eq!((said.code, &*said.err), (Some(0), ""));
    let plain = std::fs::read(&mesh).unwrap();
    // The same of a file with lines before the points.
    let path = survey(&bench, "b.csv", "made in 2020\nby 1 person\n");
    let more = ["--columns=number,y,x,z", "--skip-lines=2"];
    let said = run(&[&out[..], &more[..]].concat(), &path);
    assert_eq!((said.code, &*said.err), (Some(0), ""));
    assert_eq!(std::fs::read(&mesh).unwrap(), plain);
    let said = run(&[&out[..], &["--columns=x,y"]].concat(), &path);
    assert!(
        said.code == Some(2) && said.err.contains("does not have z once"),
        "{said:?}"
    );
    let said = run(&["info", "--columns=-,y,x,z", "--skip-lines=2"], &path);
    assert!(
        said.code == Some(0) && said.out.contains("columns 3, 2, 4"),
        "{said:?}"
    );
}
