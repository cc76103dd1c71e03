//! Smoothing where the points are noisy, as much as they are noisy, and nowhere else: positions that decide
//! which points are connected, and, by default, are those of the mesh.
//!
//! Restricted Voronoi cells disagree where points lie off the surface by a part of their spacing (scale space;
//! Digne et al., *Scale space meshing of raw data point sets*, Computer Graphics Forum 30, 2011).

use super::first::{Decided, FirstRound};
use super::foot::Feet;
use super::mover::{Mover, Noisy};
use super::moves::{Counts, Moves, RelaxStats};
use super::noise::{Found, look};
use super::pass::Pass;
use super::{Relaxing, run_of};
use crate::cells::{Among, TileRanges, each_around};
use crate::levels::Levels;
use crate::order::{PointStore, StoredPoints};
use crate::spacing::StoredSpacings;
use outcrop_disk::error::Result;
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_geom::Point;
use outcrop_paper::method::METHOD;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// The shape: positions that decide the connectivity.
#[derive(Debug, Serialize, Deserialize)]
pub struct Relaxed {
    /// The store with moved positions; `None` if no point moved.
    pub store: Option<StoredPoints>,
    /// The local spacings.
    pub spacings: StoredSpacings,
    /// The level of noise at each point before it moved; empty if no region has noise.
    pub noise: Levels,
    /// Counts of the rounds.
    pub stats: RelaxStats,
}

/// The result of a round for some points.
#[derive(Serialize, Deserialize)]
struct Done {
    /// The first of the points.
    first: usize,
    /// Their numbers of rounds, and the followers among them; empty after the first round.
    decided: Decided,
    moves: Moves,
}

/// One round.
struct Round<'a> {
    number: u32,
    relaxing: Relaxing,
    /// The positions before the first round.
    original: &'a PointStore,
    /// The levels of noise.
    levels: &'a Levels,
    /// The numbers of rounds of all points, and the followers among them; empty in the first round.
    decided: &'a Decided,
}

impl Round<'_> {
    fn is_first(&self) -> bool {
        self.number == 1
    }

    /// Moves the noisy ones of the points `ids`.
    fn advance(
        &self,
        unit: &Unit<'_>,
        store: &PointStore,
        ids: Range<usize>,
        points: &mut [Point],
    ) -> Result<Done> {
        let mut done = Done {
            first: ids.start,
            decided: Decided::new(if self.is_first() { ids.len() } else { 0 }),
            moves: Moves::default(),
        };
        // No run has a level, so all points stay.
        if !self.levels.any(&ids) {
            return Ok(done);
        }
        let original = self.original.slice(ids.clone())?;
        let mut counts = Counts::default();
        let put = |noisy: Noisy, to: Point| {
            points[noisy.id - ids.start] = to;
            counts.note(noisy.last, original[noisy.id - ids.start], to);
        };
        if self.is_first() {
            let first = FirstRound {
                unit,
                store,
                relaxing: self.relaxing,
                levels: self.levels,
                ids: ids.clone(),
                points: &original,
            };
            done.decided = first.advance(put)?;
        } else {
            self.advance_again(unit, store, ids.clone(), put)?;
        }
        done.moves = counts.moves();
        Ok(done)
    }

    /// A round after the first: moves the points whose rounds are not over, followers in their last round only.
    /// Followers are neighbours of no point.
    fn advance_again(
        &self,
        unit: &Unit<'_>,
        store: &PointStore,
        ids: Range<usize>,
        put: impl FnMut(Noisy, Point),
    ) -> Result<()> {
        let Decided { rounds, followers } = self.decided;
        let most = self.relaxing.most();
        let wanted = |id: usize| {
            let rounds = u32::from(rounds.get(id));
            rounds == self.number || rounds > self.number && !followers.contains(id)
        };
        // The others reach as far as all points do by the number of the first round.
        let count = |id: usize| {
            let run = run_of(id, self.original.len());
            let others = METHOD.curve.run - run.filter(|id| followers.contains(*id)).count();
            most * others / METHOD.curve.run
        };
        let among = Among {
            wanted: &wanted,
            count: &count,
            most,
            chosen: Some(&|id| !followers.contains(id)),
        };
        let mut feet = Feet::default();
        let mut mover = Mover::new(self.relaxing, put);
        each_around(unit, store, ids, &among, |id, point, around| {
            let rounds = rounds.get(id);
            let noisy = Noisy {
                id,
                point,
                rounds,
                last: u32::from(rounds) == self.number,
                leads: false,
                count: count(id),
                reach2: around.last2(),
            };
            feet.add(noisy, around, &mut mover);
        })?;
        mover.finish(&mut feet);
        Ok(())
    }
}

/// Measures the local spacings, and smooths the points that are noisy.
///
/// # Errors
/// [`outcrop_disk::error::Error::Io`], [`outcrop_disk::error::Error::Corrupt`], [`outcrop_disk::error::Error::Memory`],
/// [`outcrop_disk::error::Error::Cancelled`].
pub fn relax(
    store: &PointStore,
    tiles: TileRanges,
    relaxing: Relaxing,
    workspace: &Workspace,
) -> Result<Relaxed> {
    let _held = StoredSpacings::reserve(store.len(), workspace)?;
    let bytes = Levels::size(store.len());
    let _levels_held = workspace.reserve("levels of noise", bytes)?;
    let levels = Levels::new(store.len());
    let Found {
        spacings,
        levels,
        noisy,
    } = look(store, relaxing, levels, workspace)?;
    let mut relaxed = Relaxed {
        store: None,
        spacings,
        noise: Levels::default(),
        stats: RelaxStats::default(),
    };
    let mut passes = 0;
    if noisy {
        let bytes = Decided::size(store.len());
        let _rounds_held = workspace.reserve("rounds of smoothing", bytes)?;
        passes = all_rounds(store, tiles, relaxing, &levels, &mut relaxed, workspace)?;
        relaxed.noise = levels;
    }
    let left = u64::from(relaxing.rounds - passes) * store.len() as u64;
    workspace.observer.advance(left);
    Ok(relaxed)
}

/// Smooths noisy points until no point moves. Returns the number of passes over all points.
fn all_rounds(
    store: &PointStore,
    tiles: TileRanges,
    relaxing: Relaxing,
    levels: &Levels,
    relaxed: &mut Relaxed,
    workspace: &Workspace,
) -> Result<u32> {
    let mut decided = Decided::default();
    let mut moves = Moves::default();
    let (mut passes, mut rounds) = (0, 0);
    while passes < relaxing.rounds {
        passes += 1;
        let round = Round {
            number: passes,
            relaxing,
            original: store,
            levels,
            decided: &decided,
        };
        let before = relaxed.store.as_ref();
        let before = before.map(|store| store.open(workspace)).transpose()?;
        let current = before.as_ref().unwrap_or(store);
        let (next, done, first) = one_round(current, tiles, &round, workspace)?;
        drop(before);
        if passes == 1 {
            decided = first;
        }
        if done.moved() == 0 {
            next.release(workspace)?;
            break;
        }
        rounds = passes;
        moves.add(&done);
        if let Some(old) = relaxed.store.replace(next) {
            old.release(workspace)?;
        }
    }
    relaxed.stats = moves.stats(rounds, relaxing.step);
    Ok(passes)
}

/// Moves the points of one round; returns the new positions, what moved, and what the first round decides.
fn one_round(
    store: &PointStore,
    tiles: TileRanges,
    round: &Round<'_>,
    workspace: &Workspace,
) -> Result<(StoredPoints, Moves, Decided)> {
    let file = format!("relaxed{}", round.number);
    let pass = Pass {
        bytes: if round.is_first() {
            FirstRound::BYTES
        } else {
            0
        },
        ..Pass::new(&file, "relax: tile", tiles)
    };
    let work = |unit: &Unit<'_>, ids: Range<usize>, points: &mut [Point]| {
        round.advance(unit, store, ids, points)
    };
    let mut moves = Moves::default();
    let mut decided = Decided::new(if round.is_first() { store.len() } else { 0 });
    let next = pass.over(store, workspace, work, |done: Done| {
        if round.is_first() {
            decided.put(done.first, &done.decided);
        }
        moves.add(&done.moves);
    })?;
    Ok((next, moves, decided))
}
