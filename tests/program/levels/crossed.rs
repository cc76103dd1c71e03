//! Triangles that cross others: against brute force, and the same for any memory and threads.

use super::meshes::{Mesh, hills};
use super::single::job;
use outcrop::SimplifyReport;
use outcrop::levels::single::Goal;
use std::collections::BTreeSet;
use std::path::Path;

/// Hills, and a sheet across them. It is curved: in a plane roundings would decide what brute force finds.
fn crossed(side: u32) -> Mesh {
    let mut mesh = hills(side, false);
    let first = mesh.vertices.len() as u32;
    let below = mesh.vertices.iter().map(|[x, y, _]| {
        let [x, y] = [x + 0.013, y + 0.017];
        let (u, v) = (x - 635_000.0, y - 4_848_000.0);
        [x, y, 99.0 + 0.05 * u + 0.02 * v + 0.3 * (u * v).sin()]
    });
    let sheet: Vec<[f64; 3]> = below.collect();
    mesh.vertices.extend(sheet);
    let again = mesh.triangles.clone().into_iter();
    mesh.triangles.extend(again.map(|t| t.map(|v| v + first)));
    mesh
}

/// Six times the volume of a tetrahedron.
fn volume([a, b, c, d]: [[f64; 3]; 4]) -> f64 {
    let [u, v, w]: [[f64; 3]; 3] = [b, c, d].map(|p| std::array::from_fn(|k| p[k] - a[k]));
    u[0] * (v[1] * w[2] - v[2] * w[1]) - u[1] * (v[0] * w[2] - v[2] * w[0])
        + u[2] * (v[0] * w[1] - v[1] * w[0])
}

/// True if an edge of `s` passes through the inside of `t`.
fn pierces(s: [[f64; 3]; 3], t: [[f64; 3]; 3]) -> bool {
    [[0, 1], [1, 2], [2, 0]].iter().any(|[i, j]| {
        let (p, q) = (s[*i], s[*j]);
        let side = |x| volume([t[0], t[1], t[2], x]);
        let turns = [[0, 1], [1, 2], [2, 0]].map(|[a, b]| volume([p, q, t[a], t[b]]));
        let inside = turns.iter().all(|v| *v > 0.0) || turns.iter().all(|v| *v < 0.0);
        side(p) * side(q) < 0.0 && inside
    })
}

/// The number of triangles that cross another one with no common corner.
fn by_brute_force(mesh: &Mesh) -> usize {
    let all = &mesh.triangles;
    let corners = |t: [u32; 3]| t.map(|v| mesh.vertices[v as usize]);
    let mut found = BTreeSet::new();
    for (i, a) in all.iter().enumerate() {
        for (j, b) in all.iter().enumerate().skip(i + 1) {
            let apart = a.iter().all(|v| !b.contains(v));
            let (s, t) = (corners(*a), corners(*b));
            if apart && (pierces(s, t) || pierces(t, s)) {
                found.extend([i, j]);
            }
        }
    }
    found.len()
}

fn counted(mesh: &Path, output: &Path, (threads, memory): (usize, u64)) -> SimplifyReport {
    let job = job(mesh, output, Goal::Ratio(0.3), 1 << 17);
    job.threads(threads).memory(memory << 20).run().unwrap()
}

#[test]
fn triangles_that_cross_are_counted() {
    let folder = tempfile::tempdir().unwrap();
    let [path, output] = ["mesh.ply", "small.ply"].map(|name| folder.path().join(name));
    let mesh = crossed(30);
    mesh.write(&path);
    let found = counted(&path, &output, (2, 192)).crossings.unwrap();
    let (before, after) = (found.before, found.after);
    let want = by_brute_force(&mesh);
    assert!(want > 50, "{want}");
    assert_eq!(
        (before.tested, before.crossing),
        (mesh.triangles.len() as u64, want as u64)
    );
    let small = super::single::read(&output);
    let want = by_brute_force(&Mesh::of(small.vertices, small.triangles));
    assert!(want > 20, "{want}");
    assert_eq!(after.crossing, want as u64);
}

#[test]
fn memory_and_threads_change_no_count() {
    let folder = tempfile::tempdir().unwrap();
    let [path, output] = ["mesh.ply", "small.ply"].map(|name| folder.path().join(name));
    // More triangles than are tested, and several ranges.
    crossed(300).write(&path);
    let want = counted(&path, &output, (2, 192));
    let found = want.crossings.unwrap();
    assert!(found.before.tested == 1 << 18 && found.before.crossing > 500);
    for set in [(1, 192), (5, 400)] {
        assert_eq!(counted(&path, &output, set), want, "{set:?}");
    }
}
