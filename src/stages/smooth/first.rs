//! The first round of relaxing, a region at a time: a look at some points of every patch, and those that
//! are rough move if it is noise that makes them so.

use super::Relaxing;
use super::edges::Around;
use super::fits::Planes;
use super::pass::RUN;
use super::seen::{Seen, target};
use crate::error::Result;
use crate::geom::Point;
use crate::stages::order::PointStore;
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
/// or where fewer than so many in so many of its rough patches are,
const EDGES: (usize, usize) = (3, 10);
/// or where so many in so many of the points that tell are clean, of those whose positions are fine:
const CLEAN: (usize, usize) = (1, 10);
/// but where more than so many are, they lie in layers, which are to be one surface;
const LAYERS: (usize, usize) = (7, 10);
/// and fewer fine ones than one in so many say nothing.
const FINE: usize = 4;
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
    relaxing: Relaxing,
    points: &mut [Point],
) -> Result<(Vec<bool>, Seen)> {
    let neighbors = relaxing.neighbors;
    let planes = Planes::load(store, ids.clone(), neighbors)?;
    let looked = look(&planes, neighbors, ids.len())?;
    let _held = hold(bytes_of(&looked));
    let active = choose(&planes, relaxing, &looked, &ids)?;
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

/// The runs of rough patches move if it is noise that makes their region rough.
fn choose(
    planes: &Planes<'_>,
    relaxing: Relaxing,
    looked: &[Target],
    ids: &Range<usize>,
) -> Result<Vec<bool>> {
    let rough = rough_patches(looked, ids);
    let told = ask(planes, relaxing, looked, ids, &rough)?;
    let _held = hold(bytes_of(&told));
    let mut active = vec![false; ids.len().div_ceil(RUN)];
    let of_patches = rough.chunks(REGION).zip(told.chunks(REGION));
    for (runs, (rough, told)) in active.chunks_mut(PATCH * REGION).zip(of_patches) {
        if is_noise(rough, told, relaxing.smoothed) {
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

/// What some rough points of a patch tell.
#[derive(Debug, Clone, Copy, Default)]
struct Told {
    points: u8,
    /// With a curved surface through their neighbours.
    curved: u8,
    /// With the nearest of these in more than few layers, as rounding makes them.
    fine: u8,
    /// Of these, without noise in the nearest.
    clean: u8,
}

impl Told {
    fn is_noisy(self) -> bool {
        2 * self.curved < self.points
    }
}

/// True if it is noise that makes patches of a region rough, not its edges or details that are too fine
/// for the points.
fn is_noise(rough: &[bool], told: &[Told], smoothed: bool) -> bool {
    let sum = |of: fn(&Told) -> u8| told.iter().map(|t| usize::from(of(t))).sum::<usize>();
    let noisy = told.iter().filter(|told| told.is_noisy()).count();
    let (fine, clean) = (sum(|t| t.fine), sum(|t| t.clean));
    let is_clean = fine * FINE >= sum(|t| t.points)
        && clean * CLEAN.1 >= fine * CLEAN.0
        && clean * LAYERS.1 <= fine * LAYERS.0;
    let is_edges = noisy * EDGES.1 < count(rough) * EDGES.0;
    noisy * NOISE >= rough.len() && !is_edges && (smoothed || !is_clean)
}

/// Asks the first rough points of every rough patch.
fn ask(
    planes: &Planes<'_>,
    relaxing: Relaxing,
    looked: &[Target],
    ids: &Range<usize>,
    rough: &[bool],
) -> Result<Vec<Told>> {
    let neighbors = relaxing.neighbors;
    let telling = telling_points(looked, ids, rough);
    let _held = hold(bytes_of(&telling));
    let mut told = vec![Told::default(); rough.len()];
    let mut around = Around::default();
    planes.each_neighborhood(
        |id| telling[id - ids.start],
        |_, near| {
            let curved = around.is_curved(near, neighbors);
            (curved, around.is_clean(near, neighbors))
        },
        |id, _, known| {
            let told = &mut told[patch(id as u32, ids)];
            let (curved, clean) = known;
            told.points += 1;
            told.curved += u8::from(curved);
            told.fine += u8::from(clean.is_some());
            told.clean += u8::from(clean == Some(true));
        },
    )?;
    Ok(told)
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
