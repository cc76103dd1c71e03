//! Smoothing where the points are noisy, as much as they are noisy, and nowhere else: positions that decide
//! which points are connected, and, by default, are those of the mesh.
//!
//! Restricted Voronoi cells disagree where points lie off the surface by a part of their spacing (scale space;
//! Digne et al., *Scale space meshing of raw data point sets*, Computer Graphics Forum 30, 2011).

use super::foot::{Feet, Foot};
use super::moves::Moves;
use super::noise::{Found, look};
use super::pass::Pass;
use super::{Relaxing, moved};
use crate::cells::{TileRanges, each_around};
use crate::levels::{HIGHEST, Levels};
use crate::order::{PointStore, StoredPoints};
use crate::spacing::{StoredSpacings, spacing2};
use crate::tiles::near::Around;
use outcrop_disk::error::Result;
use outcrop_disk::workspace::memory::bytes_of;
use outcrop_disk::workspace::{Unit, Workspace};
use outcrop_geom::Point;
use outcrop_geom::method::METHOD;
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

/// Counts of this stage.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize, PartialEq)]
pub struct RelaxStats {
    /// Rounds in which points moved.
    pub rounds: u32,
    /// Noisy points, which moved.
    pub moved: u64,
    /// Half of them moved at most this far (to within 1 %), in the cloud's unit.
    pub median: f64,
    /// 99 % of them moved at most this far (to within 1 %).
    pub most: f64,
    /// The largest distance by which one moved.
    pub largest: f64,
}

/// The number of rounds in which a point with these neighbours moves, itself included: the highest level that
/// more than nine tenths of them reach.
fn rounds(levels: &Levels, around: &Around) -> u8 {
    let mut counts = [0; 4];
    for id in around.ids() {
        counts[levels.get(*id as usize) as usize] += 1;
    }
    let (mut below, mut rounds) = (0, 0);
    for (level, count) in (1..).zip(&counts[..3]) {
        below += count;
        if METHOD.noise.few * below >= around.count() {
            break;
        }
        rounds = level;
    }
    rounds
}

/// A noisy point.
#[derive(Debug, Clone, Copy, Default)]
struct Noisy {
    id: usize,
    point: Point,
    /// Number of rounds in which it moves.
    rounds: u8,
    /// Squared distance of the last of its neighbours.
    reach2: u64,
}

impl Noisy {
    fn new((id, point): (usize, Point), rounds: u8, around: &Around) -> Self {
        Self {
            id,
            point,
            rounds,
            reach2: around.last2(),
        }
    }

    /// The position to which it moves. An outlier, which is too far from the surface, stays.
    fn moved(&self, Foot { offset, .. }: Foot) -> Point {
        let limit = METHOD.smoothing.farthest;
        let length2 = offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2];
        if length2 > limit * limit * self.reach2 as f64 {
            self.point
        } else {
            moved(self.point, offset)
        }
    }

    /// True if `count` neighbours are farther from their surface than noise explains: there are layers, such
    /// as the two sides of a thin plate, or details.
    fn has_layers(&self, foot: Foot, count: usize) -> bool {
        let limit = METHOD.noise.layers * f64::from(self.rounds);
        foot.mean2 > limit * limit * spacing2(self.reach2, count)
    }
}

/// The result of a round for some points.
#[derive(Serialize, Deserialize)]
struct Done {
    /// The first of the points.
    first: usize,
    /// For each of them, the number of rounds in which it moves; empty after the first round.
    rounds: Levels,
    moves: Moves,
}

/// One round.
struct Round<'a> {
    number: u32,
    relaxing: Relaxing,
    /// The positions before the first round.
    original: &'a PointStore,
    /// In the first round the levels of noise, then the number of rounds in which each point moves.
    levels: &'a Levels,
}

impl Round<'_> {
    fn is_first(&self) -> bool {
        self.number == 1
    }

    /// The number of neighbours in layers: those of a plane, but enough for a surface of second order.
    fn fewer(&self) -> usize {
        self.relaxing.neighbors.max(METHOD.plane.neighbors)
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
            rounds: Levels::new(if self.is_first() { ids.len() } else { 0 }),
            moves: Moves::default(),
        };
        // Points are noisy only where some of them have a level.
        if !self.levels.any(&ids) {
            return Ok(done);
        }
        let original = self.original.slice(ids.clone())?;
        let Done { rounds, moves, .. } = &mut done;
        let mut put = |noisy: Noisy, to: Point| {
            points[noisy.id - ids.start] = to;
            let last = u32::from(noisy.rounds) == self.number;
            moves.note(last, original[noisy.id - ids.start], to);
        };
        let layered = self.move_most(unit, store, ids.clone(), rounds, &mut put)?;
        let _held = unit.hold(bytes_of(&layered));
        self.move_layered(unit, store, ids.clone(), &layered, put)?;
        Ok(done)
    }

    /// Calls `put` with the noisy points and the positions to which they move; sets the `rounds` in which
    /// points move, if this is the first. Returns the ids of those whose neighbours lie in layers, ascending,
    /// with their rounds.
    fn move_most(
        &self,
        unit: &Unit<'_>,
        store: &PointStore,
        ids: Range<usize>,
        to: &mut Levels,
        put: &mut impl FnMut(Noisy, Point),
    ) -> Result<Vec<(usize, u8)>> {
        let most = self.relaxing.rounds.min(u32::from(HIGHEST)) as u8;
        let count = self.relaxing.neighbors * METHOD.smoothing.neighbors;
        let mut layered = Vec::new();
        let mut feet = Feet::default();
        let fewer = self.fewer() < count;
        let mut settle = |noisy: Noisy, foot: Foot| match fewer && noisy.has_layers(foot, count) {
            true => layered.push((noisy.id, noisy.rounds)),
            false => put(noisy, noisy.moved(foot)),
        };
        let wanted = |id: usize| self.is_first() || u32::from(self.levels.get(id)) >= self.number;
        let first = ids.start;
        each_around(unit, store, ids, count, wanted, |id, point, around| {
            let rounds = if self.is_first() {
                let rounds = rounds(self.levels, around).min(most);
                to.set(id - first, rounds);
                rounds
            } else {
                self.levels.get(id)
            };
            if rounds > 0 {
                feet.add(Noisy::new((id, point), rounds, around), around, &mut settle);
            }
        })?;
        feet.finish(&mut settle);
        layered.sort_unstable();
        Ok(layered)
    }

    /// As [`Round::move_most`], for the points whose neighbours lie in layers: they move by fewer neighbours.
    fn move_layered(
        &self,
        unit: &Unit<'_>,
        store: &PointStore,
        ids: Range<usize>,
        layered: &[(usize, u8)],
        mut put: impl FnMut(Noisy, Point),
    ) -> Result<()> {
        if layered.is_empty() {
            return Ok(());
        }
        let place = |id: usize| layered.binary_search_by_key(&id, |(id, _)| *id);
        let count = self.fewer();
        let mut feet = Feet::default();
        let mut settle = |noisy: Noisy, foot: Foot| put(noisy, noisy.moved(foot));
        let wanted = |id: usize| place(id).is_ok();
        each_around(unit, store, ids, count, wanted, |id, point, around| {
            if let Ok(place) = place(id) {
                let noisy = Noisy::new((id, point), layered[place].1, around);
                feet.add(noisy, around, &mut settle);
            }
        })?;
        feet.finish(&mut settle);
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
        mut levels,
        noisy,
    } = look(store, relaxing, levels, workspace)?;
    let mut relaxed = Relaxed {
        store: None,
        spacings,
        noise: Levels::default(),
        stats: RelaxStats::default(),
    };
    if !noisy {
        let left = u64::from(relaxing.rounds) * store.len() as u64;
        workspace.observer.advance(left);
        return Ok(relaxed);
    }
    let _rounds_held = workspace.reserve("rounds of smoothing", bytes)?;
    // The levels of noise after the first round, which counts the rounds by them.
    let mut other = Levels::new(store.len());
    let mut moves = Moves::default();
    for number in 1..=relaxing.rounds {
        let round = Round {
            number,
            relaxing,
            original: store,
            levels: &levels,
        };
        let before = relaxed
            .store
            .as_ref()
            .map(|store| store.open(workspace))
            .transpose()?;
        let current = before.as_ref().unwrap_or(store);
        let (next, done) = one_round(current, tiles, &round, &mut other, workspace)?;
        drop(before);
        if number == 1 {
            std::mem::swap(&mut levels, &mut other);
        }
        if done.moved() == 0 {
            next.release(workspace)?;
            let left = u64::from(relaxing.rounds - number) * store.len() as u64;
            workspace.observer.advance(left);
            break;
        }
        relaxed.stats.rounds = number;
        moves.add(&done);
        if let Some(old) = relaxed.store.replace(next) {
            old.release(workspace)?;
        }
    }
    relaxed.noise = other;
    relaxed.stats = moves.stats(relaxed.stats.rounds, relaxing.step);
    Ok(relaxed)
}

/// Moves the points of one round; returns the new positions and what moved.
fn one_round(
    store: &PointStore,
    tiles: TileRanges,
    round: &Round<'_>,
    rounds: &mut Levels,
    workspace: &Workspace,
) -> Result<(StoredPoints, Moves)> {
    let file = format!("relaxed{}", round.number);
    let pass = Pass::new(&file, "relax: tile", tiles);
    let work = |unit: &Unit<'_>, ids: Range<usize>, points: &mut [Point]| {
        round.advance(unit, store, ids, points)
    };
    let mut moves = Moves::default();
    let next = pass.over(store, workspace, work, |done: Done| {
        rounds.put(done.first, &done.rounds);
        moves.add(&done.moves);
    })?;
    Ok((next, moves))
}
