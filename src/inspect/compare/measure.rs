//! Distances of samples, measured on all threads and passed on in the order of the samples.

use super::Options;
use super::pages::{Item, Pages, Searcher};
use super::samples::{self, Sample};
use super::shape::{Items, Shape};
use outcrop_disk::error::Result;
use outcrop_disk::workspace::memory::Reservation;
use outcrop_disk::workspace::{Workspace, lock};
use outcrop_geom::vector::V3;
use rayon::prelude::*;
use std::sync::Mutex;

/// Samples that one thread takes at a time. A search begins with the nearest item of the sample before, by which
/// results are rounded, so this number is fixed.
const CHUNK: usize = 1024;

/// Samples in memory at a time.
const WAVE: usize = 64 * CHUNK;

/// Finds the distances of a chunk of samples.
type Search<'a> = Box<dyn Fn(&[Sample]) -> Result<Vec<f64>> + Sync + 'a>;

/// Calls `each` with every sample of `from` and its distance to `to`.
pub(super) fn distances(
    from: &Shape,
    to: &Shape,
    options: &Options,
    workspace: &Workspace,
    mut each: impl FnMut(Sample, f64) -> Result<()>,
) -> Result<()> {
    let (search, _held) = match &to.items {
        Items::Mesh { triangles, .. } => search(triangles, workspace)?,
        Items::Cloud(points) => search(points, workspace)?,
    };
    let mut measure = |wave: &mut Vec<Sample>| {
        workspace.check_cancel()?;
        let distances: Vec<Vec<f64>> = workspace.install(|| {
            let chunks = wave.par_chunks(CHUNK).with_max_len(1);
            chunks.map(&search).collect::<Result<_>>()
        })?;
        for (sample, distance) in wave.iter().zip(distances.iter().flatten()) {
            each(*sample, *distance)?;
        }
        workspace.observer.advance(wave.len() as u64);
        wave.clear();
        Ok(())
    };
    let mut wave = Vec::with_capacity(WAVE);
    samples::for_each(from, options, workspace, |sample| {
        wave.push(sample);
        if wave.len() < WAVE {
            Ok(())
        } else {
            measure(&mut wave)
        }
    })?;
    measure(&mut wave)?;
    workspace.observer.end();
    Ok(())
}

/// Search for nearest items, with pages at hand for each thread, and the memory of these and of the samples.
fn search<'a, T: Item>(
    pages: &'a Pages<T>,
    workspace: &Workspace,
) -> Result<(Search<'a>, Reservation)> {
    let threads = workspace.threads as u64;
    let share = workspace.memory.available() / 4 / threads;
    let cached = (share / pages.page_bytes()).clamp(1, pages.count().max(1) as u64);
    let wave = WAVE * (size_of::<Sample>() + size_of::<V3>() + 2 * size_of::<f64>());
    let bytes = threads * cached * pages.page_bytes() + wave as u64;
    let held = workspace.reserve("compare: pages at hand", bytes)?;
    let searchers = Mutex::new(Vec::new());
    let search = move |samples: &[Sample]| {
        let searcher = lock(&searchers).pop();
        let mut searcher = searcher.unwrap_or_else(|| Searcher::new(cached as usize));
        let positions: Vec<V3> = samples.iter().map(|sample| sample.position).collect();
        let mut distances = pages.distances2(&positions, &mut searcher)?;
        distances.iter_mut().for_each(|d| *d = d.sqrt());
        lock(&searchers).push(searcher);
        Ok(distances)
    };
    Ok((Box::new(search), held))
}
