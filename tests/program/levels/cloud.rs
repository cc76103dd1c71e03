//! Points to be shown beside a mesh: which of them, where they are, and what is said of them.

use outcrop::inspect::compare;
use outcrop::levels::cloud::{CloudReport, tileset};
use outcrop::{Cancel, Error, MemoryPool, Silent, Workspace};
use outcrop_formats::ingest_selected;
use serde_json::Value;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;
use std::sync::Arc;

/// Points and colours by their numbers, some metres apart, far from the origin.
fn point(n: u32) -> ([f64; 3], [u8; 3]) {
    let (x, y) = (n % 100, n / 100);
    let height = (x * 7 + y * 13) % 29;
    let at = [
        500_000.25 + f64::from(x),
        4_900_000.5 + f64::from(y),
        f64::from(height) / 4.0,
    ];
    (at, [x as u8, y as u8, 200])
}

fn write(path: &Path, numbers: impl Iterator<Item = u32>, colors: bool) {
    let mut text = String::from(if colors {
        "x y z red green blue\n"
    } else {
        "x y z\n"
    });
    for n in numbers {
        let ([x, y, z], [r, g, b]) = point(n);
        write!(text, "{x} {y} {z}").unwrap();
        match colors {
            true => writeln!(text, " {r} {g} {b}").unwrap(),
            false => text.push('\n'),
        }
    }
    std::fs::write(path, text).unwrap();
}

fn made(
    cloud: &Path,
    folder: &Path,
    most: u64,
    (memory, threads): (u64, usize),
) -> outcrop::Result<CloudReport> {
    let (pool, place) = (MemoryPool::new(memory)?, tempfile::tempdir().unwrap());
    let workspace = Workspace::new(place.path(), pool, threads, Arc::new(Silent), Cancel::new())?;
    let report = tileset(
        cloud,
        "the cloud",
        folder,
        most,
        ingest_selected,
        &workspace,
    );
    drop(workspace);
    let left = std::fs::read_dir(place.path()).unwrap().count();
    assert_eq!(left, 0, "scratch files are left");
    report
}

const USUAL: (u64, usize) = (192 << 20, 2);

/// A position, and a colour in linear light.
type Shown = ([f64; 3], Option<[u16; 3]>);

/// The JSON of a tileset, and its points.
fn read(folder: &Path) -> (Value, Vec<Shown>) {
    let json: Value =
        serde_json::from_slice(&std::fs::read(folder.join("tileset.json")).unwrap()).unwrap();
    let bytes =
        std::fs::read(folder.join(json["root"]["content"]["uri"].as_str().unwrap())).unwrap();
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    assert_eq!((&bytes[..4], word(8)), (&b"glTF"[..], bytes.len()));
    let glb: Value = serde_json::from_slice(&bytes[20..20 + word(12)]).unwrap();
    let data = &bytes[28 + word(12)..];
    assert_eq!(
        data.len() as u64,
        glb["buffers"][0]["byteLength"].as_u64().unwrap()
    );
    let primitive = &glb["meshes"][0]["primitives"][0];
    assert_eq!(primitive["mode"], 0);
    let count = glb["accessors"][0]["count"].as_u64().unwrap() as usize;
    let m: Vec<f64> = glb["nodes"][0]["matrix"]
        .as_array()
        .unwrap()
        .iter()
        .map(|x| x.as_f64().unwrap())
        .collect();
    let origin = &json["extras"]["outcrop"]["origin"];
    let has_colors = primitive["attributes"]["COLOR_0"].is_number();
    let points = (0..count).map(|n| {
        let p = [0, 4, 8].map(|k| {
            f64::from(f32::from_le_bytes(
                data[12 * n + k..][..4].try_into().unwrap(),
            ))
        });
        let turned: [f64; 3] =
            std::array::from_fn(|k| (0..3).map(|a| m[4 * a + k] * p[a]).sum::<f64>() + m[12 + k]);
        // From y upwards to z upwards.
        let local = [turned[0], -turned[2], turned[1]];
        let position = std::array::from_fn(|k| local[k] + origin[k].as_f64().unwrap());
        let color = has_colors.then(|| {
            [0, 2, 4].map(|k| {
                u16::from_le_bytes(data[12 * count + 8 * n + k..][..2].try_into().unwrap())
            })
        });
        (position, color)
    });
    (json.clone(), points.collect())
}

fn key(p: [f64; 3]) -> [i64; 3] {
    p.map(|x| (x * 4.0).round() as i64)
}

#[test]
fn points_stay_where_they_are_and_keep_their_colours() {
    let place = tempfile::tempdir().unwrap();
    let (cloud, folder) = (place.path().join("cloud.xyz"), place.path().join("points"));
    write(&cloud, 0..10_000, true);
    let known: BTreeMap<_, _> = (0..10_000)
        .map(point)
        .map(|(p, color)| (key(p), color))
        .collect();
    for most in [20_000, 1000] {
        let report = made(&cloud, &folder, most, USUAL).unwrap();
        let (json, points) = read(&folder);
        assert_eq!((report.of_points, report.colors), (10_000, true));
        assert_eq!(report.points, points.len() as u64);
        match most {
            1000 => assert!((501..=1000).contains(&points.len()), "{}", points.len()),
            _ => assert_eq!(points.len(), 10_000),
        }
        let noted = &json["extras"]["outcrop"];
        assert_eq!(
            (&noted["points"], &noted["of_points"]),
            (&report.points.into(), &10_000.into())
        );
        assert_eq!(noted["source"], "the cloud");
        let mut seen = BTreeMap::new();
        for (position, color) in points {
            assert_eq!(position, key(position).map(|x| x as f64 / 4.0));
            let expected = known[&key(position)];
            assert_eq!(color.unwrap().map(super::srgb), expected);
            assert!(seen.insert(key(position), ()).is_none(), "a point twice");
        }
        std::fs::remove_dir_all(&folder).unwrap();
    }
}

#[test]
fn the_points_depend_on_the_cloud_only() {
    let place = tempfile::tempdir().unwrap();
    let path = |name: &str| place.path().join(name);
    let bytes = |folder: &str| std::fs::read(path(folder).join("points.glb")).unwrap();
    write(&path("one.xyz"), 0..10_000, true);
    made(&path("one.xyz"), &path("a"), 777, USUAL).unwrap();
    made(&path("one.xyz"), &path("b"), 777, (1 << 30, 1)).unwrap();
    std::fs::create_dir(path("many")).unwrap();
    for part in 0..5 {
        write(
            &path(&format!("many/{part}.xyz")),
            (0..10_000).rev().filter(|n| n % 5 == part),
            true,
        );
    }
    made(&path("many"), &path("c"), 777, USUAL).unwrap();
    assert!(bytes("a") == bytes("b") && bytes("a") == bytes("c"));
    // Every point of the cloud has one of them near it.
    write(&path("plain.xyz"), 0..10_000, false);
    let report = made(&path("plain.xyz"), &path("d"), 777, USUAL).unwrap();
    assert!(!report.colors);
    let (_, points) = read(&path("d"));
    let mut text = String::new();
    points
        .iter()
        .for_each(|([x, y, z], _)| writeln!(text, "{x} {y} {z}").unwrap());
    std::fs::write(path("thin.xyz"), text).unwrap();
    let pool = MemoryPool::new(192 << 20).unwrap();
    let workspace = Workspace::new(place.path(), pool, 1, Arc::new(Silent), Cancel::new()).unwrap();
    let options = compare::Options {
        samples: 100_000,
        seed: 0,
    };
    let compared =
        compare::compare(&path("plain.xyz"), &path("thin.xyz"), &options, &workspace).unwrap();
    assert!(
        compared.a_to_b.figures.max <= report.side * 3f64.sqrt(),
        "{compared}"
    );
}

#[test]
fn what_cannot_be_shown_is_refused() {
    let place = tempfile::tempdir().unwrap();
    let (cloud, folder) = (place.path().join("cloud.xyz"), place.path().join("points"));
    std::fs::write(&cloud, "nan nan nan\n").unwrap();
    let refused = |most| made(&cloud, &folder, most, USUAL).unwrap_err();
    assert!(matches!(refused(10), Error::Input { .. }));
    for most in [0, 200_000_001] {
        let said = refused(most).to_string();
        assert!(said.starts_with("points_limit: "), "{said}");
    }
    assert!(!folder.exists());
}
