//! Closed forms, files read back by another library, and other threads, memory and orders of points.

use super::{Options, Raster, Surface, raster};
use outcrop_disk::error::{Error, Result};
use outcrop_disk::workspace::Workspace;
use outcrop_formats::ingest_selected;
use outcrop_geom::region::Region;
use proptest::prelude::*;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use tiff::decoder::{Decoder, DecodingResult};
use tiff::tags::Tag;

/// A folder for the files of a test.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("outcrop-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).expect("a folder");
        Self(path)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    fn options(&self, cell: f64) -> Options {
        Options {
            output: self.path("dem.tif"),
            cell,
            surface: Surface::Highest,
            crop: None,
            orthophoto: None,
            contours: None,
        }
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// A vertex of a test: position, colour, class.
type Vertex = ([f64; 3], [u8; 3], u8);

fn write_mesh(path: &Path, vertices: &[Vertex], triangles: &[[u32; 3]]) {
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\n\
         property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar classification\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        vertices.len(),
        triangles.len()
    );
    for ([x, y, z], [red, green, blue], class) in vertices {
        let _ = writeln!(text, "{x} {y} {z} {red} {green} {blue} {class}");
    }
    for [a, b, c] in triangles {
        let _ = writeln!(text, "3 {a} {b} {c}");
    }
    std::fs::write(path, text).expect("a mesh");
}

/// A height over `side` × `side` squares of a plan.
fn field(
    path: &Path,
    [low, high]: [f64; 2],
    side: u32,
    vertex: impl Fn(f64, f64) -> (f64, [u8; 3], u8),
) {
    let at = |k: u32| low + (high - low) * f64::from(k) / f64::from(side);
    let places = (0..=side).flat_map(|y| (0..=side).map(move |x| (x, y)));
    let vertices = places.map(|(x, y)| {
        let (x, y) = (at(x), at(y));
        let (z, colour, class) = vertex(x, y);
        ([x, y, z], colour, class)
    });
    let vertices: Vec<Vertex> = vertices.collect();
    let mut triangles = Vec::new();
    for (y, x) in (0..side).flat_map(|y| (0..side).map(move |x| (y, x))) {
        let a = y * (side + 1) + x;
        let [b, c, d] = [a + 1, a + side + 2, a + side + 1];
        triangles.extend([[a, b, c], [a, c, d]]);
    }
    write_mesh(path, &vertices, &triangles);
}

fn run(source: &Path, options: &Options) -> Result<Raster> {
    raster(source, options, ingest_selected, &Workspace::for_tests(2)?)
}

fn open(path: &Path) -> Decoder<std::io::BufReader<std::fs::File>> {
    let file = std::fs::File::open(path).expect("a file");
    Decoder::new(std::io::BufReader::new(file)).expect("a TIFF file")
}

/// The heights of a raster, row by row.
fn heights(path: &Path) -> Vec<f32> {
    match open(path).read_image().expect("an image") {
        DecodingResult::F32(heights) => heights,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_plane_is_sampled_at_the_middles_of_cells() {
    let folder = Folder::new("plane");
    let source = folder.path("plane.ply");
    let height = |x: f64, y: f64| 100.0 + 0.3 * x - 0.2 * y;
    field(&source, [-10.0, 30.0], 7, |x, y| (height(x, y), [0; 3], 0));
    let made = run(&source, &folder.options(0.125)).expect("a raster");
    assert_eq!((made.columns, made.rows, made.cells), (320, 320, 320 * 320));
    assert_eq!((made.min, made.max), ([-10.0; 2], [30.0; 2]));
    assert_eq!((made.overviews, made.nothing), (1, -9999.0));
    for (at, found) in heights(&made.path).iter().enumerate() {
        let [x, y] = [at % 320, at / 320].map(|k| (k as f64 + 0.5) * 0.125);
        let expected = height(x - 10.0, 30.0 - y);
        assert!(
            (f64::from(*found) - expected).abs() < 1e-4,
            "{at}: {found} {expected}"
        );
    }
    let mut file = open(&made.path);
    let scale = file
        .get_tag_f64_vec(Tag::ModelPixelScaleTag)
        .expect("a scale");
    let place = file
        .get_tag_f64_vec(Tag::ModelTiepointTag)
        .expect("a place");
    assert_eq!(
        (scale, place),
        (
            vec![0.125, 0.125, 0.0],
            vec![0.0, 0.0, 0.0, -10.0, 30.0, 0.0]
        )
    );
    // The overview has the means of four cells.
    file.next_image().expect("an overview");
    assert_eq!(file.dimensions().expect("its size"), (160, 160));
    let DecodingResult::F32(coarse) = file.read_image().expect("an overview") else {
        panic!("heights expected");
    };
    let expected = height(0.125 - 10.0, 30.0 - 0.125);
    assert!((f64::from(coarse[0]) - expected).abs() < 1e-4);
}

#[test]
fn the_highest_and_the_lowest_of_two_layers_count_with_their_colours() {
    let folder = Folder::new("layers");
    let source = folder.path("layers.ply");
    let square = |z: f64, colour, class| {
        [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]].map(|[x, y]| ([x, y, z], colour, class))
    };
    let vertices = [square(1.0, [10, 20, 30], 2), square(5.0, [200, 100, 50], 6)].concat();
    write_mesh(
        &source,
        &vertices,
        &[[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]],
    );
    for (surface, height, colour) in [
        (Surface::Highest, 5.0, [200, 100, 50, 255]),
        (Surface::Lowest, 1.0, [10, 20, 30, 255]),
    ] {
        let options = Options {
            surface,
            orthophoto: Some(folder.path("photo.tif")),
            ..folder.options(1.0)
        };
        run(&source, &options).expect("a raster");
        assert_eq!(heights(&options.output), [height; 16]);
        let DecodingResult::U8(colours) = open(&folder.path("photo.tif"))
            .read_image()
            .expect("an image")
        else {
            panic!("bytes expected");
        };
        assert_eq!(colours, [colour; 16].concat());
    }
    let options = Options {
        surface: Surface::GroundClass,
        ..folder.options(1.0)
    };
    run(&source, &options).expect("a raster");
    assert_eq!(heights(&options.output), [1.0; 16]);
}

#[test]
fn cells_outside_have_no_height() {
    let folder = Folder::new("outside");
    let source = folder.path("wedge.ply");
    let corners = [[0.0, 0.0, 7.0], [4.0, 0.0, 7.0], [0.0, 4.0, 7.0]];
    write_mesh(&source, &corners.map(|at| (at, [0; 3], 0)), &[[0, 1, 2]]);
    let made = run(&source, &folder.options(1.0)).expect("a raster");
    let found = heights(&made.path);
    let expected = [
        [7.0, -9999.0, -9999.0, -9999.0],
        [7.0, 7.0, -9999.0, -9999.0],
        [7.0, 7.0, 7.0, -9999.0],
        [7.0, 7.0, 7.0, 7.0],
    ];
    assert_eq!((found, made.cells), (expected.concat(), 10));
    let options = Options {
        crop: Some(Region::of_numbers(&[0.0, 0.0, 2.0, 1.0]).expect("a region")),
        ..folder.options(1.0)
    };
    let made = run(&source, &options).expect("a raster");
    assert_eq!((made.columns, made.rows, made.cells), (2, 1, 2));
    let options = Options {
        crop: Some(Region::of_numbers(&[50.0, 0.0, 60.0, 1.0]).expect("a region")),
        ..folder.options(1.0)
    };
    assert!(matches!(run(&source, &options), Err(Error::Input { .. })));
}

#[test]
fn a_cloud_has_the_highest_the_lowest_or_the_mean_ground() {
    let folder = Folder::new("cloud");
    let source = folder.path("cloud.ply");
    let points = [
        (0.5, 0.5, 1.0, 2),
        (0.25, 0.5, 2.0, 2),
        (0.5, 0.75, 9.0, 5),
        (1.5, 0.5, 4.0, 5),
    ];
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\n\
         property uchar classification\nend_header\n",
        points.len()
    );
    for (x, y, z, class) in points {
        let _ = writeln!(text, "{x} {y} {z} {class}");
    }
    std::fs::write(&source, text).expect("a cloud");
    for (surface, expected) in [
        (Surface::Highest, vec![9.0, 4.0]),
        (Surface::Lowest, vec![1.0, 4.0]),
        (Surface::GroundClass, vec![1.5]),
    ] {
        let options = Options {
            surface,
            ..folder.options(1.0)
        };
        run(&source, &options).expect("a raster");
        assert_eq!(heights(&options.output), expected, "{surface:?}");
    }
}

#[test]
fn contours_of_a_cone_are_circles() {
    let folder = Folder::new("cone");
    let source = folder.path("cone.ply");
    field(&source, [-20.0, 20.0], 320, |x, y| {
        (20.0 - libm::hypot(x, y), [0; 3], 0)
    });
    let options = Options {
        contours: Some((5.0, folder.path("cone.geojson"))),
        ..folder.options(0.25)
    };
    let made = run(&source, &options).expect("a raster");
    let text = std::fs::read_to_string(folder.path("cone.geojson")).expect("a file");
    let found: Vec<(f64, Vec<[f64; 2]>)> = lines(&text);
    assert_eq!(made.contours.expect("contours").lines, found.len() as u64);
    for (elevation, positions) in &found {
        let radius = 20.0 - elevation;
        let is_closed = positions.first() == positions.last();
        assert_eq!(is_closed, *elevation > 0.0, "{elevation}");
        for [x, y] in positions {
            assert!(
                (libm::hypot(*x, *y) - radius).abs() < 0.05,
                "{elevation}: {x} {y}"
            );
        }
    }
    let closed = found.iter().filter(|(elevation, _)| *elevation > 0.0);
    let mut elevations: Vec<f64> = closed.map(|(elevation, _)| *elevation).collect();
    elevations.sort_by(f64::total_cmp);
    assert_eq!(elevations, [5.0, 10.0, 15.0]);
    // The higher ground is on the right: all circles run clockwise.
    for (_, positions) in found.iter().filter(|(elevation, _)| *elevation > 0.0) {
        let pairs = positions.windows(2);
        let area: f64 = pairs.map(|p| p[0][0] * p[1][1] - p[1][0] * p[0][1]).sum();
        assert!(area < 0.0, "{area}");
    }
}

/// Elevation and positions of all lines of a file.
fn lines(text: &str) -> Vec<(f64, Vec<[f64; 2]>)> {
    let features = text.lines().filter(|line| line.contains("LineString"));
    let line = |line: &str| {
        let (head, coordinates) = line.split_once("\"coordinates\":").expect("coordinates");
        let elevation = head.split("\"elevation\":").nth(1).expect("an elevation");
        let elevation = elevation.split('}').next().expect("its end");
        let numbers = coordinates.split(['[', ']', ',', '}']);
        let numbers: Vec<f64> = numbers.filter_map(|n| n.parse().ok()).collect();
        let (pairs, _) = numbers.as_chunks::<2>();
        (elevation.parse().expect("a number"), pairs.to_vec())
    };
    features.map(line).collect()
}

#[test]
fn what_makes_no_sense_is_refused() {
    let folder = Folder::new("refused");
    let source = folder.path("plane.ply");
    field(&source, [0.0, 4.0], 2, |x, _| (x, [0; 3], 0));
    let options = folder.options(1.0);
    let refused = |options: &Options| {
        let error = run(&source, options).expect_err("refused");
        assert!(matches!(error, Error::Parameter { .. }), "{error}");
        assert!(!folder.path("dem.tif").exists());
    };
    let with = |cell| Options {
        cell,
        ..options.clone()
    };
    refused(&with(0.0));
    refused(&with(1e-9));
    let contours = |interval| Options {
        contours: Some((interval, folder.path("lines.geojson"))),
        ..options.clone()
    };
    for interval in [0.0, -1.0, f64::NAN, 1e-9] {
        refused(&contours(interval));
    }
    refused(&Options {
        output: folder.path("dem.png"),
        ..options.clone()
    });
    refused(&Options {
        orthophoto: Some(options.output.clone()),
        ..options.clone()
    });
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Each middle of a cell within a field is covered, wherever the sides of its triangles run, and contours leave
    /// no end within the field.
    #[test]
    fn a_field_has_no_holes(
        heights in proptest::collection::vec(-3.0..3.0f64, 16),
        cell in prop_oneof![Just(0.25), Just(0.5), 0.1..0.7f64],
        shift in -1.0..1.0f64,
        threads in 1..4usize,
    ) {
        let folder = Folder::new(&format!("field{threads}"));
        let source = folder.path("field.ply");
        let number = std::cell::Cell::new(0);
        field(&source, [shift, shift + 3.0], 3, |_, _| {
            let at = number.replace(number.get() + 1);
            (heights[at], [0; 3], 0)
        });
        let options = Options {
            contours: Some((0.5, folder.path("lines.geojson"))),
            ..folder.options(cell)
        };
        let made = raster(&source, &options, ingest_selected, &Workspace::for_tests(threads).unwrap()).unwrap();
        let middles = |k: u32| (made.min[0] / cell).round() * cell + (f64::from(k) + 0.5) * cell;
        let inside = (0..made.columns).filter(|k| (shift..=shift + 3.0).contains(&middles(*k)));
        let inside = inside.count() as u64;
        prop_assert!(made.cells >= inside.saturating_sub(1).pow(2));
        let text = std::fs::read_to_string(folder.path("lines.geojson")).unwrap();
        let bounds = [made.min, made.max];
        for (elevation, positions) in lines(&text) {
            prop_assert!(elevation >= f64::from(made.lowest) && elevation <= f64::from(made.highest));
            if positions.first() == positions.last() {
                continue;
            }
            // An end lies within two cells of the side of the raster.
            for end in [positions[0], positions[positions.len() - 1]] {
                let is_near = (0..2).any(|k| {
                    end[k] - bounds[0][k] < 2.0 * cell || bounds[1][k] - end[k] < 2.0 * cell
                });
                prop_assert!(is_near, "{:?} of {}", end, elevation);
            }
        }
    }
}
