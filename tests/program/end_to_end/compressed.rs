//! Compressed meshes and clouds.

use crate::end_to_end::util::{self, Bench};
use outcrop::Builder;
use outcrop::params::Params;
use outcrop_cloudgen::{Cloud, Kind};
use outcrop_disk::workspace::memory::MINIMUM_BUDGET;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

/// A cloud with outliers and noise, so that vertices are pinched.
fn cloud(bench: &Bench, name: &str) -> PathBuf {
    let mut cloud = Cloud::new(Kind::Terrain).points(40_000).noise(0.6);
    cloud.outliers = 0.001;
    bench.cloud(name, &cloud)
}

/// The bytes of the mesh `name` of a run.
fn mesh(
    bench: &Bench,
    input: &Path,
    name: &str,
    params: &Params,
    set: impl FnOnce(Builder) -> Builder,
) -> Vec<u8> {
    let path = bench.path(name);
    let builder = util::builder(&[input.into()], &path, params);
    set(builder).build().unwrap().run().unwrap();
    std::fs::read(path).unwrap()
}

#[test]
fn the_compressed_mesh_is_the_plain_one_however_it_was_made() {
    let bench = Bench::new();
    let input = cloud(&bench, "cloud.laz");
    for block in [1500, Params::default().block] {
        let params = Params {
            block,
            ..Params::default()
        };
        let plain = mesh(&bench, &input, "mesh.ply", &params, |run| run);
        let packed = mesh(&bench, &input, "mesh.ply.zst", &params, |run| run);
        assert!(packed.len() < plain.len() * 2 / 3, "{}", packed.len());
        assert!(zstd::decode_all(&packed[..]).unwrap() == plain);
        for (threads, memory) in [(1, MINIMUM_BUDGET), (3, MINIMUM_BUDGET), (5, 4 << 30)] {
            let set = |run: Builder| run.threads(threads).memory(memory);
            let again = mesh(&bench, &input, "mesh.ply.zst", &params, set);
            assert!(again == packed, "{threads} threads, {memory} bytes");
        }
        seeks(&bench.path("mesh.ply.zst"), &plain);
    }
    let whole = util::verdict(&bench.path("mesh.ply"));
    assert_eq!(util::verdict(&bench.path("mesh.ply.zst")), whole);
    assert!(whole.manifold);
}

/// The table of frames at the end finds every part, as the seekable format of zstd describes it
/// (`contrib/seekable_format` of zstd).
fn seeks(packed: &Path, plain: &[u8]) {
    let packed = std::fs::read(packed).unwrap();
    let number = |at: usize| u32::from_le_bytes(packed[at..at + 4].try_into().unwrap());
    // The footer: the number of frames, a byte of flags, and the magic number. No checksums.
    let footer = packed.len() - 9;
    let count = number(footer) as usize;
    assert_eq!((packed[footer + 4], number(footer + 5)), (0, 0x8F92_EAB1));
    // The table is a frame that other readers skip: a magic number, its size, two sizes for each frame.
    let table = footer - 8 * count;
    assert_eq!(number(table - 8), 0x184D_2A5E);
    assert_eq!(number(table - 4) as usize, 8 * count + 9);
    let (mut from, mut at) = (0, 0);
    for frame in 0..count {
        let [size, long] = [0, 4].map(|field| number(table + 8 * frame + field) as usize);
        let part = zstd::decode_all(&packed[from..from + size]).unwrap();
        assert!(part == plain[at..at + long], "frame {frame}");
        (from, at) = (from + size, at + long);
    }
    assert!(count > 1, "{count}");
    assert_eq!((from, at), (table - 8, plain.len()));
}

#[test]
fn compare_reads_a_compressed_mesh_and_a_compressed_cloud() {
    let bench = Bench::new();
    let input = cloud(&bench, "cloud.ply");
    let params = Params::default();
    mesh(&bench, &input, "mesh.ply", &params, |run| run);
    mesh(&bench, &input, "mesh.ply.zst", &params, |run| run);
    let packed = zstd::encode_all(File::open(&input).unwrap(), 3).unwrap();
    bench.write("cloud.ply.zst", packed);
    let measured = |mesh: &str, cloud: &str| {
        let said = util::run([
            "compare".as_ref(),
            "--json".as_ref(),
            bench.path(mesh).as_os_str(),
            bench.path(cloud).as_os_str(),
        ]);
        assert_eq!(said.code, Some(0), "{said:?}");
        said.out.replace(".zst", "")
    };
    let plain = measured("mesh.ply", "cloud.ply");
    assert_eq!(measured("mesh.ply.zst", "cloud.ply.zst"), plain);
}

#[test]
fn a_compressed_cloud_gives_the_same_mesh() {
    let bench = Bench::new();
    let params = Params::default();
    for name in ["cloud.ply", "cloud.xyz", "cloud.laz"] {
        let input = cloud(&bench, name);
        let expected = mesh(&bench, &input, "mesh.ply", &params, |run| run);
        let bytes = std::fs::read(&input).unwrap();
        let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        gzip.write_all(&bytes).unwrap();
        let gzip = gzip.finish().unwrap();
        let zstd = zstd::encode_all(&bytes[..], 1).unwrap();
        for (extension, bytes) in [("gz", gzip), ("zst", zstd)] {
            let input = bench.write(&format!("{name}.{extension}"), bytes);
            let found = mesh(&bench, &input, "mesh.ply", &params, |run| run);
            assert!(found == expected, "{}", input.display());
        }
    }
    let said = util::run(["info".as_ref(), bench.path("cloud.xyz.gz").as_os_str()]);
    assert_eq!(said.code, Some(0), "{said:?}");
    assert!(said.out.contains("cloud.xyz.gz: text, "), "{}", said.out);
}

#[test]
fn meshes_are_not_written_under_the_name_of_another_compression() {
    let bench = Bench::new();
    let input = cloud(&bench, "cloud.ply");
    let output = bench.path("mesh.ply.gz");
    let said = util::run([
        "reconstruct".as_ref(),
        input.as_os_str(),
        "-o".as_ref(),
        output.as_os_str(),
    ]);
    assert_eq!(said.code, Some(2), "{said:?}");
    assert!(
        said.err.contains("--output") && said.err.contains(".ply.zst"),
        "{}",
        said.err
    );
}
