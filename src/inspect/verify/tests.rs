//! Unusual plans must not change a verdict.

use super::*;
use crate::error::Error;
use crate::workspace::memory::MemoryPool;
use crate::workspace::progress::{Cancel, Silent};
use buckets::Buckets;
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
    let workspace = Workspace::for_tests(2);
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
            blocks: [block; 3],
            large_star,
        };
        let mesh = PlyMesh::open(&path).unwrap();
        let (got, _) = check(mesh, &odd, &options, &workspace).unwrap();
        prop_assert_eq!(got, expected, "{:?}", odd);
        prop_assert_eq!(workspace.memory.available(), workspace.memory.capacity());
    });
}

/// A fan around one vertex, larger than a range may be.
#[test]
fn large_stars() {
    let workspace = Workspace::for_tests(2);
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
            let memory = MemoryPool::new(free + crate::workspace::memory::OVERHEAD);
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
    let workspace = Workspace::for_tests(2);
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
