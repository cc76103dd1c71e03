//! The points of a cloud.

mod truth;

use std::thread;

use crate::cloud::{Cloud, NoiseMode, Order};
use crate::error::Result;
use crate::kind::Kind;
use crate::odd::Odd;
use crate::outdoor::{Land, Outdoor};
use crate::picker::Picker;
use crate::reference;
use crate::rng::{Permutation, Purpose, Rng};
use crate::sampling::{Sampling, choose};
use crate::scene::{self, Made};
use crate::surface::{Grid, Line, Sample, Surface, box_distance, box_point, turned, turned_back};
use crate::vec3::{Vec3, add, length, scale, sub};

/// Largest number of attempts for a point with the density falloff; far more than needed for sensible
/// positions of the scanner.
const FALLOFF_TRIES: u32 = 4096;

/// Size of the box of outliers, in units of the bounding box.
const OUTLIER_BOX: f64 = 1.5;

/// Fewer points are made on one thread.
const PARALLEL_FROM: usize = 4096;

/// Source of the positions.
#[derive(Debug)]
enum Source {
    Grid(Grid),
    Odd(Odd),
    Outdoor(Outdoor),
    Surface {
        surface: Box<dyn Surface>,
        scan: Option<(Vec<Line>, Picker)>,
    },
    /// Points chosen in advance.
    Chosen {
        surface: Box<dyn Surface>,
        samples: Vec<Sample>,
    },
    /// A scene and its points.
    Scene(Made),
}

/// Position of point `i` in the sweep over the surface.
#[derive(Debug)]
enum Sweep {
    /// Random, independent of all others.
    Chance,
    /// Random in the `i`-th of equal parts of the sweep.
    InOrder,
    /// As in order, but with a permutation of the parts.
    Shuffled(Permutation),
}

/// Makes any point of a cloud on demand. Point `i` depends only on the description and `i`.
#[derive(Debug)]
pub struct Generator {
    cloud: Cloud,
    source: Source,
    sweep: Sweep,
    scanner: Vec3,
    /// Distance from the scanner within which the density is constant.
    near: f64,
    /// Box of the outliers, before rotation and offset.
    outlier_box: [Vec3; 2],
}

impl Generator {
    pub(crate) fn new(cloud: &Cloud) -> Result<Self> {
        if let Kind::Odd(odd) = cloud.kind {
            let half = [odd.reach(cloud.points, cloud.size); 3];
            let bounds = [scale(half, -1.0), half];
            return Ok(Self::with(cloud, Source::Odd(odd), bounds, [0.0; 3]));
        }
        if let Kind::Scene(scene) = cloud.kind {
            let made = scene::make(cloud, scene)?;
            let cloud = cloud.clone().points(made.points.len() as u64);
            let bounds = made.truth.bounds();
            return Ok(Self::with(&cloud, Source::Scene(made), bounds, [0.0; 3]));
        }
        if cloud.kind == Kind::Outdoor {
            let land = Land::new(cloud.seed, &cloud.objects);
            let source = Source::Outdoor(Outdoor::new(&land, cloud.points));
            // Another survey measures other points.
            let seed = cloud.seed ^ u64::from(cloud.objects.epoch) << 63;
            let cloud = &cloud.clone().seed(seed);
            return Ok(Self::with(cloud, source, Outdoor::bounds(), [0.0; 3]));
        }
        let Some(surface) = reference::surface(cloud)? else {
            let grid = Grid::new(cloud.points, cloud.size, cloud.rotated)?;
            let bounds = grid.bounds();
            return Ok(Self::with(cloud, Source::Grid(grid), bounds, [0.0; 3]));
        };
        let bounds = surface.bounds();
        let scanner = cloud
            .scanner
            .map_or_else(|| surface.scanner(), |s| box_point(bounds, s));
        if cloud.sampling != Sampling::Uniform {
            let samples = choose(cloud, surface.as_ref())?;
            let source = Source::Chosen { surface, samples };
            return Ok(Self::with(cloud, source, bounds, scanner));
        }
        let scan = cloud.scanlines.map(|ratio| {
            let spacing = (surface.area() * ratio / cloud.points.max(1) as f64).sqrt();
            let lines = surface.scan_lines(spacing);
            let picker = Picker::new(lines.iter().map(|line| line.weight));
            (lines, picker)
        });
        Ok(Self::with(
            cloud,
            Source::Surface { surface, scan },
            bounds,
            scanner,
        ))
    }

    fn with(cloud: &Cloud, source: Source, bounds: [Vec3; 2], scanner: Vec3) -> Self {
        let regular = matches!(cloud.kind, Kind::Grid | Kind::Outdoor | Kind::Scene(_))
            || cloud.sampling != Sampling::Uniform
            || (cloud.scanlines.is_some() && !cloud.falloff);
        let sweep = match cloud.order {
            Order::Sorted => Sweep::InOrder,
            Order::Random if regular => Sweep::Shuffled(Permutation::new(cloud.points, cloud.seed)),
            Order::Random => Sweep::Chance,
        };
        let low = (1.0 - OUTLIER_BOX) / 2.0;
        // A flat box gets a quarter of the size as depth: outliers must leave the surface.
        let depth = cloud.size / 4.0;
        let mut fat = bounds;
        for k in 0..3 {
            let [low, high] = &mut fat;
            let lack = (depth - (high[k] - low[k])).max(0.0) / 2.0;
            low[k] -= lack;
            high[k] += lack;
        }
        let outlier_box = [box_point(fat, [low; 3]), box_point(fat, [1.0 - low; 3])];
        let near = box_distance(bounds, scanner).max(0.05 * cloud.size);
        Generator {
            cloud: cloud.clone(),
            source,
            sweep,
            scanner,
            near,
            outlier_box,
        }
    }

    /// The description.
    pub fn cloud(&self) -> &Cloud {
        &self.cloud
    }

    /// Number of points.
    pub fn len(&self) -> u64 {
        self.cloud.points
    }

    /// True if there is no point.
    pub fn is_empty(&self) -> bool {
        self.cloud.points == 0
    }

    /// Point `index` with the normal of the surface; `index` is taken modulo the number of points.
    pub fn sample(&self, index: u64) -> Sample {
        self.original(self.source_of(index))
    }

    /// The index of the point of which a point is a copy; that of its own for most.
    fn source_of(&self, index: u64) -> u64 {
        let mut index = index % self.cloud.points.max(1);
        if self.cloud.duplicates > 0.0 {
            // A copy is always of an earlier point, so the loop ends.
            while index > 0 {
                let mut rng = Rng::at(self.cloud.seed, Purpose::Duplicate, index);
                if rng.uniform() >= self.cloud.duplicates {
                    break;
                }
                index = rng.below(index);
            }
        }
        index
    }

    /// Area of one layer of the surface; `None` for a grid and if there is no single surface.
    pub fn area(&self) -> Option<f64> {
        match &self.source {
            Source::Grid(_) | Source::Odd(_) | Source::Outdoor(_) | Source::Scene(_) => None,
            Source::Surface { surface, .. } | Source::Chosen { surface, .. } => {
                Some(surface.area())
            }
        }
    }

    /// Fills `out` with the points from `start` on.
    pub fn fill(&self, start: u64, out: &mut [[f64; 3]]) {
        for (index, point) in (start..).zip(out) {
            *point = self.sample(index).position;
        }
    }

    /// Side of the square with one point on a roof of the outdoor world; None for other kinds.
    pub fn outdoor_spacing(&self) -> Option<f64> {
        match &self.source {
            Source::Outdoor(outdoor) => Some(outdoor.spacing()),
            _ => None,
        }
    }

    /// All points in order.
    pub fn iter(&self) -> impl Iterator<Item = [f64; 3]> + '_ {
        (0..self.cloud.points).map(|index| self.sample(index).position)
    }

    /// Distance of a position from the true surface, the first layer: exact for the kinds with a closed form
    /// and for meshes (slow: all triangles are examined), of first order for `bumpy` and `terrain`; NaN if
    /// there is no single surface.
    pub fn distance(&self, position: [f64; 3]) -> f64 {
        let p = sub(position, self.cloud.offset);
        match &self.source {
            Source::Grid(grid) => grid.distance(p),
            Source::Odd(_) | Source::Outdoor(_) | Source::Scene(_) => f64::NAN,
            Source::Surface { surface, .. } | Source::Chosen { surface, .. } => {
                surface.distance(if self.cloud.rotated {
                    turned_back(p)
                } else {
                    p
                })
            }
        }
    }

    /// Fills `out` with the points of the given indices, on all processors.
    pub(crate) fn gather(&self, indices: &[u64], out: &mut [[f64; 3]]) {
        let make = |indices: &[u64], out: &mut [[f64; 3]]| {
            for (&index, point) in indices.iter().zip(out) {
                *point = self.sample(index).position;
            }
        };
        let threads = thread::available_parallelism()
            .map_or(1, usize::from)
            .min(16);
        let share = out.len().div_ceil(threads).max(PARALLEL_FROM);
        if out.len() <= share {
            return make(indices, out);
        }
        thread::scope(|scope| {
            for (indices, out) in indices.chunks(share).zip(out.chunks_mut(share)) {
                scope.spawn(move || make(indices, out));
            }
        });
    }

    /// Upper bound for absolute coordinates before the offset, for sensible settings.
    pub(crate) fn reach(&self) -> f64 {
        let corner = self
            .outlier_box
            .iter()
            .flatten()
            .fold(0.0, |m: f64, c| m.max(c.abs()));
        let layers = f64::from(self.cloud.layers - 1) * self.cloud.layer_offset.abs();
        corner * 3f64.sqrt() + 10.0 * self.cloud.noise + layers
    }

    /// Point `index` unless it is a duplicate.
    fn original(&self, index: u64) -> Sample {
        let sample = self.outlier(index).unwrap_or_else(|| self.noisy(index));
        Sample {
            position: add(sample.position, self.cloud.offset),
            ..sample
        }
    }

    fn outlier(&self, index: u64) -> Option<Sample> {
        if self.cloud.outliers == 0.0 {
            return None;
        }
        let mut rng = Rng::at(self.cloud.seed, Purpose::Outlier, index);
        if rng.uniform() >= self.cloud.outliers {
            return None;
        }
        let place = match &self.source {
            Source::Outdoor(_) => Outdoor::outlier(&mut rng),
            _ => box_point(self.outlier_box, std::array::from_fn(|_| rng.uniform())),
        };
        Some(self.turn(Sample {
            position: place,
            normal: [0.0; 3],
        }))
    }

    fn noisy(&self, index: u64) -> Sample {
        let mut sample = self.place(index);
        if let Source::Scene(made) = &self.source {
            let error = made.points[self.rank(index) as usize].error;
            let turn = |v| if self.cloud.rotated { turned(v) } else { v };
            sample.position = add(sample.position, turn(error));
        }
        if self.cloud.layers > 1 {
            let layer = (index % u64::from(self.cloud.layers)) as f64;
            let shift = scale(sample.normal, layer * self.cloud.layer_offset);
            sample.position = add(sample.position, shift);
        }
        let sigma = self.cloud.noise;
        if sigma > 0.0 {
            let mut rng = Rng::at(self.cloud.seed, Purpose::Noise, index);
            let shift = match self.cloud.noise_mode {
                NoiseMode::Normal => scale(sample.normal, sigma * rng.normal()),
                NoiseMode::Isotropic => std::array::from_fn(|_| sigma * rng.normal()),
            };
            sample.position = add(sample.position, shift);
        }
        sample
    }

    /// Point `index` on the surface, without any error.
    fn place(&self, index: u64) -> Sample {
        match &self.source {
            Source::Grid(grid) => grid.node(self.rank(index)),
            Source::Outdoor(outdoor) => {
                let rank = self.rank(index);
                outdoor.point(rank, &mut Rng::at(self.cloud.seed, Purpose::Position, rank))
            }
            Source::Odd(odd) => {
                let mut rng = Rng::at(self.cloud.seed, Purpose::Position, index);
                let position = odd.point(index, self.cloud.points, self.cloud.size, &mut rng);
                let normal = [0.0; 3];
                self.turn(Sample { position, normal })
            }
            Source::Surface { surface, scan } => {
                self.turn(self.on_surface(surface.as_ref(), scan.as_ref(), index))
            }
            Source::Chosen { samples, .. } => self.turn(samples[self.rank(index) as usize]),
            Source::Scene(made) => {
                let point = &made.points[self.rank(index) as usize];
                self.turn(Sample {
                    position: point.place,
                    normal: point.normal,
                })
            }
        }
    }

    /// Position of point `index` in the order of the source.
    fn rank(&self, index: u64) -> u64 {
        match &self.sweep {
            Sweep::Shuffled(permutation) => permutation.apply(index),
            Sweep::Chance | Sweep::InOrder => index,
        }
    }

    fn on_surface(
        &self,
        surface: &dyn Surface,
        scan: Option<&(Vec<Line>, Picker)>,
        index: u64,
    ) -> Sample {
        let mut rng = Rng::at(self.cloud.seed, Purpose::Position, index);
        let part = |index: u64, jitter: f64| (index as f64 + jitter) / self.cloud.points as f64;
        let mut tries = 0;
        loop {
            let (jitter, v) = (rng.uniform(), rng.uniform());
            let u = match &self.sweep {
                Sweep::Chance => jitter,
                Sweep::InOrder => part(index, jitter),
                Sweep::Shuffled(permutation) => part(permutation.apply(index), jitter),
            };
            let sample = match scan {
                Some((lines, picker)) => {
                    let (line, t) = picker.pick(u);
                    surface.on_line(&lines[line], t, v)
                }
                None => surface.at(u, v),
            };
            tries += 1;
            if !self.cloud.falloff || tries == FALLOFF_TRIES || self.seen(&sample, &mut rng) {
                return sample;
            }
        }
    }

    /// True if a point survives the falloff.
    fn seen(&self, sample: &Sample, rng: &mut Rng) -> bool {
        let near = self.near / length(sub(sample.position, self.scanner)).max(self.near);
        rng.uniform() < near * near
    }

    fn turn(&self, sample: Sample) -> Sample {
        // The box of a grid, and so its outliers, is already rotated.
        if !self.cloud.rotated || matches!(self.source, Source::Grid(_)) {
            return sample;
        }
        Sample {
            position: turned(sample.position),
            normal: turned(sample.normal),
        }
    }
}
