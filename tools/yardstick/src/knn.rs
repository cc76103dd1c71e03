//! K: queries of a k-d tree, one after another.

use crate::{Result, cpu};
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use outcrop_disk::workspace::Workspace;
use rayon::prelude::*;
use std::num::NonZero;
use std::time::Instant;

/// Neighbours per query; the query itself is one of them.
const NEIGHBORS: usize = 30;

/// The k-d tree's times in seconds.
#[derive(Debug, Clone, Copy)]
pub struct Times {
    /// Building the tree; not part of K.
    pub build: f64,
    /// All queries: K.
    pub queries: f64,
    /// Processor time of all queries.
    pub cpu: f64,
}

/// Measures `nearest_n(30)` for all points on the workspace's threads.
pub fn time(points: &[[f32; 3]], workspace: &Workspace) -> Result<Times> {
    let neighbors = NonZero::new(NEIGHBORS).ok_or("no neighbours asked for")?;
    let start = Instant::now();
    let tree: ImmutableKdTree<f32, 3> = ImmutableKdTree::new_from_slice(points);
    let build = start.elapsed().as_secs_f64();
    let (start, cpu) = (Instant::now(), cpu::own()?);
    let answer = |p| {
        let near = tree.nearest_n::<SquaredEuclidean>(p, neighbors);
        near.last().map_or(0.0, |n| f64::from(n.distance))
    };
    let sum: f64 = workspace.install(|| points.par_iter().map(answer).sum());
    let queries = start.elapsed().as_secs_f64();
    let cpu = cpu::own()? - cpu;
    // The sum prevents the compiler from removing the queries.
    if !sum.is_finite() {
        return Err("the k-d tree's distances are not finite".into());
    }
    Ok(Times {
        build,
        queries,
        cpu,
    })
}
