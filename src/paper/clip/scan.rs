//! The corners that a bisector cuts off: a connected run.

use super::{Cell, Side};
use crate::kernels::eight::Eight;
use crate::kernels::{LANES, cut_body, cut_corners};

impl Cell {
    /// The connected run of corners that `side` cuts off, found by testing all corners.
    #[inline(always)]
    pub(super) fn scan<E: Eight>(&mut self, side: &Side) -> Option<(u32, u32)> {
        if self.corners.len() > 64 / LANES {
            return self.scan_words(side);
        }
        let (mut cut, doubt) = cut_body::<E>(&self.corners, &side.line);
        if cut | doubt == 0 {
            return None;
        }
        if doubt != 0 {
            (self.cut[0], self.doubt[0]) = (cut, doubt);
            self.settle_doubts(side);
            cut = self.cut[0];
        }
        if cut == 0 {
            return None;
        }
        let is_cut = |k: u32| cut >> (k % 64) & 1 == 1;
        let (first, last, count) = self.run(cut.trailing_zeros(), is_cut)?;
        if count == cut.count_ones() as usize {
            return Some((first, last));
        }
        self.cut[0] = cut;
        self.deepest_run(side)
    }

    /// As [`Cell::scan`], for more corners than a word has bits.
    pub(super) fn scan_words(&mut self, side: &Side) -> Option<(u32, u32)> {
        let (mut doubts, mut all) = (0, 0);
        let words = self.cut.iter_mut().zip(&mut self.doubt);
        for (corners, (cut, doubt)) in self.corners.chunks(64 / LANES).zip(words) {
            (*cut, *doubt) = cut_corners(self.level, corners, &side.line);
            doubts |= *doubt;
            all |= *cut | *doubt;
        }
        if all == 0 {
            return None;
        }
        if doubts != 0 {
            self.settle_doubts(side);
        }
        self.arc(side)
    }

    /// Decides the corners that floating point leaves in doubt.
    #[cold]
    fn settle_doubts(&mut self, side: &Side) {
        for word in 0..self.doubt.len() {
            let mut doubt = self.doubt[word];
            while doubt != 0 {
                let bit = doubt.trailing_zeros();
                doubt &= doubt - 1;
                let k = word * 64 + bit as usize;
                let cut = self.cuts(k, side).unwrap_or_else(|| {
                    self.unsure |= !self.is_certain(k, side);
                    self.depth(k, side) > 0.0
                });
                self.cut[word] |= u64::from(cut) << bit;
            }
        }
    }

    #[inline(always)]
    fn is_cut(&self, k: u32) -> bool {
        self.cut[k as usize / 64] >> (k % 64) & 1 == 1
    }

    /// The connected run of corners that is cut off, as its first and last; `None` if there is none.
    #[inline(always)]
    fn arc(&self, side: &Side) -> Option<(u32, u32)> {
        let total: usize = self.cut.iter().map(|w| w.count_ones() as usize).sum();
        let word = self.cut.iter().position(|w| *w != 0)?;
        let seed = (word * 64) as u32 + self.cut[word].trailing_zeros();
        let (first, last, count) = self.run(seed, |k| self.is_cut(k))?;
        if count == total {
            return Some((first, last));
        }
        self.deepest_run(side)
    }

    /// Of several runs, the one that contains the corner deepest beyond `side`.
    #[cold]
    fn deepest_run(&self, side: &Side) -> Option<(u32, u32)> {
        // A line cuts one run off a convex polygon. Rounding at rim corners can split it; the run of the
        // deepest corner is then taken.
        let mut deepest: Option<(f64, u32)> = None;
        for k in (0..self.places() as u32).filter(|k| self.is_cut(*k)) {
            let depth = self.depth(k as usize, side).max(f64::MIN_POSITIVE);
            if deepest.is_none_or(|(d, _)| depth > d) {
                deepest = Some((depth, k));
            }
        }
        let (first, last, _) = self.run(deepest?.1, |k| self.is_cut(k))?;
        Some((first, last))
    }

    /// The run of cut corners around `seed`: first, last, length. `None` if no corner would remain, which is
    /// impossible in exact arithmetic: the cell contains its own point.
    #[inline(always)]
    fn run(&self, seed: u32, is_cut: impl Fn(u32) -> bool) -> Option<(u32, u32, usize)> {
        let (mut first, mut last, mut count) = (seed, seed, 1);
        while count < self.count && is_cut(self.links[first as usize].before) {
            first = self.links[first as usize].before;
            count += 1;
        }
        while count < self.count && is_cut(self.links[last as usize].next) {
            last = self.links[last as usize].next;
            count += 1;
        }
        (count < self.count).then_some((first, last, count))
    }
}
