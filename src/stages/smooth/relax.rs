//! Relaxing: smoothing that decides only which points are connected (scale space; Digne et al., *Scale
//! space meshing of raw data point sets*, Computer Graphics Forum 30, 2011). The mesh keeps the positions
//! that were measured.
//!
//! Restricted Voronoi cells disagree where points lie off the surface by a part of their spacing. So
//! points move only there: patches of points that are smooth already cost a look at some of them.

use super::fits::each_fit;
use super::moved;
use crate::error::Result;
use crate::geom::Point;
use crate::spill::Sections;
use crate::stages::cells::{Fit, TileRanges};
use crate::stages::order::{PointStore, StoreWriter};
use crate::stages::tiles::Tile;
use crate::stages::tiles::walk::PageCache;
use crate::workspace::Workspace;
use crate::workspace::memory::Reservation;
use crate::workspace::persist::persist;
use serde::Serialize;
use std::ops::Range;
use std::sync::atomic::{AtomicU16, Ordering};

/// Ids in a patch: with ids along a curve, a small piece of surface.
const PATCH: usize = 256;

/// Of a patch every [`SAMPLE`]th run of [`RUN`] ids is looked at first.
const SAMPLE: usize = 8;
const RUN: usize = 16;

/// A point is rough if it lies farther from its plane than this part of the local spacing.
const ROUGH: f64 = 0.3;

/// A patch moves if more than one in so many points that were looked at is rough.
const SHARE: u32 = 16;

/// Patches in a region.
const REGION: usize = 256;

/// Nothing moves in a region of which fewer than one patch in so many is rough.
const EDGES: usize = 4;

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

persist!(Relaxed { store, stats });
persist!(RelaxStats { rounds, moved });

/// Which patches move, and what was seen of them.
struct Patches {
    active: Vec<bool>,
    seen: Vec<AtomicU16>,
    rough: Vec<AtomicU16>,
    _held: Reservation,
}

impl Patches {
    fn new(points: usize, workspace: &Workspace) -> Result<Self> {
        let count = points.div_ceil(PATCH);
        let counters = || (0..count).map(|_| AtomicU16::new(0)).collect();
        Ok(Self {
            _held: workspace.reserve("relax: patches", count as u64 * 5)?,
            active: vec![true; count],
            seen: counters(),
            rough: counters(),
        })
    }

    /// Takes in what was seen of a tile.
    fn add(&self, notes: &Notes) {
        for (patch, &[seen, rough]) in (notes.first..).zip(&notes.counts) {
            self.seen[patch].fetch_add(seen, Ordering::Relaxed);
            self.rough[patch].fetch_add(rough, Ordering::Relaxed);
        }
    }

    /// Patches stay active where enough was rough.
    fn settle(&mut self) {
        for (active, (seen, rough)) in self
            .active
            .iter_mut()
            .zip(self.seen.iter_mut().zip(&mut self.rough))
        {
            let (seen, rough) = (
                std::mem::take(seen.get_mut()),
                std::mem::take(rough.get_mut()),
            );
            *active &= u32::from(rough) * SHARE > u32::from(seen);
        }
    }

    /// Where few patches are rough, they lie along edges and not in noise: none of them is active.
    fn leave_edges(&mut self) {
        for region in self.active.chunks_mut(REGION) {
            let active = region.iter().filter(|a| **a).count();
            if active * EDGES < region.len() {
                region.fill(false);
            }
        }
    }
}

/// What was seen of the patches of a tile.
struct Notes {
    first: usize,
    /// Points looked at or moved, and the rough ones of them, by patch.
    counts: Vec<[u16; 2]>,
    moved: u64,
}

persist!(Notes {
    first,
    counts,
    moved
});

impl Notes {
    fn of(ids: &Range<usize>) -> Self {
        let patches = ids.end.div_ceil(PATCH) - ids.start / PATCH;
        Self {
            first: ids.start / PATCH,
            counts: vec![[0; 2]; patches],
            moved: 0,
        }
    }

    fn note(&mut self, id: usize, rough: bool) {
        let [seen, roughs] = &mut self.counts[id / PATCH - self.first];
        *seen += 1;
        *roughs += u16::from(rough);
    }
}

/// At most `rounds` rounds of relaxing: points move to the planes of their `neighbors` nearest, in
/// each round those of the patches that were rough in the round before.
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
    let mut patches = Patches::new(store.len(), workspace)?;
    if rounds > 0 {
        let sampled = |id: usize| (id / RUN).is_multiple_of(SAMPLE);
        workspace.part("sample", || {
            let bytes = |tile: usize| Tile::bytes(tiles.ids(tile).len()) + PageCache::bytes(store);
            let work = |tile| {
                let ids = tiles.ids(tile);
                let mut notes = Notes::of(&ids);
                let points = ids.len() as u64;
                each_fit(store, ids, neighbors, sampled, |id, point, fit| {
                    notes.note(id, target(point, &fit, neighbors).1);
                })?;
                workspace.advance(points);
                Ok(notes)
            };
            workspace.units("relax: tile", tiles.count(), bytes, work, |_, notes| {
                patches.add(&notes);
                Ok(())
            })
        })?;
    }
    patches.settle();
    patches.leave_edges();
    for round in 1..=rounds {
        if round > 1 {
            patches.settle();
        }
        if !patches.active.contains(&true) {
            let left = u64::from(rounds + 1 - round) * store.len() as u64;
            workspace.observer.advance(left);
            break;
        }
        let current = relaxed.store.as_ref().unwrap_or(store);
        let (next, moved) = one_round(current, tiles, neighbors, round, &patches, workspace)?;
        relaxed.store = Some(next);
        relaxed.stats.rounds = round;
        relaxed.stats.moved += moved;
    }
    Ok(relaxed)
}

fn one_round(
    store: &PointStore,
    tiles: TileRanges,
    neighbors: usize,
    round: u32,
    patches: &Patches,
    workspace: &Workspace,
) -> Result<(PointStore, u64)> {
    let part = Sections::<3>::create(workspace, &format!("relax{round}"), tiles.count())?;
    let bytes = |tile: usize| {
        let points = tiles.ids(tile).len();
        Tile::bytes(points) + PageCache::bytes(store) + points as u64 * 24
    };
    let work = |tile| {
        let ids = tiles.ids(tile);
        let mut points = store.slice(ids.clone())?;
        let wanted = |id: usize| patches.active[id / PATCH];
        let mut notes = Notes::of(&ids);
        if ids.clone().step_by(RUN).chain([ids.end - 1]).any(wanted) {
            each_fit(store, ids.clone(), neighbors, wanted, |id, point, fit| {
                let (to, rough) = target(point, &fit, neighbors);
                notes.note(id, rough);
                points[id - ids.start] = to;
                notes.moved += 1;
            })?;
        }
        workspace.advance(points.len() as u64);
        part.put(tile, bytemuck::cast_slice(&points))?;
        Ok(notes)
    };
    let mut moved = 0;
    workspace.units("relax: tile", tiles.count(), bytes, work, |_, notes| {
        patches.add(&notes);
        moved += notes.moved;
        Ok(())
    })?;
    let name = format!("relaxed{round}");
    let store = StoreWriter::gather(workspace, &name, store.page_size(), &part)?;
    Ok((store, moved))
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
