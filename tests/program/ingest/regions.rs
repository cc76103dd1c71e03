//! Points of a region: what is read, and what is not even decoded.

use crate::ingest::bench::{Bench, cloud, write_las};
use laz::{LasZipCompressor, LazItemRecordBuilder, LazVlrBuilder};
use outcrop::Region;
use outcrop_formats::{ingest, ingest_selected};
use outcrop_points::{Classes, Crop, Selection, Spool};
use std::io::{Cursor, Seek, SeekFrom};
use std::path::PathBuf;

pub fn within(region: &str, margin: f64) -> Selection {
    let region: Region = region.parse().unwrap();
    Selection {
        classes: Classes::All,
        crop: Some(Crop { region, margin }),
        ..Selection::default()
    }
}

/// All points in the cloud's unit, by the bits of their coordinates, sorted.
pub fn points(bench: &Bench, spool: &Spool) -> Vec<[u64; 3]> {
    let lattice = spool.choose_lattice(0).unwrap();
    let mut all = Vec::new();
    let add = |points: &[[i32; 3]]| {
        all.extend(
            points
                .iter()
                .map(|p| lattice.position(*p).map(f64::to_bits)),
        );
        Ok(())
    };
    spool.for_each(&bench.workspace, &lattice, add).unwrap();
    all.sort_unstable();
    all
}

/// Reads a region, and checks that it is what is inside of all points, on the lattice of all points.
pub fn check(bench: &Bench, inputs: &[PathBuf], region: &str, margin: f64) -> Spool {
    let selection = within(region, margin);
    let some = ingest_selected(inputs, &selection, &bench.workspace).unwrap();
    let all = ingest(inputs, &bench.workspace).unwrap();
    let crop = selection.crop.unwrap();
    let area = crop.region.area();
    let near = |p: &[u64; 3]| area.is_near(p.map(f64::from_bits), margin);
    let expected: Vec<_> = points(bench, &all).into_iter().filter(near).collect();
    assert!(points(bench, &some) == expected, "{region}");
    let stats = some.stats();
    assert_eq!(stats.kept, expected.len() as u64);
    assert_eq!(stats.read, stats.kept + stats.dropped_by_crop);
    assert_eq!(stats.read + stats.skipped_by_crop, all.stats().read);
    let (ours, whole) = (
        some.choose_lattice(3).unwrap(),
        all.choose_lattice(3).unwrap(),
    );
    assert_eq!((ours.step, ours.offset), (whole.step, whole.offset));
    // The box in a header may be looser by a step of the file, which is eight of the lattice.
    for (ours, whole) in ours.base.iter().zip(whole.base) {
        assert!((whole - 8..=whole).contains(ours), "{ours} {whole}");
    }
    assert_eq!(some.source_precision(), all.source_precision());
    some
}

#[test]
fn every_format_gives_the_points_of_a_region_on_the_lattice_of_the_whole() {
    let bench = Bench::new();
    let ints = cloud(3000, 4);
    let floats: Vec<[f64; 3]> = ints
        .iter()
        .map(|p| p.map(|c| f64::from(c) / 64.0))
        .collect();
    let grid = (0.01, [100.0, -20.0, 0.5]);
    for name in ["a.las", "a.laz"] {
        write_las(&bench.path(name), (1, 2), 1, grid, &ints, false);
    }
    write_las(&bench.path("b.laz"), (1, 4), 6, grid, &ints, false);
    let lines = floats.iter().map(|[x, y, z]| format!("{x} {y} {z}\n"));
    bench.write("a.xyz", lines.collect::<String>());
    bench.write(
        "a.ply",
        crate::ingest::bench::ply("binary_little_endian", "float", false, &floats),
    );
    for name in ["a.las", "a.laz", "b.laz", "a.xyz", "a.ply"] {
        for region in [
            "300,200,900,1000",
            "300,200,10,900,1000,120",
            "POLYGON((300 0, 1500 300, 200 1700), (500 500, 600 500, 500 600))",
        ] {
            for margin in [0.0, 31.5] {
                let spool = check(&bench, &[bench.path(name)], region, margin);
                assert!(
                    spool.stats().dropped_by_crop > 500 && spool.points() > 20,
                    "{name}"
                );
            }
        }
    }
}

#[test]
fn files_outside_are_not_read_unless_their_header_is_wrong() {
    let bench = Bench::new();
    let moved = |by: i32| -> Vec<[i32; 3]> {
        cloud(2000, 7)
            .iter()
            .map(|p| [p[0] + by, p[1], p[2]])
            .collect()
    };
    for (kind, format) in [("las", 0), ("laz", 1), ("laz", 6)] {
        let path = |name: &str| bench.path(&format!("{name}.{kind}"));
        let files = [path("near"), path("far")];
        for (file, by) in files.iter().zip([0, 5_000_000]) {
            write_las(file, (1, 4), format, (0.01, [0.0; 3]), &moved(by), false);
        }
        let spool = check(&bench, &files, "100,100,900,900", 10.0);
        let stats = spool.stats();
        assert_eq!((stats.skipped_by_crop, stats.read), (2000, 2000), "{kind}");
        assert_eq!(stats.files[1].kept + stats.files[1].points, 0);
        // A box that has none of the points, one with no numbers, one that is inverted.
        let nan = [f64::NAN.to_le_bytes(); 6].concat();
        let elsewhere = [9e4f64, 8e4, 9e4, 8e4, 9e4, 8e4]
            .map(f64::to_le_bytes)
            .concat();
        let inverted = [8e4f64, 9e4, 8e4, 9e4, 8e4, 9e4]
            .map(f64::to_le_bytes)
            .concat();
        let good = std::fs::read(&files[0]).unwrap();
        for bounds in [nan, elsewhere, inverted] {
            let mut bytes = good.clone();
            bytes[179..227].copy_from_slice(&bounds);
            std::fs::write(&files[1], bytes).unwrap();
            let spool = check(&bench, &files, "100,100,900,900", 10.0);
            assert_eq!(spool.stats().skipped_by_crop, 0);
        }
    }
}

/// Points of the nodes of a COPC file: the root, and one in each quarter.
fn nodes() -> Vec<([i32; 4], Vec<[i32; 3]>)> {
    let of = |key: [i32; 4], seed| {
        let side = 1024 >> key[0];
        let at = |p: [i32; 3]| std::array::from_fn(|k| key[k + 1] * side + p[k].rem_euclid(side));
        (key, cloud(400, seed).into_iter().map(at).collect())
    };
    let quarters = (0..4).map(|n| of([1, n % 2, n / 2, 0], 11 + n as u64));
    std::iter::once(of([0; 4], 3)).chain(quarters).collect()
}

/// A COPC file, its hierarchy in two pages; `damage` changes the hierarchy.
pub fn copc(damage: impl Fn(&mut Vec<u8>)) -> Vec<u8> {
    let items = LazItemRecordBuilder::default_for_point_format_id(6, 0).unwrap();
    let laszip = LazVlrBuilder::new(items).with_variable_chunk_size().build();
    let mut record = Vec::new();
    laszip.write_to(&mut record).unwrap();
    let vlr = |user: &[u8], id: u16, data: &[u8]| {
        let mut bytes = vec![0; 54];
        bytes[2..2 + user.len()].copy_from_slice(user);
        bytes[18..20].copy_from_slice(&id.to_le_bytes());
        bytes[20..22].copy_from_slice(&(data.len() as u16).to_le_bytes());
        bytes.extend(data);
        bytes
    };
    let nodes = nodes();
    let points: usize = nodes.iter().map(|(_, points)| points.len()).sum();
    let mut file = vec![0; 375];
    file[..4].copy_from_slice(b"LASF");
    file[24..26].copy_from_slice(&[1, 4]);
    file[94..96].copy_from_slice(&375u16.to_le_bytes());
    file[100..104].copy_from_slice(&2u32.to_le_bytes());
    file[104] = 0x86;
    file[105..107].copy_from_slice(&30u16.to_le_bytes());
    file[247..255].copy_from_slice(&(points as u64).to_le_bytes());
    let every = || nodes.iter().flat_map(|(_, points)| points);
    for axis in 0..3 {
        file[131 + 8 * axis..][..8].copy_from_slice(&0.5f64.to_le_bytes());
        let ends = [
            every().map(|p| p[axis]).max(),
            every().map(|p| p[axis]).min(),
        ];
        for (n, end) in ends.into_iter().enumerate() {
            let end = f64::from(end.unwrap()) * 0.5;
            file[179 + 16 * axis + 8 * n..][..8].copy_from_slice(&end.to_le_bytes());
        }
    }
    let info = file.len() + 54;
    file.extend(vlr(b"copc", 1, &[0; 160]));
    file.extend(vlr(b"laszip encoded", 22204, &record));
    let data = file.len() as u64;
    file[96..100].copy_from_slice(&(data as u32).to_le_bytes());
    let mut out = Cursor::new(file);
    out.seek(SeekFrom::End(0)).unwrap();
    let mut compressor = LasZipCompressor::new(out, laszip).unwrap();
    compressor.reserve_offset_to_chunk_table().unwrap();
    let mut entries = Vec::new();
    for (key, points) in &nodes {
        let start = compressor.get().position();
        for p in points {
            let mut record = [0; 30];
            let words = p.map(i32::to_le_bytes);
            record[..12].copy_from_slice(words.as_flattened());
            compressor.compress_one(&record).unwrap();
        }
        compressor.finish_current_chunk().unwrap();
        let bytes = compressor.get().position() - start;
        let mut entry: Vec<u8> = key.iter().flat_map(|k| k.to_le_bytes()).collect();
        entry.extend(start.to_le_bytes());
        entry.extend((bytes as u32).to_le_bytes());
        entry.extend((points.len() as u32).to_le_bytes());
        entries.push(entry);
    }
    compressor.done().unwrap();
    let mut file = compressor.into_inner().into_inner();
    // The second page has the last two nodes.
    let second = file.len() as u64;
    file.extend(entries[3..].concat());
    let mut root = entries[..3].concat();
    root.extend([1i32, 1, 1, 1].map(i32::to_le_bytes).as_flattened());
    root.extend(second.to_le_bytes());
    root.extend(64u32.to_le_bytes());
    root.extend((-1i32).to_le_bytes());
    damage(&mut root);
    let words = [256.0, 256.0, 256.0, 256.0, 1.0].map(f64::to_bits);
    let place = [file.len() as u64, root.len() as u64];
    for (n, word) in words.into_iter().chain(place).enumerate() {
        file[info + 8 * n..][..8].copy_from_slice(&word.to_le_bytes());
    }
    file.extend(root);
    file
}

#[test]
fn chunks_of_copc_outside_are_not_decoded() {
    let bench = Bench::new();
    let file = [bench.write("a.copc.laz", copc(|_| {}))];
    for (region, margin, skipped) in [
        ("10,10,90,90", 0.0, 3),
        ("10,10,90,90", 160.0, 3),
        ("10,10,90,90", 170.0, 0),
        ("300,10,400,90", 5.0, 3),
        ("10,10,400,90", 5.0, 2),
        ("POLYGON((0 0, 500 10, 500 250, 490 30))", 0.0, 2),
        ("10,10,-9,90,90,1000", 0.0, 3),
    ] {
        let spool = check(&bench, &file, region, margin);
        let stats = spool.stats();
        assert_eq!(stats.skipped_by_crop, 400 * skipped, "{region} {margin}");
        assert!(stats.warnings.is_empty(), "{:?}", stats.warnings);
    }
}

#[test]
fn a_hierarchy_that_cannot_be_is_said_and_all_chunks_are_read() {
    let bench = Bench::new();
    let at = |at: usize, bytes: &'static [u8]| {
        move |root: &mut Vec<u8>| root[at..at + bytes.len()].copy_from_slice(bytes)
    };
    type Damage = Box<dyn Fn(&mut Vec<u8>)>;
    let damages: Vec<(Damage, &str)> = vec![
        (Box::new(at(32, &[200])), "a node with the key"),
        (
            Box::new(at(36, &[0xff, 0xff, 0xff, 0xff])),
            "a node with the key",
        ),
        (Box::new(at(60, &[0xfe, 0xff, 0xff, 0xff])), "points in"),
        (Box::new(at(96 + 16, &[0xff; 8])), "a page of"),
        (Box::new(at(96 + 24, &[63])), "a page of 63 bytes"),
        (
            Box::new(|root: &mut Vec<u8>| root.truncate(100)),
            "a page of 100 bytes",
        ),
        // A node whose points are elsewhere.
        (
            Box::new(|root: &mut Vec<u8>| root.copy_within(32..48, 64)),
            "outside the cubes",
        ),
        (Box::new(at(36, &[1])), "outside the cubes"),
    ];
    for (damage, why) in damages {
        let file = [bench.write("a.copc.laz", copc(damage))];
        let spool = check(&bench, &file, "300,300,400,400", 0.0);
        let stats = spool.stats();
        assert_eq!((stats.skipped_by_crop, stats.read), (0, 2000), "{why}");
        assert!(
            stats.warnings[0].contains(why),
            "{why}: {:?}",
            stats.warnings
        );
        assert!(stats.warnings[0].ends_with("all of its chunks are read"));
    }
    // A page that leads to itself.
    let itself = |root: &mut Vec<u8>| {
        let second = root[96 + 16..96 + 24].to_vec();
        let page = u64::from_le_bytes(second.try_into().unwrap()) + 64;
        root[96 + 16..96 + 24].copy_from_slice(&page.to_le_bytes());
        root[96 + 24..96 + 28].copy_from_slice(&128u32.to_le_bytes());
    };
    let file = [bench.write("a.copc.laz", copc(itself))];
    let spool = check(&bench, &file, "300,300,400,400", 0.0);
    assert!(spool.stats().warnings[0].contains("a page of 128 bytes"));
}
