//! Comments of PLY clouds: the origin of the coordinates, and the reference system.

use crate::ingest::bench::Bench;
use outcrop_points::Spool;
use std::path::Path;

/// Points in text or binary, with a list among the properties or not.
fn file(body: &str, comments: &[&str], list: bool, points: &[[f32; 3]]) -> Vec<u8> {
    let comments: String = comments.iter().map(|c| format!("comment {c}\n")).collect();
    let list = if list {
        "property list uchar int more\n"
    } else {
        ""
    };
    let mut bytes = format!(
        "ply\nformat {body} 1.0\n{comments}element vertex {}\n{list}property float x\nproperty float y\n\
         property float z\nend_header\n",
        points.len()
    )
    .into_bytes();
    for point in points {
        if !list.is_empty() {
            bytes.extend(if body == "ascii" { b"0 " } else { &b"\0"[..] });
        }
        for c in point {
            bytes.extend(match body {
                "ascii" => format!("{c} ").into_bytes(),
                "binary_little_endian" => c.to_le_bytes().into(),
                _ => c.to_be_bytes().into(),
            });
        }
        bytes.extend((body == "ascii").then_some(b'\n'));
    }
    bytes
}

const POINTS: [[f32; 3]; 3] = [[0.25, 1.5, -2.0], [10.01, 0.1, 0.3], [7.0, 8.0, 9.75]];

fn bounds(spool: &Spool) -> [[f64; 3]; 2] {
    let file = &spool.stats().files[0];
    [file.min.unwrap(), file.max.unwrap()]
}

#[test]
fn offsets_are_added_in_text_and_binary() {
    let bench = Bench::new();
    for body in ["ascii", "binary_little_endian", "binary_big_endian"] {
        for list in [false, true] {
            for [x, y, z] in [
                ["offsetx 635000", "offsety 848000.5", "offsetz -400"],
                ["shift_x 635000", "shift_y 848000.5", "shift_z -400"],
            ] {
                let path = bench.write("a.ply", file(body, &["by hand", z, x, y], list, &POINTS));
                let spool = bench.read(&[path]).unwrap();
                let [low, high] = bounds(&spool);
                assert_eq!(low[2], -402.0, "{body}");
                assert_eq!(high[1], 848_008.5, "{body}");
                for (found, wanted) in [
                    (low[0], 635_000.25),
                    (low[1], 848_000.6),
                    (high[0], 635_010.01),
                ] {
                    assert!((found - wanted).abs() < 1e-6, "{body}: {found} {wanted}");
                }
                if body == "ascii" {
                    let lattice = spool.choose_lattice(0).unwrap();
                    assert_eq!((lattice.step, lattice.exact), (0.01, true));
                }
                spool.release(&bench.workspace).unwrap();
            }
        }
    }
}

#[test]
fn an_origin_with_more_decimals_refines_the_lattice() {
    let bench = Bench::new();
    let comments = ["offsetx 0.0005", "offsety 0", "offsetz 1e3"];
    let path = bench.write("a.ply", file("ascii", &comments, false, &POINTS));
    let spool = bench.read(&[path]).unwrap();
    let lattice = spool.choose_lattice(0).unwrap();
    assert_eq!((lattice.step, lattice.exact), (0.0001, true));
    assert_eq!(bounds(&spool)[0][2], 998.0);
}

#[test]
fn rounded_coordinates_are_the_multiples_that_they_were() {
    let bench = Bench::new();
    let comments = ["offsetx 1000", "offsety 2000", "offsetz 0", "gridstep 0.01"];
    let path = bench.write(
        "a.ply",
        file("binary_little_endian", &comments, false, &POINTS),
    );
    let spool = bench.read(&[path]).unwrap();
    assert_eq!(
        bounds(&spool),
        [[1000.25, 2000.1, -2.0], [1010.01, 2008.0, 9.75]]
    );
}

#[test]
fn one_offset_alone_moves_nothing() {
    let bench = Bench::new();
    let path = bench.write(
        "a.ply",
        file("ascii", &["offsetx 5", "offsety 5"], false, &POINTS),
    );
    let spool = bench.read(&[path]).unwrap();
    assert_eq!(bounds(&spool)[0][2], -2.0);
}

const UTM: &str = r#"PROJCS["ETRS89 / UTM zone 32N",GEOGCS["ETRS89"],AUTHORITY["EPSG","25832"]]"#;

/// The system of a cloud with comments, and what is said of it.
fn system(
    bench: &Bench,
    comments: &[&str],
    prj: Option<&str>,
) -> (Option<String>, Option<String>, Vec<String>) {
    let path = bench.write("a.ply", file("ascii", comments, false, &POINTS));
    let beside: &Path = &bench.path("a.prj");
    let _ = std::fs::remove_file(beside);
    prj.iter()
        .for_each(|text| std::fs::write(beside, text).unwrap());
    let spool = bench.read(&[path]).unwrap();
    let crs = spool.stats().crs.clone();
    let source = crs.as_ref().map(|crs| crs.source.to_string());
    (
        crs.map(|crs| crs.label()),
        source,
        spool.stats().warnings.clone(),
    )
}

#[test]
fn comments_give_the_system() {
    let bench = Bench::new();
    let (label, source, said) = system(&bench, &["epsg 25832"], None);
    assert_eq!(label.as_deref(), Some("EPSG:25832"));
    assert_eq!(
        (source.as_deref(), said.len()),
        (Some("comments of the header"), 0)
    );
    let (label, ..) = system(&bench, &["epsg 25832", "crs EPSG:25832+7837"], None);
    assert_eq!(label.as_deref(), Some("EPSG:25832+7837"));
    let (label, ..) = system(&bench, &["crs Site north"], None);
    assert_eq!(label.as_deref(), Some("Site north"));
    assert_eq!(system(&bench, &["made by hand"], None).0, None);
}

#[test]
fn a_text_beside_counts_if_it_is_the_same_system() {
    let bench = Bench::new();
    let (label, source, said) = system(&bench, &["epsg 25832"], Some(UTM));
    assert_eq!(label.as_deref(), Some("EPSG:25832"));
    assert_eq!((source.as_deref(), said.len()), (Some(".prj file"), 0));
    let (label, source, said) = system(&bench, &["epsg 2994"], Some(UTM));
    assert_eq!(label.as_deref(), Some("EPSG:2994"));
    assert_eq!(source.as_deref(), Some("comments of the header"));
    assert!(
        said.len() == 1 && said[0].contains("EPSG:25832"),
        "{said:?}"
    );
}
