//! Columns of text: by names, by the look of numbers, as the caller says; or a refusal that lists them.

use crate::bench::Bench;
use crate::columns::rows;
use outcrop::Error;
use outcrop_points::{Attributes, IngestStats, Layout, Selection, Spool, ingest_selected};
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

/// Files whose names tell where the coordinates are, and what is said about them.
fn named() -> Vec<(&'static str, String, &'static str)> {
    let mut files: Vec<(&str, String, &str)> = Vec::new();
    let mut add = |name, header: &str, said, line: &dyn Fn(usize, [f64; 3]) -> String| {
        files.push((name, header.to_owned() + &lines(line), said));
    };
    let livox = "Version,Slot ID,Timestamp Type,Timestamp,X,Y,Z,Reflectivity,Ori_x,Ori_y,Ori_z\n";
    add(
        "livox.csv",
        livox,
        "columns 5–7 \"X Y Z\"; intensity from column 8",
        &|i, [x, y, z]| {
            format!(
                "5,1,0x00,100000{i},{x},{y},{z},{i},{},{},{}\n",
                1000.0 * x,
                1000.0 * y,
                1000.0 * z
            )
        },
    );
    let bare = ",x,y,z,red,green,blue\n";
    add(
        "pandas.csv",
        bare,
        "columns 2–4 \"x y z\"; colours 8 bits from columns 5–7",
        &|i, [x, y, z]| format!("{i},{x},{y},{z},1,{i},3\n"),
    );
    add(
        "pandas.tsv",
        &bare.replace(',', "\t"),
        "columns 2–4 \"x y z\"",
        &|i, [x, y, z]| format!("{i}\t{x}\t{y}\t{z}\t1\t2\t3\n"),
    );
    add(
        "r.txt",
        "\"x\" \"y\" \"z\" \"height above\"\n",
        "columns 2–4 \"x y z\"",
        &|i, [x, y, z]| format!("\"{i}\" {x} {y} {z} 7\n"),
    );
    let survey = "Point,Easting,Northing,Elevation\n";
    add(
        "penzd.csv",
        survey,
        "columns 2–4 \"Easting Northing Elevation\"; ",
        &|i, [x, y, z]| format!("{i},{x},{y},{z},\"TREE, old\"\n"),
    );
    let survey = "Point ID;Northing (m);Easting (m);Height (m);Code\n";
    add(
        "pnezd.csv",
        survey,
        "columns 3, 2, 4 \"Easting (m)\", \"Northing (m)\", \"Height (m)\"",
        &|i, [x, y, z]| {
            let comma = |v: f64| v.to_string().replace('.', ",");
            format!("{i};{};{};{};TREE\n", comma(y), comma(x), comma(z))
        },
    );
    add("enh.txt", "N E H\n", "columns 2, 1, 3 \"E N H\"", &|_,
                                                             [
        x,
        y,
        z,
    ]| {
        format!("{y} {x} {z}\n")
    });
    add(
        "view.csv",
        "\"Intensity\",\"Points:0\",\"Points:1\",\"Points:2\"\n",
        "columns 2–4",
        &|i, [x, y, z]| format!("{i},{x},{y},{z}\n"),
    );
    add(
        "units.csv",
        "Return number,X[m],Y[m],Z[m]\n",
        "columns 2–4 \"X[m] Y[m] Z[m]\"",
        &|i, [x, y, z]| format!("{i},{x},{y},{z}\n"),
    );
    add(
        "quoted.csv",
        "\"M3C2, distance\",\"Z\",\"Y\",\"X\"\n",
        "columns 4, 3, 2 \"X Y Z\"",
        &|i, [x, y, z]| format!("{i},{z},{y},{x}\n"),
    );
    let colmap = "# 3D point list with one line of data per point:\n\
        #   POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n\
        # Number of points: 3, mean track length: 2.5\n";
    add(
        "points3D.txt",
        colmap,
        "columns 2–4 \"X Y Z\"; colours 8 bits from columns 5–7",
        &|i, [x, y, z]| format!("{} {x} {y} {z} 1 2 3 0.5{}\n", 7 * i, " 4 5".repeat(i)),
    );
    add(
        "percent.txt",
        "% i x y z\n",
        "columns 2–4 \"x y z\"",
        &|i, [x, y, z]| format!("{i} {x} {y} {z}\n"),
    );
    add(
        "behind.asc",
        "//Nx Ny Nz X Y Z\n",
        "columns 4–6 \"X Y Z\"",
        &|_, [x, y, z]| format!("0 0 1 {x} {y} {z}\n"),
    );
    add(
        "blank.txt",
        "\"Point ID\" \"X (m)\" \"Y (m)\" \"Z (m)\"\n",
        "columns 2–4",
        &|i, [x, y, z]| format!("{i} {x} {y} {z}\n"),
    );
    files
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

#[test]
fn vertices_of_off_are_points_and_faces_are_none() {
    let bench = Bench::new();
    let faces = "3 0 1 2\n3 0 2 1 255 0 0\n";
    let plain = lines(|_, [x, y, z]| format!("{x} {y} {z}\n"));
    let colored = lines(|_, [x, y, z]| format!("{x} {y} {z} 200 100 50 255\n"));
    let normal = lines(|_, [x, y, z]| format!("{x} {y} {z} 0 0 1\n"));
    for (name, text, list, more) in [
        (
            "a.off",
            format!("OFF\n3 2 0\n{plain}{faces}"),
            "none",
            &[][..],
        ),
        (
            "b.off",
            format!("OFF 3 2 0\r\n{}{faces}", plain.replace('\n', "\r\n")),
            "none",
            &[],
        ),
        (
            "c.off",
            format!("# a mesh\nOFF # b\n\n3 2 0\n# c\n{plain}\n{faces}"),
            "none",
            &[],
        ),
        (
            "d.off",
            format!("COFF\n3 2 0\n{colored}{faces}"),
            "color",
            &[200.0, 100.0, 50.0],
        ),
        (
            "e.off",
            format!("NOFF\n3 2 0\n{normal}{faces}"),
            "nz",
            &[1.0],
        ),
        (
            "f.off",
            format!("OFF\n3 2 0\n{colored}{faces}"),
            "color",
            &[200.0, 100.0, 50.0],
        ),
        ("g", format!("off\n3 0 0\n{plain}"), "none", &[]),
        (
            "h.off",
            format!("OFF\n3 0 0\n{}", plain.trim_end()),
            "none",
            &[],
        ),
    ] {
        let (found, stats) = points(&bench, name, &text, list);
        let want: Vec<Vec<f64>> = want()
            .into_iter()
            .map(|p| [p, more.to_vec()].concat())
            .collect();
        assert_eq!(found, want, "{name}");
        assert_eq!(
            stats.warnings.len(),
            usize::from(name == "f.off"),
            "{:?}",
            stats.warnings
        );
    }
    for (text, said) in [
        (format!("OFF BINARY\n3 0 0\n{plain}"), "found binary OFF"),
        (
            format!("4OFF\n3 0 0\n{plain}"),
            "other than three coordinates",
        ),
        (
            format!("OFF\nthree 0 0\n{plain}"),
            "OFF header: found \"three 0 0\"",
        ),
        (
            format!("OFF\n4 0 0\n{plain}"),
            "found 4 vertices, expected at most 3",
        ),
        (
            format!("OFF\n4 0 0\n{plain}1 2\n"),
            "line 6: found \"1 2\", expected a vertex",
        ),
    ] {
        let found = refusal(&bench, "a.off", &text);
        assert!(found.contains(said), "{found}");
    }
}

/// More than one unit of lines, with faces that look like points.
#[test]
fn a_large_off_ends_where_its_vertices_do() {
    let bench = Bench::new();
    let count = 200_000;
    let vertices: String = (0..count)
        .map(|i| format!("{i}.25 {} -0.5\n", i % 7))
        .collect();
    let faces = "3 900000 900001 900002\n".repeat(100_000);
    let path = bench.write("a.off", format!("OFF\n{count} 100000 0\n{vertices}{faces}"));
    let spool = bench.read(&[path]).unwrap();
    assert_eq!(spool.points(), count);
    assert_eq!(
        spool.stats().files[0].max,
        Some([count as f64 - 0.75, 6.0, -0.5])
    );
}
