//! The first round of relaxing, a region at a time: a look at some points of every patch, and those that
//! are rough move if it is noise that makes them so.

use super::edges::Around;
use super::fits::Planes;
use super::pass::RUN;
use super::seen::{Seen, target};
use crate::error::Result;
use crate::geom::Point;
use crate::stages::order::PointStore;
use crate::stages::tiles::neighbors::Neighbors;
use crate::workspace::memory::{bytes_of, hold};
use std::ops::Range;

/// Runs in a patch: with ids along a curve, a small piece of surface.
const PATCH: usize = 16;

/// Every so many runs one is looked at first.
const SAMPLE: usize = 8;

/// A patch is rough if more than one in so many points that were looked at is.
const SHARE: usize = 16;
/// So many rough points of a patch tell whether it is curved.
const TELLING: usize = 3;
/// Patches in a region.
const REGION: usize = 256;
/// Nothing moves in a region of which fewer than one patch in so many is noisy,
const NOISE: usize = 8;
/// or where fewer than so many in so many of its rough patches are.
const EDGES: (usize, usize) = (3, 10);
/// Points in a region.
pub(super) const SPAN: usize = REGION * PATCH * RUN;

/// Bytes for each point of a region: what was seen of the samples, which of them tell, and some.
pub(super) const BYTES: u64 = (size_of::<Target>() / SAMPLE + 2) as u64;

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
    let active = choose(&planes, neighbors, &looked, &ids)?;
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

/// The runs of rough patches move, unless few patches of their region are noisy: then what is rough are
/// edges.
fn choose(
    planes: &Planes<'_>,
    neighbors: usize,
    looked: &[Target],
    ids: &Range<usize>,
) -> Result<Vec<bool>> {
    let rough = rough_patches(looked, ids);
    let noisy = noisy_patches(planes, neighbors, looked, ids, &rough)?;
    let mut active = vec![false; ids.len().div_ceil(RUN)];
    let of_patches = rough.chunks(REGION).zip(noisy.chunks(REGION));
    for (runs, (rough, noisy)) in active.chunks_mut(PATCH * REGION).zip(of_patches) {
        let (rough_ones, noisy_ones) = (count(rough), count(noisy));
        let few = noisy_ones * NOISE < rough.len();
        if !few && noisy_ones * EDGES.1 >= rough_ones * EDGES.0 {
            for (runs, rough) in runs.chunks_mut(PATCH).zip(rough) {
                runs.fill(*rough);
            }
        }
    }
    Ok(active)
}

fn patch(id: u32, ids: &Range<usize>) -> usize {
    (id as usize - ids.start) / (PATCH * RUN)
}

/// Patches of which enough was rough of what was looked at; none of a region where these are too few.
fn rough_patches(looked: &[Target], ids: &Range<usize>) -> Vec<bool> {
    let mut counts = vec![(0, 0); ids.len().div_ceil(PATCH * RUN)];
    for (id, _, far) in looked {
        let (seen, rough) = &mut counts[patch(*id, ids)];
        *seen += 1;
        *rough += usize::from(*far);
    }
    let rough = counts.iter().map(|(seen, rough)| rough * SHARE > *seen);
    let mut rough: Vec<bool> = rough.collect();
    for region in rough.chunks_mut(REGION) {
        if count(region) * NOISE < region.len() {
            region.fill(false);
        }
    }
    rough
}

fn count(patches: &[bool]) -> usize {
    patches.iter().filter(|patch| **patch).count()
}

/// Rough patches of which most of the first rough points have no curved surface through their
/// neighbours.
fn noisy_patches(
    planes: &Planes<'_>,
    neighbors: usize,
    looked: &[Target],
    ids: &Range<usize>,
    rough: &[bool],
) -> Result<Vec<bool>> {
    let telling = telling_points(looked, ids, rough);
    let _held = hold(bytes_of(&telling));
    // So many more points without one than with one, of each patch.
    let mut balance = vec![0; rough.len()];
    let mut around = Around::default();
    let is_curved = |_: Point, near: &Neighbors| around.is_curved(near, neighbors);
    planes.each_neighborhood(
        |id| telling[id - ids.start],
        is_curved,
        |id, _, curved| balance[patch(id as u32, ids)] += if curved { -1 } else { 1 },
    )?;
    Ok(balance.into_iter().map(|more| more > 0).collect())
}

/// The first rough ones, by id, of the points of every rough patch that were looked at.
fn telling_points(looked: &[Target], ids: &Range<usize>, rough: &[bool]) -> Vec<bool> {
    let wanted = |rough: &bool| if *rough { TELLING } else { 0 };
    let mut left: Vec<usize> = rough.iter().map(wanted).collect();
    let mut found: Vec<u32> = looked.iter().filter(|l| l.2).map(|l| l.0).collect();
    found.sort_unstable();
    let mut telling = vec![false; ids.len()];
    for id in found {
        let left = &mut left[patch(id, ids)];
        if *left > 0 {
            *left -= 1;
            telling[id as usize - ids.start] = true;
        }
    }
    telling
}
