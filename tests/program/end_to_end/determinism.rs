//! One cloud and one set of parameters give one file, byte for byte, for any threads, memory, tiles, pages,
//! and order and format of the inputs.

use crate::end_to_end::util::{self, Bench};
use outcrop::params::Params;
use outcrop_cloudgen::{Cloud, Format, Kind, LasOptions};
use outcrop_disk::workspace::mapped::Io;
use outcrop_disk::workspace::memory::MINIMUM_BUDGET;
use outcrop_disk::workspace::{Compression, Storage};
use std::path::{Path, PathBuf};

/// Settings that must not affect the mesh.
#[derive(Debug, Clone)]
struct Way {
    inputs: Vec<PathBuf>,
    threads: usize,
    memory: u64,
    tile: Option<u32>,
    page: Option<usize>,
    storage: Storage,
}

impl Way {
    fn of(input: &Path) -> Self {
        Self {
            inputs: vec![input.into()],
            threads: 2,
            memory: 512 << 20,
            tile: None,
            page: None,
            storage: Storage::default(),
        }
    }

    fn storage(self, io: Io, compression: Compression) -> Self {
        let storage = Storage { io, compression };
        Self { storage, ..self }
    }

    fn threads(self, threads: usize) -> Self {
        Self { threads, ..self }
    }

    fn memory(self, memory: u64) -> Self {
        Self { memory, ..self }
    }

    fn tile(self, points: u32) -> Self {
        Self {
            tile: Some(points),
            ..self
        }
    }

    fn page(self, points: usize) -> Self {
        Self {
            page: Some(points),
            ..self
        }
    }

    fn inputs(self, inputs: &[PathBuf]) -> Self {
        Self {
            inputs: inputs.to_vec(),
            ..self
        }
    }

    fn hash(&self, bench: &Bench, params: &Params) -> u64 {
        let mesh = bench.path("mesh.ply");
        let mut builder = util::builder(&self.inputs, &mesh, params)
            .threads(self.threads)
            .memory(self.memory)
            .storage(self.storage);
        if let Some(points) = self.tile {
            builder = builder.tile_points(points);
        }
        if let Some(points) = self.page {
            builder = builder.page_points(points);
        }
        let report = builder.build().unwrap().run().unwrap();
        assert!(report.mesh.triangles > 0);
        let hash = util::hash(&mesh);
        std::fs::remove_file(&mesh).unwrap();
        hash
    }
}

/// All ways give the same file as the first one.
fn one_hash(bench: &Bench, params: &Params, ways: &[Way]) {
    let expected = ways[0].hash(bench, params);
    println!("{expected:016x}");
    for way in &ways[1..] {
        assert_eq!(
            way.hash(bench, params),
            expected,
            "{way:#?} differs from {:#?}",
            ways[0]
        );
    }
}

/// Combinations in which each setting has all of its values.
fn settings(base: &Way) -> Vec<Way> {
    vec![
        base.clone(),
        base.clone().threads(1),
        base.clone().memory(MINIMUM_BUDGET),
        base.clone().memory(4 << 30),
        base.clone().tile(500).page(64),
        base.clone()
            .tile(7000)
            .page(16)
            .threads(1)
            .memory(MINIMUM_BUDGET),
        base.clone().storage(Io::Read, Compression::Level(1)),
        (base.clone().memory(MINIMUM_BUDGET)).storage(Io::Map, Compression::Level(3)),
    ]
}

/// The most difficult cloud of the generator: noise, outliers, copies, scan lines.
fn nasty(points: u64) -> Cloud {
    Cloud::new(Kind::Bumpy)
        .points(points)
        .seed(11)
        .noise(1.5)
        .outliers(0.01)
        .duplicates(0.03)
        .scanlines(6.0)
        .offset([500_000.0, 5_400_000.0, 300.0])
}

/// Blocks of which a cloud of 60 000 points has more than two.
fn small_blocks() -> Params {
    Params {
        block: 1 << 14,
        ..Params::default()
    }
}

#[test]
fn threads_memory_tiles_and_pages_do_not_matter() {
    let bench = Bench::new();
    // More than two blocks.
    let cloud = bench.cloud("cloud.laz", &nasty(150_000));
    one_hash(&bench, &Params::default(), &settings(&Way::of(&cloud)));
}

#[test]
fn nor_do_they_with_smoothing() {
    let bench = Bench::new();
    let cloud = bench.cloud("cloud.laz", &nasty(60_000));
    let params = Params {
        smooth: outcrop::Smooth::Rounds(1),
        ..small_blocks()
    };
    one_hash(&bench, &params, &settings(&Way::of(&cloud)));
}

#[test]
fn nor_do_they_with_fewer_points() {
    let bench = Bench::new();
    let cloud = nasty(60_000);
    let path = bench.cloud("cloud.laz", &cloud);
    let format = Format::from_path(&path).unwrap();
    let mut parts = cloud
        .write_split(bench.path("part.laz"), format, 3)
        .unwrap();
    parts.reverse();
    let params = Params {
        thin: Some(4.3),
        drop_outliers: Some(3.0),
        ..small_blocks()
    };
    let mut ways = settings(&Way::of(&path));
    ways.push(ways[0].clone().inputs(&parts));
    one_hash(&bench, &params, &ways);
    let params = Params {
        smooth: outcrop::Smooth::Rounds(1),
        drop_outliers: Some(3.0),
        block: 1000,
        ..Params::default()
    };
    let small = bench.cloud("small.laz", &nasty(20_000));
    let mut ways = settings(&Way::of(&small));
    ways.push(ways[0].clone().tile(97).page(7));
    one_hash(&bench, &params, &ways);
}

#[test]
fn nor_do_they_where_many_blocks_meet() {
    let bench = Bench::new();
    let cloud = bench.cloud("cloud.laz", &nasty(20_000));
    let kinds = [(1000, 0, true), (1000, 2, true), (333, 0, false)];
    for (number, (block, smooth, repair)) in kinds.into_iter().enumerate() {
        let params = Params {
            block,
            smooth: outcrop::Smooth::Rounds(smooth),
            repair,
            ..Params::default()
        };
        // Each kind with a third of the settings, which have nothing to do with it.
        let all = settings(&Way::of(&cloud));
        let mut ways: Vec<_> = all.iter().skip(number).step_by(3).cloned().collect();
        ways.push(all[0].clone().tile(97).page(7));
        one_hash(&bench, &params, &ways);
    }
}

#[test]
fn a_small_cloud_survives_the_smallest_tiles() {
    let bench = Bench::new();
    let cloud = bench.cloud("cloud.las", &nasty(3000));
    let base = Way::of(&cloud);
    for block in [40, 1000, 1 << 16] {
        let params = Params {
            block,
            ..Params::default()
        };
        let ways: Vec<_> = [(1, 1), (2, 3), (17, 5), (1000, 2000)]
            .into_iter()
            .map(|(tile, page)| base.clone().tile(tile).page(page))
            .collect();
        one_hash(&bench, &params, &ways);
    }
}

#[test]
fn order_and_number_of_files_do_not_matter() {
    let bench = Bench::new();
    let cloud = nasty(60_000);
    let whole = bench.cloud("whole.laz", &cloud);
    let options = LasOptions::default();
    let parts = bench.subfolder("parts");
    let laz = cloud
        .write_split(parts.join("part.laz"), Format::Laz(options), 3)
        .unwrap();
    let las = cloud
        .write_split(bench.path("part.las"), Format::Las(options), 4)
        .unwrap();
    let reversed = |files: &[PathBuf]| files.iter().rev().cloned().collect::<Vec<_>>();
    let mixed = [
        las[3].clone(),
        las[0].clone(),
        las[2].clone(),
        las[1].clone(),
    ];
    let base = Way::of(&whole);
    let ways = [
        base.clone(),
        base.clone().inputs(&laz),
        base.clone().inputs(&reversed(&laz)).threads(1),
        base.clone().inputs(&mixed).memory(MINIMUM_BUDGET),
        base.clone().inputs(&[parts]),
    ];
    one_hash(&bench, &small_blocks(), &ways);
}

#[test]
fn compression_does_not_matter() {
    let bench = Bench::new();
    let las = bench.cloud("cloud.las", &nasty(60_000));
    let laz = bench.cloud("cloud.laz", &nasty(60_000));
    one_hash(&bench, &small_blocks(), &[Way::of(&las), Way::of(&laz)]);
}

#[test]
fn the_order_of_points_does_not_matter() {
    let bench = Bench::new();
    let cloud = bench.path("cloud.xyz");
    nasty(20_000).write(&cloud, Format::Xyz).unwrap();
    let text = std::fs::read_to_string(&cloud).unwrap();
    let lines: Vec<&str> = text.lines().filter(|line| !line.starts_with('#')).collect();
    let reversed: String = lines.iter().rev().map(|line| format!("{line}\n")).collect();
    let (even, odd): (Vec<_>, Vec<_>) = lines.iter().enumerate().partition(|(i, _)| i % 2 == 0);
    let shuffled: String = odd
        .iter()
        .chain(&even)
        .map(|(_, line)| format!("{line}\n"))
        .collect();
    let ways = [
        Way::of(&cloud),
        Way::of(&bench.write("reversed.xyz", reversed)),
        Way::of(&bench.write("shuffled.xyz", shuffled)),
    ];
    one_hash(&bench, &Params::default(), &ways);
}

#[test]
fn repeated_runs_do_not_differ() {
    let bench = Bench::new();
    let cloud = bench.cloud("cloud.ply", &nasty(70_000));
    let way = Way::of(&cloud);
    one_hash(&bench, &Params::default(), &[way.clone(), way.clone(), way]);
}

#[test]
fn a_photogrammetric_scan() {
    let Some(scan) = util::scan("lion.laz") else {
        return;
    };
    let all = settings(&Way::of(&scan));
    let ways: Vec<_> = all.into_iter().step_by(2).collect();
    one_hash(&Bench::new(), &Params::default(), &ways);
}

#[test]
fn a_photogrammetric_scan_smoothed() {
    let Some(scan) = util::scan("lion.laz") else {
        return;
    };
    let params = Params {
        smooth: outcrop::Smooth::Rounds(1),
        ..Params::default()
    };
    let base = Way::of(&scan);
    let other = base
        .clone()
        .tile(7000)
        .page(64)
        .threads(1)
        .memory(MINIMUM_BUDGET);
    one_hash(&Bench::new(), &params, &[base, other]);
}

#[test]
fn a_terrestrial_scan_in_three_shapes() {
    let Some(whole) = util::scan("lone-star.laz") else {
        return;
    };
    let Some(split) = util::scan("lone-star-split") else {
        return;
    };
    let mut files: Vec<_> = util::listing(&split)
        .into_iter()
        .map(|name| split.join(name))
        .collect();
    files.reverse();
    let base = Way::of(&whole);
    let ways = [
        base.clone(),
        base.clone()
            .inputs(&[split])
            .threads(1)
            .memory(4 << 30)
            .tile(7000),
        base.inputs(&files)
            .memory(MINIMUM_BUDGET)
            .tile(500)
            .page(64),
    ];
    one_hash(&Bench::new(), &Params::default(), &ways);
}

/// The triangles of a mesh, and its vertices in steps of a millionth.
fn triangles_and_places(scan: &Path) -> (Vec<u8>, Vec<i64>) {
    let bench = Bench::new();
    let mesh = bench.path("mesh.ply");
    let report = util::reconstruct(scan, &mesh, &Params::default());
    let bytes = std::fs::read(mesh).unwrap();
    assert!(
        bytes
            .windows(17)
            .take(200)
            .any(|w| w == b"property double z")
    );
    let faces = bytes.len() - 13 * report.mesh.triangles as usize;
    let places = bytes[faces - 24 * report.mesh.vertices as usize..faces]
        .chunks_exact(8)
        .map(|x| (f64::from_le_bytes(x.try_into().unwrap()) * 1e6).round() as i64)
        .collect();
    (bytes[faces..].to_vec(), places)
}

/// The two files have different origins, so decoded coordinates differ in the last bit.
#[test]
fn a_terrestrial_scan_from_two_origins() {
    let Some(laz) = util::scan("lone-star.laz") else {
        return;
    };
    let Some(copc) = util::scan("lone-star.copc.laz") else {
        return;
    };
    let (a, b) = (triangles_and_places(&laz), triangles_and_places(&copc));
    assert!(a.0 == b.0, "different triangles");
    assert_eq!(a.1.len(), b.1.len());
    let apart = a.1.iter().zip(&b.1).map(|(a, b)| (a - b).abs()).max();
    assert!(apart <= Some(1), "{apart:?} millionths apart");
}
