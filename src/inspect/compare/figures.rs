//! The result of a comparison.

use super::samples::Sample;
use super::shape::{Kind, Side};
use outcrop_disk::error::Result;
use outcrop_disk::spill::{Sorter, row};
use outcrop_disk::workspace::Workspace;
use outcrop_geom::vector::V3;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Directions: of the first side, of the second, of both.
const WAYS: usize = 3;

/// Percentiles, in thousandths.
const SHARES: [u64; 4] = [500, 900, 990, 999];

/// Distances over one set of samples, in the unit of the files or in per cent.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Figures {
    /// The maximum over all samples.
    pub max: f64,
    /// Mean. Here and below, vertices of a mesh with an area do not count.
    pub mean: f64,
    /// Root mean square.
    pub rms: f64,
    /// Median: the smallest distance that at least half of the samples do not exceed.
    pub p50: f64,
    /// 90th percentile, likewise.
    pub p90: f64,
    /// 99th percentile.
    pub p99: f64,
    /// 99.9th percentile.
    pub p99_9: f64,
}

/// Distances in one direction, or in both.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Distances {
    /// Places where the distance was taken.
    pub samples: u64,
    /// Samples among them that count only in `max`.
    pub vertex_samples: u64,
    /// Figures in the unit of the files.
    #[serde(flatten)]
    pub figures: Figures,
    /// A sample with the largest distance.
    pub max_at: [f64; 3],
    /// In per cent of the diagonal of the first side's box; absent if the diagonal is zero.
    pub percent: Option<Figures>,
}

/// Distances between two shapes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// The first side.
    pub a: Side,
    /// The second side.
    pub b: Side,
    /// Diagonal of the first side's box, the reference of `percent`.
    pub diagonal: f64,
    /// Largest number of samples of a side.
    pub most_samples: u64,
    /// Seed of the random choices.
    pub seed: u64,
    /// From samples of the first side to the second.
    pub a_to_b: Distances,
    /// From samples of the second side to the first.
    pub b_to_a: Distances,
    /// Both directions together; `max` is the sampled Hausdorff distance.
    pub symmetric: Distances,
}

/// Running sums of one direction.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sums {
    pub(super) samples: u64,
    pub(super) counted: u64,
    pub(super) sum: f64,
    pub(super) squares: f64,
    pub(super) max: f64,
    pub(super) max_at: Option<V3>,
}

impl Sums {
    pub(super) fn add(&mut self, sample: &Sample, distance: f64) {
        self.samples += 1;
        if sample.counts {
            self.counted += 1;
            self.sum += distance;
            self.squares += distance * distance;
        }
        if self.max_at.is_none() || distance > self.max {
            self.max = distance;
            self.max_at = Some(sample.position);
        }
    }

    /// Both directions together.
    pub(super) fn with(self, other: Self) -> Self {
        let far = if other.max > self.max { other } else { self };
        Self {
            samples: self.samples + other.samples,
            counted: self.counted + other.counted,
            sum: self.sum + other.sum,
            squares: self.squares + other.squares,
            max: far.max,
            max_at: far.max_at,
        }
    }
}

row! {
    /// A distance; rows sort by size.
    pub(super) struct DistanceRow {
        /// The bits of an `f64` that is not negative; the upper 32 first.
        bits: [u32; 2],
        /// 0 from the first side, 1 from the second.
        way: u32,
    }
    unpacked
}

impl DistanceRow {
    pub(super) fn new(distance: f64, way: usize) -> Self {
        let bits = distance.to_bits();
        Self {
            bits: [(bits >> 32) as u32, bits as u32],
            way: way as u32,
        }
    }

    fn distance(&self) -> f64 {
        let [high, low] = self.bits.map(u64::from);
        f64::from_bits(high << 32 | low)
    }
}

/// Finds percentiles by counting distances in ascending order.
#[derive(Debug, Clone, Copy, Default)]
struct Ranks {
    of: u64,
    seen: u64,
    found: [f64; SHARES.len()],
}

impl Ranks {
    fn see(&mut self, distance: f64) {
        self.seen += 1;
        for (share, found) in SHARES.iter().zip(&mut self.found) {
            let rank = u128::from(self.of) * u128::from(*share);
            if u128::from(self.seen) == rank.div_ceil(1000).max(1) {
                *found = distance;
            }
        }
    }
}

/// Exact percentiles of each direction and of both from the rows of `sorter`.
pub(super) fn percentiles(
    sorter: Sorter<DistanceRow>,
    sums: &[Sums; WAYS],
    workspace: &Workspace,
) -> Result<[[f64; SHARES.len()]; WAYS]> {
    let mut ranks = sums.map(|sums| Ranks {
        of: sums.counted,
        ..Ranks::default()
    });
    sorter.finish(workspace)?.for_each(|row| {
        let distance = row.distance();
        ranks[usize::from(row.way == 1)].see(distance);
        ranks[2].see(distance);
        Ok(())
    })?;
    Ok(ranks.map(|r| r.found))
}

impl Distances {
    pub(super) fn new(sums: &Sums, percentiles: [f64; SHARES.len()], diagonal: f64) -> Self {
        let [p50, p90, p99, p99_9] = percentiles;
        let counted = sums.counted.max(1) as f64;
        let figures = |unit: f64| Figures {
            max: sums.max * unit,
            mean: sums.sum / counted * unit,
            rms: (sums.squares / counted).sqrt() * unit,
            p50: p50 * unit,
            p90: p90 * unit,
            p99: p99 * unit,
            p99_9: p99_9 * unit,
        };
        Self {
            samples: sums.samples,
            vertex_samples: sums.samples - sums.counted,
            figures: figures(1.0),
            max_at: sums.max_at.unwrap_or_default(),
            percent: (diagonal > 0.0).then(|| figures(100.0 / diagonal)),
        }
    }
}

impl Figures {
    /// Names and values.
    #[must_use]
    pub fn named(&self) -> [(&'static str, f64); 7] {
        [
            ("maximum", self.max),
            ("mean", self.mean),
            ("RMS", self.rms),
            ("50 %", self.p50),
            ("90 %", self.p90),
            ("99 %", self.p99),
            ("99.9 %", self.p99_9),
        ]
    }
}

impl fmt::Display for Side {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: ", self.path.display())?;
        match self.kind {
            Kind::Mesh => write!(
                f,
                "mesh, {} triangles, {} vertices, area {}",
                self.triangles, self.points, self.area
            ),
            Kind::Cloud => write!(f, "cloud, {} distinct points", self.points),
        }
    }
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "A  {}\nB  {}", self.a, self.b)?;
        let ways = [&self.a_to_b, &self.b_to_a, &self.symmetric];
        writeln!(f, "{:<9}{:>28}{:>28}{:>28}", "", "A to B", "B to A", "both")?;
        write!(f, "{:<9}", "samples")?;
        for way in ways {
            write!(f, "{:>28}", way.samples)?;
        }
        write!(f, "\n{:<9}", "vertices")?;
        for way in ways {
            write!(f, "{:>28}", way.vertex_samples)?;
        }
        for (row, (name, _)) in self.symmetric.figures.named().into_iter().enumerate() {
            write!(f, "\n{name:<9}")?;
            for way in ways {
                let (_, value) = way.figures.named()[row];
                let percent = way.percent.map(|p| format!("{:.4} %", p.named()[row].1));
                write!(f, "{value:>15.6e}{:>13}", percent.unwrap_or_default())?;
            }
        }
        write!(
            f,
            "\nlengths in the files' unit, and in % of the diagonal of A's box, {}\n\
             vertices are samples that count in the maximum alone",
            self.diagonal
        )
    }
}
