//! Small files with very large counts in their headers.

use crate::ingest::bench::{Bench, write_las};

/// The file with another number of points in its header, and as chunk size.
fn claiming(bytes: &[u8], points: u32) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    let name = bytes.windows(14).position(|w| w == b"laszip encoded");
    let chunk = name.unwrap() + 64;
    bytes[chunk..chunk + 4].copy_from_slice(&points.to_le_bytes());
    bytes[247..255].copy_from_slice(&u64::from(points).to_le_bytes());
    bytes[107..111].fill(0);
    bytes
}

#[test]
fn points_that_take_no_room_are_read_up_to_a_bound() {
    let bench = Bench::new();
    for format in [0, 6] {
        let path = bench.path("alike.laz");
        let points = vec![[1, 2, 3]; 1_000_000];
        write_las(&path, (1, 4), format, (0.01, [0.0; 3]), &points, false);
        assert_eq!(
            bench.read(std::slice::from_ref(&path)).unwrap().points(),
            1_000_000
        );
        let bytes = std::fs::read(path).unwrap();
        println!(
            "point format {format}: {} bytes a million points that are alike",
            bytes.len()
        );
        for points in [u32::MAX - 1, 500_000_000] {
            let error = bench.error(bench.write("bomb.laz", claiming(&bytes, points)));
            assert!(error.contains(&format!("{points} points in")), "{error}");
            assert!(error.contains("give them as LAS"), "{error}");
        }
        // A wrong count is noticed soon.
        let begin = std::time::Instant::now();
        let error = bench.error(bench.write("lie.laz", claiming(&bytes, 8_000_000)));
        assert!(
            error.contains("LAZ chunk") || error.contains("point count"),
            "{error}"
        );
        assert!(begin.elapsed().as_secs() < 10, "{:?}", begin.elapsed());
    }
}

#[test]
fn rows_of_a_grid_take_few_bytes_and_are_read() {
    let bench = Bench::new();
    let points: Vec<[i32; 3]> = (0..1_000_000).map(|i| [i % 1000, i / 1000, 0]).collect();
    for format in [0, 6] {
        let path = bench.path("grid.laz");
        write_las(&path, (1, 4), format, (0.01, [0.0; 3]), &points, false);
        let bytes = std::fs::metadata(&path).unwrap().len();
        println!(
            "point format {format}: {:.4} bytes a point",
            bytes as f64 / 1e6
        );
        assert_eq!(bench.read(&[path]).unwrap().points(), 1_000_000);
    }
}

#[test]
fn keys_that_all_name_the_same_numbers_take_no_memory() {
    let bench = Bench::new();
    let path = bench.path("keys.las");
    let keys = std::iter::repeat_n([2057u16, 34736, 8190, 0], 8190);
    let words = std::iter::once([1, 1, 0, 8190]).chain(keys).flatten();
    let mut builder = las::Builder::from((1, 4));
    for (record_id, data) in [
        (34735, words.flat_map(u16::to_le_bytes).collect()),
        (34736, vec![0xff; 65_520]),
    ] {
        builder.vlrs.push(las::Vlr {
            user_id: "LASF_Projection".into(),
            record_id,
            description: String::new(),
            data,
        });
    }
    let header = builder.into_header().unwrap();
    let mut writer = las::Writer::from_path(&path, header).unwrap();
    writer.write_point(las::Point::default()).unwrap();
    writer.close().unwrap();
    let begin = std::time::Instant::now();
    assert_eq!(bench.read(&[path]).unwrap().points(), 1);
    // With a copy of the numbers for each key it takes 10 s, and gigabytes.
    assert!(begin.elapsed().as_secs() < 2, "{:?}", begin.elapsed());
}
