//! `verify` against a simple checker, on good meshes, on a mesh for each defect, and on random triangles,
//! with ranges of vertices so small that triangles cross their borders.

mod naive;
mod shapes;

use naive::{Counts, Mesh};
use outcrop::Error;
use outcrop::inspect::verify::{Options, Verdict, verify, verify_with};
use outcrop_disk::workspace::Workspace;
use outcrop_disk::workspace::memory::{MINIMUM_BUDGET, MemoryPool};
use outcrop_disk::workspace::progress::{Cancel, Silent};
use proptest::prelude::*;
use shapes::{both, cube, grid, shuffled, sphere, tetrahedron};
use std::fmt::Write as _;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

fn workspace(budget: u64, threads: usize) -> Workspace {
    let memory = MemoryPool::new(budget).unwrap();
    let parent = std::env::temp_dir();
    Workspace::new(&parent, memory, threads, Arc::new(Silent), Cancel::new()).unwrap()
}

/// Writes a mesh to a file of its own.
fn written(mesh: &Mesh, workspace: &Workspace) -> PathBuf {
    static FILES: AtomicUsize = AtomicUsize::new(0);
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\n\
         property double z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
        mesh.positions.len(),
        mesh.faces.len()
    );
    for [x, y, z] in &mesh.positions {
        writeln!(text, "{x} {y} {z}").unwrap();
    }
    for face in &mesh.faces {
        let corners: Vec<_> = face.iter().map(i64::to_string).collect();
        writeln!(text, "{} {}", face.len(), corners.join(" ")).unwrap();
    }
    let number = FILES.fetch_add(1, Ordering::Relaxed);
    let path = workspace.path(&format!("mesh-{number}.ply"));
    std::fs::write(&path, text).unwrap();
    path
}

fn counts(v: &Verdict) -> Counts {
    Counts {
        vertices: v.vertices,
        triangles: v.triangles,
        edges: v.edges,
        boundary_edges: v.boundary_edges,
        boundary_loops: v.boundary_loops,
        components: v.components,
        euler_characteristic: v.euler_characteristic,
        genus: v.genus,
        unreferenced_vertices: v.unreferenced_vertices,
        degenerate_triangles: v.degenerate_triangles,
        zero_area_triangles: v.zero_area_triangles,
        repeated_triangles: v.repeated_triangles,
        non_manifold_edges: v.non_manifold_edges,
        inconsistent_edges: v.inconsistent_edges,
        pinched_vertices: v.pinched_vertices,
        index_out_of_range: v.index_out_of_range,
        non_finite_vertices: v.non_finite_vertices,
        manifold: v.manifold,
    }
}

/// The verdict, equal for every size of range and to that of the simple checker.
fn agreed(mesh: &Mesh, workspace: &Workspace) -> Verdict {
    let path = written(mesh, workspace);
    let verdict = verify(&path, workspace).unwrap();
    assert_eq!(counts(&verdict), naive::check(mesh), "{mesh:?}");
    for range in [1, 2, 5, 16, 1 << 20] {
        let options = Options {
            range: Some(range),
            ..Options::default()
        };
        let other = verify_with(&path, &options, workspace).unwrap();
        assert_eq!(other, verdict, "range {range} of {mesh:?}");
    }
    assert_eq!(workspace.memory.available(), workspace.memory.capacity());
    verdict
}

fn check(mesh: &Mesh) -> Verdict {
    let verdict = agreed(mesh, &workspace(MINIMUM_BUDGET, 2));
    assert_eq!(agreed(mesh, &workspace(1 << 30, 1)), verdict);
    verdict
}

#[test]
fn good_meshes() {
    let expected = [
        // mesh, components, boundary loops, Euler characteristic, genus
        (tetrahedron(), 1, 0, 2, 0),
        (cube(), 1, 0, 2, 0),
        (sphere(12, 9), 1, 0, 2, 0),
        (grid(7, 9, [true, true], false), 1, 0, 0, 1),
        (grid(6, 5, [false, false], false), 1, 1, 1, 0),
        (grid(5, 8, [false, true], false), 1, 2, 0, 0),
        (
            both(sphere(5, 4), grid(5, 5, [true, true], false)),
            2,
            0,
            2,
            1,
        ),
        (
            both(
                grid(3, 3, [false, false], false),
                grid(4, 4, [true, true], false),
            ),
            2,
            1,
            1,
            1,
        ),
    ];
    for (mesh, components, loops, euler, genus) in expected {
        for mesh in [shuffled(&mesh), mesh] {
            let verdict = check(&mesh);
            assert!(verdict.manifold, "{verdict}");
            assert_eq!(verdict.components, components);
            assert_eq!(verdict.boundary_loops, loops);
            assert_eq!(verdict.euler_characteristic, euler);
            assert_eq!(verdict.genus, Some(genus));
        }
    }
}

#[test]
fn moebius_strip_is_inconsistent() {
    let verdict = check(&grid(2, 9, [false, true], true));
    assert!(!verdict.manifold);
    assert_eq!((verdict.inconsistent_edges, verdict.boundary_loops), (2, 1));
    assert_eq!(
        (verdict.non_manifold_edges, verdict.pinched_vertices),
        (0, 0)
    );
    assert_eq!(verdict.genus, None);
}

/// Name of a defect, its count, and the change of a good mesh that causes it.
type Case<'a> = (&'a str, u64, &'a dyn Fn(&mut Mesh));

/// Each defect, alone if possible.
#[test]
fn every_defect_is_found() {
    let spoiled = |spoil: &dyn Fn(&mut Mesh)| {
        let mut mesh = sphere(7, 6);
        spoil(&mut mesh);
        check(&shuffled(&mesh));
        check(&mesh)
    };
    let cases: [Case<'_>; 9] = [
        ("non-manifold edges", 1, &|m| {
            m.positions.push([1.0, 99.0, 5.0]);
            m.faces.push(vec![0, 1, m.positions.len() as i64 - 1]);
        }),
        ("pinched vertices", 1, &|m| {
            let n = m.positions.len() as i64;
            m.positions.extend([[1.0, 99.0, 5.0], [2.0, 99.0, 8.0]]);
            m.faces.push(vec![3, n, n + 1]);
        }),
        ("inconsistently oriented edges", 3, &|m| {
            m.faces[10].reverse()
        }),
        ("degenerate triangles", 1, &|m| m.faces.push(vec![4, 9, 4])),
        ("repeated triangles", 1, &|m| {
            m.faces.push(m.faces[8].clone())
        }),
        ("repeated triangles", 2, &|m| {
            let [a, b, c] = m.faces[8][..] else { return };
            m.faces.extend([vec![b, c, a], vec![c, b, a]]);
        }),
        ("unreferenced vertices", 2, &|m| {
            m.positions.extend([[0.0; 3]; 2])
        }),
        ("triangles with an index out of range", 3, &|m| {
            let n = m.positions.len() as i64;
            m.faces.extend([
                vec![0, 1, n],
                vec![-1, 2, 3],
                vec![5, i64::from(i32::MAX), 6],
            ]);
        }),
        ("non-finite vertices", 2, &|m| {
            m.positions[3][1] = f64::NAN;
            m.positions[7][2] = f64::INFINITY;
        }),
    ];
    for (name, count, spoil) in cases {
        let verdict = spoiled(spoil);
        let found: Vec<_> = verdict.defects().into_iter().filter(|d| d.1 > 0).collect();
        assert!(found.contains(&(name, count)), "{name}: {found:?}");
        assert!(!verdict.manifold, "{name}");
        // A repeated triangle causes edges with three or more triangles; the others occur alone.
        assert!(
            found.len() == 1 || name == "repeated triangles",
            "{name}: {found:?}"
        );
        let text = verdict.to_string();
        assert!(text.starts_with("manifold: no\n"), "{text}");
        assert!(
            text.lines()
                .any(|l| l.contains(name) && l.ends_with(&count.to_string())),
            "{text}"
        );
    }
}

#[test]
fn unreferenced_vertices_can_be_allowed() {
    let mut mesh = tetrahedron();
    mesh.positions.push([9.0; 3]);
    let workspace = workspace(MINIMUM_BUDGET, 2);
    let path = written(&mesh, &workspace);
    let options = Options {
        allow_unreferenced: true,
        ..Options::default()
    };
    let verdict = verify_with(&path, &options, &workspace).unwrap();
    assert!(verdict.manifold);
    assert_eq!(verdict.unreferenced_vertices, 1);
    assert!(!verify(&path, &workspace).unwrap().manifold);
}

#[test]
fn zero_area_is_told_but_passes() {
    let mut mesh = sphere(7, 6);
    mesh.positions[9] = mesh.positions[10];
    let verdict = check(&mesh);
    assert_eq!((verdict.manifold, verdict.zero_area_triangles), (true, 2));
}

#[test]
fn empty_mesh() {
    let verdict = check(&Mesh::default());
    assert!(verdict.manifold);
    assert_eq!((verdict.genus, verdict.bounds), (None, None));
}

#[test]
fn summary_and_json() {
    let verdict = check(&cube());
    let text = verdict.to_string();
    assert!(text.starts_with("manifold: yes\nvertices "), "{text}");
    assert!(text.ends_with("box  0 0 0  to  1 1 1"), "{text}");
    let widths: Vec<_> = text.lines().skip(1).map(str::len).collect();
    assert!(widths[..11].iter().all(|w| *w == 54), "{text}");
    assert!(text.contains(&format!("\n{:<40}{:>14}\n", "closed", "yes")));
    assert_eq!((verdict.closed, verdict.volume), (true, Some(1.0)));
    let json = serde_json::to_value(verdict).unwrap();
    assert_eq!(json["edges"], 18);
    assert_eq!(json["manifold"], true);
    assert_eq!(json["bounds"]["max"][2], 1.0);
}

#[test]
fn random_soups() {
    let (small, large) = (workspace(MINIMUM_BUDGET, 2), workspace(1 << 30, 1));
    let index = |n: i64| prop_oneof![60 => 0..n, 1 => -2..n + 2];
    let soup = (3i64..14).prop_flat_map(move |n| {
        let position = prop::array::uniform3(0i32..4);
        let face = prop_oneof![
            40 => prop::collection::vec(index(n), 3),
            1 => prop::collection::vec(index(n), 0..6),
        ];
        let size = prop_oneof![0usize..6, 0usize..30];
        let faces = size.prop_flat_map(move |size| prop::collection::vec(face.clone(), size));
        (
            prop::collection::vec(position, n as usize),
            faces,
            0usize..40,
        )
    });
    let config = ProptestConfig {
        cases: 400,
        failure_persistence: None,
        ..Default::default()
    };
    proptest!(config, |((positions, faces, spoil) in soup)| {
        let positions = positions.into_iter().map(|p| p.map(f64::from)).collect();
        let mut mesh = Mesh { positions, faces };
        if let Some(p) = mesh.positions.get_mut(spoil) {
            p[spoil % 3] = f64::NEG_INFINITY;
        }
        let verdict = agreed(&mesh, &small);
        prop_assert_eq!(agreed(&mesh, &large), verdict);
    });
}

/// Nearly a manifold: a closed or open grid with triangles removed, turned and doubled.
#[test]
fn random_damage() {
    let workspace = workspace(MINIMUM_BUDGET, 2);
    let config = ProptestConfig {
        cases: 100,
        failure_persistence: None,
        ..Default::default()
    };
    proptest!(config, |(
        (n, m) in (3i64..8, 3i64..8),
        (a, b, twist, mix) in any::<(bool, bool, bool, bool)>(),
        drops in prop::collection::vec(any::<prop::sample::Index>(), 0..20),
        turns in prop::collection::vec(any::<prop::sample::Index>(), 0..3),
        merges in prop::collection::vec(any::<[prop::sample::Index; 2]>(), 0..3),
    )| {
        let mut mesh = grid(n, m, [a, b], twist);
        for at in drops.iter().take(mesh.faces.len() - 1) {
            mesh.faces.swap_remove(at.index(mesh.faces.len()));
        }
        for at in turns { let at = at.index(mesh.faces.len()); mesh.faces[at].reverse(); }
        for [from, to] in merges {
            let (from, to) = (from.index(mesh.positions.len()), to.index(mesh.positions.len()));
            let corners = mesh.faces.iter_mut().flatten();
            corners.filter(|v| **v == from as i64).for_each(|v| *v = to as i64);
        }
        agreed(&if mix { shuffled(&mesh) } else { mesh }, &workspace);
    });
}

#[test]
fn errors_name_file_and_place() {
    let workspace = workspace(MINIMUM_BUDGET, 1);
    let path = workspace.path("mesh.ply");
    let missing = verify(&path, &workspace).unwrap_err();
    assert!(matches!(missing, Error::Io { .. }), "{missing}");
    std::fs::write(&path, "solid cube\nfacet normal 0 0 1\n").unwrap();
    let text = verify(&path, &workspace).unwrap_err().to_string();
    assert!(
        text.ends_with("mesh.ply: PLY header, line 1: found \"solid cube\", expected \"ply\""),
        "{text}"
    );
    let path = written(&cube(), &workspace);
    workspace.cancel.cancel();
    assert!(matches!(verify(&path, &workspace), Err(Error::Cancelled)));
}

#[test]
fn refuses_what_does_not_fit() {
    let workspace = workspace(MINIMUM_BUDGET, 1);
    let path = written(&cube(), &workspace);
    let options = Options {
        range: Some(1 << 31),
        ..Options::default()
    };
    verify_with(&path, &options, &workspace).unwrap();
    let held = workspace
        .reserve("other", workspace.memory.capacity() - 1000)
        .unwrap();
    let error = verify(&path, &workspace).unwrap_err();
    assert!(matches!(error, Error::Memory { .. }), "{error}");
    drop(held);
}
