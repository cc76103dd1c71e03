//! The measures.

use crate::edges::topology;
use crate::read::Seen;
use crate::sample::{Sample, V3, dot, sample};
use crate::shape::Shape;
use outcrop_cloudgen::{Spots, median};
use outcrop_ply::Mesh;
use rayon::prelude::*;
use serde::Serialize;

/// Seen places among which one must face as a sample of the truth does.
const BESIDE: usize = 8;

/// Least cosine of normals of one side.
const SAME_SIDE: f64 = 0.3;

/// Shares of the percentiles.
const SHARES: [f64; 4] = [0.5, 0.9, 0.99, 0.999];

/// How to measure.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Samples of the truth, and of the mesh.
    pub samples: usize,
    /// Seed of the samples.
    pub seed: u64,
    /// Neighbours by which spacings are taken.
    pub neighbors: usize,
    /// Whether distances are compared with the spacing at the place, where it is more than the median.
    pub local: bool,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            samples: 60_000,
            seed: 0,
            neighbors: 12,
            local: false,
        }
    }
}

/// Measures of a mesh, as the crate defines them. Shares are from 0 to 1; distances are in spacings.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
#[allow(missing_docs)]
pub struct Measures {
    /// The median spacing, in the unit of the coordinates.
    pub spacing: f64,
    /// Share of the truth that was seen.
    pub seen: f64,
    pub f: f64,
    pub accuracy: [f64; 4],
    pub completeness: [f64; 4],
    pub spurious: f64,
    pub complete: f64,
    pub sided: f64,
    pub angle: f64,
    pub bent: f64,
    pub wrong: f64,
    pub boundary: u64,
    pub nonmanifold: u64,
    pub turned: u64,
    pub components: u64,
    pub euler: i64,
    pub triangles: u64,
}

/// A sample of the truth that was seen, and the spacing there.
struct Place {
    sample: Sample,
    spacing: f64,
}

/// A surface and the places of it that were measured.
pub struct Truth {
    shape: Shape,
    spots: Spots,
    /// `u` at each seen place.
    spacings: Vec<f64>,
    spacing: f64,
    places: Vec<Place>,
    /// Share of the truth that was seen.
    seen: f64,
    options: Options,
}

impl Truth {
    /// Of a surface and what was seen of it.
    pub fn new(surface: &Mesh, seen: &[Seen], options: Options) -> Self {
        let positions: Vec<V3> = seen.iter().map(|s| s.place).collect();
        let spots = Spots::new(&positions);
        let own = positions.par_iter();
        let mut spacings: Vec<f64> = own.map(|p| spots.spacing(*p, options.neighbors)).collect();
        let spacing = median(spacings.clone());
        for u in &mut spacings {
            *u = if options.local {
                u.max(spacing)
            } else {
                spacing
            };
        }
        let samples = sample(surface, options.samples, u128::from(options.seed) * 2 + 1);
        let count = samples.len();
        let at = |sample: Sample| {
            let near = spots.nearest(sample.place).take(BESIDE);
            let mut faces = near.filter(|(distance, at)| {
                *distance < 2.0 * spacings[*at] && dot(seen[*at].normal, sample.normal) > SAME_SIDE
            });
            let (_, first) = faces.next()?;
            Some(Place {
                sample,
                spacing: spacings[first],
            })
        };
        let places: Vec<Place> = samples.into_par_iter().filter_map(at).collect();
        Truth {
            shape: Shape::new(surface),
            seen: places.len() as f64 / count.max(1) as f64,
            spots,
            spacings,
            spacing,
            places,
            options,
        }
    }

    /// The median spacing of what was seen.
    pub fn spacing(&self) -> f64 {
        self.spacing
    }

    /// Measures a mesh.
    pub fn measure(&self, mesh: &Mesh) -> Measures {
        let topology = topology(mesh.vertices.len(), &mesh.triangles);
        let seed = u128::from(self.options.seed) * 2 + 2;
        let samples = sample(mesh, self.options.samples, seed);
        let there = self.there(&samples);
        let back = self.back(mesh);
        let (precision, recall) = (there.close, back.close);
        Measures {
            spacing: self.spacing,
            seen: self.seen,
            f: 2.0 * precision * recall / (precision + recall).max(1e-9),
            accuracy: percentiles(there.distances, self.spacing),
            completeness: percentiles(back.distances, self.spacing),
            spurious: there.spurious,
            complete: back.complete,
            sided: back.sided,
            angle: there.angle,
            bent: there.bent,
            wrong: there.wrong,
            boundary: topology.boundary,
            nonmanifold: topology.nonmanifold,
            turned: topology.turned,
            components: topology.components,
            euler: topology.euler,
            triangles: mesh.triangles.len() as u64,
        }
    }

    /// From the mesh to the truth.
    fn there(&self, samples: &[Sample]) -> There {
        let found = self.shape.nearest(samples.par_iter().map(|s| s.place));
        let spacing = |s: &Sample| {
            let nearest = self.spots.nearest(s.place).next();
            nearest.map_or(self.spacing, |(_, at)| self.spacings[at])
        };
        let spacings: Vec<f64> = samples.par_iter().map(spacing).collect();
        let all = || samples.iter().zip(&found).zip(&spacings);
        let near = all().filter(|((_, found), u)| found.0 <= 3.0 * **u);
        let cosines: Vec<f64> = near.map(|((s, found), _)| dot(s.normal, found.1)).collect();
        let angles = cosines.iter().map(|c| c.abs().min(1.0).acos().to_degrees());
        let sided = cosines.iter().filter(|c| c.abs() > 0.5);
        let turned = cosines.iter().filter(|c| **c < -0.5).count();
        There {
            close: share(
                all().filter(|((_, f), u)| f.0 <= **u).count(),
                samples.len(),
            ),
            spurious: share(
                all().filter(|((_, f), u)| f.0 > 3.0 * **u).count(),
                samples.len(),
            ),
            angle: angles.clone().sum::<f64>() / cosines.len().max(1) as f64,
            bent: share(angles.filter(|a| *a > 30.0).count(), cosines.len()),
            wrong: share(turned, sided.count()),
            distances: found.iter().map(|f| f.0).collect(),
        }
    }

    /// From the seen truth to the mesh.
    fn back(&self, mesh: &Mesh) -> Back {
        let places = self.places.par_iter().map(|p| p.sample.place);
        let found = Shape::new(mesh).nearest(places);
        let all = || self.places.iter().zip(&found);
        let within = |most: f64| all().filter(move |(p, f)| f.0 <= most * p.spacing);
        let sided = within(1.5).filter(|(p, f)| dot(p.sample.normal, f.1) > 0.0);
        Back {
            close: share(within(1.0).count(), found.len()),
            complete: share(within(1.5).count(), found.len()),
            sided: share(sided.count(), found.len()),
            distances: found.iter().map(|f| f.0).collect(),
        }
    }
}

struct There {
    close: f64,
    spurious: f64,
    angle: f64,
    bent: f64,
    wrong: f64,
    distances: Vec<f64>,
}

struct Back {
    close: f64,
    complete: f64,
    sided: f64,
    distances: Vec<f64>,
}

fn share(part: usize, whole: usize) -> f64 {
    part as f64 / whole.max(1) as f64
}

/// Percentiles in spacings, between ranks in proportion.
fn percentiles(mut distances: Vec<f64>, spacing: f64) -> [f64; 4] {
    distances.sort_unstable_by(f64::total_cmp);
    SHARES.map(|share| {
        let rank = share * distances.len().saturating_sub(1) as f64;
        let at = |rank: f64| distances.get(rank as usize).copied().unwrap_or(0.0);
        let (low, high) = (at(rank.floor()), at(rank.ceil()));
        let between = if low == high {
            low
        } else {
            low + (rank - rank.floor()) * (high - low)
        };
        between / spacing.max(f64::MIN_POSITIVE)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_between_ranks() {
        let distances = (0..=1000).rev().map(f64::from).collect();
        assert_eq!(percentiles(distances, 2.0), [250.0, 450.0, 495.0, 499.5]);
        assert_eq!(percentiles(Vec::new(), 2.0), [0.0; 4]);
    }
}
