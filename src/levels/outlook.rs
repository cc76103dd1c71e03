//! Times of the stages on a finished mesh, for the progress.

use outcrop_disk::workspace::outlook::Planned;

/// The stages: their names, and microseconds that they take for each triangle on one thread (BENCHMARKS.md, "Levels of
/// detail"). Reading and most of dividing have one thread.
const READ: (&str, f64) = ("read mesh", 0.15);
const DIVIDE: (&str, f64) = ("divide", 0.25);
const SHARE: (&str, f64) = ("share", 0.25);
pub(super) const LEAVES: (&str, f64) = ("leaves", 0.4);
pub(super) const LEVEL: (&str, f64) = ("level", 0.55);
pub(super) const WRITE: (&str, f64) = ("write", 0.02);

/// Those of a smaller mesh: 200 million triangles took 261 s on two threads (docs/simplify.md).
const MEASURE: (&str, f64) = ("measure", 0.5);
const SIMPLIFY: (&str, f64) = ("simplify", 1.0);

/// Those of a closed mesh: 40 million triangles took 23 s on two threads (docs/close.md).
const EDGES: (&str, f64) = ("find edges", 0.15);
const SURROUNDINGS: (&str, f64) = ("find surroundings", 0.15);
const LOOPS: (&str, f64) = ("close loops", 0.3);
const CROSSINGS: (&str, f64) = ("find crossings", 0.4);

/// Triangles of the children of all tiles for each triangle of the mesh, before they are known.
const ABOVE: f64 = 1.3;

/// Triangles for each point of a cloud, about.
const OF_POINTS: u64 = 2;

/// A stage, with the time that it takes.
pub(super) fn planned(
    (name, each): (&'static str, f64),
    triangles: f64,
    threads: usize,
) -> Planned {
    let seconds = each * 1e-6 * triangles / threads.max(1) as f64;
    Planned { name, seconds }
}

/// All stages of the levels of detail of a mesh with so many triangles.
pub(super) fn all(triangles: u64, threads: usize) -> Vec<Planned> {
    let count = triangles as f64;
    vec![
        planned(READ, count, 1),
        planned(DIVIDE, count, 1),
        planned(SHARE, count, threads),
        planned(LEAVES, count, threads),
        planned(LEVEL, ABOVE * count, threads),
        planned(WRITE, count, threads),
    ]
}

/// All stages of a mesh of fewer triangles, made of that of so many points.
pub fn of_simplified(points: u64, threads: usize) -> Vec<Planned> {
    let count = (OF_POINTS * points) as f64;
    vec![
        // The whole has the name of its longest part.
        planned((SIMPLIFY.0, 0.0), count, 1),
        planned(READ, count, 1),
        planned(DIVIDE, count, 1),
        planned(SHARE, count, threads),
        planned(MEASURE, count, threads),
        planned(SIMPLIFY, count, threads),
        planned(CROSSINGS, count, threads),
    ]
}

/// All stages of a closed mesh, made of that of so many points.
pub fn of_closed(points: u64, threads: usize) -> Vec<Planned> {
    let count = (OF_POINTS * points) as f64;
    let stages = [EDGES, SURROUNDINGS, LOOPS, CROSSINGS, WRITE];
    stages.map(|stage| planned(stage, count, threads)).into()
}

/// All stages of the levels of detail of the mesh of so many points.
pub fn of_points(points: u64, threads: usize) -> Vec<Planned> {
    all(OF_POINTS * points, threads)
}
