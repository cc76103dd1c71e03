//! The first round of relaxing, region by region: samples of every patch are examined, and the points of
//! rough patches move if the roughness of their region is noise.

use super::Relaxing;
use super::edges::WeightedNeighbors;
use super::seen::Roughness;
use crate::error::Result;
use crate::geom::Point;
use crate::method::METHOD;
use crate::stages::cells::Planes;
use crate::stages::order::PointStore;
use crate::stages::spacing::is_far;
use crate::workspace::Unit;
use crate::workspace::memory::bytes_of;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Bytes for each point of a region: the results for samples, the set of witnesses, and lists.
pub(super) fn bytes() -> u64 {
    ((size_of::<Target>() + size_of::<Sample>()) / METHOD.curve.sample + 4) as u64
}

/// Number of patches in a region.
fn region() -> usize {
    METHOD.curve.block as usize / METHOD.curve.patch
}

/// A sample: its id, the position to which it would move, and true if it is rough.
type Target = (u32, Point, bool);

/// The result of the first round for some regions.
#[derive(Serialize, Deserialize)]
pub(super) struct Done {
    /// For each run, true if it moves.
    pub active: Vec<bool>,
    /// The number of rough points in each run.
    pub seen: Roughness,
    /// See [`Spacings`](crate::stages::spacing::Spacings).
    pub usual2: Vec<u64>,
}

/// Moves the `points` of the regions with the ids `ids`.
pub(super) fn examine_and_move(
    unit: &Unit<'_>,
    store: &PointStore,
    ids: Range<usize>,
    relaxing: Relaxing,
    points: &mut [Point],
) -> Result<Done> {
    let neighbors = relaxing.neighbors;
    let planes = Planes::load(unit, store, ids.clone(), |_| true, neighbors)?;
    let (targets, usual2) = look(&planes, relaxing, &ids)?;
    let _held = unit.hold(bytes_of(&targets) + bytes_of(&usual2));
    let active = if relaxing.rounds > 0 {
        choose(&planes, relaxing, &targets, &ids)?
    } else {
        vec![false; ids.len().div_ceil(METHOD.curve.run)]
    };
    let mut seen = Roughness::of(&ids);
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
        let (to, rough) = relaxing.target(point, fit, usual2);
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

/// Examines the samples: returns the target of each sample, and the usual reach, squared, by patch.
fn look(
    planes: &Planes<'_>,
    relaxing: Relaxing,
    ids: &Range<usize>,
) -> Result<(Vec<Target>, Vec<u64>)> {
    let curve = METHOD.curve;
    let mut samples: Vec<Sample> = Vec::with_capacity(ids.len() / curve.sample + curve.run);
    planes.each(is_sampled, |id, point, fit| {
        // As if the point were on the surface: the usual reach is not known yet.
        let (to, rough) = relaxing.target(point, fit, fit.last2);
        let fills = |normal| fit.moments.fill_space(normal);
        samples.push(Sample {
            point,
            target: (id as u32, to, rough),
            last2: fit.last2,
            fills: fit.plane.normal.is_some_and(fills),
        });
    })?;
    let _held = planes.unit.hold(bytes_of(&samples));
    let usual2 = usual_reach(&samples, ids);
    let target = |sample: &Sample| {
        let id = sample.target.0;
        if relaxing.off_surface && is_far(sample.last2, usual2[patch(id, ids)]) {
            (id, sample.point, false)
        } else {
            sample.target
        }
    };
    Ok((samples.iter().map(target).collect(), usual2))
}

/// A sample for the usual reach.
struct Sample {
    point: Point,
    target: Target,
    /// Squared distance of the last neighbour.
    last2: u64,
    /// True if it and its neighbours fill space.
    fills: bool,
}

/// The usual reach of each patch, squared: the lower quartile over its samples. Where samples fill space and
/// reach far for their region, they are points strewn in the air, and the usual reach of the region is taken.
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

/// Selects the runs of rough patches in the regions whose roughness is noise.
fn choose(
    planes: &Planes<'_>,
    relaxing: Relaxing,
    examined: &[Target],
    ids: &Range<usize>,
) -> Result<Vec<bool>> {
    let rough = rough_patches(examined, ids);
    let counts = count_witnesses(planes, relaxing, examined, ids, &rough)?;
    let _held = planes.unit.hold(bytes_of(&counts));
    let run = METHOD.curve.run;
    let (of_patch, of_region) = (METHOD.curve.patch / run, METHOD.curve.block as usize / run);
    let mut active = vec![false; ids.len().div_ceil(run)];
    let of_patches = rough.chunks(region()).zip(counts.chunks(region()));
    for (runs, (rough, counts)) in active.chunks_mut(of_region).zip(of_patches) {
        if is_noise(rough, counts, relaxing.smoothed) {
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

/// The rough patches: those with a large enough share of rough samples; none in a region with too few of
/// them.
fn rough_patches(examined: &[Target], ids: &Range<usize>) -> Vec<bool> {
    let mut counts = vec![(0, 0); ids.len().div_ceil(METHOD.curve.patch)];
    for (id, _, far) in examined {
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

/// Counts of the witnesses of a patch.
#[derive(Debug, Clone, Copy, Default)]
struct WitnessCounts {
    points: u8,
    /// Witnesses that are curved: their neighbours lie on a curved surface.
    curved: u8,
    /// Witnesses that are fine: their nearest neighbours lie in more than a few layers (rounding makes
    /// layers).
    fine: u8,
    /// Fine witnesses whose nearest neighbours show no noise.
    clean: u8,
}

impl WitnessCounts {
    fn is_noisy(self) -> bool {
        METHOD.relax.noisy as u8 * self.curved < self.points
    }
}

/// True if the patches of a region are rough because of noise, not because of edges or of details too fine
/// for the points.
fn is_noise(rough: &[bool], counts: &[WitnessCounts], smoothed: bool) -> bool {
    let sum =
        |of: fn(&WitnessCounts) -> u8| counts.iter().map(|t| usize::from(of(t))).sum::<usize>();
    let noisy = counts.iter().filter(|counts| counts.is_noisy()).count();
    let (fine, clean) = (sum(|t| t.fine), sum(|t| t.clean));
    let limits = METHOD.relax;
    let is_clean = 100 * clean > fine * limits.clean && 100 * clean <= fine * limits.layers;
    let is_edges = 100 * noisy < count(rough) * limits.edges;
    noisy * limits.region >= rough.len() && !is_edges && (smoothed || !is_clean)
}

/// Counts the properties of the witnesses of every rough patch.
fn count_witnesses(
    planes: &Planes<'_>,
    relaxing: Relaxing,
    examined: &[Target],
    ids: &Range<usize>,
    rough: &[bool],
) -> Result<Vec<WitnessCounts>> {
    let neighbors = relaxing.neighbors;
    let is_witness = witnesses(examined, ids, rough);
    let _held = planes.unit.hold(bytes_of(&is_witness));
    let mut counts = vec![WitnessCounts::default(); rough.len()];
    let mut around = WeightedNeighbors::default();
    planes.each_neighborhood(
        |id| is_witness[id - ids.start],
        |_, near| {
            let curved = around.is_curved(near, neighbors);
            (curved, around.is_clean(near, neighbors))
        },
        |id, _, known| {
            let counts = &mut counts[patch(id as u32, ids)];
            let (curved, clean) = *known;
            counts.points += 1;
            counts.curved += u8::from(curved);
            counts.fine += u8::from(clean.is_some());
            counts.clean += u8::from(clean == Some(true));
        },
    )?;
    Ok(counts)
}

/// The witnesses: of each rough patch, the first rough samples by id.
fn witnesses(examined: &[Target], ids: &Range<usize>, rough: &[bool]) -> Vec<bool> {
    let wanted = |rough: &bool| if *rough { METHOD.relax.witnesses } else { 0 };
    let mut left: Vec<usize> = rough.iter().map(wanted).collect();
    let mut found: Vec<u32> = examined.iter().filter(|l| l.2).map(|l| l.0).collect();
    found.sort_unstable();
    let mut is_witness = vec![false; ids.len()];
    for id in found {
        let left = &mut left[patch(id, ids)];
        if *left > 0 {
            *left -= 1;
            is_witness[id as usize - ids.start] = true;
        }
    }
    is_witness
}
