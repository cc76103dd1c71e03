//! Decoding of scratch files, behind their checksums.
//!
//! Checksums detect damage, so a fuzzer would never get past them: here every checksum is valid. A scratch
//! folder is private, so only a fuzzer writes such files; still there must be no panic and no unbounded
//! allocation.

use crate::Bench;
use outcrop_disk::spill::{Row, Shuffle, SortedRuns, Table};
use outcrop_disk::workspace::memory::{MINIMUM_BUDGET, MemoryPool};
use outcrop_disk::workspace::progress::{Cancel, Silent};
use outcrop_disk::workspace::{Folder, Found, Workspace};
use outcrop_geom::lattice::Lattice;
use outcrop_points::{IngestStats, Spool};
use outcrop_stages::order::{Position, StoredPoints};
use serde::de::DeserializeOwned;
use std::fs::DirBuilder;
use std::os::unix::fs::DirBuilderExt;
use std::path::Path;
use std::sync::Arc;

/// The first bytes of a journal.
const MAGIC: &[u8] = b"OUTCROP2";

/// Separator of journal, saved values, and the content of files.
pub const BETWEEN: u8 = 0xfe;

/// Names of files that a journal may contain; each has three segments of the same content.
pub const FILES: [&str; 6] = [
    "ingest-0.spool",
    "points",
    "points.index",
    "cells.own",
    "order.run0",
    "a",
];

/// Reads a journal, a saved value and a file, divided by [`BETWEEN`].
pub fn read(bytes: &[u8]) {
    let mut parts = bytes.splitn(3, |b| *b == BETWEEN);
    let mut part = || parts.next().unwrap_or_default();
    let (journal, saved, file) = (part(), part(), part());
    let folder = Bench::get().path("run");
    let _ = std::fs::remove_dir_all(&folder);
    let made = DirBuilder::new().mode(0o700).create(&folder);
    made.expect("a scratch folder");
    let put = |name: &str, bytes: &[u8]| {
        std::fs::write(folder.join(name), bytes).expect("a scratch file");
    };
    put("journal", &forged(journal));
    put("manifest", &sealed(b"{}"));
    for (name, segment) in FILES
        .iter()
        .flat_map(|name| [(name, 0), (name, 1), (name, 2)])
    {
        put(&format!("{name}.{segment}"), file);
    }
    let Some(workspace) = open(&folder) else {
        return;
    };
    load::<IngestStats>(saved, |_| {});
    load::<Lattice>(saved, |_| {});
    load::<Vec<String>>(saved, |_| {});
    load::<Spool>(saved, |spool| {
        if let Ok(lattice) = spool.choose_lattice(0) {
            let _ = spool.for_each(&workspace, &lattice, |_| Ok(()));
        }
    });
    load::<StoredPoints>(saved, |stored| {
        if let Ok(store) = stored.open(&workspace) {
            let _ = store.slice(0..store.len().min(1000));
        }
    });
    load::<Table<[u32; 3]>>(saved, |table| all(&table, &workspace));
    load::<Shuffle<[u32; 3]>>(saved, |shuffle| received(&shuffle, &workspace));
    load::<SortedRuns<[u32; 3]>>(saved, |runs| {
        if let Ok(sorted) = runs.open(&workspace, "fuzz") {
            let _ = sorted.for_each_from(None, |_| Ok(()));
        }
    });
    for name in FILES {
        all(&Table::<[u32; 4]>::new(name, 3), &workspace);
        all(&Table::<Position>::new(name, 3), &workspace);
        received(&Shuffle::<[u32; 4]>::new(name), &workspace);
    }
    workspace.remove(false);
}

fn load<T: DeserializeOwned>(bytes: &[u8], then: impl FnOnce(T)) {
    if let Ok(value) = postcard::from_bytes(bytes) {
        then(value);
    }
}

fn all<R: Row>(table: &Table<R>, workspace: &Workspace) {
    for section in 0..table.count().min(64) {
        let _ = table.get(&workspace.unit(), section);
    }
}

fn received<R: Row>(shuffle: &Shuffle<R>, workspace: &Workspace) {
    if let Ok(inbox) = shuffle.open(workspace, 64) {
        for receiver in 0..64 {
            let _ = inbox.get(&workspace.unit(), receiver);
        }
    }
}

/// The journal of the records in `bytes`, each its length and its body, with valid checksums.
fn forged(bytes: &[u8]) -> Vec<u8> {
    let mut out = MAGIC.to_vec();
    let mut record = |body: &[u8]| {
        out.extend_from_slice(&(body.len() as u32).to_le_bytes());
        out.extend_from_slice(&crc32fast::hash(body).to_le_bytes());
        out.extend_from_slice(body);
    };
    // The manifest: record 0, two bytes.
    record(b"\0\x02{}");
    let mut rest = bytes;
    while let Some((length, after)) = rest.split_first_chunk::<2>() {
        let length = usize::from(u16::from_le_bytes(*length)).min(after.len());
        let (body, after) = after.split_at(length);
        record(body);
        rest = after;
    }
    out
}

fn sealed(manifest: &[u8]) -> Vec<u8> {
    let seal = format!("\n{:08x}\n", crc32fast::hash(manifest));
    [manifest, seal.as_bytes()].concat()
}

fn open(folder: &Path) -> Option<Workspace> {
    let Ok(Found::Run(found)) = Folder::find(folder) else {
        panic!("a manifest is there");
    };
    let memory = MemoryPool::new(MINIMUM_BUDGET).expect("the least budget");
    Workspace::resumable(found, memory, 1, Arc::new(Silent), Cancel::new()).ok()
}
