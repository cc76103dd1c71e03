//! Relaxing: smoothing that only serves to decide which points are connected (scale space; Digne et al.,
//! *Scale space meshing of raw data point sets*, Computer Graphics Forum 30, 2011). The mesh keeps the
//! measured positions.
//!
//! Restricted Voronoi cells disagree where points lie off the surface by a part of their spacing. Points move
//! only there; of smooth patches only samples are examined.

use super::Relaxing;
use super::first::{self, Done};
use super::pass::Pass;
use super::seen::Roughness;
use crate::error::Result;
use crate::geom::Point;
use crate::method::METHOD;
use crate::stages::cells::{Fit, TileRanges, Widen, each_plane};
use crate::stages::order::{PointStore, StoredPoints};
use crate::stages::spacing::StoredSpacings;
use crate::workspace::memory::Reservation;
use crate::workspace::{Unit, Workspace};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// The shape: positions that decide the connectivity.
#[derive(Debug, Serialize, Deserialize)]
pub struct Relaxed {
    /// The store with moved positions; `None` if no point moved.
    pub store: Option<StoredPoints>,
    /// The local spacings.
    pub spacings: StoredSpacings,
    /// Counts of the rounds.
    pub stats: RelaxStats,
}

impl Relaxed {
    /// Records the positions after a round, and the number of points that moved. Deletes the positions that
    /// are not needed: those before the round, or those after it if no point moved.
    fn take(
        &mut self,
        round: u32,
        (store, moved): (StoredPoints, u64),
        workspace: &Workspace,
    ) -> Result<()> {
        let old = if moved > 0 {
            self.stats.rounds = round;
            self.stats.moved += moved;
            self.store.replace(store)
        } else {
            Some(store)
        };
        old.map_or(Ok(()), |old| old.release(workspace))
    }
}

/// Counts of this stage.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize, PartialEq, Eq)]
pub struct RelaxStats {
    /// Rounds in which points moved.
    pub rounds: u32,
    /// Points that moved, summed over the rounds.
    pub moved: u64,
}

/// The runs that move, and the rough points in them.
struct Runs {
    active: Vec<bool>,
    /// Number of rough points in each run.
    rough: Vec<u8>,
    _held: Reservation,
}

impl Runs {
    fn new(points: usize, workspace: &Workspace) -> Result<Self> {
        let count = points.div_ceil(METHOD.curve.run);
        Ok(Self {
            _held: workspace.reserve("relax: runs", count as u64 * 2)?,
            active: vec![false; count],
            rough: vec![0; count],
        })
    }

    /// Selects the runs for the next round: those with a rough point.
    fn settle(&mut self) {
        for (active, rough) in self.active.iter_mut().zip(&mut self.rough) {
            *active &= std::mem::take(rough) > 0;
        }
    }
}

impl RelaxStats {
    /// True if the sum of moved points over all rounds is at least half the number of points: the whole cloud
    /// is noisy, not only parts of it.
    #[must_use]
    pub fn is_noisy(&self, points: u64) -> bool {
        METHOD.components.noisy * self.moved >= points
    }
}

/// Rounds of relaxing: points move to the planes of their nearest neighbours. After the first round, only the
/// points of runs that were rough in the previous round move.
///
/// # Errors
/// [`crate::Error::Io`], [`crate::Error::Corrupt`], [`crate::Error::Memory`],
/// [`crate::Error::Cancelled`].
pub fn relax(
    store: &PointStore,
    tiles: TileRanges,
    relaxing: Relaxing,
    workspace: &Workspace,
) -> Result<Relaxed> {
    let _held = StoredSpacings::reserve(store.len(), workspace)?;
    let mut runs = Runs::new(store.len(), workspace)?;
    let mut usual2 = vec![0; store.len().div_ceil(METHOD.curve.patch)];
    let first = first_round(store, tiles, relaxing, &mut runs, &mut usual2, workspace)?;
    let mut relaxed = Relaxed {
        store: None,
        spacings: StoredSpacings::new(usual2),
        stats: RelaxStats::default(),
    };
    relaxed.take(1, first, workspace)?;
    runs.settle();
    for round in 2..=relaxing.rounds {
        if !runs.active.contains(&true) {
            let left = u64::from(relaxing.rounds + 1 - round) * store.len() as u64;
            workspace.observer.advance(left);
            break;
        }
        let before = relaxed.store.as_ref();
        let before = before.map(|store| store.open(workspace)).transpose()?;
        let current = before.as_ref().unwrap_or(store);
        let spacings = &relaxed.spacings;
        let next = one_round(
            current, tiles, relaxing, round, &mut runs, spacings, workspace,
        )?;
        drop(before);
        relaxed.take(round, next, workspace)?;
        runs.settle();
    }
    Ok(relaxed)
}

/// Examines samples of every patch and moves the points of rough patches; returns the number of moved points.
fn first_round(
    store: &PointStore,
    tiles: TileRanges,
    relaxing: Relaxing,
    runs: &mut Runs,
    usual2: &mut [u64],
    workspace: &Workspace,
) -> Result<(StoredPoints, u64)> {
    let pass = Pass {
        whole: METHOD.curve.block as usize,
        bytes: first::bytes(),
        ..Pass::new("relaxed1", "relax: tile", tiles)
    };
    let work = |unit: &Unit<'_>, ids: Range<usize>, points: &mut [Point]| {
        first::examine_and_move(unit, store, ids, relaxing, points)
    };
    let mut moved = 0;
    let next = pass.over(store, workspace, work, |done: Done| {
        let patch = done.seen.first * METHOD.curve.run / METHOD.curve.patch;
        usual2[patch..][..done.usual2.len()].copy_from_slice(&done.usual2);
        runs.active[done.seen.first..][..done.active.len()].copy_from_slice(&done.active);
        moved += done.seen.moved;
        done.seen.put(&mut runs.rough);
    })?;
    Ok((next, moved))
}

/// Moves the points of all active runs; returns their number.
fn one_round(
    store: &PointStore,
    tiles: TileRanges,
    relaxing: Relaxing,
    round: u32,
    runs: &mut Runs,
    spacings: &StoredSpacings,
    workspace: &Workspace,
) -> Result<(StoredPoints, u64)> {
    let file = format!("relaxed{round}");
    let pass = Pass::new(&file, "relax: tile", tiles);
    let Runs { active, rough, .. } = runs;
    let work = |unit: &Unit<'_>, ids: Range<usize>, points: &mut [Point]| {
        let wanted = |id: usize| active[id / METHOD.curve.run];
        let mut seen = Roughness::of(&ids);
        let count = relaxing.neighbors;
        if ids.clone().step_by(METHOD.curve.run).any(wanted) {
            let each = |id: usize, point: Point, fit: &Fit| {
                let (to, rough) = relaxing.target(point, fit, spacings.usual2(id as u32));
                seen.note(id, rough);
                points[id - ids.start] = to;
                seen.moved += 1;
            };
            each_plane(unit, store, ids.clone(), count, Widen::Never, wanted, each)?;
        }
        Ok(seen)
    };
    let mut moved = 0;
    let next = pass.over(store, workspace, work, |seen: Roughness| {
        moved += seen.moved;
        seen.put(rough);
    })?;
    Ok((next, moved))
}
