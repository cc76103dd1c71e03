//! Entwine Point Tiles: all kinds of data, regions, and sets that are damaged.

use crate::ingest::bench::{Bench, cloud, write_las};
use crate::ingest::regions::{check, points};
use outcrop_formats::{ingest, probe};
use outcrop_points::Format;
use serde_json::json;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

const SCALE: f64 = 0.001;
const OFFSET: [f64; 3] = [4e5, 5e6, 0.0];

/// The cube of the root, in units of the last digit.
const LOW: i32 = -1_000;
const SIDE: i32 = 1 << 18;

type Key = [i32; 4];

fn name([depth, x, y, z]: Key) -> String {
    format!("{depth}-{x}-{y}-{z}")
}

/// Each point in one node: some near the root, the others three levels down.
fn nodes(points: &[[i32; 3]]) -> BTreeMap<Key, Vec<[i32; 3]>> {
    let mut nodes: BTreeMap<Key, Vec<[i32; 3]>> = BTreeMap::new();
    for (n, point) in points.iter().enumerate() {
        let depth = [0, 1, 3, 3, 3][n % 5];
        let [x, y, z] = point.map(|c| (c - LOW) / (SIDE >> depth));
        nodes.entry([depth, x, y, z]).or_default().push(*point);
    }
    nodes
}

/// The rows of a node: positions, intensity and an extra number.
fn rows(points: &[[i32; 3]]) -> Vec<u8> {
    let row = |p: &[i32; 3]| {
        let position = p.iter().flat_map(|c| c.to_le_bytes());
        let own = (p[0] & 0xfff) as u16;
        let long = i64::from(p[1]) << 20;
        position
            .chain(own.to_le_bytes())
            .chain(long.to_le_bytes())
            .collect::<Vec<u8>>()
    };
    points.iter().flat_map(row).collect()
}

/// Writes a set of tiles; the hierarchy has a file of its own for each node of the first level.
pub fn write(folder: &Path, data: &str, all: &[[i32; 3]]) -> PathBuf {
    for part in ["ept-data", "ept-hierarchy"] {
        std::fs::create_dir_all(folder.join(part)).unwrap();
    }
    let nodes = nodes(all);
    let mut pages: BTreeMap<Key, BTreeMap<String, i64>> = BTreeMap::new();
    for (key, points) in &nodes {
        let [depth, ..] = *key;
        let parent = key.map(|k| k >> (depth - 1).max(0));
        let page = if depth == 0 {
            [0; 4]
        } else {
            [1, parent[1], parent[2], parent[3]]
        };
        if depth > 0 {
            pages.entry([0; 4]).or_default().insert(name(page), -1);
        }
        pages
            .entry(page)
            .or_default()
            .insert(name(*key), points.len() as i64);
        let file = |extension: &str| folder.join(format!("ept-data/{}.{extension}", name(*key)));
        match data {
            "laszip" => write_las(&file("laz"), (1, 2), 1, (SCALE, OFFSET), points, false),
            "binary" => std::fs::write(file("bin"), rows(points)).unwrap(),
            _ => {
                let packed = zstd::bulk::compress(&rows(points), 3).unwrap();
                std::fs::write(file("zst"), packed).unwrap();
            }
        }
    }
    for (key, page) in pages {
        let path = folder.join(format!("ept-hierarchy/{}.json", name(key)));
        std::fs::write(path, serde_json::to_vec(&page).unwrap()).unwrap();
    }
    let place = |c: i32, axis: usize| f64::from(c) * SCALE + OFFSET[axis];
    let bounds = |ends: [[i32; 3]; 2]| {
        let of = |end: [i32; 3]| [0, 1, 2].map(|axis| place(end[axis], axis));
        [of(ends[0]), of(ends[1])].concat()
    };
    let ends = |axis: usize| all.iter().map(move |p| p[axis]);
    let low = [0, 1, 2].map(|axis| ends(axis).min().unwrap());
    let high = [0, 1, 2].map(|axis| ends(axis).max().unwrap());
    let axis = |name: &str, offset: f64| json!({"name": name, "type": "signed", "size": 4, "scale": SCALE, "offset": offset});
    let about = json!({
        "bounds": bounds([[LOW; 3], [LOW + SIDE; 3]]),
        "boundsConforming": bounds([low, high]),
        "dataType": data,
        "hierarchyType": "json",
        "points": all.len(),
        "schema": [
            axis("X", OFFSET[0]), axis("Y", OFFSET[1]), axis("Z", OFFSET[2]),
            {"name": "Intensity", "type": "unsigned", "size": 2},
            {"name": "Number", "type": "signed", "size": 8},
        ],
        "span": 128,
        "version": "1.0.0"
    });
    let path = folder.join("ept.json");
    std::fs::write(&path, about.to_string()).unwrap();
    path
}

#[test]
fn points_are_those_of_one_file_whatever_the_data_type() {
    let bench = Bench::new();
    let all = cloud(20_000, 3);
    let whole = bench.path("whole.las");
    write_las(&whole, (1, 2), 1, (SCALE, OFFSET), &all, false);
    let expected = points(&bench, &bench.read(&[whole]).unwrap());
    for data in ["laszip", "binary", "zstandard"] {
        let ept = write(&bench.path(data), data, &all);
        // A folder with a set of tiles is one input.
        for input in [ept.clone(), bench.path(data)] {
            let spool = bench.read(&[input]).unwrap();
            assert!(points(&bench, &spool) == expected, "{data}");
            assert!(
                spool.stats().warnings.is_empty(),
                "{:?}",
                spool.stats().warnings
            );
        }
        let seen = probe(&ept).unwrap();
        assert_eq!(
            (seen.format, seen.points_claimed),
            (Format::EPT, Some(20_000))
        );
        assert!(
            seen.columns.iter().any(|c| c.name == "intensity"),
            "{:?}",
            seen.columns
        );
    }
}

#[test]
fn of_a_region_only_the_nodes_that_meet_it_are_read() {
    let bench = Bench::new();
    let all = cloud(20_000, 4);
    for data in ["laszip", "binary"] {
        let ept = write(&bench.path(data), data, &all);
        for region in [
            "400010,5000010,400050,5000060",
            "400100,5000100,1,400110,5000120,9",
        ] {
            let spool = check(&bench, std::slice::from_ref(&ept), region, 2.0);
            let stats = spool.stats();
            assert!(
                stats.skipped_by_crop > 10_000,
                "{region}: {}",
                stats.skipped_by_crop
            );
        }
        // What is not read may be absent.
        let far = bench.path(data).join("ept-hierarchy/1-1-1-0.json");
        std::fs::remove_file(far).unwrap();
        let near = crate::ingest::regions::within("400001,5000001,400002,5000002", 0.5);
        outcrop_formats::ingest_selected(&[ept], &near, &bench.workspace).unwrap();
    }
}

#[test]
fn damage_is_told_with_its_file() {
    let bench = Bench::new();
    let all = cloud(2_000, 5);
    let damage = |name: &str, data: &str, what: &dyn Fn(&Path)| {
        let folder = bench.path(name);
        let ept = write(&folder, data, &all);
        what(&folder);
        ingest(&[ept], &bench.workspace)
            .map(|_| ())
            .unwrap_err()
            .to_string()
    };
    let put = |file: &'static str, text: &'static str| {
        move |folder: &Path| std::fs::write(folder.join(file), text).unwrap()
    };
    let page = "ept-hierarchy/0-0-0-0.json";
    let root = "ept-data/0-0-0-0.bin";
    for (what, error, expected) in [
        ("no JSON", damage("a", "binary", &put(page, "{")), page),
        (
            "a key",
            damage("b", "binary", &put(page, r#"{"0-0-0-7": 4}"#)),
            "depth-x-y-z",
        ),
        (
            "a number",
            damage("c", "binary", &put(page, r#"{"0-0-0-0": -7}"#)),
            "-7 points",
        ),
        (
            "too many",
            damage("d", "binary", &put(page, r#"{"0-0-0-0": 99999999999}"#)),
            "99999999999",
        ),
        (
            "half a row",
            damage("e", "binary", &put(root, "half")),
            root,
        ),
        ("too few", damage("f", "binary", &put(root, "")), "0 points"),
        (
            "no Zstandard",
            damage("g", "zstandard", &put("ept-data/0-0-0-0.zst", "no")),
            "0-0-0-0.zst",
        ),
        (
            "no LAZ",
            damage("h", "laszip", &put("ept-data/0-0-0-0.laz", "no")),
            "0-0-0-0.laz",
        ),
        (
            "cut off",
            damage("i", "binary", &|folder| {
                let file = folder.join(root);
                let bytes = std::fs::read(&file).unwrap();
                std::fs::write(file, &bytes[..bytes.len() - 22]).unwrap();
            }),
            "399 points",
        ),
        (
            "absent",
            damage("j", "binary", &|folder| {
                std::fs::remove_file(folder.join(root)).unwrap();
            }),
            root,
        ),
        (
            "a bomb",
            damage("k", "zstandard", &|folder| {
                let packed = zstd::bulk::compress(&vec![0; 50 << 20], 3).unwrap();
                std::fs::write(folder.join("ept-data/0-0-0-0.zst"), packed).unwrap();
            }),
            "0-0-0-0.zst",
        ),
        (
            "no schema",
            damage(
                "l",
                "binary",
                &put("ept.json", r#"{"hierarchyType": "json"}"#),
            ),
            "ept.json",
        ),
    ] {
        assert!(error.contains(expected), "{what}: {error}");
        assert!(!error.contains('\n'), "{error}");
    }
}
