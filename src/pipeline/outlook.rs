//! Times of the stages of a run, for its progress.

use crate::params::{Method, Params};
use outcrop_disk::workspace::outlook::Planned;

/// Microseconds that a stage takes for each point on one thread: 100 M points in 512 MiB (BENCHMARKS.md, "Large
/// clouds in 1 GiB" and "Values of points"), of noisy stages between a clean surface and an outdoor scan.
const INGEST: f64 = 0.18;
const THIN: f64 = 0.15;
const ORDER: f64 = 0.13;
const OUTLIERS: f64 = 0.6;
const ATTRIBUTES: f64 = 0.3;
const SMOOTH: f64 = 0.8;
const RELAX: f64 = 0.3;
const DISPLACEMENT: f64 = 0.03;
const CELLS: f64 = 1.3;
const TRIPLES: f64 = 0.07;
const STITCH: f64 = 0.4;
const REPAIR: f64 = 0.25;
const CUT: f64 = 0.9;
const EXPORT: f64 = 0.06;

/// Factor of the export of a compressed mesh.
const COMPRESSED: f64 = 8.0;

/// The stages of a run in their order, with the seconds that they take on `threads` threads; `valued` if points
/// keep values.
pub(super) fn plan(
    params: &Params,
    points: u64,
    threads: usize,
    valued: bool,
    compressed: bool,
) -> Vec<Planned> {
    let all = points as f64 * 1e-6 / threads.max(1) as f64;
    let mut stages = Vec::new();
    let mut add = |name, each: f64| {
        stages.push(Planned {
            name,
            seconds: each * all,
        })
    };
    add("ingest", INGEST);
    if params.thin.is_some() {
        add("thin", THIN);
    }
    add("order", ORDER);
    if params.drop_outliers.is_some() {
        add("outliers", OUTLIERS);
    }
    if valued {
        add("attributes", ATTRIBUTES);
    }
    for _ in 0..params.smooth.rounds() {
        add("smooth", SMOOTH);
    }
    if params.relax > 0 || params.method == Method::Robust {
        add("relax", RELAX);
    }
    if params.attributes.has_displacement() {
        add("displacement", DISPLACEMENT);
    }
    add("cells", CELLS);
    add("triples", TRIPLES);
    add("stitch", STITCH);
    add("repair", REPAIR);
    if params.attributes.has_confidence() {
        add("confidence", DISPLACEMENT);
    }
    if params.crop.is_some() || params.split.is_some() {
        add("cut", CUT);
    }
    add("export", EXPORT * if compressed { COMPRESSED } else { 1.0 });
    stages
}
