//! Damage to the files of a stopped run: it is found, and the mesh is the same.

use crate::Bench;
use outcrop::{Cancel, Observer, Params, Reconstruction, Start};
use outcrop_cloudgen::{Cloud, Format, Kind};
use outcrop_disk::workspace::memory::MINIMUM_BUDGET;
use std::fs::DirBuilder;
use std::os::unix::fs::DirBuilderExt;
use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

/// Stages at the beginning of which a run is stopped.
const STAGES: [&str; 6] = ["order", "relax", "cells", "triples", "repair", "export"];

/// The files of a stopped run: names and bytes.
pub type Snapshot = Vec<(String, Vec<u8>)>;

struct Runs {
    stopped: Vec<Snapshot>,
    mesh: Vec<u8>,
}

struct StopAt(&'static str, Cancel);

impl Observer for StopAt {
    fn begin(&self, name: &'static str, _: &'static str, _: u64) {
        if name == self.0 {
            self.1.cancel();
        }
    }
}

fn output() -> PathBuf {
    Bench::get().path("resumed.ply")
}

fn folder() -> PathBuf {
    Bench::get().path("resumed.ply.outcrop-scratch")
}

fn description(start: Start) -> outcrop::Builder {
    let params = Params {
        block: 128,
        ..Params::default()
    };
    Reconstruction::builder()
        .input(Bench::get().path("resumed.laz"))
        .output(output())
        .params(params)
        .memory(MINIMUM_BUDGET)
        .threads(1)
        .tile_points(64)
        .page_points(16)
        .start(start)
}

fn run(builder: outcrop::Builder) -> outcrop::Result<Vec<u8>> {
    builder.build()?.run()?;
    Ok(std::fs::read(output()).expect("the mesh"))
}

fn stopped(stage: &'static str) -> Snapshot {
    let cancel = Cancel::new();
    let observer = Arc::new(StopAt(stage, cancel.clone()));
    let builder = description(Start::Restart)
        .observer(observer)
        .cancel(cancel);
    let Err(outcrop::Error::Cancelled) = run(builder) else {
        panic!("the run has no stage {stage}");
    };
    let entries = std::fs::read_dir(folder()).expect("the folder of the stopped run");
    let mut files: Snapshot = entries
        .map(|entry| {
            let entry = entry.expect("a scratch file");
            let name = entry.file_name().into_string().expect("a name");
            (name, std::fs::read(entry.path()).expect("its bytes"))
        })
        .collect();
    files.sort();
    files
}

fn runs() -> &'static Runs {
    static RUNS: OnceLock<Runs> = OnceLock::new();
    RUNS.get_or_init(|| {
        let cloud = Cloud::new(Kind::Bumpy).points(500).seed(3);
        let path = Bench::get().path("resumed.laz");
        let written = cloud.write(path, Format::Laz(Default::default()));
        written.expect("the cloud");
        let mesh = run(description(Start::Restart)).expect("a mesh");
        Runs {
            stopped: STAGES.into_iter().map(stopped).collect(),
            mesh,
        }
    })
}

/// Snapshots of runs that were stopped at different stages.
pub fn snapshots() -> &'static [Snapshot] {
    &runs().stopped
}

/// Applies `edits` to the files of a stopped run, six bytes each: the first selects the file, the second the
/// kind of damage, two or three the place, and the last is the byte to write.
fn damaged(snapshot: &Snapshot, edits: &[u8]) -> Snapshot {
    let mut files = snapshot.clone();
    for edit in edits.chunks_exact(6) {
        let count = files.len().max(1);
        let Some((_, bytes)) = files.get_mut(usize::from(edit[0]) % count) else {
            break;
        };
        let place = u32::from_le_bytes([edit[2], edit[3], edit[4], 0]) as usize;
        let at = place % bytes.len().max(1);
        match edit[1] % 6 {
            0 => bytes.truncate(at),
            1 if !bytes.is_empty() => bytes[at] ^= edit[5] | 1,
            2 => bytes.extend(std::iter::repeat_n(edit[5], place % 5000)),
            3 => {
                files.remove(usize::from(edit[0]) % count);
            }
            4 => {
                let until = bytes.len().min(at + 1 + usize::from(edit[5]));
                bytes[at..until].fill(0);
            }
            _ => {
                let other = usize::from(edit[5]) % count;
                let content = files[other].1.clone();
                files[usize::from(edit[0]) % count].1 = content;
            }
        }
    }
    files
}

/// Damages the files of a stopped run and resumes it.
pub fn go_on(bytes: &[u8]) {
    let runs = runs();
    let Some((which, edits)) = bytes.split_first() else {
        return;
    };
    let snapshot = &runs.stopped[usize::from(*which) % runs.stopped.len()];
    let _ = std::fs::remove_dir_all(folder());
    let _ = std::fs::remove_file(output());
    let made = DirBuilder::new().mode(0o700).create(folder());
    made.expect("a scratch folder");
    for (name, bytes) in damaged(snapshot, edits) {
        std::fs::write(folder().join(name), bytes).expect("a scratch file");
    }
    match run(description(Start::Resume)) {
        Ok(mesh) => assert!(mesh == runs.mesh, "another mesh"),
        Err(error) => panic!("damage that was not mended: {error}"),
    }
    assert!(!folder().exists(), "scratch files are left");
}
