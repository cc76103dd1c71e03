//! Smoothing where the points are noisy, as much as they are noisy, and nowhere else: positions that decide
//! which points are connected, and, by default, are those of the mesh.
//!
//! Restricted Voronoi cells disagree where points lie off the surface by a part of their spacing (scale space;
//! Digne et al., *Scale space meshing of raw data point sets*, Computer Graphics Forum 30, 2011).

use super::foot::{Feet, Foot, Settle};
use super::moves::{Counts, Moves};
use super::noise::{Found, look};
use super::pass::Pass;
use super::{Relaxing, moved};
use crate::cells::{TileRanges, each_around};
use crate::levels::{HIGHEST, Levels};
use crate::order::{PointStore, StoredPoints};
use crate::spacing::{StoredSpacings, spacing2};
use crate::tiles::near::{Around, Nearer};
use outcrop_disk::error::Result;
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
    // 16 bits for each level: no addition waits for one in memory.
    let mut counts = 0u64;
    for id in around.ids() {
        counts += 1 << (16 * levels.get(*id as usize));
    }
    let (mut below, mut rounds) = (0, 0);
    for level in 1..=HIGHEST {
        below += (counts >> (16 * (level - 1)) & 0xffff) as usize;
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
    fn moved(&self, Foot { offset }: Foot) -> Point {
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
    fn has_layers(&self, mean2: f64, count: usize) -> bool {
        let limit = METHOD.noise.layers * f64::from(self.rounds);
        mean2 > limit * limit * spacing2(self.reach2, count)
    }
}

/// Moves noisy points to their feet, those whose neighbours lie in layers by fewer neighbours.
struct Mover<P> {
    /// The numbers of neighbours, and of those in layers.
    count: usize,
    fewer: usize,
    layered: Feet<Noisy>,
    nearer: Nearer,
    /// Receives the noisy points and the positions to which they move.
    put: P,
}

impl<P: FnMut(Noisy, Point)> Mover<P> {
    /// Moves the points in layers that are left.
    fn finish(&mut self) {
        let put = &mut self.put;
        self.layered
            .finish(&mut |noisy: Noisy, foot: Foot| put(noisy, noisy.moved(foot)));
    }
}

impl<P: FnMut(Noisy, Point)> Settle<Noisy> for Mover<P> {
    fn is_layered(&self, noisy: &Noisy, mean2: f64) -> bool {
        self.fewer < self.count && noisy.has_layers(mean2, self.count)
    }

    fn settle_layered(&mut self, noisy: Noisy, around: &mut Around) {
        around.keep_nearest(self.fewer, &mut self.nearer);
        let reach2 = around.last2();
        let put = &mut self.put;
        self.layered.add(
            Noisy { reach2, ..noisy },
            around,
            &mut |noisy: Noisy, foot: Foot| {
                put(noisy, noisy.moved(foot));
            },
        );
    }

    fn settle(&mut self, noisy: Noisy, foot: Foot) {
        (self.put)(noisy, noisy.moved(foot));
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

    /// True if a point of the run of `id` has a level of noise; the points of other runs stay.
    fn is_in_noise(&self, id: usize) -> bool {
        let first = id - id % METHOD.curve.run;
        let last = (first + METHOD.curve.run).min(self.original.len());
        self.levels.any(&(first..last))
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
        // No run has a level, so all points stay.
        if !self.levels.any(&ids) {
            return Ok(done);
        }
        let original = self.original.slice(ids.clone())?;
        let mut counts = Counts::default();
        let put = |noisy: Noisy, to: Point| {
            points[noisy.id - ids.start] = to;
            let last = u32::from(noisy.rounds) == self.number;
            counts.note(last, original[noisy.id - ids.start], to);
        };
        self.move_noisy(unit, store, ids.clone(), &mut done.rounds, put)?;
        done.moves = counts.moves();
        Ok(done)
    }

    /// Calls `put` with the noisy points and the positions to which they move; sets the `rounds` in which
    /// points move, if this is the first.
    fn move_noisy(
        &self,
        unit: &Unit<'_>,
        store: &PointStore,
        ids: Range<usize>,
        to: &mut Levels,
        put: impl FnMut(Noisy, Point),
    ) -> Result<()> {
        let most = self.relaxing.rounds.min(u32::from(HIGHEST)) as u8;
        let count = self.relaxing.neighbors * METHOD.smoothing.neighbors;
        let mut feet = Feet::default();
        let mut mover = Mover {
            count,
            fewer: self.fewer(),
            layered: Feet::default(),
            nearer: Nearer::default(),
            put,
        };
        let first = ids.start;
        let wanted = |id: usize| {
            if self.is_first() {
                self.is_in_noise(id)
            } else {
                u32::from(self.levels.get(id)) >= self.number
            }
        };
        each_around(unit, store, ids, count, wanted, |id, point, around| {
            let rounds = if self.is_first() {
                let rounds = rounds(self.levels, around).min(most);
                to.set(id - first, rounds);
                rounds
            } else {
                self.levels.get(id)
            };
            if rounds > 0 {
                feet.add(Noisy::new((id, point), rounds, around), around, &mut mover);
            }
        })?;
        feet.finish(&mut mover);
        mover.finish();
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
        let _rounds_held = workspace.reserve("rounds of smoothing", bytes)?;
        passes = all_rounds(store, tiles, relaxing, levels, &mut relaxed, workspace)?;
    }
    let left = u64::from(relaxing.rounds - passes) * store.len() as u64;
    workspace.observer.advance(left);
    Ok(relaxed)
}

/// Smooths noisy points, whose `levels` of noise become those of `relaxed`, until no point moves. Returns the number
/// of passes over all points.
fn all_rounds(
    store: &PointStore,
    tiles: TileRanges,
    relaxing: Relaxing,
    mut levels: Levels,
    relaxed: &mut Relaxed,
    workspace: &Workspace,
) -> Result<u32> {
    // The levels of noise after the first round, which counts the rounds by them.
    let mut other = Levels::new(store.len());
    let mut moves = Moves::default();
    let (mut passes, mut rounds) = (0, 0);
    while passes < relaxing.rounds {
        passes += 1;
        let round = Round {
            number: passes,
            relaxing,
            original: store,
            levels: &levels,
        };
        let before = relaxed.store.as_ref();
        let before = before.map(|store| store.open(workspace)).transpose()?;
        let current = before.as_ref().unwrap_or(store);
        let (next, done) = one_round(current, tiles, &round, &mut other, workspace)?;
        drop(before);
        if passes == 1 {
            std::mem::swap(&mut levels, &mut other);
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
    relaxed.noise = other;
    relaxed.stats = moves.stats(rounds, relaxing.step);
    Ok(passes)
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
