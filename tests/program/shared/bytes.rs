//! The mesh is that of one process for any number of shards, threads, workers and any memory.

use crate::end_to_end::util;
use crate::shared::run::Case;

/// Runs with several shards, threads, budgets and workers.
fn equal(options: &[&str], plans: &[&[&str]]) {
    let case = Case::new(options);
    for plan in plans {
        case.plan(plan);
        let said = case.say("submit", &["--workers", "3"]);
        assert_eq!(said.code, Some(0), "{plan:?}: {said:?}");
        assert!(said.out.contains("the mesh is finished"), "{said:?}");
        case.check();
    }
}

const PLANS: &[&[&str]] = &[
    &["--shards", "1", "--task-threads", "2"],
    &["--shards", "3", "--task-memory", "192MiB"],
    &[
        "--shards",
        "8",
        "--task-threads",
        "2",
        "--task-memory",
        "1GiB",
    ],
];

#[test]
fn shards_do_not_change_the_mesh() {
    equal(&[], PLANS);
}

#[test]
fn shards_do_not_change_the_papers_mesh() {
    equal(
        &["--method", "paper", "--smooth", "1", "--relax", "1"],
        &PLANS[1..],
    );
}

#[test]
fn shards_do_not_change_a_filtered_mesh() {
    equal(
        &["--thin", "6", "--drop-outliers", "--smooth", "2"],
        &PLANS[1..],
    );
    equal(&["--drop-classes", "7", "--no-repair"], &PLANS[2..]);
}

#[test]
fn a_compressed_mesh_is_the_same() {
    let case = Case::new(&[]);
    let (one, many) = (
        case.bench.path("one.ply.zst"),
        case.bench.path("many.ply.zst"),
    );
    let input = case.input.display().to_string();
    let mesh = many.display().to_string();
    let said = util::run(["reconstruct", &input, "-o", &one.display().to_string()]);
    assert_eq!(said.code, Some(0), "{said:?}");
    let said = util::run(["plan", &input, "-o", &mesh, "--shards", "2"]);
    assert_eq!(said.code, Some(0), "{said:?}");
    let said = util::run(["submit", &format!("{mesh}.outcrop-scratch")]);
    assert_eq!(said.code, Some(0), "{said:?}");
    assert!(util::hash(&one) == util::hash(&many));
}

#[test]
fn meshes_in_other_formats_are_the_same() {
    let case = Case::new(&[]);
    let input = case.input.display().to_string();
    let parts = ["--block-points", "4096", "--tile-points", "1500"];
    for (name, options) in [
        ("obj", &["--normals"][..]),
        ("stl", &[]),
        ("glb", &["--normals"]),
    ] {
        let one = case.bench.path(&format!("one.{name}"));
        let many = case.bench.path(&format!("many.{name}"));
        let (whole, mesh) = (one.display().to_string(), many.display().to_string());
        let run = |first: &[&str]| {
            let said = util::run(first.iter().chain(&parts).chain(options));
            assert_eq!(said.code, Some(0), "{said:?}");
        };
        run(&["reconstruct", &input, "-o", &whole]);
        run(&["plan", &input, "-o", &mesh, "--shards", "3"]);
        let said = util::run([
            "submit",
            &format!("{mesh}.outcrop-scratch"),
            "--workers",
            "2",
        ]);
        assert_eq!(said.code, Some(0), "{said:?}");
        assert!(util::hash(&one) == util::hash(&many), "{name}");
    }
}

#[test]
fn tasks_have_other_threads_and_memory_than_planned() {
    let case = Case::new(&[]);
    case.plan(&["--shards", "4", "--task-threads", "3"]);
    while case.advance() {
        for (shard, threads) in case
            .status()
            .missing()
            .into_iter()
            .zip(["1", "2", "3"].iter().cycle())
        {
            let shard = shard.to_string();
            let more = [
                "--shard",
                &shard,
                "--threads",
                threads,
                "--memory",
                "300MiB",
                "--io",
                "read",
            ];
            let said = case.say("work", &more);
            assert_eq!(said.code, Some(0), "{said:?}");
        }
    }
    case.check();
}
