//! Clouds that are no scans of a surface: the result is always a mesh that `verify` accepts or a clear error,
//! and the same for any threads, memory, tiles and order of the points.

use crate::end_to_end::util::{self, Bench};
use outcrop::Error;
use outcrop::params::{Method, Params, Radius, Smoothing};
use outcrop_cloudgen::{Cloud, Kind, NoiseMode, Odd};
use outcrop_disk::workspace::memory::MINIMUM_BUDGET;
use proptest::prelude::*;
use std::path::Path;

/// The outcome of a run.
#[derive(Debug, PartialEq, Eq)]
enum Outcome {
    /// A mesh with this hash and number of triangles.
    Mesh(u64, u64),
    /// No mesh, with the reason.
    Refused(String),
}

/// Settings of a run that must not affect the result.
struct Way {
    threads: usize,
    memory: u64,
    tile: u32,
    page: usize,
}

const USUAL: Way = Way {
    threads: 2,
    memory: MINIMUM_BUDGET,
    tile: 1 << 16,
    page: 256,
};

const OTHERS: [Way; 2] = [
    Way {
        threads: 1,
        memory: 1 << 30,
        tile: 97,
        page: 7,
    },
    Way {
        threads: 3,
        memory: MINIMUM_BUDGET,
        tile: 700,
        page: 64,
    },
];

fn outcome(cloud: &Path, mesh: &Path, params: &Params, way: &Way) -> Outcome {
    let run = util::builder(&[cloud.into()], mesh, params)
        .threads(way.threads)
        .memory(way.memory)
        .tile_points(way.tile)
        .page_points(way.page)
        .build()
        .unwrap()
        .run();
    match run {
        Ok(report) => {
            let verdict = util::verdict(mesh);
            assert!(verdict.manifold, "{verdict:?}");
            assert!(report.mesh.triangles > 0);
            let hash = util::hash(mesh);
            std::fs::remove_file(mesh).unwrap();
            Outcome::Mesh(hash, report.mesh.triangles)
        }
        Err(error @ (Error::Degenerate { .. } | Error::NoTriangles { .. })) => {
            assert!(!mesh.exists());
            Outcome::Refused(error.to_string())
        }
        Err(error) => panic!("{error}"),
    }
}

/// Methods and kinds of smoothing that treat odd clouds differently.
fn options() -> Vec<Params> {
    let robust = Params::default();
    vec![
        robust.clone(),
        Params::paper(),
        Params {
            smooth: outcrop::Smooth::Rounds(2),
            ..robust.clone()
        },
        Params {
            smooth: outcrop::Smooth::Rounds(1),
            smoothing: Smoothing::Plain,
            radius: Radius::Percent(5.0),
            ..Params::paper()
        },
        Params {
            drop_outliers: Some(2.0),
            repair: false,
            block: 500,
            ..robust
        },
    ]
}

/// Runs with all options, the first one in all ways and the others in one; returns the outcomes.
fn every_option(bench: &Bench, cloud: &Path) -> Vec<Outcome> {
    let mesh = bench.path("mesh.ply");
    let each = options().into_iter().enumerate().map(|(number, params)| {
        let usual = outcome(cloud, &mesh, &params, &USUAL);
        let others = if number == 0 {
            &OTHERS[..]
        } else {
            &OTHERS[number % 2..=number % 2]
        };
        for way in others {
            let other = outcome(cloud, &mesh, &params, way);
            assert_eq!(usual, other, "{params:?}");
        }
        usual
    });
    each.collect()
}

fn refused(outcomes: &[Outcome]) -> bool {
    outcomes.iter().all(|o| matches!(o, Outcome::Refused(_)))
}

fn generated(kind: Kind, points: u64) -> Vec<Outcome> {
    let bench = Bench::new();
    let cloud = bench.cloud("cloud.ply", &Cloud::new(kind).points(points));
    every_option(&bench, &cloud)
}

#[test]
fn every_odd_cloud() {
    for odd in Odd::ALL {
        let outcomes = generated(Kind::Odd(odd), 1500);
        println!("{}: {outcomes:?}", odd.name());
        match odd {
            Odd::OnePlace | Odd::LineGrid => assert!(refused(&outcomes), "{}", odd.name()),
            Odd::TwoClusters | Odd::DenseInSparse | Odd::Shell | Odd::FewPlaces => {
                assert!(
                    matches!(outcomes[0], Outcome::Mesh(..)),
                    "{}: {outcomes:?}",
                    odd.name()
                );
            }
            _ => {}
        }
    }
}

#[test]
fn every_odd_cloud_of_few_points() {
    for odd in Odd::ALL {
        for points in [1, 2, 3, 4, 13] {
            let outcomes = generated(Kind::Odd(odd), points);
            assert!(points > 2 || refused(&outcomes), "{}", odd.name());
        }
    }
}

#[test]
fn planes_grids_and_steps() {
    let plane = Cloud::new(Kind::Plane).points(1500);
    let clouds = [
        ("plane.ply", plane.clone()),
        ("tilted.ply", plane.clone().rotated(true)),
        ("grid.ply", Cloud::new(Kind::Grid).points(1500)),
        (
            "turned.ply",
            Cloud::new(Kind::Grid).points(1500).rotated(true),
        ),
        // Steps of one thousandth.
        ("below.las", plane.clone().rotated(true).noise(0.0003)),
        ("apart.las", plane.layers(2, 0.001)),
    ];
    let bench = Bench::new();
    for (name, cloud) in clouds {
        let path = bench.cloud(name, &cloud);
        let outcomes = every_option(&bench, &path);
        for outcome in &outcomes[..4] {
            assert!(
                matches!(outcome, Outcome::Mesh(_, n) if *n > 2500),
                "{name}: {outcomes:?}"
            );
        }
    }
}

/// Vertices and cells with hundreds of neighbours at about the same distance.
#[test]
fn hubs_of_circles() {
    let circle = |count: usize, radius: f64, part: f64| {
        let at = move |k: usize| {
            let (sin, cos) = (std::f64::consts::TAU * part * k as f64 / count as f64).sin_cos();
            let rough = f64::from((k * k % 11) as u32) * 1e-6;
            [radius * cos + rough, radius * sin, rough * 1e-3]
        };
        (0..count).map(at)
    };
    let centre = || std::iter::once([0.0; 3]);
    let clouds: [Vec<[f64; 3]>; 3] = [
        centre().chain(circle(700, 1.0, 0.4)).collect(),
        centre()
            .chain(circle(500, 1.0, 1.0))
            .chain(circle(500, 0.5, 1.0))
            .collect(),
        circle(20, 1e-4, 1.0).chain(circle(900, 1.0, 1.0)).collect(),
    ];
    let bench = Bench::new();
    for (number, points) in clouds.iter().enumerate() {
        let cloud = bench.points(&format!("{number}.xyz"), points);
        println!("{number}: {:?}", every_option(&bench, &cloud));
    }
}

/// Steps of 1e-4 at coordinates of 1e7 need double precision throughout.
#[test]
fn far_from_zero_in_fine_steps() {
    let bench = Bench::new();
    let sphere = |offset| {
        let cloud = Cloud::new(Kind::Sphere)
            .points(800)
            .size(0.5)
            .offset(offset);
        let generator = cloud.generator().unwrap();
        let points = generator.iter().map(|p| p.map(|c| (c * 1e4).round() / 1e4));
        points.collect::<Vec<_>>()
    };
    let near = bench.points("near.xyz", &sphere([0.0; 3]));
    let far = bench.points("far.xyz", &sphere([1e7, -1e7, 1e7]));
    let triangles = |cloud: &Path| {
        let outcomes = every_option(&bench, cloud);
        outcomes
            .into_iter()
            .map(|o| match o {
                Outcome::Mesh(_, triangles) => triangles,
                Outcome::Refused(why) => panic!("{why}"),
            })
            .collect::<Vec<_>>()
    };
    let (near, far) = (triangles(&near), triangles(&far));
    for (near, far) in near.iter().zip(&far) {
        assert!(near.abs_diff(*far) <= 8, "{near} {far}");
    }
}

#[test]
fn noise_around_a_line_and_copies() {
    let bench = Bench::new();
    let line = Cloud::new(Kind::Odd(Odd::ScanLine)).points(1500);
    let noisy = line.clone().noise(0.5).noise_mode(NoiseMode::Isotropic);
    let copies = Cloud::new(Kind::Bumpy).points(3000).duplicates(0.8);
    for (name, cloud) in [
        ("line.las", line),
        ("noisy.ply", noisy),
        ("copies.ply", copies),
    ] {
        let path = bench.cloud(name, &cloud);
        every_option(&bench, &path);
    }
}

fn places(most: i64, count: usize) -> impl Strategy<Value = Vec<[i64; 3]>> {
    prop::collection::vec(prop::array::uniform3(0..most), 1..count)
}

/// Small clouds of several kinds combined: on grids, lines and planes, in clusters, with copies.
fn clouds() -> impl Strategy<Value = Vec<[f64; 3]>> {
    let scaled = |by: [f64; 3]| {
        move |points: Vec<[i64; 3]>| {
            let scale = |p: [i64; 3]| std::array::from_fn(|k| p[k] as f64 * by[k]);
            points.into_iter().map(scale).collect::<Vec<[f64; 3]>>()
        }
    };
    let skew = |points: Vec<[i64; 3]>| {
        let place = |p: [i64; 3]| [p[0], 2 * p[0] + p[1] / 90, 3 * p[0]].map(|c| c as f64);
        points.into_iter().map(place).collect::<Vec<_>>()
    };
    let far = |(mut near, apart): (Vec<[f64; 3]>, f64)| {
        let others: Vec<_> = near.iter().map(|p| p.map(|c| c + apart)).collect();
        near.extend(others);
        near
    };
    let cube = || places(5, 200).prop_map(scaled([1.0; 3]));
    prop_oneof![
        places(4, 60).prop_map(scaled([1.0; 3])),
        cube(),
        places(40, 200).prop_map(scaled([1.0, 1.0, 0.0])),
        places(100, 200).prop_map(scaled([1.0, 1e-4, 0.0])),
        places(100, 200).prop_map(skew),
        (cube(), prop::sample::select(vec![100.0, 1e5, 1e9])).prop_map(far),
        places(1 << 20, 150).prop_map(scaled([1e-3; 3])),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn small_clouds(points in clouds(), option in 0usize..5, neighbors in 3usize..40) {
        let bench = Bench::new();
        let mesh = bench.path("mesh.ply");
        let cloud = bench.points("cloud.xyz", &points);
        let params = Params { neighbors, min_component: Some(1), ..options()[option].clone() };
        let usual = outcome(&cloud, &mesh, &params, &USUAL);
        let reversed: Vec<_> = points.iter().rev().copied().collect();
        let reversed = bench.points("reversed.xyz", &reversed);
        prop_assert_eq!(&usual, &outcome(&reversed, &mesh, &params, &OTHERS[0]));
        if params.method == Method::Robust {
            prop_assert_eq!(&usual, &outcome(&cloud, &mesh, &params, &OTHERS[1]));
        }
    }
}
