//! The look at all regions before points move: the usual reach of each patch, from samples, and the level of
//! noise at each point of those regions whose samples show noise.

use super::Relaxing;
use super::level::Gauges;
use crate::cells::{Planes, Widen};
use crate::ids::Id;
use crate::levels::Levels;
use crate::order::PointStore;
use crate::spacing::StoredSpacings;
use crate::tiles::Tile;
use crate::tiles::walk::PageCache;
use outcrop_disk::error::Result;
use outcrop_disk::workspace::memory::bytes_of;
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_paper::method::METHOD;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// What the look at all regions found.
pub(super) struct Found {
    /// The local spacings.
    pub spacings: StoredSpacings,
    /// The level of noise at each point; 0 in regions without noise.
    pub levels: Levels,
    /// True if a region has noise.
    pub noisy: bool,
}

/// What the look at one region found.
#[derive(Serialize, Deserialize)]
struct Seen {
    /// The usual reach of each patch, squared.
    usual2: Vec<u64>,
    /// The usual reach of the region, squared.
    region2: u64,
    /// Empty if the region has no noise.
    levels: Levels,
}

/// A sample of a region.
#[derive(Debug, Clone, Copy, Default)]
struct Sample {
    id: Id,
    /// Squared distance of the last neighbour.
    last2: u64,
    level: u8,
    /// True if the noise is plain.
    plain: bool,
}

/// Looks at all regions; `levels` are zeros.
pub(super) fn look(
    store: &PointStore,
    relaxing: Relaxing,
    levels: Levels,
    workspace: &Workspace,
) -> Result<Found> {
    let size = METHOD.curve.block as usize;
    let region = |number: usize| number * size..((number + 1) * size).min(store.len());
    let bytes = |number: usize| {
        let points = region(number).len();
        let lists = size_of::<Sample>() / METHOD.curve.sample + 2;
        Tile::estimate(points) + PageCache::estimate(store) + (points * lists) as u64
    };
    let work = |unit: &Unit<'_>| {
        let ids = region(unit.number());
        let seen = look_at(unit, store, ids.clone(), relaxing)?;
        unit.advance(ids.len() as u64);
        Ok(seen)
    };
    let mut found = Found {
        spacings: StoredSpacings::new(store.len()),
        levels,
        noisy: false,
    };
    let each = |number: usize, seen: Seen| {
        let first = region(number).start;
        found.spacings.put(first, &seen.usual2, seen.region2);
        found.noisy |= !seen.levels.is_empty();
        found.levels.put(first, &seen.levels);
        Ok(())
    };
    let step = ("noise", "noise: region");
    workspace.units(step, store.len().div_ceil(size), bytes, work, each)?;
    Ok(found)
}

/// Looks at the samples of a region, and at all its points if the samples show noise.
fn look_at(
    unit: &Unit<'_>,
    store: &PointStore,
    ids: Range<usize>,
    relaxing: Relaxing,
) -> Result<Seen> {
    let planes = Planes::load(unit, store, ids.clone(), |_| true, relaxing.neighbors)?;
    let samples = samples(&planes, ids.len(), relaxing)?;
    let held = unit.hold(bytes_of(&samples));
    let usual2 = usual_reach(&samples);
    let region2 = lower_quartile(usual2.clone());
    let noisy = is_noisy(&samples);
    let mut levels = Levels::new(if noisy { ids.len() } else { 0 });
    let put = |levels: &mut Levels, id: usize, level: u8| {
        let last = (id + METHOD.noise.every).min(ids.end);
        (id..last).for_each(|id| levels.set(id - ids.start, level));
    };
    if noisy {
        let measured = |sample: &&Sample| is_measured(sample.id.index());
        for sample in samples.iter().filter(measured) {
            put(&mut levels, sample.id.index(), sample.level);
        }
    }
    drop((samples, held));
    let _held = unit.hold(levels.bytes());
    if noisy {
        let mut gauges = Gauges::default();
        let mut put = |id: usize, level: u8, _| put(&mut levels, id, level);
        planes.each_fit(
            Widen::OnBands,
            METHOD.noise.nearest,
            |id| is_measured(id) && !is_sampled(id),
            |id, fit, near| gauges.add(id.index(), near, (fit, relaxing.neighbors), &mut put),
            |_, _, ()| (),
        )?;
        gauges.finish(&mut put);
    }
    Ok(Seen {
        usual2,
        region2,
        levels,
    })
}

/// The samples of a region with a number of `points`, in order of id.
fn samples(planes: &Planes<'_>, points: usize, relaxing: Relaxing) -> Result<Vec<Sample>> {
    let mut samples: Vec<Sample> = Vec::with_capacity(points / METHOD.curve.sample + 16);
    let mut gauges = Gauges::default();
    let mut put = |sample: Sample, level: u8, plain: bool| {
        samples.push(Sample {
            level,
            plain,
            ..sample
        });
    };
    let measured = relaxing.rounds > 0;
    planes.each_fit(
        Widen::OnBands,
        METHOD.noise.nearest,
        is_sampled,
        |id, fit, near| {
            let sample = Sample {
                id,
                last2: fit.near2,
                ..Sample::default()
            };
            match measured {
                true => gauges.add(sample, near, (fit, relaxing.neighbors), &mut put),
                false => put(sample, 0, false),
            }
        },
        |_, _, ()| (),
    )?;
    gauges.finish(&mut put);
    samples.sort_unstable_by_key(|sample| sample.id);
    Ok(samples)
}

fn is_sampled(id: usize) -> bool {
    (id / METHOD.curve.run).is_multiple_of(METHOD.curve.sample)
}

/// True if the noise of this point is also that of those behind it.
fn is_measured(id: usize) -> bool {
    id.is_multiple_of(METHOD.noise.every)
}

/// True if there is a run in which fewer than one in ten samples have no plain noise. Edges and details beside
/// smooth surface leave more.
fn is_noisy(samples: &[Sample]) -> bool {
    let run = |sample: &Sample| sample.id.index() / METHOD.curve.run;
    let runs = samples.chunk_by(|a, b| run(a) == run(b));
    let mut full = runs.filter(|run| run.len() == METHOD.curve.run);
    full.any(|run| {
        let clean = run.iter().filter(|sample| !sample.plain).count();
        METHOD.noise.few * clean < run.len()
    })
}

/// The usual reach of each patch, squared: the lower quartile over its samples.
fn usual_reach(samples: &[Sample]) -> Vec<u64> {
    let patch = |sample: &Sample| sample.id.index() / METHOD.curve.patch;
    let patches = samples.chunk_by(|a, b| patch(a) == patch(b));
    let reach = |patch: &[Sample]| patch.iter().map(|sample| sample.last2).collect();
    patches.map(|patch| lower_quartile(reach(patch))).collect()
}

fn lower_quartile(mut all: Vec<u64>) -> u64 {
    if all.is_empty() {
        return 0;
    }
    let place = all.len() / 4;
    *all.select_nth_unstable(place).1
}
