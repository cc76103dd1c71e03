//! Relaxing: smoothing that decides only which points are connected (scale space; Digne et al., *Scale
//! space meshing of raw data point sets*, Computer Graphics Forum 30, 2011). The mesh keeps the positions
//! that were measured.
//!
//! Restricted Voronoi cells disagree where points lie off the surface by a part of their spacing. So
//! points move only there: patches of points that are smooth already cost a look at some of them.

use super::fits::each_fit;
use super::moved;
use super::pass::{Pass, RUN};
use crate::error::Result;
use crate::geom::Point;
use crate::stages::cells::{Fit, TileRanges};
use crate::stages::order::PointStore;
use crate::stages::tiles::Tile;
use crate::stages::tiles::walk::PageCache;
use crate::workspace::Workspace;
use crate::workspace::memory::Reservation;
use crate::workspace::persist::persist;
use serde::Serialize;
use std::ops::Range;
use std::sync::atomic::{AtomicU8, Ordering};

/// Runs in a patch: with ids along a curve, a small piece of surface.
const PATCH: usize = 16;

/// Every so many runs one is looked at first.
const SAMPLE: usize = 8;

/// A point is rough if it lies farther from its plane than this part of the local spacing.
const ROUGH: f64 = 0.3;

/// A patch moves if more than one in so many points that were looked at is rough.
const SHARE: usize = 16;

/// Patches in a region.
const REGION: usize = 256;

/// Nothing moves in a region of which fewer than one patch in so many is rough.
const EDGES: usize = 4;

/// A run that moved moves again if at least so many of its points were rough.
const RAGGED: u8 = 1;

/// Positions to connect the points by.
#[derive(Debug)]
pub struct Relaxed {
    /// As the store's, each moved or not; `None` if none moved.
    pub store: Option<PointStore>,
    /// What was done.
    pub stats: RelaxStats,
}

/// Counts of this stage.
#[derive(Debug, Clone, Copy, Default, Serialize, PartialEq, Eq)]
pub struct RelaxStats {
    /// Rounds in which points moved.
    pub rounds: u32,
    /// Points that moved, each as often as it did.
    pub moved: u64,
}

/// Which runs of ids move, and what was seen of them.
struct Runs {
    points: usize,
    active: Vec<bool>,
    /// Rough points of each.
    rough: Vec<AtomicU8>,
    _held: Reservation,
}

impl Runs {
    fn new(points: usize, workspace: &Workspace) -> Result<Self> {
        let count = points.div_ceil(RUN);
        Ok(Self {
            _held: workspace.reserve("relax: runs", count as u64 * 2)?,
            points,
            active: vec![false; count],
            rough: (0..count).map(|_| AtomicU8::new(0)).collect(),
        })
    }

    fn is_sampled(id: usize) -> bool {
        (id / RUN).is_multiple_of(SAMPLE)
    }

    /// Takes in what was seen of a range of ids.
    fn add(&self, seen: &Seen) {
        for (rough, more) in self.rough[seen.first..].iter().zip(&seen.rough) {
            rough.fetch_add(*more, Ordering::Relaxed);
        }
    }

    /// The patches move in which enough was rough of what was looked at, unless they are few in their
    /// region: then they lie along edges and not in noise.
    fn choose(&mut self) {
        let points = self.points;
        let regions = self.active.chunks_mut(PATCH * REGION);
        let rough = self.rough.chunks_mut(PATCH * REGION);
        for (number, (active, rough)) in regions.zip(rough).enumerate() {
            let start = number * PATCH * REGION * RUN;
            let patches = active.chunks_mut(PATCH).zip(rough.chunks_mut(PATCH));
            let mut moving = 0;
            for (patch, (active, rough)) in patches.enumerate() {
                let start = start + patch * PATCH * RUN;
                let seen =
                    (start..points.min(start + PATCH * RUN)).filter(|id| Self::is_sampled(*id));
                let rough: usize = rough
                    .iter_mut()
                    .map(|r| usize::from(std::mem::take(r.get_mut())))
                    .sum();
                if rough * SHARE > seen.count() {
                    active.fill(true);
                    moving += 1;
                }
            }
            if moving * EDGES < active.len().div_ceil(PATCH) {
                active.fill(false);
            }
        }
    }

    /// Runs move again in which enough was rough.
    fn settle(&mut self) {
        for (active, rough) in self.active.iter_mut().zip(&mut self.rough) {
            *active &= std::mem::take(rough.get_mut()) >= RAGGED;
        }
    }
}

/// What was seen of a range of ids.
struct Seen {
    /// Its first run.
    first: usize,
    /// Rough points of each run.
    rough: Vec<u8>,
    moved: u64,
}

persist!(Seen {
    first,
    rough,
    moved
});

impl Seen {
    fn of(ids: &Range<usize>) -> Self {
        let first = ids.start / RUN;
        Self {
            first,
            rough: vec![0; ids.end.div_ceil(RUN) - first],
            moved: 0,
        }
    }

    fn note(&mut self, id: usize, rough: bool) {
        self.rough[id / RUN - self.first] += u8::from(rough);
    }
}

persist!(Relaxed { store, stats });
persist!(RelaxStats { rounds, moved });

/// At most `rounds` rounds of relaxing: points move to the planes of their `neighbors` nearest, in
/// each round those of the runs that were rough in the round before.
///
/// # Errors
/// [`crate::Error::Io`], [`crate::Error::Corrupt`], [`crate::Error::Memory`],
/// [`crate::Error::Cancelled`].
pub fn relax(
    store: &PointStore,
    tiles: TileRanges,
    neighbors: usize,
    rounds: u32,
    workspace: &Workspace,
) -> Result<Relaxed> {
    let mut relaxed = Relaxed {
        store: None,
        stats: RelaxStats::default(),
    };
    let mut runs = Runs::new(store.len(), workspace)?;
    if rounds > 0 {
        workspace.part("sample", || {
            sample(store, tiles, neighbors, &runs, workspace)
        })?;
        runs.choose();
    }
    for round in 1..=rounds {
        if round > 1 {
            runs.settle();
        }
        if !runs.active.contains(&true) {
            let left = u64::from(rounds + 1 - round) * store.len() as u64;
            workspace.observer.advance(left);
            break;
        }
        let current = relaxed.store.as_ref().unwrap_or(store);
        let (next, moved) = one_round(current, tiles, neighbors, round, &runs, workspace)?;
        relaxed.store = Some(next);
        relaxed.stats.rounds = round;
        relaxed.stats.moved += moved;
    }
    Ok(relaxed)
}

/// Looks at some points of every patch.
fn sample(
    store: &PointStore,
    tiles: TileRanges,
    neighbors: usize,
    runs: &Runs,
    workspace: &Workspace,
) -> Result<()> {
    let bytes = |tile: usize| Tile::bytes(tiles.ids(tile).len()) + PageCache::bytes(store);
    let work = |tile| {
        let ids = tiles.ids(tile);
        let mut seen = Seen::of(&ids);
        let points = ids.len() as u64;
        each_fit(store, ids, neighbors, Runs::is_sampled, |id, point, fit| {
            seen.note(id, target(point, &fit, neighbors).1);
        })?;
        workspace.advance(points);
        Ok(seen)
    };
    workspace.units("relax: tile", tiles.count(), bytes, work, |_, seen| {
        runs.add(&seen);
        Ok(())
    })
}

/// Moves the points of all active runs; how many.
fn one_round(
    store: &PointStore,
    tiles: TileRanges,
    neighbors: usize,
    round: u32,
    runs: &Runs,
    workspace: &Workspace,
) -> Result<(PointStore, u64)> {
    let pass = Pass {
        file: &format!("relaxed{round}"),
        memory: "relax: tile",
        tile: tiles.size(),
    };
    let work = |ids: Range<usize>, points: &mut [Point]| {
        let wanted = |id: usize| runs.active[id / RUN];
        let mut seen = Seen::of(&ids);
        if ids.clone().step_by(RUN).any(wanted) {
            each_fit(store, ids.clone(), neighbors, wanted, |id, point, fit| {
                let (to, rough) = target(point, &fit, neighbors);
                seen.note(id, rough);
                points[id - ids.start] = to;
                seen.moved += 1;
            })?;
        }
        Ok(seen)
    };
    let mut moved = 0;
    let next = pass.over(store, workspace, work, |seen: Seen| {
        runs.add(&seen);
        moved += seen.moved;
    })?;
    Ok((next, moved))
}

/// Where a point goes, and whether that is far.
fn target(point: Point, fit: &Fit, neighbors: usize) -> (Point, bool) {
    let Some(normal) = fit.plane.normal else {
        return (point, false);
    };
    let offset = fit.moments.project(normal);
    let length2 = offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2];
    // On a plane, `neighbors` points lie in the disk up to the last one.
    let spacing2 = std::f64::consts::PI * fit.last2 as f64 / neighbors as f64;
    (moved(point, offset), length2 > ROUGH * ROUGH * spacing2)
}
