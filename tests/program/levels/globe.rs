//! The place of tilesets on the globe, by the system that meshes and files beside them tell.

use super::{MEMORY, hills};
use crate::levels::meshes::Mesh;
use outcrop::levels::{Options, TilesReport};
use outcrop::{Observer, Tiles};
use proptest::prelude::*;
use serde_json::Value;
use std::path::Path;
use std::sync::{Arc, Mutex};

/// Half axes of the ellipsoid of WGS 84.
const EQUATOR: f64 = 6_378_137.0;
const POLE: f64 = 6_356_752.314_245_179;

/// Metres in units of length.
const UNITS: [f64; 3] = [1.0, 0.3048, 1200.0 / 3937.0];

/// A small square around a position, with these comments in the header.
fn mesh(path: &Path, [x, y, z]: [f64; 3], side: f64, comments: &[&str]) {
    let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
    let corner = |[a, b]: [f64; 2]| [x + (a - 0.5) * side, y + (b - 0.5) * side, z];
    let square = Mesh::of(corners.map(corner).to_vec(), vec![[0, 1, 2], [1, 3, 2]]);
    square.write(path);
    let text = std::fs::read_to_string(path).unwrap();
    let lines: String = comments
        .iter()
        .map(|line| format!("comment {line}\n"))
        .collect();
    let text = text.replacen(
        "format ascii 1.0\n",
        &format!("format ascii 1.0\n{lines}"),
        1,
    );
    std::fs::write(path, text).unwrap();
}

/// Keeps warnings.
#[derive(Default)]
struct Heard(Mutex<Vec<String>>);

impl Observer for Heard {
    fn warn(&self, message: &str) {
        self.0.lock().unwrap().push(message.to_owned());
    }
}

/// A tileset on the globe: the report, its matrix, its origin, and warnings.
struct Made {
    report: TilesReport,
    matrix: [f64; 16],
    origin: [f64; 3],
    about: Value,
    said: Vec<String>,
}

fn made(mesh: &Path, crs: Option<&str>) -> outcrop::Result<Made> {
    let output = mesh.with_extension("tiles");
    let _ = std::fs::remove_dir_all(&output);
    let heard = Arc::new(Heard::default());
    let options = Options {
        geo: true,
        crs: crs.map(|crs| crs.parse().unwrap()),
        ..Options::default()
    };
    let tiles = Tiles::new(mesh, &output)
        .options(options)
        .memory(MEMORY)
        .threads(1);
    let report = tiles.observer(heard.clone()).run()?;
    let json = std::fs::read(output.join("tileset.json")).unwrap();
    let json: Value = serde_json::from_slice(&json).unwrap();
    let number = |value: &Value| value.as_f64().unwrap();
    let said = std::mem::take(&mut *heard.0.lock().unwrap());
    Ok(Made {
        report,
        matrix: std::array::from_fn(|k| number(&json["root"]["transform"][k])),
        origin: std::array::from_fn(|k| number(&json["extras"]["outcrop"]["origin"][k])),
        about: json["extras"]["outcrop"].clone(),
        said,
    })
}

impl Made {
    /// Where a position is on the globe.
    fn place(&self, position: [f64; 3]) -> [f64; 3] {
        let m = &self.matrix;
        std::array::from_fn(|k| {
            let along = |axis: usize| m[4 * axis + k] * (position[axis] - self.origin[axis]);
            m[12 + k] + (0..3).map(along).sum::<f64>()
        })
    }

    fn is_at(&self, position: [f64; 3], wanted: [f64; 3], by: f64) {
        let found = self.place(position);
        assert!(
            (0..3).all(|k| (found[k] - wanted[k]).abs() < by),
            "{found:?}, not {wanted:?}"
        );
    }
}

/// A place on the equator.
fn on_equator(longitude: f64, height: f64) -> [f64; 3] {
    let angle = longitude.to_radians();
    [
        (EQUATOR + height) * angle.cos(),
        (EQUATOR + height) * angle.sin(),
        0.0,
    ]
}

#[test]
fn geocentric_coordinates_stay_as_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.ply");
    let at = [4_156_305.5, 671_404.25, 4_774_508.75];
    mesh(&path, at, 8.0, &["epsg 4978"]);
    let by_code = made(&path, None).unwrap();
    let linear = [0, 1, 2].map(|axis| [0, 1, 2].map(|k| by_code.matrix[4 * axis + k]));
    assert_eq!(linear, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    by_code.is_at(at, at, 1e-9);
    // By texts without a code; the second in kilometres.
    mesh(&path, at, 8.0, &[]);
    let prj = path.with_extension("prj");
    std::fs::write(&prj, "GEOCCS[\"own\",DATUM[\"d\"],UNIT[\"metre\",1]]").unwrap();
    made(&path, None).unwrap().is_at(at, at, 1e-9);
    let newer = "GEODCRS[\"own\",DATUM[\"d\"],CS[Cartesian,3],AXIS[\"x\",geocentricX],LENGTHUNIT[\"km\",1000]]";
    std::fs::write(&prj, newer).unwrap();
    let small = at.map(|c| c / 1000.0);
    mesh(&path, small, 0.008, &[]);
    made(&path, None).unwrap().is_at(small, at, 1e-5);
}

#[test]
fn the_header_of_a_mesh_is_enough_and_goes_before_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.ply");
    let at = [500_000.0, 0.0, 100.0];
    mesh(&path, at, 8.0, &["epsg 32631", "crs EPSG:32631"]);
    let alone = made(&path, None).unwrap();
    alone.is_at(at, on_equator(3.0, 100.0), 1e-3);
    assert_eq!(alone.said, [""; 0]);
    assert_eq!(alone.about["epsg"], 32631);
    assert_eq!(alone.report.crs.as_ref().unwrap().line(), "EPSG:32631");
    // A file of another mesh.
    let prj = path.with_extension("prj");
    std::fs::write(
        &prj,
        "PROJCS[\"x\",UNIT[\"metre\",1],AUTHORITY[\"EPSG\",\"32633\"]]",
    )
    .unwrap();
    let both = made(&path, None).unwrap();
    both.is_at(at, on_equator(3.0, 100.0), 1e-3);
    assert_eq!(both.said.len(), 1);
    let words = "mesh.prj: it gives EPSG:32633, but the header of ";
    assert!(
        both.said[0].contains(words) && both.said[0].ends_with("gives EPSG:32631, which is taken")
    );
    // The same system: the file tells more, and nothing is said.
    let text = "PROJCS[\"x\",UNIT[\"metre\",1],AUTHORITY[\"EPSG\",\"32631\"]]";
    std::fs::write(&prj, text).unwrap();
    let both = made(&path, None).unwrap();
    assert_eq!((both.said.len(), &both.about["crs"]), (0, &text.into()));
    // What is given goes before both.
    let given = made(&path, Some("EPSG:32632")).unwrap();
    given.is_at(at, on_equator(9.0, 100.0), 1e-3);
    assert!(
        given.said[0]
            .starts_with("crs: EPSG:32632 is taken instead of EPSG:32631, which the header of ")
    );
    // Without a header, the file is enough.
    mesh(&path, at, 8.0, &[]);
    made(&path, None)
        .unwrap()
        .is_at(at, on_equator(3.0, 100.0), 1e-3);
    std::fs::remove_file(&prj).unwrap();
    let error = made(&path, None).err().unwrap().to_string();
    assert!(
        error
            .contains("reference system: found none, expected one that can be placed on the globe"),
        "{error}"
    );
}

#[test]
fn a_mesh_whose_place_has_no_axes_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.ply");
    hills(4, false).write(&path);
    // Meridians meet at the pole, and coordinates of UTM are no degrees.
    for (at, crs) in [
        ([9.0, 90.0, 5.0], "EPSG:4326"),
        ([f64::MAX / 1e210, 0.0, 0.0], "EPSG:32631"),
    ] {
        mesh(&path, at, 1e-5, &[]);
        let error = made(&path, Some(crs)).err().unwrap().to_string();
        assert!(
            error.contains("which cannot be placed on the globe"),
            "{error}"
        );
        assert!(!path.with_extension("tiles").exists());
    }
}

/// A text of a system of this kind, with units of plane and heights.
fn text(kind: usize, plane: f64, height: Option<f64>) -> String {
    let flat = match kind {
        0 => format!(
            "PROJCS[\"p\",GEOGCS[\"g\",UNIT[\"degree\",0.0174]],UNIT[\"u\",{plane}],AUTHORITY[\"EPSG\",\"32631\"]]"
        ),
        1 => "GEOGCS[\"g\",UNIT[\"degree\",0.0174],AUTHORITY[\"EPSG\",\"4326\"]]".to_owned(),
        _ => return format!("GEOCCS[\"c\",UNIT[\"u\",{plane}]]"),
    };
    match height {
        Some(unit) => format!(
            "COMPD_CS[\"b\",{flat},VERT_CS[\"v\",VERT_DATUM[\"d\",2005],UNIT[\"u\",{unit}]]]"
        ),
        None => flat,
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    /// Unit of the plane × unit of heights × kind of the system: a known place is met.
    #[test]
    fn places_are_met_in_all_units(
        kind in 0..3usize,
        plane in 0..3usize,
        height in proptest::option::of(0..3usize),
        metres in -400.0..4000.0f64,
        given in any::<bool>(),
    ) {
        let plane = UNITS[plane];
        let height = height.map(|n| UNITS[n]);
        let of_height = height.unwrap_or(if kind == 1 { 1.0 } else { plane });
        let (at, wanted) = match kind {
            0 => ([500_000.0 / plane, 0.0, metres / of_height], on_equator(3.0, metres)),
            1 => ([30.0, 0.0, metres / of_height], on_equator(30.0, metres)),
            _ => ([0.0, 0.0, (POLE + metres) / plane], [0.0, 0.0, POLE + metres]),
        };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mesh.ply");
        mesh(&path, at, if kind == 1 { 1e-4 } else { 10.0 }, &[]);
        let text = text(kind, plane, height);
        if !given {
            std::fs::write(path.with_extension("prj"), &text).unwrap();
        }
        let made = made(&path, given.then_some(&*text)).unwrap();
        made.is_at(at, wanted, 2e-3);
        // Up is up, by as many metres as a unit has.
        let [x, y, z] = at;
        let above = made.place([x, y, z + 10.0]);
        let step = if kind == 2 { plane } else { of_height };
        let risen = (0..3).map(|k| (above[k] - wanted[k]).powi(2)).sum::<f64>().sqrt();
        prop_assert!((risen - 10.0 * step).abs() < 5e-3, "{} of {}", risen, 10.0 * step);
    }
}

#[test]
fn the_unit_of_heights_is_in_the_header_where_no_code_tells_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.ply");
    let at = [500_000.0, 0.0, 100.0];
    for (comments, height) in [
        (&["epsg 32631"][..], 100.0),
        (
            &["epsg 32631", "crs EPSG:32631+6360"],
            100.0 * 1200.0 / 3937.0,
        ),
        (&["epsg 32631", "crs EPSG:32631+5703"], 100.0),
        (
            &["epsg 32631", "crs EPSG:32631", "heightunit 0.3048"],
            30.48,
        ),
    ] {
        mesh(&path, at, 8.0, comments);
        made(&path, None)
            .unwrap()
            .is_at(at, on_equator(3.0, height), 1e-3);
    }
}
