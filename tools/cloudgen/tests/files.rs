//! Content of the written files.

use std::{fs, path::Path};

use outcrop_cloudgen::{Cloud, Encoding, Error, Format, Kind, LasOptions, PointFormat, Precision};

const N: u64 = 120_345;

fn write(cloud: &Cloud, folder: &Path, name: &str, format: Format) -> Vec<u8> {
    let path = folder.join(name);
    cloud.write(&path, format).unwrap();
    fs::read(path).unwrap()
}

#[test]
fn las_and_laz_round_trip() {
    let folder = tempfile::tempdir().unwrap();
    let offset = [500_000.25, 5_400_000.0, -12.0];
    let cloud = Cloud::new(Kind::Torus)
        .points(N)
        .seed(3)
        .noise(0.1)
        .offset(offset);
    let generator = cloud.generator().unwrap();
    for point_format in [
        PointFormat::Legacy,
        PointFormat::Colored,
        PointFormat::Extended,
        PointFormat::ExtendedColored,
    ] {
        let colored = matches!(
            point_format,
            PointFormat::Colored | PointFormat::ExtendedColored
        );
        let options = LasOptions {
            point_format,
            scale: None,
        };
        for (name, format) in [
            ("a.las", Format::Las(options)),
            ("a.laz", Format::Laz(options)),
        ] {
            let bytes = write(&cloud, folder.path(), name, format);
            assert_eq!(bytes, write(&cloud, folder.path(), name, format), "{name}");
            let mut reader = las::Reader::from_path(folder.path().join(name)).unwrap();
            assert_eq!(reader.header().number_of_points(), N);
            assert_eq!(reader.header().number_of_points_by_return(1), Some(N));
            let bounds = reader.header().bounds();
            let mut index = 0;
            let read = reader.read_all().unwrap();
            for (point, exact) in read.points().zip(generator.iter()) {
                let point = point.unwrap();
                assert_eq!((point.return_number, point.number_of_returns), (1, 1));
                let red = 32768.0 + 32767.0 * libm::sin(exact[0] * 0.06);
                let wanted = colored.then_some(red as u16);
                assert_eq!(point.color.map(|color| color.red), wanted);
                for (read, exact) in [point.x, point.y, point.z].into_iter().zip(exact) {
                    assert!((read - exact).abs() < 0.000_501, "{name} {index}");
                }
                assert!(bounds.min.x <= point.x && point.x <= bounds.max.x);
                index += 1;
            }
            assert_eq!(index, N);
        }
    }
}

#[test]
fn grid_in_las_is_exact() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("grid.laz");
    let cloud = Cloud::new(Kind::Grid).points(5000).rotated(true);
    cloud
        .write(&path, Format::from_path(&path).unwrap())
        .unwrap();
    let mut reader = las::Reader::from_path(&path).unwrap();
    let read = reader.read_all().unwrap();
    for (point, exact) in read.points().zip(cloud.generator().unwrap().iter()) {
        let point = point.unwrap();
        assert_eq!([point.x, point.y, point.z], exact);
    }
}

#[test]
fn binary_ply_round_trip() {
    let folder = tempfile::tempdir().unwrap();
    let cloud = Cloud::new(Kind::Room).points(N);
    let exact: Vec<[f64; 3]> = cloud.generator().unwrap().iter().collect();
    for encoding in [Encoding::LittleEndian, Encoding::BigEndian] {
        for precision in [Precision::Single, Precision::Double] {
            let bytes = write(
                &cloud,
                folder.path(),
                "a.ply",
                Format::Ply(encoding, precision),
            );
            let end = bytes
                .windows(11)
                .position(|w| w == b"end_header\n")
                .unwrap()
                + 11;
            let header = std::str::from_utf8(&bytes[..end]).unwrap();
            assert!(
                header.contains(&format!("element vertex {N}\n")),
                "{header}"
            );
            let body = &bytes[end..];
            let width = if precision == Precision::Single { 4 } else { 8 };
            assert_eq!(body.len() as u64, N * 3 * width);
            for (chunk, &exact) in body.chunks(width as usize).zip(exact.as_flattened()) {
                let mut chunk = chunk.to_vec();
                if encoding == Encoding::BigEndian {
                    chunk.reverse();
                }
                match precision {
                    Precision::Single => {
                        let read = f32::from_le_bytes(chunk.try_into().unwrap());
                        assert_eq!(read, exact as f32);
                    }
                    Precision::Double => {
                        let read = f64::from_le_bytes(chunk.try_into().unwrap());
                        assert_eq!(read, exact);
                    }
                }
            }
        }
    }
}

#[test]
fn text_round_trip() {
    let folder = tempfile::tempdir().unwrap();
    let cloud = Cloud::new(Kind::Sphere).points(2000).noise(0.3);
    let exact: Vec<[f64; 3]> = cloud.generator().unwrap().iter().collect();
    let ascii = Format::Ply(Encoding::Ascii, Precision::Double);
    for (name, format) in [("a.xyz", Format::Xyz), ("a.ply", ascii)] {
        let text = String::from_utf8(write(&cloud, folder.path(), name, format)).unwrap();
        let body = text
            .split_once("end_header\n")
            .map_or(text.as_str(), |(_, body)| body);
        let read: Vec<[f64; 3]> = body
            .lines()
            .map(|line| {
                let numbers: Vec<f64> = line.split(' ').map(|w| w.parse().unwrap()).collect();
                numbers.try_into().unwrap()
            })
            .collect();
        assert_eq!(read, exact, "{name}");
    }
}

#[test]
fn split_is_a_partition() {
    let folder = tempfile::tempdir().unwrap();
    let cloud = Cloud::new(Kind::Sphere).points(9000);
    let base = folder.path().join("part.xyz");
    let paths = cloud.write_split(&base, Format::Xyz, 3).unwrap();
    assert_eq!(paths.len(), 3);
    assert!(paths[2].ends_with("part-2.xyz"));
    let read = |path: &Path| -> Vec<String> {
        fs::read_to_string(path)
            .unwrap()
            .lines()
            .map(str::to_owned)
            .collect()
    };
    let mut together = Vec::new();
    for path in &paths {
        let lines = read(path);
        assert!((2700..3300).contains(&lines.len()), "{}", lines.len());
        together.extend(lines);
    }
    cloud.write(&base, Format::Xyz).unwrap();
    let mut whole = read(&base);
    whole.sort();
    together.sort();
    assert_eq!(whole, together);
}

#[test]
fn empty_files_are_valid() {
    let folder = tempfile::tempdir().unwrap();
    let cloud = Cloud::new(Kind::Sphere).points(0);
    for name in ["a.las", "a.laz"] {
        let path = folder.path().join(name);
        cloud
            .write(&path, Format::from_path(&path).unwrap())
            .unwrap();
        let mut reader = las::Reader::from_path(&path).unwrap();
        assert_eq!(reader.read_all().unwrap().len(), 0, "{name}");
    }
}

#[test]
fn failures_are_errors() {
    let cloud = Cloud::new(Kind::Sphere).points(200_000);
    let format = Format::Laz(LasOptions::default());
    let error = cloud
        .write("/nonexistent-folder/a.laz", format)
        .unwrap_err();
    assert!(matches!(error, Error::Io { .. }), "{error}");
    assert!(matches!(
        Format::from_path("a.obj"),
        Err(Error::UnknownFormat { .. })
    ));
    assert!("stl".parse::<Format>().is_err());
    assert!(cloud.write_split("a.laz", format, 0).is_err());

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.las");
    let fine = LasOptions {
        scale: Some(1e-9),
        ..LasOptions::default()
    };
    let error = cloud.write(&path, Format::Las(fine)).unwrap_err();
    assert!(
        matches!(error, Error::Parameter { name: "scale", .. }),
        "{error}"
    );
    assert!(!path.exists(), "refused before the file is touched");
}

/// A device that is always full: write errors are reported, without a panic.
#[cfg(target_os = "linux")]
#[test]
fn full_disk_is_an_error() {
    let cloud = Cloud::new(Kind::Sphere).points(200_000);
    let options = LasOptions::default();
    let ply = Format::Ply(Encoding::LittleEndian, Precision::Single);
    for format in [Format::Las(options), Format::Laz(options), ply, Format::Xyz] {
        let error = cloud.write("/dev/full", format).unwrap_err();
        assert!(matches!(error, Error::Io { .. }), "{error}");
    }
}
