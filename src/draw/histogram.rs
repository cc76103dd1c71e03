//! Distributions of positive integers, such as squared lengths, in bins that widen with the value.
//!
//! All counts are integers, so they do not depend on the order in which values come.

use serde::{Deserialize, Serialize};

/// Bins for each power of two: a bin is at most an eighth of its lower end wide.
const PARTS: u64 = 8;

/// Number of bins for all values of 64 bits.
const BINS: usize = 496;

/// Counts of values.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Tally {
    counts: Vec<u64>,
    min: u64,
    max: u64,
}

impl Default for Tally {
    fn default() -> Self {
        Self {
            counts: vec![0; BINS],
            min: u64::MAX,
            max: 0,
        }
    }
}

/// The bin of a value; below eight each has its own.
#[inline]
fn bin(value: u64) -> usize {
    if value < PARTS {
        return value as usize;
    }
    let exponent = value.ilog2();
    let part = value >> (exponent - 3) & (PARTS - 1);
    (u64::from(exponent - 2) * PARTS + part) as usize
}

/// The smallest value of a bin.
fn low(bin: usize) -> f64 {
    let (octave, part) = (bin as u64 / PARTS, bin as u64 % PARTS);
    match octave {
        0 => part as f64,
        _ => (PARTS + part) as f64 * 2f64.powi(octave as i32 - 1),
    }
}

impl Tally {
    /// Counts a value.
    #[inline]
    pub fn add(&mut self, value: u64) {
        self.add_many(value, 1);
    }

    /// Counts a value that occurs `count` times.
    #[inline]
    pub fn add_many(&mut self, value: u64, count: u64) {
        self.counts[bin(value)] += count;
        self.min = self.min.min(value);
        self.max = self.max.max(value);
    }

    /// Adds other counts.
    pub fn merge(&mut self, other: &Self) {
        for (own, more) in self.counts.iter_mut().zip(&other.counts) {
            *own += more;
        }
        self.min = self.min.min(other.min);
        self.max = self.max.max(other.max);
    }

    /// Halves all counts, of values that were counted twice.
    pub fn halve(&mut self) {
        self.counts.iter_mut().for_each(|count| *count /= 2);
    }

    /// Number of values.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.counts.iter().sum()
    }

    /// The value below which a share of all lie, to within its bin.
    fn at(&self, share: f64) -> f64 {
        let wanted = share * self.total() as f64;
        let mut before = 0.0;
        for (number, count) in self.counts.iter().enumerate() {
            let count = *count as f64;
            if count > 0.0 && before + count >= wanted {
                let (from, to) = (low(number), low(number + 1));
                let found = from + (to - from) * ((wanted - before) / count).clamp(0.0, 1.0);
                return found.clamp(self.min as f64, self.max as f64);
            }
            before += count;
        }
        self.max as f64
    }

    /// The bins that have the values from the 0.1th to the 99.95th percentile.
    fn usual(&self) -> Option<(usize, usize)> {
        let total = self.total();
        let few = (total / 1000, total / 2000);
        let mut passed = 0;
        let first = self.counts.iter().position(|count| {
            passed += count;
            passed > few.0
        })?;
        passed = 0;
        let last = self.counts.iter().rposition(|count| {
            passed += count;
            passed > few.1
        })?;
        Some((first, last))
    }

    /// The distribution; `unit` turns a value into what is shown, and ascends. Bins are joined until at most
    /// `most` remain, or until each has a whole power of two. The first and the last take the few values beyond.
    #[must_use]
    pub fn histogram(&self, most: usize, unit: impl Fn(f64) -> f64) -> Option<Histogram> {
        let (first, last) = self.usual()?;
        let fits = |joined: &usize| last / joined - first / joined < most;
        let joined = [1, 2, 4, 8].into_iter().find(fits).unwrap_or(8);
        let ends = (first / joined..=last / joined + 1).map(|n| (n * joined).min(BINS));
        Some(self.of_ends(&ends.collect::<Vec<_>>(), unit))
    }

    /// The distribution by powers of two.
    #[must_use]
    pub fn by_octave(&self) -> Option<Histogram> {
        let first = self.counts.iter().position(|count| *count > 0)?;
        let last = self.counts.iter().rposition(|count| *count > 0)?;
        let all = [0, 1, 2, 4]
            .into_iter()
            .chain((1..=BINS / 8).map(|n| 8 * n));
        let all: Vec<usize> = all.collect();
        let from = all.partition_point(|end| *end <= first).saturating_sub(1);
        let to = all.partition_point(|end| *end <= last).min(all.len() - 1);
        Some(self.of_ends(&all[from..=to], |x| x))
    }

    fn of_ends(&self, ends: &[usize], unit: impl Fn(f64) -> f64) -> Histogram {
        let last = ends.len().saturating_sub(2);
        let value = |bin: usize| unit(low(bin));
        let bins = ends.windows(2).enumerate().map(|(number, two)| {
            let mut range = two[0]..two[1];
            let mut bin = Bin {
                from: value(range.start),
                to: value(range.end),
                count: 0,
            };
            if number == 0 {
                range.start = 0;
                bin.from = bin.from.min(unit(self.min as f64));
            }
            if number == last {
                range.end = BINS;
                bin.to = bin.to.max(unit(self.max as f64));
            }
            bin.count = self.counts[range].iter().sum();
            bin
        });
        Histogram {
            count: self.total(),
            min: unit(self.min as f64),
            p5: unit(self.at(0.05)),
            p50: unit(self.at(0.5)),
            p95: unit(self.at(0.95)),
            max: unit(self.max as f64),
            bins: bins.collect(),
        }
    }
}

/// A distribution.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Histogram {
    /// Number of values.
    pub count: u64,
    /// The smallest value.
    pub min: f64,
    /// 5th percentile, to within its bin, as are the next two.
    pub p5: f64,
    /// Median.
    pub p50: f64,
    /// 95th percentile.
    pub p95: f64,
    /// The largest value.
    pub max: f64,
    /// The bins, ascending, without gaps.
    pub bins: Vec<Bin>,
}

/// A bin of a distribution.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Bin {
    /// Its lower end, inclusive.
    pub from: f64,
    /// Its upper end, exclusive.
    pub to: f64,
    /// Number of values in it.
    pub count: u64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_have_no_gaps() {
        assert_eq!(bin(u64::MAX), BINS - 1);
        for number in 0..BINS - 1 {
            let from = low(number) as u64;
            assert_eq!(bin(from), number);
            let next = low(number + 1) as u64;
            assert!(next > from && bin(next - 1) == number);
        }
    }

    #[test]
    fn a_distribution_keeps_its_counts() {
        let mut tally = Tally::default();
        (1..=1000).for_each(|value| tally.add(value));
        let mut twice = tally.clone();
        twice.merge(&tally);
        twice.halve();
        assert_eq!(twice, tally);
        let all = tally.histogram(1000, |x| x).unwrap();
        assert_eq!((all.count, all.min, all.max), (1000, 1.0, 1000.0));
        assert!((all.p50 - 500.0).abs() < 10.0 && (all.p95 - 950.0).abs() < 10.0);
        let sizes = tally.by_octave().unwrap();
        let ends: Vec<_> = sizes.bins.iter().map(|bin| (bin.from, bin.count)).collect();
        assert_eq!(ends[..4], [(1.0, 1), (2.0, 2), (4.0, 4), (8.0, 8)]);
        assert_eq!(sizes.bins.iter().map(|bin| bin.count).sum::<u64>(), 1000);
        let few = tally.histogram(12, f64::sqrt).unwrap();
        assert!(few.bins.len() <= 12);
        assert_eq!(few.bins.iter().map(|bin| bin.count).sum::<u64>(), 1000);
        assert!(few.bins.windows(2).all(|two| two[0].to == two[1].from));
        assert_eq!(Tally::default().histogram(10, |x| x), None);
        assert_eq!(Tally::default().by_octave(), None);
        // Few enough to be beyond the usual ones.
        let mut far = tally.clone();
        far.merge(&tally);
        far.merge(&tally);
        far.add(u64::MAX);
        far.add(0);
        let far = far.histogram(20, |x| x).unwrap();
        assert!(far.bins.len() <= 20 && far.bins[0].from == 0.0);
        assert_eq!(far.bins.iter().map(|bin| bin.count).sum::<u64>(), 3002);
        assert_eq!(far.bins[far.bins.len() - 1].to, u64::MAX as f64);
    }
}
