//! The version of the method, which docs/versions.md explains: meshes change with it, and not without it.

use crate::end_to_end::util::{self, Bench};
use outcrop::params::Params;
use outcrop_cloudgen::{Cloud, Kind};

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
        let bytes = std::fs::read(&mesh).expect("the mesh");
        let end = b"end_header\n";
        let header = bytes.windows(end.len()).position(|w| w == end);
        let header = header.expect("a header") + end.len();
        let text = String::from_utf8_lossy(&bytes[..header]);
        let made = format!(
            "comment made by outcrop {}, method {VERSION}\n",
            env!("CARGO_PKG_VERSION")
        );
        assert!(text.contains(&made), "{text}");
        found.push((name, crc32fast::hash(&bytes[header..])));
    }
    assert_eq!(
        found, MESHES,
        "the method is not that of version {VERSION}; see the comment above"
    );
}
