//! Reference systems of files: where they stand, their kinds, and their units.

use crate::ingest::bench::Bench;
use outcrop_points::{Crs, CrsKind, CrsSource};
use proptest::prelude::*;
use std::path::Path;

/// A record of a LAS file: the user, the number, the content.
type Record<'a> = (&'a str, u16, Vec<u8>);

/// A LAS file with these records, also behind the points.
fn las(path: &Path, minor: u8, records: &[Record<'_>], extended: &[Record<'_>]) {
    let vlr = |(user, record_id, data): &Record<'_>| las::Vlr {
        user_id: (*user).into(),
        record_id: *record_id,
        description: String::new(),
        data: data.clone(),
    };
    let mut builder = las::Builder::from((1, minor));
    builder.vlrs = records.iter().map(vlr).collect();
    builder.evlrs = extended.iter().map(vlr).collect();
    let mut writer = las::Writer::from_path(path, builder.into_header().unwrap()).unwrap();
    for i in 0..9 {
        let [x, y] = [i % 3, i / 3].map(f64::from);
        let point = las::Point {
            x,
            y,
            ..Default::default()
        };
        writer.write_point(point).unwrap();
    }
    writer.close().unwrap();
}

fn crs(bench: &Bench, minor: u8, records: &[Record<'_>], extended: &[Record<'_>]) -> Option<Crs> {
    let path = bench.path("a.las");
    las(&path, minor, records, extended);
    bench.read(&[path]).unwrap().stats().crs.clone()
}

/// GeoTIFF keys, with texts where the place is 34737.
fn keys(entries: &[[u16; 4]], texts: &str) -> Vec<Record<'static>> {
    let words = [[1, 1, 0, entries.len() as u16]];
    let words = words.iter().chain(entries).flatten();
    let directory = words.flat_map(|word| word.to_le_bytes()).collect();
    vec![
        ("LASF_Projection", 34735, directory),
        ("LASF_Projection", 34737, texts.as_bytes().to_vec()),
    ]
}

fn utm(code: u32) -> Vec<u8> {
    format!("PROJCS[\"a\",GEOGCS[\"b\"],UNIT[\"metre\",1],AUTHORITY[\"EPSG\",\"{code}\"]]\0")
        .into_bytes()
}

#[test]
fn the_text_of_liblas_is_a_system() {
    let bench = Bench::new();
    for user in ["liblas", "LibLAS"] {
        let found = crs(&bench, 2, &[(user, 2112, utm(25832))], &[]).unwrap();
        assert_eq!(
            (found.horizontal, found.source),
            (Some(25832), CrsSource::WellKnownText)
        );
    }
    // Behind the points, and beside keys, as the library writes it.
    let found = crs(&bench, 4, &[], &[("liblas", 2112, utm(32633))]).unwrap();
    assert_eq!(found.horizontal, Some(32633));
    let mut both = keys(&[[1024, 0, 1, 1], [3072, 0, 1, 25832]], "");
    both.push(("liblas", 2112, utm(25832)));
    let found = crs(&bench, 2, &both, &[]).unwrap();
    assert_eq!(
        (found.horizontal, found.source),
        (Some(25832), CrsSource::WellKnownText)
    );
    // The record of the standard goes before it; an empty one does not.
    let standard = ("LASF_Projection", 2112, utm(26917));
    let found = crs(&bench, 4, &[standard, ("liblas", 2112, utm(25832))], &[]).unwrap();
    assert_eq!(found.horizontal, Some(26917));
    let empty = ("LASF_Projection", 2112, vec![0; 9]);
    let found = crs(&bench, 4, &[empty, ("liblas", 2112, utm(25832))], &[]).unwrap();
    assert_eq!(found.horizontal, Some(25832));
    // Other records of that user, and of others, are none.
    assert_eq!(
        crs(
            &bench,
            2,
            &[("liblas", 7, utm(25832)), ("copc", 2112, utm(25832))],
            &[]
        ),
        None
    );
}

#[test]
fn a_text_in_a_citation_is_a_system() {
    let bench = Bench::new();
    let text =
        "ESRI PE String = PROJCS[\"site\",GEOGCS[\"b\"],UNIT[\"Foot_US\",0.3048006096012192]]|";
    let entries = [
        [1024, 0, 1, 1],
        [3072, 0, 1, 32767],
        [3073, 34737, text.len() as u16, 0],
    ];
    let found = crs(&bench, 2, &keys(&entries, text), &[]).unwrap();
    assert_eq!(
        (found.name.as_str(), found.unit),
        ("site", Some(0.304_800_609_601_219_2))
    );
    // With a code, that counts.
    let entries = [
        [1024, 0, 1, 1],
        [3072, 0, 1, 2994],
        [3073, 34737, text.len() as u16, 0],
    ];
    let found = crs(&bench, 2, &keys(&entries, text), &[]).unwrap();
    assert_eq!(
        (found.horizontal, found.source),
        (Some(2994), CrsSource::GeotiffKeys)
    );
}

/// Units of length: metres in them, their names, their EPSG codes.
const UNITS: [(f64, &str, u16); 3] = [
    (1.0, "metre", 9001),
    (0.3048, "foot", 9002),
    (1200.0 / 3937.0, "US survey foot", 9003),
];

/// The kinds of a plane.
const KINDS: [CrsKind; 3] = [CrsKind::Projected, CrsKind::Geographic, CrsKind::Geocentric];

/// A system without codes as text of version 1.
fn version_1(kind: CrsKind, plane: usize, height: Option<usize>) -> String {
    let unit = |n: usize| {
        let (metres, name, code) = UNITS[n];
        format!("UNIT[\"{name}\",{metres},AUTHORITY[\"EPSG\",\"{code}\"]]")
    };
    let globe = "DATUM[\"d\",SPHEROID[\"s\",6378137,298.2]],PRIMEM[\"Greenwich\",0]";
    let angle = "UNIT[\"degree\",0.0174532925199433]";
    let flat = match kind {
        CrsKind::Projected => format!(
            "PROJCS[\"p\",GEOGCS[\"g\",{globe},{angle}],PROJECTION[\"m\"],PARAMETER[\"false_easting\",5],{},\
             AXIS[\"E\",EAST]]",
            unit(plane)
        ),
        CrsKind::Geographic => format!("GEOGCS[\"g\",{globe},{angle}]"),
        _ => return format!("GEOCCS[\"c\",{globe},{},AXIS[\"X\",OTHER]]", unit(plane)),
    };
    match height {
        Some(height) => format!(
            "COMPD_CS[\"both\",{flat},VERT_CS[\"v\",VERT_DATUM[\"d\",2005],{},AXIS[\"h\",UP]]]",
            unit(height)
        ),
        None => flat,
    }
}

/// The same of version 2, with units in the axes or behind them.
fn version_2(kind: CrsKind, plane: usize, height: Option<usize>, in_axes: bool) -> String {
    let unit = |n: usize| format!("LENGTHUNIT[\"{}\",{}]", UNITS[n].1, UNITS[n].0);
    let angle = "ANGLEUNIT[\"degree\",0.0174532925199433]".to_owned();
    let axes = |names: &[(&str, &str)], unit: &str| {
        let axis = |(name, to): &(&str, &str)| match in_axes {
            true => format!("AXIS[\"{name}\",{to},ORDER[1],{unit}]"),
            false => format!("AXIS[\"{name}\",{to}]"),
        };
        let mut parts: Vec<String> = names.iter().map(axis).collect();
        parts.extend((!in_axes).then(|| unit.to_owned()));
        parts.join(",")
    };
    let globe = "DATUM[\"d\",ELLIPSOID[\"e\",6378137,298.2,LENGTHUNIT[\"metre\",1]]]";
    let level = [("e", "east"), ("n", "north")];
    let flat = match kind {
        CrsKind::Projected => format!(
            "PROJCRS[\"p\",BASEGEOGCRS[\"g\",{globe}],CONVERSION[\"c\",METHOD[\"m\"],PARAMETER[\"f\",5,\
             LENGTHUNIT[\"kilometre\",1000]]],CS[Cartesian,2],{}]",
            axes(&level, &unit(plane))
        ),
        CrsKind::Geographic => format!(
            "GEODCRS[\"g\",{globe},CS[ellipsoidal,2],{}]",
            axes(&level, &angle)
        ),
        _ => {
            let names = [
                ("x", "geocentricX"),
                ("y", "geocentricY"),
                ("z", "geocentricZ"),
            ];
            return format!(
                "GEODCRS[\"c\",{globe},CS[Cartesian,3],{}]",
                axes(&names, &unit(plane))
            );
        }
    };
    match height {
        Some(height) => format!(
            "COMPOUNDCRS[\"both\",{flat},VERTCRS[\"v\",VDATUM[\"d\"],CS[vertical,1],{}]]",
            axes(&[("h", "up")], &unit(height))
        ),
        None => flat,
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 128, failure_persistence: None, ..ProptestConfig::default() })]

    /// Unit of the plane × unit of heights × kind of the plane, told by each kind of record.
    #[test]
    fn units_of_plane_and_heights_are_told_apart(
        kind in 0..3usize,
        plane in 0..3usize,
        height in proptest::option::of(0..3usize),
        record in 0..4usize,
        spaced in any::<bool>(),
    ) {
        let kind = KINDS[kind];
        let height = height.filter(|_| kind != CrsKind::Geocentric);
        let bench = Bench::new();
        let text = |text: String| {
            let text = if spaced { text.replace(',', ",\n  ") } else { text };
            vec![("LASF_Projection", 2112, text.into_bytes())]
        };
        let records = match record {
            0 => text(version_1(kind, plane, height)),
            1 => text(version_2(kind, plane, height, false)),
            2 => text(version_2(kind, plane, height, true)),
            _ => {
                let model = match kind {
                    CrsKind::Projected => 1,
                    CrsKind::Geographic => 2,
                    _ => 3,
                };
                let mut entries = vec![[1024, 0, 1, model], [3076, 0, 1, UNITS[plane].2]];
                entries.extend(height.map(|height| [4099, 0, 1, UNITS[height].2]));
                keys(&entries, "")
            }
        };
        let found = crs(&bench, 4, &records, &[]).unwrap();
        prop_assert_eq!(found.kind, Some(kind));
        let unit = (kind != CrsKind::Geographic).then_some(UNITS[plane].0);
        prop_assert_eq!(found.unit, unit);
        prop_assert_eq!(found.height_unit, height.map(|height| UNITS[height].0));
        let usual = unit.unwrap_or(1.0);
        prop_assert_eq!(found.metres_of_heights(), height.map_or(usual, |height| UNITS[height].0));
    }
}
