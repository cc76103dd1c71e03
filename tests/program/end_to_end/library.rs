//! The library: builder, progress, cancellation, typed errors.

use crate::end_to_end::util::{self, Bench};
use outcrop::params::Params;
use outcrop::{Cancel, Error, Observer, Radius, Reconstruction, Start};
use outcrop_cloudgen::{Cloud, Kind};
use std::path::PathBuf;
use std::sync::{Arc, Mutex};

/// Calls for one stage that an observer received.
#[derive(Debug, Clone, PartialEq)]
struct Stage {
    name: &'static str,
    unit: &'static str,
    total: u64,
    done: u64,
    ended: bool,
}

/// Notes all calls, and cancels in the middle of a stage or at its start.
#[derive(Default)]
struct Notes {
    stages: Mutex<Vec<Stage>>,
    cancel: Cancel,
    cancel_at: Option<usize>,
    cancel_within: Option<usize>,
}

impl Observer for Notes {
    fn begin(&self, name: &'static str, unit: &'static str, total: u64) {
        let mut stages = self.stages.lock().unwrap();
        assert!(stages.iter().all(|stage| stage.ended), "{stages:?}");
        if self.cancel_at == Some(stages.len()) {
            self.cancel.cancel();
        }
        stages.push(Stage {
            name,
            unit,
            total,
            done: 0,
            ended: false,
        });
    }

    fn advance(&self, count: u64) {
        let mut stages = self.stages.lock().unwrap();
        if self.cancel_within == Some(stages.len() - 1) {
            self.cancel.cancel();
        }
        stages.last_mut().unwrap().done += count;
    }

    fn end(&self) {
        self.stages.lock().unwrap().last_mut().unwrap().ended = true;
    }
}

fn small(bench: &Bench) -> PathBuf {
    bench.cloud(
        "cloud.laz",
        &Cloud::new(Kind::Bumpy).points(30_000).noise(1.0),
    )
}

fn smooth() -> Params {
    Params {
        smooth: outcrop::Smooth::Rounds(1),
        block: 5000,
        ..Params::default()
    }
}

#[test]
fn progress_tells_stages_and_amounts() {
    let bench = Bench::new();
    let notes = Arc::new(Notes::default());
    let report = util::builder(&[small(&bench)], &bench.path("mesh.ply"), &smooth())
        .observer(notes.clone())
        .build()
        .unwrap()
        .run()
        .unwrap();
    let stages = notes.stages.lock().unwrap();
    let names: Vec<_> = stages.iter().map(|stage| stage.name).collect();
    let reported: Vec<_> = report.stages.iter().map(|stage| stage.name).collect();
    assert_eq!(names, reported);
    for stage in stages.iter() {
        assert!(stage.ended && stage.done > 0, "{stage:?}");
        assert!(stage.total == 0 || stage.done == stage.total, "{stage:?}");
    }
}

#[test]
fn a_run_can_be_cancelled_in_every_stage() {
    let bench = Bench::new();
    let input = small(&bench);
    let folder = bench.subfolder("folder");
    let stages = 9;
    let points = (0..stages).flat_map(|stage| [(Some(stage), None), (None, Some(stage))]);
    for (cancel_at, cancel_within) in points {
        let notes = Arc::new(Notes {
            cancel_at,
            cancel_within,
            ..Notes::default()
        });
        let outcome = util::builder(
            std::slice::from_ref(&input),
            &folder.join("mesh.ply"),
            &smooth(),
        )
        .observer(notes.clone())
        .cancel(notes.cancel.clone())
        .start(Start::Restart)
        .build()
        .unwrap()
        .run();
        let heard = notes.stages.lock().unwrap();
        if cancel_within == Some(stages - 1) {
            // The last call of the last stage may come too late.
            assert!(
                matches!(outcome, Ok(_) | Err(Error::Cancelled)),
                "{outcome:?}"
            );
            continue;
        }
        assert!(matches!(outcome, Err(Error::Cancelled)), "{heard:?}");
        let stopped = cancel_at.or(cancel_within).unwrap();
        assert!(
            heard.len() <= stopped + 2,
            "went on after {stopped}: {heard:?}"
        );
        let left = util::listing(&folder);
        let unfinished = ["mesh.ply.outcrop-scratch", ".mesh.ply.outcrop-part"];
        for name in left {
            assert!(unfinished.contains(&name.as_str()), "{name}: {heard:?}");
        }
    }
}

#[test]
fn a_run_cancelled_before_it_starts_does_nothing() {
    let bench = Bench::new();
    let input = small(&bench);
    let cancel = Cancel::new();
    cancel.cancel();
    let outcome = util::builder(&[input], &bench.path("mesh.ply"), &Params::default())
        .cancel(cancel)
        .build()
        .unwrap()
        .run();
    assert!(matches!(outcome, Err(Error::Cancelled)));
    assert_eq!(util::listing(bench.folder()), ["cloud.laz"]);
}

#[test]
fn a_builder_refuses_what_cannot_work() {
    let with = |params: Params| {
        Reconstruction::builder()
            .input("cloud.laz")
            .output("mesh.ply")
            .params(params)
            .build()
            .err()
    };
    let parameter = |error: Option<Error>| match error {
        Some(Error::Parameter { name, .. }) => name,
        other => panic!("{other:?}"),
    };
    let default = Params::default;
    assert_eq!(
        parameter(with(Params {
            neighbors: 2,
            ..default()
        })),
        "neighbors"
    );
    assert_eq!(
        parameter(with(Params {
            max_angle: 0.0,
            ..default()
        })),
        "max_angle"
    );
    assert_eq!(
        parameter(with(Params {
            max_angle: f64::NAN,
            ..default()
        })),
        "max_angle"
    );
    assert_eq!(
        parameter(with(Params {
            smooth: outcrop::Smooth::Rounds(101),
            ..default()
        })),
        "smooth"
    );
    assert_eq!(
        parameter(with(Params {
            radius: Radius::Length(-1.0),
            ..default()
        })),
        "radius"
    );
    assert_eq!(
        parameter(with(Params {
            max_hole_edges: 1 << 20,
            ..default()
        })),
        "max_hole_edges"
    );
    assert_eq!(
        parameter(Reconstruction::builder().output("mesh.ply").build().err()),
        "INPUT"
    );
    assert_eq!(
        parameter(Reconstruction::builder().input("a.las").build().err()),
        "output"
    );
    let low = Reconstruction::builder()
        .input("a.las")
        .output("m.ply")
        .memory(1 << 20)
        .build();
    assert!(matches!(
        low.err(),
        Some(Error::Memory {
            budget: 1_048_576,
            ..
        })
    ));
}

#[test]
fn errors_of_a_run_are_typed() {
    let bench = Bench::new();
    let mesh = bench.path("mesh.ply");
    let outcome = |input: PathBuf, params: &Params| {
        util::builder(&[input], &mesh, params)
            .build()
            .unwrap()
            .run()
            .unwrap_err()
    };
    let default = Params::default();
    let text = |name: &str, text: &str| bench.write(name, text);
    let error = outcome(bench.path("absent.las"), &default);
    assert!(matches!(error, Error::Io { .. }), "{error:?}");
    let error = outcome(text("short.las", "LASF"), &default);
    assert!(matches!(error, Error::Input { .. }), "{error:?}");
    let error = outcome(text("line.xyz", "0 0 0\n1 1 1\n2 2 2\n4 4 4\n"), &default);
    assert!(matches!(error, Error::Degenerate { .. }), "{error:?}");
    let strict = Params {
        min_component: Some(1_000_000),
        ..Params::default()
    };
    let error = outcome(small(&bench), &strict);
    assert!(matches!(error, Error::NoTriangles { .. }), "{error:?}");
    let helps = outcrop::error::Remedy::Smaller("min_component");
    assert!(
        error.remedies().contains(&helps) && !error.to_string().contains("--"),
        "{error:?}"
    );
    assert!(!mesh.exists());
}

#[test]
fn a_description_can_run_twice() {
    let bench = Bench::new();
    let mesh = bench.path("mesh.ply");
    let run = util::builder(&[small(&bench)], &mesh, &Params::default())
        .build()
        .unwrap();
    run.run().unwrap();
    let first = util::hash(&mesh);
    run.run().unwrap();
    assert_eq!(util::hash(&mesh), first);
    assert_eq!(util::listing(bench.folder()), ["cloud.laz", "mesh.ply"]);
}
