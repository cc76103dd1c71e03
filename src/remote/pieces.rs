//! Ranges of a file, joined and cut to the pieces that are fetched.

use std::ops::Range;

/// Most bytes of a piece: at 100 MB/s a request of it takes 40 ms, of which 10 are spent waiting.
pub(crate) const PIECE: u64 = 4 << 20;

/// Ranges with a smaller gap between them are one request.
pub const GAP: u64 = 16 << 10;

/// Bytes that are fetched with one request.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Piece {
    pub(crate) range: Range<u64>,
    /// The parts of it that were asked for and that no reader has taken yet: sorted, with gaps between them.
    wanted: Vec<Range<u64>>,
}

impl Piece {
    /// A piece of which all is wanted.
    pub(crate) fn whole(range: Range<u64>) -> Self {
        Self {
            wanted: vec![range.clone()],
            range,
        }
    }

    pub(crate) fn bytes(&self) -> u64 {
        self.range.end - self.range.start
    }

    /// Adds a range that does not begin before those it has.
    fn join(&mut self, range: &Range<u64>) {
        self.range.end = self.range.end.max(range.end);
        let start = range.start.max(self.range.start);
        match self.wanted.last_mut() {
            Some(last) if start <= last.end => last.end = last.end.max(range.end),
            _ => self.wanted.push(start..range.end),
        }
    }

    /// Notes that a reader took these bytes.
    pub(crate) fn take(&mut self, taken: &Range<u64>) {
        let around = |part: &Range<u64>| {
            let before = part.start..part.end.min(taken.start);
            let behind = part.start.max(taken.end)..part.end;
            [before, behind].into_iter().filter(|rest| !rest.is_empty())
        };
        self.wanted = self.wanted.iter().flat_map(around).collect();
    }

    /// True if readers took all that was wanted.
    pub(crate) fn is_taken(&self) -> bool {
        self.wanted.is_empty()
    }
}

/// Pieces sorted by place, and their numbers in the order in which they are read first.
pub(crate) fn pieces(ranges: impl IntoIterator<Item = Range<u64>>) -> (Vec<Piece>, Vec<usize>) {
    let mut given: Vec<(Range<u64>, usize)> = ranges
        .into_iter()
        .filter(|range| !range.is_empty())
        .zip(0..)
        .collect();
    given.sort_by_key(|(range, _)| (range.start, range.end));
    let mut joined: Vec<(Piece, usize)> = Vec::new();
    for (range, turn) in given {
        match joined.last_mut() {
            // Whole ranges come into one piece, so that a reader of one waits for one request.
            Some((last, first))
                if range.start <= last.range.end + GAP
                    && range.end.saturating_sub(last.range.start) <= PIECE =>
            {
                last.join(&range);
                *first = turn.min(*first);
            }
            last => {
                let end = last.map_or(0, |(last, _)| last.range.end);
                let cuts = (range.start.max(end)..range.end).step_by(PIECE as usize);
                joined.extend(cuts.map(|at| (Piece::whole(at..range.end.min(at + PIECE)), turn)));
            }
        }
    }
    let mut order: Vec<usize> = (0..joined.len()).collect();
    order.sort_by_key(|&piece| joined[piece].1);
    (joined.into_iter().map(|(piece, _)| piece).collect(), order)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ranges(all: &[Piece]) -> Vec<Range<u64>> {
        all.iter().map(|piece| piece.range.clone()).collect()
    }

    #[test]
    fn near_ranges_are_joined_and_long_ones_cut() {
        let (all, order) = pieces([10..20, 30..40, 1 << 20..(1 << 20) + 5]);
        assert_eq!(ranges(&all), [10..40, 1 << 20..(1 << 20) + 5]);
        assert_eq!(order, [0, 1]);
        let long = 3..3 + 2 * PIECE + 1;
        let (all, _) = pieces([long.clone()]);
        let all = ranges(&all);
        assert_eq!(all.len(), 3);
        assert_eq!((all[0].start, all[2].end), (long.start, long.end));
        assert!(all.windows(2).all(|w| w[0].end == w[1].start));
    }

    #[test]
    fn the_order_is_that_of_reading_and_nothing_is_fetched_twice() {
        let far = 100 << 20;
        let (all, order) = pieces([far..far + 10, 0..10, 5..12, 3..3]);
        assert_eq!(ranges(&all), [0..12, far..far + 10]);
        assert_eq!(order, [1, 0]);
    }

    #[test]
    fn a_range_inside_an_earlier_piece_of_a_long_one_adds_nothing() {
        let long = 0..2 * PIECE + 5;
        let alone = pieces([long.clone()]).0;
        assert_eq!(pieces([long, 1..6]).0, alone);
    }

    #[test]
    fn what_is_between_ranges_is_not_wanted() {
        let (mut all, _) = pieces([10..20, 15..22, 22..25, 30..40]);
        let piece = &mut all[0];
        assert_eq!(piece.wanted, [10..25, 30..40]);
        for taken in [12..32, 12..32, 0..11] {
            piece.take(&taken);
        }
        assert_eq!(piece.wanted, [11..12, 32..40]);
        piece.take(&(5..50));
        assert!(piece.is_taken());
    }
}
