//! The first round of relaxing, a region at a time: a look at some points of every patch, and those that
//! are rough move if it is noise that makes them so.

use super::Relaxing;
use super::edges::Around;
use super::fits::Planes;
use super::seen::Seen;
use crate::error::Result;
use crate::geom::Point;
use crate::method::METHOD;
use crate::stages::order::PointStore;
use crate::stages::spacing::is_far;
use crate::workspace::memory::{bytes_of, hold};
use crate::workspace::persist::persist;
use std::ops::Range;

/// Bytes for each point of a region: what was seen of the samples, which of them tell, and some.
pub(super) fn bytes() -> u64 {
    ((size_of::<Target>() + size_of::<Sample>()) / METHOD.curve.sample + 4) as u64
}

/// Patches in a region.
fn region() -> usize {
    METHOD.curve.block as usize / METHOD.curve.patch
}

/// Where a sampled point would go, and whether that is far.
type Target = (u32, Point, bool);

/// A look at the samples of some regions.
struct Looked {
    /// Where each would go.
    targets: Vec<Target>,
    /// How far the neighbours of points usually reach, squared, by patch.
    usual2: Vec<u64>,
}

/// What became of the points of some regions.
pub(super) struct Done {
    /// Which runs move.
    pub active: Vec<bool>,
    /// What was seen of them.
    pub seen: Seen,
    /// See [`Spacings`](crate::stages::spacing::Spacings).
    pub usual2: Vec<u64>,
}

persist!(Done {
    active,
    seen,
    usual2
});

/// Moves `points`, which are those of the regions `ids`.
pub(super) fn look_and_move(
    store: &PointStore,
    ids: Range<usize>,
    relaxing: Relaxing,
    points: &mut [Point],
) -> Result<Done> {
    let neighbors = relaxing.neighbors;
    let planes = Planes::load(store, ids.clone(), neighbors)?;
    let Looked { targets, usual2 } = look(&planes, relaxing, &ids)?;
    let _held = hold(bytes_of(&targets) + bytes_of(&usual2));
    let active = if relaxing.rounds > 0 {
        choose(&planes, relaxing, &targets, &ids)?
    } else {
        vec![false; ids.len().div_ceil(METHOD.curve.run)]
    };
    let mut seen = Seen::of(&ids);
    let moves = |id: usize| active[(id - ids.start) / METHOD.curve.run];
    let mut put = |id: usize, to, rough| {
        seen.note(id, rough);
        points[id - ids.start] = to;
        seen.moved += 1;
    };
    for (id, to, rough) in targets {
        if moves(id as usize) {
            put(id as usize, to, rough);
        }
    }
    let others = |id: usize| moves(id) && !is_sampled(id);
    planes.each(others, |id, point, fit| {
        let usual2 = usual2[patch(id as u32, &ids)];
        let (to, rough) = relaxing.target(point, &fit, usual2);
        put(id, to, rough);
    })?;
    Ok(Done {
        active,
        seen,
        usual2,
    })
}

fn is_sampled(id: usize) -> bool {
    (id / METHOD.curve.run).is_multiple_of(METHOD.curve.sample)
}

/// Looks at the samples.
fn look(planes: &Planes<'_>, relaxing: Relaxing, ids: &Range<usize>) -> Result<Looked> {
    let curve = METHOD.curve;
    let mut samples: Vec<Sample> = Vec::with_capacity(ids.len() / curve.sample + curve.run);
    planes.each(is_sampled, |id, point, fit| {
        // As if it were on the surface: how far that reaches is not known yet.
        let (to, rough) = relaxing.target(point, &fit, fit.last2);
        let fills = |normal| fit.moments.fill_space(normal);
        samples.push(Sample {
            point,
            target: (id as u32, to, rough),
            last2: fit.last2,
            fills: fit.plane.normal.is_some_and(fills),
        });
    })?;
    let _held = hold(bytes_of(&samples));
    let usual2 = usual_reach(&samples, ids);
    let target = |sample: &Sample| {
        let id = sample.target.0;
        if relaxing.off_surface && is_far(sample.last2, usual2[patch(id, ids)]) {
            (id, sample.point, false)
        } else {
            sample.target
        }
    };
    Ok(Looked {
        targets: samples.iter().map(target).collect(),
        usual2,
    })
}

/// A point that is looked at first.
struct Sample {
    point: Point,
    target: Target,
    /// Squared distance of the last of its neighbours.
    last2: u64,
    /// It and its neighbours fill space.
    fills: bool,
}

/// For each patch how far the neighbours of its points usually reach, squared: the lower quartile of those
/// looked at. Where these fill space and reach far for their region they are strewn in the air, and what is
/// usual is what is so in the region.
fn usual_reach(samples: &[Sample], ids: &Range<usize>) -> Vec<u64> {
    let curve = METHOD.curve;
    let patches = ids.len().div_ceil(curve.patch);
    let mut reach: Vec<Vec<u64>> = Vec::new();
    reach.resize_with(patches, || Vec::with_capacity(curve.patch / curve.sample));
    let mut filling = vec![0; patches];
    for sample in samples {
        let patch = patch(sample.target.0, ids);
        reach[patch].push(sample.last2);
        filling[patch] += usize::from(sample.fills);
    }
    let counts: Vec<usize> = reach.iter().map(Vec::len).collect();
    let mut usual2: Vec<u64> = reach.into_iter().map(lower_quartile).collect();
    let counts = filling.chunks(region()).zip(counts.chunks(region()));
    for (usual2, (filling, counts)) in usual2.chunks_mut(region()).zip(counts) {
        let region2 = lower_quartile(usual2.to_vec());
        let far = usual2.iter().filter(|u| is_far(**u, region2)).count();
        let one_in = if far * METHOD.off_surface.few <= usual2.len() {
            METHOD.off_surface.airy_if_few
        } else {
            METHOD.off_surface.airy
        };
        for (usual2, (filling, count)) in usual2.iter_mut().zip(filling.iter().zip(counts)) {
            if one_in * filling >= *count && is_far(*usual2, region2) {
                *usual2 = region2;
            }
        }
    }
    usual2
}

fn lower_quartile(mut all: Vec<u64>) -> u64 {
    if all.is_empty() {
        return 0;
    }
    let place = all.len() / METHOD.off_surface.quantile;
    *all.select_nth_unstable(place).1
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
    let run = METHOD.curve.run;
    let (of_patch, of_region) = (METHOD.curve.patch / run, METHOD.curve.block as usize / run);
    let mut active = vec![false; ids.len().div_ceil(run)];
    let of_patches = rough.chunks(region()).zip(told.chunks(region()));
    for (runs, (rough, told)) in active.chunks_mut(of_region).zip(of_patches) {
        if is_noise(rough, told, relaxing.smoothed) {
            for (runs, rough) in runs.chunks_mut(of_patch).zip(rough) {
                runs.fill(*rough);
            }
        }
    }
    Ok(active)
}

fn patch(id: u32, ids: &Range<usize>) -> usize {
    (id as usize - ids.start) / METHOD.curve.patch
}

/// Patches of which enough was rough of what was looked at; none of a region where these are too few.
fn rough_patches(looked: &[Target], ids: &Range<usize>) -> Vec<bool> {
    let mut counts = vec![(0, 0); ids.len().div_ceil(METHOD.curve.patch)];
    for (id, _, far) in looked {
        let (seen, rough) = &mut counts[patch(*id, ids)];
        *seen += 1;
        *rough += usize::from(*far);
    }
    let is_rough = |(seen, rough): &(usize, usize)| rough * METHOD.relax.patch > *seen;
    let mut rough: Vec<bool> = counts.iter().map(is_rough).collect();
    for region in rough.chunks_mut(region()) {
        if count(region) * METHOD.relax.region < region.len() {
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
        METHOD.relax.noisy as u8 * self.curved < self.points
    }
}

/// True if it is noise that makes patches of a region rough, not its edges or details that are too fine
/// for the points.
fn is_noise(rough: &[bool], told: &[Told], smoothed: bool) -> bool {
    let sum = |of: fn(&Told) -> u8| told.iter().map(|t| usize::from(of(t))).sum::<usize>();
    let noisy = told.iter().filter(|told| told.is_noisy()).count();
    let (fine, clean) = (sum(|t| t.fine), sum(|t| t.clean));
    let limits = METHOD.relax;
    let is_clean = fine * limits.fine >= sum(|t| t.points)
        && 100 * clean >= fine * limits.clean
        && 100 * clean <= fine * limits.layers;
    let is_edges = 100 * noisy < count(rough) * limits.edges;
    noisy * limits.region >= rough.len() && !is_edges && (smoothed || !is_clean)
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
    let wanted = |rough: &bool| if *rough { METHOD.relax.telling } else { 0 };
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
