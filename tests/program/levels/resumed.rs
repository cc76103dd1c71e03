//! The same bytes for any memory and threads, and after a run was stopped.

use super::meshes::hills;
use outcrop::levels::{Options, TilesReport};
use outcrop::{Cancel, Error, Observer, Start, Tiles};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// All files below a folder, with their content.
pub fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut all = BTreeMap::new();
    let mut left = vec![folder.to_path_buf()];
    while let Some(folder) = left.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            match path.is_dir() {
                true => left.push(path),
                false => drop(all.insert(path.clone(), std::fs::read(&path).unwrap())),
            }
        }
    }
    let relative = |path: PathBuf| path.strip_prefix(folder).unwrap().to_path_buf();
    all.into_iter()
        .map(|(path, bytes)| (relative(path), bytes))
        .collect()
}

fn tiles(mesh: &Path, folder: &Path) -> Tiles {
    let options = Options {
        most_triangles: 300,
        ..Options::default()
    };
    Tiles::new(mesh, folder)
        .options(options)
        .memory(192 << 20)
        .threads(2)
}

fn equal(found: &Path, want: &BTreeMap<PathBuf, Vec<u8>>, what: &str) {
    let found = files(found);
    assert_eq!(
        found.keys().collect::<Vec<_>>(),
        want.keys().collect::<Vec<_>>(),
        "{what}"
    );
    assert!(found == *want, "{what}");
}

#[test]
fn memory_and_threads_change_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = folder.path().join("mesh.ply");
    hills(80, true).write(&mesh);
    let first = folder.path().join("first");
    tiles(&mesh, &first).run().unwrap();
    let want = files(&first);
    for (threads, memory) in [(1, 192), (2, 1024), (5, 400)] {
        let other = folder.path().join(format!("{threads}"));
        tiles(&mesh, &other)
            .threads(threads)
            .memory(memory << 20)
            .run()
            .unwrap();
        equal(&other, &want, &format!("{threads} threads"));
    }
    // A tileset is replaced by another one of the same name, and compressed meshes are read.
    let packed = folder.path().join("mesh.ply.zst");
    let bytes = zstd::encode_all(&*std::fs::read(&mesh).unwrap(), 1).unwrap();
    std::fs::write(&packed, bytes).unwrap();
    tiles(&packed, &first).run().unwrap();
    let mut found = files(&first);
    found.remove(Path::new("tileset.json"));
    assert!(found.iter().all(|(path, bytes)| want[path] == *bytes));
    assert_eq!(found.len() + 1, want.len());
    let left = std::fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(left, 6, "something is left beside");
}

/// Stops a run after some progress.
struct Stop {
    left: AtomicU64,
    cancel: Cancel,
}

impl Observer for Stop {
    fn advance(&self, count: u64) {
        let before = self.left.fetch_sub(
            count.min(self.left.load(Ordering::Relaxed)),
            Ordering::Relaxed,
        );
        if before <= count {
            self.cancel.cancel();
        }
    }
}

/// Runs a job; a program that another test starts may hold the lock of its folder for a moment.
fn run(job: impl Fn() -> Tiles) -> Result<TilesReport, Error> {
    loop {
        match job().run() {
            Err(Error::Locked { .. }) => std::thread::sleep(Duration::from_millis(20)),
            done => return done,
        }
    }
}

#[test]
fn a_stopped_run_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = folder.path().join("mesh.ply");
    hills(70, true).write(&mesh);
    let first = folder.path().join("first");
    tiles(&mesh, &first).run().unwrap();
    let want = files(&first);
    let output = folder.path().join("output");
    let mut stops = 0;
    for after in (1..).step_by(9000) {
        let cancel = Cancel::new();
        let observer = Arc::new(Stop {
            left: AtomicU64::new(after),
            cancel: cancel.clone(),
        });
        let resumed = || {
            tiles(&mesh, &output)
                .start(Start::Resume)
                .observer(observer.clone())
                .cancel(cancel.clone())
        };
        match run(resumed) {
            Ok(_) => break,
            Err(Error::Cancelled) => stops += 1,
            Err(other) => panic!("{other}"),
        }
        assert!(!output.exists());
        if stops == 3 {
            let refused = run(|| tiles(&mesh, &output)).unwrap_err();
            assert!(matches!(refused, Error::Unfinished { .. }), "{refused}");
            let other = || {
                tiles(&mesh, &output)
                    .options(Options::default())
                    .start(Start::Resume)
            };
            assert!(matches!(run(other).unwrap_err(), Error::Mismatch { .. }));
        }
    }
    assert!(stops > 3, "{stops}");
    equal(&output, &want, "resumed");
}

/// A cloud of a landscape, as text.
pub fn cloud(path: &Path) {
    let points = hills(60, false).vertices;
    let lines = points.iter().map(|[x, y, z]| format!("{x} {y} {z}\n"));
    std::fs::write(path, lines.collect::<String>()).unwrap();
}

#[test]
fn a_cloud_becomes_a_small_mesh_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    cloud(&at("scan.xyz"));
    let run = |output: &str, triangles| {
        let params = outcrop::Params {
            triangles,
            ..outcrop::Params::default()
        };
        let run = outcrop::Reconstruction::builder()
            .input(at("scan.xyz"))
            .output(at(output))
            .params(params);
        run.memory(192 << 20).threads(2).start(Start::Resume)
    };
    run("mesh.ply", None).build().unwrap().run().unwrap();
    let goal = outcrop::levels::single::Goal::Triangles(1000);
    outcrop::Simplification::new(at("mesh.ply"), at("want.ply"), goal)
        .memory(192 << 20)
        .run()
        .unwrap();
    let cancel = Cancel::new();
    let observer = Arc::new(Stop {
        left: AtomicU64::new(60_000),
        cancel: cancel.clone(),
    });
    let small = || run("small.ply", Some(1000));
    let stopped = small().observer(observer).cancel(cancel).build().unwrap();
    assert!(matches!(stopped.run().unwrap_err(), Error::Cancelled));
    let report = small().build().unwrap().run().unwrap();
    let made = report.simplified.unwrap();
    assert_eq!(made.triangles_before, report.mesh.triangles);
    assert!((990..=1000).contains(&made.triangles));
    let bytes = |name| std::fs::read(at(name)).unwrap();
    assert!(bytes("small.ply") == bytes("want.ply"));
    // Nothing else is left.
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 4);
    // Smaller and closed.
    let params = outcrop::Params {
        triangles: Some(1000),
        close: Some("lids".parse().unwrap()),
        ..outcrop::Params::default()
    };
    let both = run("both.ply", None).params(params).build().unwrap();
    let made = both.run().unwrap().simplified.unwrap();
    assert!(made.closed.is_some());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 5);
    for (output, triangles) in [
        ("small.ply", 0),
        ("small.ply.zst", 9),
        ("town/tileset.json", 9),
        ("small.txt", 9),
    ] {
        let refused = run(output, Some(triangles)).build();
        let refused = refused.and_then(|run| run.run());
        assert!(matches!(refused, Err(Error::Parameter { .. })), "{output}");
    }
    assert!(matches!(
        small().build().unwrap().plan(2),
        Err(Error::Parameter { .. })
    ));
}

#[test]
fn a_cloud_becomes_the_tileset_of_its_mesh() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    cloud(&at("scan.xyz"));
    let run = |output: &Path| {
        let run = outcrop::Reconstruction::builder()
            .input(at("scan.xyz"))
            .output(output);
        run.memory(192 << 20).threads(2).start(Start::Resume)
    };
    run(&at("mesh.ply")).build().unwrap().run().unwrap();
    Tiles::new(at("mesh.ply"), at("want"))
        .memory(192 << 20)
        .run()
        .unwrap();
    let output = at("town").join("tileset.json");
    let cancel = Cancel::new();
    let observer = Arc::new(Stop {
        left: AtomicU64::new(60_000),
        cancel: cancel.clone(),
    });
    let stopped = run(&output)
        .observer(observer)
        .cancel(cancel)
        .build()
        .unwrap();
    assert!(matches!(stopped.run().unwrap_err(), Error::Cancelled));
    assert_eq!(stopped.output(), output);
    let resumed = outcrop::Reconstruction::resume(at("town.outcrop-scratch")).unwrap();
    let report = resumed.memory(192 << 20).build().unwrap().run().unwrap();
    let tiles = report.tiles.unwrap();
    assert_eq!(
        (tiles.triangles, tiles.vertices),
        (report.mesh.triangles, report.mesh.vertices)
    );
    let (mut found, mut want) = (files(&at("town")), files(&at("want")));
    let name = Path::new("tileset.json");
    let json = |files: &mut BTreeMap<PathBuf, Vec<u8>>| {
        let mut json: serde_json::Value =
            serde_json::from_slice(&files.remove(name).unwrap()).unwrap();
        json["extras"]["outcrop"]["source"] = "".into();
        json
    };
    assert_eq!(json(&mut found), json(&mut want));
    assert!(found == want);
    // Nothing else is left.
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 4);
    let params = outcrop::Params {
        lossy: true,
        ..outcrop::Params::default()
    };
    let of = |output: &Path| run(output).params(params.clone()).build();
    let lossy = of(&output).unwrap().run().unwrap().tiles.unwrap();
    assert!(lossy.lossy.is_some() && lossy.bytes < tiles.bytes);
    let refused = of(&at("small.ply"));
    assert!(matches!(
        refused,
        Err(Error::Parameter { name: "lossy", .. })
    ));
    for wrong in ["tileset.json", "/tileset.json"] {
        assert!(
            matches!(run(Path::new(wrong)).build(), Err(Error::Parameter { .. })),
            "{wrong}"
        );
    }
}
