//! The version of the method, which docs/versions.md explains: meshes change with it, and not without it.

use crate::end_to_end::util::{self, Bench};
use outcrop::params::Params;
use outcrop_cloudgen::{Cloud, Kind, Scene};
use std::path::{Path, PathBuf};

/// The version, and checksums of meshes without their headers. If a mesh has changed on purpose, raise
/// `method_version` in `src/paper/method.rs` (once for each release), write the checksum that the test found, a row of
/// docs/versions.md and an entry of the changelog that says **Meshes change**.
const VERSION: u64 = 3;
const MESHES: [(&str, u32); 8] = [
    ("clean, robust", 2_364_131_790),
    ("clean, paper", 2_771_001_501),
    ("noisy, robust", 169_893_712),
    ("noisy, paper", 1_777_962_663),
    ("noisy, smooth", 2_552_388_948),
    ("scan lines, robust", 3_568_111_642),
    ("outdoor, robust", 3_329_173_332),
    ("outdoor, thinned", 332_999_311),
];
/// That of [`everything`].
const MILLION: u32 = 2_284_170_142;

fn cloud(name: &str) -> Cloud {
    let cloud = match name {
        "clean" => Cloud::new(Kind::Bumpy),
        "noisy" => Cloud::new(Kind::Bumpy).noise(6.0),
        "scan lines" => Cloud::new(Kind::Terrain).scanlines(10.0),
        _ => Cloud::new(Kind::Outdoor).noise(0.05).outliers(0.002),
    };
    cloud.points(20_000)
}

fn params(name: &str) -> Params {
    match name {
        "paper" => Params::paper(),
        "smooth" => Params {
            smooth: outcrop::Smooth::Rounds(1),
            ..Params::default()
        },
        "thinned" => Params {
            thin: Some(2.0),
            ..Params::default()
        },
        _ => Params::default(),
    }
}

/// The checksum of a mesh without its header, which must name the version of the method.
fn checksum(mesh: &Path) -> u32 {
    let bytes = std::fs::read(mesh).expect("the mesh");
    let end = b"end_header\n";
    let header = bytes.windows(end.len()).position(|w| w == end);
    let header = header.expect("a header") + end.len();
    let text = String::from_utf8_lossy(&bytes[..header]);
    let made = format!(
        "comment made by outcrop {}, method {VERSION}\n",
        env!("CARGO_PKG_VERSION")
    );
    assert!(text.contains(&made), "{text}");
    crc32fast::hash(&bytes[header..])
}

#[test]
fn meshes_change_with_the_version_of_the_method_only() {
    let bench = Bench::new();
    let mesh = bench.path("mesh.ply");
    let mut found = Vec::new();
    for (name, _) in MESHES {
        let (world, options) = name.split_once(", ").expect("two words");
        let input = bench.cloud("cloud.laz", &cloud(world));
        let report = util::reconstruct(&input, &mesh, &params(options));
        assert!(report.mesh.triangles > 1000, "{name}");
        assert_eq!(u64::from(report.method_version), VERSION);
        found.push((name, checksum(&mesh)));
    }
    assert_eq!(
        found, MESHES,
        "the method is not that of version {VERSION}; see the comment above"
    );
}

/// A million points, side by side, of all that the method treats in a way of its own: ground with houses, trees, walls,
/// wires and birds, surfaces without noise and with noise of half a spacing and of a whole one, of one density and of
/// many, scan lines, edges, and a street as a scanner sees it.
fn everything() -> Vec<Cloud> {
    let land = Cloud::new(Kind::Outdoor).points(620_000).noise(0.05);
    let mut land = land.outliers(0.001);
    land.objects.wires = 3;
    let small = |kind, points| Cloud::new(kind).points(points).size(100.0);
    let street = Kind::Scene(Scene::StreetScan);
    let mut street = Cloud::new(street).points(80_000);
    (street.measuring.noise, street.measuring.flying) = (0.5, 0.01);
    let beside = [
        small(Kind::Bumpy, 50_000),
        // Spacings of about 0.7.
        small(Kind::Bumpy, 50_000).noise(0.35),
        small(Kind::Bumpy, 50_000).noise(0.7),
        small(Kind::Terrain, 50_000).scanlines(10.0).noise(0.02),
        small(Kind::Sphere, 50_000).falloff(true),
        small(Kind::Room, 50_000).outliers(0.01),
        street,
    ];
    let placed = beside.into_iter().enumerate().map(|(place, mut cloud)| {
        cloud.offset = [450.0, 150.0 * place as f64, 20.0];
        cloud
    });
    std::iter::once(land).chain(placed).collect()
}

#[test]
fn a_mesh_of_a_million_points_changes_with_the_version_only() {
    let bench = Bench::new();
    let mesh = bench.path("mesh.ply");
    let clouds = everything();
    let inputs = clouds.iter().zip(0..);
    let inputs = inputs.map(|(cloud, number)| bench.cloud(&format!("{number}.laz"), cloud));
    let inputs: Vec<PathBuf> = inputs.collect();
    let builder = util::builder(&inputs, &mesh, &Params::default());
    let report = builder.memory(1 << 30).build().unwrap().run().unwrap();
    assert!(
        (980_000..1_020_000).contains(&report.points),
        "{}",
        report.points
    );
    let found = checksum(&mesh);
    assert_eq!(
        found, MILLION,
        "the method is not that of version {VERSION}; see the comment above"
    );
}
