//! Generated files of every kind, read back as lattice positions.

mod belong;
mod bench;
mod bombs;
mod classes;
mod color_scales;
mod columns;
mod damage;
mod far;
mod folders;
mod formats;
mod lattices;
mod normals;
mod numbers;
mod ply_comments;
mod ply_headers;
mod point_tiles;
mod recipe;
mod regions;
mod scan_columns;
mod scans;
mod server;
mod systems;
mod text_columns;
mod text_grammar;
mod urls;

use bench::{Bench, based, cloud, ply, positions, write_las};
use outcrop::Error;
use outcrop_formats::{expand, probe};
use outcrop_points::{CoordinateType, Format};
use std::fmt::Write as _;
use std::path::PathBuf;

#[test]
fn reads_every_version_and_point_format() {
    let bench = Bench::new();
    let points = cloud(1234, 1);
    for (minor, formats) in [(0, 0..=1), (1, 0..=1), (2, 0..=3), (3, 0..=5), (4, 0..=10)] {
        for format in formats {
            for kind in ["las", "laz"] {
                let path = bench.path(&format!("v{minor}-{format}.{kind}"));
                let grid = (0.001, [4e5, 5e6, 0.0]);
                write_las(&path, (1, minor), format, grid, &points, false);
                let spool = bench.read(std::slice::from_ref(&path)).unwrap();
                let lattice = spool.choose_lattice(0).unwrap();
                assert!(lattice.exact && lattice.step == 0.001, "{path:?}");
                assert_eq!(lattice.offset, [4e5, 5e6, 0.0]);
                assert_eq!(
                    positions(&bench, &spool, &lattice),
                    based(&points),
                    "{path:?}"
                );
                let seen = probe(&path).unwrap();
                assert_eq!(seen.points_claimed, Some(1234));
                assert_eq!(seen.format == Format::LAZ, kind == "laz");
                assert_eq!(seen.point_format, Some(format));
            }
        }
    }
}

#[test]
fn reads_many_chunks_with_and_without_a_chunk_table() {
    let bench = Bench::new();
    let points = cloud(120_000, 2);
    for format in [1, 6] {
        let path = bench.path(&format!("chunks-{format}.laz"));
        write_las(&path, (1, 4), format, (0.01, [0.0; 3]), &points, true);
        let check = |path: PathBuf| {
            let spool = bench.read(&[path]).unwrap();
            assert_eq!(spool.stats().withheld, 1200);
            assert_eq!(spool.points(), 118_800);
            let kept: Vec<_> = (0..points.len()).filter(|i| i % 100 != 0).collect();
            let kept: Vec<_> = kept.into_iter().map(|i| points[i]).collect();
            let lattice = spool.choose_lattice(0).unwrap();
            assert_eq!(positions(&bench, &spool, &lattice), based(&kept));
        };
        check(path.clone());
        let mut bytes = std::fs::read(&path).unwrap();
        let data = u32::from_le_bytes(bytes[96..100].try_into().unwrap()) as usize;
        bytes[data..data + 8].copy_from_slice(&(-1i64).to_le_bytes());
        check(bench.write("streamed.laz", &bytes));
        // Chunks of different sizes: layered ones have their length, the others do not.
        let name = bytes
            .windows(14)
            .position(|w| w == b"laszip encoded")
            .unwrap();
        bytes[name + 64..name + 68].copy_from_slice(&u32::MAX.to_le_bytes());
        let path = bench.write("variable.laz", &bytes);
        if format == 6 {
            check(path);
        } else {
            let error = bench.error(path);
            assert!(error.contains("no chunk table"), "{error}");
        }
    }
}

#[test]
fn reads_every_kind_of_ply() {
    let bench = Bench::new();
    let points: Vec<[f64; 3]> = cloud(3000, 8).iter().map(|p| p.map(f64::from)).collect();
    let mut seen = Vec::new();
    for body in ["ascii", "binary_little_endian", "binary_big_endian"] {
        for kind in ["float", "double", "int"] {
            for list in [false, true] {
                let path = bench.write("a.ply", ply(body, kind, list, &points));
                let spool = bench.read(&[path]).unwrap();
                let lattice = spool.choose_lattice(0).unwrap();
                assert_eq!(
                    (lattice.step, lattice.exact),
                    (1.0, true),
                    "{body} {kind} {list}"
                );
                seen.push(positions(&bench, &spool, &lattice));
                assert_eq!(spool.source_precision(), CoordinateType::F32);
            }
        }
    }
    assert!(seen.iter().all(|s| *s == based(&cloud(3000, 8))));
}

#[test]
fn reads_text_of_many_slabs_and_finds_the_line_that_is_wrong() {
    let bench = Bench::new();
    let points = cloud(200_000, 9);
    for end in ["\n", "\r\n", "\r"] {
        let mut text = String::from("# a note\nX Y Z Intensity\n").replace('\n', end);
        for [x, y, z] in &points {
            let [x, y, z] = [x, y, z].map(|c| f64::from(*c) / 1000.0);
            write!(text, "{x:.3} {y:.3} {z:.3} 7{end}").unwrap();
        }
        let path = bench.write("a.txt", &text);
        let spool = bench.read(&[path]).unwrap();
        let lattice = spool.choose_lattice(0).unwrap();
        assert_eq!((lattice.step, lattice.exact), (0.001, true));
        assert_eq!(positions(&bench, &spool, &lattice), based(&points));
        let cut = text.trim_end().len() - 14;
        let error = bench.error(bench.write("b.txt", &text[..cut]));
        assert!(error.contains("line 200002"), "{error}");
    }
}

#[test]
fn folders_are_searched_by_content() {
    let bench = Bench::new();
    std::fs::create_dir_all(bench.path("in/deep")).unwrap();
    let b = bench.write("in/deep/b.xyz", "1 2 3\n");
    let a = bench.write("in/a.ply", "1 2 3\n4 5 6\n");
    bench.write("in/readme.txt", "Not a point to be seen.\n");
    bench.write("in/.hidden.xyz", "1 2 3\n");
    bench.write("in/table.json", "1 2 3\n");
    assert_eq!(expand(&[bench.path("in")]).unwrap(), [a, b]);
    let spool = bench.read(&[bench.path("in")]).unwrap();
    assert_eq!((spool.points(), spool.stats().files.len()), (3, 2));
    assert_eq!(spool.stats().files[0].format, Format::TEXT);
    std::fs::create_dir(bench.path("empty")).unwrap();
    assert!(bench.error(bench.path("empty")).contains("no point file"));
    assert!(matches!(
        bench.read(&[bench.path("absent")]),
        Err(Error::Io { .. })
    ));
}

/// Run with `cargo test --release --test ingest -- --ignored --nocapture`.
#[test]
#[ignore = "takes long without optimisation"]
fn reads_a_large_scan() {
    let Some(path) = crate::skip::if_present("../shared/data/scans/autzen.laz") else {
        return;
    };
    let bench = Bench::new();
    let start = std::time::Instant::now();
    let spool = bench.read(&[path]).unwrap();
    let read = start.elapsed();
    let lattice = spool.choose_lattice(0).unwrap();
    spool
        .for_each(&bench.workspace, &lattice, |_| Ok(()))
        .unwrap();
    println!(
        "{} points: decoded in {read:.2?}, streamed in {:.2?}, at most {} MiB resident; {lattice:?}",
        spool.points(),
        start.elapsed() - read,
        outcrop_disk::workspace::limits::peak_resident() >> 20
    );
    assert_eq!(spool.points(), 10_653_336);
}
