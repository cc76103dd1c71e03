//! Tests of the reference implementation itself.

use crate::reference::base::base;
use crate::reference::check::check;
use crate::reference::clouds::Random;
use crate::reference::{Mesh, Radius, Settings, cells, clouds, from_triples, narrow, reconstruct};
use outcrop_geom::Point;
use std::collections::BTreeSet;

fn kind(name: &str) -> usize {
    clouds::KINDS
        .iter()
        .position(|(n, _)| *n == name)
        .expect("a kind of this name")
}

/// The mesh of a cloud, checked for all properties of every mesh.
fn checked(points: &[Point], settings: &Settings) -> Mesh {
    let mesh = reconstruct(points, settings);
    let counts = mesh.counts;
    check(&mesh, settings.repair).unwrap_or_else(|e| panic!("{e}: {counts:?}"));
    mesh
}

#[test]
fn a_tetrahedron_closes_if_its_cells_agree() {
    let points = [[0, 0, 0], [10, 10, 0], [10, 0, 10], [0, 10, 10]];
    let settings = Settings {
        cos_max_angle: -1.0,
        min_component: 0,
        radius: Radius::Length(100.0),
        ..Settings::default()
    };
    // No plane through four such points is better than another: each triple lacks a cell, and without a base
    // no candidate can be inserted.
    let counts = checked(&points, &settings).counts;
    assert_eq!((counts.t3, counts.t2, counts.t1, counts.base), (0, 4, 0, 0));
    for block in [1, 2, 4] {
        // Two adjacent T3, and two T12 that close the rest.
        let triples = [
            ([0, 1, 2], 3),
            ([0, 1, 3], 3),
            ([0, 2, 3], 2),
            ([1, 2, 3], 1),
        ]
        .into();
        let ordered = cells::in_id_order(&points);
        let mesh = from_triples(ordered, &triples, &Settings { block, ..settings });
        let shape = check(&mesh, true).unwrap();
        assert_eq!(
            (shape.triangles, shape.boundary),
            (4, 0),
            "{:?}",
            mesh.counts
        );
        assert!(
            mesh.triangles
                .iter()
                .map(|t| volume6(&mesh, *t, 0.0))
                .sum::<f64>()
                > 0.0
        );
    }
}

#[test]
fn an_octahedron_is_closed_at_once() {
    let points = [
        [0, 5, 5],
        [10, 5, 5],
        [5, 0, 5],
        [5, 10, 5],
        [5, 5, 0],
        [5, 5, 10],
    ];
    let settings = Settings {
        neighbors: 4,
        // The corners of its cells are as far away as its neighbours.
        radius: Radius::Length(8.0),
        min_component: 8,
        ..Settings::default()
    };
    let mesh = checked(&points, &settings);
    assert_eq!((mesh.counts.t3, mesh.triangles.len()), (8, 8));
    assert!(mesh.triangles.iter().all(|t| volume6(&mesh, *t, 5.0) > 0.0));
}

#[test]
fn a_small_sphere_is_closed_and_faces_outwards() {
    // A hundred points, evenly spread.
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let point = |k: usize| {
        let z = 1.0 - 2.0 * (k as f64 + 0.5) / 100.0;
        let (flat, turn) = ((1.0 - z * z).sqrt(), golden * k as f64);
        [flat * turn.cos(), flat * turn.sin(), z].map(|x| (1000.0 * x).round() as i32 + 1000)
    };
    let points: Vec<Point> = (0..100).map(point).collect();
    for block in [7, 20, 65_536] {
        let settings = Settings {
            neighbors: 10,
            block,
            ..Settings::default()
        };
        let mesh = checked(&points, &settings);
        let shape = check(&mesh, true).unwrap();
        assert_eq!(
            (shape.boundary, shape.euler(), shape.vertices),
            (0, 2, 100),
            "{shape:?}"
        );
        let volume: f64 = mesh
            .triangles
            .iter()
            .map(|t| volume6(&mesh, *t, 1000.0))
            .sum();
        assert!(
            volume / 6.0 > 0.8 * 4.0 / 3.0 * std::f64::consts::PI * 1e9,
            "{volume}"
        );
    }
}

/// Six times the volume of the tetrahedron of a triangle and the point with three equal coordinates.
fn volume6(mesh: &Mesh, t: [u32; 3], middle: f64) -> f64 {
    let at = t.map(|v| {
        let id = mesh.vertices[v as usize];
        mesh.ids[id as usize].map(|x| f64::from(x) - middle)
    });
    let [a, b, c] = at;
    a[0] * (b[1] * c[2] - b[2] * c[1])
        + a[1] * (b[2] * c[0] - b[0] * c[2])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
}

#[test]
fn flat_grids_have_no_holes_and_only_full_triples_inside() {
    for (name, block) in [
        ("grid", 9),
        ("grid", 65_536),
        ("turned grid", 16),
        ("skewed grid", 50),
    ] {
        let points = clouds::cloud(kind(name), 100, 1);
        let settings = Settings {
            neighbors: 8,
            block,
            ..Settings::default()
        };
        let mesh = checked(&points, &settings);
        let shape = check(&mesh, true).unwrap();
        assert_eq!(shape.vertices, 100, "{name}: {:?}", mesh.counts);
        assert_eq!(shape.euler(), 1, "{name}: {:?}", mesh.counts);
        if name != "skewed grid" {
            assert_eq!(
                (mesh.counts.t3, mesh.counts.t2, mesh.counts.t1),
                (162, 0, 0),
                "{name}"
            );
            assert_eq!((shape.triangles, shape.boundary), (162, 36), "{name}");
        }
    }
}

#[test]
fn a_line_has_no_surface() {
    let mesh = checked(&clouds::cloud(kind("line"), 60, 1), &Settings::default());
    assert_eq!((mesh.triangles.len(), mesh.vertices.len()), (0, 0));
}

#[test]
fn a_gap_in_a_grid_is_a_hole_that_can_be_filled() {
    let at = |k: i32| [k % 12 * 10, k / 12 * 10, 0];
    let gap = |p: &Point| (40..70).contains(&p[0]) && (40..70).contains(&p[1]);
    let points: Vec<Point> = (0..144).map(at).filter(|p| !gap(p)).collect();
    let settings = Settings {
        neighbors: 8,
        radius: Radius::Length(15.0),
        max_hole_edges: 11,
        ..Settings::default()
    };
    let open = checked(&points, &settings);
    assert_eq!(
        (open.counts.holes.loops, open.counts.holes.too_long),
        (2, 2)
    );
    assert_eq!(check(&open, true).unwrap().euler(), 0);
    let closed = checked(
        &points,
        &Settings {
            max_hole_edges: 500,
            ..settings
        },
    );
    let holes = closed.counts.holes;
    assert_eq!(
        (holes.filled, holes.outlines, holes.triangles),
        (1, 1, 10),
        "{holes:?}"
    );
    assert_eq!(check(&closed, true).unwrap().euler(), 1);
}

#[test]
fn a_wide_hole_is_closed_at_its_rim() {
    let settings = |max_fill| Settings {
        neighbors: 30,
        relax: 0,
        max_fill,
        ..Settings::robust()
    };
    let points = clouds::wide_hole(0);
    let [closed, narrowed] = [f64::INFINITY, 8.0].map(|w| checked(&points, &settings(w)));
    let holes = [&closed, &narrowed].map(|mesh| mesh.counts.holes);
    assert_eq!(
        holes.map(|h| (h.filled, h.left_open)),
        [(1, 0), (0, 1)],
        "{holes:?}"
    );
    assert!(narrowed.triangles.len() < closed.triangles.len() && holes[1].triangles > 30);
    let euler = |mesh: &Mesh| check(mesh, true).unwrap().euler();
    assert!(euler(&closed) == 1 && euler(&narrowed) <= 0);
}

#[test]
fn what_lies_between_two_that_are_left_out_is_left_out() {
    let fan: Vec<[usize; 3]> = (1..7).map(|k| [0, k, k + 1]).collect();
    let out = |filling: &[[usize; 3]], wide: &[usize]| {
        let wide: Vec<[usize; 3]> = wide.iter().map(|&t| filling[t]).collect();
        narrow::left_out(8, filling, |t| wide.contains(t))
    };
    assert_eq!(out(&fan, &[]), [false; 6]);
    assert_eq!(out(&fan, &[3]), [false, false, false, true, false, false]);
    assert_eq!(out(&fan, &[1, 3]), [false, true, true, true, false, false]);
    // An octagon: the corners cut off, and the two halves of the middle.
    let octagon = [
        [0, 1, 2],
        [2, 3, 4],
        [4, 5, 6],
        [6, 7, 0],
        [0, 2, 4],
        [0, 4, 6],
    ];
    let only = |left: [usize; 6]| left.map(|out| out == 1);
    assert_eq!(out(&octagon, &[5]), only([0, 0, 0, 0, 0, 1]));
    // At corner 0 the other half is between.
    assert_eq!(out(&octagon, &[0, 5]), only([1, 0, 0, 0, 1, 1]));
}

#[test]
fn a_moebius_band_is_cut_open() {
    let points = clouds::cloud(kind("moebius band"), 300, 1);
    let settings = Settings {
        neighbors: 8,
        ..Settings::default()
    };
    let mesh = checked(&points, &settings);
    assert!(mesh.counts.one_sided > 0, "{:?}", mesh.counts);
}

#[test]
fn the_order_of_points_and_duplicates_do_not_matter() {
    let points = clouds::cloud(kind("sphere"), 80, 5);
    let mut other = points.clone();
    other.reverse();
    other.extend(&points[..20]);
    let settings = Settings {
        neighbors: 10,
        ..Settings::default()
    };
    assert_eq!(
        reconstruct(&points, &settings),
        reconstruct(&other, &settings)
    );
}

#[test]
fn every_mesh_of_every_cloud_is_a_manifold() {
    for seed in 0..6 {
        for (name, points) in clouds::one_of_each(seed) {
            for settings in varied(seed) {
                println!("{name} {seed} {settings:?}");
                checked(&points, &settings);
            }
        }
    }
}

#[test]
fn edges_of_three_triangles_and_vertices_by_excess_are_flagged() {
    let book = BTreeSet::from([[0, 1, 2], [0, 1, 3], [0, 1, 4], [1, 2, 5]]);
    let found = base(&book, 100);
    assert_eq!(
        found.flagged,
        BTreeSet::from([[0, 1, 2], [0, 1, 3], [0, 1, 4]])
    );
    let cone = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 1, 4]];
    let other = [[0, 5, 6], [0, 6, 7]];
    let found = base(&cone.into_iter().chain(other).collect(), 100);
    assert_eq!(found.flagged, BTreeSet::from(other));
}

#[test]
fn of_points_in_one_place_only_the_first_is_seen() {
    for seed in 20..24 {
        for (name, points) in clouds::one_of_each(seed) {
            let mut points = cells::in_id_order(&points);
            let count = points.len();
            points.extend_from_within(..count / 2);
            for triple in cells::triples(&points, &varied(seed)[1], 1000.0, None)
                .0
                .keys()
            {
                assert!((triple[2] as usize) < count, "{name} {seed} {triple:?}");
            }
        }
    }
}

/// Cells never give an edge with three T3; other triples do.
#[test]
fn triples_with_any_counts_make_manifolds() {
    let (mut flagged, mut merges_reverted) = (0, 0);
    for seed in 50..56 {
        let mut random = Random::new(seed);
        for (name, points) in clouds::one_of_each(seed) {
            let [settings, ..] = varied(seed);
            let points = cells::in_id_order(&points);
            let (mut triples, _) = cells::triples(&points, &settings, 0.0, None);
            triples
                .values_mut()
                .for_each(|count| *count = random.integer(1, 4) as u32);
            let mesh = from_triples(points, &triples, &settings);
            check(&mesh, true).unwrap_or_else(|e| panic!("{name} {seed}: {e}"));
            flagged += mesh.counts.flagged;
            merges_reverted += mesh.counts.merges_reverted;
        }
    }
    assert!(flagged > 0 && merges_reverted > 0);
}

#[test]
fn the_triangle_that_closes_a_moebius_band_is_removed() {
    // The smallest band: five vertices, five triangles.
    let band = (0..5u32).map(|k| {
        let mut t = [k, (k + 1) % 5, (k + 2) % 5];
        t.sort_unstable();
        t
    });
    for block in [2, 100] {
        let found = base(&band.clone().collect(), block);
        assert!(found.flagged.is_empty());
        assert_eq!(found.one_sided.len(), 1);
    }
}

/// Settings that cover different parts of the method.
fn varied(seed: u64) -> [Settings; 4] {
    let plain = Settings {
        neighbors: 10,
        min_component: 1,
        ..Settings::default()
    };
    let percent = Radius::Percent([5.0, 0.5, 40.0][seed as usize % 3]);
    [
        Settings {
            block: [16, 40, 100][seed as usize % 3],
            ..plain
        },
        Settings {
            radius: percent,
            neighbors: 30,
            block: 25,
            cos_max_angle: -0.5,
            ..plain
        },
        Settings {
            smooth: 2,
            repair: seed.is_multiple_of(2),
            block: 10,
            ..plain
        },
        Settings {
            neighbors: 10,
            relax: 1 + seed as u32 % 3,
            block: [30, 12, 80][seed as usize % 3],
            patch: [8, 256][seed as usize % 2],
            cluster: [3, 20, 1024][seed as usize % 3],
            min_component: 1 + seed as usize % 2 * 9,
            max_fill: [8.0, 2.0, 1.2][seed as usize % 3],
            ..Settings::robust()
        },
    ]
}
