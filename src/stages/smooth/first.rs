//! The first round of smoothing: decides in how many rounds each point moves, and which points follow the point
//! before them (docs/method.md, section 4.3).

use super::followers::{Followers, leader};
use super::foot::Feet;
use super::mover::{Mover, Noisy, farthest2};
use super::{Relaxing, run_of};
use crate::cells::{Among, each_around};
use crate::levels::{HIGHEST, Levels};
use crate::order::PointStore;
use crate::tiles::near::Around;
use outcrop_disk::error::Result;
use outcrop_disk::workspace::Unit;
use outcrop_geom::{Point, distance2};
use outcrop_paper::method::METHOD;
use serde::{Deserialize, Serialize};
use std::cell::Cell;
use std::ops::Range;

/// In how many rounds the points of a range move, and which of them follow the point before them.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct Decided {
    /// For each point, the number of rounds in which it moves; a follower moves in the last of them only.
    pub rounds: Levels,
    pub followers: Followers,
}

impl Decided {
    /// Nothing moves.
    pub fn new(count: usize) -> Self {
        Self {
            rounds: Levels::new(count),
            followers: Followers::new(count),
        }
    }

    /// Bytes for `count` points.
    pub fn size(count: usize) -> u64 {
        Levels::size(count) + Followers::size(count)
    }

    /// Sets the rounds of the followers among `count` points to those of the points that they follow.
    fn follow(&mut self, count: usize) {
        for place in (0..count).filter(|place| self.followers.contains(*place)) {
            self.rounds.set(place, self.rounds.get(place - 1));
        }
    }

    /// Copies what was decided about the points from `first` on.
    pub fn put(&mut self, first: usize, others: &Self) {
        self.rounds.put(first, &others.rounds);
        self.followers.put(first, &others.followers);
    }
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

/// The first round for the points of a unit.
pub(super) struct FirstRound<'a> {
    pub unit: &'a Unit<'a>,
    pub store: &'a PointStore,
    pub relaxing: Relaxing,
    /// The levels of noise of all points.
    pub levels: &'a Levels,
    /// The ids of the points, from an even one on.
    pub ids: Range<usize>,
    /// Their positions before the round.
    pub points: &'a [Point],
}

impl FirstRound<'_> {
    /// Most bytes for each point: a list of half of them, which grows twofold.
    pub const BYTES: u64 = 12;

    /// Moves all noisy points but followers: `put` receives them and the positions to which they move.
    pub fn advance(&self, put: impl FnMut(Noisy, Point)) -> Result<Decided> {
        let mut decided = Decided::new(self.ids.len());
        let mut feet = Feet::default();
        let mut mover = Mover::new(self.relaxing, put);
        let mut late = self.decide(&mut decided, &mut feet, &mut mover)?;
        mover.finish(&mut feet);
        for leader in &mover.scattered {
            let place = leader + 1 - self.ids.start;
            decided.followers.remove(place);
            late.add(place);
        }
        self.move_late(&late, &mut decided.rounds, &mut feet, &mut mover)?;
        mover.finish(&mut feet);
        decided.follow(self.ids.len());
        Ok(decided)
    }

    /// The number of rounds in which a point with these neighbours moves.
    fn rounds(&self, around: &Around) -> u8 {
        let most = self.relaxing.rounds.min(u32::from(HIGHEST)) as u8;
        rounds(self.levels, around).min(most)
    }

    /// True if a point of the run of `id` has a level of noise; the points of other runs stay.
    fn is_in_noise(&self, id: usize) -> bool {
        self.levels.any(&run_of(id, self.ids.end))
    }

    /// Decides about the points, and moves all but those that may follow. Returns the places of points that were
    /// missed, because their leader came after them.
    fn decide<P: FnMut(Noisy, Point)>(
        &self,
        decided: &mut Decided,
        feet: &mut Feet<Noisy>,
        mover: &mut Mover<P>,
    ) -> Result<Followers> {
        // The last leader, and whether the next point may follow it.
        let last = Cell::new(None);
        let wanted = |id: usize| {
            self.is_in_noise(id)
                && match (leader(id), last.get()) {
                    (Some(leader), Some(last)) => last == (leader, false),
                    _ => true,
                }
        };
        // Points that may not follow their leader and were not looked at since.
        let mut waiting = Followers::new(self.ids.len());
        self.each_around(wanted, |id, point, around| {
            let place = id - self.ids.start;
            if leader(id).is_some() && !waiting.remove(place) {
                return;
            }
            let rounds = self.rounds(around);
            decided.rounds.set(place, rounds);
            let leads = rounds > 1 && leader(id).is_none() && self.is_near_next(place, around);
            if leader(id).is_none() && place + 1 < self.ids.len() {
                last.set(Some((id, leads)));
                if leads {
                    decided.followers.add(place + 1);
                } else {
                    waiting.add(place + 1);
                }
            }
            self.step((id, point), (rounds, leads), around, feet, mover);
        })?;
        Ok(waiting)
    }

    /// Collects a point with these neighbours, if it moves.
    fn step<P: FnMut(Noisy, Point)>(
        &self,
        (id, point): (usize, Point),
        (rounds, leads): (u8, bool),
        around: &mut Around,
        feet: &mut Feet<Noisy>,
        mover: &mut Mover<P>,
    ) {
        if rounds > 0 {
            let noisy = Noisy {
                id,
                point,
                rounds,
                last: rounds == 1,
                leads,
                count: self.relaxing.most(),
                reach2: around.last2(),
            };
            feet.add(noisy, around, mover);
        }
    }

    /// True if there is a next point, so near to a leader with these neighbours that it may follow.
    fn is_near_next(&self, place: usize, around: &Around) -> bool {
        let next = self.points.get(place + 1);
        next.is_some_and(|next| {
            distance2(self.points[place], *next) as f64 <= farthest2(around.last2())
        })
    }

    /// Moves the points at the places `late`, about which nothing is decided yet.
    fn move_late<P: FnMut(Noisy, Point)>(
        &self,
        late: &Followers,
        decided: &mut Levels,
        feet: &mut Feet<Noisy>,
        mover: &mut Mover<P>,
    ) -> Result<()> {
        let wanted = |id: usize| late.contains(id - self.ids.start);
        self.each_around(wanted, |id, point, around| {
            let rounds = self.rounds(around);
            decided.set(id - self.ids.start, rounds);
            self.step((id, point), (rounds, false), around, feet, mover);
        })
    }

    fn each_around(
        &self,
        wanted: impl Fn(usize) -> bool,
        each: impl FnMut(usize, Point, &mut Around),
    ) -> Result<()> {
        let most = self.relaxing.most();
        let among = Among {
            wanted: &wanted,
            count: &|_| most,
            most,
            chosen: None,
        };
        each_around(self.unit, self.store, self.ids.clone(), &among, each)
    }
}
