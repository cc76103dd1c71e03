//! Distances of samples, measured on all threads and passed on in the order of the samples.

use super::pages::{Best, Cache, Item, Pages};
use super::samples::Sample;
use super::shape::{Items, Shape};
use super::vector::V3;
use crate::error::Result;
use crate::workspace::Workspace;
use crate::workspace::memory::Reservation;
use rayon::prelude::*;
use std::sync::{Mutex, PoisonError};

/// Samples that one thread takes at a time. A search begins with the nearest item of the sample before, so
/// this number is fixed.
const CHUNK: usize = 1024;

/// Samples in memory at a time.
const WAVE: usize = 64 * CHUNK;

/// Receives samples and passes on their distances.
pub(super) trait Measure {
    /// Adds a sample.
    fn push(&mut self, sample: Sample) -> Result<()>;
    /// Ends input.
    fn finish(&mut self) -> Result<()>;
}

/// Distances to a shape; `each` is called with every sample and its distance.
pub(super) fn to<'a>(
    shape: &'a Shape,
    workspace: &'a Workspace,
    each: impl FnMut(Sample, f64) -> Result<()> + 'a,
) -> Result<Box<dyn Measure + 'a>> {
    Ok(match &shape.items {
        Items::Mesh { triangles, .. } => Box::new(Waves::new(triangles, workspace, each)?),
        Items::Cloud(points) => Box::new(Waves::new(points, workspace, each)?),
    })
}

/// Finds nearest items, with a page cache for each thread.
struct Search<'a, T: Item> {
    pages: &'a Pages<T>,
    caches: Mutex<Vec<Cache<T>>>,
    cached: usize,
}

impl<T: Item> Search<'_, T> {
    fn caches(&self) -> std::sync::MutexGuard<'_, Vec<Cache<T>>> {
        self.caches.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn chunk(&self, samples: &[Sample]) -> Result<Vec<f64>> {
        let cache = self.caches().pop();
        let mut cache = cache.unwrap_or_else(|| Cache::new(self.cached));
        let mut item: Option<T> = None;
        let mut distances = Vec::with_capacity(samples.len());
        for sample in samples {
            let from = |item: T| item.distance2(sample.position);
            let mut best = Best {
                distance2: item.map_or(f64::INFINITY, from),
                item,
            };
            self.pages.nearest(sample.position, &mut best, &mut cache)?;
            item = best.item;
            distances.push(best.distance2.sqrt());
        }
        self.caches().push(cache);
        Ok(distances)
    }
}

struct Waves<'a, T: Item, F> {
    search: Search<'a, T>,
    workspace: &'a Workspace,
    each: F,
    wave: Vec<Sample>,
    _held: Reservation,
}

impl<'a, T, F> Waves<'a, T, F>
where
    T: Item,
    F: FnMut(Sample, f64) -> Result<()>,
{
    fn new(pages: &'a Pages<T>, workspace: &'a Workspace, each: F) -> Result<Self> {
        let threads = workspace.threads as u64;
        let share = workspace.memory.available() / 4 / threads;
        let cached = (share / pages.page_bytes()).clamp(1, pages.count().max(1) as u64);
        let wave = WAVE * (size_of::<Sample>() + 2 * size_of::<f64>());
        let bytes = threads * cached * pages.page_bytes() + wave as u64;
        let held = workspace.reserve("compare: pages at hand", bytes)?;
        let search = Search {
            pages,
            caches: Mutex::default(),
            cached: cached as usize,
        };
        Ok(Self {
            search,
            workspace,
            each,
            wave: Vec::with_capacity(WAVE),
            _held: held,
        })
    }

    fn flush(&mut self) -> Result<()> {
        self.workspace.check_cancel()?;
        let (search, wave) = (&self.search, &self.wave);
        let distances: Vec<Vec<f64>> = self.workspace.install(|| {
            let chunks = wave.par_chunks(CHUNK).with_max_len(1);
            chunks
                .map(|chunk| search.chunk(chunk))
                .collect::<Result<_>>()
        })?;
        let all = distances.iter().flatten();
        for (sample, distance) in self.wave.iter().zip(all) {
            (self.each)(*sample, *distance)?;
        }
        self.workspace.observer.advance(self.wave.len() as u64);
        self.wave.clear();
        Ok(())
    }
}

impl<T, F> Measure for Waves<'_, T, F>
where
    T: Item,
    F: FnMut(Sample, f64) -> Result<()>,
{
    fn push(&mut self, sample: Sample) -> Result<()> {
        self.wave.push(sample);
        if self.wave.len() == WAVE {
            self.flush()?;
        }
        Ok(())
    }

    fn finish(&mut self) -> Result<()> {
        self.flush()
    }
}

/// Running sums of one direction.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sums {
    pub(super) samples: u64,
    pub(super) counted: u64,
    pub(super) sum: f64,
    pub(super) squares: f64,
    pub(super) max: f64,
    pub(super) max_at: Option<V3>,
}

impl Sums {
    pub(super) fn add(&mut self, sample: &Sample, distance: f64) {
        self.samples += 1;
        if sample.counts {
            self.counted += 1;
            self.sum += distance;
            self.squares += distance * distance;
        }
        if self.max_at.is_none() || distance > self.max {
            self.max = distance;
            self.max_at = Some(sample.position);
        }
    }

    /// Both directions together.
    pub(super) fn with(self, other: Self) -> Self {
        let far = if other.max > self.max { other } else { self };
        Self {
            samples: self.samples + other.samples,
            counted: self.counted + other.counted,
            sum: self.sum + other.sum,
            squares: self.squares + other.squares,
            max: far.max,
            max_at: far.max_at,
        }
    }
}
