//! ZIP archives.

use super::compressed::samples;
use crate::ingest::bench::Bench;
use rawzip::{CompressionMethod, ZipArchiveWriter};
use std::io::Write;
use std::path::PathBuf;

const TEXT: &[u8] = b"1 2 3\n4 5 6\n7 8 10\n";

/// An archive with these members, stored or deflated.
pub fn zip(members: &[(&str, &[u8])], method: CompressionMethod) -> Vec<u8> {
    let mut archive = ZipArchiveWriter::new(Vec::new());
    for (name, bytes) in members {
        if name.ends_with('/') {
            archive.new_dir(name).create().unwrap();
            continue;
        }
        let (mut entry, config) = archive
            .new_file(name)
            .compression_method(method)
            .start()
            .unwrap();
        let descriptor = match method {
            CompressionMethod::DEFLATE => {
                let level = flate2::Compression::default();
                let mut writer = config.wrap(flate2::write::DeflateEncoder::new(&mut entry, level));
                writer.write_all(bytes).unwrap();
                let (encoder, descriptor) = writer.finish().unwrap();
                encoder.finish().unwrap();
                descriptor
            }
            _ => {
                let mut writer = config.wrap(&mut entry);
                writer.write_all(bytes).unwrap();
                writer.finish().unwrap().1
            }
        };
        entry.finish(descriptor).unwrap();
    }
    archive.finish().unwrap()
}

const METHODS: [CompressionMethod; 2] = [CompressionMethod::STORE, CompressionMethod::DEFLATE];

pub fn one(bench: &Bench) -> Vec<PathBuf> {
    let files = samples(bench);
    let mut packed = Vec::new();
    for (number, path) in files.iter().enumerate() {
        let bytes = std::fs::read(path).unwrap();
        let name = path.file_name().unwrap().to_str().unwrap();
        let inside = format!("scans/{name}");
        let others: [(&str, &[u8]); 5] = [
            ("scans/", b""),
            (
                "scans/readme.txt",
                b"Scanned by the river on a windy day.\n",
            ),
            (&inside, &bytes),
            ("__MACOSX/scans/._scan.xyz", TEXT),
            ("scans/preview.jpg", b"\xff\xd8\xff\xe0\0\x10JFIF"),
        ];
        for (way, method) in METHODS.into_iter().enumerate() {
            packed.push(bench.write(&format!("{number}-{way}.zip"), zip(&others, method)));
        }
        // The content decides, not the name.
        packed.push(bench.write(&format!("{number}"), zip(&[(&inside, &bytes)], METHODS[1])));
    }
    packed
}

pub fn several(bench: &Bench) -> Vec<PathBuf> {
    let two: [(&str, &[u8]); 3] = [
        ("a.xyz", TEXT),
        ("b/c.ply", PLY),
        ("notes.md", b"# Notes\n"),
    ];
    METHODS
        .map(|method| bench.write(&format!("{}.zip", method.as_u16()), zip(&two, method)))
        .into()
}

const PLY: &[u8] = b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n\
    property float z\nend_header\n1 2 3\n";

pub fn none(bench: &Bench) -> Vec<PathBuf> {
    let sheet: [(&str, &[u8]); 2] = [("xl/workbook.xml", b"<workbook/>"), ("a.txt", b"prose\n")];
    vec![
        bench.write("a.zip", zip(&sheet, METHODS[1])),
        bench.write("b.zip", zip(&[], METHODS[1])),
    ]
}

pub fn damaged(bench: &Bench) -> Vec<PathBuf> {
    let text = TEXT.repeat(5000);
    let whole = zip(&[("a.xyz", &text)], METHODS[0]);
    let mut changed = whole.clone();
    // A digit of a late point.
    changed[50_000] ^= 1;
    vec![
        bench.write("cut.zip", &whole[..whole.len() - 30]),
        bench.write("head.zip", b"PK\x03\x04 and more"),
        bench.write("changed.zip", changed),
    ]
}

pub fn unreadable(bench: &Bench) -> Vec<PathBuf> {
    let bytes = zip(&[("a.xyz", TEXT)], METHODS[0]);
    let central = bytes.windows(4).position(|w| w == b"PK\x01\x02").unwrap();
    let changed = |at: usize, value: u8| {
        let mut bytes = bytes.clone();
        bytes[central + at] |= value;
        bytes
    };
    vec![
        bench.write("encrypted.zip", changed(8, 1)),
        bench.write("other.zip", changed(10, 9)),
    ]
}

pub fn many(bench: &Bench) -> Vec<PathBuf> {
    let names: Vec<String> = (0..1001).map(|n| format!("{n}.xyz")).collect();
    let members: Vec<(&str, &[u8])> = names.iter().map(|n| (&**n, TEXT)).collect();
    vec![bench.write("a.zip", zip(&members, METHODS[0]))]
}
