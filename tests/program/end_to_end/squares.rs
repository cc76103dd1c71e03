//! `--split`: squares together are the mesh.

use crate::end_to_end::regions::{boundary_edges, bounds, params, triangles, volume};
use crate::end_to_end::scanners::read;
use crate::end_to_end::util::{self, Bench};
use outcrop::params::{Params, Region};
use outcrop_cloudgen::{Cloud, Kind};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// A position of an index, rounded as in the meshes, which have single precision.
fn single(position: &serde_json::Value) -> [f64; 3] {
    [0, 1, 2].map(|axis| f64::from(position[axis].as_f64().unwrap() as f32))
}

/// The meshes of an index, with their squares.
fn meshes(index: &Path) -> Vec<([i64; 2], PathBuf, serde_json::Value)> {
    let json: serde_json::Value = serde_json::from_slice(&std::fs::read(index).unwrap()).unwrap();
    let of = |entry: &serde_json::Value| {
        let square = [0, 1].map(|axis| entry["square"][axis].as_i64().unwrap());
        let file = index.with_file_name(entry["file"].as_str().unwrap());
        (square, file, entry.clone())
    };
    json["meshes"].as_array().unwrap().iter().map(of).collect()
}

#[test]
fn squares_together_are_the_whole_mesh_and_each_is_clean() {
    let bench = Bench::new();
    let (input, whole) = (volume(&bench), bench.path("whole.ply"));
    util::reconstruct(&input, &whole, &params());
    let whole = read(&whole);
    let around = bounds(&whole);
    for share in [0.31, 0.07, 3.0] {
        let side = share * (around[1][0] - around[0][0]);
        let folder = bench.subfolder(&format!("split-{share}"));
        let output = folder.join("mesh.ply");
        let split = Params {
            split: Some(side),
            ..params()
        };
        let report = util::reconstruct(&input, &output, &split);
        let index = meshes(&folder.join("mesh.index.json"));
        assert_eq!(index.len() as u64, report.cut.squares);
        let names: BTreeSet<_> = util::listing(&folder).into_iter().collect();
        assert_eq!(names.len(), index.len() + 1, "{names:?}");
        let (mut all, mut boundary, mut vertices) = (Vec::new(), 0, 0);
        for (square, path, entry) in index {
            let mesh = read(&path);
            let verdict = util::verdict(&path);
            assert!(verdict.manifold, "{path:?}");
            for t in &mesh.triangles {
                let sum = |axis: usize| {
                    t.iter()
                        .map(|v| mesh.vertices[*v as usize][axis])
                        .sum::<f64>()
                };
                for axis in 0..2 {
                    let at = sum(axis) / 3.0 / side;
                    let low = square[axis] as f64;
                    assert!(
                        low - 1e-9 <= at && at <= low + 1.0 + 1e-9,
                        "{at} in {square:?}"
                    );
                }
            }
            let used: BTreeSet<u32> = mesh.triangles.iter().flatten().copied().collect();
            assert_eq!(used.len(), mesh.vertices.len());
            assert_eq!(entry["vertices"], mesh.vertices.len());
            assert_eq!(entry["triangles"], mesh.triangles.len());
            assert_eq!(entry["boundary_edges"], boundary_edges(&mesh));
            let [min, max] = bounds(&mesh);
            assert_eq!(single(&entry["min"]), min);
            assert_eq!(single(&entry["max"]), max);
            boundary += boundary_edges(&mesh);
            vertices += mesh.vertices.len() as u64;
            all.extend(triangles(&mesh));
        }
        all.sort_unstable();
        assert!(all == triangles(&whole), "{share}");
        assert_eq!(report.mesh.boundary_edges, boundary);
        assert_eq!(report.mesh.vertices, vertices);
        assert_eq!(report.mesh.triangles, whole.triangles.len() as u64);
    }
}

#[test]
fn one_square_around_everything_has_the_bytes_of_the_whole_mesh() {
    let bench = Bench::new();
    // Coordinates along x and y are positive, so there is one square.
    let cloud = Cloud::new(Kind::Outdoor).points(20_000);
    let input = bench.cloud("cloud.las", &cloud);
    for (name, normals) in [
        ("a.ply", false),
        ("b.ply", true),
        ("c.obj", true),
        ("d.stl", true),
        ("e.glb", true),
        ("f.ply.zst", true),
    ] {
        let whole = bench.path(&format!("whole-{name}"));
        let plain = Params {
            normals,
            ..params()
        };
        let report = util::reconstruct(&input, &whole, &plain);
        assert!(report.mesh.pinched_copies > 0 && report.mesh.triangles > 10_000);
        let split = Params {
            split: Some(1e7),
            ..plain.clone()
        };
        let counts = util::reconstruct(&input, &bench.path(name), &split).mesh;
        assert_eq!(counts, report.mesh, "{name}");
        let (stem, extension) = name.split_once('.').unwrap();
        let square = bench.path(&format!("{stem}_0_0.{extension}"));
        assert_eq!(util::hash(&square), util::hash(&whole), "{name}");
        // A region with everything goes the same way, to a file of the name given.
        let around = Params {
            crop: Some(Region::of_numbers(&[-1e5, -1e5, 1e5, 1e5]).unwrap()),
            ..plain
        };
        let output = bench.path(&format!("crop-{name}"));
        util::reconstruct(&input, &output, &around);
        assert_eq!(util::hash(&output), util::hash(&whole), "{name}");
    }
}

#[test]
fn squares_are_the_same_for_any_threads_memory_tiles_and_pages_and_in_a_crop() {
    let bench = Bench::new();
    let input = volume(&bench);
    let bytes = |folder: &Path| -> Vec<(String, u64)> {
        let names = util::listing(folder).into_iter();
        names
            .map(|name| (name.clone(), util::hash(&folder.join(name))))
            .collect()
    };
    let whole = util::reconstruct(&input, &bench.path("whole.ply"), &params());
    let file = &whole.input.files[0];
    let (min, max) = (file.min.unwrap(), file.max.unwrap());
    let region = [min[0], min[1], (min[0] + max[0]) / 2.0, max[1]];
    let parameters = Params {
        split: Some((max[0] - min[0]) / 9.0),
        crop: Some(Region::of_numbers(&region).unwrap()),
        normals: true,
        ..params()
    };
    let mut expected = None;
    for (n, (threads, memory, tile, page)) in
        [(2, 512, 3000, 256), (1, 192, 700, 64), (3, 256, 1500, 999)]
            .into_iter()
            .enumerate()
    {
        let folder = bench.subfolder(&format!("way-{n}"));
        let run = util::builder(
            std::slice::from_ref(&input),
            &folder.join("m.ply"),
            &parameters,
        )
        .threads(threads)
        .memory(memory << 20)
        .tile_points(tile)
        .page_points(page);
        run.build().unwrap().run().unwrap();
        let found = bytes(&folder);
        assert!(found.len() > 20);
        assert_eq!(*expected.get_or_insert(found.clone()), found);
    }
}

#[test]
fn a_side_that_makes_too_many_meshes_and_names_of_inputs_are_refused() {
    let bench = Bench::new();
    let input = bench.cloud("m_1_2.ply", &Cloud::new(Kind::Sphere).points(2000));
    for (split, name) in [(0.0, "x.ply"), (f64::NAN, "x.ply"), (10.0, "m.ply")] {
        let split = Params {
            split: Some(split),
            ..Params::default()
        };
        let run = util::builder(std::slice::from_ref(&input), &bench.path(name), &split).build();
        let error = run.and_then(|run| run.run()).unwrap_err().to_string();
        assert!(
            error.starts_with("split: ") || error.contains("m_1_2.ply"),
            "{error}"
        );
    }
    assert_eq!(util::listing(bench.folder()), ["m_1_2.ply"]);
}
