//! The first round of relaxing, a region at a time: a look at some points of every patch, and those that
//! are rough move.

use super::fits::Planes;
use super::pass::RUN;
use super::relax::{Seen, target};
use crate::error::Result;
use crate::geom::Point;
use crate::stages::order::PointStore;
use crate::workspace::memory::{bytes_of, hold};
use std::ops::Range;

/// Runs in a patch: with ids along a curve, a small piece of surface.
const PATCH: usize = 16;

/// Every so many runs one is looked at first.
const SAMPLE: usize = 8;

/// A patch moves if more than one in so many points that were looked at is rough.
const SHARE: usize = 16;

/// Patches in a region.
const REGION: usize = 256;

/// Nothing moves in a region of which fewer than one patch in so many is rough.
const EDGES: usize = 4;

/// Points in a region.
pub(super) const SPAN: usize = REGION * PATCH * RUN;

/// Bytes for each point of a region: what was seen of the samples, and some.
pub(super) const BYTES: u64 = (size_of::<Target>() / SAMPLE + 1) as u64;

/// Where a sampled point would go, and whether that is far.
type Target = (u32, Point, bool);

/// Moves `points`, which are those of the regions `ids`: which runs move, and what was seen of them.
pub(super) fn look_and_move(
    store: &PointStore,
    ids: Range<usize>,
    neighbors: usize,
    points: &mut [Point],
) -> Result<(Vec<bool>, Seen)> {
    let planes = Planes::load(store, ids.clone(), neighbors)?;
    let looked = look(&planes, neighbors, ids.len())?;
    let _held = hold(bytes_of(&looked));
    let active = choose(&looked, &ids);
    let mut seen = Seen::of(&ids);
    let moves = |id: usize| active[(id - ids.start) / RUN];
    let mut put = |id: usize, to, rough| {
        seen.note(id, rough);
        points[id - ids.start] = to;
        seen.moved += 1;
    };
    for (id, to, rough) in looked {
        if moves(id as usize) {
            put(id as usize, to, rough);
        }
    }
    let others = |id: usize| moves(id) && !is_sampled(id);
    planes.each(others, |id, point, fit| {
        let (to, rough) = target(point, &fit, neighbors);
        put(id, to, rough);
    })?;
    Ok((active, seen))
}

fn is_sampled(id: usize) -> bool {
    (id / RUN).is_multiple_of(SAMPLE)
}

/// Where the sampled ones of so many points would go.
fn look(planes: &Planes<'_>, neighbors: usize, points: usize) -> Result<Vec<Target>> {
    let mut looked = Vec::with_capacity(points / SAMPLE + RUN);
    planes.each(is_sampled, |id, point, fit| {
        let (to, rough) = target(point, &fit, neighbors);
        looked.push((id as u32, to, rough));
    })?;
    Ok(looked)
}

/// The runs of those patches move in which enough was rough of what was looked at, unless these are few
/// in their region: then they lie along edges and not in noise.
fn choose(looked: &[Target], ids: &Range<usize>) -> Vec<bool> {
    let patch = |id: usize| (id - ids.start) / (PATCH * RUN);
    let mut rough = vec![0; ids.len().div_ceil(PATCH * RUN)];
    for (id, _, far) in looked {
        rough[patch(*id as usize)] += usize::from(*far);
    }
    let mut active = vec![false; ids.len().div_ceil(RUN)];
    let regions = active.chunks_mut(PATCH * REGION).zip(rough.chunks(REGION));
    for (number, (active, rough)) in regions.enumerate() {
        let mut moving = 0;
        for (place, (active, rough)) in active.chunks_mut(PATCH).zip(rough).enumerate() {
            let start = ids.start + (number * REGION + place) * PATCH * RUN;
            let seen = (start..ids.end.min(start + PATCH * RUN)).filter(|id| is_sampled(*id));
            if rough * SHARE > seen.count() {
                active.fill(true);
                moving += 1;
            }
        }
        if moving * EDGES < rough.len() {
            active.fill(false);
        }
    }
    active
}
