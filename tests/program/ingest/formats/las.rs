//! LAS and LAZ.

use crate::ingest::bench::{Bench, cloud, write_las};
use std::ops::RangeInclusive;
use std::path::PathBuf;

fn make(bench: &Bench, name: &str, minor: u8, format: u8) -> PathBuf {
    let path = bench.path(name);
    write_las(
        &path,
        (1, minor),
        format,
        (0.01, [0.0; 3]),
        &cloud(300, 1),
        false,
    );
    path
}

pub fn all(bench: &Bench, minors: &[u8], formats: RangeInclusive<u8>, kind: &str) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for minor in minors {
        for format in formats.clone() {
            files.push(make(
                bench,
                &format!("1.{minor}-{format}.{kind}"),
                *minor,
                format,
            ));
        }
    }
    files
}

pub fn old_laz(bench: &Bench) -> Vec<PathBuf> {
    let mut files = all(bench, &[0, 1], 0..=1, "laz");
    files.extend(all(bench, &[2], 0..=3, "laz"));
    files.extend(all(bench, &[3], 0..=5, "laz"));
    files
}

/// With the record that makes a file COPC, as far as its points are concerned: they are LAZ.
pub fn copc(bench: &Bench) -> Vec<PathBuf> {
    let path = bench.path("a.copc.laz");
    let mut builder = las::Builder::from((1, 4));
    builder.point_format = las::point::Format::new(6).unwrap();
    builder.vlrs.push(las::Vlr {
        user_id: "copc".into(),
        record_id: 1,
        description: "COPC info VLR".into(),
        data: vec![0; 160],
    });
    write(&path, builder, &[]);
    vec![path]
}

fn write(path: &PathBuf, builder: las::Builder, extra_bytes: &[u8]) {
    let mut writer = las::Writer::from_path(path, builder.into_header().unwrap()).unwrap();
    for i in 0..300 {
        let t = f64::from(i);
        let point = las::Point {
            x: t,
            y: t % 17.0,
            z: t % 5.0,
            gps_time: Some(t),
            extra_bytes: extra_bytes.to_vec(),
            ..Default::default()
        };
        writer.write_point(point).unwrap();
    }
    writer.close().unwrap();
}

pub fn extra_bytes(bench: &Bench) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for kind in ["las", "laz"] {
        for format in [1, 6] {
            let path = bench.path(&format!("{format}.{kind}"));
            let mut builder = las::Builder::from((1, 4));
            builder.point_format = las::point::Format::new(format).unwrap();
            builder.point_format.extra_bytes = 7;
            write(&path, builder, &[1, 2, 3, 4, 5, 6, 7]);
            files.push(path);
        }
    }
    files
}

pub fn misnamed(bench: &Bench) -> Vec<PathBuf> {
    let (las, laz) = (make(bench, "a.las", 2, 1), make(bench, "a.laz", 2, 1));
    let (from, to) = (bench.path("b.laz"), bench.path("b.las"));
    std::fs::rename(las, &from).unwrap();
    std::fs::rename(laz, &to).unwrap();
    vec![from, to]
}

fn data_start(bytes: &[u8]) -> usize {
    u32::from_le_bytes(bytes[96..100].try_into().unwrap()) as usize
}

/// The size of chunks in the laszip record.
fn chunk_size(bytes: &[u8]) -> usize {
    let name = bytes.windows(14).position(|w| w == b"laszip encoded");
    name.unwrap() + 64
}

pub fn no_table(bench: &Bench) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for (format, variable) in [(1, false), (6, false), (6, true)] {
        let path = make(bench, &format!("{format}-{variable}.laz"), 4, format);
        let mut bytes = std::fs::read(&path).unwrap();
        let data = data_start(&bytes);
        bytes[data..data + 8].copy_from_slice(&(-1i64).to_le_bytes());
        // Nor is it at the end of the file.
        bytes.extend((-1i64).to_le_bytes());
        if variable {
            let at = chunk_size(&bytes);
            bytes[at..at + 4].copy_from_slice(&u32::MAX.to_le_bytes());
        }
        files.push(bench.write(path.file_name().unwrap().to_str().unwrap(), bytes));
    }
    files
}

/// A LAS file with these bytes at these offsets.
pub fn patched(bench: &Bench, patches: &[(usize, &[u8])]) -> Vec<PathBuf> {
    let mut bytes = std::fs::read(make(bench, "good.las", 2, 0)).unwrap();
    for (at, patch) in patches {
        bytes[*at..at + patch.len()].copy_from_slice(patch);
    }
    let name = format!(
        "patched-{}.las",
        patches[0].0 + usize::from(patches[0].1[0])
    );
    vec![bench.write(&name, bytes)]
}

pub fn boxes(bench: &Bench) -> Vec<PathBuf> {
    let nan = [f64::NAN.to_le_bytes(); 6].concat();
    let zero = vec![0; 48];
    let inverted = [1e9f64.to_le_bytes(), (-1e9f64).to_le_bytes()].concat();
    let all = [nan, zero, inverted];
    all.iter()
        .flat_map(|bytes| patched(bench, &[(179, bytes)]))
        .collect()
}

pub fn trailing(bench: &Bench) -> Vec<PathBuf> {
    let mut bytes = std::fs::read(make(bench, "a.las", 2, 0)).unwrap();
    // Not a multiple of the size of a record.
    bytes.extend([7; 1001]);
    vec![bench.write("b.las", bytes)]
}

pub fn withheld(bench: &Bench) -> Vec<PathBuf> {
    let path = bench.path("a.laz");
    write_las(&path, (1, 4), 6, (0.01, [0.0; 3]), &cloud(300, 1), true);
    vec![path]
}

pub fn none(bench: &Bench) -> Vec<PathBuf> {
    let path = |name| bench.path(name);
    let files = vec![path("a.las"), path("b.laz"), path("c.laz")];
    for (file, format) in files.iter().zip([0, 3, 6]) {
        write_las(file, (1, 4), format, (0.01, [0.0; 3]), &[], false);
    }
    files
}

pub fn too_many(bench: &Bench) -> Vec<PathBuf> {
    let mut files = patched(bench, &[(107, &[0, 0, 1, 0])]);
    let mut bytes = std::fs::read(make(bench, "b.laz", 2, 0)).unwrap();
    bytes[107..111].copy_from_slice(&1_000_000u32.to_le_bytes());
    files.push(bench.write("b.laz", bytes));
    files
}

pub fn cut(bench: &Bench, kind: &str, percents: &[usize]) -> Vec<PathBuf> {
    let bytes = std::fs::read(make(bench, &format!("good.{kind}"), 2, 1)).unwrap();
    let cut = |percent: &usize| {
        let part = &bytes[..bytes.len() * percent / 100];
        bench.write(&format!("{percent}.{kind}"), part)
    };
    percents.iter().map(cut).collect()
}

pub fn short_header(bench: &Bench) -> Vec<PathBuf> {
    let bytes = std::fs::read(make(bench, "good.las", 2, 1)).unwrap();
    vec![
        bench.write("a.las", &bytes[..200]),
        bench.write("b.laz", "LASF"),
    ]
}

pub fn no_record(bench: &Bench) -> Vec<PathBuf> {
    let mut bytes = std::fs::read(make(bench, "a.laz", 2, 1)).unwrap();
    let at = bytes
        .windows(14)
        .position(|w| w == b"laszip encoded")
        .unwrap();
    bytes[at] = b'L';
    vec![bench.write("a.laz", bytes)]
}

pub fn variable_without_table(bench: &Bench) -> Vec<PathBuf> {
    let mut bytes = std::fs::read(make(bench, "a.laz", 2, 1)).unwrap();
    let data = data_start(&bytes);
    bytes[data..data + 8].copy_from_slice(&(-1i64).to_le_bytes());
    bytes.extend((-1i64).to_le_bytes());
    let at = chunk_size(&bytes);
    bytes[at..at + 4].copy_from_slice(&u32::MAX.to_le_bytes());
    vec![bench.write("a.laz", bytes)]
}

pub fn bomb(bench: &Bench) -> Vec<PathBuf> {
    let mut bytes = std::fs::read(make(bench, "a.laz", 2, 1)).unwrap();
    bytes[107..111].copy_from_slice(&u32::MAX.to_le_bytes());
    vec![bench.write("a.laz", bytes)]
}
