//! One mesh with fewer triangles: shape, topology, values, and the same bytes however it is made.

use super::meshes::{Mesh, hills, sphere};
use outcrop::levels::single::{Goal, Options};
use outcrop::{Error, Simplification, SimplifyReport};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

pub fn job(mesh: &Path, output: &Path, goal: Goal, most: u32) -> Simplification {
    let options = Options {
        most_triangles: most,
        ..Options::of(goal)
    };
    Simplification::new(mesh, output, goal)
        .options(options)
        .memory(192 << 20)
        .threads(2)
}

pub fn read(path: &Path) -> outcrop_ply::Mesh {
    let bytes = std::fs::read(path).unwrap();
    outcrop_ply::Mesh::read(&bytes[..], bytes.len() as u64).unwrap()
}

/// Edges with their numbers of triangles, each way.
pub fn edges(triangles: &[[u32; 3]]) -> BTreeMap<[u32; 2], [u32; 2]> {
    let mut edges = BTreeMap::new();
    for [a, b, c] in triangles {
        for [a, b] in [[*a, *b], [*b, *c], [*c, *a]] {
            let ways: &mut [u32; 2] = edges.entry([a.min(b), a.max(b)]).or_default();
            ways[usize::from(a > b)] += 1;
        }
    }
    edges
}

/// Checks that it is an oriented manifold without unused vertices; returns its boundary edges and its Euler
/// characteristic.
pub fn shape(vertices: usize, triangles: &[[u32; 3]]) -> (usize, i64) {
    let edges = edges(triangles);
    assert!(edges.values().all(|[a, b]| *a <= 1 && *b <= 1));
    let used: BTreeSet<u32> = triangles.as_flattened().iter().copied().collect();
    assert_eq!(used.len(), vertices);
    // Around a vertex each other end is passed on by one triangle: one fan for each.
    let mut around: BTreeMap<u32, Vec<[u32; 2]>> = BTreeMap::new();
    for [a, b, c] in triangles {
        for [v, from, to] in [[a, b, c], [b, c, a], [c, a, b]] {
            around.entry(*v).or_default().push([*from, *to]);
        }
    }
    for fan in around.values() {
        let ends = fan
            .iter()
            .filter(|[from, _]| fan.iter().all(|[_, to]| to != from));
        let mut at = ends.clone().next().unwrap_or(&fan[0])[0];
        assert!(ends.count() <= 1, "two fans at a vertex");
        for _ in fan {
            let next = fan.iter().find(|[from, _]| *from == at);
            at = next.expect("one fan at a vertex")[1];
        }
    }
    let open = edges.values().filter(|[a, b]| a + b == 1).count();
    (
        open,
        vertices as i64 - edges.len() as i64 + triangles.len() as i64,
    )
}

fn normal(mesh: &outcrop_ply::Mesh, [a, b, c]: [u32; 3]) -> [f64; 3] {
    let [a, b, c] = [a, b, c].map(|v| mesh.vertices[v as usize]);
    let [u, v]: [[f64; 3]; 2] = [b, c].map(|p| std::array::from_fn(|k| p[k] - a[k]));
    [
        u[1] * v[2] - u[2] * v[1],
        u[2] * v[0] - u[0] * v[2],
        u[0] * v[1] - u[1] * v[0],
    ]
}

struct Made {
    report: SimplifyReport,
    mesh: outcrop_ply::Mesh,
}

fn made(mesh: &Mesh, goal: Goal, most: u32) -> Made {
    let folder = tempfile::tempdir().unwrap();
    let [path, output] = ["mesh.ply", "small.ply"].map(|name| folder.path().join(name));
    mesh.write(&path);
    let report = job(&path, &output, goal, most).run().unwrap();
    let left = std::fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(left, 2, "something is left beside");
    let mesh = read(&output);
    assert_eq!(report.triangles as usize, mesh.triangles.len());
    assert_eq!(report.vertices as usize, mesh.vertices.len());
    Made { report, mesh }
}

#[test]
fn a_sphere_stays_a_sphere() {
    let sphere = sphere(60);
    for (most, wanted) in [(1 << 17, 500), (2000, 500), (2000, 8000)] {
        let Made { report, mesh } = made(&sphere, Goal::Triangles(wanted), most);
        assert_eq!(report.triangles_before, sphere.triangles.len() as u64);
        let count = mesh.triangles.len() as f64 / wanted as f64;
        assert!((0.99..=1.01).contains(&count), "{most}: {count}");
        assert_eq!(shape(mesh.vertices.len(), &mesh.triangles), (0, 2));
        // The sphere has the radius 100.
        let sag = 8.0 * 500.0 / wanted as f64;
        for [x, y, z] in &mesh.vertices {
            let radius = (x * x + y * y + z * z).sqrt();
            assert!((radius - 100.0).abs() < sag, "{radius}");
        }
        for t in &mesh.triangles {
            let middle: [f64; 3] =
                std::array::from_fn(|k| t.iter().map(|v| mesh.vertices[*v as usize][k]).sum());
            let n = normal(&mesh, *t);
            assert!((0..3).map(|k| n[k] * middle[k]).sum::<f64>() > 0.0);
        }
        let measured = report.measured.unwrap().symmetric.figures;
        assert!(measured.max < sag && measured.mean > 0.0, "{measured:?}");
    }
}

#[test]
fn cells_leave_no_seams() {
    for shuffled in [false, true] {
        let mut mesh = hills(150, false);
        let corner = mesh.vertices.clone();
        for hole in [
            [635_070.0, 4_848_060.0],
            [635_030.0, 4_848_110.0],
            [635_075.0, 4_848_085.0],
        ] {
            mesh.triangles.retain(|t| {
                let away = |k: usize| corner[t[0] as usize][k] - hole[k];
                away(0).hypot(away(1)) > 6.0
            });
        }
        if shuffled {
            mesh.shuffle(3);
        }
        let (open, euler) = shape(used(&mesh), &mesh.triangles);
        let goal = Goal::Ratio(0.1);
        let single = made(&mesh, goal, 1 << 17);
        let many = made(&mesh, goal, 1500);
        assert!(many.report.passes > 2 && single.report.passes == 1);
        let means = [&single, &many].map(|made| {
            let (boundary, found) = shape(made.mesh.vertices.len(), &made.mesh.triangles);
            assert_eq!(found, euler, "holes went or came");
            assert!(boundary < open);
            let wanted = mesh.triangles.len() as f64 * 0.1;
            let count = made.mesh.triangles.len() as f64 / wanted;
            assert!((0.985..=1.01).contains(&count), "{count}");
            // A landscape has no overhangs.
            let up = |t: &&[u32; 3]| normal(&made.mesh, **t)[2] > 0.0;
            let over = made.mesh.triangles.len() - made.mesh.triangles.iter().filter(up).count();
            assert!(over * 500 <= made.mesh.triangles.len(), "{over}");
            made.report
                .measured
                .as_ref()
                .unwrap()
                .symmetric
                .figures
                .mean
        });
        assert!(means[1] < 1.05 * means[0], "{means:?}");
    }
}

/// Vertices that triangles have: those inside of holes are left out.
fn used(mesh: &Mesh) -> usize {
    let all: BTreeSet<u32> = mesh.triangles.as_flattened().iter().copied().collect();
    all.len()
}

#[test]
fn what_stays_does_not_ruin_the_rest() {
    // Small spheres above hills: each takes four triangles at least.
    let mut mesh = hills(70, false);
    let small = sphere(4);
    for n in 0..30 {
        let first = mesh.vertices.len() as u32;
        let at = [635_005.0 + 2.0 * f64::from(n), 4_848_035.0, 130.0];
        let moved = |p: &[f64; 3]| std::array::from_fn(|k| at[k] + p[k] / 200.0);
        mesh.vertices.extend(small.vertices.iter().map(moved));
        let triangles = small.triangles.iter().map(|t| t.map(|v| v + first));
        mesh.triangles.extend(triangles);
    }
    let Made { report, mesh } = made(&mesh, Goal::Ratio(0.001), 1 << 17);
    let (_, euler) = shape(mesh.vertices.len(), &mesh.triangles);
    assert_eq!(euler, 1 + 2 * 30);
    // 120 of the spheres, a few of the ground, and three tenths more.
    assert!(
        (150..200).contains(&report.triangles),
        "{}",
        report.triangles
    );
    assert!(
        report.to_string().contains("not 15: components"),
        "{report}"
    );
}

#[test]
fn flat_ground_takes_few_triangles_and_relief_many() {
    // Flat on one side, hills on the other.
    let mut mesh = hills(100, false);
    for p in mesh.vertices.iter_mut().filter(|p| p[0] < 635_050.0) {
        p[2] = 100.0;
    }
    let Made { report, mesh } = made(&mesh, Goal::Error(0.05), 3000);
    let flat = mesh
        .triangles
        .iter()
        .filter(|t| t.iter().all(|v| mesh.vertices[*v as usize][0] < 635_049.0));
    let (flat, all) = (flat.count(), mesh.triangles.len());
    assert!(all < 19_602 * 3 / 4 && flat * 20 < all, "{flat} of {all}");
    assert!(
        report.error <= 0.0501 && report.error > 0.03,
        "{}",
        report.error
    );
    let figures = report.measured.unwrap().symmetric.figures;
    assert!(figures.mean < 0.05 && figures.max < 0.5, "{figures:?}");
}

#[test]
fn the_boundary_and_values_can_be_kept() {
    let mut mesh = hills(60, true);
    mesh.add_values();
    let folder = tempfile::tempdir().unwrap();
    let [path, output] = ["mesh.ply", "small.ply"].map(|name| folder.path().join(name));
    mesh.write(&path);
    let goal = Goal::Ratio(0.2);
    let options = Options {
        keep_boundary: true,
        most_triangles: 900,
        ..Options::of(goal)
    };
    let run = job(&path, &output, goal, 900).options(options);
    run.run().unwrap();
    let small = read(&output);
    let place = |p: &[f64; 3]| p.map(|x| (x * 100.0).round() as i64);
    let numbers: BTreeMap<_, _> = small.vertices.iter().map(place).zip(0..).collect();
    let (mut kept, boundary) = (0, edges(&mesh.triangles));
    let open = boundary.iter().filter(|(_, [a, b])| a + b == 1);
    for v in open.flat_map(|(ends, _)| ends) {
        let at = numbers.get(&place(&mesh.vertices[*v as usize]));
        let at = *at.expect("a vertex of the boundary is kept");
        assert_eq!(small.colors[at], Mesh::values_of(*v as usize).0);
        kept += 1;
    }
    assert!(kept > 200);
    let bytes = std::fs::read(&output).unwrap();
    let text = String::from_utf8_lossy(&bytes[..600]).into_owned();
    for line in [
        "double x",
        "uchar red",
        "ushort intensity",
        "double gps_time",
    ] {
        assert!(text.contains(&format!("property {line}\n")), "{text}");
    }
}

#[test]
fn what_is_no_surface_is_left_as_it_is() {
    // Two spheres that share a vertex, a triangle on an edge of one, and triangles without area.
    let mut mesh = sphere(20);
    let count = mesh.vertices.len() as u32;
    let other = mesh.clone();
    let shifted = other.vertices.iter().map(|p| [p[0] + 300.0, p[1], p[2]]);
    mesh.vertices.extend(shifted);
    let moved = |v: u32| if v == 0 { 1 } else { v + count };
    let more = other.triangles.iter().map(|t| t.map(moved));
    mesh.triangles.extend(more);
    let [a, b, _] = mesh.triangles[40];
    mesh.triangles.push([a, b, 7]);
    mesh.triangles.extend([[5, 5, 9], [3, 8, 3]]);
    for most in [1 << 17, 500] {
        let Made { report, mesh } = made(&mesh, Goal::Ratio(0.1), most);
        assert_eq!(report.degenerate, 2);
        let edges = edges(&mesh.triangles);
        let crowded = edges
            .values()
            .filter(|[a, b]| a + b > 2 || *a > 1 || *b > 1);
        assert!(crowded.count() <= 3);
        assert!(mesh.triangles.len() < 1200, "{}", mesh.triangles.len());
    }
}

#[test]
fn memory_and_threads_change_nothing_and_formats_are_written() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let mut mesh = hills(80, true);
    mesh.add_values();
    mesh.write(&at("mesh.ply"));
    let run = |name: &str| job(&at("mesh.ply"), &at(name), Goal::Ratio(0.15), 700);
    run("first.ply").run().unwrap();
    let want = std::fs::read(at("first.ply")).unwrap();
    for (threads, memory) in [(1, 192), (5, 400), (2, 1024)] {
        let again = run("again.ply").threads(threads).memory(memory << 20);
        again.run().unwrap();
        assert!(std::fs::read(at("again.ply")).unwrap() == want, "{threads}");
    }
    let packed = zstd::encode_all(&*std::fs::read(at("mesh.ply")).unwrap(), 1).unwrap();
    std::fs::write(at("mesh.ply.zst"), packed).unwrap();
    let job = |from: &str, to: &str| job(&at(from), &at(to), Goal::Ratio(0.15), 700);
    job("mesh.ply.zst", "again.ply").run().unwrap();
    assert!(std::fs::read(at("again.ply")).unwrap() == want);
    for name in ["small.obj", "small.stl", "small.glb"] {
        job("mesh.ply", name).run().unwrap();
    }
    let small = read(&at("first.ply"));
    let stl = std::fs::read(at("small.stl")).unwrap();
    assert_eq!(stl.len(), 84 + 50 * small.triangles.len());
    assert_eq!(stl[80..84], (small.triangles.len() as u32).to_le_bytes());
    let obj = std::fs::read_to_string(at("small.obj")).unwrap();
    let lines = |start: &str| obj.lines().filter(|line| line.starts_with(start)).count();
    assert_eq!(
        (lines("v "), lines("f ")),
        (small.vertices.len(), small.triangles.len())
    );
    assert_eq!(&std::fs::read(at("small.glb")).unwrap()[..4], b"glTF");
}

#[test]
fn what_makes_no_sense_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    sphere(4).write(&at("mesh.ply"));
    let refused = |mesh: &str, output: &str, goal| {
        let error = job(&at(mesh), &at(output), goal, 100).run().unwrap_err();
        assert!(!at(&format!("{output}.outcrop-scratch")).exists());
        error
    };
    for (output, goal) in [
        ("small.ply", Goal::Triangles(0)),
        ("small.ply", Goal::Ratio(0.0)),
        ("small.ply", Goal::Ratio(f64::NAN)),
        ("small.ply", Goal::Ratio(1.5)),
        ("small.ply", Goal::Error(0.0)),
        ("small.ply", Goal::Error(f64::INFINITY)),
        ("small.ply.zst", Goal::Ratio(0.5)),
        ("small.txt", Goal::Ratio(0.5)),
        ("mesh.ply", Goal::Ratio(0.5)),
    ] {
        let error = refused("mesh.ply", output, goal);
        assert!(matches!(error, Error::Parameter { .. }), "{error}");
    }
    let quads = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
                 property float z\nelement face 1\nproperty list uchar int vertex_indices\n\
                 end_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";
    std::fs::write(at("quads.ply"), quads).unwrap();
    std::fs::write(at("far.ply"), quads.replace("4 0 1 2 3", "3 0 1 9")).unwrap();
    std::fs::write(at("none.ply"), quads.replace("4 0 1 2 3", "3 0 1 1")).unwrap();
    std::fs::write(at("nan.ply"), quads.replace("1 1 0\n", "1 nan 0\n")).unwrap();
    for name in ["far.ply", "none.ply", "nan.ply"] {
        let error = refused(name, "small.ply", Goal::Ratio(0.5));
        assert!(matches!(error, Error::Input { .. }), "{name}: {error}");
        assert!(!at("small.ply").exists());
    }
    // A mesh that has no more triangles than are wanted is the same mesh.
    job(
        &at("mesh.ply"),
        &at("small.ply"),
        Goal::Triangles(1 << 20),
        100,
    )
    .run()
    .unwrap();
    let (was, is) = (sphere(4), read(&at("small.ply")));
    assert_eq!(
        (was.vertices, was.triangles.len()),
        (is.vertices, is.triangles.len())
    );
}
