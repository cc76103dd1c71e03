//! Distribution of the points on the surface.

mod eliminate;
mod grid;

use crate::cloud::Cloud;
use crate::error::{Error, Result};
use crate::rng::{Purpose, Rng};
use crate::surface::{Sample, Surface};

/// Distribution of the points on the surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sampling {
    /// Each independent of the others.
    #[default]
    Uniform,
    /// Evenly spaced, without a preferred direction (blue noise): no two are close together.
    Regular,
    /// Like regular, with up to 16 times the density where curvature is high.
    Adaptive,
}

/// Largest number of points of a cloud that is held in memory.
pub const MOST_HELD: u64 = 10_000_000;

/// Candidates per remaining point.
const CANDIDATES: u64 = 4;

/// Further candidates, so that small clouds have a choice too.
const EXTRA: u64 = 64;

/// Samples for the mean curvature.
const PILOT: u64 = 1 << 14;

/// Density of flat parts, relative to the largest.
const LEAST_DENSITY: f64 = 1.0 / 16.0;

/// Density is largest where curvature is this multiple of its mean.
const SHARP: f64 = 4.0;

/// Chooses exactly the wanted number of points, in the order of a sweep over the surface.
pub(crate) fn choose(cloud: &Cloud, surface: &dyn Surface) -> Result<Vec<Sample>> {
    let wanted = cloud.points;
    if wanted > MOST_HELD {
        let most = format!("at most {MOST_HELD} with a sampling that is not uniform");
        return Err(Error::parameter("points", wanted, most));
    }
    let density = Density::new(cloud, surface)?;
    let drawn = ((CANDIDATES * wanted + EXTRA) as f64 / density.mean).ceil() as u64;
    let (mut chosen, mut spare) = (Vec::new(), Vec::new());
    for index in 0..drawn {
        let mut rng = Rng::at(cloud.seed, Purpose::Position, index);
        let u = (index as f64 + rng.uniform()) / drawn as f64;
        let (v, chance) = (rng.uniform(), rng.uniform());
        let here = density.at(surface, u, v);
        let candidate = (surface.at(u, v), here);
        if chance < here {
            chosen.push(candidate);
        } else if (chosen.len() + spare.len()) < wanted as usize {
            spare.push(candidate);
        }
    }
    // Rarely needed: far too many candidates were rejected by chance.
    let lack = (wanted as usize).saturating_sub(chosen.len());
    chosen.extend(spare.into_iter().take(lack));
    let area = surface.area() * density.mean;
    let keep = eliminate::eliminate(&chosen, wanted as usize, area);
    let mut kept = keep.iter();
    chosen.retain(|_| kept.next() == Some(&true));
    Ok(chosen.into_iter().map(|(sample, _)| sample).collect())
}

/// Wanted density of points, from [`LEAST_DENSITY`] to 1.
struct Density {
    /// Curvature of density 1; none if the density is the same everywhere.
    sharp: Option<f64>,
    mean: f64,
}

impl Density {
    fn new(cloud: &Cloud, surface: &dyn Surface) -> Result<Self> {
        let mut density = Density {
            sharp: None,
            mean: 1.0,
        };
        if cloud.sampling != Sampling::Adaptive {
            return Ok(density);
        }
        let places = (0..PILOT).map(|k| {
            let u = (k as f64 + 0.5) / PILOT as f64;
            // Multiples of the golden ratio, which are spread evenly.
            (u, (k as f64 * 0.618_033_988_749_894_9).fract())
        });
        let mut sum = 0.0;
        for (u, v) in places.clone() {
            sum += surface.curvature(u, v).ok_or(Error::Conflict {
                first: "adaptive sampling",
                second: cloud.kind.name(),
                why: "the points follow the curvature of closed smooth surfaces and meshes",
            })?;
        }
        density.sharp = Some(SHARP * sum / PILOT as f64).filter(|&sharp| sharp > 0.0);
        let all: f64 = places.map(|(u, v)| density.at(surface, u, v)).sum();
        density.mean = all / PILOT as f64;
        Ok(density)
    }

    fn at(&self, surface: &dyn Surface, u: f64, v: f64) -> f64 {
        let density = self
            .sharp
            .and_then(|sharp| Some(surface.curvature(u, v)? / sharp));
        density.map_or(1.0, |density| density.clamp(LEAST_DENSITY, 1.0))
    }
}
