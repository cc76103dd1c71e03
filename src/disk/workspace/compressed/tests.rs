//! Compressed files of all shapes, and damaged ones.

use super::*;
use flate2::write::GzEncoder;
use std::io::Write;

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), flate2::Compression::default());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

fn zstd(bytes: &[u8]) -> Vec<u8> {
    zstd::bulk::compress(bytes, 3).unwrap()
}

/// Bytes that compress a little.
fn noise(bytes: usize) -> Vec<u8> {
    let mut random = oorandom::Rand32::new(7);
    (0..bytes).map(|_| random.rand_range(0..50) as u8).collect()
}

fn content(bytes: &[u8], workspace: &Workspace) -> Result<Option<Vec<u8>>> {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), bytes).unwrap();
    let content = Content::of(file.path(), &|_, _, _| true, workspace)?;
    let read = content.map(|content| {
        let bytes = std::fs::read(&content.path).unwrap();
        assert_eq!(bytes.len() as u64, content.bytes);
        bytes
    });
    if let Some(read) = &read {
        let start = Beginning::of(file.path(), &|_, _, _| true, 100)
            .unwrap()
            .unwrap();
        assert!(read.starts_with(&start.bytes) && start.bytes.len() >= read.len().min(100));
        assert!(start.likely as usize >= start.bytes.len());
    }
    Ok(read)
}

#[test]
fn all_members_and_frames_are_read() {
    let workspace = Workspace::for_tests(1).expect("a scratch folder");
    let whole = noise(3_000_000);
    let (one, two) = whole.split_at(1_200_000);
    let skipped = [&[0x5e, 0x2a, 0x4d, 0x18, 3, 0, 0, 0][..], b"abc"].concat();
    let streamed = zstd::stream::encode_all(one, 19).unwrap();
    for bytes in [
        gzip(&whole),
        [gzip(one), gzip(two)].concat(),
        zstd(&whole),
        [zstd(one), zstd(&[]), zstd(two)].concat(),
        [&skipped, &streamed, &skipped, &zstd(two), &skipped]
            .map(|p| &p[..])
            .concat(),
    ] {
        assert!(content(&bytes, &workspace).unwrap().unwrap() == whole);
    }
    assert_eq!(content(b"1 2 3\n", &workspace).unwrap(), None);
    assert_eq!(workspace.memory.available(), workspace.memory.capacity());
    assert_eq!(workspace.io.scratch(), 0);
}

#[test]
fn damage_is_told_in_one_line() {
    let workspace = Workspace::for_tests(1).expect("a scratch folder");
    let bytes = noise(400_000);
    for (packed, name) in [
        (gzip(&bytes), "gzip data"),
        (zstd(&bytes), "Zstandard frame"),
    ] {
        let mut changed = packed.clone();
        changed[packed.len() / 2] ^= 0xff;
        let endless = [&packed, &b"rest"[..]].concat();
        let cut = packed[..packed.len() / 2].to_vec();
        for (bytes, found) in [(cut, "the end of the file"), (changed, ""), (endless, "")] {
            // A damaged frame without a checksum may give other bytes.
            match content(&bytes, &workspace) {
                Err(error @ Error::Input { .. }) => {
                    let said = error.to_string();
                    assert!(said.contains(name) && said.contains(found), "{said}");
                    assert_eq!(said.lines().count(), 1);
                }
                other => assert!(found.is_empty() && other.is_ok(), "{other:?}"),
            }
        }
    }
    assert!(content(&zstd(&[]), &workspace).is_err());
    assert_eq!(workspace.io.scratch(), 0);
}

#[test]
fn a_window_beyond_the_budget_names_one_that_is_enough() {
    let workspace = Workspace::for_tests(1).expect("a scratch folder");
    let mut encoder = zstd::Encoder::new(Vec::new(), 1).unwrap();
    encoder.window_log(30).unwrap();
    encoder.write_all(&noise(300_000)).unwrap();
    let packed = encoder.finish().unwrap();
    assert_eq!(window(&packed), Some(1 << 30));
    match content(&packed, &workspace) {
        Err(Error::Memory { needed, what, .. }) => {
            assert!(needed > 1 << 30 && needed < 3 << 29, "{needed}");
            assert!(what.starts_with("decompress"), "{what}");
        }
        other => panic!("{:?}", other.map(|c| c.map(|c| c.len()))),
    }
}

#[test]
fn the_window_is_that_of_the_library() {
    for bytes in [0, 1, 255, 256, 70_000, 300_000, 9_000_000] {
        let content = vec![7; bytes];
        let packed = zstd(&content);
        let window = window(&packed).unwrap();
        assert!(
            window <= 1 << 21 && window >= (bytes as u64).min(1 << 10),
            "{bytes} {window}"
        );
    }
    assert_eq!(window(b"PK\x03\x04 and more"), None);
    assert_eq!(window(&[0x28, 0xb5]), None);
}

#[test]
fn names_lose_one_extension() {
    let name = |text| plain_name(Path::new(text)).display().to_string();
    assert_eq!(name("a/x.ply.zst"), "a/x.ply");
    assert_eq!(name("x.xyz.GZ"), "x.xyz");
    assert_eq!(name("x.ply"), "x.ply");
}

#[test]
fn the_beginning_of_much_in_few_bytes_is_not_all() {
    let file = tempfile::NamedTempFile::new().unwrap();
    let content = vec![b'1'; 8 << 20];
    for packed in [gzip(&content), zstd(&content)] {
        assert!(packed.len() < 16 << 10);
        std::fs::write(file.path(), packed).unwrap();
        let start = Beginning::of(file.path(), &|_, _, _| true, 1 << 20)
            .unwrap()
            .unwrap();
        assert!(start.likely as usize > start.bytes.len());
        assert!(start.bytes.len() <= 2 << 20);
    }
}
