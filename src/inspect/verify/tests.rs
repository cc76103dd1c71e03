//! Unusual plans must not change a verdict.

use super::*;
use buckets::Buckets;
use outcrop_disk::error::Error;
use outcrop_disk::workspace::memory::MemoryPool;
use outcrop_disk::workspace::progress::{Cancel, Silent};
use outcrop_ply::{Encoding, Layout, Scalar};
use proptest::prelude::*;
use std::fmt::Write as _;
use std::sync::Arc;

fn write(workspace: &Workspace, vertices: u32, faces: &[[u32; 3]]) -> std::path::PathBuf {
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\n\
         property float z\nelement face {}\nproperty list uchar uint vertex_index\nend_header\n",
        faces.len()
    );
    for v in 0..vertices {
        writeln!(text, "{} {} {}", v % 3, v / 3 % 3, v / 9).unwrap();
    }
    for [x, y, z] in faces {
        writeln!(text, "3 {x} {y} {z}").unwrap();
    }
    let path = workspace.path("mesh.ply");
    std::fs::write(&path, text).unwrap();
    path
}

#[test]
fn no_plan_changes_the_verdict() {
    let workspace = Workspace::for_tests(2).expect("a scratch folder");
    let options = Options::default();
    let faces = prop::collection::vec(prop::array::uniform3(0u32..40), 0..120);
    let plan = (0u32..7, 1usize..40, 1u64..200, 0usize..6, any::<bool>());
    let config = ProptestConfig {
        cases: 200,
        failure_persistence: None,
        ..ProptestConfig::default()
    };
    proptest!(config, |(faces in faces, (shift, corners, block, large_star, all) in plan)| {
        let path = write(&workspace, 40, &faces);
        let expected = verify(&path, &workspace).unwrap();
        let odd = Plan {
            vertices: 40,
            shift,
            ranges: 40usize.div_ceil(1 << shift),
            all_positions: all,
            corners,
            blocks: [block; 4],
            large_star,
        };
        let mesh = PlyMesh::open(&path).unwrap();
        let (got, _) = check(mesh, &odd, &options, &workspace).unwrap();
        prop_assert_eq!(got, expected, "{:?}", odd);
        prop_assert_eq!(workspace.memory.available(), workspace.memory.capacity());
    });
}

/// A binary mesh with some coordinates that are no numbers.
fn write_binary(workspace: &Workspace, faces: &[[u32; 3]], big: bool) -> std::path::PathBuf {
    let encoding = if big { Encoding::Big } else { Encoding::Little };
    let layout = Layout {
        encoding,
        comments: &[],
        vertices: 40,
        coordinates: Scalar::F32,
        columns: &[("red", Scalar::U8)],
        triangles: Some((faces.len() as u64, Scalar::I32)),
    };
    let mut bytes = layout.header().into_bytes();
    let order = |mut word: [u8; 4]| {
        if big {
            word.reverse();
        }
        word
    };
    for v in 0..40u8 {
        let odd = if v == 17 { f32::NAN } else { 0.0 };
        for c in [
            f32::from(v % 3),
            f32::from(v / 3 % 3),
            f32::from(v / 9) + odd,
        ] {
            bytes.extend(order(c.to_le_bytes()));
        }
        bytes.push(v);
    }
    for face in faces {
        bytes.push(3);
        face.iter()
            .for_each(|v| bytes.extend(order(v.to_le_bytes())));
    }
    let path = workspace.path("binary.ply");
    std::fs::write(&path, bytes).unwrap();
    path
}

/// A grid of 6 by 6 vertices without some of its triangles.
fn grid(keep: u64) -> Vec<[u32; 3]> {
    let squares = (0..5).flat_map(|i| (0..5).map(move |j| 6 * i + j));
    let triangles = squares.flat_map(|v| [[v, v + 6, v + 7], [v, v + 7, v + 1]]);
    let kept = triangles.enumerate().filter(|(at, _)| keep >> at & 1 != 0);
    kept.map(|(_, triangle)| triangle).collect()
}

#[test]
fn pieces_change_no_verdict() {
    let workspace = Workspace::for_tests(2).expect("a scratch folder");
    let options = Options::default();
    let faces = (
        any::<u64>(),
        any::<u64>(),
        prop::collection::vec(prop::array::uniform3(0u32..42), 0..12),
        any::<prop::sample::Index>(),
    );
    let sizes = (1usize..30, 0u32..5, 1usize..12, 0u32..7, 1u64..200);
    let config = ProptestConfig {
        cases: 400,
        failure_persistence: None,
        ..ProptestConfig::default()
    };
    proptest!(config, |(
        (keep, more, others, turn) in faces,
        (piece, shift, most_groups, range, block) in sizes,
        big in any::<bool>(),
    )| {
        let mut faces = grid(keep | more);
        faces.extend(others);
        let turn = turn.index(faces.len() + 1);
        faces.rotate_left(turn);
        let path = write_binary(&workspace, &faces, big);
        let expected = verify(&path, &workspace).unwrap();
        let division = Division {
            vertices: 40,
            faces: faces.len() as u64,
            piece,
            shift,
            most_groups,
            at_home: 0,
        };
        let mut plan = Plan::of_rims(40, division.faces, 1 << 24, Some(1 << range)).unwrap();
        plan.blocks = [block; 4];
        let mesh = PlyMesh::open(&path).unwrap();
        let got = check_pieces(&mesh, division, &plan, &options, &workspace).unwrap();
        let (got, _) = got.unwrap();
        prop_assert_eq!(got, expected, "{:?} {:?}", division, faces);
        prop_assert_eq!(workspace.memory.available(), workspace.memory.capacity());
    });
}

/// A mesh large enough to be read by pieces, in its order, in another, and with a face that is no triangle.
#[test]
fn large_meshes_are_read_by_pieces_if_their_order_allows() {
    let workspace = Workspace::for_tests(2).expect("a scratch folder");
    let (rows, columns) = (1030u32, 1024u32);
    let id = |i: u32, j: u32| i * columns + j;
    let squares = (0..rows - 1).flat_map(|i| (0..columns - 1).map(move |j| (i, j)));
    let mut faces: Vec<[u32; 3]> = squares
        .filter(|(i, j)| i % 100 != 50 || j % 3 != 1)
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    let written = |faces: &[[u32; 3]], length: u8| {
        let (vertices, count) = (rows * columns, faces.len() as u64);
        let layout = Layout {
            encoding: Encoding::Little,
            comments: &[],
            vertices: vertices.into(),
            coordinates: Scalar::F64,
            columns: &[],
            triangles: Some((count, Scalar::I32)),
        };
        let mut bytes = layout.header().into_bytes();
        for v in 0..vertices {
            let [x, y] = [f64::from(v / columns), f64::from(v % columns)];
            [x, y, x * y]
                .iter()
                .for_each(|c| bytes.extend(c.to_le_bytes()));
        }
        let faces_at = bytes.len();
        faces
            .iter()
            .for_each(|face| outcrop_ply::put_triangle(*face, &mut bytes));
        bytes[faces_at] = length;
        let path = workspace.path("large.ply");
        std::fs::write(&path, bytes).unwrap();
        path
    };
    let options = Options::default();
    let read = |path: &Path| by_pieces(&PlyMesh::open(path).unwrap(), &options, &workspace);
    let path = written(&faces, 3);
    let (ordered, _) = read(&path).unwrap().unwrap();
    assert!(ordered.manifold, "{ordered}");
    assert_eq!((ordered.components, ordered.genus), (1, Some(0)));
    assert_eq!(ordered.boundary_loops, 1 + 341 * 10);
    // The same mesh, in an order without neighbours.
    let count = faces.len();
    for at in 0..count {
        faces.swap(at, (at * 1_000_003 + 17) % count);
    }
    let path = written(&faces, 3);
    assert!(read(&path).unwrap().is_none());
    assert_eq!(verify(&path, &workspace).unwrap(), ordered);
    // A face of two corners takes bytes of the last.
    let path = written(&faces, 2);
    assert!(read(&path).unwrap().is_none());
    assert!(verify(&path, &workspace).is_err());
}

/// A fan around one vertex, larger than a range may be.
#[test]
fn large_stars() {
    let workspace = Workspace::for_tests(2).expect("a scratch folder");
    let n = 30_000;
    let fan: Vec<_> = (0..n).map(|i| [n, i, (i + 1) % n]).collect();
    let path = write(&workspace, n + 1, &fan);
    let expected = verify(&path, &workspace).unwrap();
    assert!(expected.manifold, "{expected}");
    assert_eq!(
        (expected.boundary_loops, expected.euler_characteristic),
        (1, 1)
    );
    let mut plan = Plan::new(u64::from(n) + 1, u64::from(n), 100 << 20, Some(256));
    plan.corners = 1000;
    let mesh = PlyMesh::open(&path).unwrap();
    let (got, _) = check(mesh, &plan, &Options::default(), &workspace).unwrap();
    assert_eq!(got, expected);
}

#[test]
fn plans_fit_what_is_free() {
    let sizes = [
        0,
        1,
        1000,
        1 << 20,
        10_000_000,
        100_000_000,
        1 << 30,
        u64::from(u32::MAX),
    ];
    for free in [64 << 20, 144 << 20, 1 << 30, 1 << 36] {
        let workspace = {
            let memory = MemoryPool::new(free + outcrop_disk::workspace::memory::OVERHEAD);
            let Ok(memory) = memory else { continue };
            let parent = std::env::temp_dir();
            Workspace::new(&parent, memory, 2, Arc::new(Silent), Cancel::new()).unwrap()
        };
        for vertices in sizes {
            for faces in [0, 2 * vertices, 300 * vertices, 1 << 33] {
                let plan = Plan::new(vertices, faces, free, None);
                let held = plan.reserve(&workspace).unwrap();
                drop(held);
                assert_eq!(
                    plan.range(plan.ranges - 1).0 as usize,
                    (plan.ranges - 1) << plan.shift
                );
                assert!(
                    vertices == 0 || plan.range(plan.ranges - 1).1 > 0,
                    "{plan:?}"
                );
                assert!(plan.ranges as u64 * plan.blocks[1] <= free / 16, "{plan:?}");
            }
        }
    }
}

#[test]
fn damage_to_a_bucket_is_found_and_named() {
    let workspace = Workspace::for_tests(2).expect("a scratch folder");
    let mut buckets = Buckets::<[u32; 2]>::new(&workspace, "bucket", 3, 80).unwrap();
    for i in 0..1000u32 {
        buckets.push(i as usize % 3, [i, 7 * i]).unwrap();
    }
    let mut all = Vec::new();
    let mut cursor = buckets.cursor(1);
    while let Some(block) = buckets.next(&mut cursor).unwrap() {
        all.extend_from_slice(block);
    }
    all.sort_unstable();
    let expected: Vec<_> = (0..1000u32)
        .filter(|i| i % 3 == 1)
        .map(|i| [i, 7 * i])
        .collect();
    assert_eq!(all, expected);
    let path = workspace.path("bucket.0");
    let whole = std::fs::read(&path).unwrap();
    for at in [0, 9, 13, 20, 95] {
        let mut bytes = whole.clone();
        bytes[at] ^= 1;
        std::fs::write(&path, bytes).unwrap();
        let mut cursor = buckets.cursor(0);
        let error = loop {
            match buckets.next(&mut cursor) {
                Ok(Some(_)) => {}
                Ok(None) => panic!("byte {at} unnoticed"),
                Err(error) => break error,
            }
        };
        assert!(matches!(error, Error::Corrupt { .. }), "{error}");
    }
    buckets.clear(0);
    assert_eq!(buckets.next(&mut buckets.cursor(0)).unwrap(), None);
}
