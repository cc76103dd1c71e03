//! Columns of text: by names, by the look of numbers, as the caller says; or a refusal that lists them.

mod named;
mod off;

use crate::ingest::bench::Bench;
use crate::ingest::columns::rows;
use named::named;
use outcrop::Error;
use outcrop_formats::ingest_selected;
use outcrop_points::{Attributes, IngestStats, Layout, Selection, Spool};
use std::path::PathBuf;

/// Reads a file with these columns of its points.
fn read(bench: &Bench, path: PathBuf, layout: Layout, list: &str) -> Result<Spool, Error> {
    let selection = Selection {
        attributes: list.parse().unwrap(),
        layout,
        ..Selection::default()
    };
    ingest_selected(&[path], &selection, &bench.workspace)
}

/// The coordinates of all points, with the values of listed columns, in the order of the coordinates; and what was
/// said.
fn points(bench: &Bench, name: &str, text: &str, list: &str) -> (Vec<Vec<f64>>, IngestStats) {
    laid(bench, name, text, Layout::default(), list)
}

fn laid(
    bench: &Bench,
    name: &str,
    text: &str,
    layout: Layout,
    list: &str,
) -> (Vec<Vec<f64>>, IngestStats) {
    let path = bench.write(name, text);
    let spool = read(bench, path, layout, list).unwrap_or_else(|e| panic!("{text:?}: {e}"));
    let lattice = spool.choose_lattice(0).unwrap();
    let attributes: Attributes = list.parse().unwrap();
    let found = if attributes == Attributes::None {
        let mut all: Vec<Vec<f64>> = Vec::new();
        let take = |points: &[[i32; 3]]| {
            all.extend(points.iter().map(|p| lattice.position(*p).to_vec()));
            Ok(())
        };
        spool.for_each(&bench.workspace, &lattice, take).unwrap();
        all.sort_by(|a, b| a.partial_cmp(b).unwrap());
        all
    } else {
        let carried = spool.carried(&attributes, false);
        let found = rows(bench, &spool, &carried).into_iter();
        let row = |(point, values): ([i32; 3], Vec<f64>)| {
            [lattice.position(point).to_vec(), values].concat()
        };
        found.map(row).collect()
    };
    let stats = spool.stats().clone();
    spool.release(&bench.workspace).unwrap();
    (found, stats)
}

fn refusal(bench: &Bench, name: &str, text: &str) -> String {
    let path = bench.write(name, text);
    let said = bench.error(path);
    assert_eq!(said.lines().count(), 1);
    said
}

/// Three points, of which the second has the coordinates 2.5, 20.25, 200.5, in lines of a form.
fn lines(line: impl Fn(usize, [f64; 3]) -> String) -> String {
    let line = |i: usize| {
        let f = i as f64;
        line(i, [f + 0.5, 10.0 * f + 0.25, 100.0 * f + 0.5])
    };
    (1..=3).map(line).collect()
}

fn want() -> Vec<Vec<f64>> {
    let point = |i: f64| vec![i + 0.5, 10.0 * i + 0.25, 100.0 * i + 0.5];
    [1.0, 2.0, 3.0].map(point).into()
}

#[test]
fn names_tell_the_coordinates_whatever_is_between_them() {
    let bench = Bench::new();
    for (name, text, said) in named() {
        let (found, stats) = points(&bench, name, &text, "none");
        assert_eq!(found, want(), "{name}");
        let taken = stats.files[0].taken.as_deref().unwrap();
        assert!(
            taken.starts_with("x y z from ") && taken.contains(said),
            "{name}: {taken}"
        );
        assert!(stats.files[0].guessed, "{name}");
        assert_eq!(stats.warnings.len(), 1, "{name}: {:?}", stats.warnings);
        assert!(
            stats.warnings[0].ends_with(taken),
            "{name}: {:?}",
            stats.warnings
        );
    }
}

#[test]
fn names_that_are_plain_are_no_guess() {
    let bench = Bench::new();
    for (name, text) in [
        ("a.xyz", "1.5 10.25 100.5\n"),
        ("b.csv", "x,y,z\n1.5,10.25,100.5\n"),
        ("c.asc", "//X Y Z Intensity\n1.5 10.25 100.5 7\n"),
        ("d.csv", "X[m];Y[m];Z[m];odd name\n1,5;10,25;100,5;7\n"),
        ("e.pts", "1\n1.5 10.25 100.5 -7 1 2 3\n"),
        ("f.txt", "# X Y Z coordinates\n1.5 10.25 100.5\n"),
        (
            "g.txt",
            "# the x y z of all points are in metres\n1.5 10.25 100.5\n",
        ),
    ] {
        let (found, stats) = points(&bench, name, text, "none");
        assert_eq!(found, [[1.5, 10.25, 100.5]], "{name}");
        assert!(
            stats.files[0].taken.is_some() && !stats.files[0].guessed,
            "{name}"
        );
        assert_eq!(stats.warnings, [""; 0], "{name}");
    }
}

#[test]
fn colours_and_intensities_of_text_are_read() {
    let bench = Bench::new();
    let color = "red,green,blue";
    for (name, text, list, want) in [
        (
            "a.asc",
            "//X Y Z R G B Intensity\n1 2 3 200 100 50 -7\n",
            "color,intensity",
            &[200.0, 100.0, 50.0, -7.0][..],
        ),
        (
            "b.txt",
            "#x,y,z,Red,Green,Blue\n1,2,3,200,100,50\n",
            color,
            &[200.0, 100.0, 50.0],
        ),
        (
            "c.pts",
            "//X;Y;Z;Rf;Gf;Bf;Intensity\n1\n1.5;2;3;0.2;0.4;1.0;0.75\n",
            "color,intensity",
            &[51.0, 102.0, 255.0, 0.75],
        ),
        (
            "d.pts",
            "1 2 3 -1035 200 100 50\n",
            "color,intensity",
            &[200.0, 100.0, 50.0, -1035.0],
        ),
        ("e.xyz", "1 2 3 200 100 50\n", color, &[200.0, 100.0, 50.0]),
        (
            "f.txt",
            "1 2 3 2019 200 100 50\n",
            "color,intensity",
            &[200.0, 100.0, 50.0, 2019.0],
        ),
        (
            "g.xyzrgb",
            "1 2 3 0.2 0.4 1.0\n",
            color,
            &[51.0, 102.0, 255.0],
        ),
        ("h.pts", "1.5 2 3 0.25\n", "intensity", &[0.25]),
        (
            "i.csv",
            "z,y,x,b,g,r\n3,2,1,50,100,200\n",
            color,
            &[200.0, 100.0, 50.0],
        ),
        (
            "j.csv",
            "x,y,z,r,g,b\n1,2,3,51400,25700,12850\n",
            color,
            &[200.0, 100.0, 50.0],
        ),
        (
            "k.txt",
            "1 2 3 200 100 50 0.5 0.5 0.7\n",
            color,
            &[200.0, 100.0, 50.0],
        ),
        (
            "l.txt",
            "1 2 3 200 100 50 255\n",
            color,
            &[200.0, 100.0, 50.0],
        ),
    ] {
        let (found, stats) = points(&bench, name, text, list);
        assert_eq!(found[0][3..], *want, "{name}: {:?}", stats.files[0].taken);
    }
    // Normals that are whole numbers, floats, and numbers that may be either, are no colours, which is said.
    for (name, text) in [
        ("a.txt", "1 2 3 0 0 1\n4 5 6 1 0 0\n"),
        ("b.txt", "1 2 3 0.5 0.5 0.7\n"),
        ("c.txt", "1 2 3 10 20 30 40\n5 6 7 10 20 30 44\n"),
        ("d.txt", "1 2 3 10 20 300\n"),
    ] {
        let (_, stats) = points(&bench, name, text, "none");
        assert_eq!(stats.files[0].columns, [""; 0], "{name}");
        assert!(
            stats.warnings[0].contains("not read"),
            "{:?}",
            stats.warnings
        );
    }
}

#[test]
fn what_was_guessed_is_said_once_for_files_alike() {
    let bench = Bench::new();
    let paths =
        ["a.xyz", "b.xyz", "c.xyz"].map(|n| bench.write(n, "1 2 3 200 100 50\n4 5 6 1 2 3\n"));
    let spool = bench.read(&paths).unwrap();
    let said = &spool.stats().warnings;
    let wanted = "a.xyz and 2 others: x y z from columns 1–3; colours 8 bits from columns 4–6";
    assert!(said.len() == 1 && said[0].ends_with(wanted), "{said:?}");
}

#[test]
fn columns_that_cannot_be_told_are_listed() {
    let bench = Bench::new();
    for (name, text, listed) in [
        (
            "a.csv",
            lines(|_, [x, y, z]| format!("{x},{y},{z}\n")),
            "\"foo\", \"bar baz\", \"q\"",
        ),
        (
            "b.txt",
            lines(|_, [x, y, z]| format!("{x} {y} {z} 1 1\n")),
            "\"lat\", \"lon\", \"height\", \"a\", \"b\"",
        ),
        (
            "c.csv",
            lines(|_, [x, y, z]| format!("7,{x},{y},{z},8,9\n")),
            "\"id\", \"x\", \"y\", \"z\"",
        ),
        (
            "d.csv",
            lines(|i, [x, y, z]| format!("{i},{x},{y},{z},TREE\n")),
            "5 columns without names",
        ),
        (
            "e.csv",
            lines(|i, [x, y, z]| format!("10{i} {y} {x} {z}\n")),
            "4 columns without names",
        ),
        (
            "f.txt",
            lines(|i, [x, y, z]| format!("{i} {x} {y} {z}\n")),
            "\"Point\", \"ID\", \"X\", \"Y\", \"Z\"",
        ),
        (
            "g.txt",
            lines(|i, [x, y, z]| format!("{i} {x} {y} {z} 1 1 1\n")),
            "\"id\", \"x\", \"y\", \"z\"",
        ),
    ] {
        let header = match name {
            "a.csv" => "foo,bar baz,q\n",
            "b.txt" => "lat lon height a b\n",
            "c.csv" => "id,x,y,z\n",
            "f.txt" => "Point ID X Y Z\n",
            "g.txt" => "# id x y z\n",
            _ => "",
        };
        let said = refusal(&bench, name, &(header.to_owned() + &text));
        assert!(
            said.contains(": columns: found ") && said.contains(listed),
            "{said}"
        );
    }
}

#[test]
fn the_caller_names_columns_and_passes_over_lines() {
    let bench = Bench::new();
    let layout = |columns: &str, skip_lines| Layout {
        columns: Some(columns.parse().unwrap()),
        skip_lines,
    };
    let title = "made by a program of 2020\n1 2 3 4 5 6\r\n\n";
    let pnezd = lines(|i, [x, y, z]| format!("{i},{y},{x},{z},TREE\n"));
    for (name, text, given) in [
        ("a.csv", pnezd.clone(), layout("-,y,x,z,-", 0)),
        ("b.csv", title.to_owned() + &pnezd, layout("-,y,x,z", 3)),
        (
            "c.csv",
            "x,y,z,a,b\n".to_owned() + &pnezd,
            layout("-,Y,X,Z,word", 0),
        ),
        (
            "d.txt",
            lines(|i, [x, y, z]| format!("{i} {x} {y} {z} TREE\n")),
            layout("n,x,y,z", 0),
        ),
        (
            "e.csv",
            lines(|_, p| format!("\"{}\",\"{}\",\"{}\"\n", p[0], p[1], p[2]).replace('.', ",")),
            layout("x,y,z", 0),
        ),
    ] {
        let (found, stats) = laid(&bench, name, &text, given, "none");
        assert_eq!(found, want(), "{name}");
        assert!(
            !stats.files[0].guessed && stats.warnings.is_empty(),
            "{:?}",
            stats.warnings
        );
    }
    let given = layout("x,y,z,intensity,r,g,b,-", 0);
    let text = "1 2 3 4 200 100 50 9\n";
    let (found, _) = laid(&bench, "f.txt", text, given, "color,intensity");
    assert_eq!(found[0], [1.0, 2.0, 3.0, 200.0, 100.0, 50.0, 4.0]);
    // Only lines to pass over: the rest is as the file says.
    let only = Layout {
        columns: None,
        skip_lines: 1,
    };
    let (found, _) = laid(
        &bench,
        "g.csv",
        "a title, of 2\nz,y,x\n3,2,1\n",
        only,
        "none",
    );
    assert_eq!(found, [[1.0, 2.0, 3.0]]);
    let error = |name: &str, text: &str, layout| {
        let path = bench.write(name, text);
        read(&bench, path, layout, "none")
            .map(|_| ())
            .unwrap_err()
            .to_string()
    };
    let said = error("h.csv", "a,b,c,d\n", layout("-,x,y,z", 0));
    assert!(
        said.contains("found text that is no list of points"),
        "{said}"
    );
    let said = error("i.csv", "1,2,3\n", layout("-,x,y,z", 0));
    assert!(said.contains("the given -,x,y,z has"), "{said}");
    let said = error("j.csv", "1,2,3\n", layout("x,y,z", 9));
    assert!(said.contains("fewer than 9 lines"), "{said}");
    let ply = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n\
        property float z\nend_header\n1 2 3\n";
    let said = error("k.ply", ply, layout("x,y,z", 0));
    assert!(
        said.starts_with("columns: ") && said.contains("a text file among the inputs"),
        "{said}"
    );
}
