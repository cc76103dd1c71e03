//! Meshes in all formats: each has the triangles and positions of the PLY mesh.

mod packed;
mod read;

use crate::end_to_end::util::{self, Bench};
use outcrop::Reconstruction;
use outcrop::error::Error;
use outcrop::params::Params;
use outcrop::report::Report;
use outcrop_cloudgen::{Cloud, Kind};
use outcrop_disk::workspace::memory::MINIMUM_BUDGET;
use read::Mesh;
use std::collections::HashSet;
use std::path::Path;

const NAMES: [&str; 4] = ["mesh.ply", "mesh.obj", "mesh.stl", "mesh.glb"];

/// Noise and outliers, so that vertices are pinched and some points are not used.
fn cloud(points: u64) -> Cloud {
    Cloud::new(Kind::Bumpy)
        .points(points)
        .seed(11)
        .noise(1.5)
        .outliers(0.01)
        .duplicates(0.03)
        .scanlines(6.0)
}

/// Many blocks.
fn params(normals: bool) -> Params {
    Params {
        block: 1500,
        normals,
        smooth: outcrop::Smooth::Rounds(0),
        ..Params::default()
    }
}

/// Makes the mesh `name`.
fn make(bench: &Bench, input: &Path, name: &str, params: &Params) -> (Vec<u8>, Report) {
    let output = bench.path(name);
    let report = util::reconstruct(input, &output, params);
    (std::fs::read(output).unwrap(), report)
}

#[test]
fn all_formats_have_the_same_mesh() {
    let bench = Bench::new();
    let far = cloud(20_000).offset([500_000.0, 5_400_000.0, 300.0]);
    let inputs = [
        (bench.cloud("far.laz", &far), true),
        (bench.cloud("near.laz", &cloud(20_000)), false),
        (bench.cloud("doubles.ply", &cloud(20_000)), true),
    ];
    for (input, wide) in inputs {
        for normals in [false, true] {
            println!("{}, normals {normals}", input.display());
            let params = params(normals);
            let made = NAMES.map(|name| make(&bench, &input, name, &params));
            let report = &made[0].1;
            assert!(report.mesh.pinched_copies > 0 && report.mesh.points_used < report.points);
            made.iter()
                .for_each(|(_, other)| assert_eq!(other.mesh, report.mesh));
            let [(ply, _), (obj, _), (stl, _), (glb, others)] = &made;
            let (ply, double) = read::ply(ply);
            assert_eq!(double, wide);
            assert_eq!(ply.triangles.len() as u64, report.mesh.triangles);
            assert_eq!(ply.normals.is_empty(), !normals);
            same_as_text(&ply, obj);
            same_as_solid(&ply, stl, double);
            same_as_glb(&ply, glb, double);
            let said = others.warnings.concat();
            assert!(!said.contains("32-bit") && !said.contains("nx"), "{said}");
            let warnings = made[2].1.warnings.concat();
            assert_eq!(warnings.contains("32-bit floats"), wide, "{warnings}");
            assert_eq!(warnings.contains("nx, ny, nz"), normals, "{warnings}");
        }
    }
}

fn same_as_text(ply: &Mesh, bytes: &[u8]) {
    let (mesh, decimals) = read::obj(bytes);
    assert_eq!(mesh.triangles, ply.triangles);
    assert_eq!(mesh.vertices.len(), ply.vertices.len());
    let close = 0.5001 / 10f64.powi(decimals as i32) + 1e-9;
    for (a, b) in mesh
        .vertices
        .as_flattened()
        .iter()
        .zip(ply.vertices.as_flattened())
    {
        assert!((a - b).abs() <= close, "{a} {b}, {decimals} decimals");
    }
    // All places that differ still differ.
    let places = |mesh: &Mesh| -> usize {
        let places = mesh.vertices.iter().map(|v| v.map(f64::to_bits));
        places.collect::<HashSet<_>>().len()
    };
    assert_eq!(places(&mesh), places(ply));
    assert_eq!(mesh.normals.len(), ply.normals.len());
    for (a, b) in mesh
        .normals
        .as_flattened()
        .iter()
        .zip(ply.normals.as_flattened())
    {
        assert!((a - b).abs() < 6e-7, "{a} {b}");
    }
}

fn same_as_solid(ply: &Mesh, bytes: &[u8], double: bool) {
    let triangles = read::stl(bytes);
    assert_eq!(triangles.len(), ply.triangles.len());
    for ([normal, corners @ ..], t) in triangles.iter().zip(&ply.triangles) {
        let exact = t.map(|v| ply.vertices[v as usize]);
        assert_eq!(*corners, exact.map(|p| p.map(|x| x as f32)));
        let to = |k: usize| [0, 1, 2].map(|axis| exact[k][axis] - exact[0][axis]);
        let (u, v) = (to(1), to(2));
        let area = [
            u[1] * v[2] - u[2] * v[1],
            u[2] * v[0] - u[0] * v[2],
            u[0] * v[1] - u[1] * v[0],
        ];
        let norm = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let length = norm(area);
        // Normals come from the positions before these were rounded to floats for the PLY mesh.
        let rounded = if double {
            0.0
        } else {
            1e-4 * (norm(u) + norm(v))
        };
        for (a, b) in normal.iter().zip(area) {
            assert!((f64::from(*a) * length - b).abs() <= 1e-5 * length + rounded);
        }
    }
}

fn same_as_glb(ply: &Mesh, bytes: &[u8], double: bool) {
    let (mesh, translation) = read::glb(bytes);
    assert_eq!(mesh.triangles, ply.triangles);
    assert_eq!(mesh.normals, ply.normals);
    assert!(double || translation == [0.0; 3]);
    // Far clouds have one.
    assert_eq!(ply.vertices[0][1] > 1e6, translation[1] > 1e6);
    for (a, b) in mesh.vertices.iter().zip(&ply.vertices) {
        let local = [0, 1, 2].map(|k| f64::from((b[k] - translation[k]) as f32));
        assert_eq!(*a, local);
        // Floats relative to the middle are far more precise than the cloud.
        assert!((0..3).all(|k| (a[k] + translation[k] - b[k]).abs() < 4e-5));
    }
    assert_eq!(mesh.vertices.len(), ply.vertices.len());
}

#[test]
fn rounding_is_told_by_the_distance_from_the_origin_of_the_mesh() {
    let bench = Bench::new();
    let near = bench.cloud("near.laz", &cloud(2_000));
    let far = cloud(2_000).offset([500_000.0, 5_400_000.0, 300.0]);
    let far = bench.cloud("far.laz", &far);
    for (input, origin, step) in [
        (&near, "none", None),
        (&near, "-5000000,0,0", Some("0.5")),
        (&far, "none", Some("0.5")),
        (&far, "auto", None),
        (&far, "500000,5400000,0", None),
        (&far, "500000,9500000,0", Some("0.25")),
    ] {
        let params = Params {
            origin: origin.parse().unwrap(),
            ..params(false)
        };
        let (_, report) = make(&bench, input, "mesh.stl", &params);
        let said = report.warnings.concat();
        assert_eq!(
            said.contains("32-bit floats"),
            step.is_some(),
            "{origin}: {said}"
        );
        let step = step.map(|step| format!("steps of up to {step};"));
        assert!(
            step.is_none_or(|step| said.contains(&step)),
            "{origin}: {said}"
        );
    }
}

/// The sums of the triangles of the mesh on the lattice, in integers; copies have triangles of their own.
#[test]
fn normals_are_those_of_the_triangles_around_each_vertex() {
    let bench = Bench::new();
    let far = cloud(20_000).offset([500_000.0, 5_400_000.0, 300.0]);
    let input = bench.cloud("cloud.laz", &far);
    let (bytes, report) = make(&bench, &input, "mesh.ply", &params(true));
    let (mesh, _) = read::ply(&bytes);
    let step = report.lattice.step;
    let first = mesh.vertices[0];
    let place = |v: u32| -> [i128; 3] {
        let p = mesh.vertices[v as usize];
        [0, 1, 2].map(|k| ((p[k] - first[k]) / step).round() as i128)
    };
    let mut sums = vec![[0i128; 3]; mesh.vertices.len()];
    for t in &mesh.triangles {
        let [a, b, c] = t.map(place);
        let to = |p: [i128; 3]| [0, 1, 2].map(|k| p[k] - a[k]);
        let (u, v) = (to(b), to(c));
        let area = [
            u[1] * v[2] - u[2] * v[1],
            u[2] * v[0] - u[0] * v[2],
            u[0] * v[1] - u[1] * v[0],
        ];
        for v in t {
            for k in 0..3 {
                sums[*v as usize][k] += area[k];
            }
        }
    }
    for (sum, normal) in sums.iter().zip(&mesh.normals) {
        let [x, y, z] = sum.map(|x| x as f64);
        let length = (x * x + y * y + z * z).sqrt();
        let expected = match length == 0.0 {
            true => [0.0, 0.0, 1.0],
            false => [x, y, z].map(|x| (x / length) as f32),
        };
        assert_eq!(*normal, expected);
    }
    let outside = |v: &[f32; 3]| (v.iter().map(|x| x * x).sum::<f32>() - 1.0).abs() < 1e-6;
    assert!(mesh.normals.iter().all(outside));
}

#[test]
fn formats_with_normals_do_not_depend_on_threads_memory_and_parts() {
    let bench = Bench::new();
    let input = bench.cloud("cloud.laz", &cloud(10_000));
    for name in [
        "mesh.ply",
        "mesh.obj",
        "mesh.stl",
        "mesh.glb",
        "mesh.obj.zst",
        "mesh.glb.zst",
    ] {
        let params = params(true);
        let (expected, _) = make(&bench, &input, name, &params);
        if let Some(plain) = name.strip_suffix(".zst") {
            let plain = std::fs::read(bench.path(plain)).unwrap();
            assert!(zstd::decode_all(&expected[..]).unwrap() == plain, "{name}");
        }
        for (threads, memory, tile, page) in [(1, MINIMUM_BUDGET, 97, 7), (3, 4 << 30, 500, 64)] {
            let output = bench.path(&format!("again-{name}"));
            let builder = util::builder(std::slice::from_ref(&input), &output, &params)
                .threads(threads)
                .memory(memory)
                .tile_points(tile)
                .page_points(page);
            builder.build().unwrap().run().unwrap();
            assert!(
                std::fs::read(&output).unwrap() == expected,
                "{name}, {threads} threads"
            );
        }
    }
}

#[test]
fn an_unknown_extension_is_refused_before_any_work() {
    let bench = Bench::new();
    let input = bench.cloud("cloud.xyz", &cloud(500));
    let before = util::listing(bench.folder());
    for name in ["mesh", "mesh.gltf", "mesh.ply.gz", "mesh.zst", "mesh.las"] {
        let output = bench.path(name);
        for command in ["reconstruct", "plan"] {
            let said = util::run([
                command.as_ref(),
                input.as_os_str(),
                "-o".as_ref(),
                output.as_os_str(),
            ]);
            assert_eq!(said.code, Some(2), "{said:?}");
            let known = ".ply, .obj, .stl or .glb";
            assert!(
                said.err.contains("--output") && said.err.contains(known),
                "{said:?}"
            );
            assert_eq!(said.err.lines().count(), 1, "{said:?}");
        }
        let built = Reconstruction::builder()
            .input(&input)
            .output(&output)
            .build();
        assert!(
            matches!(built.err(), Some(Error::Parameter { .. })),
            "{name}"
        );
    }
    assert_eq!(util::listing(bench.folder()), before);
}

#[test]
fn a_mesh_too_large_for_its_format_is_refused_before_any_work() {
    let bench = Bench::new();
    // A LAS file of zeros, on no disk: 300 million points of 20 bytes.
    let points = 300_000_000u32;
    let mut header = vec![0; 227];
    header[..4].copy_from_slice(b"LASF");
    header[24..26].copy_from_slice(&[1, 2]);
    header[94..96].copy_from_slice(&227u16.to_le_bytes());
    header[96..100].copy_from_slice(&227u32.to_le_bytes());
    header[105..107].copy_from_slice(&20u16.to_le_bytes());
    header[107..111].copy_from_slice(&points.to_le_bytes());
    for (at, number) in [(131, 0.01), (139, 0.01), (147, 0.01), (179, 100.0)] {
        header[at..at + 8].copy_from_slice(&f64::to_le_bytes(number));
    }
    let input = bench.write("cloud.las", header);
    let file = std::fs::File::options().write(true).open(&input).unwrap();
    file.set_len(227 + 20 * u64::from(points)).unwrap();
    let before = util::listing(bench.folder());
    for command in ["reconstruct", "plan"] {
        let output = bench.path("mesh.glb");
        let said = util::run([
            command.as_ref(),
            input.as_os_str(),
            "-o".as_ref(),
            output.as_os_str(),
        ]);
        assert_eq!(said.code, Some(2), "{said:?}");
        for word in [
            "mesh.glb: GLB holds at most 4294967295 bytes",
            "about",
            ".ply",
            "--thin",
        ] {
            assert!(said.err.contains(word), "{said:?}");
        }
        assert_eq!(said.err.lines().count(), 1, "{said:?}");
    }
    // The folder of the run is begun and removed.
    assert_eq!(util::listing(bench.folder()), before);
}

/// Commands on meshes read each format that the program writes.
#[test]
fn commands_read_all_formats() {
    let bench = Bench::new();
    let input = bench.cloud("cloud.xyz", &cloud(2000));
    let (_, _) = make(&bench, &input, "mesh.ply", &Params::default());
    let counted = |text: &str| {
        let line = text.lines().find(|line| line.starts_with("triangles"));
        line.map(|line| line.replace(' ', ""))
    };
    let expected = counted(&util::run(["verify".as_ref(), bench.path("mesh.ply").as_os_str()]).out);
    assert!(expected.is_some());
    for name in [
        "mesh.obj",
        "mesh.stl",
        "mesh.glb",
        "mesh.glb.zst",
        "mesh.obj.zst",
    ] {
        let (_, _) = make(&bench, &input, name, &Params::default());
        let mesh = bench.path(name);
        let said = util::run(["verify".as_ref(), mesh.as_os_str()]);
        assert_eq!(said.code, Some(0), "{name}: {said:?}");
        assert_eq!(counted(&said.out), expected, "{name}");
        let ply = bench.path("mesh.ply");
        let (compare, samples) = ("compare".as_ref(), "--samples=10000".as_ref());
        let said = util::run([compare, samples, mesh.as_os_str(), ply.as_os_str()]);
        assert_eq!(said.code, Some(0), "{name}: {said:?}");
        let small = bench.path("small.ply");
        let said = util::run([
            "simplify".as_ref(),
            mesh.as_os_str(),
            "-o".as_ref(),
            small.as_os_str(),
            "--ratio".as_ref(),
            "0.5".as_ref(),
        ]);
        assert_eq!(said.code, Some(0), "{name}: {said:?}");
    }
}
