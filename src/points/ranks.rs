//! The scanners of all files, in one order that does not depend on the order of files.

use super::columns::{NO_SCANNER, SCANNER};
use super::source::Source;
use super::stats::IngestStats;

/// The scanners of a cloud: distinct positions, ascending.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Ranks {
    /// The positions, in the input's unit.
    pub(super) positions: Vec<[f64; 3]>,
    /// For each source and each scanner of its file, the number of its position, from 1.
    numbers: Vec<Vec<u32>>,
}

fn compare(a: &[f64; 3], b: &[f64; 3]) -> std::cmp::Ordering {
    let axes = a.iter().zip(b).map(|(a, b)| a.total_cmp(b));
    axes.fold(std::cmp::Ordering::Equal, |order, next| order.then(next))
}

impl Ranks {
    pub(super) fn of(sources: &[Source], stats: &IngestStats) -> Self {
        let files = sources.iter().zip(&stats.files);
        // Zero has one sign.
        let read = |source: &Source| source.columns.iter().any(|c| c.name == SCANNER);
        let of_file = files.map(
            |(source, file)| match source.stats.kept > 0 && read(source) {
                false => Vec::new(),
                true => file.scanners.iter().map(|p| p.map(|x| x + 0.0)).collect(),
            },
        );
        Self::of_files(&of_file.collect::<Vec<_>>())
    }

    fn of_files(files: &[Vec<[f64; 3]>]) -> Self {
        let mut positions: Vec<[f64; 3]> = files.concat();
        positions.sort_unstable_by(compare);
        positions.dedup_by(|a, b| compare(a, b).is_eq());
        let number = |p: &[f64; 3]| 1 + positions.partition_point(|q| compare(q, p).is_lt()) as u32;
        let numbers = files.iter().map(|own| own.iter().map(number).collect());
        Self {
            numbers: numbers.collect(),
            positions,
        }
    }

    /// The number of a scanner of a source, from 1; 0 for one that is unknown.
    pub(super) fn number(&self, source: usize, scanner: f64) -> u32 {
        let of_source = self.numbers.get(source);
        let known = of_source.filter(|_| scanner < f64::from(NO_SCANNER));
        let number = known.and_then(|all| all.get(scanner as usize));
        number.copied().unwrap_or(0)
    }

    /// True if files give the scanners of a source.
    pub(super) fn has(&self, source: usize) -> bool {
        self.numbers.get(source).is_some_and(|own| !own.is_empty())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_have_numbers_whatever_the_order_of_files() {
        let (a, b, c) = ([1.0, 5.0, 0.0], [1.0, -5.0, 9.0], [-2.0, 0.0, 0.0]);
        let files = [vec![a, b], vec![], vec![c, a]];
        let ranks = Ranks::of_files(&files);
        assert_eq!(ranks.positions, [c, b, a]);
        let numbers = |source: usize| [0.0, 1.0, 2.0, 65535.0].map(|n| ranks.number(source, n));
        assert_eq!(numbers(0), [3, 2, 0, 0]);
        assert_eq!(numbers(1), [0; 4]);
        assert_eq!(numbers(2), [1, 3, 0, 0]);
        let turned: Vec<_> = files.into_iter().rev().collect();
        assert_eq!(Ranks::of_files(&turned).positions, ranks.positions);
    }
}
