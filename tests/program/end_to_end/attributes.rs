//! Values of points at the vertices of the mesh: the right ones, in the same bytes whatever the run.

use crate::end_to_end::util::{self, Bench};
use outcrop::Smooth;
use outcrop::Start;
use outcrop::params::Params;
use outcrop_cloudgen::{Cloud, Kind};
use outcrop_disk::workspace::memory::MINIMUM_BUDGET;
use outcrop_disk::workspace::progress::{Cancel, Observer};
use std::collections::HashMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A point with its values: red, green, blue, and a level that may be negative.
type Valued = ([i32; 3], [i32; 4]);

/// A bumpy surface with noise, on a grid, with points of other values at some of its positions.
fn cloud(points: u64) -> Vec<Valued> {
    let cloud = Cloud::new(Kind::Bumpy).points(points).noise(1.0).seed(3);
    let mut random = oorandom::Rand32::new(8);
    let mut all = Vec::new();
    for point in cloud.generator().unwrap().iter() {
        let place = point.map(|c| (c * 1000.0).round() as i32);
        for _ in 0..1 + random.rand_range(0..5) / 4 {
            let mut value = |most| random.rand_range(0..most) as i32;
            all.push((place, [value(256), value(256), value(256), value(3) - 1]));
        }
    }
    all
}

/// Writes points as text, with coordinates of three decimals.
fn write(bench: &Bench, name: &str, points: &[Valued]) -> PathBuf {
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\n\
         property uchar red\nproperty uchar green\nproperty uchar blue\nproperty short level\nend_header\n",
        points.len()
    );
    for (place, [r, g, b, level]) in points {
        let [x, y, z] = place.map(|c| f64::from(c) / 1000.0);
        writeln!(text, "{x:.3} {y:.3} {z:.3} {r} {g} {b} {level}").unwrap();
    }
    bench.write(name, text)
}

fn params() -> Params {
    Params {
        attributes: "level,color".parse().unwrap(),
        smooth: outcrop::Smooth::Rounds(0),
        ..Params::default()
    }
}

/// The vertices of a mesh with these columns.
fn vertices(path: &Path) -> Vec<Valued> {
    let bytes = std::fs::read(path).unwrap();
    let end = bytes
        .windows(11)
        .position(|w| w == b"end_header\n")
        .unwrap()
        + 11;
    let header = String::from_utf8(bytes[..end].to_vec()).unwrap();
    let order = "float x\nproperty float y\nproperty float z\nproperty short level\nproperty uchar red\n\
        property uchar green\nproperty uchar blue\n";
    assert!(header.contains(order), "{header}");
    let count = header.split("element vertex ").nth(1).unwrap();
    let count: usize = count.lines().next().unwrap().parse().unwrap();
    let record = |row: &[u8]| {
        let coordinate = |n: usize| {
            let c = f32::from_le_bytes(row[4 * n..4 * n + 4].try_into().unwrap());
            (f64::from(c) * 1000.0).round() as i32
        };
        let level = i16::from_le_bytes([row[12], row[13]]);
        let color = [row[14], row[15], row[16]].map(i32::from);
        let [r, g, b] = color;
        ([0, 1, 2].map(coordinate), [r, g, b, level.into()])
    };
    bytes[end..].chunks(17).take(count).map(record).collect()
}

#[test]
fn every_vertex_has_the_smallest_values_at_its_position() {
    let bench = Bench::new();
    let points = cloud(20_000);
    let mut least: HashMap<[i32; 3], [i32; 4]> = HashMap::new();
    for (place, [r, g, b, level]) in &points {
        let row = [*level, *r, *g, *b];
        let entry = least.entry(*place).or_insert(row);
        *entry = row.min(*entry);
    }
    let input = write(&bench, "cloud.ply", &points);
    let more = [
        params(),
        Params {
            thin: Some(0.8),
            ..params()
        },
        Params {
            drop_outliers: Some(2.0),
            block: 700,
            ..params()
        },
    ];
    for params in more {
        let mesh = bench.path("mesh.ply");
        let report = util::reconstruct(&input, &mesh, &params);
        let found = vertices(&mesh);
        assert_eq!(found.len() as u64, report.mesh.vertices);
        for (place, [r, g, b, level]) in &found {
            assert_eq!([*level, *r, *g, *b], least[place], "{place:?}");
        }
        assert_eq!(util::verdict(&mesh).defects().map(|d| d.1), [0; 8]);
        assert_eq!(report.attributes.len(), 4);
        std::fs::remove_file(&mesh).unwrap();
    }
}

/// Stops the run when a stage begins.
struct StopAt(&'static str, Cancel);

impl Observer for StopAt {
    fn begin(&self, name: &'static str, _: &'static str, _: u64) {
        if name == self.0 {
            self.1.cancel();
        }
    }
}

#[test]
fn bytes_do_not_depend_on_how_it_was_run() {
    let bench = Bench::new();
    let points = cloud(30_000);
    let whole = write(&bench, "cloud.ply", &points);
    let (one, other) = points.split_at(10_000);
    let mut turned = other.to_vec();
    turned.reverse();
    let parts = [write(&bench, "b.ply", &turned), write(&bench, "a.ply", one)];
    let params = Params {
        block: 3000,
        ..params()
    };
    let mesh = bench.path("mesh.ply");
    let hash = |inputs: &[PathBuf], threads, memory, page| {
        let builder = util::builder(inputs, &mesh, &params)
            .threads(threads)
            .memory(memory);
        builder.page_points(page).build().unwrap().run().unwrap();
        let hash = util::hash(&mesh);
        std::fs::remove_file(&mesh).unwrap();
        hash
    };
    let expected = hash(std::slice::from_ref(&whole), 2, 1 << 30, 256);
    assert_eq!(hash(&parts, 1, MINIMUM_BUDGET, 256), expected);
    assert_eq!(hash(&parts, 3, 1 << 30, 16), expected);
    // Stopped in a stage, and resumed.
    for stage in ["order", "attributes", "cells", "export"] {
        let cancel = Cancel::new();
        let stop = StopAt(stage, cancel.clone());
        let stopped = util::builder(&parts, &mesh, &params)
            .cancel(cancel)
            .observer(Arc::new(stop));
        assert!(stopped.build().unwrap().run().is_err());
        let again = util::builder(&parts, &mesh, &params).start(Start::Resume);
        // A program that another test starts may hold the lock of the folder for a moment; this waits for it.
        again.build().unwrap().run().unwrap();
        assert_eq!(util::hash(&mesh), expected);
        std::fs::remove_file(&mesh).unwrap();
    }
}

/// The values of the vertices of a mesh with only this column, of floats, in coordinates of double precision.
fn values(path: &Path, column: &str) -> Vec<f32> {
    let bytes = std::fs::read(path).unwrap();
    let end = bytes.windows(11).position(|w| w == b"end_header\n");
    let (header, rows) = bytes.split_at(end.unwrap() + 11);
    let header = std::str::from_utf8(header).unwrap();
    assert!(header.contains(&format!("double z\nproperty float {column}\nelement face")));
    let count = header.split("element vertex ").nth(1).unwrap();
    let count: usize = count.lines().next().unwrap().parse().unwrap();
    let rows = rows.as_chunks::<28>().0.iter().take(count);
    rows.map(|row| f32::from_le_bytes(row[24..].try_into().unwrap()))
        .collect()
}

#[test]
fn displacement_tells_how_far_each_point_moved() {
    let bench = Bench::new();
    let cloud = |noise| {
        let cloud = Cloud::new(Kind::Bumpy).points(20_000);
        bench.cloud(&format!("{noise}.ply"), &cloud.noise(noise).seed(5))
    };
    let (clean, noisy) = (cloud(0.0), cloud(5.0));
    let mesh = bench.path("mesh.ply");
    let run = |input: &Path, smooth| {
        let params = Params {
            attributes: "displacement".parse().unwrap(),
            smooth,
            ..Params::default()
        };
        let report = util::reconstruct(input, &mesh, &params);
        (report, values(&mesh, "displacement"))
    };
    for (input, smooth) in [(&clean, Smooth::Auto), (&noisy, Smooth::Rounds(0))] {
        let (report, moved) = run(input, smooth);
        assert!(moved.iter().all(|length| *length == 0.0));
        assert_eq!(report.attributes[0].range, [0.0; 2]);
    }
    let (report, mut moved) = run(&noisy, Smooth::Auto);
    let relaxed = report.relax.unwrap();
    moved.sort_by(f32::total_cmp);
    let rest = moved.iter().filter(|length| **length > 0.0).count() as u64;
    assert!(rest > 18_000 && rest <= relaxed.moved, "{rest}");
    let largest = report.attributes[0].range[1];
    assert_eq!(largest, relaxed.largest);
    assert!(f64::from(moved[moved.len() - 1]) <= largest * (1.0 + 1e-6));
    // The counts of the report are in classes of a 64th of the square.
    let middle = f64::from(moved[moved.len() - rest as usize / 2]);
    assert!(
        (middle / relaxed.median - 1.0).abs() < 0.05,
        "{middle} {}",
        relaxed.median
    );
    let (_, twice) = run(&noisy, Smooth::Rounds(2));
    assert!(twice.iter().filter(|length| **length > 0.0).count() > 18_000);
}

/// Where all cells agree the confidence is 1; noise and filled holes lower it.
#[test]
fn confidence_is_the_share_of_cells_that_agree() {
    let bench = Bench::new();
    let mesh = bench.path("mesh.ply");
    let run = |input: &Path, smooth| {
        let params = Params {
            smooth,
            attributes: "confidence".parse().unwrap(),
            relax: match smooth {
                Smooth::Auto => Params::default().relax,
                Smooth::Rounds(_) => 0,
            },
            ..Params::default()
        };
        let report = util::reconstruct(input, &mesh, &params);
        (report, values(&mesh, "confidence"))
    };
    let cloud = |noise| {
        let cloud = Cloud::new(Kind::Bumpy).points(20_000);
        bench.cloud(&format!("{noise}.ply"), &cloud.noise(noise).seed(5))
    };
    let mean = |all: &[f32]| all.iter().map(|x| f64::from(*x)).sum::<f64>() / all.len() as f64;
    let (report, clean) = run(&cloud(0.0), Smooth::Auto);
    let [least, most] = report.attributes[0].range;
    assert!(
        clean
            .iter()
            .all(|x| (least as f32..=most as f32).contains(x))
    );
    assert!(least > 0.0 && most == 1.0);
    assert!(mean(&clean) > 0.97, "{}", mean(&clean));
    // As it was measured, without smoothing.
    let (_, noisy) = run(&cloud(5.0), Smooth::Rounds(0));
    assert!(mean(&noisy) < mean(&clean) - 0.2, "{}", mean(&noisy));
    // Some have nearly no support.
    assert!(noisy.iter().any(|x| *x < 0.2));
}

#[test]
fn columns_that_are_made_come_behind_others_in_any_division() {
    let bench = Bench::new();
    let input = write(&bench, "cloud.ply", &cloud(20_000));
    let mesh = bench.path("mesh.ply");
    let mut hashes = Vec::new();
    for (threads, tile, memory) in [(1, 500, MINIMUM_BUDGET), (4, 3000, 300 << 20)] {
        let params = Params {
            attributes: "confidence,displacement,level".parse().unwrap(),
            block: 3000,
            ..Params::default()
        };
        let run = util::builder(std::slice::from_ref(&input), &mesh, &params);
        let run = run.threads(threads).tile_points(tile).memory(memory);
        let report = run.build().unwrap().run().unwrap();
        let names: Vec<_> = report.attributes.iter().map(|a| &*a.name).collect();
        assert_eq!(names, ["level", "displacement", "confidence"]);
        hashes.push(util::hash(&mesh));
    }
    assert_eq!(hashes[0], hashes[1]);
}
