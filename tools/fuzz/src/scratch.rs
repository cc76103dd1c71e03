//! Decoding of scratch files, behind their checksums.
//!
//! Checksums detect damage, so a fuzzer would never get past them: here every checksum is valid. A scratch
//! folder is private, so only a fuzzer writes such files; still there must be no panic and no unbounded
//! allocation.

use crate::Bench;
use outcrop::geom::lattice::Lattice;
use outcrop::spill::{Row, Sorted, Table};
use outcrop::stages::ingest::{IngestStats, Spool};
use outcrop::stages::order::{PointStore, Position};
use outcrop::workspace::memory::{MINIMUM_BUDGET, MemoryPool};
use outcrop::workspace::persist::{Persist, Saved};
use outcrop::workspace::progress::{Cancel, Silent};
use outcrop::workspace::{Folder, Found, Workspace};
use std::fs::DirBuilder;
use std::os::unix::fs::DirBuilderExt;
use std::path::Path;
use std::sync::Arc;

/// The first bytes of a journal.
const MAGIC: &[u8] = b"OUTCROP1";

/// Separator of journal, saved values, and the content of files.
pub const BETWEEN: u8 = 0xfe;

/// Names of files that a journal may contain.
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
    FILES.iter().for_each(|name| put(name, file));
    let Some(workspace) = open(&folder) else {
        return;
    };
    load::<IngestStats>(saved, &workspace, |_| {});
    load::<Lattice>(saved, &workspace, |_| {});
    load::<Vec<String>>(saved, &workspace, |_| {});
    load::<Spool>(saved, &workspace, |spool| {
        if let Ok(lattice) = spool.choose_lattice(0) {
            let _ = spool.for_each(&lattice, |_| Ok(()));
        }
    });
    load::<PointStore>(saved, &workspace, |store| {
        let _ = store.slice(0..store.len().min(1000));
    });
    load::<Table<[u32; 3]>>(saved, &workspace, |table| all(&table));
    load::<Sorted<[u32; 3]>>(saved, &workspace, |sorted| {
        let _ = sorted.for_each(|_| Ok(()));
    });
    for name in FILES {
        let packed = Table::<[u32; 4]>::create(&workspace, name, 3);
        let _ = packed.map(|table| all(&table));
        let plain = Table::<Position>::create(&workspace, name, 3);
        let _ = plain.map(|table| all(&table));
    }
    workspace.remove(false);
}

fn load<T: Persist>(bytes: &[u8], workspace: &Workspace, then: impl FnOnce(T)) {
    if let Ok(value) = T::load(&mut Saved::new(bytes, workspace)) {
        then(value);
    }
}

fn all<R: Row>(table: &Table<R>) {
    for section in 0..table.count().min(64) {
        let _ = table.get(section);
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
    record(b"\0{}");
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
