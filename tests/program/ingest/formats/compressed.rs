//! Compressed files.

use super::{las, ply};
use crate::ingest::bench::Bench;
use flate2::write::GzEncoder;
use std::io::Write;
use std::path::PathBuf;

const TEXT: &[u8] = b"1 2 3\n4 5 6\n7 8 10\n";

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), flate2::Compression::default());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

/// A frame with a checksum.
fn zstd(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = zstd::Encoder::new(Vec::new(), 3).unwrap();
    encoder.include_checksum(true).unwrap();
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

/// Files of several formats.
pub fn samples(bench: &Bench) -> Vec<PathBuf> {
    let mut files = las::all(bench, &[2], 0..=1, "las");
    files.extend(las::all(bench, &[2], 0..=1, "laz"));
    files.extend(ply::bodies(bench));
    files.push(bench.write("text.xyz", TEXT));
    files
}

pub fn formats(bench: &Bench) -> Vec<PathBuf> {
    let files = samples(bench);
    let mut packed = Vec::new();
    for (number, path) in files.iter().enumerate() {
        let bytes = std::fs::read(path).unwrap();
        let name = path.file_name().unwrap().to_str().unwrap();
        packed.push(bench.write(&format!("{name}.gz"), gzip(&bytes)));
        packed.push(bench.write(&format!("{name}.zst"), zstd(&bytes)));
        // The content decides, not the name.
        packed.push(bench.write(&format!("{number}"), zstd(&bytes)));
    }
    packed
}

pub fn several(bench: &Bench) -> Vec<PathBuf> {
    let skipped = b"\x50\x2a\x4d\x18\x02\x00\x00\x00ab".to_vec();
    let frames = [skipped.clone(), zstd(TEXT), zstd(b""), zstd(TEXT), skipped];
    vec![
        bench.write("a.xyz.gz", [gzip(TEXT), gzip(TEXT)].concat()),
        bench.write("a.xyz.zst", frames.concat()),
    ]
}

fn cut(bytes: Vec<u8>) -> Vec<u8> {
    bytes[..bytes.len() - 6].to_vec()
}

pub fn short_gzip(bench: &Bench) -> Vec<PathBuf> {
    vec![bench.write("a.xyz.gz", cut(gzip(TEXT)))]
}

pub fn short_zstd(bench: &Bench) -> Vec<PathBuf> {
    let second = [zstd(TEXT), cut(zstd(TEXT))].concat();
    vec![
        bench.write("a.xyz.zst", cut(zstd(TEXT))),
        bench.write("b.xyz.zst", second),
    ]
}

pub fn damaged(bench: &Bench) -> Vec<PathBuf> {
    // The last bytes of both are checksums; those of gzip are followed by the length.
    let changed = |mut bytes: Vec<u8>, back: usize| {
        let at = bytes.len() - back;
        bytes[at] ^= 0x55;
        bytes
    };
    vec![
        bench.write("a.xyz.gz", changed(gzip(TEXT), 6)),
        bench.write("a.xyz.zst", changed(zstd(TEXT), 2)),
    ]
}

pub fn more(bench: &Bench) -> Vec<PathBuf> {
    vec![bench.write("a.xyz.zst", [&zstd(TEXT), TEXT].concat())]
}

pub fn nothing(bench: &Bench) -> Vec<PathBuf> {
    vec![
        bench.write("a.xyz.gz", gzip(b"")),
        bench.write("a.xyz.zst", zstd(b"")),
    ]
}

pub fn twice(bench: &Bench) -> Vec<PathBuf> {
    vec![bench.write("a.xyz.zst.gz", gzip(&zstd(TEXT)))]
}
