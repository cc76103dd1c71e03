//! Distances of samples, measured on all threads and passed on in the order of the samples.

use super::Options;
use super::pages::{Best, Cache, Item, Pages};
use super::samples::{self, Sample};
use super::shape::{Items, Shape};
use crate::error::Result;
use crate::workspace::memory::Reservation;
use crate::workspace::{Workspace, lock};
use rayon::prelude::*;
use std::sync::Mutex;

/// Samples that one thread takes at a time. A search begins with the nearest item of the sample before, so
/// this number is fixed.
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

/// Search for nearest items, with a page cache for each thread, and the memory of these caches and of the
/// samples.
fn search<'a, T: Item>(
    pages: &'a Pages<T>,
    workspace: &Workspace,
) -> Result<(Search<'a>, Reservation)> {
    let threads = workspace.threads as u64;
    let share = workspace.memory.available() / 4 / threads;
    let cached = (share / pages.page_bytes()).clamp(1, pages.count().max(1) as u64);
    let wave = WAVE * (size_of::<Sample>() + 2 * size_of::<f64>());
    let bytes = threads * cached * pages.page_bytes() + wave as u64;
    let held = workspace.reserve("compare: pages at hand", bytes)?;
    let caches = Mutex::new(Vec::new());
    let search = move |samples: &[Sample]| {
        let cache = lock(&caches).pop();
        let mut cache = cache.unwrap_or_else(|| Cache::new(cached as usize));
        let mut item: Option<T> = None;
        let mut distances = Vec::with_capacity(samples.len());
        for sample in samples {
            let from = |item: T| item.distance2(sample.position);
            let mut best = Best {
                distance2: item.map_or(f64::INFINITY, from),
                item,
            };
            pages.nearest(sample.position, &mut best, &mut cache)?;
            item = best.item;
            distances.push(best.distance2.sqrt());
        }
        lock(&caches).push(cache);
        Ok(distances)
    };
    Ok((Box::new(search), held))
}
