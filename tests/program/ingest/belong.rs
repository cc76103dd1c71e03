//! Warnings about files that do not belong together.

use crate::ingest::bench::{Bench, cloud, write_las};
use outcrop_disk::error::{Remedy, Setting};
use outcrop_formats::check_systems;
use outcrop_points::CrsSource;
use std::path::{Path, PathBuf};

/// A file with these records of its reference system.
fn with_records(path: &Path, records: &[(u16, Vec<u8>)], extended: bool) {
    let mut builder = las::Builder::from((1, 4));
    builder.point_format = las::point::Format::new(6).unwrap();
    let records = records.iter().map(|(record_id, data)| las::Vlr {
        user_id: "LASF_Projection".into(),
        record_id: *record_id,
        description: String::new(),
        data: data.clone(),
    });
    if extended {
        builder.evlrs.extend(records);
    } else {
        builder.vlrs.extend(records);
    }
    let mut writer = las::Writer::from_path(path, builder.into_header().unwrap()).unwrap();
    for i in 0..200 {
        let t = f64::from(i);
        let [x, y, z] = [t % 14.0, t / 14.0, 0.0];
        writer
            .write_point(las::Point {
                x,
                y,
                z,
                gps_time: Some(t),
                ..Default::default()
            })
            .unwrap();
    }
    writer.close().unwrap();
}

/// The keys of a projected system.
fn keys(code: u16) -> Vec<(u16, Vec<u8>)> {
    let words = [1u16, 1, 0, 2, 1024, 0, 1, 1, 3072, 0, 1, code];
    vec![(34735, words.map(u16::to_le_bytes).concat())]
}

fn text(code: u16) -> Vec<(u16, Vec<u8>)> {
    let text = format!("PROJCS[\"a\",GEOGCS[\"b\"],AUTHORITY[\"EPSG\",\"{code}\"]]\0");
    vec![(2112, text.into_bytes())]
}

#[test]
fn files_of_two_reference_systems_are_told_apart() {
    let bench = Bench::new();
    let mut number = 0;
    let mut file = |records: &[(u16, Vec<u8>)], extended| {
        number += 1;
        let path = bench.path(&format!("{number}.laz"));
        with_records(&path, records, extended);
        path
    };
    let utm = file(&keys(26917), false);
    let same = [
        file(&keys(26917), false),
        file(&text(26917), false),
        file(&text(26917), true),
        file(&[], false),
    ];
    let other = [
        file(&keys(32617), false),
        file(&text(32617), false),
        file(&text(32617), true),
    ];
    let warnings = |paths: &[PathBuf]| bench.read(paths).unwrap().stats().warnings.clone();
    let plain = bench.write("a.xyz", "1 2 0\n3 4 0\n");
    let mut fine = vec![utm.clone(), plain];
    fine.extend_from_slice(&same);
    let said = warnings(&fine);
    assert_eq!(said.len(), 1, "{said:?}");
    assert!(
        said[0].ends_with(
            "it gives no reference system, as 2 of 6 files; that of the others, EPSG:26917, is \
             taken for all"
        ),
        "{said:?}"
    );
    // The one that tells most, in any order of the files.
    for paths in [fine.clone(), fine.iter().rev().cloned().collect()] {
        let spool = bench.read(&paths).unwrap();
        let crs = spool.stats().crs.clone().unwrap();
        assert_eq!((crs.name.as_str(), crs.horizontal), ("a", Some(26917)));
        assert!(spool.wkt().unwrap().starts_with("PROJCS[\"a\""));
        assert_eq!(check_systems(&paths).map_err(|e| e.to_string()), Ok(()));
    }
    for other in other {
        let mut files = fine.clone();
        files.push(other.clone());
        let said = warnings(&files);
        let expected = format!(
            "{}: its reference system is EPSG:32617, that of {} is EPSG:26917;",
            other.display(),
            utm.display()
        );
        assert!(
            said.len() == 1 && said[0].starts_with(&expected),
            "{said:?}"
        );
        let stats = bench.read(&files).unwrap().stats().clone();
        assert_eq!(stats.crs, None);
        let refused = format!(
            "{}: reference system: found EPSG:32617, expected EPSG:26917, that of {}",
            other.display(),
            utm.display()
        );
        let error = stats.mixed.unwrap().refused();
        assert_eq!(error.to_string(), refused);
        let ignored = Remedy::Give(Setting::Flag("ignore_crs"), "takes coordinates as they are");
        assert_eq!(error.remedies(), [ignored]);
        assert_eq!(check_systems(&files).unwrap_err().to_string(), refused);
    }
}

#[test]
fn a_file_beside_may_give_the_system() {
    let bench = Bench::new();
    let cloud = bench.write("a.xyz", "1 2 0\n3 4 0\n");
    let las = bench.path("b.laz");
    with_records(&las, &keys(26917), false);
    let text = |code| String::from_utf8(text(code).swap_remove(0).1).unwrap();
    bench.write("a.prj", text(26917).trim_end_matches('\0'));
    // What a file says itself counts more.
    bench.write("b.prj", text(32617).trim_end_matches('\0'));
    let stats = bench
        .read(&[cloud.clone(), las.clone()])
        .unwrap()
        .stats()
        .clone();
    assert_eq!(stats.warnings.len(), 1, "{:?}", stats.warnings);
    assert!(
        stats.warnings[0].contains("b.prj: it gives EPSG:32617, but "),
        "{:?}",
        stats.warnings
    );
    let sources: Vec<_> = stats
        .files
        .iter()
        .map(|f| f.crs.as_ref().unwrap().source)
        .collect();
    assert_eq!(sources, [CrsSource::Prj, CrsSource::GeotiffKeys]);
    assert_eq!(stats.crs.unwrap().source, CrsSource::Prj);
    bench.write("a.prj", text(32617));
    assert!(check_systems(&[cloud.clone(), las]).is_err());
    for (content, why) in [
        ("Projection UTM".to_owned(), "it is no well-known text"),
        (
            format!("A[\"{}\"]", "b".repeat(1 << 20)),
            "it is longer than 1 MiB",
        ),
    ] {
        bench.write("a.prj", content);
        let stats = bench
            .read(std::slice::from_ref(&cloud))
            .unwrap()
            .stats()
            .clone();
        let said = format!("a.prj: {why}, no reference system is taken from it");
        assert!(stats.warnings[0].ends_with(&said), "{:?}", stats.warnings);
        assert_eq!(stats.crs, None);
    }
}

#[test]
fn files_in_two_units_or_places_are_told_apart() {
    let bench = Bench::new();
    let write = |name: &str, scale: f64, offset: f64| {
        let path = bench.path(name);
        write_las(
            &path,
            (1, 2),
            0,
            (scale, [offset, 0.0, 0.0]),
            &cloud(2000, 3),
            false,
        );
        path
    };
    let metres = write("metres.las", 0.001, 0.0);
    let beside = write("beside.las", 0.001, 200.0);
    let millimetres = write("millimetres.las", 1.0, 0.0);
    let elsewhere = write("elsewhere.las", 0.001, 5e6);
    let warnings = |paths: &[&PathBuf]| {
        let paths: Vec<PathBuf> = paths.iter().map(|p| (*p).clone()).collect();
        bench.read(&paths).unwrap().stats().warnings.clone()
    };
    assert_eq!(warnings(&[&metres, &beside]), [""; 0]);
    let said = warnings(&[&metres, &beside, &millimetres]);
    assert!(
        said.len() == 1 && said[0].contains("are they in the same unit?"),
        "{said:?}"
    );
    assert!(
        said[0].contains("millimetres.las: it is 1000 times as large as"),
        "{said:?}"
    );
    let said = warnings(&[&elsewhere, &metres, &beside]);
    assert!(
        said.len() == 1 && said[0].contains("do they belong together?"),
        "{said:?}"
    );
    assert!(
        said[0].contains("elsewhere.las") && said[0].contains("beside.las"),
        "{said:?}"
    );
}

#[test]
fn texts_of_different_kinds_are_not_compared() {
    let bench = Bench::new();
    let keys = bench.path("keys.laz");
    // A system described by other keys, with a name only.
    let words = [1u16, 1, 0, 2, 1024, 0, 1, 1, 3072, 0, 1, 32767];
    with_records(
        &keys,
        &[(34735, words.map(u16::to_le_bytes).concat())],
        false,
    );
    let files = ["PROJCS[\"a\"]", "PROJCRS[\"a\"]"].map(|text| {
        let name = text[..7].trim_end_matches('[');
        bench.write(&format!("{name}.prj"), text);
        bench.write(&format!("{name}.xyz"), "1 2 0\n3 4 0\n")
    });
    let all = [vec![keys], files.to_vec()].concat();
    assert_eq!(check_systems(&all).map_err(|e| e.to_string()), Ok(()));
    assert_eq!(bench.read(&all).unwrap().wkt(), Some("PROJCRS[\"a\"]"));
    bench.write("PROJCS.prj", "PROJCRS[\"b\"]");
    assert!(check_systems(&all).is_err());
}
