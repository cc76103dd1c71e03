//! Meshes whose boundary is closed: shape, topology, values, and the same bytes however it is done.

use super::meshes::{Mesh, hills, sphere};
use super::single::{edges, read, shape};
use outcrop::params::Close;
use outcrop::{CloseReport, Closing, Error};
use std::path::Path;

struct Made {
    report: CloseReport,
    mesh: outcrop_ply::Mesh,
    /// For each triangle whether it is marked.
    filled: Vec<bool>,
}

fn job(mesh: &Path, output: &Path, kind: Close) -> Closing {
    Closing::new(mesh, output)
        .kind(kind)
        .memory(192 << 20)
        .threads(2)
}

fn made(mesh: &Mesh, kind: Close) -> Made {
    let folder = tempfile::tempdir().unwrap();
    let [path, output] = ["mesh.ply", "closed.ply"].map(|name| folder.path().join(name));
    mesh.write(&path);
    let report = job(&path, &output, kind).run().unwrap();
    let left = std::fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(left, 2, "something is left beside");
    let closed = read(&output);
    assert_eq!(report.triangles as usize, closed.triangles.len());
    assert_eq!(report.vertices as usize, closed.vertices.len());
    // What was there stays, in its order.
    assert_eq!(closed.triangles[..mesh.triangles.len()], mesh.triangles);
    assert_eq!(closed.vertices[..mesh.vertices.len()], mesh.vertices);
    let bytes = std::fs::read(&output).unwrap();
    let rows = bytes[bytes.len() - 14 * closed.triangles.len()..].chunks(14);
    let filled: Vec<bool> = rows.map(|row| row[13] == 1).collect();
    let marked = filled.iter().filter(|filled| **filled).count();
    assert_eq!(marked, closed.triangles.len() - mesh.triangles.len());
    assert!(filled[mesh.triangles.len()..].iter().all(|filled| *filled));
    Made {
        report,
        mesh: closed,
        filled,
    }
}

fn volume(mesh: &outcrop_ply::Mesh) -> f64 {
    let origin = mesh.vertices[0];
    let six = mesh.triangles.iter().map(|t| {
        let [a, b, c] = t.map(|v| {
            let p = mesh.vertices[v as usize];
            [p[0] - origin[0], p[1] - origin[1], p[2] - origin[2]]
        });
        a[0] * (b[1] * c[2] - b[2] * c[1])
            + a[1] * (b[2] * c[0] - b[0] * c[2])
            + a[2] * (b[0] * c[1] - b[1] * c[0])
    });
    six.sum::<f64>() / 6.0
}

/// A sphere of radius 100 without the triangles with a corner within `angle` degrees of one of the directions.
fn holed(side: u32, holes: &[([f64; 3], f64)]) -> Mesh {
    let mut mesh = sphere(side);
    let corner = mesh.vertices.clone();
    mesh.triangles.retain(|t| {
        holes.iter().all(|(to, angle)| {
            t.iter().all(|v| {
                let p = corner[*v as usize];
                let cosine = (0..3).map(|k| p[k] * to[k]).sum::<f64>() / 100.0;
                cosine < angle.to_radians().cos()
            })
        })
    });
    compact(&mut mesh);
    mesh
}

/// Leaves out vertices without a triangle.
fn compact(mesh: &mut Mesh) {
    let mut numbers = vec![u32::MAX; mesh.vertices.len()];
    mesh.triangles
        .as_flattened()
        .iter()
        .for_each(|v| numbers[*v as usize] = 0);
    let mut kept = Vec::new();
    for (number, at) in numbers.iter_mut().zip(&mesh.vertices) {
        if *number == 0 {
            *number = kept.len() as u32;
            kept.push(*at);
        }
    }
    mesh.vertices = kept;
    let corners = mesh.triangles.as_flattened_mut().iter_mut();
    corners.for_each(|v| *v = numbers[*v as usize]);
}

const HOLES: [([f64; 3], f64); 3] = [
    ([0.0, 0.0, 1.0], 25.0),
    ([1.0, 0.0, 0.0], 8.0),
    ([0.0, -1.0, 0.0], 3.0),
];

#[test]
fn a_sphere_is_whole_again() {
    let whole = 4.0 / 3.0 * std::f64::consts::PI * 1e6;
    let mut mesh = holed(60, &HOLES);
    let Made {
        report,
        mesh: closed,
        ..
    } = made(&mesh, Close::Auto);
    assert_eq!(shape(closed.vertices.len(), &closed.triangles), (0, 2));
    assert_eq!(
        (report.closed.smooth.loops, report.closed.lids.loops),
        (3, 0)
    );
    assert_eq!(report.closed.crossing, 0);
    let new = &closed.vertices[mesh.vertices.len()..];
    assert!(new.len() > 500, "{}", new.len());
    let away = |p: &[f64; 3]| ((0..3).map(|k| p[k] * p[k]).sum::<f64>().sqrt() - 100.0).abs();
    let worst = new.iter().map(away).fold(0.0, f64::max);
    // The cap is 9.4 high.
    assert!(worst < 0.7, "{worst}");
    let apart = volume(&closed) / whole - 1.0;
    assert!(apart.abs() < 2e-3, "{apart}");
    let lids = made(&mesh, Close::Lids);
    assert_eq!(
        shape(lids.mesh.vertices.len(), &lids.mesh.triangles),
        (0, 2)
    );
    assert_eq!(lids.report.closed.vertices, 0);
    let height = 100.0 * (1.0 - 25f64.to_radians().cos());
    let cap = std::f64::consts::PI * height * height * (300.0 - height) / 3.0;
    // Holes are wider by a part of a triangle, and there are two small ones.
    let apart = (whole - volume(&lids.mesh)) / cap - 1.0;
    assert!((0.0..0.3).contains(&apart), "{apart}");
    let area = std::f64::consts::PI * (100.0 * 25f64.to_radians().sin()).powi(2);
    let apart = lids.report.closed.lids.area / area - 1.0;
    assert!((0.1..0.35).contains(&apart), "{apart}");
    // Far away, and in any order: the same shape.
    for p in &mut mesh.vertices {
        *p = [p[0] + 635_000.0, p[1] + 4_848_000.0, p[2]];
    }
    mesh.shuffle(5);
    let far = made(&mesh, Close::Smooth).mesh;
    assert_eq!(shape(far.vertices.len(), &far.triangles), (0, 2));
    let apart = volume(&far) / whole - 1.0;
    assert!(apart.abs() < 2e-3, "{apart}");
}

#[test]
fn an_outline_gets_a_lid_and_a_hole_a_membrane() {
    // Half a sphere with a hole at the pole.
    let mut mesh = holed(40, &[([0.0, 0.0, 1.0], 12.0)]);
    let corner = mesh.vertices.clone();
    mesh.triangles
        .retain(|t| t.iter().all(|v| corner[*v as usize][2] > -1.0));
    compact(&mut mesh);
    let Made {
        report,
        mesh: closed,
        ..
    } = made(&mesh, Close::Auto);
    assert_eq!(
        (report.closed.smooth.loops, report.closed.lids.loops),
        (1, 1)
    );
    assert_eq!(shape(closed.vertices.len(), &closed.triangles), (0, 2));
    let half = 2.0 / 3.0 * std::f64::consts::PI * 1e6;
    assert!((volume(&closed) / half - 1.0).abs() < 0.02);
}

#[test]
fn a_base_makes_a_block() {
    // A plane of 40 by 30, and one with a hole and hills.
    let mut flat = Mesh::of(Vec::new(), Vec::new());
    for y in 0..=30u32 {
        for x in 0..=40u32 {
            flat.vertices.push([f64::from(x), f64::from(y), 5.0]);
        }
    }
    for y in 0..30 {
        for x in 0..40 {
            let a = y * 41 + x;
            flat.triangles.push([a, a + 1, a + 41]);
            flat.triangles.push([a + 1, a + 42, a + 41]);
        }
    }
    let Made { report, mesh, .. } = made(&flat, Close::Base(Some(2.0)));
    assert_eq!(shape(mesh.vertices.len(), &mesh.triangles), (0, 2));
    assert!((volume(&mesh) - 40.0 * 30.0 * 3.0).abs() < 1e-9);
    assert_eq!(report.closed.base.loops, 1);
    assert_eq!(report.closed.floor, Some(2.0));
    let area = 40.0 * 30.0 + 3.0 * 140.0;
    assert!((report.closed.base.area - area).abs() < 1e-9);
    assert_eq!((report.closed.overlaps, report.closed.crossing), (0, 0));
    let mut hills = hills(80, true);
    compact(&mut hills);
    let Made { report, mesh, .. } = made(&hills, Close::Base(None));
    assert_eq!(shape(mesh.vertices.len(), &mesh.triangles), (0, 2));
    assert_eq!(report.closed.base.loops, 1);
    assert!(report.closed.smooth.loops > 10, "{report}");
    assert_eq!(report.closed.crossing, 0, "{report}");
    let floor = report.closed.floor.unwrap();
    let lowest = hills.vertices.iter().map(|p| p[2]).fold(f64::MAX, f64::min);
    assert!(floor < lowest - 1.0 && floor > lowest - 3.0, "{floor}");
    // The mean height above the floor, on 79 by 79 metres.
    let high = volume(&mesh) / 79.0 / 79.0;
    assert!((high - (100.15 - floor)).abs() < 0.3, "{high}");
    let refused = tempfile::tempdir().unwrap();
    let at = |name: &str| refused.path().join(name);
    flat.write(&at("mesh.ply"));
    let error = job(&at("mesh.ply"), &at("closed.ply"), Close::Base(Some(5.0))).run();
    let error = error.unwrap_err();
    assert!(
        matches!(error, Error::Parameter { name: "close", .. }),
        "{error}"
    );
    assert_eq!(std::fs::read_dir(refused.path()).unwrap().count(), 1);
}

#[test]
fn small_and_awkward_boundaries_are_closed() {
    // A single triangle, a square of two, and a strip: their lids must not repeat what is there.
    let points = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
    ];
    let far = points.map(|p| [p[0] + 5.0, p[1], p[2]]);
    let mut mesh = Mesh::of(Vec::new(), Vec::new());
    mesh.vertices.extend(&points[..3]);
    mesh.triangles.push([0, 1, 2]);
    mesh.vertices.extend(far);
    mesh.triangles.extend([[3, 4, 5], [3, 5, 6]]);
    for n in 0..6 {
        mesh.vertices.push([f64::from(n), f64::from(n % 2), 9.0]);
    }
    for n in 7..11u32 {
        mesh.triangles.push(if n % 2 == 1 {
            [n, n + 2, n + 1]
        } else {
            [n, n + 1, n + 2]
        });
    }
    for kind in [Close::Auto, Close::Lids, Close::Smooth] {
        let Made {
            report,
            mesh: closed,
            ..
        } = made(&mesh, kind);
        assert_eq!(
            shape(closed.vertices.len(), &closed.triangles),
            (0, 6),
            "{kind:?}"
        );
        assert_eq!(report.closed.all().loops, 3);
    }
    // A closed mesh stays as it is.
    let ball = sphere(6);
    let Made { report, filled, .. } = made(&ball, Close::Auto);
    assert_eq!(report.closed.all().loops, 0);
    assert!(filled.iter().all(|filled| !filled));
    assert!(report.to_string().contains("no boundary"));
    // Two holes that meet at a vertex: it stays pinched, and every edge has two triangles.
    let mut mesh = sphere(12);
    let around: Vec<usize> = (0..mesh.triangles.len())
        .filter(|n| mesh.triangles[*n].contains(&30))
        .collect();
    let half = around.len() / 2;
    let mut gone: Vec<usize> = vec![around[0], around[half]];
    gone.sort_unstable();
    mesh.triangles.remove(gone[1]);
    mesh.triangles.remove(gone[0]);
    let Made { mesh: closed, .. } = made(&mesh, Close::Auto);
    let edges = edges(&closed.triangles);
    assert!(edges.values().all(|ways| *ways == [1, 1]));
}

#[test]
fn nothing_crosses_the_measured_surface() {
    // A sphere with a hole, and a small one in the hole, where the membrane would be.
    let mut mesh = holed(60, &[([0.0, 0.0, 1.0], 30.0)]);
    let small = sphere(6);
    let first = mesh.vertices.len() as u32;
    let moved = |p: &[f64; 3]| [p[0] * 0.06, p[1] * 0.06, p[2] * 0.06 + 99.0];
    mesh.vertices.extend(small.vertices.iter().map(moved));
    mesh.triangles
        .extend(small.triangles.iter().map(|t| t.map(|v| v + first)));
    let Made {
        report,
        mesh: closed,
        ..
    } = made(&mesh, Close::Smooth);
    assert_eq!(report.closed.flattened, 1);
    assert_eq!((report.closed.lids.loops, report.closed.crossing), (1, 0));
    assert_eq!(shape(closed.vertices.len(), &closed.triangles), (0, 4));
    // One more at the lid: it is closed nevertheless, and said.
    let first = mesh.vertices.len() as u32;
    let lower = 100.0 * 30f64.to_radians().cos() - 99.0;
    let lid = |p: &[f64; 3]| [p[0] * 0.06 + 20.0, p[1] * 0.06, p[2] * 0.06 + 99.0 + lower];
    mesh.vertices.extend(small.vertices.iter().map(lid));
    mesh.triangles
        .extend(small.triangles.iter().map(|t| t.map(|v| v + first)));
    let Made {
        report,
        mesh: closed,
        ..
    } = made(&mesh, Close::Smooth);
    assert_eq!(report.closed.crossing, 1, "{report}");
    assert!(report.closed.crossed_triangles > 0);
    assert!(
        report.to_string().contains("patches of 1 loop cross"),
        "{report}"
    );
    assert_eq!(shape(closed.vertices.len(), &closed.triangles), (0, 6));
}

#[test]
fn memory_and_threads_change_nothing_and_formats_are_written() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let mut mesh = hills(80, true);
    mesh.add_values();
    mesh.write(&at("mesh.ply"));
    for kind in [Close::Auto, Close::Base(None)] {
        job(&at("mesh.ply"), &at("first.ply"), kind).run().unwrap();
        let want = std::fs::read(at("first.ply")).unwrap();
        for (threads, memory) in [(1, 192), (5, 400), (2, 1024)] {
            let again = job(&at("mesh.ply"), &at("again.ply"), kind);
            again.threads(threads).memory(memory << 20).run().unwrap();
            assert!(std::fs::read(at("again.ply")).unwrap() == want, "{threads}");
        }
    }
    let closed = read(&at("first.ply"));
    let head = std::fs::read(at("first.ply")).unwrap();
    let head = String::from_utf8_lossy(&head[..700]).into_owned();
    assert!(head.contains("property double gps_time\n"), "{head}");
    assert!(
        head.contains("property uchar filled\nend_header\n"),
        "{head}"
    );
    for (n, color) in closed.colors.iter().enumerate() {
        match n < mesh.vertices.len() {
            true => assert_eq!(*color, Mesh::values_of(n).0),
            false => break,
        }
    }
    // The floor has the values of the rim above.
    let rim = closed.colors[mesh.vertices.len()..].iter();
    let known: std::collections::BTreeSet<_> = (0..mesh.vertices.len())
        .map(|n| Mesh::values_of(n).0)
        .collect();
    let same = rim.clone().filter(|color| known.contains(*color)).count();
    assert!(same > 300, "{same} of {}", rim.count());
    let packed = zstd::encode_all(&*std::fs::read(at("mesh.ply")).unwrap(), 1).unwrap();
    std::fs::write(at("mesh.ply.zst"), packed).unwrap();
    let from = |name: &str, to: &str| job(&at(name), &at(to), Close::Base(None)).run();
    from("mesh.ply.zst", "again.ply").unwrap();
    assert!(std::fs::read(at("again.ply")).unwrap() == std::fs::read(at("first.ply")).unwrap());
    for name in ["closed.obj", "closed.stl", "closed.glb"] {
        from("mesh.ply", name).unwrap();
    }
    let stl = std::fs::read(at("closed.stl")).unwrap();
    assert_eq!(stl.len(), 84 + 50 * closed.triangles.len());
    for (mesh, output) in [
        ("mesh.ply", "mesh.ply"),
        ("mesh.ply", "a.ply.zst"),
        ("mesh.ply", "a.txt"),
    ] {
        let error = from(mesh, output).unwrap_err();
        assert!(matches!(error, Error::Parameter { .. }), "{error}");
    }
    let quads = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
                 property float z\nelement face 1\nproperty list uchar int vertex_indices\n\
                 end_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";
    std::fs::write(at("quads.ply"), quads).unwrap();
    std::fs::write(at("far.ply"), quads.replace("4 0 1 2 3", "3 0 1 9")).unwrap();
    let nan = quads
        .replace("4 0 1 2 3", "3 0 1 2")
        .replace("1 1 0\n", "1 nan 0\n");
    std::fs::write(at("nan.ply"), nan).unwrap();
    assert_eq!(from("quads.ply", "block.ply").unwrap().triangles, 12);
    for name in ["far.ply", "nan.ply"] {
        let error = from(name, "none.ply").unwrap_err();
        assert!(matches!(error, Error::Input { .. }), "{name}: {error}");
        assert!(!at("none.ply").exists());
    }
}

#[test]
fn long_loops_are_closed() {
    // A disk with a jagged rim of 20 000 edges: too long to be smooth, and no ear is like another.
    let count = 20_000u32;
    let mut mesh = Mesh::of(vec![[0.0; 3]], Vec::new());
    for n in 0..count {
        let angle = f64::from(n) / f64::from(count) * std::f64::consts::TAU;
        let far = 100.0 + 10.0 * (40.0 * angle).sin() + f64::from(n % 7);
        mesh.vertices
            .push([far * angle.cos(), far * angle.sin(), (9.0 * angle).sin()]);
        mesh.triangles.push([0, 1 + n, 1 + (n + 1) % count]);
    }
    let Made {
        report,
        mesh: closed,
        ..
    } = made(&mesh, Close::Smooth);
    assert_eq!(
        (report.closed.too_long, report.closed.longest),
        (1, u64::from(count))
    );
    assert_eq!(shape(closed.vertices.len(), &closed.triangles), (0, 2));
    let Made {
        report,
        mesh: closed,
        ..
    } = made(&mesh, Close::Base(Some(-50.0)));
    assert_eq!(shape(closed.vertices.len(), &closed.triangles), (0, 2));
    assert_eq!(report.closed.overlaps, 0, "{report}");
    // The floor has the area of the rim.
    let rim = &mesh.vertices[1..];
    let next = rim.iter().cycle().skip(1);
    let area: f64 = rim
        .iter()
        .zip(next)
        .map(|(a, b)| a[0] * b[1] - a[1] * b[0])
        .sum();
    let floor = volume(&closed) / (area / 2.0);
    assert!((floor - 50.0).abs() < 0.1, "{floor}");
}
